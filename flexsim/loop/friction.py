"""What happens to a commanded torque before it moves a joint: limit, dead zone, friction.

Three readings of the paper's friction, (47) and Table 4. `simulink`: the blocks of Simulink, which
the paper's words point to, one after the other: Dead Zone, which gives the torque beyond the zone's
edge *minus* that edge, so that it sets in from nothing, and Coulomb & Viscous Friction, which is
(47) on what is left. `jump`: beyond its edge the dead zone passes the whole torque to (47), so the
torque at either joint jumps there by as much as the edge: much of the chaos comes from that.
`opposing`: the whole torque beyond the edge, and the same numbers oppose the joint's motion.
The law is evaluated once per physics step and its torque held over the step, alike on all plants.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.jit import jit

LAWS = ("none", "simulink", "jump", "opposing")
NONE, SIMULINK, JUMP, OPPOSING = range(len(LAWS))


@dataclass(frozen=True)
class Friction:
    """Joint friction and torque limits; the defaults are Table 4's numbers.

    Attributes:
        law: 'none' (torque as commanded), 'simulink' ((47) on the torque minus the dead zone's
            edge), 'jump' ((47) on the whole torque beyond it) or 'opposing' (Coulomb and viscous
            friction opposing the joint's velocity).
        dead_zone: ((low, high), (low, high)) per joint [N m]: torques inside produce none.
        tau_0: Coulomb friction per joint [N m]. mu: slope per joint [-] under 'simulink' and
            'jump', [N m s/rad] under 'opposing'.
        speed: velocity that smooths the sign under 'opposing', tanh(w/speed) [rad/s]; *assumed*.
        torque_limit: largest torque per joint, before the dead zone [N m]; *assumed*.

    Raises:
        ParameterError: an unknown law, a dead zone that does not hold zero, a negative or
            non-finite number.
    """

    law: str = "none"
    dead_zone: tuple[tuple[float, float], tuple[float, float]] = (
        (-3.2379, 2.9129),
        (-0.5543, 0.6608),
    )
    tau_0: tuple[float, float] = (4.56, 0.0)
    mu: tuple[float, float] = (0.2585, 1.0231)
    speed: float = 0.02
    torque_limit: tuple[float, float] = (math.inf, math.inf)

    def __post_init__(self) -> None:
        if self.law not in LAWS:
            raise ParameterError(f"friction law is {self.law!r}; choose one of {', '.join(LAWS)}")
        for name in ("dead_zone", "tau_0", "mu", "torque_limit"):
            if np.shape(getattr(self, name)) != ((2, 2) if name == "dead_zone" else (2,)):
                pair = "a pair" if name == "dead_zone" else "a number"
                raise ParameterError(
                    f"friction {name} is {getattr(self, name)}; give {pair} for each of two joints"
                )
        for low, high in self.dead_zone:
            if not (-math.inf < low <= 0 <= high < math.inf):
                raise ParameterError(f"dead zone is ({low}, {high}) N m; give low <= 0 <= high")
        for name, values in (("tau_0", self.tau_0), ("mu", self.mu)):
            if not all(0 <= value < math.inf for value in values):
                raise ParameterError(f"friction {name} is {values}; give finite numbers, 0 or more")
        if not all(limit > 0 for limit in self.torque_limit):
            raise ParameterError(f"torque limit is {self.torque_limit}; give more than 0 [N m]")
        if not 0 < self.speed < math.inf:
            raise ParameterError(f"friction speed is {self.speed}; give more than 0 [rad/s]")

    @property
    def steepest(self) -> tuple[float, float]:
        """The largest slope of friction over a joint's velocity, at rest [N m s/rad].

        Held over a step, it bounds the step.
        """
        if self.law != "opposing":
            return 0.0, 0.0
        first, second = (mu + tau / self.speed for mu, tau in zip(self.mu, self.tau_0, strict=True))
        return first, second

    def numbers(self) -> FrictionNumbers:
        """Return the numbers as the compiled law reads them."""
        (low_1, high_1), (low_2, high_2) = self.dead_zone
        return FrictionNumbers(
            LAWS.index(self.law),
            float(low_1),
            float(high_1),
            float(low_2),
            float(high_2),
            float(self.tau_0[0]),
            float(self.tau_0[1]),
            float(self.mu[0]),
            float(self.mu[1]),
            float(self.speed),
            float(self.torque_limit[0]),
            float(self.torque_limit[1]),
        )


class FrictionNumbers(NamedTuple):
    """A `Friction` as plain numbers, for compiled code."""

    law: int
    low_1: float
    high_1: float
    low_2: float
    high_2: float
    tau_0_1: float
    tau_0_2: float
    mu_1: float
    mu_2: float
    speed: float
    limit_1: float
    limit_2: float


@jit
def effective_torque(
    law: int,
    tau: float,
    w: float,
    low: float,
    high: float,
    tau_0: float,
    mu: float,
    speed: float,
) -> float:
    """Return the torque that reaches one joint [N m].

    Args:
        law: index into LAWS.
        tau: limited torque [N m]; w: joint velocity [rad/s].
        low, high: dead zone; tau_0, mu, speed: as in `Friction`.

    Source: (47), Table 4.
    """
    if law == NONE:
        return tau
    if low < tau < high:
        tau = 0.0
    elif law == SIMULINK:
        tau -= high if tau > 0.0 else low
    if law == OPPOSING:
        return tau - tau_0 * np.tanh(w / speed) - mu * w
    if tau == 0.0:
        return 0.0
    return np.sign(tau) * (mu * abs(tau) + tau_0)  # (47)


@jit
def joint_torques(f: FrictionNumbers, tau_1: float, tau_2: float, w1: float, w2: float):  # type: ignore[no-untyped-def]
    """Return the two torques that reach the joints [N m]; see `effective_torque`."""
    tau_1 = min(max(tau_1, -f.limit_1), f.limit_1)
    tau_2 = min(max(tau_2, -f.limit_2), f.limit_2)
    return (
        effective_torque(f.law, tau_1, w1, f.low_1, f.high_1, f.tau_0_1, f.mu_1, f.speed),
        effective_torque(f.law, tau_2, w2, f.low_2, f.high_2, f.tau_0_2, f.mu_2, f.speed),
    )
