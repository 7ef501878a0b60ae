"""What a compiled arm has that neither the assumed modes nor a linear model do, named.

>>> require_linear(load_chain("models/chain6.xml"))
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import mujoco
import numpy as np

from flexsim.errors import ModelError

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
        ("a spring (stiffness)", model.jnt_stiffness[:2] * (not joint_springs)),
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


def _of_surroundings(model: mujoco.MjModel) -> Iterator[str]:
    """Give contacts, gravity in the plane of motion, and a medium around."""
    options = model.opt
    if not options.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT:
        touching = np.flatnonzero(model.geom_contype | model.geom_conaffinity)
        if model.npair:
            yield f"the contact pair {model.pair(0).name!r} can touch"
        if len(touching):
            name = model.geom(int(touching[0])).name or f"{touching[0]}"
            yield (
                f"geom {name!r} can make contact (disable it by contype and conaffinity 0, or all "
                'by <flag contact="disable"/>)'
            )
        if (model.flex_contype | model.flex_conaffinity).any() and len(touching):
            yield "the flex can make contact"
    if not options.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY:
        if options.gravity[:2].any():
            yield f"gravity is {options.gravity} m/s2, not along z"
    if options.density or options.viscosity:
        yield "the option density or viscosity gives the air a drag"
