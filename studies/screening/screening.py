"""What does screening by stability save the genetic algorithm? Searches in pairs, with and without.

    >>> result = run(ScreeningConfig(quick=True))
    >>> result.rows[0]["simulations_to_target"], result.target

Equal seeds, settings and numbers of generations; the searches differ only in what the first
population and the fresh quarters are drawn from. None stops early, so that they can be compared at
equal numbers of simulations. The equal result is the median, over seeds, of the best index that
the plain searches end with. Seconds include the screening; they are of this machine.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from rich.progress import Progress

from flexsim.errors import ParameterError
from flexsim.loop.settings import DEFAULT_SETTING
from flexsim.numerics.types import Array
from studies.core.carry_out import Study, ticker
from studies.core.evidence.intervals import share_of
from studies.core.study_options import (
    Out,
    Population,
    SeedOptions,
    SettingName,
    StudyOptions,
    ThreadOptions,
)
from studies.screening import report
from studies.tuning.genetic import Generation, Search
from studies.tuning.problem import distribution_for, problem_of, tune
from studies.tuning.screened_draws import Screened, Tally, screened
from studies.tuning.tuning import Tuning


@dataclass(frozen=True)
class ScreeningConfig(ThreadOptions, SeedOptions, StudyOptions):
    """Compare the genetic algorithm with and without screened draws, seed by seed."""

    QUICK: ClassVar = {"seeds": 2, "population": 16, "generations": 4}

    out: Out = Path("runs/screening")
    quick: bool = False
    """Two small pairs only."""
    trajectory: str = "circle"
    """line, two-loop or circle."""
    plant: str = "assumed-modes"
    """both, or a plant's name as in flexsim tune."""
    setting: SettingName = DEFAULT_SETTING
    distribution: str = "table-1"
    """table-1, log-uniform or a TOML file, as in flexsim tune."""
    screen: int = 200
    """Candidates at most per individual drawn."""
    seeds: int = 10
    """Pairs of searches."""
    population: Population = 50
    generations: int = 40
    """Generations of every search, the first included."""

    def tuning(self, seed: int, screen: int) -> Tuning:
        """Return one search of the study, which never stops early."""
        return Tuning(
            trajectory=self.trajectory,
            plant=self.plant,
            setting=self.setting,
            distribution=self.distribution,
            population=self.population,
            generations=self.generations,
            patience=max(1, self.generations),
            screen=screen,
            seed=seed,
            **self.for_tuning,
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


def row(each: Course, target: float) -> report.SearchRow:
    """Return one search's row; target: index that counts as the equal result [m2 s]."""
    at = each.reached(target)
    return report.SearchRow(
        seed=each.seed,
        screen=each.screen,
        **share_of("stable_first", np.isfinite(each.search.generations[0].indices)),
        simulations_to_target=None if at is None else int(each.simulations[at]),
        seconds_to_target=None if at is None else float(each.seconds[at]),
        simulations=int(each.simulations[-1]),
        best_index=float(each.best[-1]),
        candidates=each.tally.candidates,
        seconds=float(each.seconds[-1]),
        seconds_screening=each.tally.seconds,
    )


def curve(each: Course) -> list[report.CurveRow]:
    """Return a search's rows generation by generation: what the figure shows."""
    columns = zip(each.simulations, each.best, each.seconds, strict=True)
    return [
        report.CurveRow(each.seed, each.screen, i, int(simulations), float(best), float(seconds))
        for i, (simulations, best, seconds) in enumerate(columns)
    ]


def run(config: ScreeningConfig, progress: Progress | None = None) -> report.ScreeningResult:
    """Return the searches, plain and screened.

    Raises:
        ParameterError: an option out of range.
    """
    config = config.asked()
    if config.screen < 2:
        raise ParameterError(f"screen is {config.screen}; give 2 or more candidates")
    seeds = range(config.seed, config.seed + config.seeds)
    pairs = [config.tuning(seed, screen) for seed in seeds for screen in (0, config.screen)]
    advance = ticker(progress, "searches", len(pairs) * config.generations)
    warm_up(config)
    courses = [course(each, config.threads, advance) for each in pairs]
    target = float(np.median([each.best[-1] for each in courses if not each.screen]))
    return report.ScreeningResult(
        [row(each, target) for each in courses],
        [point for each in courses for point in curve(each)],
        f"{config.trajectory}, {config.plant}, setting {config.setting}",
        target,
        config.seed,
    )


command = Study(
    run,
    report.tables,
    report.verdict,
    report.figures,
    report.facts,
    question="What does screening by stability save the genetic algorithm?",
)
