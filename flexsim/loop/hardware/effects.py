"""What motors and joints do beyond limit, lag and friction's law: torque ripple.

All off by default. A motor's torque tau becomes tau (1 + a sin(n theta)) under ripple, theta the
joint's angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexsim.loop.hardware.parts import check_parts, part
from flexsim.numerics.jit import jit


@dataclass(frozen=True)
class JointEffects:
    """What is at the joints; each field has its unit, meaning and source.

    Raises:
        ParameterError: a number out of range.
    """

    ripple: tuple[float, float] = part(
        (0.0, 0.0), "-", "amplitude of the torque ripple, of the torque", high=1.0
    )
    ripple_periods: tuple[float, float] = part(
        (12.0, 12.0), "-", "periods of the torque ripple in a turn of the joint"
    )

    def __post_init__(self) -> None:
        check_parts(self)

    def numbers(self) -> EffectNumbers:
        """Return the numbers as the compiled loop reads them."""
        (a1, a2), (n1, n2) = self.ripple, self.ripple_periods
        return EffectNumbers(a1 > 0 or a2 > 0, float(a1), float(a2), float(n1), float(n2))


class EffectNumbers(NamedTuple):
    """`JointEffects` as plain numbers, for compiled code."""

    there: bool
    ripple_1: float
    ripple_2: float
    periods_1: float
    periods_2: float


@jit
def rippled(j: EffectNumbers, tau_1: float, tau_2: float, theta1: float, theta2: float):  # type: ignore[no-untyped-def]
    """Return the motors' torques with their ripple [N m]."""
    if not j.there:
        return tau_1, tau_2
    return (
        tau_1 * (1.0 + j.ripple_1 * np.sin(j.periods_1 * theta1)),
        tau_2 * (1.0 + j.ripple_2 * np.sin(j.periods_2 * theta2)),
    )
