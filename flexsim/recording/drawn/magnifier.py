"""How far the tips are off, magnified by a stated factor: a glass beside the map that follows them.

>>> glass = Glass(centre, factor=10.0)
>>> glass.seen(path, about)                 # the part of a path within the glass, magnified

One glass follows the reference and shows both tips about it; another follows the first plant's tip
and shows the second's. What is seen is moved and scaled only: directions and ratios are true.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexsim.numerics.types import Array
from flexsim.recording.panels import one_two_five

RADIUS = 0.105  # of a glass [m]
FULL = 0.95  # of it, which the largest deviation reaches
TRAIL = 0.2  # of a path that is seen [s]
TRAIL_STEP = 0.02  # [s]
LEAST, MOST = 1.0, 1e5  # factors


@dataclass(frozen=True, eq=False)
class Glass:
    """A circle on the map that shows what lies around a moving point.

    Attributes:
        centre: (2,) [m]. factor: of lengths. radius: [m].
    """

    centre: Array
    factor: float
    radius: float = RADIUS

    @property
    def shows(self) -> float:
        """Radius of what is seen [m]."""
        return self.radius / self.factor

    def circle(self, points: int = 73) -> Array:
        """Return the glass's rim, (points, 2) [m]."""
        angle = np.linspace(0, 2 * np.pi, points)
        return self.centre + self.radius * np.column_stack([np.cos(angle), np.sin(angle)])

    def placed(self, points: Array, about: Array) -> Array:
        """Return where the glass shows points (..., 2), followed points (..., 2) at its centre."""
        return self.centre + self.factor * (points - about)

    def holds(self, points: Array, about: Array) -> NDArray[np.bool_]:
        """Return whether points (..., 2) about others are seen."""
        away: Array = np.linalg.norm(points - about, axis=-1)
        return away <= self.shows

    def seen(self, path: Array, about: Array, now: int) -> Array:
        """Return the part of a path (P, 2) around its point `now` within the glass, (m, 2) [m]."""
        away = np.flatnonzero(np.logical_not(self.holds(path, about)))
        if (away == now).any():
            return np.zeros((0, 2))
        before, after = away[away < now], away[away > now]
        first = before[-1] + 1 if before.size else 0
        last = after[0] if after.size else len(path)
        return self.placed(path[first:last], about)


def factor_for(deviations: Array) -> float:
    """Return how often deviations [m] can be magnified, 1, 2 or 5 times a power of ten."""
    finite = deviations[np.isfinite(deviations)]
    largest = float(np.abs(finite).max()) if finite.size else 0.0
    if largest <= 0:
        return MOST
    return float(np.clip(one_two_five(FULL * RADIUS / largest), LEAST, MOST))


def trails(
    glass: Glass,
    paths: Sequence[tuple[Array, Array]],
    about: tuple[Array, Array],
    at: Array,
    ahead: Sequence[bool],
) -> list[list[Array]]:
    """Return what a glass shows of paths at times `at`: per time the part of each, (m, 2) [m].

    Args:
        paths: times (K,) [s] and points (K, 2) [m] of each. about: of what the glass follows.
        ahead: whether a path is also seen TRAIL ahead, as a reference is.
    """
    centre = np.column_stack([np.interp(at, about[0], about[1][:, i]) for i in range(2)])
    found = []
    for k, t in enumerate(at):
        row = []
        for (time, points), on in zip(paths, ahead, strict=True):
            row.append(_part(glass, time, points, centre[k], float(t), on))
        found.append(row)
    return found


def _part(glass: Glass, time: Array, points: Array, about: Array, t: float, ahead: bool) -> Array:
    """Return what is seen of one path at a time."""
    if not time.size or t > time[-1] + 1e-9:
        return np.zeros((0, 2))
    step = max(1, round(TRAIL_STEP / float(time[1] - time[0]))) if time.size > 1 else 1
    now = int(np.searchsorted(time, t - 1e-9))
    reach = round(TRAIL / TRAIL_STEP) * step
    first, last = max(0, now - reach), min(time.size - 1, now + reach * ahead)
    before = np.arange(now, first - 1, -step)[::-1]
    chosen = np.concatenate([before, np.arange(now + step, last + 1, step)])
    return glass.seen(points[chosen], about, len(before) - 1)
