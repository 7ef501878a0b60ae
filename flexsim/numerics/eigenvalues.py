"""Eigenvalues of any real matrix in compiled scalar code, alike to the last bit on every machine.

    >>> eigenvalues(state_matrix(M, D, K))       # rates of damped motions [1/s], complex

Balancing, Hessenberg form and Francis's double QR steps, as in EISPACK. Symmetric matrices, and
motions without damping, are better served by `flexsim.numerics.eigen`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexsim.errors import ModelError
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array

STEPS = 60  # QR steps for one eigenvalue or a pair; two or three are usual
UNUSUAL = 10  # after as many without one, a shift that is not the usual
ROUNDING = 2.0**-53
BALANCED = 0.95  # a row and column are scaled if that makes their sum smaller than this much of it


def eigenvalues(matrix: ArrayLike) -> NDArray[np.complex128]:
    """Return the eigenvalues (n,) of a matrix (n, n), pairs beside one another.

    Raises:
        ModelError: the matrix is not finite.
    """
    a = np.array(matrix, dtype=float, order="C")
    real, imaginary = np.zeros(len(a)), np.zeros(len(a))
    if not np.isfinite(a).all():
        raise ModelError("the eigenvalues of a matrix cannot be found: it is not finite")
    _balance(a)
    _to_hessenberg(a)
    if not _deflate(a, real, imaginary):
        raise ModelError(f"the eigenvalues of a matrix of {len(a)} rows are not found")
    return real + 1j * imaginary


@jit
def _balance(a: Array) -> None:
    """Scale rows and columns of a (n, n) by powers of two until they are alike; exact."""
    n = a.shape[0]
    changed = True
    while changed:
        changed = False
        for i in range(n):
            row = column = 0.0
            for j in range(n):
                if j != i:
                    row += abs(a[i, j])
                    column += abs(a[j, i])
            if not (0.0 < row < np.inf and 0.0 < column < np.inf):
                continue
            before, scale = row + column, 1.0
            while column < row / 2.0:
                scale *= 2.0
                column *= 4.0
            while column >= row * 2.0:
                scale /= 2.0
                column /= 4.0
            if (row + column) / scale < BALANCED * before:
                changed = True
                for j in range(n):
                    a[i, j] /= scale
                for j in range(n):
                    a[j, i] *= scale


@jit
def _to_hessenberg(a: Array) -> None:
    """Bring a (n, n) to Hessenberg form by elimination with pivots; zeros are written below."""
    n = a.shape[0]
    for m in range(1, n - 1):
        best = m
        for i in range(m, n):
            if abs(a[i, m - 1]) > abs(a[best, m - 1]):
                best = i
        pivot = a[best, m - 1]
        if best != m:
            for j in range(n):
                a[best, j], a[m, j] = a[m, j], a[best, j]
            for j in range(n):
                a[j, best], a[j, m] = a[j, m], a[j, best]
        if pivot == 0.0:
            continue
        for i in range(m + 1, n):
            factor = a[i, m - 1] / pivot
            if factor != 0.0:
                for j in range(n):
                    a[i, j] -= factor * a[m, j]
                for j in range(n):
                    a[j, m] += factor * a[j, i]
            a[i, m - 1] = 0.0


@jit
def _deflate(a: Array, real: Array, imaginary: Array) -> bool:
    """Fill the eigenvalues of a Hessenberg matrix, overwritten; return whether all were found."""
    norm = 0.0
    for i in range(a.shape[0]):
        for j in range(a.shape[0]):
            norm += abs(a[i, j])
    last, shift, steps = a.shape[0] - 1, 0.0, 0
    while last >= 0:
        first = _block(a, last, norm)
        if first == last:
            real[last] = a[last, last] + shift
            last, steps = last - 1, 0
        elif first == last - 1:
            _pair(a, last, shift, real, imaginary)
            last, steps = last - 2, 0
        elif steps == STEPS:
            return False
        else:
            x, y = a[last, last], a[last - 1, last - 1]
            w = a[last, last - 1] * a[last - 1, last]
            if steps > 0 and steps % UNUSUAL == 0:
                shift += x
                for i in range(last + 1):
                    a[i, i] -= x
                s = abs(a[last, last - 1]) + abs(a[last - 1, last - 2])
                x = y = 0.75 * s
                w = -0.4375 * s * s
            steps += 1
            _double_step(a, first, last, x, y, w)
    return True


@jit
def _block(a: Array, last: int, norm: float) -> int:
    """Return the first row of the block that ends with `last`, cut off by a negligible element."""
    for row in range(last, 0, -1):
        size = abs(a[row - 1, row - 1]) + abs(a[row, row])
        if size == 0.0:
            size = norm
        if abs(a[row, row - 1]) <= ROUNDING * size:
            a[row, row - 1] = 0.0
            return row
    return 0


@jit
def _pair(a: Array, last: int, shift: float, real: Array, imaginary: Array) -> None:
    """Fill the two eigenvalues of the last block of two rows."""
    x, y = a[last, last], a[last - 1, last - 1]
    w = a[last, last - 1] * a[last - 1, last]
    p = 0.5 * (y - x)
    q = p * p + w
    z = math.sqrt(abs(q))
    x += shift
    if q >= 0.0:
        z = p + z if p >= 0.0 else p - z
        real[last - 1] = x + z
        real[last] = x - w / z if z != 0.0 else x + z
    else:
        real[last - 1] = real[last] = x + p
        imaginary[last - 1], imaginary[last] = z, -z


@jit
def _double_step(a: Array, first: int, last: int, x: float, y: float, w: float) -> None:
    """Do one double QR step on rows first to last, with shifts of sum x + y and product xy - w."""
    p = q = r = 0.0
    start = last - 2
    for m in range(last - 2, first - 1, -1):  # where two small elements in a row let it begin
        start = m
        z = a[m, m]
        p = ((x - z) * (y - z) - w) / a[m + 1, m] + a[m, m + 1]
        q = a[m + 1, m + 1] - z - (x - z) - (y - z)
        r = a[m + 2, m + 1]
        size = abs(p) + abs(q) + abs(r)
        p, q, r = p / size, q / size, r / size
        if m == first:
            break
        near = abs(a[m - 1, m - 1]) + abs(z) + abs(a[m + 1, m + 1])
        if abs(a[m, m - 1]) * (abs(q) + abs(r)) <= ROUNDING * abs(p) * near:
            break
    for i in range(start + 2, last + 1):
        a[i, i - 2] = 0.0
        if i > start + 2:
            a[i, i - 3] = 0.0
    for k in range(start, last):
        scale = 1.0
        if k > start:
            p, q = a[k, k - 1], a[k + 1, k - 1]
            r = a[k + 2, k - 1] if k + 1 < last else 0.0
            scale = abs(p) + abs(q) + abs(r)
            if scale == 0.0:
                continue
            p, q, r = p / scale, q / scale, r / scale
        s = math.sqrt(p * p + q * q + r * r)
        if p < 0.0:
            s = -s
        if s == 0.0:
            continue
        if k > start:
            a[k, k - 1] = -s * scale
        elif first != start:
            a[k, k - 1] = -a[k, k - 1]
        p += s
        _reflect(a, first, last, k, p / s, q / s, r / s, q / p, r / p)


@jit
def _reflect(
    a: Array, first: int, last: int, k: int, x: float, y: float, z: float, q: float, r: float
) -> None:
    """Reflect rows and columns k to k + 2, the latter left out at the end of the block."""
    three = k + 1 < last
    for j in range(k, last + 1):
        p = a[k, j] + q * a[k + 1, j]
        if three:
            p += r * a[k + 2, j]
            a[k + 2, j] -= p * z
        a[k + 1, j] -= p * y
        a[k, j] -= p * x
    for i in range(first, min(last, k + 3) + 1):
        p = x * a[i, k] + y * a[i, k + 1]
        if three:
            p += z * a[i, k + 2]
            a[i, k + 2] -= p * r
        a[i, k + 1] -= p * q
        a[i, k] -= p
