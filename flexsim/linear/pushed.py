"""A push at the tip: the rates that an impulse leaves behind, on any plant.

>>> start = pushed(plant, theta=(0.1, 1.2), impulse=0.02)
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from flexsim.errors import ParameterError
from flexsim.numerics.dense import solve
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant


def pushed(plant: Plant, theta: ArrayLike, impulse: float) -> Array:
    """Return the state (2 m,) just after a push at the tip, the arm at rest before.

    The push is across link 2, positive towards +v, and so short that nothing moves meanwhile:
    M q' = J^T P.

    Args:
        theta: joint angles (2,) [rad], beam straight. impulse: P [N s].

    Raises:
        ParameterError: the impulse is not a finite number.
    """
    if not math.isfinite(impulse):
        raise ParameterError(f"a push is {impulse} N s; give a finite number")
    start = np.array(plant.rest_state(theta), dtype=float)
    _, theta2 = (float(each) for each in np.asarray(theta, dtype=float))
    linear, p = plant.linearised(theta2), plant.parameters
    across = linear.tip.copy()
    across[0] += p.L_R * math.cos(theta2) + p.reach
    across[1] += p.reach
    own = np.arange(len(across)) if linear.coordinates is None else linear.coordinates
    start[len(start) // 2 + own] = solve(linear.M, impulse * across[:, None])[:, 0]
    return start
