"""Why does the paper find no stable integer PID: the order, the realisation, the search range?

    >>> result = run(PidQuestionConfig(quick=True))
    >>> result.rows[0]["order"], result.rows[0]["stable_draws"], result.rows[0]["best_index"]

Section 3.2's algorithm with one thing changed at a time, several seeds each. Order: the fractional
controllers (3) and (4), or integer PIDs. Realisation: (2) cut after p terms, or a textbook digital
PID, a true integrator and a backward difference; this has no meaning for fractional orders, so the
two are not combined. Range: Table 1's distributions, or gains drawn evenly in their logarithms.
The first populations say how rare stable controllers are, the searches whether they are found.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from flexsim.errors import ParameterError
from flexsim.loop.runs import thread_count
from studies.core.carry_out import carried_out
from studies.core.folder import to_json, write_config, write_rows
from studies.core.options import RobotOptions
from studies.pid_question.report import question_figure, table, verdict
from studies.tuning.distributions import DISTRIBUTIONS, NAMES, Distribution
from studies.tuning.genetic import INITIAL, Evaluate, Generation, Search, generation_rng
from studies.tuning.problem import SEED_MOST, Tuning, distribution_for, problem_of, tune

STRUCTURES = {  # (order, realisation): controller and realisation of `Tuning`
    ("fractional", "truncated"): ("fractional", "tustin"),
    ("integer", "truncated"): ("pid", "tustin"),
    ("integer", "textbook"): ("pid", "textbook"),
}
PLANTS = ("assumed-modes", "chain")
QUICK_SEEDS, QUICK_POPULATION, QUICK_GENERATIONS = 2, 16, 3


@dataclass(frozen=True)
class PidQuestionConfig(RobotOptions):
    """Settle what the integer PIDs fail of: their order, realisation or search range."""

    out: Path = Path("runs/pid-question")
    """Folder of the run, made anew."""
    force: bool = False
    """Replace the run that is there."""
    quick: bool = False
    """The first plant and setting only, two seeds, 16 individuals, three generations at most."""
    plants: tuple[str, ...] = PLANTS
    """assumed-modes, chain."""
    settings: tuple[str, ...] = ("print", "joint")
    """Friction, limits and motors: none, print, joint, reconstructed."""
    trajectory: str = "circle"
    """line, two-loop or circle."""
    seeds: int = 10
    """Searches of each kind."""
    seed: int = 1
    """Seed of the first search; the others follow."""
    population: int = 50
    """Individuals per generation."""
    generations: int = 100
    """Generations at most, the first included; ten without improvement end a search."""
    chain_generations: int = 5
    """The same on the chain, which is twenty times slower."""
    terms: int = 10
    """p in (2), length of each operator."""
    modes: int = 3
    """Assumed modes, n."""
    segments: int | None = None
    """Segments of the chain; 6 unless given."""
    threads: int | None = None
    """Threads; all cores unless given. Results do not depend on it."""
    json: bool = False
    """Print one JSON object instead of the table."""

    def asked(self) -> PidQuestionConfig:
        """Return what is run: this, or a small part of it if `quick`."""
        if not self.quick:
            return self
        return dataclasses.replace(
            self,
            plants=self.plants[:1],
            settings=self.settings[:1],
            seeds=min(self.seeds, QUICK_SEEDS),
            population=min(self.population, QUICK_POPULATION),
            generations=min(self.generations, QUICK_GENERATIONS),
            chain_generations=min(self.chain_generations, QUICK_GENERATIONS),
        )


@dataclass(frozen=True)
class Case:
    """One row's names, as the table has them, and the tuning they stand for."""

    order: str
    realisation: str
    range: str
    plant: str
    setting: str
    tuning: Tuning

    @property
    def names(self) -> dict[str, str]:
        """The names alone."""
        keys = ("order", "realisation", "range", "plant", "setting")
        return {key: getattr(self, key) for key in keys}


@dataclass(frozen=True, eq=False)
class PidQuestionResult:
    """A row per case, and one per search, its best parameters in Table 1's units."""

    rows: list[dict[str, Any]]
    searches: list[dict[str, Any]]


def cases(config: PidQuestionConfig) -> list[Case]:
    """Return everything that is searched, rows that belong together side by side.

    Raises:
        ParameterError: an unknown name, a number out of range, an empty or repeating list.
    """
    for label, given in (("plants", config.plants), ("settings", config.settings)):
        if not given or len(set(given)) != len(given):
            raise ParameterError(f"{label} are {' '.join(given) or 'empty'}; name each once")
    for plant in config.plants:
        if plant not in PLANTS:
            raise ParameterError(f"plant {plant!r} is unknown; choose from {', '.join(PLANTS)}")
    if config.seeds < 1:
        raise ParameterError(f"seeds is {config.seeds}; give 1 or more")
    if config.chain_generations < 1:
        raise ParameterError(f"chain generations is {config.chain_generations}; give 1 or more")
    if not 0 <= config.seed <= SEED_MOST - config.seeds + 1:
        raise ParameterError(f"seed is {config.seed}; give 0 to {SEED_MOST - config.seeds + 1}")
    if config.threads is not None and not 1 <= config.threads <= thread_count():
        raise ParameterError(f"threads is {config.threads}; give 1 to {thread_count()}")
    return [
        Case(*names, drawn, plant, reading, _tuning(config, structure, drawn, plant, reading))
        for plant in config.plants
        for reading in config.settings
        for names, structure in STRUCTURES.items()
        for drawn in DISTRIBUTIONS
    ]


def _tuning(
    config: PidQuestionConfig, structure: tuple[str, str], drawn: str, plant: str, reading: str
) -> Tuning:
    controller, realisation = structure
    return Tuning(
        trajectory=config.trajectory,
        plant=plant,
        controller=controller,
        realisation=realisation,
        setting=reading,
        distribution=drawn,
        terms=config.terms,
        population=config.population,
        generations=config.chain_generations if plant == "chain" else config.generations,
        seed=config.seed,
        modes=config.modes,
        segments=config.segments,
        **config.tuned,
    )


def first_generations(
    evaluate_all: Evaluate, draws: Distribution, size: int, seeds: Sequence[int]
) -> list[Generation]:
    """Return the first generation of every seed, as `genetic.first_generation`, from one call."""
    populations = [draws.sample(generation_rng(seed, 0), size) for seed in seeds]
    scores = evaluate_all(np.vstack(populations))
    parts = (np.split(each, len(seeds)) for each in scores)
    return [
        Generation(0, population, (INITIAL,) * size, indices, diverged)
        for population, indices, diverged in zip(populations, *parts, strict=True)
    ]


def search_row(case: Case, seed: int, search: Search) -> dict[str, Any]:
    """Return what became of one search; best index and parameters None if nothing held."""
    best = search.best_parameters
    found = dict.fromkeys(NAMES) if best is None else dict(zip(NAMES, best.tolist(), strict=True))
    return {
        **case.names,
        "seed": seed,
        "stable_draws": search.generations[0].stable_share,
        "best_index": None if best is None else search.best_index,
        "generations": len(search.generations),
        "evaluations": search.evaluations,
        **found,
    }


def summary(case: Case, searches: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return a case's row: shares of all draws and of all searches, best index [m2 s].

    The median, least and most of the best index are those of the searches that found anything
    stable; None if none did. Evaluations and generations are of all searches, the most a search
    may have being `generations_most`.
    """
    best = [each["best_index"] for each in searches if each["best_index"] is not None]
    return {
        **case.names,
        "seeds": len(searches),
        "stable_draws": float(np.mean([each["stable_draws"] for each in searches])),
        "stable_runs": len(best) / len(searches),
        "best_index": float(np.median(best)) if best else None,
        "best_index_least": min(best, default=None),
        "best_index_most": max(best, default=None),
        "draws": len(searches) * case.tuning.population,
        "evaluations": sum(each["evaluations"] for each in searches),
        "generations_most": case.tuning.generations,
    }


def searched(
    case: Case, seeds: Sequence[int], threads: int | None, done: Callable[[], None]
) -> Iterator[dict[str, Any]]:
    """Give the row of every seed's search; `done` is called after each."""
    tuning = case.tuning
    problem, draws = problem_of(tuning, threads), distribution_for(tuning)
    firsts = first_generations(problem, draws, tuning.population, seeds)
    for seed, first in zip(seeds, firsts, strict=True):
        search = tune(problem, draws, tuning.genetic, seed, resume_from=(first,))
        done()
        yield search_row(case, seed, search)


def run(config: PidQuestionConfig, progress: Progress | None = None) -> PidQuestionResult:
    """Return how rare stable controllers are, and how good the found ones, in every case.

    Raises:
        ParameterError, ModelError: an unknown name, or a number out of range.
    """
    config = config.asked()
    result = PidQuestionResult([], [])
    chosen = cases(config)
    for tuning in {(each.plant, each.setting): each.tuning for each in chosen}.values():
        problem_of(tuning, config.threads)  # refuses now, not after an hour, what cannot be run
    seeds = range(config.seed, config.seed + config.seeds)
    bar = progress.add_task("searches", total=len(chosen) * len(seeds)) if progress else None

    def done() -> None:
        if progress is not None and bar is not None:
            progress.advance(bar)

    for case in chosen:
        mine = list(searched(case, seeds, config.threads, done))
        result.rows.append(summary(case, mine))
        result.searches.extend(mine)
    return result


def write(folder: Path, config: PidQuestionConfig, result: PidQuestionResult) -> None:
    """Write configuration, tables and figure into a folder."""
    write_config(folder, config, ran=dataclasses.asdict(config.asked()))
    write_rows(folder / "results.csv", result.rows)
    write_rows(folder / "searches.csv", result.searches)
    (folder / "figures").mkdir()
    question_figure(result.rows, config.trajectory, folder / "figures" / "pid_question.png")


def command(config: PidQuestionConfig) -> None:
    """Run the study and write its folder."""
    result = carried_out(config, run, write)
    if config.json:
        print(to_json({"rows": result.rows, "searches": result.searches, "run": str(config.out)}))
        return
    out = Console(highlight=False)
    out.print(table(result.rows))
    out.print(
        f"{verdict(result.rows)}\n{config.out}: results.csv, searches.csv, figures/",
        soft_wrap=True,
    )
