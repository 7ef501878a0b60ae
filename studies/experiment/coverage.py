"""Do the intervals hold? Logs of one model with drawn numbers, identified on the other.

>>> rows = coverage(model, made_on, torque, theta, period, Draws(number=100, spread=0.2, seed=1))
>>> rows[0].inside, rows[0].worst
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from flexsim.errors import FlexsimError
from flexsim.numerics.types import Array
from studies.core.evidence.intervals import share_interval
from studies.experiment.synthetic import logged, sigmas
from studies.identify.estimates import LEAST_SQUARES, Estimate, Search, identified
from studies.identify.names import values_at
from studies.identify.records import Record
from studies.identify.residuals import Problem
from studies.identify.simulated import Model
from studies.tuning.genetic import GeneticSettings


class Draws(NamedTuple):
    """How many draws, how far from the nominal numbers [-], by which seed."""

    number: int
    spread: float
    seed: int


@dataclass(frozen=True)
class Covered:
    """A number over all draws: how many intervals had the truth in them, with that share's 95 %
    interval; median and largest relative error; median half-width of the intervals [-]."""

    name: str
    draws: int
    inside: int
    share_low: float
    share_high: float
    error: float
    worst: float
    half: float


def coverage(
    model: Model,
    made_on: str,
    torque: Array,
    theta: tuple[float, float],
    period: float,
    draws: Draws,
    threads: int,
    advance: Callable[[], None],
) -> tuple[list[Covered], list[str]]:
    """Return how the intervals hold, number by number, and what went wrong in words.

    Args:
        model: identified on, its hardware that of the logs. made_on: plant of the logs.
        torque: (K, 2) [N m].
    """

    def task(number: int) -> tuple[dict[str, float], list[Estimate] | None, str]:
        found = _draw(model, made_on, torque, theta, period, draws, number)
        advance()
        return found

    with ThreadPoolExecutor(threads) as pool:
        outcomes = list(pool.map(task, range(draws.number)))
    failed = [words for _, rows, words in outcomes if rows is None]
    known = [(truth, rows) for truth, rows, _ in outcomes if rows is not None]
    named = enumerate(model.free) if known else ()
    return [_covered(j, each.name, known, draws.number) for j, each in named], failed


def _draw(
    model: Model,
    made_on: str,
    torque: Array,
    theta: tuple[float, float],
    period: float,
    draws: Draws,
    number: int,
) -> tuple[dict[str, float], list[Estimate] | None, str]:
    """Return the true numbers of a draw, its estimates, and why there are none."""
    rng = np.random.default_rng([draws.seed, number])
    z = draws.spread * rng.uniform(-1, 1, len(model.free))
    truth = values_at(model.free, z)
    source = replace(model, plant=made_on)
    empty = Record("", period, torque, np.zeros(0), (), np.zeros(0))
    try:
        motion = source.moved(truth, empty, np.array([*theta, 0.0, 0.0]), run=number)
        record = logged(motion, torque, period)
        problem = Problem(model, (record,), (sigmas(record),), "rest", 1)
        search = Search(LEAST_SQUARES, 1, draws.seed, GeneticSettings())
        return truth, identified(problem, search, "").rows, ""
    except FlexsimError as error:
        return truth, None, f"draw {number}: {error}"


def _covered(
    j: int, name: str, known: list[tuple[dict[str, float], list[Estimate]]], count: int
) -> Covered:
    errors = np.array([rows[j].value / truth[name] - 1 for truth, rows in known])
    halves = [(rows[j].high - rows[j].low) / 2 / abs(rows[j].value) for _, rows in known]
    inside = sum(rows[j].low <= truth[name] <= rows[j].high for truth, rows in known)
    low, high = share_interval(inside, count)
    sizes = np.abs(errors)
    figures = (float(np.median(sizes)), float(sizes.max()), float(np.median(halves)))
    return Covered(name, count, inside, low, high, *figures)
