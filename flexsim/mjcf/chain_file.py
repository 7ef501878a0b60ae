"""The MuJoCo chain as a plant: an MJCF file read, checked and made ready for compiled loops.

    >>> from flexsim.mjcf.chain_file import load_chain
    >>> chain = load_chain(path="models/chain6.xml")

The file may be edited, as long as it stays the two-link arm: hinges `joint1`, `joint2` and a
chain of hinges from the hub on, sites `hub` and `tip`, motors `motor1`, `motor2`, all in a plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import mujoco
import numpy as np

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
from flexsim.numerics.step_limits import POSES
from flexsim.numerics.types import Array


@dataclass(frozen=True, eq=False)
class ChainModel(ArmFile):
    """A compiled MJCF file of a chain, with its geometry.

    Attributes:
        model, text, source, L_R, clamp: see `ArmFile`.
        root: from joint 2 to the first hinge [m]; lengths: (N,) of the segments [m].
    """

    kind = "chain"

    root: float
    lengths: Array

    second: ClassVar[int] = 1  # joint 2 comes next to joint 1: link 1 is rigid

    @property
    def link1(self) -> Array:
        """Lengths (1,) of the pieces of link 1 [m]."""
        return np.array([self.L_R])

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
        return chain_motion(self.model, theta2)


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
    source, text, _, model = read_arm("chain", given)
    data = straight(model)
    x = np.append(data.xanchor[:, 0], data.site("tip").xpos[0])  # joints, hinges, tip
    lengths = np.diff(x)
    piece = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "root")
    clamp = float(data.xpos[piece][0] - x[1]) if piece >= 0 else float(lengths[1])
    chain = ChainModel(
        model, text, source, float(lengths[0]), clamp, float(lengths[1]), lengths[2:].copy()
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


def chain_motion(model: mujoco.MjModel, theta2: float) -> Motion:
    """Return M, D, K (nv, nv) of small motions about rest, joints free, at theta2 [rad]."""
    pose = np.zeros(model.nq)
    pose[1] = theta2
    return mass_matrix(model, pose), np.diag(model.dof_damping), stiffness_matrix(model)


def highest_frequency(model: mujoco.MjModel) -> float:
    """Return the highest natural frequency of the free chain [rad/s], over poses of joint 2.

    It bounds the step of an explicit integrator.
    """
    return highest_of([chain_motion(model, float(pose)) for pose in POSES])


def longest_step(model: mujoco.MjModel) -> float | None:
    """Return the step below which the model's integrator is stable [s], None if at any step."""
    motions = [chain_motion(model, float(pose)) for pose in POSES]
    longest = longest_of(model, motions, np.diag(model.dof_damping))
    return longest if np.isfinite(longest) else None
