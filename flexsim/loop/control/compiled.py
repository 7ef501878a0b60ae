"""Controllers as compiled code runs them: sums of cascades of filters, and a state space.

Whatever kind a controller was given as (`flexsim.loop.control.stacking`), each joint has a sum of
cascades of digital filters on its own error, and both joints share a discrete state space on the
errors and v; what a controller does not have is zero and costs next to nothing.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array

MEASURED = 3  # what a state space sees: the errors of both joints [rad] and v [m]


class Controllers(NamedTuple):
    """P controllers of both joints.

    The torque of a joint is the sum of its branches, each a cascade of sections on its error,
    and of its row of the state space x' = A x + B y, u = C x + D y with y = (e1, e2, v).

    Attributes:
        b, a: (P, 2, branches, sections, m+1), a[..., 0] = 1; missing sections pass what they get,
            missing branches give zero.
        A: (P, n, n), B: (P, n, 3), C: (P, 2, n), D: (P, 2, 3); n = 0 where nobody has one.
    """

    b: Array
    a: Array
    A: Array
    B: Array
    C: Array
    D: Array

    def chosen(self, which: slice | NDArray[Any]) -> Controllers:
        """Return some of the controllers."""
        return Controllers(*(each[which] for each in self))


@jit
def filter_sample(b: Array, a: Array, z: Array, x: float) -> float:
    """Return the output of a digital filter for one input sample, direct form II transposed.

    Args:
        b, a: (m+1,) coefficients, a[0] = 1, as scipy.signal.lfilter takes them.
        z: (m+1,) delays, the last always 0; overwritten.
    """
    y = b[0] * x + z[0]
    for i in range(b.shape[0] - 1):
        z[i] = b[i + 1] * x - a[i + 1] * y + z[i + 1]
    return y


@jit
def branches_sample(b: Array, a: Array, z: Array, x: float) -> float:
    """Return the sum of cascades of filters for one input sample.

    Args:
        b, a, z: (branches, sections, m+1); see `filter_sample`.
    """
    total = 0.0
    for i in range(b.shape[0]):
        y = x
        for j in range(b.shape[1]):
            y = filter_sample(b[i, j], a[i, j], z[i, j], y)
        total += y
    return total


@jit
def space_sample(A: Array, B: Array, C: Array, D: Array, x: Array, y: Array, u: Array) -> None:
    """Add a state space's output for one sample to u (2,), and advance its state.

    Args:
        A, B, C, D: (n, n), (n, 3), (2, n), (2, 3). x: (2, n), the state and room for the next.
        y: (3,) measurements.
    """
    n = A.shape[0]
    for i in range(2):
        for j in range(n):
            u[i] += C[i, j] * x[0, j]
        for j in range(MEASURED):
            u[i] += D[i, j] * y[j]
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += A[i, j] * x[0, j]
        for j in range(MEASURED):
            total += B[i, j] * y[j]
        x[1, i] = total
    x[0, :] = x[1]


@jit
def control_sample(c: Controllers, i: int, z: Array, x: Array, e1: float, e2: float, v: float):  # type: ignore[no-untyped-def]
    """Return the torques (u1, u2) of controller i for one sample of the measurements [N m].

    Args:
        z: (2, branches, sections, m+1) and x: (2, n), the controller's memory, overwritten.

    Source: (3), (4).
    """
    u1 = branches_sample(c.b[i, 0], c.a[i, 0], z[0], e1)
    u2 = branches_sample(c.b[i, 1], c.a[i, 1], z[1], e2)
    if x.shape[1] > 0:
        y, u = np.array([e1, e2, v]), np.array([u1, u2])
        space_sample(c.A[i], c.B[i], c.C[i], c.D[i], x, y, u)
        u1, u2 = u[0], u[1]
    return u1, u2
