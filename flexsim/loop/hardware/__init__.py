"""Sensors, computer, motors and joints of a laboratory: `base` has them, the rest their parts."""

from flexsim.loop.hardware.base import HARDWARE, IDEAL, Hardware, named, overridden
from flexsim.loop.hardware.bridges import (
    SENSED,
    BridgeNumbers,
    bridge_numbers,
    read_bridges,
)
from flexsim.loop.hardware.effects import EffectNumbers, JointEffects, rippled
from flexsim.loop.hardware.numbers import (
    HardwareNumbers,
    commands,
    lag_factors,
    mean_torque,
    measured,
    motor_step,
    waiting_room,
)
from flexsim.loop.hardware.sensing import Sensing

__all__ = [
    "HARDWARE",
    "IDEAL",
    "SENSED",
    "BridgeNumbers",
    "EffectNumbers",
    "Hardware",
    "HardwareNumbers",
    "JointEffects",
    "Sensing",
    "bridge_numbers",
    "commands",
    "lag_factors",
    "mean_torque",
    "measured",
    "motor_step",
    "named",
    "overridden",
    "read_bridges",
    "rippled",
    "waiting_room",
]
