"""Gauss-Legendre quadrature, its nodes found by Newton's iteration in compiled scalar code.

>>> node, weight = gauss_legendre(24)       # on (-1, 1), exact for polynomials up to degree 47
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array

STEPS = 20  # of Newton; four or five are usual
SETTLED = 1e-15  # last change of a node: it converges quadratically, so nothing is left to change
ROUNDING = 1e-13  # of the weights' sum, which is 2


@lru_cache
def gauss_legendre(points: int) -> tuple[Array, Array]:
    """Return nodes and weights (points,) on (-1, 1), rising; not to be written into.

    Raises:
        ParameterError: points is below 1, or a node was not found.
    """
    if points < 1:
        raise ParameterError(f"quadrature has {points} points; give 1 or more")
    node, weight = np.empty(points), np.empty(points)
    found = _nodes(node, weight)
    rising = bool((np.diff(node) > 0).all())
    if not found or not rising or abs(weight.sum() - 2) > ROUNDING * points:
        raise ParameterError(f"quadrature of {points} points was not found; take fewer")
    node.flags.writeable = weight.flags.writeable = False
    return node, weight


@jit
def _nodes(node: Array, weight: Array) -> bool:
    """Fill nodes and weights; return whether every node has settled.

    Source: Newton on P_n from cos(pi (i - 1/4)/(n + 1/2)), with P_n' from the recursion.
    """
    n = node.shape[0]
    settled = True
    for i in range((n + 1) // 2):
        x = math.cos(math.pi * (i + 0.75) / (n + 0.5))
        if 2 * i + 1 == n:
            x = 0.0
        change = 1.0
        slope = 1.0
        for _ in range(STEPS):
            last, value = 1.0, x
            for k in range(2, n + 1):
                last, value = value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * last) / k
            slope = n * (last - x * value) / (1.0 - x * x)
            if abs(change) <= SETTLED:
                break
            change = value / slope
            x -= change
        settled = settled and abs(change) <= SETTLED
        node[n - 1 - i], node[i] = x, -x
        weight[i] = weight[n - 1 - i] = 2.0 / ((1.0 - x * x) * slope * slope)
    return settled
