"""How long may a step be? Regions of stability of Runge-Kutta, and how fast damped motions decay.

>>> longest_rk4_step(1424.0, fastest_decay([(M, D, K)]))      # [s]
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from flexsim.numerics.types import Array

RK4_LIMIT = 2.8  # omega step on the imaginary axis up to which classical RK4 is stable (2.828)
DAMPED_LIMIT = 2.61  # radius of the left half-disc inside RK4's region of stability (2.616)
DAMPED_SHARE = 0.01  # damping ratio from which the disc counts, not the imaginary axis


def fastest_decay(motions: Iterable[tuple[Array, Array, Array]]) -> float:
    """Return the largest |lambda| of damped motions M q'' + D q' + K q = 0 [1/s], 0 without any.

    Args:
        motions: (M, D, K), each (n, n), of every pose.
    """
    fastest = 0.0
    for M, D, K in motions:
        n = len(M)
        A = np.vstack([np.eye(n, 2 * n, n), -np.linalg.solve(M, np.hstack([K, D]))])  # (2 n, 2 n)
        rates = np.linalg.eigvals(A)
        damped = rates[-rates.real > DAMPED_SHARE * np.abs(rates)]
        fastest = max(fastest, float(np.abs(damped).max(initial=0.0)))
    return fastest


def longest_rk4_step(omega: float, decay: float) -> float:
    """Return the step below which RK4 is stable [s], inf where nothing moves by itself.

    Args:
        omega: highest natural frequency [rad/s]. decay: see `fastest_decay` [1/s].
    """
    longest = RK4_LIMIT / omega if omega else np.inf
    return float(min(longest, DAMPED_LIMIT / decay) if decay else longest)


LONGEST_STEP = 1e-3  # [s] the control period of the paper
POSES = np.linspace(0.0, np.pi, 5)  # [rad] of joint 2, from stretched to folded


def halved(longest: float) -> float:
    """Return 1 ms, halved until it is below the longest step [s]."""
    step = LONGEST_STEP
    while step >= longest:
        step /= 2
    return step
