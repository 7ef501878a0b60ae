"""Another arm from a compiled one: a stiffer or heavier beam, a payload at the tip.

>>> heavier = changed(chain, payload=0.05)
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable
from dataclasses import replace
from typing import TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from flexsim.arm.locked import LOCKED, which_locked
from flexsim.errors import ParameterError
from flexsim.mjcf.arm_xml import PAYLOAD
from flexsim.mjcf.bodies import parts
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.rod_file import RodModel
from flexsim.numerics.dense import product
from flexsim.numerics.eigen import symmetric_eigen
from flexsim.numerics.types import Array

Arm = TypeVar("Arm", ChainModel, RodModel)
INTEGRATORS = {
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
}


def changed(
    chain: ChainModel, stiffness: float = 1.0, density: float = 1.0, payload: float = 0.0
) -> ChainModel:
    """Return a copy of a chain with its beam changed; its text remains the original's.

    Args:
        chain: a checked file. stiffness, density: factors of every hinge's stiffness, and of the
            mass and inertia of every body of the beam but a payload; its dampers go with the root
            of both, so that the damping ratios stay. payload: point mass at the tip [kg].

    Raises:
        ParameterError: a factor that is not a finite number above 0, or a negative payload.
    """
    for what, value in (("stiffness", stiffness), ("density", density)):
        if not 0 < value < np.inf:
            raise ParameterError(f"factor of {what} is {value}; give a finite number above 0")
    if not 0 <= payload < np.inf:
        raise ParameterError(f"payload is {payload} kg; give a finite number, 0 or more")
    model = copy.copy(chain.model)
    own = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, PAYLOAD)
    beam = [body for body in parts(chain)[2].ids if body != own]
    model.body_mass[beam] *= density
    model.body_inertia[beam] *= density
    model.jnt_stiffness[2:] *= stiffness
    model.dof_damping[2:] *= math.sqrt(stiffness * density)
    if payload:
        tip = model.site("tip")
        _load(model, int(tip.bodyid[0]), tip.pos, payload)
    mujoco.mj_setConst(model, mujoco.MjData(model))  # what MuJoCo derives from masses
    return replace(chain, model=model)


def with_motors(arm: Arm, I_m1: float | None, I_m2: float | None) -> Arm:
    """Return a copy of a chain or rod, with other armatures of its joints where given [kg m2]."""
    model = copy.copy(arm.model)
    for dof, inertia in zip(_driven(model), (I_m1, I_m2), strict=True):
        if inertia is not None:
            model.dof_armature[dof] = inertia
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return replace(arm, model=model)


def with_locked(arm: Arm, joints: Iterable[str]) -> Arm:
    """Return a copy of a chain or rod whose joints of these names do not move.

    A joint's limits and dry friction go: they would act on what does not move. MuJoCo's solvers of
    constraints end by a tolerance over the mean of the inertias, which is to be what it was.

    Raises:
        ParameterError: there is no joint of that name.
    """
    model = copy.copy(arm.model)
    driven = _driven(model)
    dofs = driven[np.flatnonzero(which_locked(joints))]
    mean = float(model.stat.meaninertia)  # of the mass matrix's diagonal, as the file has it
    before = mean + model.dof_armature[driven].sum() / model.nv
    model.dof_armature[dofs] = LOCKED
    model.jnt_limited[dofs] = False
    model.dof_frictionloss[dofs] = 0.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    model.opt.tolerance *= before / (mean + model.dof_armature[driven].sum() / model.nv)
    return replace(arm, model=model)


def _driven(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Return which degrees of freedom joints 1 and 2 are (2,)."""
    return np.array([0, model.joint("joint2").id])


def stepped(chain: Arm, integrator: str, step: float) -> Arm:
    """Return a copy of a chain or rod with another integrator and step [s], stable or not.

    Raises:
        ParameterError: there is no such integrator.
    """
    if integrator not in INTEGRATORS:
        raise ParameterError(
            f"integrator {integrator!r} is unknown; choose one of {', '.join(INTEGRATORS)}"
        )
    model = copy.copy(chain.model)
    model.opt.integrator = INTEGRATORS[integrator]
    model.opt.timestep = step
    return replace(chain, model=model)


def without_damping(arm: Arm) -> Arm:
    """Return a copy of a chain or rod with all damping of its joints and its flex zero."""
    model = copy.copy(arm.model)
    model.dof_damping[:] = 0.0
    model.flex_damping[:] = 0.0
    return replace(arm, model=model)


def _load(model: mujoco.MjModel, body: int, place: Array, mass: float) -> None:
    """Add a point mass [kg] to a body, at a place (3,) in its frame [m]."""
    total = model.body_mass[body] + mass
    centre = (model.body_mass[body] * model.body_ipos[body] + mass * place) / total
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.body_iquat[body])
    axes = rotation.reshape(3, 3)
    inertia = product(axes * model.body_inertia[body], axes.T)
    inertia += model.body_mass[body] * _point(model.body_ipos[body] - centre)
    inertia += mass * _point(place - centre)
    values, vectors = symmetric_eigen(inertia)
    vectors[:, 2] = np.cross(vectors[:, 0], vectors[:, 1])  # a rotation, no reflection
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, vectors.flatten())
    model.body_mass[body], model.body_ipos[body] = total, centre
    model.body_inertia[body], model.body_iquat[body] = values, quaternion


def _point(d: Array) -> Array:
    """Return the inertia (3, 3) about the origin of a unit mass at d (3,) [m2]."""
    return float(product(d, d)) * np.eye(3) - np.outer(d, d)
