"""The sampled plant with v as strain bridges and an estimator give it: what else is linear.

>>> with_bridges(A, B, C, positions, told, b).C[2]       # v as the controllers see it

An estimator without memory is another row. A bridge's filter and a Kalman filter are states: the
strains read and those ahead of the filter at the sample before, the commands held since, and what
the estimator made of them. Noise, offset and drift move no poles.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexsim.loop.hardware import BridgeNumbers
from flexsim.loop.hardware.bridges import CAME, READ, TOLD
from flexsim.loop.hardware.estimators import COMMANDS, READINGS
from flexsim.numerics.types import Array


class SeenLoop(NamedTuple):
    """A sampled plant of n states, then `memory` of the bridges': A, B (.., 2), C (3, ..)."""

    A: Array
    B: Array
    C: Array
    memory: int


def has_memory(b: BridgeNumbers) -> bool:
    """Return whether v depends on what was read before."""
    return b.estimated and (b.states > 0 or b.keep > 0.0)


def with_bridges(
    A: Array, B: Array, C: Array, positions: Array, told: Array, b: BridgeNumbers
) -> SeenLoop:
    """Return a sampled plant whose v is that of an estimator.

    Args:
        A, B: (n, n), (n, 2) of the plant over a period. C: (3, n) to theta1, theta2, v.
        positions: (m, n) rows that take the plant's own m positions out of its states.
        told: (2, n) rows of the commands that reach the motors at a sample; zeros where they are
            the inputs themselves. b: of the plant.
    """
    if not b.estimated:
        return SeenLoop(A, B, C, 0)
    n, states = len(A), b.states
    strain = b.rows.reshape(COMMANDS, -1) @ positions  # (2, n)
    H_states, H_read = b.H[:states], b.H[states:]
    if not has_memory(b):
        return SeenLoop(A, B, np.vstack([C[:2], H_read @ strain]), 0)
    F, G = b.F.reshape(states, states), b.G.reshape(states, READINGS + COMMANDS)
    size = 2 * COMMANDS + COMMANDS + states  # read, came, told, estimated
    own = slice(3 * COMMANDS, size)
    read, came, held = slice(READ, READ + 2), slice(CAME, CAME + 2), slice(TOLD, TOLD + 2)
    two = np.eye(2)
    of_x, of_memory = np.zeros((size, n)), np.zeros((size, size))
    of_x[read], of_x[came] = b.now * strain, strain
    of_memory[read, read], of_memory[read, came] = b.keep * two, b.before * two
    of_x[own] = G[:, :2] @ C[:2] + G[:, 2:4] @ of_x[read]
    of_memory[own] = G[:, 2:4] @ of_memory[read]
    of_memory[own, held] += G[:, 4:]
    of_memory[own, own] += F
    v_x = H_states @ of_x[own] + H_read @ of_x[read]
    v_memory = H_states @ of_memory[own] + H_read @ of_memory[read]
    into = np.zeros((size, COMMANDS))
    of_x[held] = told
    if not told.any():
        into[held] = two
    rows = np.hstack([np.vstack([C[:2], v_x]), np.zeros((3, size))])
    rows[2, n:] = v_memory
    whole = np.block([[A, np.zeros((n, size))], [of_x, of_memory]])
    return SeenLoop(whole, np.vstack([B, into]), rows, size)


def memory_of(seen: SeenLoop, plant_states: Array, torques: Array) -> Array:
    """Return the memory (K, size) ahead of every sample of a run from rest, beam straight.

    Args:
        plant_states: (K, n) deviations of the plant behind its hardware. torques: (K, 2) commands
            of the controllers [N m].
    """
    n, size = seen.A.shape[0] - seen.memory, seen.memory
    memory = np.zeros((len(plant_states), size))
    if size > 3 * COMMANDS and len(memory):  # it counts angles from those that it reads first:
        # to its model, whose joints are free, that is to start at them
        memory[0, 3 * COMMANDS : 3 * COMMANDS + 2] = plant_states[0, :2]
    for k in range(len(memory) - 1):
        memory[k + 1] = (
            seen.A[n:, :n] @ plant_states[k] + seen.A[n:, n:] @ memory[k] + seen.B[n:] @ torques[k]
        )
    return memory
