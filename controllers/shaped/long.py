"""Fractional PIDs by Oustaloup's sections, which remember long, from bandwidth, angles and orders.

c1, c2 = design(knobs, inertias=(0.35, 0.011), period=1e-3)      # knobs as KNOBS, (10,)
"""

import math
from collections.abc import Sequence

from controllers.knobs import Knob
from controllers.oustaloup import oustaloup_cascade
from controllers.pid import Gains, oustaloup_pid
from controllers.sections import Sections
from controllers.shaped.fractional import JOINT
from controllers.shaped.normalised import at, both, check_bandwidth, gains, paired

TERMS = 9
"""Pairs of poles and zeros of each operator, two to a decade."""
LOW = 0.1
"""Lower edge of their band [rad/s]."""
HIGH = 0.8 * math.pi
"""Upper edge times the period, as `controllers.oustaloup` has it."""
KNOBS: tuple[Knob, ...] = both(JOINT)


def design(
    knobs: Sequence[float], inertias: Sequence[float], period: float
) -> tuple[Sections, Sections]:
    """Return the controllers of both joints as sums of sections.

    Args:
        knobs: (10,) as KNOBS, those of `controllers.shaped.fractional`.
        inertias: (I_1, I_2) [kg m2]. period: [s].

    Raises:
        ControllerError: an argument is out of range.

    Source: (3), (4); Oustaloup, Levron, Mathieu, Nanot, IEEE Trans. Circuits Syst. I 47 (2000)
    25-39.
    """
    return paired(joint, JOINT, knobs, inertias, period)  # type: ignore[return-value]


def joint(knobs: Sequence[float], inertia: float, period: float) -> Sections:
    """Return the controller of one joint; arguments as of `gains_of`."""
    return oustaloup_pid(gains_of(knobs, inertia, period), period, TERMS, LOW, HIGH / period)


def gains_of(knobs: Sequence[float], inertia: float, period: float) -> Gains:
    """Return the gains of one joint from its knobs (5,).

    Raises:
        ControllerError: an argument is out of range.
    """
    omega_c, phi_1, phi_2, nu_1, nu_2 = knobs
    check_bandwidth(omega_c, period)
    derivative, integral = (
        at(
            Sections((oustaloup_cascade(nu, period, TERMS, LOW, HIGH / period),)),
            omega_c,
            period,
        )
        for nu in (nu_1, nu_2)
    )
    k1, k2, k3 = gains(omega_c, phi_1, phi_2, inertia, derivative, integral)
    return Gains(k1, nu_1, k2, nu_2, k3)
