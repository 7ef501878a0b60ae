"""What the study of designs by rule finds, in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexsim.numerics.types import Array


@dataclass(frozen=True)
class DesignRow:
    """One joint's design.

    Attributes:
        rule: its name. joint: 1 or 2. inertia: of the joint as the rule sees it [kg m2].
        knobs, design: in words, numbers in SI units.
        omega_c, phi_m: crossing [rad/s] and phase margin [rad] of the digital controller with the
            rigid joint and its dead time; None where it does not cross.
    """

    rule: str
    joint: int
    inertia: float
    knobs: str
    design: str
    omega_c: float | None
    phi_m: float | None


@dataclass(frozen=True)
class LoopRow:
    """One joint's loop on the plant, the other joint closed.

    Attributes:
        rule, joint: as of a design. growth: of the slowest-decaying motion of both loops [1/s].
        gain_low, gain_high: factors of this joint's loop gain at which the loop is about to grow.
        phase: the least margin, at any crossing [rad]; omega_phase: where [rad/s].
        delay_margin: extra delay that both loops bear [s], None for more than 20 ms.
        overshoot: of a step of this joint's reference, over the step; None of a loop that grows.
        settling: until its angle stays within 2 % of the step [s], None if not within the time
            shown.
    """

    rule: str
    joint: int
    growth: float
    gain_low: float
    gain_high: float
    phase: float
    omega_phase: float
    delay_margin: float | None
    overshoot: float | None
    settling: float | None


@dataclass(frozen=True, eq=False)
class Curves:
    """What figures show of one rule.

    Attributes:
        rule: its name. omega: (F,) [rad/s]. loops: (2, F), each joint's, the other closed.
        time: (K,) [s]. steps: (2, K), each joint's measured angle after a unit step of its own
            reference, nan where the loop grows.
    """

    rule: str
    omega: Array
    loops: NDArray[np.complex128]
    time: Array
    steps: Array


@dataclass(frozen=True, eq=False)
class RulesResult:
    """Designs, their loops and curves.

    Attributes:
        numbers: knobs and numbers of every design by name, for programs.
        plant: name. theta2: pose [rad]. delay: dead time that the rules were given [s].
    """

    designs: list[DesignRow]
    loops: list[LoopRow]
    curves: list[Curves]
    numbers: list[dict[str, Any]]
    plant: str
    theta2: float
    delay: float
