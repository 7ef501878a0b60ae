"""Sensors, computer, motors and joints of a laboratory: `base` has them, the rest their parts."""

from flexsim.loop.hardware.base import HARDWARE, IDEAL, Hardware, named, overridden
from flexsim.loop.hardware.bridges import (
    SENSED,
    BridgeNumbers,
    NoBridges,
    bridge_numbers,
    leanest_bridges,
    note,
    seen_v,
    tell,
)
from flexsim.loop.hardware.effects import EffectNumbers, JointEffects, NoEffects, leanest_effects
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
    "NoBridges",
    "NoEffects",
    "Sensing",
    "bridge_numbers",
    "cascade",
    "commands",
    "encoder_angles",
    "joint_memory",
    "joint_step",
    "lag_factors",
    "leanest_bridges",
    "leanest_effects",
    "mean_torque",
    "measured",
    "named",
    "note",
    "overridden",
    "seen_v",
    "tell",
    "waiting_room",
]
