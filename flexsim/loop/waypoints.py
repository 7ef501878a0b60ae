"""Paths through points of one's own, by four time laws, from rest to rest.

>>> way = Waypoints(((0.70, 0.20), (0.55, 0.45), (0.30, 0.60)), law="minimum-jerk", duration=4.0)
>>> reference(way, Parameters())

| law | between the points | at the points |
|---|---|---|
| quintic | straight, a quintic of the length gone | rest at both ends; with `times`, at each |
| constant-speed | straight | corners, which a beam can only follow roughly |
| spline | cubic splines x(t), y(t) | continuous acceleration, velocity zero at both ends |
| minimum-jerk | quintic splines | the least integral of squared jerk; rest at both ends |

Source: T. Flash and N. Hogan, The coordination of arm movements, J. Neurosci. 5 (1985), whose
minimum between two points is the quintic; through points, with their times given, it is the spline
of order six with continuous fourth derivative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from flexsim.errors import ParameterError
from flexsim.loop.trajectories import quintic
from flexsim.numerics.dense import product, solve
from flexsim.numerics.types import Array

LAWS = ("quintic", "constant-speed", "spline", "minimum-jerk")
DEGREE = {"spline": 3, "minimum-jerk": 5}
POINTS_MOST = 1000  # the splines' equations are solved as one dense system


@dataclass(frozen=True)
class Waypoints:
    """Points that the tip passes, and when.

    Attributes:
        points: two or more, (x, y) each [m]; two in a row differ.
        law: see above. duration: from the first to the last [s].
        times: at each point, from 0 to the duration [s]; unless given, each leg takes its share of
            the length.
        lead, hold: rest before and after [s]. name: for tables.

    Raises:
        ParameterError: an unknown law, too few or too many points, or a number out of range.
    """

    points: tuple[tuple[float, float], ...]
    law: str = "minimum-jerk"
    duration: float = 4.0
    times: tuple[float, ...] = ()
    lead: float = 0.0
    hold: float = 1.0
    name: str = "waypoints"

    def __post_init__(self) -> None:
        if self.law not in LAWS:
            raise ParameterError(f"law {self.law!r} is unknown; choose one of {', '.join(LAWS)}")
        if not 2 <= len(self.points) <= POINTS_MOST:
            raise ParameterError(f"{len(self.points)} points; give 2 to {POINTS_MOST}")
        for number, (one, other) in enumerate(zip(self.points, self.points[1:], strict=False)):
            if one == other:
                raise ParameterError(
                    f"points {number} and {number + 1} are the same, {one}; leave one out, and "
                    "use hold to wait"
                )
        if not all(len(each) == 2 and all(map(math.isfinite, each)) for each in self.points):
            raise ParameterError("points are pairs (x, y) of finite numbers [m]")
        if not (0 < self.duration < math.inf):
            raise ParameterError(f"duration is {self.duration} s; give more than 0")
        if not all(0 <= each < math.inf for each in (self.lead, self.hold)):
            raise ParameterError(f"lead is {self.lead} s, hold {self.hold} s; give 0 or more")
        if self.times and not self._timed():
            raise ParameterError(
                f"times are {len(self.times)} for {len(self.points)} points; give one for each, "
                f"rising from 0 to the duration, {self.duration:g} s"
            )

    def _timed(self) -> bool:
        """Return whether the times are one for each point, rising from 0 to the duration."""
        rising = all(a < b for a, b in zip(self.times, self.times[1:], strict=False))
        ends = len(self.times) == len(self.points) and (self.times[0], self.times[-1])
        return rising and ends == (0.0, self.duration)

    @property
    def end_time(self) -> float:
        """Lead, duration and hold together [s]."""
        return self.lead + self.duration + self.hold

    @property
    def lengths(self) -> Array:
        """Length of the way up to each point (n,) [m]."""
        return np.append(0.0, np.cumsum(np.hypot(*np.diff(np.array(self.points), axis=0).T)))

    @property
    def knots(self) -> Array:
        """Times at the points (n,) [s]."""
        if self.times:
            return np.array(self.times, dtype=float)
        return self.duration * (self.lengths / self.lengths[-1])

    def at(self, time: Array) -> Array:
        """Return the reference tip (K, 2) [m] at times (K,) [s]."""
        t = np.clip(np.asarray(time) - self.lead, 0.0, self.duration)
        found = self._curve(t) if self.law in DEGREE else self._straight(t)
        points = np.array(self.points)
        found[t <= 0.0], found[t >= self.duration] = points[0], points[-1]  # without rounding
        return found

    def _straight(self, t: Array) -> Array:
        """Return points (K, 2) on straight legs."""
        knots, points = self.knots, np.array(self.points)
        if self.law == "quintic" and not self.times:
            gone = self.lengths[-1] * quintic(t / self.duration)
            knots = self.lengths
        else:
            leg = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2)
            u = (t - knots[leg]) / (knots[leg + 1] - knots[leg])
            gone = leg + (quintic(u) if self.law == "quintic" else u)
            knots = np.arange(len(points), dtype=float)
        return np.stack([np.interp(gone, knots, points[:, i]) for i in range(2)], axis=1)

    def _curve(self, t: Array) -> Array:
        """Return points (K, 2) on splines that rest at both ends, velocity and, of six, more."""
        degree, knots, count = DEGREE[self.law], self.knots, len(self.points)
        ends = np.repeat(knots[[0, -1]], degree + 1)
        places = np.concatenate([ends[: degree + 1], knots[1:-1], ends[degree + 1 :]])
        size = count + degree - 1
        bases = BSpline(places, np.eye(size), degree)
        rests = range(1, degree // 2 + 1)  # derivatives that vanish at both ends
        rows = [bases(knots)] + [bases.derivative(order)(knots[[0, -1]]) for order in rests]
        right = np.zeros((size, 2))
        right[:count] = self.points
        scale = [np.abs(each).max(axis=1, keepdims=True) for each in rows]
        matrix = np.concatenate([each / most for each, most in zip(rows, scale, strict=True)])
        right[:count] /= scale[0]
        return product(bases(t), solve(matrix, right))
