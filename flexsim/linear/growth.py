"""How fast does a loop grow near rest, as the simulation steps it, along a trajectory's poses?

>>> options = loop_options(setting("simulink").friction, 1e-3)
>>> radii = spectral_radii(plant, extreme_poses(reference), controllers, options)
>>> growth_rates(radii, 1e-3) <= SLACK
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexsim.linear.loop_poles import LoopOptions, small_signal
from flexsim.loop.friction import Friction
from flexsim.loop.hardware import IDEAL, Hardware
from flexsim.loop.settings import V_GAIN
from flexsim.loop.trajectories import Reference
from flexsim.numerics.types import Array

QUANTUM = 1e-6  # [1/s] of growth that is ranked: LAPACK's rounding is far below
SLACK = 0.05  # [1/s] growth that a loop called stable may have: an undamped beam hardly decays


def growth_rates(radii: Array, period: float) -> Array:
    """Return growth rates [1/s] of spectral radii, -inf at a radius of 0."""
    with np.errstate(divide="ignore"):
        return np.log(radii) / period


def quantised(growth: ArrayLike) -> Array:
    """Return growth rates [1/s] as whole multiples of QUANTUM, before anything is ranked by them.

    So the last digits of an eigenvalue, which differ between processors, decide nothing, unless a
    rate lies on the edge between two multiples. What is not finite stays.
    """
    return np.asarray(np.round(np.asarray(growth, dtype=float) / QUANTUM) * QUANTUM)


def extreme_poses(ref: Reference) -> list[float]:
    """Return the smallest, middle and largest theta2 of a trajectory [rad]."""
    theta2 = ref.joint[:, 1]
    low, high = float(theta2.min()), float(theta2.max())
    return [low, (low + high) / 2, high]


def loop_options(
    friction: Friction,
    period: float,
    hold: str = "stepped",
    torque_gain: tuple[float, float] | None = None,
    hardware: Hardware = IDEAL,
) -> LoopOptions:
    """Return how a loop is linearised: with the friction's slopes, or with the torque gain given.

    Of the hardware, delay and lag count.

    Raises:
        ParameterError: an unknown hold, or a torque gain that is not finite.
    """
    gain, damping = small_signal(friction)
    return LoopOptions(period, V_GAIN, torque_gain or gain, damping, hold, hardware)
