"""What figures and recordings share: plants in words, the longer motion, differences."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from flexsim.errors import ParameterError
from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array

TIMELINE = "simulation_time"  # [s]
MM = 1000.0  # [mm/m]
ASSUMED_MODES, CHAIN = "assumed-modes", "chain"


def kind(plant: str) -> str:
    """Return a plant's name without its size: 'chain' for 'chain:10'."""
    return plant.partition(":")[0]


def spoken(plant: str) -> str:
    """Return the plant's name as text shows it: 'assumed modes', 'chain', 'chain 10'."""
    return plant.replace("-", " ").replace(":", " ")


def longest(motions: Mapping[str, Motion]) -> Motion:
    """Return the motion with the most samples, whose reference covers all the others."""
    return max(motions.values(), key=lambda motion: motion.time.size)


def difference(motions: Mapping[str, Motion], of: Callable[[Motion], Array]) -> tuple[Array, Array]:
    """Return the times that both plants reached (K,) [s] and the second minus the first there.

    Raises:
        ParameterError: the two were not sampled at the same times.
    """
    (one, first), (other, second) = motions.items()
    k = min(first.time.size, second.time.size)
    if not np.allclose(first.time[:k], second.time[:k], rtol=0, atol=1e-9):
        raise ParameterError(
            f"the motions of {one} and {other} are sampled at different times; "
            "thin both by the same stride"
        )
    return first.time[:k], of(second)[:k] - of(first)[:k]
