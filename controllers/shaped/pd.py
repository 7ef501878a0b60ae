"""PDs with filtered derivatives, from bandwidth, lead angle and the filter's ratio.

c1, c2 = design(knobs, inertias=(0.35, 0.011), period=1e-3)      # knobs as KNOBS, (6,)

`controllers.shaped.textbook` without an integral part, for references that are shaped.
"""

from collections.abc import Sequence

from controllers.series import Filter
from controllers.shaped import textbook
from controllers.shaped.normalised import OMEGA_C, PHI_1, both, paired

JOINT = (OMEGA_C, PHI_1, textbook.RATIO)
KNOBS = both(JOINT)


def design(
    knobs: Sequence[float], inertias: Sequence[float], period: float
) -> tuple[Filter, Filter]:
    """Return the controllers of both joints, b and a (2,) each.

    Args:
        knobs: (6,) as KNOBS: omega_c [rad/s], phi_1 [rad], omega_f/omega_c of joint 1, then of
            joint 2. inertias: (I_1, I_2) [kg m2]. period: [s].

    Raises:
        ControllerError: an argument is out of range.
    """
    return paired(joint, JOINT, knobs, inertias, period)  # type: ignore[return-value]


def joint(knobs: Sequence[float], inertia: float, period: float) -> Filter:
    """Return the controller of one joint from its knobs (3,)."""
    omega_c, phi_1, ratio = knobs
    return textbook.joint((omega_c, phi_1, 0.0, ratio), inertia, period)
