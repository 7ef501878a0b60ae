"""Fewer states for a stable sampled system: balanced truncation, with its bound.

    reduced, bound = truncated(system, order=8)   # norm of the difference: at most the bound

Source: K. Glover, All optimal Hankel-norm approximations of linear multivariable systems and their
L-infinity error bounds, Int. J. Control 39 (1984) 1115-1193, for the bound; U. M. Al-Saggaf and
G. F. Franklin, An error bound for a discrete reduced order model of a linear multivariable system,
IEEE Trans. Automatic Control 32 (1987) 815-819, for sampled systems. From memory, not checked
against the prints; the bound itself is held by tests.
"""

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from controllers.errors import ControllerError
from controllers.model_based.model import Space, spectral_radius
from controllers.series import Array

LEAST = 1e-14
"""Hankel singular values below this share of the largest are none."""


def hankel_values(system: Space) -> Array:
    """Return the Hankel singular values (n,) of a stable sampled system, largest first."""
    return _balancing(system)[0]


def bounds(values: Array) -> Array:
    """Return the bounds (n + 1,) on the error's norm of keeping 0, 1, ... n states."""
    tail = np.concatenate([np.cumsum(values[::-1])[::-1], [0.0]])
    return np.asarray(2.0 * tail)


def truncated(system: Space, order: int) -> tuple[Space, float]:
    """Return a system of so many states, and the bound on the norm of what it is off by.

    Args:
        system: (A, B, C, D), stable, sampled. order: as many states as it has, or fewer.

    Raises:
        ControllerError: the system is not stable.
    """
    values, left, right = _balancing(system)
    A, B, C, D = system
    k = min(order, int((values > LEAST * values.max(initial=0.0)).sum()))
    bound = float(bounds(values)[k])
    T, S = right[:, :k], left[:k]  # x = T x~, x~ = S x
    return (S @ A @ T, S @ B, C @ T, D), bound


def _balancing(system: Space) -> tuple[Array, Array, Array]:
    """Return Hankel singular values (n,), and S (n, n) and T (n, n) of the square-root method.

    S and T are of as many rows and columns as there are values that count, then zeros.
    """
    A, B, C, _ = system
    if not len(A):
        return np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0))
    if not spectral_radius(A) < 1.0:
        raise ControllerError("only a stable system can be balanced; keep the poles that are not")
    reached = _root(solve_discrete_lyapunov(A, B @ B.T, method="bilinear"))
    seen = _root(solve_discrete_lyapunov(A.T, C.T @ C, method="bilinear"))
    U, values, Vt = np.linalg.svd(seen.T @ reached)
    counts = values > LEAST * values.max(initial=0.0)
    scale = np.where(counts, 1.0 / np.sqrt(np.where(counts, values, 1.0)), 0.0)
    S, T = scale[:, None] * (U.T @ seen.T), reached @ Vt.T * scale
    most = np.abs(T).argmax(axis=0)  # signs that do not depend on the library
    signs = np.where(T[most, np.arange(len(A))] < 0.0, -1.0, 1.0)
    return values, signs[:, None] * S, T * signs


def _root(P: Array) -> Array:
    """Return R (n, n) of P = R R', what rounding made negative left out."""
    size, U = np.linalg.eigh((P + P.T) / 2)
    return np.asarray(U * np.sqrt(np.maximum(size, 0.0)))
