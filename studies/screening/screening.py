"""What does screening by stability save the genetic algorithm? Searches in pairs, with and without.

    >>> result = run(ScreeningConfig(quick=True))
    >>> result.rows[0]["simulations_to_target"], result.target

Equal seeds, settings and numbers of generations; the searches differ only in what the first
population and the fresh quarters are drawn from. None stops early, so that they can be compared at
equal numbers of simulations. The equal result is the median, over seeds, of the best index that
the plain searches end with. Seconds include the screening; they are of this machine.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array
from studies.core.carry_out import carried_out
from studies.core.folder import to_json, write_config, write_rows
from studies.core.options import RobotOptions
from studies.screening.report import screening_figure, screening_table, verdict
from studies.tuning.genetic import Generation, GeneticSettings, Search
from studies.tuning.problem import Tuning, distribution_for, problem_of, tune
from studies.tuning.screened_draws import Screened, Tally, screened

QUICK_SEEDS, QUICK_POPULATION, QUICK_GENERATIONS = 2, 16, 4


@dataclass(frozen=True)
class ScreeningConfig(RobotOptions):
    """Compare the genetic algorithm with and without screened draws, seed by seed."""

    trajectory: str = "circle"
    """line, two-loop or circle."""
    plant: str = "assumed-modes"
    """both, or a plant's name as in flexsim tune."""
    setting: str = "print"
    """none, print, joint or reconstructed."""
    distribution: str = "table-1"
    """table-1, log-uniform or a TOML file, as in flexsim tune."""
    screen: int = 200
    """Candidates at most per individual drawn."""
    seeds: int = 5
    """Pairs of searches."""
    seed: int = 1
    """The first of the seeds."""
    population: int = 50
    """Individuals per generation."""
    generations: int = 40
    """Generations of every search, the first included."""
    quick: bool = False
    """Two small pairs only."""
    threads: int | None = None
    """Threads; all cores unless given. Only the seconds depend on it."""
    out: Path = Path("runs/screening")
    """Folder of the run, made anew."""
    force: bool = False
    """Replace the run that is there."""
    json: bool = False
    """Print one JSON object instead of the table."""

    def tuning(self, seed: int, screen: int) -> Tuning:
        """Return one search of the study, which never stops early."""
        quick = self.quick
        generations = min(self.generations, QUICK_GENERATIONS) if quick else self.generations
        return Tuning(
            trajectory=self.trajectory,
            plant=self.plant,
            setting=self.setting,
            distribution=self.distribution,
            population=min(self.population, QUICK_POPULATION) if quick else self.population,
            generations=generations,
            patience=max(1, generations),
            screen=screen,
            seed=seed,
            **self.tuned,
        )


@dataclass(frozen=True, eq=False)
class Course:
    """A search, and what it took.

    Attributes:
        seed, screen: as in `Tuning`. search: as named.
        simulations: (G,) until the end of each generation. best: (G,) index so far [m2 s].
        seconds: (G,) wall time since the start. tally: of the screening.
    """

    seed: int
    screen: int
    search: Search
    simulations: Array
    best: Array
    seconds: Array
    tally: Tally

    def reached(self, target: float) -> int | None:
        """Return the first generation as good as the target, None if there is none."""
        good = np.flatnonzero(self.best <= target)
        return int(good[0]) if len(good) else None


@dataclass(frozen=True, eq=False)
class ScreeningResult:
    """Rows as written, searches, and the index that counts as the equal result [m2 s]."""

    rows: list[dict[str, Any]]
    courses: list[Course]
    target: float


def course(tuning: Tuning, threads: int | None, advance: Callable[[], None]) -> Course:
    """Return one search with its wall time, generation by generation."""
    problem = problem_of(tuning, threads)
    draws = screened(tuning, distribution_for(tuning), problem)
    stamps: list[float] = []

    def stamp(_: Generation) -> None:
        stamps.append(time.perf_counter())
        advance()

    start = time.perf_counter()
    search = tune(problem, draws, tuning.genetic, tuning.seed, on_generation=stamp)
    per_evaluation = len(problem.scenarios)
    return Course(
        tuning.seed,
        tuning.screen,
        search,
        per_evaluation * np.cumsum([float(each.evaluated) for each in search.generations]),
        np.minimum.accumulate([each.indices.min() for each in search.generations]),
        np.array(stamps) - start,
        draws.tally if isinstance(draws, Screened) else Tally(),
    )


def warm_up(config: ScreeningConfig) -> None:
    """Compile the loop, so that the first search's time is not that."""
    tuning = config.tuning(config.seed, 0)
    problem_of(tuning, config.threads)(distribution_for(tuning).sample(np.random.default_rng(0), 2))


def row(each: Course, target: float) -> dict[str, Any]:
    """Return one line of the table.

    Returns:
        seed; screen; stable_first, share of the first generation that holds; simulations and
        seconds until the target was reached, None if never; best_index of the whole search
        [m2 s], inf if nothing holds; candidates screened; seconds in all, and of screening.
    """
    at = each.reached(target)
    return {
        "seed": each.seed,
        "screen": each.screen,
        "stable_first": each.search.generations[0].stable_share,
        "simulations_to_target": None if at is None else int(each.simulations[at]),
        "seconds_to_target": None if at is None else float(each.seconds[at]),
        "simulations": int(each.simulations[-1]),
        "best_index": float(each.best[-1]),
        "candidates": each.tally.candidates,
        "seconds": float(each.seconds[-1]),
        "seconds_screening": each.tally.seconds,
    }


def run(config: ScreeningConfig, progress: Progress | None = None) -> ScreeningResult:
    """Return the searches, plain and screened.

    Raises:
        ParameterError: an option out of range.
    """
    if config.seeds < 1:
        raise ParameterError(f"seeds is {config.seeds}; give 1 or more")
    if config.screen < 2:
        raise ParameterError(f"screen is {config.screen}; give 2 or more candidates")
    count = min(config.seeds, QUICK_SEEDS) if config.quick else config.seeds
    seeds = range(config.seed, config.seed + count)
    pairs = [config.tuning(seed, screen) for seed in seeds for screen in (0, config.screen)]
    settings: GeneticSettings = pairs[0].genetic
    total = len(pairs) * settings.generations
    bar = progress.add_task("searches", total=total) if progress else None

    def advance() -> None:
        if progress and bar is not None:
            progress.advance(bar)

    warm_up(config)
    courses = [course(each, config.threads, advance) for each in pairs]
    target = float(np.median([each.best[-1] for each in courses if not each.screen]))
    return ScreeningResult([row(each, target) for each in courses], courses, target)


def curves(courses: list[Course]) -> list[dict[str, Any]]:
    """Return a row per search and generation: what the figure shows."""
    return [
        {
            "seed": each.seed,
            "screen": each.screen,
            "generation": i,
            "simulations": int(each.simulations[i]),
            "best": float(each.best[i]),
            "seconds": float(each.seconds[i]),
        }
        for each in courses
        for i in range(len(each.best))
    ]


def write(folder: Path, config: ScreeningConfig, result: ScreeningResult) -> None:
    """Write configuration, tables and figure into a folder."""
    write_config(folder, config, target=result.target)
    write_rows(folder / "results.csv", result.rows)
    rows = curves(result.courses)
    write_rows(folder / "convergence.csv", rows)
    (folder / "figures").mkdir()
    title = f"{config.trajectory}, {config.plant}, setting {config.setting}"
    screening_figure(rows, result.target, title, folder / "figures" / "screening.png")


def command(config: ScreeningConfig) -> None:
    """Run the study and write its folder."""
    result = carried_out(config, run, write)
    if config.json:
        print(to_json({"rows": result.rows, "target": result.target, "run": str(config.out)}))
        return
    out = Console(highlight=False)
    out.print(screening_table(result.rows))
    if math.isfinite(result.target):
        out.print(
            f"Target: {1e4 * result.target:.4g}e-4 m2 s, median of what the plain searches end "
            "with: simulations and seconds until it is reached, - if never. Best index after the "
            "whole search [1e-4 m2 s]",
            soft_wrap=True,
        )
    out.print(verdict(result.rows), soft_wrap=True)
    out.print(f"{config.out}: results.csv, convergence.csv, figures/", soft_wrap=True)
