"""What happens to a commanded torque before it moves a joint: limit, dead zone, friction.

Three readings of the paper's friction, (47) and Table 4. `simulink`: the blocks of Simulink, which
the paper's words point to, one after the other: Dead Zone, which gives the torque beyond the zone's
edge *minus* that edge, and Coulomb & Viscous Friction, which is (47) on what is left, so that at
the edge the torque jumps by tau_0: 4.56 N m at joint 1, nothing at joint 2. `jump`: beyond its edge
the dead zone passes the whole torque to (47), so that it jumps by tau_0 + mu times the edge, at
joint 2 as well: chaos in the ideal loop comes from that. `opposing`: the whole torque beyond the
edge, and the same numbers oppose the joint's motion.
`stribeck` is `opposing` with more of tau_0 the slower a joint moves (Stribeck's curve); `lugre` has
bristles that bend before a joint slides, a state of their own per joint
(`flexsim.loop.hardware.bristles`), so that friction holds at rest, breaks away and lags.
The law is evaluated once per physics step and its torque held over the step, alike on all plants.

Sources: Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994), for Stribeck's curve;
Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Trans. Automatic Control 40 (1995), for LuGre,
whose tau_s/tau_0 = 1.5 and sigma_1 = sqrt(sigma_0 J) are the defaults here; Olsson, thesis, Lund
(1996), for bristles' damping that falls with speed. The other numbers are *assumed*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.elementary import exp, tanh
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array

LAWS = ("none", "simulink", "jump", "opposing", "stribeck", "lugre")
NONE, SIMULINK, JUMP, OPPOSING, STRIBECK, LUGRE = range(len(LAWS))
RESISTING = LAWS[OPPOSING:]  # the laws whose friction opposes the motion


@dataclass(frozen=True)
class Friction:
    """Joint friction and torque limits; the defaults are Table 4's numbers.

    Attributes:
        law: 'none' (torque as commanded), 'simulink' ((47) on the torque minus the dead zone's
            edge), 'jump' ((47) on the whole torque beyond it), 'opposing' (Coulomb and viscous
            friction opposing the joint's velocity), 'stribeck' (that, with stiction) or 'lugre'.
        dead_zone: ((low, high), (low, high)) per joint [N m]: torques inside produce none.
        tau_0: Coulomb friction per joint [N m]. mu: slope per joint [-] under 'simulink' and
            'jump', [N m s/rad] under the others.
        speed: velocity that smooths the sign under 'opposing' and 'stribeck', tanh(w/speed)
            [rad/s]; *assumed*.
        torque_limit: largest torque per joint, before the dead zone [N m]; *assumed*.
        stiction: tau_s/tau_0 per joint, 1 or more [-], and stribeck: the velocity w_s at which most
            of what is more than 1 has gone [rad/s], under 'stribeck' and 'lugre'.
        sigma_0, sigma_1: stiffness [N m/rad] and damping [N m s/rad] of the bristles per joint,
            under 'lugre', whose sigma_2 is mu.

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
    stiction: tuple[float, float] = (1.5, 1.5)
    stribeck: float = 0.1
    sigma_0: tuple[float, float] = (2000.0, 500.0)
    sigma_1: tuple[float, float] = (30.0, 2.4)

    def __post_init__(self) -> None:
        if self.law not in LAWS:
            raise ParameterError(f"friction law is {self.law!r}; choose one of {', '.join(LAWS)}")
        for name in ("dead_zone", "tau_0", "mu", "torque_limit", "stiction", "sigma_0", "sigma_1"):
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
        self._check_sliding()

    def _check_sliding(self) -> None:
        """Refuse numbers of 'stribeck' and 'lugre' that cannot be used."""
        if not 0 < self.stribeck < math.inf:
            raise ParameterError(f"friction stribeck is {self.stribeck}; give more than 0 [rad/s]")
        for name, least in (("stiction", 1.0), ("sigma_0", 0.0), ("sigma_1", 0.0)):
            values = getattr(self, name)
            if not all(least <= value < math.inf for value in values):
                raise ParameterError(
                    f"friction {name} is {values}; give finite numbers, {least:g} or more"
                )
        if self.law == "lugre":
            for tau, stiffness in zip(self.tau_0, self.sigma_0, strict=True):
                if tau > 0 and stiffness == 0:
                    raise ParameterError(
                        f"friction sigma_0 is {self.sigma_0}; under 'lugre' give more than 0 "
                        "[N m/rad] to a joint that has tau_0"
                    )

    @property
    def steepest(self) -> tuple[float, float]:
        """The largest slope of friction over a joint's velocity, at rest [N m s/rad].

        Held over a step, it bounds the step h. A spring k held with the mean of its torque over the
        step counts as k h/2, for a step of PERIOD: so bristles do.
        """
        if self.law not in RESISTING:
            return 0.0, 0.0
        first, second = (
            mu + (own if tau > 0 else 0.0)
            for mu, tau, own in zip(self.mu, self.tau_0, self._at_rest, strict=True)
        )
        return first, second

    @property
    def _at_rest(self) -> list[float]:
        """What tau_0 adds to the slope at rest, per joint [N m s/rad]."""
        if self.law == "lugre":
            both = zip(self.sigma_0, self.sigma_1, strict=True)
            return [damping + stiffness * PERIOD / 2 for stiffness, damping in both]
        share = self.stiction if self.law == "stribeck" else (1.0, 1.0)
        return [each * tau / self.speed for each, tau in zip(share, self.tau_0, strict=True)]

    def coulomb(self, rates: Array) -> Array:
        """Return what opposes steady rates (K, 2) [rad/s] beside mu, smoothed, (K, 2) [N m]."""
        if self.law not in RESISTING:
            return np.zeros_like(rates)
        share = np.ones_like(rates)
        if self.law != "opposing":
            share += (np.array(self.stiction) - 1) * exp(-((rates / self.stribeck) ** 2))
        return np.array(self.tau_0) * share * tanh(rates / self.speed)

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
            float(self.stiction[0]),
            float(self.stiction[1]),
            float(self.stribeck),
            float(self.sigma_0[0]),
            float(self.sigma_0[1]),
            float(self.sigma_1[0]),
            float(self.sigma_1[1]),
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
    stiction_1: float
    stiction_2: float
    stribeck: float
    sigma_0_1: float
    sigma_0_2: float
    sigma_1_1: float
    sigma_1_2: float


@jit
def driving(law: int, tau: float, low: float, high: float, tau_0: float, mu: float) -> float:
    """Return what dead zone and (47) leave of a motor's torque, ahead of what opposes motion [N m].

    Args:
        law: index into LAWS. tau: limited torque [N m]. low, high: dead zone.
        tau_0, mu: as in `Friction`.

    Source: (47), Table 4.
    """
    if law == NONE:
        return tau
    if low < tau < high:
        tau = 0.0
    elif law == SIMULINK:
        tau -= high if tau > 0.0 else low
    if law >= OPPOSING:
        return tau
    if tau == 0.0:
        return 0.0
    return np.sign(tau) * (mu * abs(tau) + tau_0)  # (47)


@jit
def stribeck_torque(w: float, tau_0: float, stiction: float, stribeck: float) -> float:
    """Return tau_0 + (tau_s - tau_0) exp(-(w/w_s)^2), Coulomb friction on Stribeck's curve [N m].

    Args:
        w: joint velocity [rad/s]. tau_0, stiction, stribeck: as in `Friction`.
    """
    return tau_0 * (1.0 + (stiction - 1.0) * np.exp(-((w / stribeck) ** 2)))


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
    stiction: float,
    stribeck: float,
) -> float:
    """Return the torque that reaches one joint [N m]; under 'lugre' that of steady sliding.

    Args:
        law: index into LAWS.
        tau: limited torque [N m]; w: joint velocity [rad/s].
        low, high: dead zone; tau_0, mu, speed, stiction, stribeck: as in `Friction`.
    """
    tau = driving(law, tau, low, high, tau_0, mu)
    if law < OPPOSING:
        return tau
    if law > OPPOSING:
        tau_0 = stribeck_torque(w, tau_0, stiction, stribeck)
    sign = np.sign(w) if law == LUGRE else np.tanh(w / speed)
    return tau - tau_0 * sign - mu * w


@jit
def joint_torques(f: FrictionNumbers, tau_1: float, tau_2: float, w1: float, w2: float):  # type: ignore[no-untyped-def]
    """Return the two torques that reach the joints [N m]; see `effective_torque`."""
    tau_1 = min(max(tau_1, -f.limit_1), f.limit_1)
    tau_2 = min(max(tau_2, -f.limit_2), f.limit_2)
    return (
        effective_torque(
            f.law,
            tau_1,
            w1,
            f.low_1,
            f.high_1,
            f.tau_0_1,
            f.mu_1,
            f.speed,
            f.stiction_1,
            f.stribeck,
        ),
        effective_torque(
            f.law,
            tau_2,
            w2,
            f.low_2,
            f.high_2,
            f.tau_0_2,
            f.mu_2,
            f.speed,
            f.stiction_2,
            f.stribeck,
        ),
    )
