"""A joint that does not move, in every model of the arm: its motor is heavier than anything.

    >>> still = plant.locked(["joint1"])

A motor's inertia turns with its joint alone: in the mass matrix it is added to that joint's own
diagonal, to nothing else. Of 1e30 kg m2, the largest number that a robot may have, 100 N m turn it
by 1e-22 rad in an hour, while all other rows are, to rounding, those of the arm with the joint
taken out: nothing is lost in eliminating the largest pivot. No frequency rises above the highest of
the free joints (Rayleigh's quotient over fewer motions), so that the step they allow will do.
"""

from __future__ import annotations

from collections.abc import Iterable

from flexsim.arm.parameters import LARGEST
from flexsim.errors import ParameterError

JOINTS = ("joint1", "joint2")
LOCKED = LARGEST  # [kg m2] of the motor at a joint that does not move


def which_locked(joints: Iterable[str]) -> tuple[bool, bool]:
    """Return whether joint 1 and joint 2 are among joints that do not move.

    Raises:
        ParameterError: there is no joint of that name.
    """
    names = set(joints)
    unknown = sorted(names - set(JOINTS))
    if unknown:
        raise ParameterError(
            f"joint {unknown[0]!r} is unknown; lock {' or '.join(JOINTS)}, or both"
        )
    return JOINTS[0] in names, JOINTS[1] in names


def motors_locking(joints: Iterable[str]) -> dict[str, float]:
    """Return the motors' inertias [kg m2] of a `Parameters` whose joints do not move.

    Raises:
        ParameterError: as `which_locked`.
    """
    held = which_locked(joints)
    return {name: LOCKED for name, still in zip(("I_m1", "I_m2"), held, strict=True) if still}
