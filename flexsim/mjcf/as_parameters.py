"""The robot of a compiled MJCF file: its rigid bodies, and the uniform beam most like its own.

>>> parameters_of(load_chain("models/chain6.xml")).EI        # [N m2]
"""

from __future__ import annotations

import mujoco
import numpy as np

from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError
from flexsim.mjcf.bodies import parted, parts, payload_of, robot_of_bodies
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.rod_file import RodModel
from flexsim.mjcf.rod_xml import GREGORY

ROUNDING = 1e-9  # of masses: files have 12 digits


def beam_heads(rod: RodModel) -> list[int]:
    """Return the bodies of a rod's beam: the piece at the clamp, where there is one, and vertices.

    Without a body `root` the rod's own mass begins with its first free vertex.
    """
    root = mujoco.mj_name2id(rod.model, mujoco.mjtObj.mjOBJ_BODY, "root")
    return [*([root] if root >= 0 else []), *(int(i) for i in rod.model.jnt_bodyid[2::2])]


def parameters_of_rod(rod: RodModel) -> Parameters:
    """Return the robot of a rod's file: its rigid bodies, and its beam's length, mass and EI.

    Raises:
        ModelError: a quantity is zero that must not be.
    """
    model = rod.model
    spans = np.diff(rod.vertices)
    EI = float(rod.bending[0] * (spans[0] + spans[1]))
    bodies = parted(model, rod.L_R, beam_heads(rod))
    L = rod.reach - rod.clamp
    eta, load = float(model.flex_damping[0]), (rod_payload(rod), 0.0)
    return robot_of_bodies(bodies, model, rod.source, rod.L_R, rod.clamp, L, EI, eta, load)


def rod_payload(rod: RodModel) -> float:
    """Return what the last vertex of a rod weighs beyond its share of the beam [kg], 0 if nothing.

    Its share is GREGORY's first weight of what a vertex in the middle weighs.
    """
    masses = rod.model.body_mass[rod.model.jnt_bodyid[2::2]]
    beyond = float(masses[-1] - GREGORY[-1] * masses[0])
    return beyond if beyond > ROUNDING * masses[-1] else 0.0


def parameters_of(chain: ChainModel) -> Parameters:
    """Return the robot of a file: its rigid bodies, and the uniform beam of its length, mass,
    static tip compliance and, under a force there, damping; the body `payload` is a payload.

    The assumed modes of a file do not use that beam; tables and the kinematics do.

    Raises:
        ModelError: a hinge of the beam has no stiffness, or another quantity is zero that must
            not be.
    """
    model = chain.model
    for i in range(2, model.nv):
        if model.jnt_stiffness[i] == 0:
            raise ModelError(
                f"{chain.source}: joint {model.joint(i).name!r} has no stiffness, so the beam does "
                "not vibrate; give every hinge of the beam one"
            )
    L = chain.reach - chain.clamp
    arm = np.append(0.0, np.cumsum(chain.lengths))
    lever = arm[-1] - arm[:-1]  # (N,) from each hinge to the tip
    compliance = float(np.sum(lever**2 / model.jnt_stiffness[2:]))
    EI = L**3 / (3 * compliance)
    turned = (lever / model.jnt_stiffness[2:]) ** 2  # of a hinge, under the force
    eta = float(np.sum(model.dof_damping[2:] * turned)) / compliance
    bodies, load = parts(chain), payload_of(chain)
    return robot_of_bodies(bodies, model, chain.source, chain.L_R, chain.clamp, L, EI, eta, load)
