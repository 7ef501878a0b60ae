"""From a bandwidth and angles to gains: what all forms of shaped controllers share.

k1, k2, k3 = gains(70.0, 0.6, 0.1, inertia=0.35, derivative=D, integral=J)

A joint whose other joint is held is a rigid inertia I [kg m2], 1/(I s^2). Its loop crosses at the
bandwidth omega_c where |C(j omega_c)| = I omega_c^2, C being the *digital* controller. There the
derivative part is tan(phi_1) times the proportional one, and the integral part tan(phi_2) times its
magnitude, each by the digital operator's own magnitude: where (2) has forgotten what an operator
is, the angles still say how much of each part there is.

    p = cos(phi_1) cos(phi_2), d = sin(phi_1) cos(phi_2), i = |cos(phi_1)| sin(phi_2)

Any three gains with a proportional part have such angles: phi_1 beyond pi/2 is a negative
proportional part, phi_2 below zero a negative integral one.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from controllers.errors import ControllerError, check_finite, check_positive
from controllers.knobs import Knob
from controllers.sections import Sections
from controllers.series import Filter

DIGITS = 12
"""Significant digits of a designed gain: what is beyond is a library's rounding."""
LEAST = 1e-6
"""Of a sum of parts of unit size: below, they cancel at the bandwidth."""
LOWEST, HIGHEST, GRID = 1e-4, 0.95 * math.pi, 600
"""Where a crossing is looked for, [rad/sample], and at how many frequencies."""

OMEGA_C = Knob("omega_c", "rad/s", 10.0, 150.0, True)
PHI_1 = Knob("phi_1", "rad", -0.5, 1.65, False)
PHI_2 = Knob("phi_2", "rad", -0.5, 1.5, False)


class Parts(NamedTuple):
    """Gains of the three parts of a joint's controller."""

    derivative: float
    """[N m s^nu1/rad]."""
    integral: float
    """[N m s^nu2/rad], nu2 below zero where it integrates."""
    proportional: float
    """[N m/rad]."""


def both(joint: Sequence[Knob]) -> tuple[Knob, ...]:
    """Return the knobs of both joints side by side, their names ending in _1 and _2."""
    return tuple(each._replace(name=f"{each.name}_{j}") for j in (1, 2) for each in joint)


def of_joints(
    knobs: Sequence[float], each: Sequence[Knob], inertias: Sequence[float]
) -> list[tuple[list[float], float]]:
    """Return the knobs of either joint, finite, with its inertia [kg m2].

    Args:
        knobs: of joint 1, then of joint 2. each: what one joint has. inertias: (I_1, I_2).

    Raises:
        ControllerError: there are too few or too many, or one is no finite number.
    """
    n = len(each)
    if len(knobs) != 2 * n or len(inertias) != 2:
        raise ControllerError(
            f"{len(knobs)} knobs and {len(inertias)} inertias are given; give {2 * n} knobs, "
            f"{', '.join(knob.name for knob in each)} of joint 1 and then of joint 2, and two "
            "inertias"
        )
    found = []
    for j in (0, 1):
        mine = [
            check_finite(f"{knob.name} of joint {j + 1}", value)
            for knob, value in zip(each, knobs[j * n : (j + 1) * n], strict=True)
        ]
        found.append((mine, check_positive(f"inertia of joint {j + 1}", inertias[j])))
    return found


def at(given: Filter | Sections, omega: float, period: float) -> complex:
    """Return a digital filter's response at one angular frequency [rad/s]."""
    delay = complex(math.cos(omega * period), -math.sin(omega * period))
    cascades = given.cascades if isinstance(given, Sections) else ((given,),)
    total = 0j
    for cascade in cascades:
        passed = 1 + 0j
        for b, a in cascade:
            passed *= _polynomial(b.tolist(), delay) / _polynomial(a.tolist(), delay)
        total += passed
    return total


def _polynomial(coefficients: list[float], delay: complex) -> complex:
    total = 0j
    for each in reversed(coefficients):
        total = total * delay + each
    return total


def shortened(number: float) -> float:
    """Return a number to DIGITS significant digits, the same on every machine."""
    return float(f"{number:.{DIGITS}g}")


def check_bandwidth(omega_c: float, period: float) -> float:
    """Return the bandwidth [rad/s].

    Raises:
        ControllerError: it is not above zero, or not below the Nyquist frequency.
    """
    nyquist = math.pi / check_positive("period", period)
    if not 0.0 < omega_c < nyquist:
        raise ControllerError(
            f"omega_c is {omega_c:g} rad/s; give more than 0 and less than pi/period = "
            f"{nyquist:g} rad/s"
        )
    return omega_c


def gains(
    omega_c: float,
    phi_1: float,
    phi_2: float,
    inertia: float,
    derivative: complex,
    integral: complex,
) -> Parts:
    """Return the gains with which |C(j omega_c)| = I omega_c^2.

    Args:
        omega_c: bandwidth [rad/s]. phi_1, phi_2: angles of the parts [rad].
        inertia: I [kg m2].
        derivative, integral: the digital operators' responses at omega_c [s^-nu].

    Raises:
        ControllerError: the parts cancel at omega_c, or an operator has no response there.
    """
    sizes = abs(derivative), abs(integral)
    if not all(0.0 < size < math.inf for size in sizes):
        raise ControllerError(f"an operator does not respond at omega_c = {omega_c:g} rad/s")
    p = math.cos(phi_1) * math.cos(phi_2)
    d = math.sin(phi_1) * math.cos(phi_2)
    i = abs(math.cos(phi_1)) * math.sin(phi_2)
    total = abs(p + d * derivative / sizes[0] + i * integral / sizes[1])
    if not total > LEAST:
        raise ControllerError(
            f"phi_1 = {phi_1:g} and phi_2 = {phi_2:g} rad cancel at omega_c = {omega_c:g} rad/s; "
            "change one of them"
        )
    k = inertia * omega_c**2 / total
    return Parts(shortened(k * d / sizes[0]), shortened(k * i / sizes[1]), shortened(k * p))


def angles(parts: Parts, derivative: complex, integral: complex) -> tuple[float, float]:
    """Return (phi_1, phi_2) [rad] of gains; the operators' responses as of `gains`.

    Raises:
        ControllerError: there is no proportional part, against which they are measured.
    """
    if parts.proportional == 0.0:
        raise ControllerError("without a proportional part there are no angles to it")
    d, i = parts.derivative * abs(derivative), parts.integral * abs(integral)
    return math.atan2(d, parts.proportional), math.atan(i / abs(parts.proportional))


def bandwidth(given: Filter | Sections, inertia: float, period: float) -> float:
    """Return the lowest omega_c [rad/s] at which |C(j omega_c)| = I omega_c^2.

    Raises:
        ControllerError: it never is.
    """

    def excess(angle: float) -> float:
        omega = angle / period
        size = abs(at(given, omega, period))
        return math.log(size / (inertia * omega**2)) if size > 0.0 else -math.inf

    grid = np.geomspace(LOWEST, HIGHEST, GRID).tolist()
    before, last = excess(grid[0]), grid[0]
    for angle in grid[1:]:
        now = excess(angle)
        if before > 0.0 >= now and math.isfinite(now):
            return float(brentq(excess, last, angle, xtol=1e-15)) / period
        before, last = now, angle
    raise ControllerError(
        f"the loop with an inertia of {inertia:g} kg m2 does not cross between "
        f"{LOWEST / period:g} and {HIGHEST / period:g} rad/s"
    )


def paired(
    joint: Callable[[Sequence[float], float, float], Filter | Sections],
    each: Sequence[Knob],
    knobs: Sequence[float],
    inertias: Sequence[float],
    period: float,
) -> tuple[Filter | Sections, Filter | Sections]:
    """Return the controllers of both joints, each by `joint(its knobs, its inertia, period)`."""
    first, second = (joint(*found, period) for found in of_joints(knobs, each, inertias))
    return first, second
