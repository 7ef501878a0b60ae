"""A robot's joint as the rules see it, and how what they design becomes digital.

    joint = RigidJoint(inertia=0.3177, delay=1.5e-3)
    joint.response(40.0)                       # exp(-j omega delay) / (I (j omega)^2)

With the other joint held and the beam not bending a joint is an inertia behind a dead time: half a
sample of the zero-order hold, and one sample for the computer. So it has no step response that is
S-shaped and no gain that is critical without more; `controllers.rules.valerio` says what is done
about it. Rules are of controllers in s; here they are Oustaloup's sections, scaled to the gain that
the rule wants at the bandwidth.
"""

import cmath
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.errors import ControllerError, check_finite, check_positive
from controllers.knobs import Knob
from controllers.pid import Gains, oustaloup_pid
from controllers.sections import Cascade, Sections
from controllers.shaped.long import HIGH, LOW, TERMS
from controllers.shaped.normalised import at, shortened

HELD_AND_COMPUTED = 1.5
"""Samples of dead time: half of the zero-order hold, one of the computer."""
PHI_M = Knob("phi_m", "rad", 0.4, 1.2, False)


class RigidJoint(NamedTuple):
    """An inertia behind a dead time, e^(-s delay) / (I s^2)."""

    inertia: float
    """I [kg m2]."""
    delay: float
    """[s]."""

    def response(self, omega: NDArray[np.float64] | float) -> NDArray[np.complex128]:
        """Return the response from torque to angle [rad/(N m)] at frequencies [rad/s]."""
        s = 1j * np.asarray(omega, dtype=float)
        return np.asarray(np.exp(-s * self.delay) / (self.inertia * s * s))

    def phase(self, omega: float) -> float:
        """Return the phase [rad]."""
        return -math.pi - omega * self.delay

    def slope(self, omega: float) -> float:
        """Return the phase's derivative over frequency [s]; it is the same at every one."""
        return -self.delay


def rigid_joint(inertia: float, period: float, delay: float | None) -> RigidJoint:
    """Return a joint with its loop's dead time, HELD_AND_COMPUTED samples unless given.

    Raises:
        ControllerError: a number is out of range.
    """
    T = check_positive("period", period)
    late = HELD_AND_COMPUTED * T if delay is None else check_finite("delay", delay)
    if late < 0.0:
        raise ControllerError(f"delay must be zero or more, got {delay!r} s")
    return RigidJoint(check_positive("inertia", inertia), late)


def ideal(gains: Gains, omega: float) -> complex:
    """Return k1 (j omega)^nu1 + k2 (j omega)^nu2 + k3."""
    s = 1j * omega
    total = complex(gains.k3)
    for k, nu in ((gains.k1, gains.nu1), (gains.k2, gains.nu2)):
        if k != 0.0 and nu is not None:
            total += k * cmath.exp(nu * cmath.log(s))
    return total


def digital(gains: Gains, omega_c: float, period: float) -> Sections:
    """Return a fractional PID as sections whose gain at omega_c [rad/s] is the ideal one's.

    Raises:
        ControllerError: a number is out of range, or omega_c is not below the band's upper edge.
    """
    check_in_band(omega_c, period)
    built = oustaloup_pid(gains, period, TERMS, LOW, HIGH / period)
    return scaled(built, abs(ideal(gains, omega_c)) / abs(at(built, omega_c, period)))


def check_in_band(omega_c: float, period: float) -> float:
    """Return the bandwidth [rad/s].

    Raises:
        ControllerError: the sections' band does not hold it.
    """
    if not LOW < omega_c < HIGH / period:
        raise ControllerError(
            f"omega_c is {omega_c:g} rad/s; give more than {LOW:g} and less than "
            f"{HIGH / period:g} rad/s, where sections still follow an operator"
        )
    return omega_c


def scaled(given: Sections, factor: float) -> Sections:
    """Return sections times a factor, each coefficient to as many digits as all machines share."""
    cascades: list[Cascade] = []
    for (b, a), *others in given.cascades:
        cascades.append(((np.array([shortened(factor * x) for x in b]), a), *others))
    return Sections(tuple(cascades))


def check_knobs(values: Sequence[float], knobs: Sequence[Knob]) -> list[float]:
    """Return one joint's knobs as floats.

    Raises:
        ControllerError: there are too few or too many, or one is not above zero.
    """
    if len(values) != len(knobs):
        raise ControllerError(
            f"{len(values)} knobs are given; give {', '.join(each.name for each in knobs)}"
        )
    return [check_positive(each.name, value) for each, value in zip(knobs, values, strict=True)]
