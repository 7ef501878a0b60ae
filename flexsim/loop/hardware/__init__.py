"""Sensors, computer, motors and joints of a laboratory: `base` has them, the rest their parts."""

from flexsim.loop.hardware.base import HARDWARE, IDEAL, Hardware, named, overridden
from flexsim.loop.hardware.bridges import (
    SENSED,
    BridgeNumbers,
    bridge_numbers,
    read_bridges,
)
from flexsim.loop.hardware.effects import EffectNumbers, JointEffects
from flexsim.loop.hardware.joints import encoder_angles, joint_step
from flexsim.loop.hardware.memory import joint_memory
from flexsim.loop.hardware.numbers import (
    HardwareNumbers,
    cascade,
    commands,
    lag_factors,
    mean_torque,
    measured,
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
    "cascade",
    "commands",
    "encoder_angles",
    "joint_memory",
    "joint_step",
    "lag_factors",
    "mean_torque",
    "measured",
    "named",
    "overridden",
    "read_bridges",
    "waiting_room",
]
