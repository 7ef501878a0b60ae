"""The beam's coordinates in the hub's frame, which a state has, and in the world, as EXUDYN has.

A state is [theta1, theta2, s_0, a_1, b_1, s_1, t_1, ..., t_N], then rates: how far node k is from
its place on the straight beam along (a) and across (b) the hub's axis, and how far its slope
vector, the derivative of the position along the beam, is from the hub's axis (s along, t across).
Node 0 is clamped: of it only the slope's length is free. EXUDYN's are what link 1, hub and nodes
are away from the straight arm, (x, y, angle) and (x, y, slope x, slope y), of a payload last.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexsim.numerics.jit import jit_apart
from flexsim.numerics.types import Array

FIRST = 3  # coordinates of a state ahead of node 1's
BODIES = 6  # EXUDYN's coordinates ahead of node 0's
OF_NODE = 4


class ExudynBeam(NamedTuple):
    """What compiled functions need to know of the arm in EXUDYN.

    Attributes:
        handle: the number of the run's systems, see `.calls`. L_R, reach: [m]. r_1, r_2: gears.
        places: (N+1,) of the nodes along the hub's axis, from joint 2 [m].
        straight: (n,) EXUDYN's coordinates of the straight arm along x.
        world: (threads, 2, n) EXUDYN's coordinates and rates, where both sides find them.
    """

    handle: int
    L_R: float
    reach: float
    r_1: float
    r_2: float
    places: Array
    straight: Array
    world: Array


@jit_apart
def to_world(p: ExudynBeam, state: Array, world: Array) -> None:
    """Write EXUDYN's coordinates and rates of a state (2 m,) to world (2, n)."""
    m, N = state.shape[0] // 2, p.places.shape[0] - 1
    w1, w12 = state[m], state[m] + state[m + 1]
    c1, s1 = np.cos(state[0]), np.sin(state[0])
    c, s = np.cos(state[0] + state[1]), np.sin(state[0] + state[1])
    q, w = world[0], world[1]
    q[:] = 0.0
    w[:] = 0.0
    q[2], w[2] = state[0], w1
    q[3], q[4], q[5] = p.L_R * c1, p.L_R * s1, state[0] + state[1]
    w[3], w[4], w[5] = -p.L_R * s1 * w1, p.L_R * c1 * w1, w12
    for k in range(N + 1):
        a = b = da = db = t = dt = 0.0
        i, j = 2, BODIES + OF_NODE * k
        if k > 0:
            i = FIRST + OF_NODE * (k - 1)
            a, b, da, db = state[i], state[i + 1], state[m + i], state[m + i + 1]
            t, dt = state[i + 3], state[m + i + 3]
            i += 2
        a, slope, stretching = p.places[k] + a, 1.0 + state[i], state[m + i]
        q[j], q[j + 1] = q[3] + a * c - b * s, q[4] + a * s + b * c
        q[j + 2], q[j + 3] = slope * c - t * s, slope * s + t * c
        along, across = da - w12 * b, db + w12 * a
        w[j], w[j + 1] = w[3] + along * c - across * s, w[4] + along * s + across * c
        along, across = stretching - w12 * t, dt + w12 * slope
        w[j + 2], w[j + 3] = along * c - across * s, along * s + across * c
    last = BODIES + OF_NODE * (N + 1)
    if q.shape[0] > last:  # the payload, held at the tip
        slope, t = 1.0 + state[m - 2], state[m - 1]
        turning = (slope * state[2 * m - 1] - t * state[2 * m - 2]) / (slope * slope + t * t)
        q[last], q[last + 1] = q[last - 4], q[last - 3]
        w[last], w[last + 1] = w[last - 4], w[last - 3]
        q[last + 2], w[last + 2] = q[5] + np.arctan2(t, slope), w12 + turning
    for i in range(q.shape[0]):
        q[i] -= p.straight[i]


@jit_apart
def from_world(p: ExudynBeam, world: Array, state: Array) -> None:
    """Write the state (2 m,) of EXUDYN's coordinates and rates (2, n)."""
    m, N = state.shape[0] // 2, p.places.shape[0] - 1
    q, w = world[0], world[1]
    state[0], state[1] = q[2], q[5] - q[2]
    state[m], state[m + 1] = w[2], w[5] - w[2]
    c1, s1 = np.cos(q[2]), np.sin(q[2])
    c, s, w12 = np.cos(q[5]), np.sin(q[5]), w[5]
    for k in range(N + 1):
        i, j = 0, BODIES + OF_NODE * k
        if k > 0:
            i = FIRST + OF_NODE * (k - 1)
            x = q[j] + p.straight[j] - p.L_R * c1
            y = q[j + 1] + p.straight[j + 1] - p.L_R * s1
            dx, dy = w[j] + p.L_R * s1 * w[2], w[j + 1] - p.L_R * c1 * w[2]
            a, b = x * c + y * s, y * c - x * s
            state[i], state[i + 1] = a - p.places[k], b
            state[m + i] = dx * c + dy * s + w12 * b
            state[m + i + 1] = dy * c - dx * s - w12 * a
        x, y = q[j + 2] + p.straight[j + 2], q[j + 3] + p.straight[j + 3]
        slope, t = x * c + y * s, y * c - x * s
        state[i + 2] = slope - 1.0
        state[m + i + 2] = w[j + 2] * c + w[j + 3] * s + w12 * t
        if k > 0:
            state[i + 3] = t
            state[m + i + 3] = w[j + 3] * c - w[j + 2] * s - w12 * slope


@jit_apart
def all_to_world(p: ExudynBeam, states: Array) -> Array:
    """Return EXUDYN's coordinates and rates (K, 2, n) of states (K, 2 m)."""
    found = np.empty((states.shape[0], 2, p.straight.shape[0]))
    for k in range(states.shape[0]):
        to_world(p, states[k], found[k])
    return found
