"""Fractional, PID or PD, v mirrored or ignored: which is best at equal effort?

    >>> result = run(StructuresConfig(quick=True))
    >>> result.winners[0].index

Section 3.2 finds no integer PID that holds, and makes no other choice of measurement than the
mirrored tip. Here CMA-ES tunes three structures, each with v mirrored and ignored, with as many
individuals for each; several seeds show the search's luck. The best of each is then repeated with
its gains' fourth digits changed, on the plant that it was tuned on and on the chain, and held
against the exact linear loop.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

from rich.progress import Progress

from flexsim.errors import ParameterError
from studies.core.carry_out import Study, ticker
from studies.core.options import HardwareOptions
from studies.core.study_options import (
    Out,
    Perturbations,
    Population,
    SeedOptions,
    StudyOptions,
    ThreadOptions,
)
from studies.pid_question import structures_report as report
from studies.pid_question.designs import (
    FILTER_TIMES,
    GROUNDS,
    Effort,
    designs,
    problems_of,
    searched,
)
from studies.pid_question.structures_report import REFERENCE, Design, SearchRow
from studies.pid_question.winners import ratio_of, winner_rows
from studies.tuning.tuning import SEED_MOST


@dataclass(frozen=True)
class StructuresConfig(ThreadOptions, SeedOptions, StudyOptions):
    """Compare structures of controller at equal search effort, v mirrored and ignored."""

    QUICK: ClassVar = {
        **{"grounds": 1, "seeds": 2, "individuals": 96},
        **{"population": 16, "perturbations": 6},
    }

    out: Out = Path("runs/structures")
    quick: bool = False
    """The first ground only, two seeds of 96 individuals at most, six repeats."""
    grounds: tuple[str, ...] = tuple(GROUNDS)
    """Some of ideal, friction, delay (three modes) and bench (five modes, simulink, the worst of
    ideal, delayed and bench hardware). What grows on the exact linear loop is rejected."""
    trajectory: str = "circle"
    """line, two-loop or circle."""
    seeds: int = 6
    """Searches of each kind."""
    individuals: int = 960
    """Of each search; PIDs and PDs share them out among three time constants of their derivative's
    filter. Rounded up to whole populations."""
    population: Population = 16
    effort: float = 1e-7
    """What each N m of the torques' total variation adds to the index [m2 s]."""
    perturbations: Perturbations = 40
    terms: int = 10
    """p in (2), length of each fractional operator."""

    @property
    def budget(self) -> Effort:
        """What all searches have in common."""
        own = {name: each for name, each in self.for_tuning.items() if not _of_hardware(name)}
        return Effort(
            self.trajectory,
            self.individuals,
            self.population,
            self.effort,
            self.terms,
            own,
            self.threads,
            self.has_exact_loop,
        )


def _of_hardware(name: str) -> bool:
    return name in {item.name for item in fields(HardwareOptions)}


def _check(config: StructuresConfig) -> None:
    """Refuse what the study cannot be run with.

    Raises:
        ParameterError: an unknown ground, hardware beside the grounds' own, or too large a seed.
    """
    given, known = config.grounds, ", ".join(GROUNDS)
    for name in given:
        if name not in GROUNDS:
            raise ParameterError(f"ground {name!r} is unknown; choose from {known}")
    if not given or len(set(given)) != len(given):
        raise ParameterError(f"grounds are {' '.join(given) or 'empty'}; name each once")
    for item in fields(HardwareOptions):
        if getattr(config, item.name) != item.default:
            raise ParameterError(
                f"--{item.name.replace('_', '-')} has no effect: every ground has its own "
                f"hardware; choose with --grounds from {known}"
            )
    if config.seed > SEED_MOST - config.seeds + 1:
        raise ParameterError(f"seed is {config.seed}; give 0 to {SEED_MOST - config.seeds + 1}")


def summary(
    ground: str, searches: Mapping[Design, list[SearchRow]], design: Design, seed: int
) -> report.StructureRow:
    """Return a design's row over its searches, and its ratio to the fractional one's."""
    costs = {
        name: [float("inf") if row.cost is None else row.cost for row in rows]
        for name, rows in searches.items()
    }
    mine, rows = costs[design], searches[design]
    found = sum(row.cost is not None for row in rows)
    reference = costs[REFERENCE] if design != REFERENCE else None
    ratio, ratio_low, ratio_high = ratio_of(mine, reference, seed, paired=False)
    spread: dict[str, Any] = report.spread_of(mine)
    return report.StructureRow(
        ground=ground,
        design=design,
        seeds=len(rows),
        found=found,
        evaluations=rows[0].evaluations,
        ratio=ratio,
        ratio_low=ratio_low,
        ratio_high=ratio_high,
        **spread,
    )


def run(config: StructuresConfig, progress: Progress | None = None) -> report.StructuresResult:
    """Return what each structure reaches on every ground, and what its best is worth.

    Raises:
        ParameterError, ModelError: an unknown name, or a number out of range.
    """
    config = config.asked()
    _check(config)
    budget, robot, compared = config.budget, config.robot_of(), designs()
    seeds = range(config.seed, config.seed + config.seeds)
    whole = [
        {design: problems_of(design, GROUNDS[name], budget, config.seed) for design in compared}
        for name in config.grounds
    ]  # refuses now, not after minutes, what cannot be run
    done = ticker(progress, "searches", len(config.grounds) * len(compared) * (len(seeds) + 1))
    result = report.StructuresResult([], [], [], _words(config, budget))
    for name, problems in zip(config.grounds, whole, strict=True):
        found: dict[Design, list[SearchRow]] = {}
        for design in compared:
            found[design] = []
            for seed in seeds:
                found[design].append(searched(design, name, problems[design], seed))
                done()
        result.rows.extend(summary(name, found, design, config.seed) for design in compared)
        result.searches.extend(row for rows in found.values() for row in rows)
        often = config.perturbations
        result.winners.extend(winner_rows(name, found, budget, robot, often, config.seed, done))
    return result


def _words(config: StructuresConfig, budget: Effort) -> str:
    """Return the budget in a line."""
    times = ", ".join(f"{1e3 * each:g}" for each in FILTER_TIMES)
    return (
        f"CMA-ES, {config.seeds} seeds of {budget.share * len(FILTER_TIMES)} individuals each "
        f"(PIDs and PDs: {budget.share} for each filter time of {times} ms), "
        f"{config.effort:g} m2 s/(N m) of effort; best of all seeds repeated "
        f"{config.perturbations} times."
    )


command = Study(
    run,
    report.tables,
    report.verdict,
    report.figures,
    question="Fractional, PID or PD, v mirrored or ignored: which is best at equal effort?",
)
