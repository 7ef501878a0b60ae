"""The bodies of a compiled chain: link, hub and beam; and what of a file has no modal counterpart.

>>> link, hub, beam = parts(load_chain("models/chain6.xml"))
>>> hub.about_axis                # [kg m2] about joint 2
>>> require_carried(chain)        # refuses by name what the assumed modes do not have
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from flexsim.chain import ChainModel
from flexsim.errors import ModelError

Array = NDArray[np.float64]

OFF_AXIS = 1e-9  # [m] how far from the beam's axis a centre of mass may lie


@dataclass(frozen=True)
class Bodies:
    """Bodies of one part of the arm, with respect to a vertical axis.

    Attributes:
        mass: (B,) [kg]; x, y: (B,) of the centres of mass, from the axis, arm straight [m];
        inertia: (B,) about the centres of mass, along z [kg m2]; ids: of the bodies.
    """

    mass: Array
    x: Array
    y: Array
    inertia: Array
    ids: tuple[int, ...]

    @property
    def about_axis(self) -> float:
        """Moment of inertia about the axis [kg m2]."""
        return float(self.inertia.sum() + self.mass @ (self.x**2 + self.y**2))


def _bodies(model: mujoco.MjModel, ids: NDArray[np.intp], axis: float) -> Bodies:
    """Return the bodies with these indices, arm straight, about the axis at x = axis [m]."""
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    z = data.ximat.reshape(-1, 3, 3)[:, 2, :]  # (B, 3) vertical in each body's principal axes
    inertia = np.sum(z**2 * model.body_inertia, axis=1)
    return Bodies(
        mass=model.body_mass[ids].copy(),
        x=data.xipos[ids, 0] - axis,
        y=data.xipos[ids, 1].copy(),
        inertia=inertia[ids],
        ids=tuple(int(i) for i in ids),
    )


def parts(chain: ChainModel) -> tuple[Bodies, Bodies, Bodies]:
    """Return the bodies of the rigid link about joint 1, of the hub and the beam about joint 2.

    The beam begins with the body `root`, or, without one, behind the first hinge.
    """
    model = chain.model
    root = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "root")
    heads = (
        model.jnt_bodyid[0],
        model.jnt_bodyid[1],
        root if root >= 0 else model.jnt_bodyid[2],
    )
    within = [_subtree(model, int(head)) for head in heads]  # (3, nbody) each within the last
    beam = within[2]
    hub = within[1] & ~beam
    link = within[0] & ~within[1]
    return (
        _bodies(model, np.flatnonzero(link), 0.0),
        _bodies(model, np.flatnonzero(hub), chain.L_R),
        _bodies(model, np.flatnonzero(beam), chain.L_R),
    )


def _subtree(model: mujoco.MjModel, head: int) -> NDArray[np.bool_]:
    """Return which bodies (nbody,) are the head or carried by it."""
    member = np.zeros(model.nbody, dtype=bool)
    for i in range(model.nbody):  # parents come first
        member[i] = i == head or (i > 0 and bool(member[model.body_parentid[i]]))
    return member


def _require_on_axis(chain: ChainModel, bodies: Bodies) -> None:
    """Raise a ModelError for a mass beside the beam's axis, which the equations do not have."""
    data = mujoco.MjData(chain.model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(chain.model, data)
    for i in bodies.ids:
        aside = data.xipos[i, 1]
        if chain.model.body_mass[i] > 0 and abs(aside) > OFF_AXIS:
            name = chain.model.body(i).name
            _refuse(chain, f"body {name!r} has its centre of mass {aside:g} m beside the axis")


def require_carried(chain: ChainModel) -> None:
    """Raise a ModelError naming the first thing in a file that the assumed modes do not have."""
    model = chain.model
    _, hub, beam = parts(chain)
    _require_on_axis(chain, hub)
    _require_on_axis(chain, beam)
    checks = (
        ("a spring (stiffness)", model.jnt_stiffness[:2]),
        ("dry friction (frictionloss)", model.dof_frictionloss),
        ("a limited range", model.jnt_limited),
        ("a limited torque (actuatorfrcrange)", model.jnt_actfrclimited),
        (
            "a spring that is not at rest in the straight arm (springref)",
            model.qpos_spring * (model.jnt_stiffness > 0),
        ),
        ("a spring that is not linear", np.abs(model.jnt_stiffnesspoly).max(axis=1)),
        ("a spring that yields", model.jnt_springyield),
        ("a damper that is not linear", np.abs(model.dof_dampingpoly).max(axis=1)),
    )
    for what, values in checks:
        for i in np.flatnonzero(values):
            _refuse(chain, f"joint {model.joint(int(i)).name!r} has {what}")
    for what, values in (
        ("a limited range", model.actuator_ctrllimited | model.actuator_forcelimited),
        ("an armature of its own; give the joint one", model.actuator_armature),
        ("a damping of its own; give the joint one", model.actuator_damping),
        ("a delay", model.actuator_delay),
        ("a group that is disabled", [_disabled(model, i) for i in range(model.nu)]),
    ):
        for i in np.flatnonzero(values):
            _refuse(chain, f"actuator {model.actuator(int(i)).name!r} has {what}")
    for what, bit in (
        ("springs", mujoco.mjtDisableBit.mjDSBL_SPRING),
        ("dampers", mujoco.mjtDisableBit.mjDSBL_DAMPER),
        ("actuation", mujoco.mjtDisableBit.mjDSBL_ACTUATION),
    ):
        if model.opt.disableflags & bit:
            _refuse(chain, f"the option's flag disables {what}")
    _require_free_space(chain)


def _disabled(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether the options switch an actuator's group off."""
    return bool(model.opt.disableactuator >> int(model.actuator_group[actuator]) & 1)


def _require_free_space(chain: ChainModel) -> None:
    """Raise a ModelError for contacts, gravity in the plane of motion, and a medium around."""
    model, options = chain.model, chain.model.opt
    if not options.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT:
        touching = np.flatnonzero(model.geom_contype | model.geom_conaffinity)
        if model.npair:
            _refuse(chain, f"the contact pair {model.pair(0).name!r} can touch")
        if len(touching):
            _refuse(chain, f"geom {model.geom(int(touching[0])).name!r} can make contact")
    if not options.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY:
        if options.gravity[:2].any():
            _refuse(chain, f"gravity is {options.gravity} m/s2, not along z")
    if options.density or options.viscosity:
        _refuse(chain, "the option density or viscosity gives the air a drag")


def _refuse(chain: ChainModel, what: str) -> None:
    raise ModelError(
        f"{chain.source}: {what}, which the assumed modes cannot carry; remove it, or run the "
        "chain alone (flexsim drive or tune with --plant chain)"
    )
