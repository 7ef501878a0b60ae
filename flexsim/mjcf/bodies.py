"""The bodies of a compiled chain: link, hub and beam; and what of a file has no modal counterpart.

>>> link, hub, beam = parts(load_chain("models/chain6.xml"))
>>> hub.about_axis                # [kg m2] about joint 2
>>> require_carried(chain)        # refuses by name what the assumed modes do not have
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from flexsim.arm.parameters import FIRST_ROOT, Parameters
from flexsim.errors import ModelError, ParameterError
from flexsim.mjcf.arm_xml import PAYLOAD
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.reading.geometry import straight
from flexsim.mjcf.reading.linear_checks import linear_reasons, refuse
from flexsim.numerics.dense import product
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
        return float(self.inertia.sum() + product(self.mass, self.x**2 + self.y**2))


def _bodies(model: mujoco.MjModel, ids: NDArray[np.intp], axis: float) -> Bodies:
    """Return the bodies with these indices, arm straight, about the axis at x = axis [m]."""
    data = straight(model)
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
    eta: float = 0.0,
    payload: tuple[float, float] = (0.0, 0.0),
) -> Parameters:
    """Return the robot of link, hub and beam, its joints and motors read from the model.

    Args:
        bodies: link, hub, beam with its payload. model: compiled; source: its name. L_R: of the
            rigid link, clamp: of the beam from joint 2, L: of the beam [m]. EI: its stiffness
            [N m2]; eta: its damping over stiffness [s]. payload: part of the beam's bodies that is
            one, mass and inertia about the tip [kg], [kg m2].

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
    rho = (float(beam.mass.sum()) - payload[0]) / L
    if not rho > 0:
        raise ModelError(
            f"{source}: the beam has no mass beside its payload's; give its bodies some"
        )
    try:
        return Parameters(
            L_R=L_R,
            I_R0=link.about_axis,
            I_H=hub.about_axis,
            m_H=float(hub.mass.sum()),
            r=clamp,
            L=L,
            rho=rho,
            EI=EI,
            F_1=float(model.dof_damping[0]) / gears[0] ** 2 if gears[0] else 0.0,
            F_2=float(model.dof_damping[1]) / gears[1] ** 2 if gears[1] else 0.0,
            I_m1=float(model.dof_armature[0]),
            I_m2=float(model.dof_armature[1]),
            r_1=gears[0],
            r_2=gears[1],
            zeta=eta * FIRST_ROOT**2 / L**2 * math.sqrt(max(EI, 0.0) / rho) / 2,  # EI is refused
            payload=payload[0],
            payload_inertia=payload[1],
        )
    except ParameterError as error:
        raise ModelError(f"{source}: {error}") from None


def payload_of(chain: ChainModel) -> tuple[float, float]:
    """Return mass [kg] and inertia about the tip [kg m2] of a file's body `payload`, or zeros.

    Raises:
        ModelError: that body is not fixed to the last segment, which has the tip.
    """
    model = chain.model
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, PAYLOAD)
    if body < 0:
        return 0.0, 0.0
    last = int(model.jnt_bodyid[-1])
    if body == last:
        raise ModelError(
            f"{chain.source}: body {PAYLOAD!r} has a hinge of its own; fix it to the last segment, "
            "or give it another name"
        )
    if int(model.body_weldid[body]) != last:
        raise ModelError(
            f"{chain.source}: body {PAYLOAD!r} is not fixed to {model.body(last).name!r}, which "
            "has the tip; move it there, or give it another name: it is no payload elsewhere"
        )
    data = straight(model)
    vertical = data.ximat[body].reshape(3, 3)[2]
    place = data.xipos[body, :2] - data.site("tip").xpos[:2]
    mass = float(model.body_mass[body])
    inertia = float(np.sum(vertical**2 * model.body_inertia[body]))
    return mass, inertia + mass * float(product(place, place))


def payload_ahead(chain: ChainModel) -> float:
    """Return how far ahead of the tip the centre of the body `payload` is [m], 0 without one."""
    body = mujoco.mj_name2id(chain.model, mujoco.mjtObj.mjOBJ_BODY, PAYLOAD)
    if body < 0 or chain.model.body_mass[body] == 0:
        return 0.0
    data = straight(chain.model)
    return float(data.xipos[body, 0] - data.site("tip").xpos[0])


def _carried(model: mujoco.MjModel, heads: Sequence[int]) -> NDArray[np.bool_]:
    """Return which bodies (nbody,) are one of the heads or carried by one."""
    member = np.zeros(model.nbody, dtype=bool)
    for i in range(model.nbody):  # parents come first
        member[i] = i in heads or (i > 0 and bool(member[model.body_parentid[i]]))
    return member


def _beside_axis(chain: ChainModel, bodies: Bodies) -> list[str]:
    """Return masses beside the beam's axis, which the equations do not have."""
    data = straight(chain.model)
    return [
        f"body {chain.model.body(i).name!r} has its centre of mass {data.xipos[i, 1]:g} m beside "
        "the axis"
        for i in bodies.ids
        if chain.model.body_mass[i] > 0 and abs(data.xipos[i, 1]) > OFF_AXIS
    ]


def require_carried(chain: ChainModel) -> None:
    """Raise a ModelError naming all in a file that the assumed modes do not have."""
    _, hub, beam = parts(chain)
    found = [*_beside_axis(chain, hub), *_beside_axis(chain, beam)]
    refuse(chain, found + linear_reasons(chain.model))
