"""Why does the paper find no stable integer PID: the order, the realisation, the search range?

    >>> result = run(PidQuestionConfig(quick=True))
    >>> result.rows[0]["order"], result.rows[0]["stable_draws"], result.rows[0]["best_index"]

Section 3.2's algorithm with one thing changed at a time, several seeds each. Order: the fractional
controllers (3) and (4), or integer PIDs. Realisation: (2) cut after p terms, or a textbook digital
PID, a true integrator and a backward difference; this has no meaning for fractional orders, so the
two are not combined. Range: Table 1's distributions, or gains drawn evenly in their logarithms.
The first populations say how rare stable controllers are, the searches whether they are found.
Bounded is what stays so in simulation, stable what does not grow on the exact linear loop either.
The searches, being the paper's, know of the first only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.progress import Progress

from flexsim.errors import ParameterError
from studies.core.carry_out import Study, ticker
from studies.core.evidence import repeats
from studies.core.evidence.intervals import share_of
from studies.core.paper import PLANTS
from studies.core.study_options import LoopOptions, Out, Population
from studies.pid_question import report
from studies.tuning.distributions import NAMES, Distribution
from studies.tuning.genetic import INITIAL, Evaluate, Generation, Search, generation_rng
from studies.tuning.problem import Problem, distribution_for, problem_of, tune
from studies.tuning.tuning import SEED_MOST, Tuning

DESIGNS = {  # (order, realisation): controller and realisation of `Tuning`
    ("fractional", "truncated"): ("fractional", "tustin"),
    ("integer", "truncated"): ("pid", "tustin"),
    ("integer", "textbook"): ("pid", "textbook"),
}
RANGES = ("table-1", "log-uniform")  # both can have their orders forced to a PID's


@dataclass(frozen=True)
class PidQuestionConfig(LoopOptions):
    """Settle what the integer PIDs fail of: their order, realisation or search range."""

    QUICK: ClassVar = {
        **{"plants": 1, "settings": 1, "seeds": 2, "population": 16},
        **{"generations": 3, "chain_generations": 3},
    }

    out: Out = Path("runs/pid-question")
    quick: bool = False
    """The first plant and setting only, two seeds, 16 individuals, three generations at most."""
    plants: tuple[str, ...] = PLANTS
    """assumed-modes, chain."""
    settings: tuple[str, ...] = ("simulink", "opposing")
    """Friction, limits and motors: none, simulink, jump, opposing, reconstructed."""
    trajectory: str = "circle"
    """line, two-loop or circle."""
    seeds: int = 10
    """Searches of each kind."""
    population: Population = 50
    generations: int = 100
    """Generations at most, the first included; ten without improvement end a search."""
    chain_generations: int = 5
    """The same on the chain, which takes five times as long."""
    terms: int = 10
    """p in (2), length of each operator."""


@dataclass(frozen=True)
class Case:
    """One row's names, as the table has them, and the tuning they stand for."""

    names: report.Names
    tuning: Tuning


def cases(config: PidQuestionConfig) -> list[Case]:
    """Return everything that is searched, rows that belong together side by side.

    Raises:
        ParameterError: an unknown name, or a number out of range.
    """
    for plant in config.plants:
        if plant not in PLANTS:
            raise ParameterError(f"plant {plant!r} is unknown; choose from {', '.join(PLANTS)}")
    if config.seed > SEED_MOST - config.seeds + 1:
        raise ParameterError(f"seed is {config.seed}; give 0 to {SEED_MOST - config.seeds + 1}")
    return [
        Case(
            report.Names(*names, drawn, plant, reading),
            _tuning(config, design, drawn, plant, reading),
        )
        for plant in config.plants
        for reading in config.settings
        for names, design in DESIGNS.items()
        for drawn in RANGES
    ]


def _tuning(
    config: PidQuestionConfig, design: tuple[str, str], drawn: str, plant: str, reading: str
) -> Tuning:
    controller, realisation = design
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
        **config.for_tuning,
    )


def first_generations(
    evaluate_all: Evaluate, draws: Distribution, size: int, seeds: Sequence[int]
) -> list[Generation]:
    """Return the first generation of every seed, as `genetic.first_generation`, from one call."""
    populations = [draws.sample(generation_rng(seed, 0), size) for seed in seeds]
    parts = (np.split(each, len(seeds)) for each in evaluate_all(np.vstack(populations)))
    return [
        Generation(0, population, (INITIAL,) * size, *scores)
        for population, *scores in zip(populations, *parts, strict=True)
    ]


def search_row(case: Case, seed: int, search: Search, exact: Problem | None) -> report.SearchRow:
    """Return what became of one search; exact: has the linear loops, None where there are none."""
    best, first = search.best_parameters, search.generations[0]
    found = [None] * len(NAMES) if best is None else best.tolist()
    bounded = np.isfinite(first.indices)
    still = bounded.copy()
    if exact is not None and bounded.any():
        still[bounded] = exact.growth(first.population[bounded]) == 0
    return report.SearchRow(
        names=case.names,
        seed=seed,
        bounded_draws=float(np.mean(bounded)),
        stable_draws=float(np.mean(still)),
        best_stable=best is not None and (exact is None or bool(exact.growth(best[None])[0] == 0)),
        best_index=None if best is None else search.best_index,
        generations=len(search.generations),
        evaluations=search.evaluations,
        parameters=dict(zip(NAMES, found, strict=True)),
    )


def summary(case: Case, searches: Sequence[report.SearchRow]) -> report.CaseRow:
    """Return a case's row over its searches."""
    best = [each.best_index for each in searches if each.best_index is not None]
    draws = len(searches) * case.tuning.population
    bounded, stable = (
        round(draws * float(np.mean([getattr(each, name) for each in searches])))
        for name in ("bounded_draws", "stable_draws")
    )
    figures: dict[str, Any] = {
        **share_of("bounded_draws", np.arange(draws) < bounded),
        **share_of("stable_draws", np.arange(draws) < stable),
        **share_of("bounded_runs", [each.best_index is not None for each in searches]),
        **share_of("stable_runs", [each.best_stable for each in searches]),
        **repeats.summary("best_index", best),
    }
    return report.CaseRow(
        names=case.names,
        seeds=len(searches),
        **figures,
        best_index_least=min(best, default=None),
        best_index_most=max(best, default=None),
        draws=draws,
        evaluations=sum(each.evaluations for each in searches),
        generations_most=case.tuning.generations,
    )


def searched(
    case: Case,
    seeds: Sequence[int],
    threads: int | None,
    done: Callable[[], None],
    has_exact: bool = True,
) -> Iterator[report.SearchRow]:
    """Give the row of every seed's search; `done` is called after each.

    has_exact: whether there is an exact linear loop to tell the stable from the bounded by.
    """
    tuning = case.tuning
    problem, draws = problem_of(tuning, threads), distribution_for(tuning)
    exact = problem_of(replace(tuning, exact=True)) if has_exact else None
    firsts = first_generations(problem, draws, tuning.population, seeds)
    for seed, first in zip(seeds, firsts, strict=True):
        search = tune(problem, draws, tuning.genetic, seed, resume_from=(first,))
        done()
        yield search_row(case, seed, search, exact)


def run(config: PidQuestionConfig, progress: Progress | None = None) -> report.PidQuestionResult:
    """Return how rare stable controllers are, and how good the found ones, in every case.

    Raises:
        ParameterError, ModelError: an unknown name, or a number out of range.
    """
    config = config.asked()
    result = report.PidQuestionResult([], [], config.trajectory, config.has_exact_loop)
    chosen = cases(config)
    for tuning in {(each.names.plant, each.names.setting): each.tuning for each in chosen}.values():
        problem_of(tuning, config.threads)  # refuses now, not after an hour, what cannot be run
    seeds = range(config.seed, config.seed + config.seeds)
    done = ticker(progress, "searches", len(chosen) * len(seeds))
    for case in chosen:
        mine = list(searched(case, seeds, config.threads, done, result.exact))
        result.rows.append(summary(case, mine))
        result.searches.extend(mine)
    return result


command = Study(
    run,
    report.tables,
    report.verdict,
    report.figures,
    question="Why did the paper find no integer PID: order, realisation or search range?",
)
