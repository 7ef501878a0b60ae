"""The linear arm solved exactly: Euler-Bernoulli beam on a hub on a link, no assumed shapes.

    >>> joint_free_frequencies(Parameters(), 3) / 6.283185307179586   # [Hz], straight arm
    array([ 7.77934818, 24.30140498, 60.67535799])

Both plants are held against these frequencies.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from flexsim.arm.beam import Load, beta_lengths, load_of
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.types import Array

JUMP = 1e-6  # of a function beside a change of sign: more is left there than of a root
SCAN = 400  # points per pi of beta L in the search for sign changes


def clamped_frequencies(parameters: Parameters, n: int) -> Array:
    """Return the first n frequencies of the clamped beam with its payload [rad/s], from (15)."""
    beta = np.array(beta_lengths(n, load_of(parameters))) / parameters.L
    return beta**2 * np.sqrt(parameters.EI / parameters.rho)


def _base_reactions(b: float, load: Load) -> tuple[float, float, float, float]:
    """Return the beam's reactions on its moving base, and their poles, all times e^-b.

    D_11, D_12 = D_21 and D_22, which map the base's (y, y' L) to the dimensionless force (-L^3
    times the third derivative) and moment (L^2 times the second) of the beam on it, at
    b = beta L, each multiplied by the last number, which is zero at the clamped frequencies.
    """
    e = math.exp(-b)
    cosh, sinh = (1 + e * e) / 2, (1 - e * e) / 2  # times e^-b
    cos, sin = math.cos(b), math.sin(b)
    p, j = load.mass * b, load.inertia * b**3
    Cc, Cs, Sc, Ss = cosh * cos, cosh * sin, sinh * cos, sinh * sin
    both = 1 - j * p
    first = b**3 * ((Cs + Sc) * both + 2 * p * Cc - 2 * j * Ss)
    mixed = b**2 * (Ss * both + p * (Cs + Sc) + j * (Sc - Cs))
    second = b * ((Cs - Sc) * both + 2 * p * Ss + 2 * j * Cc)
    clamped = (e + Cc) + p * (Sc - Cs) - j * (Cs + Sc) + j * p * (e - Cc)
    return first, mixed, second, clamped


def _determinant(parameters: Parameters, theta2: float, b: float) -> float:
    """Return the frequency determinant at b = beta L, zero at a natural frequency only."""
    p = parameters
    s, c = math.sin(theta2), math.cos(theta2)
    D_11, D_12, D_22, clamped = _base_reactions(b, load_of(p))
    scale = clamped * b**4 / p.m_b
    # inertia of theta1 and of the hub's absolute angle, the axial mass of beam and payload on
    # link 1; and the reactions, of the base's y = L_R c theta1 + r theta and y' L = L theta
    link = p.I_m1 + p.I_m2 + p.I_R0 + p.L_R**2 * (p.m_H + (p.m_b + p.payload) * s * s)
    K_11 = scale * link + (p.L_R * c) ** 2 * D_11
    K_12 = -scale * p.I_m2 + p.L_R * c * (p.r * D_11 + p.L * D_12)
    K_22 = scale * (p.I_m2 + p.I_H) + p.r**2 * D_11 + 2 * p.r * p.L * D_12 + p.L**2 * D_22
    return (K_11 * K_22 - K_12 * K_12) / clamped / b**6


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function that changes its sign between two places is zero.

    Raises:
        ParameterError: it jumps there instead, or no place was found.
    """
    root, found = brentq(function, low, high, xtol=1e-14, full_output=True, disp=False)
    sizes = max(abs(function(low)), abs(function(high)))
    if not found.converged or abs(function(root)) > JUMP * sizes:
        raise ParameterError(f"no frequency is found between beta L = {low:.6g} and {high:.6g}")
    return float(root)


def joint_free_frequencies(parameters: Parameters, n: int, theta2: float = 0.0) -> Array:
    """Return the first n flexible frequencies with both joints free [rad/s].

    Args:
        parameters: the robot. n: how many, 1 or more.
        theta2: pose of joint 2 with the beam straight [rad].

    Raises:
        ParameterError: n is below 1, or so many are not found.
    """
    if not isinstance(n, int | np.integer) or n < 1:
        raise ParameterError(f"number of frequencies is {n!r}; give a whole number, 1 or more")
    grid = np.linspace(0.05, (n + 2) * np.pi, (n + 2) * SCAN)

    def determinant(b: float) -> float:
        return _determinant(parameters, theta2, b)

    values = np.array([determinant(b) for b in grid])
    change = np.flatnonzero(np.sign(values[1:]) * np.sign(values[:-1]) < 0)[:n]
    if len(change) < n:
        raise ParameterError(
            f"{len(change)} of {n} frequencies with free joints were found; ask for fewer"
        )
    roots = np.array([_root(determinant, grid[i], grid[i + 1]) for i in change])
    return (roots / parameters.L) ** 2 * np.sqrt(parameters.EI / parameters.rho)
