"""Least squares over growing parts of the logs, from several starts, each checked.

>>> found = fit(problem, starts=4, seed=1)
>>> found.z, found.agreeing

A long log of vibrations has many local minima, one for each period that a wrong frequency loses
over it; its first part has few. So each search begins with a thirty-second of every log and goes
on with twice as much. Of several starts the least is taken, and how many came to the same place is
said.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from flexsim.errors import RunError
from flexsim.numerics.types import Array
from studies.identify.records import LEAST_ROWS
from studies.identify.residuals import Problem

SHARES = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2)  # of every log, one after the other, then all
SPREAD = 0.3  # of the coordinates at which the other starts are drawn
HELD = 1.0  # coordinates to which a number is held that the part of a log does not tell
EVALUATIONS = 40  # of each part
PARTLY, WHOLLY = 1e-3, 1e-8  # relative, to which a part of the logs, and all, are searched
REWEIGHED = 2  # times that the noise is taken from what is left
AS_BEFORE = 0.01  # relative change of the noise that needs no other search
SAME = 1e-3  # coordinates within which two ends are one place
EDGE = 1e-6  # of a range, at which a number has run to its end


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a search ended.

    Attributes:
        problem: with the noise as it came out. z: coordinates. cost: half the sum of squares.
        starts: searches made. agreeing: those that ended at the same place.
        residuals: (R,), jacobian: (R, size) there.
    """

    problem: Problem
    z: Array
    cost: float
    starts: int
    agreeing: int
    residuals: Array
    jacobian: Array


def fit(problem: Problem, starts: int, seed: int, begin: Array | None = None) -> Fit:
    """Return the least of several searches, the noise then taken from its residuals.

    Args:
        begin: where the first begins; the nominal numbers unless given.

    Raises:
        RunError: no search ends, or a number runs to the end of its range.
    """
    first = problem.beginning() if begin is None else begin
    rng = np.random.default_rng(seed)
    ends: list[tuple[float, Array]] = []
    failed = ""
    for start in range(starts):
        z = first.copy()
        if start:
            z[: problem.own] += SPREAD * rng.uniform(-1, 1, problem.own) * _roomy(problem)
        try:
            ends.append(_grown(problem, z))
        except RunError as error:
            failed = str(error)
    if not ends:
        raise RunError(failed)
    _, z = min(ends, key=lambda each: each[0])
    own = slice(problem.own)
    agreeing = sum(bool(np.all(np.abs(other[own] - z[own]) < SAME)) for _, other in ends)
    for _ in range(REWEIGHED):
        before, problem = problem, reweighed(problem, z)
        if _same_noise(before, problem):
            break
        _, z = _searched(problem, z)
    _require_inside(problem, z)
    left, slopes = problem.residuals(z), problem.jacobian(z)
    return Fit(problem, z, float(left @ left) / 2, starts, agreeing, left, slopes)


def _same_noise(one: Problem, other: Problem) -> bool:
    """Return whether two problems weigh their signals nearly alike."""
    pairs = zip(one.sigmas, other.sigmas, strict=True)
    return all(bool(np.all(np.abs(a / b - 1) < AS_BEFORE)) for a, b in pairs)


def _roomy(problem: Problem) -> Array:
    """Return 1 for coordinates that are relative changes, 0 for those that begin at zero."""
    return np.array([float(each.scale is None) for each in problem.model.free])


def _grown(problem: Problem, z: Array) -> tuple[float, Array]:
    """Return cost and place of one search over growing parts.

    Raises:
        RunError: it does not end.
    """
    for share in SHARES:
        part = problem.first(share)
        if min(len(each.time) for each in part.records) >= LEAST_ROWS:
            _, z = _searched(part, z, held=True)
    return _searched(problem, z)


def _searched(problem: Problem, z: Array, held: bool = False) -> tuple[float, Array]:
    """Return cost and place where least squares ends.

    Args:
        held: whether the numbers are held, weakly, to where the search begins.

    Raises:
        RunError: it does not end, or only without a motion.
    """
    own, low_high = problem.own, problem.bounds()
    origin = z[:own].copy()

    def residuals(at: Array) -> Array:
        pull = (at[:own] - origin) / HELD
        return np.concatenate([problem.residuals(at), pull]) if held else problem.residuals(at)

    def jacobian(at: Array) -> Array:
        slopes = problem.jacobian(at)
        return np.vstack([slopes, np.eye(own, problem.size) / HELD]) if held else slopes

    inside = np.clip(z, low_high[0] + 1e-9, low_high[1] - 1e-9)
    found = least_squares(
        residuals,
        inside,
        jacobian,
        low_high,
        "trf",
        x_scale="jac",
        max_nfev=EVALUATIONS,
        **{name: PARTLY if held else WHOLLY for name in ("ftol", "xtol")},
    )
    if not np.isfinite(found.cost) or (found.status <= 0 and not held):
        raise RunError(
            f"least squares did not end in {EVALUATIONS} evaluations: the logs may be of other "
            "torques or another arm; check files and columns, begin nearer with --robot.* "
            "numbers, or free fewer"
        )
    return float(found.cost), found.x


def reweighed(problem: Problem, z: Array) -> Problem:
    """Return the problem with the noise of each signal as its residuals have it."""
    sigmas = []
    for r, left in enumerate(problem.split(problem.residuals(z))):
        known = np.isfinite(problem.records[r].values)
        size = np.sqrt(np.sum(left**2, axis=0) / known.sum(axis=0)) * problem.sigmas[r]
        span = np.nanmax(np.abs(problem.records[r].values), axis=0)
        sigmas.append(np.maximum(size, 1e-9 * (1e-3 + span)))
    return replace(problem, sigmas=tuple(sigmas))


def _require_inside(problem: Problem, z: Array) -> None:
    """Raise a RunError if a number has run to the end of its range; zero is none."""
    for each, at in zip(problem.model.free, z, strict=False):
        span = each.high - each.low
        if at > each.high - EDGE * span or (at < each.low + EDGE * span and not each.bounded):
            low, high = sorted((each.value(each.low), each.value(each.high)))
            raise RunError(
                f"{each.name} runs to {each.value(float(at)):.3g} {each.unit}, the end of its "
                f"range, {low:.3g} to {high:.3g}: the logs are not of such an arm, or do not tell "
                "it; check columns and units, --setting and --start, or leave "
                f"{each.name} out of --free"
            )
