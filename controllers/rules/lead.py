"""A fractional lead by its phase margin over a range of payloads.

    alpha = order(omega_c=40.0, phi_m=0.8, heavier=2.0, edge=5.0, high=2513.0, delay=1.5e-3)
    c1, c2 = design(knobs, inertias=(0.35, 0.011), period=1e-3)

C(s) = k ((1 + s/low) / (1 + s/high))^alpha: with an inertia I the loop k s^alpha / (I s^2) has the
phase margin alpha pi/2 *wherever* it crosses, so a payload, which makes I larger and the crossing
omega_c (I/I')^(1/(2 - alpha)) lower, leaves the overshoot alone. With the band's edges and a dead
time the margin is

    alpha (atan(omega/low) - atan(omega/high)) - omega delay,

and the order is the least that gives phi_m at both ends of the range of crossings, from the
unladen joint's omega_c to that of `heavier` times its inertia; in between it is no less, since this
is concave in omega up to sqrt(low high) at least. `low` is a factor `edge` below the lowest
crossing: below it the lead is a spring, as a joint with dry friction needs.

Source: the flat margin of s^alpha on a double integrator is Bode's ideal loop; for single-link
flexible arms with changing payloads: C. A. Monje, F. Ramos, V. Feliu, B. M. Vinagre, Tip position
control of a lightweight flexible manipulator using a fractional order controller, IET Control
Theory Appl. 1 (2007) 1451-1460; the fractional lead with its corners: Monje, Vinagre, Feliu, Chen,
Control Eng. Practice 16 (2008) 798-812; both from memory, not checked against the print. The
formulas are derived here and tested. Assumed: the beam does not bend, the other joint is held.
"""

import math
from collections.abc import Sequence

import numpy as np

from controllers.errors import ControllerError, check_positive
from controllers.knobs import Knob
from controllers.oustaloup import oustaloup_cascade
from controllers.rules.joint import PHI_M, check_knobs, rigid_joint, scaled
from controllers.sections import Sections
from controllers.shaped.long import HIGH, TERMS
from controllers.shaped.normalised import OMEGA_C, at, both, paired, shortened

HEAVIER = Knob("inertia_ratio", "-", 1.0, 3.0, True)
EDGE = Knob("edge", "-", 2.0, 10.0, True)
JOINT = (OMEGA_C, PHI_M, HEAVIER, EDGE)
KNOBS = both(JOINT)
ALPHA_MOST = 1.9
"""Order up to which there is a loop: at 2 it would cross nowhere."""
ROUNDS = 60
"""Of the order and the lowest crossing by turns; twenty are usual."""
SETTLED = 1e-9
"""Change of the order between two rounds."""


def order(
    omega_c: float, phi_m: float, heavier: float, edge: float, high: float, delay: float
) -> float:
    """Return the least alpha with a phase margin of phi_m for all inertias of a range.

    Args:
        omega_c: crossing with the least inertia [rad/s]. phi_m: phase margin [rad].
        heavier: largest over least inertia, 1 or more. edge: lowest crossing over `low`.
        high: upper corner [rad/s]. delay: dead time [s].

    Raises:
        ControllerError: a number is out of range, or no order up to ALPHA_MOST has that margin.
    """
    w, rho = check_positive("omega_c", omega_c), check_positive("inertia_ratio", heavier)
    if rho < 1.0:
        raise ControllerError(f"inertia_ratio is {rho:g}; give 1 or more, heaviest over lightest")
    alpha, before = 1.0, math.inf
    for _ in range(ROUNDS):
        lowest = lowest_crossing(w, rho, alpha)
        low = lowest / edge
        needed = 0.0
        for omega in (w, lowest):
            lead = math.atan(omega / low) - math.atan(omega / high)
            needed = max(needed, (phi_m + omega * delay) / lead if lead > 0.0 else math.inf)
        alpha, before = needed, alpha
        if not alpha < ALPHA_MOST or abs(alpha - before) < SETTLED:
            break
    if not alpha < ALPHA_MOST or abs(alpha - before) >= SETTLED:
        raise ControllerError(
            f"a phase margin of {math.degrees(phi_m):.3g} degrees at {w:g} rad/s takes an order of "
            f"{ALPHA_MOST:g} or more; choose a lower omega_c, phi_m or inertia_ratio, or a wider "
            "edge"
        )
    return alpha


def lowest_crossing(omega_c: float, heavier: float, alpha: float) -> float:
    """Return where k s^alpha / (I s^2) crosses with `heavier` times the inertia [rad/s]."""
    return float(omega_c * heavier ** (-1.0 / (2.0 - alpha)))


def design(
    knobs: Sequence[float],
    inertias: Sequence[float],
    period: float,
    delay: float | None = None,
) -> tuple[Sections, Sections]:
    """Return the controllers of both joints.

    Args:
        knobs: (8,) as KNOBS: omega_c [rad/s], phase margin phi_m [rad], largest over least inertia,
            lowest crossing over `low`, of joint 1, then of joint 2.
        inertias: (I_1, I_2) without a payload [kg m2]. period: [s].
        delay: the loop's dead time [s]; one and a half samples unless given.

    Raises:
        ControllerError: an argument is out of range, or there is no such controller.
    """

    def joint(mine: Sequence[float], inertia: float, T: float) -> Sections:
        return joint_lead(mine, inertia, T, delay)

    return paired(joint, JOINT, knobs, inertias, period)  # type: ignore[return-value]


def corners(knobs: Sequence[float], period: float, delay: float) -> tuple[float, float, float]:
    """Return alpha, low and high [rad/s] of one joint's lead from its knobs (4,)."""
    omega_c, phi_m, heavier, edge = check_knobs(knobs, JOINT)
    high = HIGH / period
    alpha = shortened(round(order(omega_c, phi_m, heavier, edge, high, delay), 9))
    low = lowest_crossing(omega_c, heavier, alpha) / edge
    if not omega_c < high:
        raise ControllerError(
            f"omega_c is {omega_c:g} rad/s; give less than the upper corner, {high:g} rad/s"
        )
    return alpha, low, high


def joint_lead(
    knobs: Sequence[float], inertia: float, period: float, delay: float | None = None
) -> Sections:
    """Return one joint's lead from its knobs (4,): two cascades of alpha/2 in series."""
    late = rigid_joint(inertia, period, delay).delay
    alpha, low, high = corners(knobs, period, late)
    half = oustaloup_cascade(alpha / 2.0, period, TERMS, low, high)
    built = Sections(((*half, *half),))
    wanted = inertia * knobs[0] ** 2
    return scaled(built, wanted / abs(at(built, knobs[0], period)))


def margin(alpha: float, low: float, high: float, omega: float, delay: float) -> float:
    """Return the phase margin [rad] where the loop crosses at omega [rad/s]."""
    return alpha * float(np.arctan(omega / low) - np.arctan(omega / high)) - omega * delay


def numbers(
    knobs: Sequence[float], inertia: float, period: float, delay: float | None = None
) -> dict[str, float]:
    """Return what one joint's design comes to, by name [SI]."""
    alpha, low, high = corners(knobs, period, rigid_joint(inertia, period, delay).delay)
    omega_c = knobs[0]
    size = math.hypot(1.0, omega_c / low) / math.hypot(1.0, omega_c / high)
    k = shortened(inertia * omega_c**2 / size**alpha)
    return {"k": k, "alpha": alpha, "low": low, "high": high}
