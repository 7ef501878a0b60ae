"""The open-loop motions that plants are held against each other in."""

from __future__ import annotations

import numpy as np

from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array

DURATION = 2.0  # [s] of driven and free motion
GENTLE = (0.1, 0.05)  # [rad/s] initial joint rates of the free motion, beam straight
BRISK = (0.5, 0.3)  # [rad/s]
POSE = (0.0, 1.2)  # [rad]
AMPLITUDES = {"small": 1.0, "large": 4.0}  # of `trial_torque`


def trial_torque(scale: float, duration: float = DURATION, period: float = PERIOD) -> Array:
    """Return (K, 2) torques scale (0.5 sin(2 pi t/0.8), 0.05 sin(2 pi t/0.5)) [N m]."""
    t = period * np.arange(round(duration / period))
    return scale * np.column_stack(
        [0.5 * np.sin(2 * np.pi * t / 0.8), 0.05 * np.sin(2 * np.pi * t / 0.5)]
    )
