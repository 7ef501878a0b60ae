"""Errors of the tip along and across its path: what lags behind, and what leaves the path.

>>> along, across = split(tip - reference_tip, tangents(reference_tip))   # [m]
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexsim.numerics.types import Array

STILL = 1e-9  # [m] between a sample's neighbours: less has no direction that rounding leaves


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


def split(difference: ArrayLike, tangent: Array) -> tuple[Array, Array]:
    """Return the parts of differences (..., K, 2) along and across a path (..., K), in their unit.

    Across is positive to the left of the path's direction.

    Args:
        difference: of the tip from its reference, or of two tips. tangent: (K, 2), see `tangents`.
    """
    x, y = np.moveaxis(np.asarray(difference, dtype=float), -1, 0)
    tx, ty = tangent.T
    return x * tx + y * ty, y * tx - x * ty
