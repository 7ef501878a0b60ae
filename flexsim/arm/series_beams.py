"""Two beams in series, solved exactly: the frequencies of an arm whose link 1 bends as well.

    >>> series_frequencies(named_arm("two-flexible"), 4) / 6.283185307179586   # [Hz]

Euler-Bernoulli's general solution in each link, ten linear conditions at joints and tip; no shapes
are assumed, no chain is cut. Both joints are free; one with `Arm.locked` is not. Models of the arm
are held against it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flexsim.arm.arms import Arm
from flexsim.errors import ParameterError
from flexsim.numerics.types import Array

STEP = 5e-3  # of log omega in the search for sign changes
LOWEST, HIGHEST = 0.05, 1e3  # of the frequency unit sqrt(EI/rho)/L^2 of the softer beam
JUMP = 1e-6  # of the determinant beside a change of sign: more is left there than of a root


def series_frequencies(arm: Arm, n: int, theta2: float = 0.0) -> Array:
    """Return the first n flexible frequencies with the links straight [rad/s].

    Args:
        arm: with a link 1 that bends. n: how many, 1 or more. theta2: pose of joint 2 [rad].

    Raises:
        ParameterError: n is below 1, so many are not found, or link 1 is rigid.
    """
    if not isinstance(n, int | np.integer) or n < 1:
        raise ParameterError(f"number of frequencies is {n!r}; give a whole number, 1 or more")
    beams = (arm.beam1, arm.parameters)
    unit = min(math.sqrt(b.EI / b.rho) / b.L**2 for b in beams)
    grid = unit * np.exp(np.arange(math.log(LOWEST), math.log(HIGHEST), STEP))

    def determinant(omega: float) -> float:
        sign, size = np.linalg.slogdet(_conditions(arm, theta2, omega))
        return float(sign * math.exp(size))

    found: list[float] = []
    low, before = grid[0], determinant(grid[0])
    for high in grid[1:]:
        value = determinant(high)
        if value * before < 0:
            root = float(brentq(determinant, low, high, xtol=1e-12 * unit, rtol=1e-14))
            if abs(determinant(root)) <= JUMP * max(abs(value), abs(before)):
                found.append(root)
            if len(found) == n:
                return np.array(found)
        low, before = high, value
    raise ParameterError(f"{len(found)} of {n} frequencies were found; ask for fewer")


def _solution(b: float, s: float, derivative: int) -> Array:
    """Return the four solutions of one beam, or a derivative, at s = x/L [-], none above 1.

    cos bs, sin bs, e^-bs, e^-b(1-s), b = beta L; derivatives with respect to s, over b^k.
    """
    c, d = math.cos(b * s), math.sin(b * s)
    turned = ((c, d), (-d, c), (-c, -d), (d, -c))[derivative]
    return np.array([*turned, (-1.0) ** derivative * math.exp(-b * s), math.exp(-b * (1 - s))])


def _conditions(arm: Arm, theta2: float, omega: float) -> NDArray[np.float64]:
    """Return the matrix (10, 10) of the conditions, singular at a natural frequency.

    Unknowns: four constants of each link's deflection w, from the link's straight line at rest,
    then the angles of hub 1 and hub 2. Forces on a body are EI w''' at a beam's end, -EI w''' at
    its start, moments -EI w'' and EI w''; the links do not stretch.
    """
    p, one = arm.parameters, arm.beam1
    square, s, c = omega**2, math.sin(theta2), math.cos(theta2)
    beta = [(b.rho * square / b.EI) ** 0.25 for b in (one, p)]

    def link(which: int, x: float, derivative: int) -> Array:
        beam = (one, p)[which]
        row = np.zeros(10)
        of_beam = _solution(beta[which] * beam.L, x, derivative) * beta[which] ** derivative
        row[4 * which : 4 * which + 4] = of_beam
        return row

    hub1, hub2 = np.eye(10)[8], np.eye(10)[9]
    y, turned = link(0, 1.0, 0), link(0, 1.0, 1)  # of joint 2, across link 1; of link 1's end
    force_1, moment_1 = one.EI * link(0, 1.0, 3), one.EI * link(0, 1.0, 2)
    force_2, moment_2 = -p.EI * link(1, 0.0, 3), p.EI * link(1, 0.0, 2)
    motor = -square * p.I_m2 * (hub2 - turned)
    carried = p.m_H + (p.m_b + p.payload) * s * s  # what moves along link 2 moves as one
    rows = [
        link(0, 0.0, 0) - one.r * hub1,
        link(0, 0.0, 1) - hub1,
        square * (arm.hub_inertia + p.I_m1) * hub1
        + one.EI * (link(0, 0.0, 2) - one.r * link(0, 0.0, 3)),
        square * carried * y + force_1 + c * force_2,
        moment_1 - motor,
        square * p.I_H * hub2 - moment_1 + moment_2 + p.r * force_2,  # and the motor's
        link(1, 0.0, 0) - c * y - p.r * hub2,
        link(1, 0.0, 1) - hub2,
        p.EI * link(1, 1.0, 3) + square * p.payload * link(1, 1.0, 0),
        p.EI * link(1, 1.0, 2) - square * p.payload_inertia * link(1, 1.0, 1),
    ]
    matrix = np.array(rows)
    return matrix / np.linalg.norm(matrix, axis=1, keepdims=True)
