"""The MuJoCo chain as a plant: an MJCF file read, checked and made ready for compiled loops.

    >>> from flexsim.mjcf.chain_file import load_chain
    >>> chain = load_chain(path="models/chain6.xml")

The file may be edited, as long as it stays the two-link arm: hinges `joint1`, `joint2` and a
chain of hinges from the hub on, sites `hub` and `tip`, motors `motor1`, `motor2`, all in a plane.
Where link 1 bends as well there are hinges between `joint1` and `joint2`, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from flexsim.mjcf.arm_file import (
    ArmFile,
    Given,
    Motion,
    given_text,
    highest_of,
    longest_of,
    read_arm,
    require_stable_step,
)
from flexsim.mjcf.own_motion import require_steady
from flexsim.mjcf.reading.geometry import straight
from flexsim.mjcf.reading.names import Names
from flexsim.mjcf.reading.second_beam import bends_twice
from flexsim.numerics.step_limits import POSES
from flexsim.numerics.types import Array

TWO_CHAINS = "two-chains"  # what is checked where link 1 bends as well


@dataclass(frozen=True, eq=False)
class ChainModel(ArmFile):
    """A compiled MJCF file of a chain, with its geometry.

    Coordinates are joint 1, joint 2, then the hinges from joint 1 on, whatever the file's order is.

    Attributes:
        model, text, source, L_R, clamp: see `ArmFile`.
        link1: lengths (second,) of link 1's pieces, from joint 1 on [m]: one, unless it bends.
        root: from joint 2 to the first hinge [m]; lengths: (N,) of the segments [m].
    """

    kind = "chain"

    link1: Array
    root: float
    lengths: Array

    @property
    def second(self) -> int:
        """Place of joint 2 in the file's order of joints: 1, or behind the hinges of link 1."""
        return len(self.link1)

    @property
    def bends_twice(self) -> bool:
        """Whether link 1 bends as well."""
        return self.second > 1

    @property
    def order(self) -> NDArray[np.intp]:
        """For each coordinate, which joint of the file it is (m,)."""
        return joint_order(self.model.njnt, self.second)

    @property
    def reach(self) -> float:
        """Distance from joint 2 to the tip of the straight beam [m]."""
        return self.root + float(self.lengths.sum())

    @property
    def hinges(self) -> Array:
        """Distances (N,) from the clamp to the hinges [m]."""
        starts = np.concatenate([[0.0], np.cumsum(self.lengths)[:-1]])
        return self.root - self.clamp + starts

    def motion(self, theta2: float) -> Motion:
        """Return M, D, K (nv, nv) of joint and hinge angles; see `ArmFile`."""
        return chain_motion(self.model, theta2, self.second)


def load_chain(
    path: str | Path | None = None, text: str | None = None, names: Names | None = None
) -> ChainModel:
    """Return the chain of an MJCF file, or of its text, checked.

    Args:
        path: MJCF file; text: MJCF instead of a file. names: that it has for the parts of the arm.

    Raises:
        ModelError: the file cannot be read, does not compile, is not the two-link arm, or its
            step is beyond what its integrator can take.
    """
    return chain_of(given_text(path, text, names))


def chain_of(given: Given) -> ChainModel:
    """Return the chain of MJCF; see `load_chain`."""
    source, text, _, model = read_arm(TWO_CHAINS if bends_twice(given.text) else "chain", given)
    data = straight(model)
    x = np.append(data.xanchor[:, 0], data.site("tip").xpos[0])  # joints, hinges, tip
    lengths, second = np.diff(x), model.joint("joint2").id
    piece = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "root")
    clamp = float(data.xpos[piece][0] - x[second]) if piece >= 0 else float(lengths[second])
    chain = ChainModel(
        model,
        text,
        source,
        float(lengths[0] if second == 1 else x[second]),
        clamp,
        lengths[:second].copy(),
        float(lengths[second]),
        lengths[second + 1 :].copy(),
    )
    require_stable_step(chain)
    require_steady(chain)
    _ = chain.bridge_sites  # refuses sites off the beam
    return chain


def mass_matrix(model: mujoco.MjModel, qpos: Array) -> Array:
    """Return the joint-space inertia (nv, nv) at a configuration (nq,) [kg m2]."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_makeM(model, data)  # not factorised: a singular one is judged by who asks
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return full


def stiffness_matrix(model: mujoco.MjModel) -> Array:
    """Return the diagonal matrix (nv, nv) of the joints' linear stiffnesses [N m/rad]."""
    return np.diag(model.jnt_stiffness)


def motor_matrix(model: mujoco.MjModel) -> Array:
    """Return S (nv, 2): the generalised forces of unit torques at the motors, their gears."""
    S = np.zeros((model.nv, 2))
    for i in range(2):
        S[i, i] = model.actuator_gear[i, 0] * model.actuator_gainprm[i, 0]
    return S


def joint_order(joints: int, second: int) -> NDArray[np.intp]:
    """Return for each coordinate which of the file's joints it is, joint 2 at place `second`."""
    others = np.delete(np.arange(joints), [0, second])
    return np.concatenate([[0, second], others])


def chain_motion(model: mujoco.MjModel, theta2: float, second: int = 1) -> Motion:
    """Return M, D, K (nv, nv) of small motions about rest, joints free, at theta2 [rad].

    second: place of joint 2 among the joints; coordinates are as those of a `ChainModel`.
    """
    order, pose = joint_order(model.njnt, second), np.zeros(model.nq)
    pose[second] = theta2
    M = mass_matrix(model, pose)[np.ix_(order, order)]
    return M, np.diag(model.dof_damping[order]), np.diag(model.jnt_stiffness[order])


def highest_frequency(model: mujoco.MjModel) -> float:
    """Return the highest natural frequency of the free chain [rad/s], over poses of joint 2.

    It bounds the step of an explicit integrator.
    """
    return highest_of([chain_motion(model, float(pose)) for pose in POSES])


def longest_step(model: mujoco.MjModel) -> float | None:
    """Return the step below which the model's integrator is stable [s], None if at any step."""
    second = model.joint("joint2").id
    motions = [chain_motion(model, float(pose), second) for pose in POSES]
    longest = longest_of(model, motions, motions[0][1])
    return longest if np.isfinite(longest) else None
