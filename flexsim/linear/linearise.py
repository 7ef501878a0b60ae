"""The plants near rest: matrices of motion about a pose with the beam straight, joints free.

    >>> from flexsim.linear.linearise import linearise, zero_order_hold
    >>> linear = linearise(plant, theta2=1.2)
    >>> Ad, Bd = zero_order_hold(linear, 1e-3)

About rest the equations of either plant are M q'' + D q' + K q = S tau, and what is measured is
theta1, theta2 and v. Nothing depends on theta1, since the arm moves in a horizontal plane.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from flexsim.errors import ParameterError
from flexsim.loop.hardware import JointEffects, cascade
from flexsim.numerics.clocks import whole_substeps
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.exudyn_beam.system import HALVES
from flexsim.plants.linear_plant import LinearPlant


def linearise(
    plant: Plant, theta2: float = math.pi / 2, joint_damping: ArrayLike = (0.0, 0.0)
) -> LinearPlant:
    """Return the linearisation of any plant about rest.

    Args:
        plant: assumed modes of either form, a chain, a rod, or EXUDYN's beam.
        theta2: of the pose [rad].
        joint_damping: (2,) viscous friction that is taken from the torques at the motors, beside
            the plant's own at the joints [N m s/rad].

    Raises:
        ParameterError: theta2 or the damping is not a finite number, or the plant is another.
        ModelError: a file has dry friction, a limit or the like, named.
    """
    extra = np.asarray(joint_damping, dtype=float)
    if not math.isfinite(theta2):
        raise ParameterError(f"theta2 is {theta2}; give a finite angle [rad]")
    if extra.shape != (2,) or not np.isfinite(extra).all():
        raise ParameterError(f"joint damping is {extra}; give two finite numbers")
    linear = plant.linearised(float(theta2))
    D = linear.D.copy()
    D[[0, 1], [0, 1]] += extra * np.diag(linear.S[:2])  # friction acts on the motors' torques
    return replace(linear, D=D)


def with_shafts(linear: LinearPlant, effects: JointEffects) -> LinearPlant:
    """Return a plant behind its motors' shafts, gaps closed: one more coordinate for each motor.

    As it is if no joint has a shaft.

    Args:
        effects: whose shaft, shaft_damping and motor_inertia count.
    """
    for j in range(2):
        k, damping = effects.shaft[j], effects.shaft_damping[j]
        if k == 0:
            continue
        m, gear = len(linear.M), float(linear.S[j, j])
        M, D, K = (np.pad(each, ((0, 1), (0, 1))) for each in (linear.M, linear.D, linear.K))
        S = np.pad(linear.S, ((0, 1), (0, 0)))
        M[m, m] = gear * effects.motor_inertia[j]
        for X, each in ((K, gear * k), (D, gear * damping)):
            X[[j, m], [j, m]] += each
            X[[j, m], [m, j]] -= each
        S[m, j], S[j, j] = gear, 0.0
        linear = replace(linear, M=M, D=D, K=K, S=S, tip=np.append(linear.tip, 0.0))
    return linear


def _lags(lag: float, amplifier: float) -> list[float]:
    """Return the lags that are there, the motor's first [s]."""
    return [each for each in (lag, amplifier) if each > 0]


def zero_order_hold(
    linear: LinearPlant, period: float, lag: float = 0.0, amplifier: float = 0.0
) -> tuple[Array, Array]:
    """Return (Ad, Bd), the exact motion over one period with the torques' commands held.

    Args:
        linear: with n = 2m states. period: [s].
        lag: time constant of the motors [s], which are then two more states: their torques [N m].
        amplifier: of their currents [s], two more.

    Returns:
        (n, n) and (n, 2), n + 2 with a lag, n + 4 with two.

    Raises:
        ParameterError: the period is not a finite number over 0.
    """
    if not 0 < period < math.inf:
        raise ParameterError(f"control period is {period} s; give more than 0")
    X, n = _augmented(linear), len(linear.A)
    for each in _lags(lag, amplifier):  # tau' = (u - tau) / lag
        X = np.pad(X, ((0, 2), (0, 2)))
        X[n : n + 2, n:] = np.hstack([-np.eye(2), np.eye(2)]) / each
        n += 2
    return _split(expm(X * period), n)


def split_hold(
    linear: LinearPlant, period: float, before: float, lag: float = 0.0, amplifier: float = 0.0
) -> tuple[Array, Array, Array]:
    """Return (Ad, B_old, B_new) where a period begins with the commands of one sample ago.

    The modified z-transform: the old command is held for `before`, the new one for the rest.

    Args:
        period: [s]. before: above 0, below the period [s].
        lag, amplifier: as in `zero_order_hold`.

    Returns:
        (n, n), (n, 2), (n, 2); n + 2 with a lag, n + 4 with two.
    """
    A1, B1 = zero_order_hold(linear, before, lag, amplifier)
    A2, B2 = zero_order_hold(linear, period - before, lag, amplifier)
    return A2 @ A1, A2 @ B1, B2


def stepped_hold(
    linear: LinearPlant,
    period: float,
    step: float,
    integrator: str = "RK4",
    held_friction: ArrayLike = (0.0, 0.0),
    lag: float = 0.0,
    amplifier: float = 0.0,
) -> tuple[Array, Array]:
    """Return (Ad, Bd) as the simulation steps the plant over one period, `period/step` times.

    RK4 is the exponential's series to fourth order; Euler, implicit and implicitfast are
    semi-implicit, with the dampers' forces at the end of the step; discrete has the springs' there,
    too; trapezoidal takes means of both ends, twice in a step. Their damping of the fastest modes
    is included.

    Args:
        integrator: of the plant.
        held_friction: (2,) viscous friction that takes from the torques at the motors what the
            joints' rates at the start of a step give [N m s/rad], as `flexsim.loop.friction` does.
        lag: time constant of the motors [s], which are then two more states; a step gets the mean
            of their torques over it, as `flexsim.loop.hardware` does.
        amplifier: of their currents [s], two more.

    Raises:
        ParameterError: the period is no whole multiple of the step.
    """
    substeps = whole_substeps(period, step)
    m, n = len(linear.M), len(linear.A)
    if integrator == "RK4":
        X = _augmented(linear) * step
        one = np.eye(len(X))
        X = one + X @ (one + X / 2 @ (one + X / 3 @ (one + X / 4)))
    elif integrator == "trapezoidal":
        X = np.linalg.matrix_power(_trapezoidal(linear, step / len(HALVES)), len(HALVES))
    else:
        h, M, D, K = step, linear.M, linear.D, linear.K
        ahead = M + h * D
        if integrator == "discrete":
            ahead = ahead + h**2 * K
        rate = np.linalg.solve(ahead, np.hstack([-h * K, M, h * linear.S]))  # (m, n+2)
        X = np.vstack([np.eye(m, n + 2) + h * rate, rate, np.eye(2, n + 2, n)])
    X[:n, m : m + 2] -= X[:n, n:] * np.asarray(held_friction, dtype=float)
    lags = _lags(lag, amplifier)
    if lags:
        c, into, more = cascade(lag, amplifier, step), X[:n, n:].copy(), 2 * len(lags)
        X = np.pad(X, ((0, more), (0, more)))
        rows = [[c.motor, c.amplifier], [0.0, c.own]] if len(lags) > 1 else [[c.motor]]
        means = [c.mean, c.mean_amplifier][: len(lags)]
        kept = [[*row, 1 - sum(row)] for row in rows] + [[0.0] * len(lags) + [1.0]]
        X[:n, n:] = np.kron([[*means, 1 - sum(means)]], into)
        X[n:, n:] = np.kron(kept, np.eye(2))
        n += more
    return _split(np.linalg.matrix_power(X, substeps), n)


def _trapezoidal(linear: LinearPlant, h: float) -> Array:
    """Return the matrix (n+2, n+2) of one step h [s] of the trapezoidal rule, torques held."""
    M, D, K, n = linear.M, linear.D, linear.K, len(linear.A)
    m = len(M)
    mean = h / 2 * D + h**2 / 4 * K
    rate = np.linalg.solve(M + mean, np.hstack([-h * K, M - mean, h * linear.S]))  # (m, n+2)
    place = np.eye(m, n + 2) + h / 2 * (np.eye(m, n + 2, m) + rate)
    return np.vstack([place, rate, np.eye(2, n + 2, n)])


def _augmented(linear: LinearPlant) -> Array:
    """Return [[A, B], [0, 0]] (n+2, n+2), whose exponential holds Ad and Bd."""
    n = len(linear.A)
    X = np.zeros((n + 2, n + 2))
    X[:n, :n], X[:n, n:] = linear.A, linear.B
    return X


def _split(step: Array, n: int) -> tuple[Array, Array]:
    return step[:n, :n].copy(), step[:n, n:].copy()
