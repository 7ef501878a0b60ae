"""What a compiled arm has that neither the assumed modes nor a linear model do, named.

>>> require_linear(load_chain("models/chain6.xml"))
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Protocol

import mujoco
import numpy as np

from flexsim.errors import ModelError
from flexsim.numerics.types import Array

TURNS = 13  # angles of each joint that contacts are looked for at
BENT = 0.6  # [rad] in all hinges together: the tip aside by a third of the beam's length
DISABLED = (
    ("springs", mujoco.mjtDisableBit.mjDSBL_SPRING),
    ("dampers", mujoco.mjtDisableBit.mjDSBL_DAMPER),
)


class Arm(Protocol):
    """A compiled file of either kind."""

    @property
    def kind(self) -> str:
        """Of its beam: chain or rod."""

    @property
    def model(self) -> mujoco.MjModel:
        """As MuJoCo compiled it."""

    @property
    def source(self) -> str:
        """Its name, for messages."""


def require_linear(arm: Arm, joint_springs: bool = False) -> None:
    """Raise a ModelError for joints, motors, options or surroundings that the modes do not have.

    joint_springs: whether those of joints 1 and 2 are taken, as a linearisation does.
    """
    refuse(arm, linear_reasons(arm.model, joint_springs))


def refuse(arm: Arm, found: list[str]) -> None:
    """Raise a ModelError of all reasons, if there are any, that only the arm's own plant takes."""
    if found:
        them = "it" if len(found) == 1 else "them"
        raise ModelError(
            f"{arm.source}: {'; '.join(found)}, which neither the assumed modes nor a linear model "
            f"carry; remove {them}, or run the {arm.kind} alone (flexsim drive or tune with "
            f"--plant {arm.kind})"
        )


def linear_reasons(model: mujoco.MjModel, joint_springs: bool = False) -> list[str]:
    """Return what a model has that no linear model carries, a sentence's subject and verb each."""
    if not model.nq == model.nv == model.njnt:
        return []  # joints that no arm has; said elsewhere
    return [
        *_of_joints(model, joint_springs),
        *_of_motors(model),
        *(
            f"the option's flag disables {what}"
            for what, bit in DISABLED
            if model.opt.disableflags & bit
        ),
        *_of_surroundings(model),
    ]


def together(kind: str, names: list[str], what: str) -> Iterator[str]:
    """Give one sentence on all elements of a kind that have the same thing, if there are any."""
    if len(names) == 1:
        yield f"{kind} {names[0]!r} has {what}"
    elif names:
        yield f"{kind} {names[0]!r} and {len(names) - 1} more have {what}"


def _of_joints(model: mujoco.MjModel, joint_springs: bool) -> Iterator[str]:
    nonlinear = np.abs(model.jnt_stiffnesspoly).max(axis=1, initial=0.0)
    for what, values in (
        ("a spring (stiffness)", _of_motors_joints(model) * (not joint_springs)),
        ("dry friction (frictionloss)", model.dof_frictionloss),
        ("a limited range", model.jnt_limited),
        ("a limited torque (actuatorfrcrange)", model.jnt_actfrclimited),
        (
            "a spring that is not at rest in the straight arm (springref)",
            model.qpos_spring * ((model.jnt_stiffness > 0) | (nonlinear > 0)),
        ),
        ("a spring that is not linear", nonlinear),
        ("a spring that yields", model.jnt_springyield),
        ("a damper that is not linear", np.abs(model.dof_dampingpoly).max(axis=1, initial=0.0)),
    ):
        yield from together(
            "joint", [model.joint(int(i)).name for i in np.flatnonzero(values)], what
        )


def _of_motors_joints(model: mujoco.MjModel) -> Array:
    """Return the stiffnesses of the joints (m,), those of hinges along a link zero."""
    own = np.zeros(model.njnt)
    driven = [i for i in range(model.njnt) if model.joint(i).name in ("joint1", "joint2")]
    own[driven] = model.jnt_stiffness[driven]
    return own


def _of_motors(model: mujoco.MjModel) -> Iterator[str]:
    for what, values in (
        ("a limited range", model.actuator_ctrllimited | model.actuator_forcelimited),
        ("an armature of its own; give the joint one", model.actuator_armature),
        ("a damping of its own; give the joint one", model.actuator_damping),
        (
            "a damping that is not linear",
            np.abs(model.actuator_dampingpoly).max(axis=1, initial=0.0),
        ),
    ):
        names = [model.actuator(int(i)).name for i in np.flatnonzero(values)]
        yield from together("actuator", names, what)


def contact_of(model: mujoco.MjModel) -> str | None:
    """Return what touches what somewhere in the workspace, in words, None if nothing does.

    Tried with the beam straight and, a chain's, bent to either side, over all angles of the joints.
    """
    able = model.geom_contype | model.geom_conaffinity
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT or not (
        able.any() or model.npair
    ):
        return None
    data = mujoco.MjData(model)
    chain = model.njnt > 2 and not (model.jnt_type[2:] == mujoco.mjtJoint.mjJNT_SLIDE).any()
    driven = [0, int(model.joint("joint2").id)]  # behind the hinges of link 1, if that bends
    for theta1, theta2, bent in itertools.product(
        np.linspace(-np.pi, np.pi, TURNS, endpoint=False),
        np.linspace(-np.pi, np.pi, TURNS),
        (0.0, BENT, -BENT) if chain else (0.0,),
    ):
        data.qpos[:] = bent / max(1, model.njnt - 2)
        data.qpos[driven] = theta1, theta2
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_flex(model, data)
        mujoco.mj_collision(model, data)
        if data.ncon:
            names = [_geom_name(model, int(i)) for i in data.contact[0].geom]
            where = f"theta1 = {theta1:.2g}, theta2 = {theta2:.2g} rad"
            return f"{names[0]} can make contact with {names[1]}, as at {where}"
    return None


def _geom_name(model: mujoco.MjModel, geom: int) -> str:
    if geom < 0:
        return "the flex"
    body = model.body(int(model.geom_bodyid[geom])).name
    return f"geom {model.geom(geom).name!r}" if model.geom(geom).name else f"a geom of {body!r}"


def _of_surroundings(model: mujoco.MjModel) -> Iterator[str]:
    """Give contacts, gravity in the plane of motion, and a medium around."""
    options = model.opt
    touching = contact_of(model)
    if touching is not None:
        yield (
            f"{touching} (no geom does with contype and conaffinity 0, or "
            '<flag contact="disable"/>)'
        )
    if not options.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY:
        if options.gravity[:2].any():
            yield f"gravity is {options.gravity} m/s2, not along z"
    if options.density or options.viscosity:
        yield "the option density or viscosity gives the air a drag"
