"""Figures of merit of a motion: Table 3's envelope half-width, the index (5), errors and v.

>>> measures(motion, reference)["envelope"]   # [m]
>>> along, across = along_across(tip - reference.tip, tangents(reference.tip))   # [m]
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from flexsim.loop.measuring import PART_NAMES, growth_rate, hold_samples
from flexsim.loop.motion import Motion
from flexsim.loop.trajectories import Reference
from flexsim.numerics.types import Array

STILL = 1e-9  # [m] between a sample's neighbours: less has no direction that rounding leaves
WEIGHTS = (1.0, 1.0, 1.0)  # of x, y and v in the index (5), unless told otherwise


def envelope_half_width(tip: ArrayLike, reference: ArrayLike) -> float:
    """Return the largest distance from a response point to the set of reference points [m].

    The directed Hausdorff distance: the radius of circles centred on the reference's points
    that together cover the response, as Table 3 defines it.

    Args:
        tip: (K, 2) response; reference: (M, 2) reference points [m].
    """
    distance, _ = cKDTree(np.asarray(reference)).query(np.asarray(tip))
    return float(distance.max())


def rms_distance(first: ArrayLike, second: ArrayLike) -> float:
    """Return the root-mean-square distance of points (K, 2), (K, 2), one by one [m]."""
    apart = np.asarray(first) - np.asarray(second)
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))


def tangents(reference: ArrayLike) -> Array:
    """Return the direction in which a reference goes at each of its samples (K, 2), of length 1.

    By central differences. Where the reference stands still the last direction is held, before it
    first moves the first; one that never moves goes along x.

    Args:
        reference: (K, 2) tip positions [m].
    """
    points = np.asarray(reference, dtype=float)
    if len(points) < 2:
        return np.tile([1.0, 0.0], (len(points), 1))
    padded = np.concatenate([points[:1], points, points[-1:]])
    way = padded[2:] - padded[:-2]
    length = np.hypot(*way.T)
    moving = np.flatnonzero(length > STILL)
    if not len(moving):
        return np.tile([1.0, 0.0], (len(points), 1))
    last = np.searchsorted(moving, np.arange(len(points)), side="right") - 1
    held = moving[np.maximum(last, 0)]
    return way[held] / length[held, None]


def along_across(difference: ArrayLike, tangent: Array) -> tuple[Array, Array]:
    """Return the parts of differences (..., K, 2) along and across a path (..., K), in their unit.

    Across is positive to the left of the path's direction.

    Args:
        difference: of the tip from its reference, or of two tips. tangent: (K, 2), see `tangents`.
    """
    x, y = np.moveaxis(np.asarray(difference, dtype=float), -1, 0)
    tx, ty = tangent.T
    return x * tx + y * ty, y * tx - x * ty


def performance_index(motion: Motion, weights: ArrayLike = WEIGHTS) -> float:
    """Return the performance index (5) of a motion [m2 s], trapezoidal rule; inf if diverged.

    Args:
        motion: with every control sample; weights: of x, y and v.
    """
    return float(sum(index_parts(motion, weights)))


def index_parts(motion: Motion, weights: ArrayLike = WEIGHTS) -> tuple[float, float, float]:
    """Return what x, y and v add to the index (5) [m2 s]; all inf if diverged.

    Args: as of `performance_index`.
    """
    if motion.diverged is not None:
        return (float("inf"),) * 3
    wx, wy, wv = np.asarray(weights, dtype=float)
    dx, dy = (motion.tip - motion.reference_tip).T
    integrands = wx * dx**2, wy * dy**2, wv * motion.time**2 * (motion.v**2) ** 2  # (5)
    x, y, v = (float(np.trapezoid(each, motion.time)) for each in integrands)
    return x, y, v


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def measures(motion: Motion, reference: Reference, hold: float = 0.0) -> dict[str, Any]:
    """Return the figures of merit of a motion, in SI units.

    Args:
        motion: recorded at every sample; reference: all of it, also after a divergence.
        hold: length of the hold at the end [s], over which residual v is taken.

    Returns:
        envelope, max_error, rms_error (simultaneous tip error), max_v, residual_v, growth (rate at
        which v's rms grows from the first half of the hold to the second [1/s], above 0 where a
        run still grows at its end, None without a hold or motion), index, diverged (bool),
        diverged_at ([s] or None); of the torques that the controllers command: effort (integral
        of tau'tau [N2 m2 s], each held until the next sample), and for joints 1 and 2
        peak_torque_1, rms_torque_1 [N m], variation_1 (sum of the changes' sizes [N m]) and so
        on; index_x, index_y, index_v, the parts of the index [m2 s]. A diverged motion's numbers
        describe its part before divergence, except the index and its parts, which are inf.
    """
    if len(motion.time) == 0:
        return {"diverged": True, "diverged_at": motion.diverged, "index": float("inf")}
    error = np.linalg.norm(motion.tip - motion.reference_tip, axis=1)
    start, middle = hold_samples(reference.time, hold)
    finished = motion.diverged is None
    held = finished and hold > 0
    period = float(reference.time[1] - reference.time[0])
    torque = motion.torque
    with np.errstate(over="ignore", invalid="ignore"):  # a runaway's
        effort = period * float(np.sum(torque[:-1] ** 2))
        by_joint = {
            "peak_torque": np.abs(torque).max(axis=0),
            "rms_torque": np.sqrt(np.mean(torque**2, axis=0)),
            "variation": np.abs(np.diff(torque, axis=0)).sum(axis=0),
        }
    return {
        "envelope": envelope_half_width(motion.tip, reference.tip),
        "max_error": float(error.max()),
        "rms_error": float(np.sqrt(np.mean(error**2))),
        "max_v": float(np.abs(motion.v).max()),
        "residual_v": float(np.abs(motion.v[start:]).max()) if held else None,
        "growth": growth_rate(_rms(motion.v[start:middle]), _rms(motion.v[middle:]), hold)
        if held
        else None,
        "effort": effort,
        **{f"{name}_{j + 1}": float(each[j]) for name, each in by_joint.items() for j in (0, 1)},
        **dict(zip(PART_NAMES, index_parts(motion), strict=True)),
        "index": performance_index(motion),
        "diverged": not finished,
        "diverged_at": motion.diverged,
    }
