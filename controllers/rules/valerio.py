"""Valerio and Sa da Costa's rules of the Ziegler-Nichols kind for fractional PIDs.

    s_shaped(delay=0.1, time=1.0)              # P, I, lambda, D, mu of P + I s^-lambda + D s^mu
    critical(gain=16.4, period=0.39)
    c1, c2 = design(knobs, inertias=(0.35, 0.011), period=1e-3)          # by the S-shaped response

The rules are polynomials fitted to controllers that minimise a loop's gain near 10 rad/s under four
conditions more: the loop with e^(-L s) / (1 + T s) crosses at 0.5 rad/s with a phase margin of 2/3
rad, the sensitivity is at most -20 dB at 0.01 rad/s and the complementary one -10 dB at 10 rad/s,
whatever the plant. So they are of plants with a gain of one and with times in a unit in which the
crossing wanted is 0.5.

**A joint has no S-shaped step response**: it is an inertia. So the rule is given the joint closed
by a loop of its angle and rate, critically damped, omega_i^2 / (s + omega_i)^2 from its command to
its angle; that response is S-shaped, with the tangent in its inflection at T = e / omega_i and L =
(3 - e) / omega_i and the loop's own dead time. Time is counted in units of 0.5 / omega_c. What is
returned is both loops as one controller of the joint's error: the loop around the joint is the
same, and the inner loop's angle and rate are then also compared with their references.

Source: D. Valerio, J. Sa da Costa, Tuning of fractional PID controllers with Ziegler-Nichols-type
rules, Signal Processing 86 (2006) 2771-2784. Tables are from memory, not checked against the print;
what supports them is that they give to all four digits the authors' controller of e^(-0.1 s)/(1+s),
0.4448 + 0.5158 s^-1.4277 + 0.2045 s^1.0202, and, over their range, the conditions they were fitted
to (tests/controllers/rules/test_valerio.py). The paper's second set of S-shaped rules did not pass
that test as remembered, and is left out.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from controllers.errors import ControllerError, check_positive
from controllers.knobs import Knob
from controllers.pid import Gains, textbook_pid
from controllers.rules.joint import check_in_band, check_knobs, digital, rigid_joint, scaled
from controllers.sections import Sections
from controllers.shaped.normalised import both, paired

CROSSING, MARGIN = 0.5, 2.0 / 3.0
"""What the rules are fitted to: crossing [1/unit of time] and phase margin [rad]."""
RATE_FILTER = 10.0
"""Corner of the inner loop's rate over omega_i."""
PERIOD_LEAST = 0.15
"""Of a critical period, ours: below it the rule's terms in its inverse rule alone."""

# rows: 1, L, T, L^2, T^2, L T; columns: P, I, lambda, D, mu
_SHORT = np.array(  # 0.1 <= T <= 5
    [
        [-0.0048, 0.3254, 1.5766, 0.0662, 0.8736],
        [0.2664, 0.2478, -0.2098, -0.2528, 0.2746],
        [0.4982, 0.1429, -0.1313, 0.1081, 0.1489],
        [0.0232, -0.1330, 0.0713, 0.0702, -0.1557],
        [-0.0720, 0.0258, 0.0016, 0.0328, -0.0250],
        [-0.0348, -0.0171, 0.0114, 0.2202, -0.0323],
    ]
)
_LONG = np.array(  # 5 <= T <= 50
    [
        [2.1187, -0.5201, 1.0645, 1.1421, 1.2902],
        [-3.5207, 2.6643, -0.3268, -1.3707, -0.5371],
        [-0.1563, 0.3453, -0.0229, 0.0357, -0.0381],
        [1.5827, -1.0944, 0.2018, 0.5552, 0.2208],
        [0.0025, 0.0002, 0.0003, -0.0002, 0.0007],
        [0.1824, -0.1054, 0.0028, 0.2630, -0.0014],
    ]
)
# rows: 1, K, P, 1/K, 1/P of the critical gain and period; columns as above
_LOW = np.array(  # K P <= 64
    [
        [0.4139, 0.7067, 1.3240, 0.2293, 0.8804],
        [0.0145, 0.0101, -0.0081, 0.0153, -0.0048],
        [0.1584, -0.0049, -0.0163, 0.0936, 0.0061],
        [-0.4384, -0.2951, 0.1393, -0.5293, 0.0749],
        [-0.0855, -0.1001, 0.0791, -0.0440, 0.0810],
    ]
)
_HIGH = np.array(  # 64 <= K P <= 640
    [
        [-1.4405, 5.7800, 0.4712, 1.3190, 0.5425],
        [0.0000, 0.0238, -0.0003, -0.0024, -0.0023],
        [0.4795, 0.2783, -0.0029, 2.6251, -0.0281],
        [32.2516, -56.2373, 7.0519, -138.9333, 5.0073],
        [0.6893, -2.5917, 0.1355, 0.1941, 0.2873],
    ]
)

OMEGA_I = Knob("omega_i", "rad/s", 5.0, 100.0, True)
RATIO = Knob("omega_c_over_omega_i", "-", 0.25, 1.0, True)
JOINT = (OMEGA_I, RATIO)
KNOBS = both(JOINT)


class Rule(NamedTuple):
    """P + I s^-lambda + D s^mu, in the rule's unit of time."""

    P: float
    I: float  # noqa: E741 - the paper's symbol
    lam: float
    D: float
    mu: float

    def gains(self, unit: float) -> Gains:
        """Return the same for time in seconds; unit: the rule's unit of time [s]."""
        return Gains(self.D * unit**self.mu, self.mu, self.I * unit**-self.lam, -self.lam, self.P)


def s_shaped(delay: float, time: float) -> Rule:
    """Return the controller of a plant with an S-shaped unit step response.

    Args:
        delay, time: L and T of the tangent in its inflection, in units of 0.5 over the crossing
            wanted.

    Raises:
        ControllerError: they are outside of what the rules were fitted to.
    """
    L, T = check_positive("delay", delay), check_positive("time", time)
    if L > 2.0 or not 0.1 <= T <= 50.0:
        raise ControllerError(
            f"an S-shaped response of L = {L:.3g} and T = {T:.3g} is outside of the rules, which "
            "are for L up to 2 and T from 0.1 to 50, in units of 0.5 over the crossing wanted"
        )
    return _row([1.0, L, T, L * L, T * T, L * T], _SHORT if T <= 5.0 else _LONG)


def critical(gain: float, period: float) -> Rule:
    """Return the controller of a plant that a critical gain makes oscillate.

    Args:
        gain: K_cr, times the plant's own. period: P_cr, in units of 0.5 over the crossing wanted.

    Raises:
        ControllerError: they are outside of what the rules were fitted to.
    """
    K, P = check_positive("gain", gain), check_positive("period", period)
    if not PERIOD_LEAST <= P <= 8.0 or K * P > 640.0:
        raise ControllerError(
            f"a critical gain of {K:.3g} and period of {P:.3g} are outside of the rules, which are "
            f"for periods from {PERIOD_LEAST:g} to 8 and gain times period up to 640, in units of "
            "0.5 over the crossing wanted"
        )
    return _row([1.0, K, P, 1.0 / K, 1.0 / P], _LOW if K * P <= 64.0 else _HIGH)


def _row(features: list[float], table: NDArray[np.float64]) -> Rule:
    total = [0.0] * table.shape[1]
    for feature, row in zip(features, table.tolist(), strict=True):
        total = [one + feature * other for one, other in zip(total, row, strict=True)]
    return Rule(*total)


def design(
    knobs: Sequence[float],
    inertias: Sequence[float],
    period: float,
    delay: float | None = None,
) -> tuple[Sections, Sections]:
    """Return the controllers of both joints by the rule for S-shaped responses.

    Args:
        knobs: (4,) as KNOBS: the inner loop's omega_i [rad/s] and the outer loop's omega_c over it,
            of joint 1, then of joint 2. inertias: (I_1, I_2) [kg m2]. period: [s].
        delay: the loop's dead time [s]; one and a half samples unless given.

    Raises:
        ControllerError: an argument is out of range, or the joint is outside of the rule.
    """

    def joint(mine: Sequence[float], inertia: float, T: float) -> Sections:
        return s_shaped_joint(mine, inertia, T, delay)

    return paired(joint, JOINT, knobs, inertias, period)  # type: ignore[return-value]


def design_critical(
    knobs: Sequence[float],
    inertias: Sequence[float],
    period: float,
    delay: float | None = None,
) -> tuple[Sections, Sections]:
    """Return the controllers of both joints by the rule for critical gains; as `design`."""

    def joint(mine: Sequence[float], inertia: float, T: float) -> Sections:
        return critical_joint(mine, inertia, T, delay)

    return paired(joint, JOINT, knobs, inertias, period)  # type: ignore[return-value]


def s_shaped_joint(
    knobs: Sequence[float], inertia: float, period: float, delay: float | None = None
) -> Sections:
    """Return one joint's controller from its knobs (2,); see `design`."""
    omega_i, ratio = check_knobs(knobs, JOINT)
    rule, unit = _s_shaped(omega_i, ratio, rigid_joint(inertia, period, delay).delay)
    return _cascaded(rule.gains(unit), omega_i, ratio, inertia, period)


def critical_joint(
    knobs: Sequence[float], inertia: float, period: float, delay: float | None = None
) -> Sections:
    """Return one joint's controller from its knobs (2,); see `design_critical`."""
    omega_i, ratio = check_knobs(knobs, JOINT)
    rule, unit = _critical(omega_i, ratio, rigid_joint(inertia, period, delay).delay)
    return _cascaded(rule.gains(unit), omega_i, ratio, inertia, period)


def numbers(
    knobs: Sequence[float], inertia: float, period: float, delay: float | None = None
) -> dict[str, float]:
    """Return what one joint's design by the S-shaped response comes to, by name.

    P, I, lambda, D, mu in the rule's unit of time, and that unit [s].
    """
    omega_i, ratio = check_knobs(knobs, JOINT)
    return _named(*_s_shaped(omega_i, ratio, rigid_joint(inertia, period, delay).delay))


def numbers_critical(
    knobs: Sequence[float], inertia: float, period: float, delay: float | None = None
) -> dict[str, float]:
    """Return what one joint's design by the critical gain comes to; as `numbers`."""
    omega_i, ratio = check_knobs(knobs, JOINT)
    return _named(*_critical(omega_i, ratio, rigid_joint(inertia, period, delay).delay))


def _s_shaped(omega_i: float, ratio: float, delay: float) -> tuple[Rule, float]:
    """Return the rule's controller of the joint's inner loop, and the unit of time [s]."""
    unit = CROSSING / (ratio * omega_i)
    L, T = (3.0 - math.e) / omega_i + delay, math.e / omega_i
    return s_shaped(L / unit, T / unit), unit


def _critical(omega_i: float, ratio: float, delay: float) -> tuple[Rule, float]:
    """Return the same by the critical gain."""
    unit = CROSSING / (ratio * omega_i)
    K, P = critical_point(omega_i, delay)
    return critical(K, P / unit), unit


def _named(rule: Rule, unit: float) -> dict[str, float]:
    names = ("P", "I", "lambda", "D", "mu")
    return dict(zip(names, map(float, rule), strict=True)) | {"unit": unit}


def critical_point(omega_i: float, delay: float) -> tuple[float, float]:
    """Return critical gain and period [s] of omega_i^2 e^(-s delay) / (s + omega_i)^2.

    Raises:
        ControllerError: without a delay no gain is critical.
    """
    if delay <= 0.0:
        raise ControllerError("a double lag without a dead time has no critical gain; give a delay")

    def short_of_half_a_turn(omega: float) -> float:
        return math.pi - omega * delay - 2.0 * math.atan(omega / omega_i)

    found = float(brentq(short_of_half_a_turn, 1e-9 / delay, math.pi / delay, xtol=1e-12))
    omega = float(f"{found:.10g}")  # without a root's last digits
    return 1.0 + (omega / omega_i) ** 2, 2.0 * math.pi / omega


def _cascaded(
    outer: Gains, omega_i: float, ratio: float, inertia: float, period: float
) -> Sections:
    """Return I omega_i^2 (1 + outer) + 2 I omega_i s / (1 + s / (RATE_FILTER omega_i))."""
    omega_c = check_in_band(ratio * omega_i, period)
    stiffness, damping = inertia * omega_i**2, 2.0 * inertia * omega_i
    inner = textbook_pid(stiffness, 0.0, damping, period, 1.0 / (RATE_FILTER * omega_i))
    built = scaled(digital(outer, omega_c, period), stiffness)
    return Sections((*built.cascades, (inner,)))
