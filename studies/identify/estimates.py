"""From logs to estimates with intervals: the search, the errors, what is left, what is held back.

>>> found = identified(problem, Search("least-squares", starts=4, seed=1), excite)
>>> found.rows[0].value, found.rows[0].low, found.rows[0].high

An interval is of two standard uncertainties: what the logs' noise leaves (`intervals`), and, as no
model is the arm, how far the estimate would have moved had the other model of the arm made the
logs. They are added as the Guide to the expression of uncertainty in measurement (JCGM 100:2008,
5.1 and 6.2) adds what is random and what is not, by squares, then expanded to 95 %.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexsim.numerics.types import Array
from studies.identify.fit import Fit, fit, reweighed
from studies.identify.genetic import genetic
from studies.identify.intervals import Counted, Spread, correlation, spread_of
from studies.identify.names import values_at
from studies.identify.records import counts_of
from studies.identify.residuals import Left, Problem, left_over, require_explained
from studies.identify.simulated import Model, other_of
from studies.identify.telling import LOOSE, Told, require_told, told_by
from studies.tuning.genetic import GeneticSettings

LEAST_SQUARES, GENETIC = "least-squares", "genetic"
PREDICTED_STARTS = 1  # searches for the start of a log that is predicted
SHIFTED = 4  # steps towards the other model's signals


@dataclass(frozen=True)
class Search:
    """How numbers are searched.

    Attributes:
        method: least-squares or genetic. starts: searches of least squares. seed: of them.
        genetic: numbers of the genetic algorithm.
    """

    method: str
    starts: int
    seed: int
    genetic: GeneticSettings


@dataclass(frozen=True)
class Estimate:
    """A number: its estimate, the ends of its 95 % interval, and what that is made of [-].

    `noise`: half-width that the logs' noise alone leaves; `model`: how far the other model would
    move it; `search`: how far the search may be from its end; all relative to the value, or to
    its unit where it begins at zero.
    """

    name: str
    unit: str
    nominal: float
    value: float
    low: float
    high: float
    noise: float
    model: float
    search: float


@dataclass(frozen=True)
class HeldBack:
    """A log that was not identified from: its largest relative error of prediction, and whose."""

    log: str
    signal: str
    relative: float


@dataclass(frozen=True, eq=False)
class Identified:
    """What logs tell."""

    found: Fit
    told: Told
    spread: Spread
    rows: list[Estimate]
    left: list[Left]
    correlation: Array
    other: str
    evaluations: int | None

    @property
    def values(self) -> dict[str, float]:
        """The estimates by their names."""
        return {row.name: row.value for row in self.rows}

    @property
    def near(self) -> list[tuple[str, str, float]]:
        """Pairs that act nearly together, with their correlation."""
        names = [row.name for row in self.rows]
        return [
            (names[i], names[j], float(self.correlation[i, j]))
            for i in range(len(names))
            for j in range(i)
            if abs(self.correlation[i, j]) > LOOSE
        ]


def identified(problem: Problem, search: Search, excite: str) -> Identified:
    """Return what the logs of a problem tell.

    Args:
        excite: the command that writes torques which would tell more.

    Raises:
        ParameterError: the logs do not tell the numbers. RunError: the search does not end.
    """
    where = ", ".join(record.source for record in problem.records)
    names = [each.name for each in problem.model.free]
    nominal = problem.jacobian(problem.beginning())
    told = told_by(names, nominal)
    if told.silent or told.groups:
        require_told(told, where, excite)
    found, evaluations = _searched(problem, search)
    told = told_by(names, found.jacobian)
    require_told(told, where, excite)
    left = left_over(found.problem, found.z)
    require_explained(found.problem, found.z, left, search.method == LEAST_SQUARES)
    spread = spread_of(found.problem.split(found.residuals), _by_record(found), _counted(found))
    own = spread.covariance[: problem.own, : problem.own]
    other = other_of(problem.model.plant)
    return Identified(
        found,
        told,
        spread,
        _rows(found, spread, model_shift(found, other), search_shift(found)),
        left,
        correlation(own),
        other,
        evaluations,
    )


def _searched(problem: Problem, search: Search) -> tuple[Fit, int | None]:
    """Return where the search ended, and the evaluations of a genetic one."""
    if search.method == LEAST_SQUARES:
        return fit(problem, search.starts, search.seed), None
    z, evaluations = genetic(problem, search.genetic, search.seed)
    problem = reweighed(problem, z)
    left, slopes = problem.residuals(z), problem.jacobian(z)
    return Fit(problem, z, float(left @ left) / 2, 1, 1, left, slopes), evaluations


def _by_record(found: Fit) -> list[Array]:
    """Return the slopes (N, S, size) of each record."""
    columns, begin = [], 0
    for record in found.problem.records:
        rows = found.jacobian[begin : begin + record.values.size]
        columns.append(rows.reshape(*record.values.shape, -1))
        begin += record.values.size
    return columns


def _counted(found: Fit) -> list[Counted]:
    """Return what of each record is counted; nothing where there is no motion."""
    problem, counted = found.problem, []
    for r, record in enumerate(problem.records):
        signals = problem.modelled(found.z, r)
        if signals is None:
            return []
        counted.append(Counted(signals, counts_of(record), problem.sigmas[r]))
    return counted


def model_shift(found: Fit, other: str) -> Array:
    """Return how far coordinates (p,) would move had another model made the logs.

    Had it, with the same numbers, its signals would be the logs; this model is led to them by
    Gauss and Newton's steps with the slopes that there are, as long as they come nearer.
    """
    problem = found.problem
    model = replace(problem.model, plant=other)
    size, slopes = _size(found.jacobian), _unit(found.jacobian)
    theirs = [problem.modelled(found.z, r, model) for r in range(len(problem.records))]
    z, apart = found.z, _apart(problem, found.z, theirs)
    for _ in range(SHIFTED):
        if apart is None:
            break
        step = np.linalg.lstsq(slopes, -apart, rcond=None)[0] / size
        nearer = _apart(problem, z + step, theirs)
        if nearer is None or nearer @ nearer >= apart @ apart:
            break
        z, apart = z + step, nearer
    return np.full(problem.own, np.nan) if apart is None else (z - found.z)[: problem.own]


def _apart(problem: Problem, z: Array, theirs: Sequence[Array | None]) -> Array | None:
    """Return what this model's signals are from others', in noises (R,); None without a motion."""
    rows = []
    for r, other in enumerate(theirs):
        ours = problem.modelled(z, r)
        if other is None or ours is None:
            return None
        known = np.isfinite(problem.records[r].values)
        rows.append(np.where(known, (other - ours) / problem.sigmas[r], 0.0).ravel())
    return np.concatenate(rows)


def search_shift(found: Fit) -> Array:
    """Return how far coordinates (p,) are from the least squares of the linear model there."""
    moved = np.linalg.lstsq(_unit(found.jacobian), -found.residuals, rcond=None)[0]
    return (moved / _size(found.jacobian))[: found.problem.own]


def _size(slopes: Array) -> Array:
    size = np.linalg.norm(slopes, axis=0)
    return np.where(size > 0, size, 1.0)


def _unit(slopes: Array) -> Array:
    return slopes / _size(slopes)


def _rows(found: Fit, spread: Spread, model: Array, search: Array) -> list[Estimate]:
    rows = []
    model, search = np.abs(np.nan_to_num(model)), np.abs(search)
    for j, each in enumerate(found.problem.model.free):
        noise = float(spread.half[j])
        z = float(found.z[j])
        quantile = noise / float(spread.error[j])  # of both standard uncertainties together
        both = quantile * math.hypot(float(spread.error[j]), float(model[j]))
        low, high = each.interval(z, both + float(search[j]))
        own = (each.name, each.unit, each.nominal, each.value(z), low, high)
        rows.append(Estimate(*own, noise, float(model[j]), float(search[j])))
    return rows


def predicted(model: Model, values: dict[str, float], problem: Problem) -> list[HeldBack]:
    """Return how well numbers predict logs that they are not of; their starts alone are searched.

    Args:
        problem: of those logs.
    """
    free = problem.model.free
    z = problem.beginning()
    for j, each in enumerate(free):
        z[j] = each.coordinate(values[each.name]) if values[each.name] else 0.0
    low, high = problem.bounds()
    z = np.clip(z, low, high)
    columns = problem.jacobian(z)[:, problem.own :]
    left = problem.residuals(z)
    z[problem.own :] += np.linalg.lstsq(columns, -left, rcond=None)[0]
    rows = left_over(problem, z)
    worst: dict[str, Left] = {}
    for row in rows:
        if row.log not in worst or row.relative > worst[row.log].relative:
            worst[row.log] = row
    return [HeldBack(row.log, row.signal, row.relative) for row in worst.values()]


def left_one_out(problem: Problem, search: Search, at: Array) -> list[HeldBack]:
    """Return each log's error as the other logs' numbers predict it.

    Args:
        at: (p,) coordinates of all logs' numbers, where the searches begin.
    """
    rows = []
    for r in range(len(problem.records)):
        kept = [i for i in range(len(problem.records)) if i != r]
        others = _only(problem, kept)
        begin = others.beginning()
        begin[: problem.own] = at
        found = fit(others, PREDICTED_STARTS, search.seed, begin)
        values = values_at(problem.model.free, found.z[: problem.own])
        rows += predicted(problem.model, values, _only(problem, [r]))
    return rows


def _only(problem: Problem, kept: Sequence[int]) -> Problem:
    return replace(
        problem,
        records=tuple(problem.records[i] for i in kept),
        sigmas=tuple(problem.sigmas[i] for i in kept),
    )
