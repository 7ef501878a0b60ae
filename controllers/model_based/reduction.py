"""Fewer states for a stable sampled system: balanced truncation, with its bound.

    found = balanced(system)
    reduced = found.truncated(8)        # the norm of the difference is found.bounds[8] at most

Source: K. Glover, All optimal Hankel-norm approximations of linear multivariable systems and their
L-infinity error bounds, Int. J. Control 39 (1984) 1115-1193, for the bound; U. M. Al-Saggaf and
G. F. Franklin, An error bound for a discrete reduced order model of a linear multivariable system,
IEEE Trans. Automatic Control 32 (1987) 815-819, for sampled systems. From memory, not checked
against the prints; the bound itself is held by tests.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from controllers.errors import ControllerError
from controllers.model_based.model import Space, spectral_radius
from controllers.series import Array

LEAST = 1e-14
"""Hankel singular values below this share of the largest are none."""


class Balanced(NamedTuple):
    """A stable sampled system of n states, with what balances it."""

    system: Space
    values: Array
    """(n,) Hankel singular values, largest first."""
    S: Array
    """(n, n) to balanced states, one row each; zero where a value is none."""
    T: Array
    """(n, n) from balanced states, one column each."""

    @property
    def bounds(self) -> Array:
        """Bounds (n + 1,) on the norm of what keeping 0, 1, ... n states leaves out."""
        tail = np.concatenate([np.cumsum(self.values[::-1])[::-1], [0.0]])
        return np.asarray(2.0 * tail)

    def truncated(self, order: int) -> Space:
        """Return the system of so many states, or fewer where fewer count."""
        A, B, C, D = self.system
        k = min(order, int(self.S.any(axis=1).sum()))
        S, T = self.S[:k], self.T[:, :k]
        return S @ A @ T, S @ B, C @ T, D


def balanced(system: Space) -> Balanced:
    """Return a system balanced, by the square-root method.

    Args:
        system: (A, B, C, D), stable, sampled.

    Raises:
        ControllerError: the system is not stable.
    """
    A, B, C, _ = system
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
    return Balanced(system, values, signs[:, None] * S, T * signs)


def _root(P: Array) -> Array:
    """Return R (n, n) of P = R R', what rounding made negative left out."""
    size, U = np.linalg.eigh((P + P.T) / 2)
    return np.asarray(U * np.sqrt(np.maximum(size, 0.0)))
