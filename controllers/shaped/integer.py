"""Integer PIDs by (2), the paper's counterpart, from bandwidth and angles.

c1, c2 = design(knobs, inertias=(0.35, 0.011), period=1e-3)      # knobs as KNOBS, (6,)

Truncated after ten terms its integral forgets: it is `controllers.shaped.fractional` at orders 1
and -1.
"""

from collections.abc import Sequence

from controllers.pid import Gains, integer_pid
from controllers.series import Filter
from controllers.shaped import fractional
from controllers.shaped.normalised import OMEGA_C, PHI_1, PHI_2, both, paired

JOINT = (OMEGA_C, PHI_1, PHI_2)
KNOBS = both(JOINT)
ORDERS = (1.0, -1.0)


def design(
    knobs: Sequence[float], inertias: Sequence[float], period: float
) -> tuple[Filter, Filter]:
    """Return the controllers of both joints, b (11,) and a = [1] each.

    Args:
        knobs: (6,) as KNOBS: omega_c [rad/s], phi_1, phi_2 [rad] of joint 1, then of joint 2.
        inertias: (I_1, I_2) [kg m2]. period: [s].

    Raises:
        ControllerError: an argument is out of range.

    Source: section 3.2, last paragraph; (2), p = 10.
    """
    return paired(joint, JOINT, knobs, inertias, period)  # type: ignore[return-value]


def joint(knobs: Sequence[float], inertia: float, period: float) -> Filter:
    """Return the controller of one joint from its knobs (3,)."""
    found = gains_of(knobs, inertia, period)
    return integer_pid(found.k1, found.k2, found.k3, period, fractional.TERMS)


def gains_of(knobs: Sequence[float], inertia: float, period: float) -> Gains:
    """Return the gains of one joint from its knobs (3,), with orders 1 and -1."""
    return fractional.gains_of((*knobs, *ORDERS), inertia, period)


def knobs_of(given: Gains, inertia: float, period: float) -> tuple[float, ...]:
    """Return the knobs (3,) of one joint's gains, whose orders are 1 and -1."""
    return fractional.knobs_of(given, inertia, period)[:3]
