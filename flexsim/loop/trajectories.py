"""Reference trajectories of the tip: the paper's three kinds, at coordinates we *assume*.

The paper draws a line, a two-loop figure and a circle without saying where, how large or how
fast. Ours follow a quintic time law, at rest at both ends, and then hold; every number can be
changed with `dataclasses.replace`. `reconstructed` trajectories are those of the fit in which the
paper's Table 2 is bounded: constant speed, started at rest on the reference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from flexsim.arm.kinematics import joint_angles, tip_position
from flexsim.arm.locked import LOCKED
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.elementary import cos, sin
from flexsim.numerics.types import Array

SHAPES = ("line", "two-loop", "circle")
TIME_LAWS = ("quintic", "constant-speed")


WHOLE = 1e-6  # of a period: what rounding makes of a whole number of them
STANDS = 1e-9  # [rad] that rounding turns a joint by


@dataclass(frozen=True)
class Trajectory:
    """A path, its time law and a hold at its end.

    Attributes:
        shape: 'line' (start to end), 'two-loop' (x = cx + a sin phi, y = cy + b sin 2 phi) or
            'circle' (of radius a, started at phi = 0).
        duration: of the path [s].
        hold: rest at its end [s].
        time_law: 'quintic' or 'constant-speed' (phi linear in time).
        start: of the line [m].
        end: of the line [m].
        centre: (cx, cy) of two-loop and circle [m].
        half_width: a of two-loop and circle [m].
        half_height: b of two-loop [m].
        name: for tables; the shape's name unless given.
        lead: rest before the start [s].

    Raises:
        ParameterError: an unknown shape or time law, or a number that cannot be used.
    """

    shape: str
    duration: float = 4.0
    hold: float = 1.0
    time_law: str = "quintic"
    start: tuple[float, float] = (0.70, 0.20)
    end: tuple[float, float] = (0.30, 0.60)
    centre: tuple[float, float] = (0.55, 0.35)
    half_width: float = 0.15
    half_height: float = 0.12
    name: str = field(default="")
    lead: float = 0.0

    def __post_init__(self) -> None:
        for label, value, names in (
            ("trajectory", self.shape, SHAPES),
            ("time law", self.time_law, TIME_LAWS),
        ):
            if value not in names:
                raise ParameterError(
                    f"{label} {value!r} is unknown; choose one of {', '.join(names)}"
                )
        if not (0 < self.duration < math.inf and 0 <= self.hold < math.inf):
            raise ParameterError(
                f"trajectory lasts {self.duration} s and holds {self.hold} s; "
                "give a duration over 0 and a hold of 0 or more"
            )
        if not 0 <= self.lead < math.inf:
            raise ParameterError(f"trajectory has a lead of {self.lead} s; give 0 or more")
        if not (0 < self.half_width < math.inf and 0 < self.half_height < math.inf):
            raise ParameterError("half width and half height must be finite and more than 0 [m]")
        for label in ("start", "end", "centre"):
            point = getattr(self, label)
            if len(point) != 2 or not all(math.isfinite(value) for value in point):
                raise ParameterError(f"{label} is {point}; give two finite numbers [m]")
        if not self.name:
            object.__setattr__(self, "name", self.shape)

    @property
    def end_time(self) -> float:
        """Lead, duration and hold together [s]."""
        return self.lead + self.duration + self.hold

    def at(self, time: Array) -> Array:
        """Return the reference tip (K, 2) [m] at times (K,) [s]."""
        u = np.clip((np.asarray(time) - self.lead) / self.duration, 0.0, 1.0)
        if self.time_law == "quintic":
            u = quintic(u)
        if self.shape == "line":
            start, end = np.array(self.start), np.array(self.end)
            return start + u[:, None] * (end - start)
        phi = 2 * np.pi * u
        cx, cy = self.centre
        if self.shape == "circle":
            return np.stack(
                [cx + self.half_width * cos(phi), cy + self.half_width * sin(phi)], axis=-1
            )
        return np.stack(
            [cx + self.half_width * sin(phi), cy + self.half_height * sin(2 * phi)], axis=-1
        )


@dataclass(frozen=True)
class Turn:
    """A turn of the joints, one at least, by the quintic time law, and a hold at its end.

    Attributes:
        start, end: joint angles (theta1, theta2) [rad]. duration, hold, lead: as of `Trajectory`.
        name: for tables.

    Raises:
        ParameterError: a number that cannot be used.
    """

    start: tuple[float, float] = (0.0, 0.0)
    end: tuple[float, float] = (0.0, math.pi / 2)
    duration: float = 2.0
    hold: float = 1.0
    lead: float = 0.0
    name: str = "turn"

    def __post_init__(self) -> None:
        for label in ("start", "end"):
            angles = getattr(self, label)
            if len(angles) != 2 or not all(math.isfinite(value) for value in angles):
                raise ParameterError(f"{label} is {angles}; give two finite angles [rad]")
        if not (0 < self.duration < math.inf and 0 <= self.hold < math.inf):
            raise ParameterError(
                f"turn lasts {self.duration} s and holds {self.hold} s; "
                "give a duration over 0 and a hold of 0 or more"
            )
        if not 0 <= self.lead < math.inf:
            raise ParameterError(f"turn has a lead of {self.lead} s; give 0 or more")

    @property
    def end_time(self) -> float:
        """Lead, duration and hold together [s]."""
        return self.lead + self.duration + self.hold

    def joints(self, time: Array) -> Array:
        """Return the reference joint angles (K, 2) [rad] at times (K,) [s]."""
        gone = quintic(np.clip((np.asarray(time) - self.lead) / self.duration, 0.0, 1.0))
        start, end = np.array(self.start), np.array(self.end)
        return start + gone[:, None] * (end - start)


class Path(Protocol):
    """What a reference is sampled from: a `Trajectory`, or `flexsim.loop.waypoints.Waypoints`."""

    @property
    def name(self) -> str:
        """For tables."""

    @property
    def hold(self) -> float:
        """Rest at the end [s]."""

    @property
    def end_time(self) -> float:
        """All of its length [s]."""

    def at(self, time: Array) -> Array:
        """Return the reference tip (K, 2) [m] at times (K,) [s]."""


def quintic(u: Array) -> Array:
    """Return the share of a way that is gone at a share of the time, at rest at both ends."""
    return u * u * u * (10 + u * (6 * u - 15))


@dataclass(frozen=True, eq=False)
class Reference:
    """A trajectory sampled at the control period: time (K+1,), tip and joint (K+1, 2).

    torque: (K+1, 2) [N m], fed forward: added to what the controllers of both joints give, before
    friction and limits; None for none. `replace(reference, torque=mine)` adds one.
    """

    time: Array
    tip: Array
    joint: Array
    torque: Array | None = None


def reference(trajectory: Path | Turn, parameters: Parameters, period: float = PERIOD) -> Reference:
    """Return the sampled reference with its rigid inverse kinematics, of a turn the tip instead.

    Raises:
        ParameterError: the control period is not positive, a point is out of reach or singular, or
            joint 1 is to turn, which stands still in this robot.
    """
    if not 0 < period < math.inf:
        raise ParameterError(f"control period is {period} s; give more than 0")
    samples = math.ceil(trajectory.end_time / period - WHOLE)  # the end is in the last period
    time = period * np.arange(samples + 1, dtype=float)
    if isinstance(trajectory, Turn):
        turned = trajectory.joints(time)
        return _able(
            trajectory, parameters, Reference(time, tip_position(parameters, turned), turned)
        )
    tip = trajectory.at(time)
    try:
        found = Reference(time, tip, joint_angles(parameters, tip))
    except ParameterError as error:
        raise ParameterError(f"trajectory {trajectory.name!r}: {error}") from None
    return _able(trajectory, parameters, found)


def _able(trajectory: Path | Turn, parameters: Parameters, found: Reference) -> Reference:
    """Return a reference that a robot whose joint 1 may stand still is able to follow.

    Raises:
        ParameterError: it turns that joint.
    """
    first = found.joint[:, 0]
    if parameters.I_m1 >= LOCKED and np.ptp(first) > STANDS:
        raise ParameterError(
            f"trajectory {trajectory.name!r} turns joint 1 by {np.ptp(first):.3g} rad, and joint 1 "
            "of this arm stands still; give one that turns joint 2 alone, as turn"
        )
    return found


CIRCLE = Trajectory("circle", half_width=0.12)
TRAJECTORIES = {
    "line": Trajectory("line"),
    "two-loop": Trajectory("two-loop"),
    "circle": CIRCLE,
}

_FITTED = {"duration": 5.79, "hold": 0.0, "time_law": "constant-speed"}
_HALF = 0.45 / 2 / math.sqrt(2)  # of the 0.45 m line, along each axis
RECONSTRUCTED_TRAJECTORIES = {  # sizes from the fit; placed where medians come near Table 3
    "line": replace(
        TRAJECTORIES["line"],
        start=(0.55 + _HALF, 0.35 - _HALF),
        end=(0.55 - _HALF, 0.35 + _HALF),
        **_FITTED,  # type: ignore[arg-type]
    ),
    "two-loop": replace(  # in the proportions of ours
        TRAJECTORIES["two-loop"],
        centre=(0.45, 0.30),
        half_width=0.052,
        half_height=0.052 * 0.12 / 0.15,
        **_FITTED,  # type: ignore[arg-type]
    ),
    "circle": replace(CIRCLE, half_width=0.061, **_FITTED),  # type: ignore[arg-type]
}


TURN = Turn()  # of joint 2 by a right angle, for an arm whose joint 1 stands still


def path_named(name: str, reconstructed: bool = False) -> Trajectory | Turn:
    """Return the named trajectory, or the turn; errors as `trajectory`."""
    return TURN if name == TURN.name else trajectory(name, reconstructed)


def trajectory(name: str, reconstructed: bool = False) -> Trajectory:
    """Return the named trajectory, or its counterpart in the fit to Table 3.

    Raises:
        ParameterError: there is none of that name.
    """
    table = RECONSTRUCTED_TRAJECTORIES if reconstructed else TRAJECTORIES
    if name not in table:
        raise ParameterError(f"trajectory {name!r} is unknown; choose one of {', '.join(table)}")
    return table[name]
