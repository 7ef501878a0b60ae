"""What motors and joints do beyond limit, lag and friction's law; all off by default.

    >>> JointEffects(cold=(0.3, 0.3), warming=(20.0, 20.0))       # friction that warms up
    >>> JointEffects(backlash=(2e-3, 0.0), shaft=(500.0, 0.0), motor_inertia=(0.02, 0.0))

- **Amplifier**: its current follows the command with a first-order lag, ahead of the motors' own.
- **Ripple and cogging**: a motor's torque tau is tau (1 + a sin(n phi)) + c sin(m phi) at its angle
  phi: commutation scales with the current, cogging does not.
- **Temperature**: Table 4's numbers, tau_0, mu and the dead zone's edges, are times
  1 + cold e^(-t/T) + warm (1 - e^(-t/T)), of a joint that moves from t = 0: the numbers as they are
  are those of the temperature at which they were identified.
- **Configuration**: they are times 1 + b cos(n theta - phase), too.
  Under 'simulink' and 'jump' mu and tau_0 are of (47), where more of them is *more* torque beyond
  the dead zone; only the edges hold back. A stiction or bristles' stress follows tau_0.
- **Backlash**: `flexsim.loop.hardware.shaft`: a motor with an inertia of its own behind an elastic
  shaft with a gap; dead zone and (47) act on the motor, what opposes motion on the joint. Encoders
  may be at the motors.

Sources: temperature Bittencourt and Gunnarsson, ASME J. Dynamic Systems, Measurement and Control
134 (2012), a robot's joint whose friction changes by several tenths from cold to warm; Wolf and
Iskandar, ICRA 2018, motor and harmonic drive from 24 to 50 C; configuration Armstrong-Helouvry,
Control of Machines with Friction (1991); backlash Nordin, Galic and Gutman, Int. J. Adaptive
Control and Signal Processing 11 (1997), Nordin and Gutman, Automatica 38 (2002); ripple and
cogging Holtz and Springob, IEEE Trans. Industrial Electronics 43 (1996). They are sources of the
models; sizes for this arm are *assumed*.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexsim.errors import ParameterError
from flexsim.loop.hardware.parts import check_parts, part, word
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array

NOTHING = (0.0, 0.0)
SIDES = ("joint", "motor")  # where an encoder may be
STIFFEST = 2.0  # of k h^2/J at a motor: half of what its shaft is stable with, the rest the joint's
WARM = "Bittencourt and Gunnarsson (2012); size assumed"
POSED = "Armstrong-Helouvry (1991); size assumed"
GAP = "Nordin, Galic and Gutman (1997); size assumed"
WAVES = "Holtz and Springob (1996); size assumed"


@dataclass(frozen=True)
class JointEffects:
    """What is at the joints; each field has its unit, meaning and source.

    Raises:
        ParameterError: a number out of range, or backlash without shaft or motor.
    """

    amplifier: float = part(0.0, "s", "time constant of the amplifiers' currents")
    ripple: tuple[float, float] = part(
        NOTHING, "-", "torque ripple, of the torque", WAVES, high=1.0
    )
    ripple_periods: tuple[float, float] = part(
        (12.0, 12.0), "-", "periods of the ripple in a turn", WAVES
    )
    cogging: tuple[float, float] = part(NOTHING, "N m", "amplitude of the cogging torque", WAVES)
    cogging_periods: tuple[float, float] = part(
        (24.0, 24.0), "-", "periods of the cogging in a turn", WAVES
    )
    cold: tuple[float, float] = part(
        NOTHING, "-", "more friction at the start, of it", WARM, low=-1.0
    )
    warm: tuple[float, float] = part(NOTHING, "-", "more friction when warm, of it", WARM, low=-1.0)
    warming: tuple[float, float] = part(
        (60.0, 60.0), "s", "time constant of warming up", WARM, above=True
    )
    pose: tuple[float, float] = part(
        NOTHING, "-", "amplitude of friction over the angle, of it", POSED, high=1.0
    )
    pose_periods: tuple[float, float] = part(
        (1.0, 1.0), "-", "periods of friction in a turn", POSED
    )
    pose_phase: tuple[float, float] = part(
        NOTHING, "rad", "phase at which friction is largest", low=-math.inf
    )
    backlash: tuple[float, float] = part(
        NOTHING, "rad", "gap between motor and joint, from end to end", GAP
    )
    shaft: tuple[float, float] = part(
        NOTHING, "N m/rad", "stiffness between motor and joint, 0 for rigid", GAP
    )
    shaft_damping: tuple[float, float] = part(
        NOTHING, "N m s/rad", "damping of the shaft in contact", GAP
    )
    motor_inertia: tuple[float, float] = part(
        NOTHING, "kg m2", "of a motor behind its shaft, at the joint, beside I_m", GAP
    )
    encoder: str = word("joint", SIDES, "side of the shaft that the encoders are on")

    def __post_init__(self) -> None:
        check_parts(self)
        for gap, k, J in zip(self.backlash, self.shaft, self.motor_inertia, strict=True):
            if gap > 0 and k == 0:
                raise ParameterError(
                    f"hardware backlash is {self.backlash} rad, the shaft {self.shaft} N m/rad; "
                    "give a joint with backlash a shaft of more than 0"
                )
            if k > 0 and J == 0:
                raise ParameterError(
                    f"hardware shaft is {self.shaft} N m/rad, motor_inertia {self.motor_inertia} "
                    "kg m2; give a motor behind a shaft more than 0"
                )

    @property
    def friction_most(self) -> tuple[float, float]:
        """The largest factor of friction, per joint."""
        rows = zip(self.cold, self.warm, self.pose, strict=True)
        one, other = ((1 + max(cold, warm)) * (1 + b) for cold, warm, b in rows)
        return one, other

    @property
    def steepest(self) -> tuple[float, float]:
        """What the shafts add to the slope of torque over a joint's rate [N m s/rad].

        As `flexsim.loop.friction.Friction.steepest`, with room for the motors' share.
        """
        both = zip(self.shaft_damping, self.shaft, strict=True)
        one, other = (damping + k * PERIOD if k > 0 else 0.0 for damping, k in both)
        return one, other

    def numbers(self, step: float) -> EffectNumbers:
        """Return the numbers as the compiled loop reads them.

        Args:
            step: physics step [s].

        Raises:
            ParameterError: a shaft is too stiff or too damped for its motor and the step.
        """
        for k, damping, J in zip(self.shaft, self.shaft_damping, self.motor_inertia, strict=True):
            if k > 0 and max(k * step**2 / J, damping * step / J) >= STIFFEST:
                raise ParameterError(
                    f"hardware shaft of {k:g} N m/rad and {damping:g} N m s/rad is too stiff for a "
                    f"motor of {J:g} kg m2 and a physics step of {step:g} s; use less than "
                    f"{STIFFEST * J / step**2:.3g} N m/rad and {STIFFEST * J / step:.3g} N m s/rad"
                )
        rows = zip(
            self.ripple,
            self.ripple_periods,
            self.cogging,
            self.cogging_periods,
            self.cold,
            self.warm,
            self.warming,
            self.pose,
            self.pose_periods,
            self.pose_phase,
            (gap / 2 for gap in self.backlash),
            self.shaft,
            self.shaft_damping,
            self.motor_inertia,
            strict=True,
        )
        per_joint = np.array(list(rows), dtype=float)
        acting = (self.ripple, self.cogging, self.cold, self.warm, self.pose, self.shaft)
        there = any(each != 0.0 for pair in acting for each in pair)
        return EffectNumbers(there, self.encoder == "motor", float(step), per_joint)


class EffectNumbers(NamedTuple):
    """`JointEffects` as plain numbers, for compiled code.

    Attributes:
        there: whether any acts. at_motor: whether encoders are there. step: physics step [s].
        per_joint: (2, 14) columns as numbered below.
    """

    there: bool
    at_motor: bool
    step: float
    per_joint: Array


class NoEffects(NamedTuple):
    """Joints that are ideal."""

    step: float = 0.0


def leanest_effects(
    found: Sequence[EffectNumbers], bristles: bool
) -> Sequence[EffectNumbers | NoEffects]:
    """Return effects of one kind: none at all if none of them acts and no friction has bristles."""
    acting = bristles or any(each.there or each.at_motor for each in found)
    return found if acting else [NoEffects()] * len(found)


RIPPLE, RIPPLE_PERIODS, COGGING, COGGING_PERIODS = range(4)
COLD, WARMED, WARMING, POSE, POSE_PERIODS, POSE_PHASE = range(4, 10)
HALF_GAP, SHAFT, SHAFT_DAMPING, MOTOR_INERTIA = range(10, 14)
