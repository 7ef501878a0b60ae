"""The rod as a plant's model: an MJCF file read, checked and made ready for compiled loops.

    >>> from flexsim.mjcf.rod_file import load_rod
    >>> rod = load_rod(path="models/rod.xml")

The file may be edited, as long as it stays the two-link arm of `flexsim.mjcf.rod_xml`: hinges
`joint1` and `joint2`, then two slides for every vertex of one flex, the last of which carries the
site `tip`. Its bending is MuJoCo's; what is read here is for frequencies, energy and drawing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from flexsim.mjcf.arm_file import ArmFile, Given, Motion, given_text, read_arm, require_stable_step
from flexsim.mjcf.chain_file import mass_matrix
from flexsim.mjcf.own_motion import require_steady
from flexsim.mjcf.reading.geometry import straight
from flexsim.mjcf.reading.names import Names
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array

SMALL = 1e-6  # [m] displacement of a vertex, at which the rod's force is still linear


@dataclass(frozen=True, eq=False)
class RodModel(ArmFile):
    """A compiled MJCF file of a rod, with its geometry.

    Attributes:
        model, text, source, L_R, clamp: see `ArmFile`.
        vertices: (N+2,) distances from joint 2, the first two on the hub, the last the tip [m].
        bending: (N,) k of the vertices from the second on, energy k |kb|^2 [N m].
    """

    kind = "rod"

    vertices: Array
    bending: Array

    @property
    def reach(self) -> float:
        """Distance from joint 2 to the tip of the straight beam [m]."""
        return float(self.vertices[-1])

    def motion(self, theta2: float) -> Motion:
        """Return M, D, K (N+2, N+2) of the joints and the vertices' motions across the rod.

        Edges that keep their lengths leave each vertex of a straight rod no other; see `ArmFile`.
        """
        model, pose = self.model, np.zeros(self.model.nq)
        pose[1] = theta2
        moving = moving_across(model)
        take = np.ix_(moving, moving)
        D = rod_damping(model)[take] + np.diag(model.dof_damping[moving])
        return mass_matrix(model, pose)[take], D, rod_stiffness(model)[take]

    @property
    def dampers(self) -> Array:
        """The part of D (N+2, N+2) that is dampers of joints; see `ArmFile`."""
        return np.diag(self.model.dof_damping[moving_across(self.model)])


def load_rod(
    path: str | Path | None = None, text: str | None = None, names: Names | None = None
) -> RodModel:
    """Return the rod of an MJCF file, or of its text, checked.

    Args:
        path: MJCF file; text: MJCF instead of a file. names: that it has for the parts of the arm.

    Raises:
        ModelError: the file cannot be read, does not compile, is not the two-link arm with a rod,
            or its step is beyond what its integrator can take.
    """
    return rod_of(given_text(path, text, names))


def rod_of(given: Given) -> RodModel:
    """Return the rod of MJCF; see `load_rod`."""
    source, text, spec, model = read_arm("rod", given)
    data = straight(model)
    L_R = float(data.xanchor[1, 0])
    vertices = data.flexvert_xpos[:, 0] - L_R
    spans = np.diff(vertices)
    EI = spec.flexes[0].young * math.pi * spec.flexes[0].radius ** 4 / 4
    clamp = float(vertices[:2].mean())
    rod = RodModel(model, text, source, L_R, clamp, vertices, EI / (spans[:-1] + spans[1:]))
    require_stable_step(rod)
    require_steady(rod)
    return rod


def rod_stiffness(model: mujoco.MjModel) -> Array:
    """Return the stiffness (nv, nv) of the straight rod, by differences of its force [N/m]."""
    data = mujoco.MjData(model)
    stiffness = np.zeros((model.nv, model.nv))
    for column in range(3, model.nv, 2):
        for sign in (1, -1):
            data.qpos[:] = 0.0
            data.qpos[column] = sign * SMALL
            _forward(model, data)
            stiffness[:, column] -= sign * data.qfrc_spring / (2 * SMALL)
    return (stiffness + stiffness.T) / 2


def _forward(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    with quiet_warnings():
        mujoco.mj_forward(model, data)


def rod_damping(model: mujoco.MjModel) -> Array:
    """Return the damping (nv, nv) of the straight rod's elasticity, by differences [N s/m]."""
    data = mujoco.MjData(model)
    damping = np.zeros((model.nv, model.nv))
    if not model.flex_damping.any():
        return damping
    still = model.dof_damping  # a damper at a joint is not the rod's
    for column in range(3, model.nv, 2):
        for sign in (1, -1):
            data.qvel[:] = 0.0
            data.qvel[column] = sign * SMALL
            _forward(model, data)
            damping[:, column] -= sign * (data.qfrc_damper + still * data.qvel) / (2 * SMALL)
    return (damping + damping.T) / 2


def moving_across(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Return the coordinates of joint 1, joint 2 and the vertices' motions across the rod."""
    return np.concatenate([[0, 1], np.arange(3, model.nv, 2)])


def rod_frequencies(model: mujoco.MjModel, locked: bool = True, theta2: float = 0.0) -> Array:
    """Return the frequencies, rising, of small vibrations about the straight rod [rad/s].

    Edges that keep their lengths leave each vertex of a straight rod its motion across.

    Args:
        model: a rod's. locked: whether the joints are; else theta2 is the angle of joint 2.
    """
    qpos = np.zeros(model.nq)
    qpos[1] = theta2
    moving = moving_across(model)[2 if locked else 0 :]
    take = np.ix_(moving, moving)
    squared, _ = natural_modes(rod_stiffness(model)[take], mass_matrix(model, qpos)[take])
    return np.sqrt(np.maximum(squared, 0.0))
