"""The open-loop motions that plants are held against each other in."""

from __future__ import annotations

import math

import numpy as np

from flexsim.arm.locked import LOCKED
from flexsim.errors import DivergenceError
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.elementary import sin
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.modes_plant import AssumedModesPlant

DURATION = 2.0  # [s] of driven and free motion
GENTLE = (0.1, 0.05)  # [rad/s] initial joint rates of the free motion, beam straight
BRISK = (0.5, 0.3)  # [rad/s]
POSE = (0.0, 1.2)  # [rad]
BENT = 0.02  # |v|/L under the small torques, at most; the paper's arm: 0.019, under the large 0.075
SAFE = 1.05  # motions are not linear: a little less than in proportion, and again ...
TRIED = 6  # ... so often at most
WEAKEST = 10.0  # at most a tenth at a time, where one has run away
AMPLITUDES = {"small": 1.0, "large": 4.0}  # of `trial_torque`


def trial_torque(scale: float, duration: float = DURATION, period: float = PERIOD) -> Array:
    """Return (K, 2) torques scale (0.5 sin(2 pi t/0.8), 0.05 sin(2 pi t/0.5)) [N m]."""
    t = period * np.arange(round(duration / period))
    return scale * np.column_stack(
        [0.5 * sin(2 * np.pi * t / 0.8), 0.05 * sin(2 * np.pi * t / 0.5)]
    )


def fitting_torque(plant: Plant, scale: float) -> Array:
    """Return `trial_torque` (K, 2), as much stronger or weaker as the arm is heavier or lighter.

    In proportion to the inertia that each joint feels with the other free and the beam rigid, so
    that joints accelerate as the paper's do: a light arm is not thrown through angles that tell
    rounding errors apart, a heavy one moves. And less, until the beam bends by BENT of its length
    at most: a soft or resonant one would leave what the equations are for.
    """
    felt = felt_inertia(plant)
    felt = np.where(felt < LOCKED / 2, felt, 0.0)  # nothing moves a joint that stands still
    torque = trial_torque(scale) * (felt / felt_inertia(AssumedModesPlant()))
    for _ in range(TRIED):
        bent = _bent(plant, torque) / (BENT * scale)
        if bent <= 1:
            break
        torque = torque / min(SAFE * bent, WEAKEST)
    return torque


def _bent(plant: Plant, torque: Array) -> float:
    """Return the largest |v|/L of a plant under torques, inf if it runs away."""
    try:
        motion = drive(plant, setting("none"), torque, theta=POSE)
    except DivergenceError:
        return math.inf
    return float(np.abs(motion.v).max()) / plant.parameters.L


def felt_inertia(plant: Plant) -> Array:
    """Return what a motor's torque over its joint's acceleration is (2,) [kg m2], other joint free.

    At POSE, the beam as rigid as the first two coordinates have it.
    """
    linear = plant.linearised(POSE[1])
    M, gear = linear.M[:2, :2], np.diag(linear.S[:2])
    felt: Array = (M[0, 0] * M[1, 1] - M[0, 1] ** 2) / (M[[1, 0], [1, 0]] * gear)
    return felt
