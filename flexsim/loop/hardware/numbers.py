"""What hardware does to measurements and torques in the loop, as compiled functions of numbers."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from flexsim.loop.hardware.memory import AMPLIFIER, MOTOR
from flexsim.numerics.jit import jit
from flexsim.numerics.noise import MASK, normal
from flexsim.numerics.types import Array


def lag_factors(lag: float, time: float) -> tuple[float, float]:
    """Return what is left of a motor's distance from its command after a time, and on average.

    x(t) - u = (x(0) - u) e^(-t/lag) under a command u held; (0, 0) without a lag.

    Args:
        lag, time: [s].
    """
    if lag == 0.0:
        return 0.0, 0.0
    return math.exp(-time / lag), -math.expm1(-time / lag) * lag / time


class Cascade(NamedTuple):
    """What is left after a time of an amplifier's and a motor's distance from a command held.

    Attributes:
        motor, amplifier: of the motor's distance x - u, by its own and by the amplifier's y - u.
        own: of the amplifier's, by its own.
        mean, mean_amplifier: the first two on average over the time.
    """

    motor: float
    amplifier: float
    own: float
    mean: float
    mean_amplifier: float


def cascade(lag: float, amplifier: float, time: float) -> Cascade:
    """Return two first-order lags in a row over a time, exactly.

    lag x' = y - x, amplifier y' = u - y; one of no length is not there.

    Args:
        lag: of the motor, amplifier: of its current, time: [s].
    """
    if lag == 0.0 or amplifier == 0.0:
        decay, mean = lag_factors(max(lag, amplifier), time)
        return Cascade(decay, 0.0, decay, mean, 0.0)
    X = np.zeros((4, 4))
    X[:2, :2] = [[-1 / lag, 1 / lag], [0.0, -1 / amplifier]]
    X[:2, 2:] = np.eye(2)
    moved = expm(X * time)
    (a, b), (c, d) = moved[0, :2], moved[0, 2:] / time
    return Cascade(float(a), float(b), float(moved[1, 1]), float(c), float(d))


class HardwareNumbers(NamedTuple):
    """A `Hardware` as plain numbers, for compiled code.

    Attributes:
        quantum_1, quantum_2: angles of a count at the joints [rad], 0 for exact.
        lagging: whether there is a lag; cascaded: whether there are two.
        decay, mean: `lag_factors` over a physics step; mean_period: the second over a period.
        late_decay, late_own, late_mean, late_mean_period: the amplifier's part in a `Cascade`.
    """

    ideal: bool
    delay: int
    limit_1: float
    limit_2: float
    quantum_1: float
    quantum_2: float
    noise_v: float
    lagging: bool
    decay: float
    mean: float
    mean_period: float
    seed: int
    cascaded: bool
    late_decay: float
    late_own: float
    late_mean: float
    late_mean_period: float


@jit
def measured(h: HardwareNumbers, run: int, sample: int, theta1: float, theta2: float, v: float):  # type: ignore[no-untyped-def]
    """Return theta1, theta2 [rad] and v [m] as the controllers get them.

    Args:
        run: whose noise it is. sample: at which the measurement is taken.
    """
    if h.ideal:
        return theta1, theta2, v
    if h.quantum_1 > 0.0:
        theta1 = h.quantum_1 * np.floor(theta1 / h.quantum_1 + 0.5)
        theta2 = h.quantum_2 * np.floor(theta2 / h.quantum_2 + 0.5)
    if h.noise_v > 0.0:
        v += h.noise_v * normal(h.seed, run & MASK, sample)
    return theta1, theta2, v


@jit
def waiting_room(h: HardwareNumbers) -> Array:
    """Return room (delay, 2) for the commands that wait, at first zero."""
    return np.zeros((h.delay, 2))


@jit
def commands(h: HardwareNumbers, waiting: Array, sample: int, u1: float, u2: float, f1, f2):  # type: ignore[no-untyped-def]
    """Return the commands that reach the motors: those of `delay` samples ago, limited [N m].

    Args:
        waiting: of `waiting_room`, overwritten. u1, u2: of the controllers, now.
        f1, f2: limits of the friction setting; the lesser of these and the hardware's holds.
    """
    if h.delay > 0:
        row = sample % h.delay
        now1, now2 = u1, u2
        u1, u2 = waiting[row, 0], waiting[row, 1]
        waiting[row, 0], waiting[row, 1] = now1, now2
    limit_1, limit_2 = min(h.limit_1, f1), min(h.limit_2, f2)
    return min(max(u1, -limit_1), limit_1), min(max(u2, -limit_2), limit_2)


@jit
def motor_step(h: HardwareNumbers, u: float, x: float, y: float):  # type: ignore[no-untyped-def]
    """Return a lagging motor's mean torque over a physics step, and x and y at its end [N m].

    Args:
        u: command, held. x: the motor's torque at the start. y: its amplifier's, where both lag.
    """
    mean, after = u + h.mean * (x - u), u + h.decay * (x - u)
    if h.cascaded:
        mean, after = mean + h.late_mean * (y - u), after + h.late_decay * (y - u)
        y = u + h.late_own * (y - u)
    return mean, after, y


@jit
def mean_torque(h: HardwareNumbers, u: float, memory: Array) -> float:
    """Return a motor's mean torque over a control period [N m].

    Args:
        u: command, held. memory: of the joint, at the period's start.
    """
    if not h.lagging:
        return u
    mean = u + h.mean_period * (memory[MOTOR] - u)
    if h.cascaded:
        mean += h.late_mean_period * (memory[AMPLIFIER] - u)
    return mean
