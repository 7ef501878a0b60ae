"""Figures of merit while a run goes on: what `flexsim.loop.metrics` takes from a recorded motion.

No time series is kept. Sums and maxima cost a few operations a sample; the envelope half-width, a
maximum of minima, needs the nearest reference point only where a sample may be farther from the
reference than every one before it. A sample is not, as soon as one reference point is as near as
that. Others wait, a few at a time, and are settled from the one that seems farthest on, which rules
out most. Its reference point is found by leaps: a point at arc length s along the reference and
distance d hides all up to s + d - nearest, by the triangle inequality.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import ParameterError
from flexsim.loop.trajectories import Reference
from flexsim.numerics.elementary import log
from flexsim.numerics.jit import jit, jit_apart
from flexsim.numerics.types import Array

MARGIN = 1e-12  # [m] by which leaps fall short, for rounding's sake
ROUNDING = 1e-12  # relative, of lengths along a reference
HOLD_SLACK = 1e-12  # [s] rounding of the time at which the hold begins

# what a run adds up, by column; squares of lengths and sums of squares
ROWS, ENVELOPE, MOST_ERROR, ERROR, MOST_V, RESIDUAL_V, EARLY_V, LATE_V = range(8)
PEAK, TORQUE, VARIATION, LAST = 8, 10, 12, 14  # of joint 1, then of joint 2
EFFORT, BEHIND, WAITING = 16, 17, 18
PARTS = 19  # of the index (5): of x, y and v [m2 s]
SUMS = 22
PART_NAMES = ("index_x", "index_y", "index_v")
WAITING_MOST = 64  # points; more take longer to sort, fewer are settled more often


class Yardstick(NamedTuple):
    """A reference as compiled code measures against it; without points, nothing is measured.

    Attributes:
        points: (M, 2) its points one after the other, without repetitions [m].
        own: (K+1,) which of them a sample's is.
        arc: (M,) length along them [m]; first: (M+1,) of each of M equal cells of that length,
            the first point that is not before it; per_length: cells per metre [1/m].
        hold, middle: samples with which the hold at the end and its second half begin, K+1 for
            none.
    """

    points: Array
    own: NDArray[np.int64]
    arc: Array
    first: NDArray[np.int64]
    per_length: float
    hold: int
    middle: int


NO_YARDSTICK = Yardstick(
    np.zeros((0, 2)), np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64), 0.0, 0, 0
)


def yardstick(reference: Reference, hold: float = 0.0) -> Yardstick:
    """Return what a run on a reference is measured against.

    Args:
        hold: length of the hold at the end [s].

    Raises:
        ParameterError: the hold is no finite length of time.
    """
    start, middle = hold_samples(reference.time, hold)
    tip = np.ascontiguousarray(reference.tip, dtype=float)
    new = np.append(True, (np.diff(tip, axis=0) != 0).any(axis=1))
    points, own = tip[new], np.cumsum(new).astype(np.int64) - 1
    arc = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
    cells, length = len(points), float(arc[-1])
    per_length = cells / length if length > 0 else 0.0
    edges = np.arange(cells + 1) / per_length if per_length else np.zeros(cells + 1)
    edges *= 1 - ROUNDING  # a point on an edge belongs to its cell
    first = np.searchsorted(arc, edges).astype(np.int64)
    return Yardstick(points, own, arc, first, per_length, start, middle)


def hold_samples(time: Array, hold: float) -> tuple[int, int]:
    """Return the samples with which the hold at the end and its second half begin.

    Raises:
        ParameterError: the hold is no finite length of time.
    """
    if not 0 <= hold < math.inf:
        raise ParameterError(f"hold is {hold} s; give 0 or more")
    count = len(time)
    if hold == 0:
        return count, count
    start = int(np.searchsorted(time, time[-1] - hold - HOLD_SLACK))
    return start, (start + count) // 2


@jit
def apart(yard: Yardstick, at: int, x: float, y: float) -> float:
    """Return the squared distance of (x, y) from one reference point [m2]."""
    dx, dy = x - yard.points[at, 0], y - yard.points[at, 1]
    return dx * dx + dy * dy


@jit
def downhill(yard: Yardstick, x: float, y: float, at: int):  # type: ignore[no-untyped-def]
    """Return a reference point from which the next are farther, and its squared distance [m2].

    Args:
        at: the point to begin at.
    """
    at = min(max(at, 0), yard.points.shape[0] - 1)
    last, best = yard.points.shape[0] - 1, apart(yard, at, x, y)
    for step in (1, -1):
        while 0 <= at + step <= last:
            there = apart(yard, at + step, x, y)
            if there >= best:
                break
            at, best = at + step, there
    return at, best


@jit_apart
def nearest(yard: Yardstick, x: float, y: float, near: float, at: int):  # type: ignore[no-untyped-def]
    """Return the nearest reference point and its squared distance [m2].

    Args:
        near: squared distance [m2] at which to stop. at: a point thought to be near.
    """
    last, best = yard.points.shape[0] - 1, apart(yard, at, x, y)
    radius = np.sqrt(best)
    j = 0
    while j <= last and best > near:
        there = apart(yard, j, x, y)
        distance = np.sqrt(there)
        if there < best:
            at, best, radius = j, there, distance
        clear = (yard.arc[j] + distance - radius - MARGIN) * yard.per_length
        j = max(j + 1, yard.first[min(max(int(clear), 0), last)])
    return at, best


@jit_apart
def settle(yard: Yardstick, sums: Array, waiting: Array) -> None:
    """Take waiting points into the envelope, the one that seems farthest first."""
    count, far = int(sums[WAITING]), sums[ENVELOPE]
    sums[WAITING] = 0.0
    while count > 0:
        top = 0
        for i in range(1, count):
            if waiting[i, 2] > waiting[top, 2]:
                top = i
        if waiting[top, 2] <= far:
            break
        x, y = waiting[top, 0], waiting[top, 1]
        at, there = nearest(yard, x, y, far, int(waiting[top, 3]))
        far = max(far, there)
        count -= 1
        waiting[top] = waiting[count]
        for i in range(count):  # what is near this point is near its neighbours, too
            seen = apart(yard, at, waiting[i, 0], waiting[i, 1])
            if seen < waiting[i, 2]:
                waiting[i, 2], waiting[i, 3] = seen, at
    sums[ENVELOPE] = far


@jit
def add_to_envelope(yard: Yardstick, sums: Array, waiting: Array, k: int, x, y, error) -> None:  # type: ignore[no-untyped-def]
    """Let the tip (x, y) of sample k wait if it may be farther off than all that were settled."""
    if error <= sums[ENVELOPE]:
        return
    own = yard.own[k]
    last = yard.points.shape[0] - 1
    at = min(max(own - int(sums[BEHIND]), 0), last)  # as far behind its own as the last one
    if apart(yard, at, x, y) <= sums[ENVELOPE]:
        return
    at, there = downhill(yard, x, y, at)
    sums[BEHIND] = own - at
    if there > sums[ENVELOPE]:
        count = int(sums[WAITING])
        waiting[count, 0], waiting[count, 1] = x, y
        waiting[count, 2], waiting[count, 3] = there, at
        sums[WAITING] += 1.0


@jit
def add_sample(  # type: ignore[no-untyped-def]
    yard: Yardstick,
    sums: Array,
    waiting: Array,
    k: int,
    x: float,
    y: float,
    error: float,
    v: float,
    u1: float,
    u2: float,
):
    """Add sample k to the sums (SUMS,) of a run.

    Args:
        waiting: (WAITING_MOST, 4), points that `settle` takes into the sums, at the end and
            whenever sums[WAITING] says that they are full.
        x, y: tip [m]. error: squared distance from its reference [m2]. v: deflection [m].
        u1, u2: torques that the controllers command from this sample on [N m].
    """
    sums[ERROR] += error
    sums[MOST_ERROR] = max(sums[MOST_ERROR], error)
    add_to_envelope(yard, sums, waiting, k, x, y, error)
    sums[MOST_V] = max(sums[MOST_V], abs(v))
    if k >= yard.hold:
        sums[RESIDUAL_V] = max(sums[RESIDUAL_V], abs(v))
        sums[EARLY_V if k < yard.middle else LATE_V] += v * v
    if sums[ROWS] > 0.0:
        sums[VARIATION] += abs(u1 - sums[LAST])
        sums[VARIATION + 1] += abs(u2 - sums[LAST + 1])
        sums[EFFORT] += sums[LAST] ** 2 + sums[LAST + 1] ** 2
    sums[TORQUE] += u1 * u1
    sums[TORQUE + 1] += u2 * u2
    sums[PEAK] = max(sums[PEAK], abs(u1))
    sums[PEAK + 1] = max(sums[PEAK + 1], abs(u2))
    sums[LAST], sums[LAST + 1] = u1, u2
    sums[ROWS] += 1.0


def growth_rate(early: float, late: float, length: float) -> float | None:
    """Return at what rate an rms grows from one half of a hold to the other [1/s].

    Args:
        early, late: rms over the halves. length: of the hold [s].

    Returns:
        Above 0 where the run still grows; None where nothing moves.
    """
    rate = float(_growth_rates(np.array([early]), np.array([late]), length)[0])
    return None if math.isnan(rate) else rate


def _growth_rates(early: Array, late: Array, length: float) -> Array:
    """Return `growth_rate` of many runs (P,), nan where nothing moves."""
    moving = (early > 0) & (late > 0) & np.isfinite(early) & np.isfinite(late)
    rates = np.full(len(early), np.nan)
    rates[moving] = log(late[moving] / early[moving]) / (length / 2)
    return rates


def figure_columns(
    sums: Array, index: Array, diverged: Array, reference: Reference, hold: float
) -> dict[str, Array]:
    """Return the figures of merit of P runs by name, those of `flexsim.loop.metrics.measures`.

    Args:
        sums: (P, SUMS). index: (P,) of (5). diverged: (P,) times of divergence [s], nan for none.
        reference, hold: of all the runs.

    Returns:
        (P,) each, nan where a run does not have the figure; diverged is 0 or 1.
    """
    finished, rows = np.isnan(diverged), sums[:, ROWS]
    start, middle = hold_samples(reference.time, hold)
    count, period = len(reference.time), float(reference.time[1] - reference.time[0])
    with np.errstate(divide="ignore", invalid="ignore"):  # a run that has no sample
        found = {
            "envelope": np.sqrt(sums[:, ENVELOPE]),
            "max_error": np.sqrt(sums[:, MOST_ERROR]),
            "rms_error": np.sqrt(sums[:, ERROR] / rows),
            "max_v": sums[:, MOST_V].copy(),
            "residual_v": np.full(len(rows), np.nan),
            "growth": np.full(len(rows), np.nan),
            "effort": sums[:, EFFORT] * period,
        }
        for joint in range(2):
            found[f"peak_torque_{joint + 1}"] = sums[:, PEAK + joint].copy()
            found[f"rms_torque_{joint + 1}"] = np.sqrt(sums[:, TORQUE + joint] / rows)
            found[f"variation_{joint + 1}"] = sums[:, VARIATION + joint].copy()
    for k, name in enumerate(PART_NAMES):
        found[name] = np.where(finished, sums[:, PARTS + k], np.inf)
    if hold > 0:
        early = np.sqrt(sums[:, EARLY_V] / max(middle - start, 1))
        late = np.sqrt(sums[:, LATE_V] / max(count - middle, 1))
        found["residual_v"] = np.where(finished, sums[:, RESIDUAL_V], np.nan)
        found["growth"] = np.where(finished, _growth_rates(early, late, hold), np.nan)
    for each in found.values():
        each[rows == 0] = np.nan
    return found | {"index": index, "diverged": ~finished, "diverged_at": diverged}


def figures(columns: dict[str, Array], run: int) -> dict[str, Any]:
    """Return one run's figures of merit, of those of many: None for what it does not have."""
    numbers = {name: float(each[run]) for name, each in columns.items() if name != "diverged"}
    found: dict[str, Any] = {name: None if math.isnan(x) else x for name, x in numbers.items()}
    found["diverged"] = bool(columns["diverged"][run])
    if found["rms_error"] is not None:
        return found
    return {name: found[name] for name in ("index", "diverged", "diverged_at")}
