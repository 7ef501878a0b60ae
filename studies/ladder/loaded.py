"""What does a rung make of what hangs at its tip? A moment there, a heavy and turning payload.

    >>> rotation_error(robot, plant), loaded_error(robot, "rule-of-thumb:6")

A chain's hinges decide both: a moment at the tip bends all of them alike, so that it turns the tip
by the sum of 1/k_j, where it turns the beam by L/EI; and what turns at the tip vibrates by it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexsim.arm.beam import MODES, Load, modal_integrals
from flexsim.arm.free_arm import clamped_frequencies
from flexsim.numerics.dense import solve
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.rod_plant import RodPlant
from flexsim.recording.traces import kind
from flexsim.robot import Robot
from studies.ladder.integrators import frequencies

LOAD = Load(1.0, 0.04)  # as heavy as the beam, its radius of gyration 0.2 L
UNLOADED = ("rigid", "printed", "rod")  # kinds: without modes, without payload, with a point tip


def rotation_error(robot: Robot, plant: Plant) -> float:
    """Return the relative error of the tip's static rotation under a moment there, nan if none.

    Assumed modes: that of as many terms of the sum over modes. A file's beam is its own truth.
    """
    p = robot.parameters
    if robot.file is not None:
        return np.nan
    if isinstance(plant, AssumedModesPlant):
        modes = plant.modes
        if modes == 0:
            return np.nan
        of = modal_integrals(replace(p, payload=0.0, payload_inertia=0.0), modes)
        found = float(np.sum(of.tip_slope**2 / (p.EI * p.L * of.beta**4)))
    elif isinstance(plant, ChainPlant):
        found = float(np.sum(1 / plant.model.jnt_stiffness[2:]))
    elif isinstance(plant, RodPlant):
        found = _of_rod(plant)
    else:
        return np.nan
    return found * p.EI / p.L - 1


def _of_rod(plant: RodPlant) -> float:
    """Return how far a rod's last edge turns per moment on it, a couple at its ends [rad/(N m)]."""
    K = plant.rod.motion(0.0)[2][2:, 2:]
    couple = np.zeros(len(K))
    length = float(np.diff(plant.rod.vertices)[-1])
    couple[-1], couple[-2] = 1 / length, -1 / length
    return float(couple @ solve(K, couple))


def loaded_error(robot: Robot, name: str) -> Array:
    """Return relative errors (3,) of the clamped frequencies under LOAD, nan where there are none.

    The plant is that of a robot with this payload: assumed modes are then modes under it.
    """
    if robot.file is not None or kind(name) in UNLOADED:
        return np.full(MODES, np.nan)
    p = robot.parameters
    mass, inertia = LOAD.mass * p.m_b, LOAD.inertia * p.m_b * p.L**2
    laden = Robot(replace(p, payload=mass, payload_inertia=inertia))
    found = frequencies(laden.plant(name))[0]
    return found / (clamped_frequencies(laden.parameters, MODES) / (2 * np.pi)) - 1
