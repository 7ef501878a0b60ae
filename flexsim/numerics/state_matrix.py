"""The one state matrix: M q'' + D q' + K q = 0 as a system of first order.

>>> eigenvalues(state_matrix(M, D, K))       # the motions' rates [1/s]
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexsim.numerics.dense import solve
from flexsim.numerics.types import Array


def state_matrix(M: ArrayLike, D: ArrayLike, K: ArrayLike) -> Array:
    """Return [[0, I], [-M^-1 K, -M^-1 D]] (2m, 2m) of the state [q, q'].

    Args:
        M, D, K: (m, m) mass, damping and stiffness; none need be symmetric.

    Raises:
        ModelError: M is singular.
    """
    m = len(np.asarray(M))
    accelerations = -solve(M, np.hstack([K, D]))  # (m, 2m)
    return np.vstack([np.eye(m, 2 * m, m), accelerations])
