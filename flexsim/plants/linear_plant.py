"""A plant near rest: M q'' + D q' + K q = S tau about a pose with the beam straight, joints free.

>>> linear = plant.linearised(theta2=1.2)
>>> linear.A.shape, linear.B.shape, linear.C.shape

Measured are theta1, theta2 and v. Nothing depends on theta1, since the arm moves in a horizontal
plane. What a sampled loop makes of it: `flexsim.linear`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexsim.numerics.dense import solve
from flexsim.numerics.state_matrix import state_matrix
from flexsim.numerics.types import Array

THETA1, THETA2, V = 0, 1, 2  # rows of C


@dataclass(frozen=True, eq=False)
class LinearPlant:
    """A plant about rest at theta2, beam straight; q are deviations from that pose.

    Attributes:
        M, D, K: (m, m) mass, damping and stiffness [SI, mixed]. S: (m, 2) torques at the motors.
        tip: (m,) v = tip . q. theta2: of the pose [rad].
        coordinates: (m,) which of the plant's these are; None for all, in order.
    """

    M: Array
    D: Array
    K: Array
    S: Array
    tip: Array
    theta2: float
    coordinates: NDArray[np.intp] | None = None

    def state(self, states: Array) -> Array:
        """Return states (K, 2m) of these coordinates, from the plant's (K, 2M)."""
        if self.coordinates is None:
            return states
        rates = self.coordinates + states.shape[1] // 2
        return states[:, np.concatenate([self.coordinates, rates])]

    @cached_property
    def A(self) -> Array:
        """System matrix (2m, 2m) of the state [q, q']."""
        return state_matrix(self.M, self.D, self.K)

    @cached_property
    def B(self) -> Array:
        """Input matrix (2m, 2), from the torques at the motors [N m]."""
        return np.vstack([np.zeros_like(self.S), solve(self.M, self.S)])

    @cached_property
    def C(self) -> Array:
        """Output matrix (3, 2m) to theta1, theta2 [rad] and v [m]."""
        m = len(self.M)
        C = np.zeros((3, 2 * m))
        C[THETA1, 0] = C[THETA2, 1] = 1.0
        C[V, :m] = self.tip
        return C
