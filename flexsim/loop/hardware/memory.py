"""What motors and joints hand from a physics step to the next: one small array per run."""

from __future__ import annotations

import numpy as np

from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array

MOTOR, AMPLIFIER, ANGLE, RATE, BRISTLE, BEFORE = range(6)  # columns


@jit
def joint_memory(state: Array) -> Array:
    """Return the memory (2, 6) of both joints, motors in the middle of their gaps, moving along.

    Args:
        state: (2 m,) of the plant.
    """
    memory = np.zeros((2, 6))
    for j in range(2):
        memory[j, ANGLE] = memory[j, BEFORE] = state[j]
        memory[j, RATE] = state[state.shape[0] // 2 + j]
    return memory
