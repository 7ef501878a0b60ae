"""The closed loop, compiled: reference, measurement, filters, friction and plant, for populations.

One function, `run_some`, serves every plant and every controller: a controller is what
`flexsim.loop.control.compiled` runs, a plant two compiled functions (`flexsim.plants.dispatch`).
Individuals run on separate threads; each is computed alike whatever the number of threads, and each
may have a plant, friction, hardware and reference of its own (`flexsim.loop.populations`).

Loop (Figure 2 of the paper is lost; this is our reading): the joint errors are
theta1_ref - theta1 and theta2_ref - (theta2 - atan(v/(r+L))), v entering with its sign changed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flexsim.loop.control.compiled import Controllers, control_sample
from flexsim.loop.friction import FrictionNumbers
from flexsim.loop.hardware import (
    BridgeNumbers,
    EffectNumbers,
    HardwareNumbers,
    NoBridges,
    NoEffects,
    commands,
    encoder_angles,
    joint_memory,
    joint_step,
    mean_torque,
    measured,
    note,
    seen_v,
    tell,
    waiting_room,
)
from flexsim.loop.measuring import (
    PARTS,
    SUMS,
    WAITING,
    WAITING_MOST,
    Yardstick,
    add_sample,
    settle,
)
from flexsim.loop.stacked import nth
from flexsim.numerics.jit import jit, jit_apart
from flexsim.numerics.types import Array
from flexsim.plants.dispatch import elbow, physics_step, tip_in_hub, work_space

HALF_TURN = math.pi  # a joint this far from its reference has left the workspace
APART = SUMS + 10  # numbers of a run's own sums: 256 bytes, lines of the cache for themselves
TORQUE_MOST = 1e9  # [N m] at a joint: a runaway; MuJoCo drops torques above 1e10 unasked
RATE_LIMIT = 1e3  # [rad/s] joint velocity beyond which the motion is a runaway


class Loop(NamedTuple):
    """What a run needs besides plant and controllers.

    Attributes:
        period: control period [s]; substeps: physics steps per period.
        tip, joint: (K+1, 2) reference at t_k = k period [m], [rad].
        torque: (K+1, 2) fed forward, added to the controllers' torques [N m]; (0, 2) for none.
        L_R, reach: link lengths of the kinematics [m].
        v_gain: factor of atan(v/(r+L)) where it is added to the measured theta2, -1 in the paper.
        v_limit: deflection beyond which the beam has left its model's range [m].
        weights: (3,) of x, y and v in the index (5).
    """

    period: float
    substeps: int
    tip: Array
    joint: Array
    torque: Array
    L_R: float
    reach: float
    v_gain: float
    v_limit: float
    weights: Array


class Outcome(NamedTuple):
    """Results of a population of P runs.

    Attributes:
        indices: (P,) performance index (5), inf where diverged [m2 s].
        diverged: (P,) time of divergence [s], nan where none.
        states: (P, R, 2 m), torques, errors: (P, R, 2) at every stride-th sample, R = 0 unless
            recorded; nan after divergence.
        sums: (P, SUMS) of `flexsim.loop.measuring`; (P, 0) unless measured.
        applied: (P, R, 2) what the motors give, on average over the period, ahead of friction.
        measured: (P, R, 3) theta1, theta2 and v as the controllers get them.
        sensed: (P, R, 4) what bridges and tachometers read, nan where there are none.
    """

    indices: Array
    diverged: Array
    states: Array
    torques: Array
    errors: Array
    sums: Array
    applied: Array
    measured: Array
    sensed: Array


@jit
def has_left(loop: Loop, state: Array, k: int, v: float) -> bool:
    """Return whether the motion is non-finite, or out of the workspace, at sample k."""
    m = state.shape[0] // 2
    total = 0.0
    for i in range(2 * m):
        total += state[i]
    inside = (  # written so that a nan is not inside
        abs(v) <= loop.v_limit
        and abs(state[0] - loop.joint[k, 0]) <= HALF_TURN
        and abs(state[1] - loop.joint[k, 1]) <= HALF_TURN
        and abs(state[m]) <= RATE_LIMIT
        and abs(state[m + 1]) <= RATE_LIMIT
    )
    return not (inside and np.isfinite(total))


@jit
def tip_of(plant, loop: Loop, state: Array, along: float, v: float):  # type: ignore[no-untyped-def]
    """Return the tip's position (x, y) [m]."""
    x1, y1, turned = elbow(plant, loop.L_R, state)
    th1, th12 = state[0], state[0] + turned + state[1]
    s1, c1 = np.sin(th1), np.cos(th1)
    s, c = np.sin(th12), np.cos(th12)
    return (
        x1 * c1 - y1 * s1 + along * c - v * s,
        x1 * s1 + y1 * c1 + along * s + v * c,
    )


@jit
def squared_error(loop: Loop, k: int, dx: float, dy: float, v: float) -> float:
    """Return the integrand of the performance index (5) at sample k [m2], dx, dy off the path."""
    t = k * loop.period
    w = loop.weights
    return w[0] * dx * dx + w[1] * dy * dy + w[2] * t * t * (v * v) * (v * v)  # (5)


@jit
def add_parts(
    loop: Loop, sums: Array, k: int, share: float, dx: float, dy: float, v: float
) -> None:
    """Add the parts of the index (5) at sample k, which counts for a share of the period [s]."""
    t = k * loop.period
    w = loop.weights
    sums[PARTS] += share * w[0] * dx * dx
    sums[PARTS + 1] += share * w[1] * dy * dy
    sums[PARTS + 2] += share * w[2] * t * t * (v * v) * (v * v)


@jit
def run_one(  # type: ignore[no-untyped-def]
    plant,
    slot,
    friction: FrictionNumbers,
    h: HardwareNumbers,
    effects: EffectNumbers | NoEffects,
    bridges: BridgeNumbers | NoBridges,
    loop: Loop,
    controllers: Controllers,
    i,
    number,
    state,
    stride,
    yard: Yardstick,
    states,
    torques,
    errors,
    sums,
    waiting,
    applied,
    seen,
    sensed,
):
    """Return (index (5), time of divergence or nan) of one run from `state`, overwritten.

    Args:
        controllers, i: of all runs, and which of them is this run's.
        number: of the run, which decides its noise. h, effects, bridges: hardware.
        stride: record every stride-th sample into states, torques, errors, applied, seen (what
            was measured) and sensed (bridges and tachometers); 0 records nothing.
        yard: what is measured into sums, points still waiting; nothing if it has no points.
    """
    late = waiting_room(h)  # commands on their way
    joints = joint_memory(state)
    memory = np.zeros(bridges.room)
    work = work_space(state.shape[0] // 2)
    z = np.zeros(controllers.b.shape[1:])
    inner = np.zeros((2, controllers.A.shape[1]))
    samples = loop.tip.shape[0]
    index = 0.0
    for k in range(samples):
        along, v = tip_in_hub(plant, state)
        if has_left(loop, state, k, v):
            return np.inf, k * loop.period
        edge = 0.5 if k == 0 or k == samples - 1 else 1.0  # trapezoidal rule
        x, y = tip_of(plant, loop, state, along, v)
        dx, dy = x - loop.tip[k, 0], y - loop.tip[k, 1]
        index += edge * loop.period * squared_error(loop, k, dx, dy, v)
        th1, th2 = encoder_angles(effects, joints, state[0], state[1])
        th1, th2, v_seen = measured(h, number, k, th1, th2, v)
        v_seen = seen_v(bridges, memory, number, k, th1, th2, state, v_seen)
        e1 = loop.joint[k, 0] - th1
        e2 = loop.joint[k, 1] - (th2 + loop.v_gain * np.arctan(v_seen / loop.reach))
        u1, u2 = control_sample(controllers, i, z, inner, e1, e2, v_seen)
        if loop.torque.shape[0] > 0:
            u1, u2 = u1 + loop.torque[k, 0], u2 + loop.torque[k, 1]
        c1, c2 = commands(h, late, k, u1, u2, friction.limit_1, friction.limit_2)
        tell(bridges, memory, c1, c2)
        if stride > 0 and k % stride == 0:
            row = k // stride
            note(bridges, memory, sensed, row)
            applied[row, 0] = mean_torque(h, c1, joints[0])
            applied[row, 1] = mean_torque(h, c2, joints[1])
            seen[row, 0], seen[row, 1], seen[row, 2] = th1, th2, v_seen
            states[row, :] = state
            torques[row, 0], torques[row, 1] = u1, u2
            errors[row, 0], errors[row, 1] = e1, e2
        if yard.points.shape[0] > 0:
            add_sample(yard, sums, waiting, k, x, y, dx * dx + dy * dy, v, u1, u2)
            add_parts(loop, sums, k, edge * loop.period, dx, dy, v)
            if sums[WAITING] == WAITING_MOST:  # here: within, numba would count references
                settle(yard, sums, waiting)
        if k == samples - 1:
            break
        if not (np.isfinite(u1) and np.isfinite(u2)):
            return np.inf, k * loop.period
        for _ in range(loop.substeps):
            t = k * loop.period
            tau_1, tau_2 = joint_step(friction, h, effects, joints, t, c1, c2, state)
            if not abs(tau_1) + abs(tau_2) <= TORQUE_MOST:
                return np.inf, k * loop.period
            physics_step(plant, slot, state, tau_1, tau_2, work)
    return index, np.nan


@jit_apart
def run_some(  # type: ignore[no-untyped-def]
    first,
    last,
    slot,
    plants,
    plant_first,
    frictions,
    friction_first,
    hardwares,
    hardware_first,
    effects,
    effects_first,
    bridges,
    bridge_first,
    loops,
    loop_first,
    yards,
    yard_first,
    starts,
    which,
    numbers,
    controllers,
    stride,
    index,
    diverged,
    states,
    torques,
    errors,
    sums,
    applied,
    seen,
    sensed,
):
    """Fill rows first to last, the latter not among them, of the outcome arrays.

    Args:
        slot: which of a plant's places for threads these runs have to themselves.
        plants, plant_first, ...: stacked, see `flexsim.loop.stacked`; starts: (S, 2 m).
        which: (P, 7) each run's plant, friction, hardware, loop, yardstick, start and bridges.
        numbers: (P,) of the runs, for their noise.
    """
    for i in range(first, last):
        plant = nth(plants, plant_first, which[i, 0])
        friction = nth(frictions, friction_first, which[i, 1])
        hardware = nth(hardwares, hardware_first, which[i, 2])
        effect = nth(effects, effects_first, which[i, 2])
        bridge = nth(bridges, bridge_first, which[i, 6])
        loop = nth(loops, loop_first, which[i, 3])
        yard = nth(yards, yard_first, which[i, 4])
        waiting = np.empty((WAITING_MOST, 4))
        own = np.zeros(APART)  # written at every sample: rows of `sums` would share cache lines
        index[i], diverged[i] = run_one(
            plant,
            slot,
            friction,
            hardware,
            effect,
            bridge,
            loop,
            controllers,
            i,
            numbers[i],
            starts[which[i, 5]].copy(),
            stride,
            yard,
            states[i],
            torques[i],
            errors[i],
            own,
            waiting,
            applied[i],
            seen[i],
            sensed[i],
        )
        if yard.points.shape[0] > 0:
            settle(yard, own, waiting)
            sums[i] = own[:SUMS]
