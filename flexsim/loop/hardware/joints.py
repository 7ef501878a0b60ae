"""From commands to the torques at the joints over one physics step: all loops use `joint_step`.

Amplifier and motor lag, ripple and cogging, the friction setting's limit, dead zone and (47); then
the shaft, if there is one; then what opposes the joint's motion. Friction's numbers vary with time
and angle. What is off costs nothing: ideal joints, `NoEffects`, have a way of their own.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import overload

from flexsim.loop.friction import (
    LUGRE,
    OPPOSING,
    FrictionNumbers,
    driving,
    joint_torques,
    stribeck_torque,
)
from flexsim.loop.hardware.bristles import bristle_torque
from flexsim.loop.hardware.effects import (
    COGGING,
    COGGING_PERIODS,
    COLD,
    POSE,
    POSE_PERIODS,
    POSE_PHASE,
    RIPPLE,
    RIPPLE_PERIODS,
    SHAFT,
    WARMED,
    WARMING,
    EffectNumbers,
    NoEffects,
)
from flexsim.loop.hardware.memory import AMPLIFIER, ANGLE, MOTOR
from flexsim.loop.hardware.numbers import HardwareNumbers, motor_step
from flexsim.loop.hardware.shaft import shaft_torque
from flexsim.numerics.jit import jit, jit_apart
from flexsim.numerics.types import Array


@jit
def waved(row: Array, tau: float, angle: float) -> float:
    """Return a motor's torque with ripple and cogging at its angle [rad], [N m]."""
    tau *= 1.0 + row[RIPPLE] * np.sin(row[RIPPLE_PERIODS] * angle)
    return tau + row[COGGING] * np.sin(row[COGGING_PERIODS] * angle)


@jit
def friction_factor(row: Array, t: float, theta: float) -> float:
    """Return what friction's numbers are times at a time [s] and a joint's angle [rad]."""
    left = np.exp(-t / row[WARMING])
    warmth = 1.0 + row[COLD] * left + row[WARMED] * (1.0 - left)
    return warmth * (1.0 + row[POSE] * np.cos(row[POSE_PERIODS] * theta - row[POSE_PHASE]))


@jit_apart
def worn_torque(  # type: ignore[no-untyped-def]
    law,
    limit,
    low,
    high,
    tau_0,
    mu,
    speed,
    stiction,
    stribeck,
    sigma_0,
    sigma_1,
    row,
    memory,
    step,
    t,
    tau,
    theta,
    w,
) -> float:
    """Return the torque that reaches one joint with all effects [N m].

    Args:
        law ... sigma_1: of `FrictionNumbers`, of this joint. row: of `EffectNumbers.per_joint`.
        memory: of the joint, overwritten. step, t: physics step, and now [s].
        tau: of the motor [N m]. theta, w: of the joint [rad], [rad/s].
    """
    elastic = row[SHAFT] > 0.0
    tau = waved(row, tau, memory[ANGLE] if elastic else theta)
    tau = min(max(tau, -limit), limit)
    factor = friction_factor(row, t, theta)
    tau_0, mu = factor * tau_0, factor * mu
    tau = driving(law, tau, factor * low, factor * high, tau_0, mu)
    if elastic:
        tau = shaft_torque(row, memory, step, tau, theta, w)
    if law < OPPOSING:
        return tau
    if law == LUGRE:
        held = bristle_torque(memory, step, theta, w, tau_0, stiction, stribeck, sigma_0, sigma_1)
        return tau - held - mu * w
    if law > OPPOSING:
        tau_0 = stribeck_torque(w, tau_0, stiction, stribeck)
    return tau - tau_0 * np.tanh(w / speed) - mu * w


@jit_apart
def worn_torques(  # type: ignore[no-untyped-def]
    f: FrictionNumbers, e: EffectNumbers, memory: Array, t, tau_1, tau_2, theta1, theta2, w1, w2
):
    """Return the torques at both joints with all effects [N m]; arguments as of `worn_torque`."""
    first = worn_torque(
        f.law,
        f.limit_1,
        f.low_1,
        f.high_1,
        f.tau_0_1,
        f.mu_1,
        f.speed,
        f.stiction_1,
        f.stribeck,
        f.sigma_0_1,
        f.sigma_1_1,
        e.per_joint[0],
        memory[0],
        e.step,
        t,
        tau_1,
        theta1,
        w1,
    )
    second = worn_torque(
        f.law,
        f.limit_2,
        f.low_2,
        f.high_2,
        f.tau_0_2,
        f.mu_2,
        f.speed,
        f.stiction_2,
        f.stribeck,
        f.sigma_0_2,
        f.sigma_1_2,
        e.per_joint[1],
        memory[1],
        e.step,
        t,
        tau_2,
        theta2,
        w2,
    )
    return first, second


@jit
def lagged(h: HardwareNumbers, memory: Array, u1: float, u2: float):  # type: ignore[no-untyped-def]
    """Return the motors' mean torques over a physics step [N m]; memory: overwritten."""
    if h.lagging:
        u1, memory[0, MOTOR], memory[0, AMPLIFIER] = motor_step(
            h, u1, memory[0, MOTOR], memory[0, AMPLIFIER]
        )
        u2, memory[1, MOTOR], memory[1, AMPLIFIER] = motor_step(
            h, u2, memory[1, MOTOR], memory[1, AMPLIFIER]
        )
    return u1, u2


@jit
def plain_step(f, h, e, memory, t, u1, u2, state):  # type: ignore[no-untyped-def]
    """Return `joint_step` of ideal joints."""
    m = state.shape[0] // 2
    tau_1, tau_2 = lagged(h, memory, u1, u2)
    return joint_torques(f, tau_1, tau_2, state[m], state[m + 1])


@jit
def worn_step(f, h, e, memory, t, u1, u2, state):  # type: ignore[no-untyped-def]
    """Return `joint_step` of joints that may be worn."""
    m = state.shape[0] // 2
    tau_1, tau_2 = lagged(h, memory, u1, u2)
    if e.there or f.law == LUGRE:
        return worn_torques(
            f, e, memory, t, tau_1, tau_2, state[0], state[1], state[m], state[m + 1]
        )
    return joint_torques(f, tau_1, tau_2, state[m], state[m + 1])


@jit
def motor_angles(e: EffectNumbers, memory: Array, theta1: float, theta2: float):  # type: ignore[no-untyped-def]
    """Return `encoder_angles` of joints that may be worn."""
    if e.at_motor:
        if e.per_joint[0, SHAFT] > 0.0:
            theta1 = memory[0, ANGLE]
        if e.per_joint[1, SHAFT] > 0.0:
            theta2 = memory[1, ANGLE]
    return theta1, theta2


def joint_step(
    f: FrictionNumbers,
    h: HardwareNumbers,
    e: EffectNumbers | NoEffects,
    memory: Array,
    t: float,
    u1: float,
    u2: float,
    state: Array,
) -> tuple[float, float]:
    """Return the torques that reach the joints over a physics step [N m].

    Args:
        f, h, e: friction and hardware. memory: of `joint_memory`, overwritten.
        t: time of the control period [s]. u1, u2: commands, held [N m]. state: (2 m,) of the plant.
    """
    step: Any = plain_step if isinstance(e, NoEffects) else worn_step
    tau_1, tau_2 = step(f, h, e, memory, t, u1, u2, state)
    return tau_1, tau_2


def encoder_angles(
    e: EffectNumbers | NoEffects, memory: Array, theta1: float, theta2: float
) -> tuple[float, float]:
    """Return the angles that the encoders turn by [rad]: of motors behind shafts, or of joints."""
    if isinstance(e, NoEffects):
        return theta1, theta2
    angles: tuple[float, float] = motor_angles(e, memory, theta1, theta2)
    return angles


@overload(joint_step, jit_options={"forceinline": True})
def _joint_step(f, h, e, memory, t, u1, u2, state) -> Any:  # type: ignore[no-untyped-def]
    step = plain_step if e.instance_class is NoEffects else worn_step
    return lambda f, h, e, memory, t, u1, u2, state: step(f, h, e, memory, t, u1, u2, state)


@overload(encoder_angles, jit_options={"forceinline": True})
def _encoder_angles(e, memory, theta1, theta2) -> Any:  # type: ignore[no-untyped-def]
    if e.instance_class is NoEffects:
        return lambda e, memory, theta1, theta2: (theta1, theta2)
    return lambda e, memory, theta1, theta2: motor_angles(e, memory, theta1, theta2)
