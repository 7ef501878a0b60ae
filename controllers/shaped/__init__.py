"""Controllers from a bandwidth and angles, alike for every form: what a fair search turns.

    c1, c2 = FORMS["textbook"].design(knobs, inertias=(0.35, 0.011), period=1e-3)
    FORMS["textbook"].KNOBS                     # (8,), names, units and ranges

Raw gains of a fractional and an integer PID have no common scale. Bandwidth and angles have: with
the rigid joint every form crosses at omega_c, as `controllers.shaped.normalised` tells. A form is a
module with `KNOBS` and `design(knobs, inertias, period)`; `gains_of` and, where they can be had
back, `knobs_of` are beside it.

The inertias are those of the rigid joints, each with the other one held: the diagonal of the arm's
mass matrix M[:2, :2] with the beam straight, at the pose in the middle of the path.

Ranges are the same for all forms, and hold the known good designs, `COLLOCATED` and `TUNED`. Angles
may be negative: cut after ten terms, (2) makes of a derivative at these bandwidths a delayed gain,
and it is the *negative* ones that lead. Of 400 random draws, even over the ranges, omega_c and
ratios by their logarithms, these hold (flexsim's assumed modes, 5 of them, 0.1 % damping, hardware
`bench`, setting `simulink`; line, two-loop, circle) in %:

               v ignored       v mirrored
    fractional 37, 21, 28      32, 18, 24
    long       48, 43, 45      47, 43, 44
    integer    14,  6,  8       9,  7,  7
    textbook    6,  6,  6       8,  8,  8
    pd         71, 66, 68      67, 66, 66
"""

from collections.abc import Mapping
from types import MappingProxyType, ModuleType

from controllers.shaped import fractional, integer, long, pd, textbook

FORMS: Mapping[str, ModuleType] = MappingProxyType(
    {
        "fractional": fractional,
        "long": long,
        "integer": integer,
        "textbook": textbook,
        "pd": pd,
    }
)
"""Name -> module of a form."""

__all__ = ["FORMS", "fractional", "integer", "long", "pd", "textbook"]
