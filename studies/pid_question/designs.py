"""What is compared at equal search effort: structures of controller, each on several grounds.

>>> problems = problems_of(Design("pid", "ignored"), GROUNDS["ideal"], effort, seed=1)
>>> searched(Design("pid", "ignored"), "ideal", problems, seed=1).cost      # [m2 s]

A search has as many individuals whatever the structure. One with a low-pass filter in its
derivative shares them out among `FILTER_TIMES`, a search for each, and the best counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array
from studies.pid_question.structures_report import Design, SearchRow
from studies.tuning.distributions import NAMES, Distribution, Draw
from studies.tuning.genetic import GeneticSettings
from studies.tuning.individuals import DERIVATIVE_PAIRS, TEXTBOOK
from studies.tuning.problem import Problem, distribution_for, problem_of, tune
from studies.tuning.tuning import Tuning

FILTER_TIMES = (1e-3, 3e-3, 10e-3)  # [s] of the derivative's low-pass filter
TORQUE_LIMIT = (10.0, 5.0)  # [N m] of both motors, on every ground: those of `bench`
V_GAINS = {"mirrored": -1.0, "ignored": 0.0}
NO_INTEGRAL = {name: Draw("fixed", (0.0,)) for name in ("k2", "k5")}
GAINS = sorted({k for k, _ in DERIVATIVE_PAIRS} | {4, 9})  # positions in `NAMES`, orders left out
CMA = "cma"


@dataclass(frozen=True)
class Structure:
    """A structure of controller; the range is where CMA-ES begins, not where it ends.

    Attributes:
        controller, realisation, distribution: of a `Tuning`. filter_times: [s].
        fixed: draws in place of the distribution's.
    """

    controller: str
    realisation: str
    distribution: str
    filter_times: tuple[float, ...] = (0.0,)
    fixed: Mapping[str, Draw] = field(default_factory=dict)


STRUCTURES = {
    "fractional": Structure("fractional", "tustin", "wide"),
    "pid": Structure("pid", TEXTBOOK, "log-uniform", FILTER_TIMES),
    "pd": Structure("pid", TEXTBOOK, "log-uniform", FILTER_TIMES, NO_INTEGRAL),
}


@dataclass(frozen=True)
class Ground:
    """Where structures are tuned.

    Attributes:
        plant, setting, hardware: of a `Tuning`; the worst hardware counts. What grows on the exact
            linear loop, of any hardware, is rejected everywhere.
    """

    plant: str
    setting: str
    hardware: tuple[str, ...]


GROUNDS = {
    "ideal": Ground("assumed-modes:3", "none", ("ideal",)),
    "friction": Ground("assumed-modes:3", "opposing", ("ideal",)),
    "delay": Ground("assumed-modes:3", "none", ("delayed",)),
    "bench": Ground("assumed-modes:5", "simulink", ("ideal", "delayed", "bench")),
}


@dataclass(frozen=True)
class Effort:
    """What all searches have in common.

    Attributes:
        trajectory: named. individuals: of a search. population: of a generation.
        weight: of the torques' total variation in what is minimised [m2 s/(N m)].
        terms: p in (2). more: of the robot, as `Tuning` has it. threads: None for all.
        exact: whether the robot has an exact linear loop, in which nothing may grow.

    Raises:
        ParameterError: a number out of range.
    """

    trajectory: str
    individuals: int
    population: int
    weight: float
    terms: int
    more: Mapping[str, Any] = field(default_factory=dict)
    threads: int | None = None
    exact: bool = True

    def __post_init__(self) -> None:
        if self.individuals < 1:
            raise ParameterError(f"individuals is {self.individuals}; give 1 or more")

    @property
    def share(self) -> int:
        """Individuals per filter time: those asked for shared out, in whole populations."""
        return math.ceil(self.individuals / (self.population * len(FILTER_TIMES))) * self.population

    def settings(self, searches: int) -> GeneticSettings:
        """Return the numbers of one of so many searches that share the individuals.

        CMA-ES takes as many whole populations as the genetic algorithm's budget pays for, which
        does not evaluate its survivors anew.
        """
        own = GeneticSettings(self.population)
        whole = len(FILTER_TIMES) * self.share // searches // self.population
        fresh = self.population - own.survivors
        generations = 1 + math.ceil((whole - 1) * self.population / fresh)
        return GeneticSettings(self.population, generations)


def designs(structures: Sequence[str] = tuple(STRUCTURES)) -> list[Design]:
    """Return every structure with v mirrored and ignored."""
    return [Design(name, v) for name in structures for v in V_GAINS]


def tunings_of(design: Design, ground: Ground, effort: Effort, seed: int) -> list[Tuning]:
    """Return the tuning of each filter time.

    Raises:
        ParameterError: a name or a number that a tuning cannot have.
    """
    own = STRUCTURES[design.structure]
    numbers = effort.settings(len(own.filter_times))
    return [
        Tuning(
            trajectory=effort.trajectory,
            plant=ground.plant,
            controller=own.controller,
            realisation=own.realisation,
            setting=ground.setting,
            distribution=own.distribution,
            tuner=CMA,
            terms=effort.terms,
            filter_time=filter_time,
            population=numbers.population,
            generations=numbers.generations,
            seed=seed,
            hardware=ground.hardware,
            hardware_torque_limit=TORQUE_LIMIT,
            exact=effort.exact,
            effort=effort.weight,
            v_gain=V_GAINS[design.v],
            **effort.more,
        )
        for filter_time in own.filter_times
    ]


def draws_of(design: Design, tuning: Tuning) -> Distribution:
    """Return what a structure's individuals are drawn from."""
    return distribution_for(tuning).with_draws(STRUCTURES[design.structure].fixed)


def problems_of(
    design: Design, ground: Ground, effort: Effort, seed: int
) -> list[tuple[Tuning, Problem]]:
    """Return tuning and problem of each filter time; all seeds of a case have these problems.

    Raises:
        ParameterError, ModelError: as `problem_of`.
    """
    return [
        (tuning, problem_of(tuning, effort.threads))
        for tuning in tunings_of(design, ground, effort, seed)
    ]


def searched(
    design: Design, ground: str, problems: Sequence[tuple[Tuning, Problem]], seed: int
) -> SearchRow:
    """Return what became of one seed's search, the best of its filter times."""
    found = [
        tune(problem, draws_of(design, tuning), tuning.genetic, seed, CMA)
        for tuning, problem in problems
    ]
    first = min(range(len(found)), key=lambda i: found[i].best_index)
    parameters = found[first].best_parameters
    held = parameters is not None
    numbers = [None] * len(NAMES) if parameters is None else parameters.tolist()
    return SearchRow(
        ground=ground,
        design=design,
        seed=seed,
        cost=found[first].best_index if held else None,
        filter_time=problems[first][0].filter_time if held else None,
        evaluations=sum(each.evaluations for each in found),
        parameters=dict(zip(NAMES, numbers, strict=True)),
    )


def shaken(parameters: Array, count: int, size: float, seed: int) -> Array:
    """Return copies of an individual (count, 10), every gain changed by a relative size (1 sd).

    The same changes by the same seed, whatever the individual: copies i of several are pairs.
    """
    rng = np.random.default_rng(seed)
    copies = np.tile(np.asarray(parameters, dtype=float), (count, 1))
    copies[:, GAINS] *= 1 + size * rng.standard_normal((count, len(GAINS)))
    return copies
