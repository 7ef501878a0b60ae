"""The closed loop of one arm by whole control periods, its memory carried from call to call.

    >>> done, seen = run_periods(plant, friction, hardware, loop, controllers, memory, push,
    ...                          first=0, count=16, again=HOLD, rows=rows)

The same compiled functions in the same order as `flexsim.loop.compiled_loop.run_one`, so a motion
in pieces is the batch's to the bit; a test holds that. What is more: a force on the arm, and a
reference that goes on after its end.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from flexsim.loop.compiled_loop import TORQUE_MOST, Loop, has_left, tip_of
from flexsim.loop.control.compiled import Controllers, control_sample
from flexsim.loop.friction import FrictionNumbers
from flexsim.loop.hardware import (
    SENSED,
    BridgeNumbers,
    EffectNumbers,
    HardwareNumbers,
    commands,
    encoder_angles,
    joint_step,
    mean_torque,
    measured,
    note,
    seen_v,
    tell,
)
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array
from flexsim.plants.assumed_modes import AssumedModes, acceleration, rk4_step
from flexsim.plants.dispatch import physics_step, tip_in_hub

HOLD, AGAIN, BACK = range(3)  # what a reference does after its end
NOWHERE, LINK, BEAM = range(3)  # on which part a force acts; the hub is the beam's beginning
RUN = 0  # which of a population's runs this is, for its noise


class Push(NamedTuple):
    """A force on the assumed-modes arm, held, at one of its material points.

    Attributes:
        part: NOWHERE, LINK or BEAM. fx, fy: force [N]; torque: about z [N m], in the world.
        along, across: the point of the straight arm, from the joint that moves its part [m].
        shape, slope: (n,) the modes' displacement [-] and rotation [1/m] there.
        shortening: (n, n) integral of chi_i' chi_j' up to there [1/m].
    """

    part: int
    fx: float
    fy: float
    torque: float
    along: float
    across: float
    shape: Array
    slope: Array
    shortening: Array


class Memory(NamedTuple):
    """What one arm's loop hands from a period to the next, all overwritten.

    Attributes:
        state: (2 m,). z, inner: of the controller, see `control_sample`. late: (delay, 2) commands
            that wait. joints: of `flexsim.loop.hardware.joint_memory`. work: of the plant's step.
        bridges: (room,) of what is read, see `read_bridges`.
    """

    state: Array
    z: Array
    inner: Array
    late: Array
    joints: Array
    work: Array
    bridges: Array


class Rows(NamedTuple):
    """What is seen at the start of each period: columns as in `flexsim.loop.motion.Motion`."""

    state: Array
    torque: Array
    error: Array
    applied: Array
    measured: Array
    tip: Array
    sensed: Array


def rows_for(count: int, size: int) -> Rows:
    """Return room for a number of periods, of states of a size, nan where nothing is written."""
    widths = (size, 2, 2, 2, 3, 2, SENSED)
    return Rows(*(np.full((count, width), np.nan) for width in widths))


@jit
def row_of(k: int, samples: int, again: int) -> int:
    """Return which of a reference's samples holds at period k.

    Args:
        again: HOLD stays at the end, AGAIN starts anew, BACK goes back the way it came.
    """
    last = samples - 1
    if k <= last or again == HOLD:
        return min(k, last)
    if again == AGAIN:
        return k % last
    row = k % (2 * last)
    return row if row <= last else 2 * last - row


@jit
def pushing(push: Push, L_R: float, q: Array, Q: Array):  # type: ignore[no-untyped-def]
    """Return the generalised forces of a push on theta1 and theta2; those on the modes go into Q.

    J^T F at the point, the beam's rotation and shortening to the order of the equations.

    Args:
        L_R: length of the rigid link [m]. q: (n+2,). Q: (n,) result [N m, N].
    """
    n = Q.shape[0]
    s, c = np.sin(q[0]), np.cos(q[0])
    if push.part == LINK:
        x, y = c * push.along - s * push.across, s * push.along + c * push.across
        Q[:] = 0.0
        return x * push.fy - y * push.fx + push.torque, 0.0
    v = turn = short = 0.0
    for j in range(n):
        v += push.shape[j] * q[2 + j]
        turn += push.slope[j] * q[2 + j]
        for i in range(n):
            short += 0.5 * push.shortening[j, i] * q[2 + j] * q[2 + i]
    s12, c12 = np.sin(q[0] + q[1]), np.cos(q[0] + q[1])
    f_along = c12 * push.fx + s12 * push.fy
    f_across = c12 * push.fy - s12 * push.fx
    along, across = push.along - short - push.across * turn, push.across + v
    for j in range(n):
        shortened = push.across * push.slope[j]
        for i in range(n):
            shortened += push.shortening[j, i] * q[2 + i]
        Q[j] = f_across * push.shape[j] - f_along * shortened + push.torque * push.slope[j]
    second = along * f_across - across * f_along + push.torque
    return second + L_R * (c * push.fy - s * push.fx), second


@jit
def pushed_acceleration(pushed, q, w, tau_1, tau_2, a, H1) -> None:  # type: ignore[no-untyped-def]
    """Write the generalised accelerations under torques and a push into a; see `acceleration`.

    Args:
        pushed: the coefficients and the `Push`.

    Source: H a = ... + J^T F with H of (36)-(41), its modal block eliminated.
    """
    p, push = pushed
    acceleration(p, q, w, tau_1, tau_2, a, H1)
    n = p.P.shape[0]
    Q = np.empty(n)
    Q1, Q2 = pushing(push, p.L_R, q, Q)
    P_e = m_ee = e_M_e = e_N_e = s11 = s12 = s22 = r1 = r2 = 0.0
    for j in range(n):
        e = q[2 + j]
        P_e += p.P[j] * e
        m_ee += p.mass[j] * e * e
        for i in range(n):
            e_M_e += e * p.M[j, i] * q[2 + i]
            e_N_e += e * p.N[j, i] * q[2 + i]
        inverse = p.inverse_mass[j]
        s11 += H1[j] * H1[j] * inverse
        s12 += H1[j] * p.X[j] * inverse
        s22 += p.X[j] * p.X[j] * inverse
        r1 += H1[j] * Q[j] * inverse
        r2 += p.X[j] * Q[j] * inverse
    J2 = p.J + m_ee - e_N_e
    h = p.L_R * (np.cos(q[1]) * (p.first_moment - 0.5 * e_M_e) - np.sin(q[1]) * P_e)
    k11, k12, k22 = p.A + J2 + 2.0 * h - s11, J2 + h - s12, p.I_m2 + J2 - s22  # (36)-(38)
    scale = 1.0 / (k11 * k22 - k12 * k12)
    b1, b2 = Q1 - r1, Q2 - r2
    a1, a2 = (k22 * b1 - k12 * b2) * scale, (k11 * b2 - k12 * b1) * scale
    a[0] += a1
    a[1] += a2
    for j in range(n):
        a[2 + j] += (Q[j] - H1[j] * a1 - p.X[j] * a2) * p.inverse_mass[j]


@jit
def plain_step(plant, state, tau_1, tau_2, work, push: Push) -> None:  # type: ignore[no-untyped-def]
    """Advance a plant by one physics step; a push on MuJoCo's plants is in its data already."""
    physics_step(plant, 0, state, tau_1, tau_2, work)


@jit
def pushed_step(  # type: ignore[no-untyped-def]
    plant: AssumedModes, state, tau_1, tau_2, work, push: Push
) -> None:
    """Advance the assumed modes by one Runge-Kutta step, under a push if there is one."""
    if push.part == NOWHERE:
        physics_step(plant, 0, state, tau_1, tau_2, work)
    else:
        rk4_step(pushed_acceleration, (plant, push), plant.step, state, tau_1, tau_2, work)


def step_under(
    plant: Any, state: Array, tau_1: float, tau_2: float, work: Array, push: Push
) -> None:
    """Advance a plant's state by one physics step, torques held, under a push."""
    step = pushed_step if isinstance(plant, AssumedModes) else plain_step
    step(plant, state, tau_1, tau_2, work, push)


@overload(step_under, jit_options={"forceinline": True})
def _step_under(plant, state, tau_1, tau_2, work, push):  # type: ignore[no-untyped-def]
    step = pushed_step if plant.instance_class is AssumedModes else plain_step
    return lambda plant, state, tau_1, tau_2, work, push: step(
        plant, state, tau_1, tau_2, work, push
    )


@jit
def run_periods(  # type: ignore[no-untyped-def]
    plant: Any,
    friction: FrictionNumbers,
    h: HardwareNumbers,
    effects: EffectNumbers,
    bridges: BridgeNumbers,
    loop: Loop,
    controllers: Controllers,
    memory: Memory,
    push: Push,
    first: int,
    count: int,
    again: int,
    rows: Rows,
):
    """Return how many periods were done, and how many rows written: fewer than asked diverged.

    Args:
        first: number of the first period; count: how many. again: see `row_of`. rows: filled.
    """
    state, joints = memory.state, memory.joints
    for i in range(count):
        k = first + i
        r = row_of(k, loop.tip.shape[0], again)
        along, v = tip_in_hub(plant, state)
        if has_left(loop, state, r, v):
            return i, i
        rows.tip[i, 0], rows.tip[i, 1] = tip_of(plant, loop, state, along, v)
        th1, th2 = encoder_angles(effects, joints, state[0], state[1])
        th1, th2, v_seen = measured(h, RUN, k, th1, th2, v)
        v_seen = seen_v(bridges, memory.bridges, RUN, k, th1, th2, state, v_seen)
        e1 = loop.joint[r, 0] - th1
        e2 = loop.joint[r, 1] - (th2 + loop.v_gain * np.arctan(v_seen / loop.reach))
        u1, u2 = control_sample(controllers, 0, memory.z, memory.inner, e1, e2, v_seen)
        c1, c2 = commands(h, memory.late, k, u1, u2, friction.limit_1, friction.limit_2)
        tell(bridges, memory.bridges, c1, c2)
        note(bridges, memory.bridges, rows.sensed, i)
        rows.applied[i, 0] = mean_torque(h, c1, joints[0])
        rows.applied[i, 1] = mean_torque(h, c2, joints[1])
        rows.measured[i, 0], rows.measured[i, 1], rows.measured[i, 2] = th1, th2, v_seen
        rows.state[i, :] = state
        rows.torque[i, 0], rows.torque[i, 1] = u1, u2
        rows.error[i, 0], rows.error[i, 1] = e1, e2
        if not (np.isfinite(u1) and np.isfinite(u2)):
            return i, i + 1
        for _ in range(loop.substeps):
            t = k * loop.period
            tau_1, tau_2 = joint_step(friction, h, effects, joints, t, c1, c2, state)
            if not abs(tau_1) + abs(tau_2) <= TORQUE_MOST:
                return i, i + 1
            step_under(plant, state, tau_1, tau_2, memory.work, push)
    return count, count


@jit
def rehearse(controllers: Controllers, z: Array, inner: Array, error: Array, v: Array) -> None:
    """Let a controller, its memory at zero, see errors (K, 2) and v (K,) that were."""
    for k in range(len(v)):
        control_sample(controllers, 0, z, inner, error[k, 0], error[k, 1], v[k])
