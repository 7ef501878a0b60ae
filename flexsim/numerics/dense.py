"""Small dense linear algebra in compiled scalar code: the same bits whatever BLAS a machine picks.

    >>> solve(A, B)
    >>> product(A, B)

BLAS and LAPACK add up in an order that depends on the processor; these loops add up in the order
written, one rounding per operation. For matrices of a few dozen rows they are as fast.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from flexsim.errors import ModelError
from flexsim.numerics.jit import jit_apart
from flexsim.numerics.types import Array


def product(left: ArrayLike, right: ArrayLike) -> Array:
    """Return left @ right, the last axis of one with the first of the other, summed in order.

    Args:
        left: (..., n). right: (n,) or (n, k). Either may be complex.

    Returns:
        (...,) or (..., k).
    """
    a, b = np.asarray(left), np.asarray(right)
    kind = np.result_type(a, b, float)
    flat = _product(  # of one layout only, so that it is compiled once
        np.ascontiguousarray(a.reshape(math.prod(a.shape[:-1]), len(b)), dtype=kind),
        np.ascontiguousarray(b.reshape(len(b), math.prod(b.shape[1:])), dtype=kind),
    )
    return flat.reshape(a.shape[:-1] + b.shape[1:])[()]


@jit_apart
def _product(a: Array, b: Array) -> Array:
    """Return a (m, n) times b (n, k)."""
    out = np.zeros((a.shape[0], b.shape[1]), dtype=a.dtype)
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            for c in range(b.shape[1]):
                out[i, c] += a[i, j] * b[j, c]
    return out


def solve(matrix: ArrayLike, right: ArrayLike) -> Array:
    """Return the solution (n,) or (n, k) of matrix (n, n) x = right, by pivoted elimination.

    Raises:
        ModelError: the matrix is singular, or not finite.
    """
    b = np.asarray(right, dtype=float)
    a = np.array(matrix, dtype=float, order="C")
    x = np.array(b.reshape(len(a), -1), order="C")
    if not eliminate(a, x):
        raise ModelError(f"a matrix of {len(a)} rows is singular; check masses and stiffnesses")
    return x.reshape(b.shape)


@jit_apart
def dot(a: Array, b: Array) -> float:
    """Return the inner product of a (n,) and b (n,), for compiled code."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@jit_apart
def bilinear(a: Array, matrix: Array, b: Array) -> float:
    """Return a (m,) times matrix (m, n) times b (n,), for compiled code."""
    total = 0.0
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            total += a[i] * matrix[i, j] * b[j]
    return total


@jit_apart
def eliminate(a: Array, x: Array) -> bool:
    """Solve a (n, n) x = x (n, k) in place of both; return whether there was a solution."""
    n = a.shape[0]
    for p in range(n):
        best = p
        for i in range(p + 1, n):
            if abs(a[i, p]) > abs(a[best, p]):
                best = i
        if not 0.0 < abs(a[best, p]) < np.inf:
            return False
        if best != p:
            for j in range(n):
                a[p, j], a[best, j] = a[best, j], a[p, j]
            for j in range(x.shape[1]):
                x[p, j], x[best, j] = x[best, j], x[p, j]
        for i in range(p + 1, n):
            factor = a[i, p] / a[p, p]
            for j in range(p + 1, n):
                a[i, j] -= factor * a[p, j]
            for j in range(x.shape[1]):
                x[i, j] -= factor * x[p, j]
    for p in range(n - 1, -1, -1):
        for j in range(x.shape[1]):
            for i in range(p + 1, n):
                x[p, j] -= a[p, i] * x[i, j]
            x[p, j] /= a[p, p]
    return True
