"""Sampled optimal regulators and filters, by the discrete Riccati equation.

    K = regulator(A, B, Q, R)          # u = -K x
    M = filter_gain(A, W, C, V)        # x = x + M (y - C x), once y is measured

Source: K. J. Astrom and B. Wittenmark, Computer-Controlled Systems, 3rd ed., Prentice Hall, 1997,
ch. 11, from memory, not checked against the print.
"""

import numpy as np
from scipy.linalg import LinAlgError, solve, solve_discrete_are

from controllers.errors import ControllerError
from controllers.model_based.model import spectral_radius
from controllers.series import Array


def regulator(A: Array, B: Array, Q: Array, R: Array) -> Array:
    """Return K (m, n) of u = -K x that has the least sum of x'Q x + u'R u.

    Args:
        A: (n, n), B: (n, m). Q: (n, n) and R: (m, m), weights.

    Raises:
        ControllerError: there is no such regulator, or the loop that was found is not stable.
    """
    try:
        X = solve_discrete_are(A, B, Q, R)
        K: Array = solve(R + B.T @ X @ B, B.T @ X @ A, assume_a="sym")
        stable = np.isfinite(K).all() and spectral_radius(A - B @ K) < 1.0
    except (LinAlgError, ValueError):
        stable = False
    if not stable:
        raise ControllerError(
            "the Riccati equation has no stabilising solution to working precision; choose "
            "weights that are closer to one another, or a model whose modes can be moved"
        )
    return K


def filter_gain(A: Array, W: Array, C: Array, V: Array) -> Array:
    """Return M (n, p) of the steady-state Kalman filter that corrects by what is just measured.

    Args:
        A: (n, n). W: (n, n), covariance of what drives the states. C: (p, n). V: (p, p),
            covariance of the measurements' noise.

    Raises:
        ControllerError: there is no such filter, or the one that was found is not stable.
    """
    try:
        P = solve_discrete_are(A.T, C.T, W, V)
        M: Array = solve(C @ P @ C.T + V, C @ P, assume_a="sym").T
        stable = np.isfinite(M).all() and spectral_radius(A - A @ M @ C) < 1.0
    except (LinAlgError, ValueError):
        stable = False
    if not stable:
        raise ControllerError(
            "the Kalman filter has no stable solution to working precision; choose a slower "
            "observer, or a model whose modes are seen and driven"
        )
    return M
