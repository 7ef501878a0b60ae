"""Natural frequencies and modes in compiled scalar code, alike to the last bit on every machine.

    >>> squared, vectors = natural_modes(K, M)       # rising; V'MV = 1, V'KV = diag(squared)

Cyclic Jacobi rotations: as exact as LAPACK, for small frequencies beside large ones more so, and
quick enough up to a few hundred coordinates. The rotations end when none is left to be done; a
matrix for which that takes too long is refused.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from flexsim.errors import ModelError
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array

SWEEPS = 60  # 5 to 12 are usual; a matrix that is not finite never ends
ROTATED = 1e-16  # relative to both diagonals: an element below it is rounding
NOTHING = 1e-30  # relative to the largest: an element beside diagonals of zero


def natural_modes(K: ArrayLike, M: ArrayLike) -> tuple[Array, Array]:
    """Return squared frequencies (n,), rising, and modes (n, n), a column each, of M q'' + K q = 0.

    Args:
        K, M: (n, n) symmetric; M positive definite. Lower triangles of M are read.

    Raises:
        ModelError: M is not positive definite, or a matrix is not finite.
    """
    stiffness = np.array(K, dtype=float, order="C")
    lower = np.array(M, dtype=float, order="C")
    n = len(lower)
    vectors = np.empty((n, n))
    squared = np.empty(n)
    if not factored(lower):
        raise ModelError(
            "the mass matrix is singular: a joint moves nothing; give its bodies inertia"
        )
    if not modes_of(stiffness, lower, squared, vectors):
        raise ModelError("the natural frequencies cannot be found: a stiffness is not finite")
    return squared, vectors


def symmetric_eigen(matrix: ArrayLike) -> tuple[Array, Array]:
    """Return eigenvalues (n,), rising, and unit eigenvectors (n, n), a column each.

    Raises:
        ModelError: the matrix is not finite.
    """
    a = np.array(matrix, dtype=float, order="C")
    values, vectors = np.empty(len(a)), np.empty_like(a)
    if not rotated(a, values, vectors):
        raise ModelError("the eigenvalues of a matrix cannot be found: it is not finite")
    return values, vectors


@jit
def factored(m: Array) -> bool:
    """Write Cholesky's factor over the lower triangle of m (n, n); return whether there is one."""
    for j in range(m.shape[0]):
        for i in range(j, m.shape[0]):
            total = m[i, j]
            for c in range(j):
                total -= m[i, c] * m[j, c]
            if i == j:
                if not 0.0 < total < np.inf:
                    return False
                m[j, j] = math.sqrt(total)
            else:
                m[i, j] = total / m[j, j]
    return True


@jit
def modes_of(K: Array, lower: Array, squared: Array, vectors: Array) -> bool:
    """Fill squared (n,) and vectors (n, n) of K, overwritten, and the factor of M."""
    n = K.shape[0]
    for c in range(n):  # K becomes L^-1 K, column by column, ...
        for i in range(n):
            for j in range(i):
                K[i, c] -= lower[i, j] * K[j, c]
            K[i, c] /= lower[i, i]
    for r in range(n):  # ... then L^-1 K L^-T, row by row
        for i in range(n):
            for j in range(i):
                K[r, i] -= lower[i, j] * K[r, j]
            K[r, i] /= lower[i, i]
    for i in range(n):
        for j in range(i):
            K[i, j] = K[j, i] = 0.5 * (K[i, j] + K[j, i])
    if not rotated(K, squared, vectors):
        return False
    for c in range(n):  # back to the coordinates: L^-T times the unit vectors
        for i in range(n - 1, -1, -1):
            for j in range(i + 1, n):
                vectors[i, c] -= lower[j, i] * vectors[j, c]
            vectors[i, c] /= lower[i, i]
    return True


@jit
def rotated(a: Array, values: Array, vectors: Array) -> bool:
    """Fill eigenvalues (n,), rising, and eigenvectors (n, n) of a symmetric a, overwritten.

    Returns:
        Whether the rotations came to an end.

    Source: cyclic Jacobi rotations with the small angle; G. Golub, C. Van Loan, Matrix
    Computations, 4th ed., section 8.5.
    """
    n = a.shape[0]
    largest = 0.0
    turned = np.zeros((n, n))  # eigenvectors in rows, so that a rotation runs along the memory
    for i in range(n):
        turned[i, i] = 1.0
        for j in range(n):
            if not abs(a[i, j]) < np.inf:
                return False
            largest = max(largest, abs(a[i, j]))
    for _ in range(SWEEPS):
        left = 0
        for p in range(n - 1):
            for q in range(p + 1, n):
                apq = a[p, q]
                if abs(apq) <= ROTATED * math.sqrt(abs(a[p, p]) * abs(a[q, q])):
                    continue
                if abs(apq) <= NOTHING * largest:
                    continue
                left += 1
                theta = (a[q, q] - a[p, p]) / (2.0 * apq)
                t = 1.0 / (abs(theta) + math.sqrt(theta * theta + 1.0))
                if theta < 0.0:
                    t = -t
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                a[p, p] -= t * apq
                a[q, q] += t * apq
                a[p, q] = a[q, p] = 0.0
                for i in range(n):
                    if i != p and i != q:
                        x, y = a[p, i], a[q, i]
                        a[p, i] = c * x - s * y
                        a[q, i] = s * x + c * y
                for i in range(n):
                    a[i, p] = a[p, i]
                    a[i, q] = a[q, i]
                for i in range(n):
                    x, y = turned[p, i], turned[q, i]
                    turned[p, i] = c * x - s * y
                    turned[q, i] = s * x + c * y
        if left == 0:
            _sorted(a, turned, values, vectors)
            return True
    return False


@jit
def _sorted(a: Array, turned: Array, values: Array, vectors: Array) -> None:
    """Fill values and vectors, rising, from the diagonal of a and the rows of turned."""
    n = a.shape[0]
    taken = np.zeros(n)
    for c in range(n):
        best = -1
        for i in range(n):
            if taken[i] == 0.0 and (best < 0 or a[i, i] < a[best, best]):
                best = i
        taken[best] = 1.0
        values[c] = a[best, best]
        for i in range(n):
            vectors[i, c] = turned[best, i]
