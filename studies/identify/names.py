"""Which numbers may be identified, by their names, and the coordinates in which they are searched.

    >>> free = free_numbers("EI,zeta,friction.tau_0", Robot(), setting("opposing"))
    >>> [each.name for each in free]
    ['EI', 'zeta', 'friction.tau_0_1', 'friction.tau_0_2']

A number that is not zero is searched by its logarithm over the nominal one, so that a coordinate is
a relative change; one that may be zero and is, in a unit of its own. All coordinates begin at 0.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.settings import Setting
from flexsim.numerics.types import Array
from flexsim.robot import Robot
from studies.identify.friction_names import (
    FRICTION,
    LEAST,
    SCALES,
    both_joints,
    friction_number,
    is_there,
    require_there,
    unit_of,
    with_friction,
)

RANGE = 10.0  # factor over and under the nominal number within which one is searched
LINEAR_MOST = 100.0  # coordinates of a number that begins at zero
SIGNED_LEAST = -0.9  # of friction that is less when cold or warm: all of it would be -1
LENGTHS = ("L_R", "r", "L")  # are measured with a rule: the kinematics of a log rest on them
OF_FILE = ("EI", "rho", "payload")  # that `Robot.changed` changes in an MJCF file
UNITS_AT_ZERO = {  # one coordinate of what is zero at first
    **{"I_m1": 1e-2, "I_m2": 1e-3, "zeta": 1e-3, "F_1": 1e-3, "F_2": 1e-3},
    **{"payload": 1e-2, "payload_inertia": 1e-4},
    **{"offset.v": 1e-3, "offset.theta1": 1e-3, "offset.theta2": 1e-3},
    **{"offset.strain1": 1e-5, "offset.strain2": 1e-5},
}
PAIRS = both_joints()
OUTPUTS = {  # of what is measured: gain times it, plus offset
    **{"offset.v": ("m", 0.0), "gain.v": ("-", 1.0)},
    **{f"gain.strain{i}": ("-", 1.0) for i in (1, 2)},
    **{f"offset.strain{i}": ("-", 0.0) for i in (1, 2)},
}
MOTORS = ("I_m1", "I_m2")  # that a setting may have its own of


@dataclass(frozen=True)
class Free:
    """A number that is to be identified.

    Attributes:
        name: as above. nominal: where the search begins. unit: of the number.
        scale: of a coordinate where the number is searched linearly, None by its logarithm.
        low, high: ends of the coordinate.
    """

    name: str
    nominal: float
    unit: str
    scale: float | None
    low: float
    high: float

    def value(self, z: float) -> float:
        """Return the number at a coordinate."""
        return self.nominal * math.exp(z) if self.scale is None else self.nominal + self.scale * z

    def coordinate(self, value: float) -> float:
        """Return the coordinate of a number."""
        return math.log(value / self.nominal) if self.scale is None else self._linear(value)

    def _linear(self, value: float) -> float:
        assert self.scale is not None
        return (value - self.nominal) / self.scale

    def interval(self, z: float, half: float) -> tuple[float, float]:
        """Return the numbers between which an interval of the coordinate, z +- half, lies."""
        most = 700.0 if self.scale is None else math.inf  # exp of more is no double
        least = self.low if self.bounded else -most
        ends = [self.value(min(max(each, least), most)) for each in (z - half, z + half)]
        return min(ends), max(ends)

    @property
    def bounded(self) -> bool:
        """Whether the range begins where the number can be no less, as at zero."""
        return self.scale is not None and self.low > -LINEAR_MOST


def free_numbers(names: str | Sequence[str], robot: Robot, chosen: Setting) -> tuple[Free, ...]:
    """Return the numbers of these names.

    Args:
        names: with commas between them, or one by one. robot, chosen: which have the nominal ones.

    Raises:
        ParameterError: none, a name that there is not or twice, or one that the robot's file has
            no number for.
    """
    listed = names.split(",") if isinstance(names, str) else list(names)
    given = [name.strip() for name in listed if name.strip()]
    if not given:
        raise ParameterError(
            "--free is empty; name the numbers to identify, as --free EI,zeta,F_1,friction.tau_0"
        )
    wanted = [each for name in given for each in PAIRS.get(name, (name,))]
    for name in wanted:
        if wanted.count(name) > 1:
            raise ParameterError(f"--free names {name} twice; name it once")
    return tuple(_free(name, robot, chosen) for name in wanted)


def known_names() -> tuple[str, ...]:
    """Return all names that may be free."""
    own = tuple(item.name for item in fields(Parameters) if item.name not in LENGTHS)
    return (*own, *FRICTION, *OUTPUTS)


def _free(name: str, robot: Robot, chosen: Setting) -> Free:
    if name not in known_names():
        known = {each.lower(): each for each in (*known_names(), *PAIRS)}
        near = difflib.get_close_matches(name.lower(), known, n=1)
        hint = f", perhaps {known[near[0]]}" if near else ""
        why = "; lengths are measured, not identified" if name in LENGTHS else hint
        raise ParameterError(
            f"--free {name}: there is no such number{why}; of setting {chosen.name} choose of "
            f"{', '.join(each for each in known_names() if _there(each, chosen))}"
        )
    if name in OUTPUTS:
        unit, nominal = OUTPUTS[name]
        return _searched(name, nominal, unit, signed=True)
    if name in FRICTION:
        require_there(name, chosen)
        return _of_friction(name, friction_number(chosen, name), unit_of(name, chosen))
    if robot.given is not None and name not in OF_FILE:
        raise ParameterError(
            f"--free {name}: {robot.given.source} has numbers of its own; of a file's robot "
            f"{', '.join(OF_FILE)}, friction and outputs may be free; or leave out --mjcf"
        )
    unit = next(item.metadata["unit"] for item in fields(Parameters) if item.name == name)
    return _searched(name, getattr(chosen.applied(robot.parameters), name), unit)


def _there(name: str, chosen: Setting) -> bool:
    return name not in FRICTION or is_there(name, chosen)


def _of_friction(name: str, nominal: float, unit: str) -> Free:
    """Return a number of friction with its range."""
    kind = FRICTION[name].field
    least, signed = LEAST.get(kind, 0.0), kind in ("cold", "warm")
    if not signed and least == 0.0 and nominal != 0.0:
        return Free(name, nominal, unit, None, -math.log(RANGE), math.log(RANGE))
    scale = -SCALES[kind] if name.endswith("_low") else SCALES[kind]
    low = ((SIGNED_LEAST if signed else least) - nominal) / scale
    return Free(name, nominal, unit, scale, low, LINEAR_MOST)


def _searched(name: str, nominal: float, unit: str, signed: bool = False) -> Free:
    """Return a number with its range: by its logarithm, or in a unit of its own."""
    if nominal != 0.0 and not signed:
        return Free(name, nominal, unit, None, -math.log(RANGE), math.log(RANGE))
    family = next((each for each in UNITS_AT_ZERO if name.startswith(each)), None)
    scale = UNITS_AT_ZERO[family] if family else 1.0
    return Free(name, nominal, unit, scale, -LINEAR_MOST if signed else 0.0, LINEAR_MOST)


def values_at(free: Sequence[Free], z: Array) -> dict[str, float]:
    """Return the numbers (p,) by their names at coordinates (p,)."""
    return {each.name: each.value(float(at)) for each, at in zip(free, z, strict=True)}


def robot_with(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return the robot with these of its numbers.

    Raises:
        ParameterError: a number that no robot has.
    """
    own = {name: value for name, value in values.items() if "." not in name}
    if not own:
        return robot
    p = robot.parameters
    if robot.given is not None:
        factors = {name: own[name] / getattr(p, name) for name in ("EI", "rho") if name in own}
        payload = own.get("payload", p.payload) - p.payload
        return robot.changed(factors.get("EI", 1.0), factors.get("rho", 1.0), payload)
    return replace(robot, parameters=replace(p, **own))


def setting_with(chosen: Setting, values: Mapping[str, float]) -> Setting:
    """Return the setting with these of its numbers, its motors' among them."""
    motors: dict[str, Any] = {
        name: values[name]
        for name in MOTORS
        if name in values and getattr(chosen, name) is not None
    }
    if motors:
        chosen = replace(chosen, **motors)
    return with_friction(chosen, values) if any(name in FRICTION for name in values) else chosen


def bounds_of(free: Sequence[Free]) -> tuple[Array, Array]:
    """Return the ends (p,), (p,) of the coordinates."""
    return np.array([each.low for each in free]), np.array([each.high for each in free])
