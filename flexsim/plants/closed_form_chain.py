"""The planar chain in closed form: MuJoCo's chain, to rounding, at a seventh of its cost.

>>> p = closed_form(load_chain("models/chain6.xml"))
>>> closed_chain_step(p, 0, state, tau_1, tau_2, work)

In absolute angles phi_i, the sums of the joints' angles, a chain of bodies that turn about z has

    J_i phi_i'' + sum_{j<i} h_i . d_j phi_j'' + sum_{j>i} d_i . h_j phi_j''
        = Q_i + sum_{j<i} h_i x d_j phi_j'^2 + sum_{j>i} d_i x h_j phi_j'^2,

where d_i leads from joint i to the next, h_i is the first moment about joint i and J_i the second
of body i and of all masses that hang on it, these taken at the next joint: d_i and h_i turn with
phi_i, J_i is constant. A torque, spring or damper at joint i acts on phi_i and back on phi_(i-1),
and so do armatures on the accelerations. Off the diagonal a row is one vector times one of each
column, so the unknowns are eliminated from the tip inwards in a number of operations that grows
with m, not its cube, as in Featherstone's articulated bodies.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from flexsim.errors import ModelError
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.reading.linear_checks import require_linear
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array
from flexsim.plants.mujoco_steps import place

INTEGRATORS = ("RK4", "Euler")  # that are written out here
ROWS = 12  # of work space


class ClosedChain(NamedTuple):
    """A chain as the compiled equations read it; of m = N + 2 joints.

    J (m,) [kg m2]; d_x, d_y (m,) [m] and h_x, h_y (m,) [kg m] in the straight pose, y across it;
    armature (m,) [kg m2]; stiffness, rest (m,) [N m/rad], [rad]; damping (m,) [N m s/rad]; gears;
    L_R, root, lengths, second, link1 as in `mujoco_steps.Chain`; step [s]; rk4: whether RK4 takes
    it, else Euler with the dampers at the end of the step.
    """

    J: Array
    d_x: Array
    d_y: Array
    h_x: Array
    h_y: Array
    armature: Array
    stiffness: Array
    rest: Array
    damping: Array
    gear_1: float
    gear_2: float
    L_R: float
    root: float
    lengths: Array
    step: float
    rk4: int
    second: int
    link1: Array


def closed_form(chain: ChainModel) -> ClosedChain:
    """Return a chain's coefficients, read from the file as MuJoCo compiled it.

    Raises:
        ModelError: the file has what these equations do not: dry friction, limits, contacts,
            another integrator; named.
    """
    require_linear(chain, joint_springs=True)
    model = chain.model
    name = chain.integrator
    if name not in INTEGRATORS:
        raise ModelError(
            f"{chain.source}: integrator {name} is not written in closed form; use RK4 or Euler, "
            "or the plant chain, which is MuJoCo itself"
        )
    J, d, h = moments(model)
    gears = model.actuator_gear[:2, 0] * model.actuator_gainprm[:2, 0]
    return ClosedChain(
        J=J,
        d_x=d[:, 0].copy(),
        d_y=d[:, 1].copy(),
        h_x=h[:, 0].copy(),
        h_y=h[:, 1].copy(),
        armature=model.dof_armature.copy(),
        stiffness=model.jnt_stiffness.copy(),
        rest=model.qpos_spring.copy(),
        damping=model.dof_damping.copy(),
        gear_1=float(gears[0]),
        gear_2=float(gears[1]),
        L_R=chain.L_R,
        root=chain.root,
        lengths=chain.lengths.copy(),
        step=chain.step,
        rk4=int(name == "RK4"),
        second=chain.second,
        link1=chain.link1.copy(),
    )


def moments(model: mujoco.MjModel) -> tuple[Array, Array, Array]:
    """Return J (m,) [kg m2], d (m, 2) [m], h (m, 2) [kg m] of a planar chain, straight along x."""
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    m = model.njnt
    anchor = data.xanchor[:, :2]  # (m, 2)
    vertical = data.ximat.reshape(-1, 3, 3)[:, 2, :]  # z in each body's principal axes
    J, d, h, beyond = np.zeros(m), np.zeros((m, 2)), np.zeros((m, 2)), np.zeros(m)
    d[:-1] = np.diff(anchor, axis=0)
    for b, carrier in _carriers(model):
        mass, centre = model.body_mass[b], data.xipos[b, :2] - anchor[carrier]
        beyond[:carrier] += mass
        h[carrier] += mass * centre
        J[carrier] += mass * np.sum(centre**2) + np.sum(vertical[b] ** 2 * model.body_inertia[b])
    return J + beyond * np.sum(d**2, axis=1), d, h + beyond[:, None] * d


def _carriers(model: mujoco.MjModel) -> list[tuple[int, int]]:
    """Return (body, joint that it turns with) of every body behind joint 1."""
    joint_of = {int(body): j for j, body in enumerate(model.jnt_bodyid)}
    found = ((b, joint_of.get(int(model.body_weldid[b]), -1)) for b in range(1, model.nbody))
    return [(b, j) for b, j in found if j >= 0]


@jit
def _accelerations(
    p: ClosedChain, phi: Array, u: Array, tau_1: float, tau_2: float, late: float, work: Array
) -> None:
    """Write the angular accelerations at absolute angles phi (m,) and rates u (m,) into work[0].

    Args:
        late: by how much later the dampers act: the step of an implicit Euler, else 0 [s].
        work: ROWS rows of (m,), of which the first six are overwritten.
    """
    m = phi.shape[0]
    a, d_x, d_y, g_x, g_y, inverse = work[0], work[1], work[2], work[3], work[4], work[5]
    before = rate = sum_x = sum_y = 0.0
    for i in range(m):
        c, s = np.cos(phi[i]), np.sin(phi[i])
        d_x[i], d_y[i] = p.d_x[i] * c - p.d_y[i] * s, p.d_x[i] * s + p.d_y[i] * c
        g_x[i], g_y[i] = p.h_x[i] * c - p.h_y[i] * s, p.h_x[i] * s + p.h_y[i] * c
        tau = -p.stiffness[i] * (phi[i] - before - p.rest[i]) - p.damping[i] * (u[i] - rate)
        if i == 0:
            tau += p.gear_1 * tau_1
        else:
            if i == p.second:
                tau += p.gear_2 * tau_2
            a[i - 1] -= tau
        a[i] = tau + g_x[i] * sum_y - g_y[i] * sum_x
        before, rate = phi[i], u[i]
        sum_x += u[i] * u[i] * d_x[i]
        sum_y += u[i] * u[i] * d_y[i]

    # eliminated from the tip inwards: row i is then g_i . d_j in columns j < i, less what the
    # armature of i ties to i - 1; all but the last one eliminated left W and z of their rows.
    # An armature as heavy as that of a locked joint must not swallow the pivots beside it: with
    # r = g_i . d_(i-1) and P the pivot of i without its armature A, i - 1 has in place of A
    # A - (r - A)^2/(P + A) = (A (P + 2 r) - r^2)/(P + A)
    sum_x = sum_y = W_xx = W_xy = W_yy = z_x = z_y = 0.0
    last_x = last_y = tie = quotient = solved = bare = 0.0  # of the last: g, A, 1/H, force/H, P
    for i in range(m - 1, -1, -1):
        dx, dy, uu = d_x[i], d_y[i], u[i] * u[i]
        force = a[i] + dx * sum_y - dy * sum_x
        sum_x += uu * g_x[i]
        sum_y += uu * g_y[i]
        own = p.armature[i] + late * p.damping[i]
        r = last_x * dx + last_y * dy
        row = r - tie
        share = row * quotient
        w_x, w_y = W_xx * dx + W_xy * dy, W_xy * dx + W_yy * dy
        carried = tie * (bare + 2.0 * r) * quotient
        bare = p.J[i] + carried - (dx * w_x + dy * w_y) - r * (r * quotient)
        force -= dx * z_x + dy * z_y + row * solved
        W_xx += last_x * last_x * quotient
        W_xy += last_x * last_y * quotient
        W_yy += last_y * last_y * quotient
        z_x += last_x * solved
        z_y += last_y * solved
        last_x, last_y = g_x[i] - w_x - last_x * share, g_y[i] - w_y - last_y * share
        tie, quotient = own, 1.0 / (bare + own)
        solved = force * quotient
        g_x[i], g_y[i], inverse[i], a[i] = last_x, last_y, quotient, solved

    sum_x = sum_y = before = 0.0  # of the accelerations, from joint 1 outwards
    for i in range(m):
        own = p.armature[i] + late * p.damping[i]
        a[i] -= (g_x[i] * sum_x + g_y[i] * sum_y - own * before) * inverse[i]
        before = a[i]
        sum_x += d_x[i] * before
        sum_y += d_y[i] * before


@jit
def _rk4(p: ClosedChain, x: Array, tau_1: float, tau_2: float, work: Array) -> None:
    """Advance absolute angles and rates x (2, m) by one step of classical Runge-Kutta."""
    m, h = x.shape[1], p.step
    a, phi, u, dphi, du = work[0], work[6], work[7], work[8], work[9]
    for i in range(m):
        phi[i], u[i] = x[0, i], x[1, i]
        dphi[i] = du[i] = 0.0
    for stage in range(4):
        _accelerations(p, phi, u, tau_1, tau_2, 0.0, work)
        weight = h / 6.0 if stage == 0 or stage == 3 else h / 3.0
        ahead = h if stage == 2 else 0.5 * h
        for i in range(m):
            dphi[i] += weight * u[i]
            du[i] += weight * a[i]
            phi[i] = x[0, i] + ahead * u[i]
            u[i] = x[1, i] + ahead * a[i]
    for i in range(m):
        x[0, i] += dphi[i]
        x[1, i] += du[i]


@jit
def _euler(p: ClosedChain, x: Array, tau_1: float, tau_2: float, work: Array) -> None:
    """Advance x (2, m) by one step of MuJoCo's Euler: dampers at the step's end, then angles."""
    m, h, a = x.shape[1], p.step, work[0]
    # (H + h D) u' = H u + h (forces without the dampers) has the increment h a
    _accelerations(p, x[0], x[1], tau_1, tau_2, h, work)
    for i in range(m):
        x[1, i] += h * a[i]
        x[0, i] += h * x[1, i]


@jit
def closed_chain_step(
    p: ClosedChain, slot: int, state: Array, tau_1: float, tau_2: float, work: Array
) -> None:
    """Advance the state by one step, torques held.

    Args:
        state: (2 m,) angles, then rates: joint 1, joint 2, then the hinges; overwritten.
        work: (ROWS, m) work space.
    """
    m = state.shape[0] // 2
    x = work[10:12]
    total, rate = 0.0, 0.0
    for i in range(m):
        total += state[place(i, p.second)]
        rate += state[m + place(i, p.second)]
        x[0, i], x[1, i] = total, rate
    if p.rk4 == 1:
        _rk4(p, x, tau_1, tau_2, work)
    else:
        _euler(p, x, tau_1, tau_2, work)
    total, rate = 0.0, 0.0
    for i in range(m):
        its = place(i, p.second)
        state[its], state[m + its] = x[0, i] - total, x[1, i] - rate
        total, rate = x[0, i], x[1, i]
