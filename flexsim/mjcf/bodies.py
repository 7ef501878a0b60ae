"""The bodies of a compiled chain: link, hub and beam; and what of a file has no modal counterpart.

>>> link, hub, beam = parts(load_chain("models/chain6.xml"))
>>> hub.about_axis                # [kg m2] about joint 2
>>> require_carried(chain)        # refuses by name what the assumed modes do not have
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError, ParameterError
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.rod_file import RodModel
from flexsim.numerics.types import Array

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
    root = mujoco.mj_name2id(chain.model, mujoco.mjtObj.mjOBJ_BODY, "root")
    return parted(chain.model, chain.L_R, [root if root >= 0 else int(chain.model.jnt_bodyid[2])])


def parted(
    model: mujoco.MjModel, L_R: float, beam_heads: Sequence[int]
) -> tuple[Bodies, Bodies, Bodies]:
    """Return link, hub and beam as `parts`, the beam being these bodies and what they carry."""
    beam = _carried(model, beam_heads)
    jointed = _carried(model, [int(model.jnt_bodyid[1])])
    hub = jointed & ~beam
    link = _carried(model, [int(model.jnt_bodyid[0])]) & ~jointed
    return (
        _bodies(model, np.flatnonzero(link), 0.0),
        _bodies(model, np.flatnonzero(hub), L_R),
        _bodies(model, np.flatnonzero(beam), L_R),
    )


def robot_of_bodies(
    bodies: tuple[Bodies, Bodies, Bodies],
    model: mujoco.MjModel,
    source: str,
    L_R: float,
    clamp: float,
    L: float,
    EI: float,
) -> Parameters:
    """Return the robot of link, hub and beam, its joints and motors read from the model.

    Raises:
        ModelError: a quantity is zero that must not be.
    """
    link, hub, beam = bodies
    gears = [float(model.actuator_gear[i, 0] * model.actuator_gainprm[i, 0]) for i in range(2)]
    for element, quantity, value in (
        ("body 'link1'", "moment of inertia about joint1 [kg m2]", link.about_axis),
        ("body 'hub'", "mass [kg]", float(hub.mass.sum())),
        ("body 'hub'", "moment of inertia about joint2 [kg m2]", hub.about_axis),
        ("motor 'motor1'", "gear", gears[0]),
        ("motor 'motor2'", "gear", gears[1]),
    ):
        if not value > 0:
            raise ModelError(f"{source}: {element} has the {quantity} {value:g}; give more than 0")
    try:
        return Parameters(
            L_R=L_R,
            I_R0=link.about_axis,
            I_H=hub.about_axis,
            m_H=float(hub.mass.sum()),
            r=clamp,
            L=L,
            rho=float(beam.mass.sum()) / L,
            EI=EI,
            F_1=float(model.dof_damping[0]) / gears[0] ** 2 if gears[0] else 0.0,
            F_2=float(model.dof_damping[1]) / gears[1] ** 2 if gears[1] else 0.0,
            I_m1=float(model.dof_armature[0]),
            I_m2=float(model.dof_armature[1]),
            r_1=gears[0],
            r_2=gears[1],
        )
    except ParameterError as error:
        raise ModelError(f"{source}: {error}") from None


def _carried(model: mujoco.MjModel, heads: Sequence[int]) -> NDArray[np.bool_]:
    """Return which bodies (nbody,) are one of the heads or carried by one."""
    member = np.zeros(model.nbody, dtype=bool)
    for i in range(model.nbody):  # parents come first
        member[i] = i in heads or (i > 0 and bool(member[model.body_parentid[i]]))
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
    _, hub, beam = parts(chain)
    _require_on_axis(chain, hub)
    _require_on_axis(chain, beam)
    require_linear(chain)


def require_linear(arm: ChainModel | RodModel, joint_springs: bool = False) -> None:
    """Raise a ModelError for joints, motors, options or surroundings that the modes do not have.

    joint_springs: whether those of joints 1 and 2 are taken, as a linearisation does.
    """
    model = arm.model
    checks = (
        ("a spring (stiffness)", model.jnt_stiffness[:2] * (not joint_springs)),
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
            _refuse(arm, f"joint {model.joint(int(i)).name!r} has {what}")
    for what, values in (
        ("a limited range", model.actuator_ctrllimited | model.actuator_forcelimited),
        ("an armature of its own; give the joint one", model.actuator_armature),
        ("a damping of its own; give the joint one", model.actuator_damping),
        ("a delay", model.actuator_delay),
        ("a group that is disabled", [_disabled(model, i) for i in range(model.nu)]),
    ):
        for i in np.flatnonzero(values):
            _refuse(arm, f"actuator {model.actuator(int(i)).name!r} has {what}")
    for what, bit in (
        ("springs", mujoco.mjtDisableBit.mjDSBL_SPRING),
        ("dampers", mujoco.mjtDisableBit.mjDSBL_DAMPER),
        ("actuation", mujoco.mjtDisableBit.mjDSBL_ACTUATION),
    ):
        if model.opt.disableflags & bit:
            _refuse(arm, f"the option's flag disables {what}")
    _require_free_space(arm)


def _disabled(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether the options switch an actuator's group off."""
    return bool(model.opt.disableactuator >> int(model.actuator_group[actuator]) & 1)


def _require_free_space(arm: ChainModel | RodModel) -> None:
    """Raise a ModelError for contacts, gravity in the plane of motion, and a medium around."""
    model, options = arm.model, arm.model.opt
    if not options.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT:
        touching = np.flatnonzero(model.geom_contype | model.geom_conaffinity)
        if model.npair:
            _refuse(arm, f"the contact pair {model.pair(0).name!r} can touch")
        if len(touching):
            _refuse(arm, f"geom {model.geom(int(touching[0])).name!r} can make contact")
    if not options.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY:
        if options.gravity[:2].any():
            _refuse(arm, f"gravity is {options.gravity} m/s2, not along z")
    if options.density or options.viscosity:
        _refuse(arm, "the option density or viscosity gives the air a drag")


def _refuse(arm: ChainModel | RodModel, what: str) -> None:
    kind = "chain" if isinstance(arm, ChainModel) else "rod"
    raise ModelError(
        f"{arm.source}: {what}, which neither the assumed modes nor a linear model carry; remove "
        f"it, or run the {kind} alone (flexsim drive or tune with --plant {kind})"
    )
