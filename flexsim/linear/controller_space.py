"""Controllers of any linear kind as one state space each, exactly as compiled code runs them.

>>> from flexsim.loop.control.stacking import stack
>>> A, B, C, D = controller_space(stack([controller], period=1e-3))
"""

from __future__ import annotations

import numpy as np

from flexsim.loop.control.compiled import MEASURED, Controllers
from flexsim.loop.control.linear_kinds import filter_space
from flexsim.numerics.types import Array


def controller_space(controllers: Controllers) -> tuple[Array, Array, Array, Array]:
    """Return A (P, n, n), B (P, n, 3), C (P, 2, n), D (P, 2, 3), from (e1, e2, v) to two torques.

    The states are the delays of joint 1's sections, branch by branch, then joint 2's, then the
    states of the state space; sections and branches that are there for others only are kept.
    """
    P, joints, branches, sections, width = controllers.b.shape
    m, own = width - 1, controllers.A.shape[-1]
    n = joints * branches * sections * m + own
    A, B = np.zeros((P, n, n)), np.zeros((P, n, MEASURED))
    C, D = np.zeros((P, joints, n)), controllers.D.copy()
    start = 0
    for j in range(joints):
        for k in range(branches):
            passed, direct = np.zeros((P, n)), np.ones(P)  # what the next section gets
            for s in range(sections):
                F, G, H, d = filter_space(controllers.b[:, j, k, s], controllers.a[:, j, k, s])
                mine = slice(start, start + m)
                A[:, mine] = G[:, :, None] * passed[:, None, :]
                A[:, mine, mine] += F
                B[:, mine, j] = G * direct[:, None]
                passed, direct = d[:, None] * passed, d * direct
                passed[:, mine] += H
                start += m
            C[:, j] += passed
            D[:, j, j] += direct
    A[:, start:, start:], B[:, start:] = controllers.A, controllers.B
    C[:, :, start:] = controllers.C
    return A, B, C, D


def controller_states(controllers: Controllers, measured: Array) -> Array:
    """Return the states (K, n) that one controller has when it gets measurements (K, 3)."""
    A, B, _, _ = (part[0] for part in controller_space(controllers))
    states = np.zeros((len(measured), len(A)))
    for k in range(1, len(measured)):
        states[k] = A @ states[k - 1] + B @ measured[k - 1]
    return states
