"""The open-loop motions that plants are held against each other in."""

from __future__ import annotations

import numpy as np

from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.elementary import sin
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.modes_plant import AssumedModesPlant

DURATION = 2.0  # [s] of driven and free motion
GENTLE = (0.1, 0.05)  # [rad/s] initial joint rates of the free motion, beam straight
BRISK = (0.5, 0.3)  # [rad/s]
POSE = (0.0, 1.2)  # [rad]
AMPLITUDES = {"small": 1.0, "large": 4.0}  # of `trial_torque`


def trial_torque(scale: float, duration: float = DURATION, period: float = PERIOD) -> Array:
    """Return (K, 2) torques scale (0.5 sin(2 pi t/0.8), 0.05 sin(2 pi t/0.5)) [N m]."""
    t = period * np.arange(round(duration / period))
    return scale * np.column_stack(
        [0.5 * sin(2 * np.pi * t / 0.8), 0.05 * sin(2 * np.pi * t / 0.5)]
    )


def fitting_torque(plant: Plant, scale: float) -> Array:
    """Return `trial_torque` (K, 2), less where an arm is lighter than the paper's [N m].

    In proportion to the inertia that each joint feels with the other free and the beam rigid, so
    that a light arm is not thrown through angles that tell rounding errors apart.
    """
    own, usual = felt_inertia(plant), felt_inertia(AssumedModesPlant())
    return trial_torque(scale) * np.minimum(1.0, own / usual)


def felt_inertia(plant: Plant) -> Array:
    """Return what a motor's torque over its joint's acceleration is (2,) [kg m2], other joint free.

    At POSE, the beam as rigid as the first two coordinates have it.
    """
    linear = plant.linearised(POSE[1])
    M, gear = linear.M[:2, :2], np.diag(linear.S[:2])
    felt: Array = (M[0, 0] * M[1, 1] - M[0, 1] ** 2) / (M[[1, 0], [1, 0]] * gear)
    return felt
