"""The planar chain in closed form: MuJoCo's chain, to rounding, at a fifth of its cost.

>>> p = closed_form(load_chain("models/chain6.xml"))
>>> closed_chain_step(p, 0, state, tau_1, tau_2, work)

In absolute angles phi_i, the sums of the joints' angles, a chain of bodies that turn about z has

    H_ij = A_ij cos(phi_i - phi_j) + B_ij sin(phi_j - phi_i),
    sum_j H_ij phi_j'' + sum_j (A_ij sin(phi_i - phi_j) + B_ij cos(phi_j - phi_i)) phi_j'^2 = Q_i,

with constant A, symmetric, and B, antisymmetric, from masses beside the axis. A torque, spring or
damper at joint i acts on phi_i and back on phi_(i-1); armatures add a constant tridiagonal part.
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

INTEGRATORS = ("RK4", "Euler")  # that are written out here


class ClosedChain(NamedTuple):
    """A chain as the compiled equations read it; of m = N + 2 joints.

    A, B: (m, m) [kg m2]; armature (m,) [kg m2]; stiffness, rest (m,) [N m/rad], [rad]; damping (m,)
    [N m s/rad]; gears of the motors; L_R, root, lengths as in `mujoco_steps.Chain`; step [s]; rk4:
    whether RK4 takes it, else Euler with the dampers at the end of the step.
    """

    A: Array
    B: Array
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
    A, B = inertia_products(model)
    gears = model.actuator_gear[:2, 0] * model.actuator_gainprm[:2, 0]
    return ClosedChain(
        A=A,
        B=B,
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
    )


def inertia_products(model: mujoco.MjModel) -> tuple[Array, Array]:
    """Return A and B (m, m) [kg m2] of a planar chain, from its bodies at the straight pose.

    With d_bi the part of the way to body b's centre of mass that turns with joint i,
    A_ij = sum_b m_b d_bi . d_bj (and b's own inertia at i = j), B_ij = sum_b m_b d_bj x d_bi.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    m = model.njnt
    anchor = data.xanchor[:, :2]  # (m, 2)
    vertical = data.ximat.reshape(-1, 3, 3)[:, 2, :]  # z in each body's principal axes
    A, B = np.zeros((m, m)), np.zeros((m, m))
    for b, carrier in _carriers(model):
        d = np.zeros((m, 2))
        d[:carrier] = np.diff(anchor[: carrier + 1], axis=0)
        d[carrier] = data.xipos[b, :2] - anchor[carrier]
        for i in range(carrier + 1):
            for j in range(carrier + 1):
                A[i, j] += model.body_mass[b] * (d[i, 0] * d[j, 0] + d[i, 1] * d[j, 1])
                B[i, j] += model.body_mass[b] * (d[i, 1] * d[j, 0] - d[i, 0] * d[j, 1])
        A[carrier, carrier] += float(np.sum(vertical[b] ** 2 * model.body_inertia[b]))
    return A, B


def _carriers(model: mujoco.MjModel) -> list[tuple[int, int]]:
    """Return (body, joint that it turns with) of every body behind joint 1."""
    joint_of = {int(body): j for j, body in enumerate(model.jnt_bodyid)}
    found = ((b, joint_of.get(int(model.body_weldid[b]), -1)) for b in range(1, model.nbody))
    return [(b, j) for b, j in found if j >= 0]


@jit
def _cholesky_solve(H: Array, x: Array) -> None:
    """Solve H x = x in place; of H (m, m), positive definite, the lower half is overwritten."""
    m = x.shape[0]
    for j in range(m):
        pivot = H[j, j]
        for k in range(j):
            pivot -= H[j, k] * H[j, k]
        inverse = 1.0 / np.sqrt(pivot)
        H[j, j] = inverse
        for i in range(j + 1, m):
            value = H[i, j]
            for k in range(j):
                value -= H[i, k] * H[j, k]
            H[i, j] = value * inverse
    for i in range(m):
        value = x[i]
        for k in range(i):
            value -= H[i, k] * x[k]
        x[i] = value * H[i, i]
    for i in range(m - 1, -1, -1):
        value = x[i]
        for k in range(i + 1, m):
            value -= H[k, i] * x[k]
        x[i] = value * H[i, i]


@jit
def _fill(
    p: ClosedChain, phi: Array, u: Array, tau_1: float, tau_2: float, a: Array, work: Array
) -> None:
    """Write H's lower half into work (m, m) and the forces, dampers included, into a (m,)."""
    m = phi.shape[0]
    c, s = work[m], work[m + 1]
    for i in range(m):
        c[i] = np.cos(phi[i])
        s[i] = np.sin(phi[i])
        a[i] = 0.0
        for j in range(i):
            work[i, j] = 0.0
    before, rate = 0.0, 0.0
    for i in range(m):
        tau = -p.stiffness[i] * (phi[i] - before - p.rest[i]) - p.damping[i] * (u[i] - rate)
        before, rate = phi[i], u[i]
        if i == 0:
            tau += p.gear_1 * tau_1
        elif i == 1:
            tau += p.gear_2 * tau_2
        a[i] += tau
        work[i, i] = p.A[i, i] + p.armature[i]
        if i > 0:
            a[i - 1] -= tau
            work[i - 1, i - 1] += p.armature[i]
            work[i, i - 1] = -p.armature[i]
    for i in range(m):
        for j in range(i):
            cosine = c[i] * c[j] + s[i] * s[j]  # of phi_i - phi_j
            sine = s[i] * c[j] - c[i] * s[j]
            work[i, j] += p.A[i, j] * cosine - p.B[i, j] * sine
            turned = p.A[i, j] * sine + p.B[i, j] * cosine
            a[i] -= turned * u[j] * u[j]
            a[j] += turned * u[i] * u[i]


@jit
def _rk4(p: ClosedChain, x: Array, tau_1: float, tau_2: float, work: Array) -> None:
    """Advance absolute angles and rates x (2, m) by one step of classical Runge-Kutta."""
    m, h = x.shape[1], p.step
    phi, u, a, dphi, du = work[m + 2], work[m + 3], work[m + 4], work[m + 5], work[m + 6]
    for i in range(m):
        phi[i], u[i] = x[0, i], x[1, i]
        dphi[i] = du[i] = 0.0
    for stage in range(4):
        _fill(p, phi, u, tau_1, tau_2, a, work)
        _cholesky_solve(work, a)
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
    m, h = x.shape[1], p.step
    a = work[m + 2]
    _fill(p, x[0], x[1], tau_1, tau_2, a, work)
    for i in range(m):  # (H + h D) u' = H u + h (forces without dampers) has increment h a
        work[i, i] += h * p.damping[i]
        if i > 0:
            work[i - 1, i - 1] += h * p.damping[i]
            work[i, i - 1] -= h * p.damping[i]
    _cholesky_solve(work, a)
    for i in range(m):
        x[1, i] += h * a[i]
        x[0, i] += h * x[1, i]


@jit
def closed_chain_step(
    p: ClosedChain, slot: int, state: Array, tau_1: float, tau_2: float, work: Array
) -> None:
    """Advance the state by one step, torques held.

    Args:
        state: (2 m,) joint angles, then rates, as MuJoCo's; overwritten.
        work: (m + 9, m) work space.
    """
    m = state.shape[0] // 2
    x = work[m + 7 : m + 9]
    total, rate = 0.0, 0.0
    for i in range(m):
        total += state[i]
        rate += state[m + i]
        x[0, i], x[1, i] = total, rate
    if p.rk4 == 1:
        _rk4(p, x, tau_1, tau_2, work)
    else:
        _euler(p, x, tau_1, tau_2, work)
    total, rate = 0.0, 0.0
    for i in range(m):
        state[i], state[m + i] = x[0, i] - total, x[1, i] - rate
        total, rate = x[0, i], x[1, i]
