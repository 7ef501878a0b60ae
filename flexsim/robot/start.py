"""Where a motion starts: a keyframe of the robot's file, as the state of any of its plants.

    >>> start = start_of(robot, robot.plant("assumed-modes"), "bent")
    >>> drive(plant, chosen, torque, state=start.state)

A plant of the file itself has the keyframe's own state, a straight beam is every plant's, and a
bent one is projected on the assumed modes: by the file's mass on its own modes, by the paper's
(15) on an analytic beam's. Without a file the keyframes are those that `flexsim chain` writes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexsim.errors import ParameterError
from flexsim.mjcf.arm_file import ArmFile
from flexsim.mjcf.chain_file import mass_matrix
from flexsim.mjcf.reading.keyframes import Keyframe, keyframe
from flexsim.numerics.dense import product
from flexsim.numerics.elementary import cos
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_as_modes import vibration
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.rod_plant import RodPlant
from flexsim.robot.robot import Robot


@dataclass(frozen=True, eq=False)
class Start:
    """A state that a motion starts from.

    Attributes:
        keyframe: its name; source: the file it is from.
        state: (2 m,) of the plant. v: the plant's tip deflection [m]; v_of_file: the file's.
    """

    keyframe: str
    source: str
    state: Array
    v: float
    v_of_file: float

    @property
    def theta(self) -> Array:
        """Joint angles (2,) [rad]."""
        return self.state[:2].copy()

    @property
    def rates(self) -> Array:
        """Rates (2,) of the joints [rad/s]."""
        m = len(self.state) // 2
        return self.state[m : m + 2].copy()

    @property
    def at_rest(self) -> bool:
        """Whether nothing moves."""
        return not self.state[len(self.state) // 2 :].any()


def start_of(robot: Robot, plant: Plant, name: str) -> Start:
    """Return a plant's state at a keyframe.

    Args:
        robot: whose file has it; without a file, what the plant or the designed chain has.
        plant: of the robot. name: of the keyframe.

    Raises:
        ParameterError: there is no such keyframe, or the plant cannot bend as it does.
    """
    shown = _with_keyframes(robot, plant)
    arm = shown.chain if isinstance(shown, ChainPlant) else shown.rod
    source = arm.source if robot.given is not None else f"the designed {arm.kind}"
    found = keyframe(arm.model, name, source)
    v = float(shown.deflection(found.qpos[None])[1][0])
    state = _state(plant, shown, arm, found)
    if state is None:
        raise ParameterError(
            f"plant {plant.name!r} cannot be bent as keyframe {name!r} of {source} is; give one "
            f"with a straight beam, or choose assumed-modes or {arm.kind}"
        )
    own = float(plant.deflection(state[None, : len(state) // 2])[1][0])
    return Start(name, source, state, own, v)


def _with_keyframes(robot: Robot, plant: Plant) -> ChainPlant | RodPlant:
    """Return the plant of the file, the plant itself or the designed chain."""
    if robot.given is None and isinstance(plant, ChainPlant | RodPlant):
        return plant
    if robot.rod is not None:
        return RodPlant(robot.parameters, robot.rod)
    return robot.chain_plant()


def _state(
    plant: Plant, shown: ChainPlant | RodPlant, arm: ArmFile, found: Keyframe
) -> Array | None:
    """Return a plant's state (2 m,) of a keyframe of another, None if it has none."""
    if plant.mjcf == arm.text:
        return np.concatenate(found)
    state = plant.rest_state(found.qpos[:2])
    m = len(state) // 2
    state[m : m + 2] = found.qvel[:2]
    if not (found.qpos[2:].any() or found.qvel[2:].any()):
        return state
    if not isinstance(plant, AssumedModesPlant) or plant.modes == 0:
        return None
    state[2:m], state[m + 2 :] = _modal(plant, shown, found)
    return state


def _modal(
    plant: AssumedModesPlant, shown: ChainPlant | RodPlant, found: Keyframe
) -> tuple[Array, Array]:
    """Return the modal coordinates (n,) and their rates of a bent beam."""
    if plant.chain is not None and isinstance(shown, ChainPlant):  # V' M V = m_b
        model, own = shown.chain.model, shown.parameters
        M = mass_matrix(model, np.zeros(model.nq))[2:, 2:]  # (N, N)
        share = product(vibration(shown.chain, own, plant.modes).hinges.T, M) / own.m_b  # (n, N)
        return product(share, found.qpos[2:]), product(share, found.qvel[2:])
    share = shown.projection(plant.modes)  # (n, N+2)
    if isinstance(shown, RodPlant):
        across = shown.shape(np.stack([np.concatenate(found), np.tile(found.qvel, 2)]))[:, :, 1]
        return product(share, across[0]), product(share, across[1])
    _, across = shown.shape(found.qpos[None])
    angle, rate = np.cumsum(found.qpos[2:]), np.cumsum(found.qvel[2:])  # (N,) of the segments
    rising = np.cumsum(shown.chain.lengths * cos(angle) * rate)
    return product(share, across[0]), product(share, np.concatenate([[0.0, 0.0], rising]))
