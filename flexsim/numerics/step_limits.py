"""How long may a step be? What each integrator can take of vibrations, damping and held friction.

    >>> longest_step("RK4", [(M, D, K)])                          # [s]
    >>> longest_step("Euler", [(M, D, K)], at_start=friction)

About rest motions are M q'' + D q' + K q = 0, and one step is a linear map (`one_step_map`), stable
while no eigenvalue is beyond the unit circle.

- Euler, implicit and implicitfast take springs at the start of a step, damping at its end. A mode
  is stable for omega h < 2 zeta + 2 sqrt(zeta^2 + 1): with h = 2/s where s^2 + 2 zeta omega s -
  omega^2 = 0. The same holds of matrices, whatever D is: where the map ceases to be stable an
  eigenvalue passes through -1, which makes s^2 M + s D - K singular, and all its s are real, since
  m s^2 + d s - k = 0 has real roots for the m, d, k > 0 of any vector.
- Damping D0 at the start of the step (Euler with `eulerdamp` disabled; friction held over a step)
  counts against the other: s^2 M + s (D - D0) - K.
- `discrete` has the springs at the end, too: s^2 M + s (D - D0) + K, which only D0 makes singular.
- RK4 has no closed form for all angles: RK4_LIMIT where vibrations are hardly damped, DAMPED_LIMIT
  elsewhere; with friction held, the map itself is searched.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from flexsim.errors import ParameterError
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.dense import product, solve
from flexsim.numerics.eigenvalues import eigenvalues
from flexsim.numerics.state_matrix import state_matrix
from flexsim.numerics.types import Array

Motions = Iterable[tuple[Array, Array, Array]]  # M, D, K (n, n) of every pose

INTEGRATORS = ("RK4", "Euler", "implicit", "implicitfast", "discrete")
RK4_LIMIT = 2.8  # omega step on the imaginary axis up to which classical RK4 is stable (2.828)
DAMPED_LIMIT = 2.61  # radius of the left half-disc inside RK4's region of stability (2.616)
DAMPED_SHARE = 0.01  # damping ratio from which the disc counts, not the imaginary axis
REAL = 1e-6  # imaginary part, relative, below which an eigenvalue counts as real
GROWTH = 1e-6  # of the map's radius over 1: rounding of the double one of a rigid motion
HALVINGS = 30  # of the interval in which a limit is searched: 1e-9 of it
LONGEST_STEP = PERIOD
SHORTEST_STEP = 1e-7  # [s] a second takes minutes
POSES = np.linspace(0.0, np.pi, 5)  # [rad] of joint 2, from stretched to folded


def fastest_decay(motions: Motions) -> float:
    """Return the largest |lambda| of damped motions M q'' + D q' + K q = 0 [1/s], 0 without any."""
    fastest = 0.0
    for M, D, K in motions:
        rates = eigenvalues(state_matrix(M, D, K))
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


def longest_step(integrator: str, motions: Motions, at_start: ArrayLike | None = None) -> float:
    """Return the step below which an integrator is stable about rest [s], inf if any step is.

    Args:
        integrator: of INTEGRATORS. motions: of every pose.
        at_start: D0 (n, n), damping whose forces are those of the start of the step, held; beside
            the D of the motions, of which RK4 has those of its stages.
    """
    every = list(motions)
    still = np.zeros_like(every[0][0])
    D0 = still if at_start is None else np.asarray(at_start, dtype=float)
    if integrator == "RK4":
        return min(_longest_of_rk4(motion, D0) for motion in every)
    sign = 1.0 if integrator == "discrete" else -1.0
    fastest = 0.0
    for M, D, K in every:
        s = eigenvalues(state_matrix(M, D - D0, sign * K))
        real = s.real[np.abs(s.imag) <= REAL * np.abs(s)]
        fastest = max(fastest, float(real.max(initial=0.0)))
    scale = max(float(np.abs(D0).max()), 0.0 if sign > 0 else 1.0)
    return 2 / fastest if fastest > 0 and scale > 0 else np.inf


def _longest_of_rk4(motion: tuple[Array, Array, Array], D0: Array) -> float:
    M, D, K = motion
    rates = np.abs(eigenvalues(state_matrix(M, np.zeros_like(D), K)))
    longest = longest_rk4_step(float(rates.max(initial=0.0)), fastest_decay([motion]))
    if not D0.any():
        return longest
    rate = eigenvalues(solve(M, D0)).real.max()  # of friction alone
    low, high = 0.0, min(longest, 2 * RK4_LIMIT / rate)
    if radius(one_step_map("RK4", motion, high, D0)) <= 1 + GROWTH:
        return high
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        stable = radius(one_step_map("RK4", motion, middle, D0)) <= 1 + GROWTH
        low, high = (middle, high) if stable else (low, middle)
    return low


def one_step_map(
    integrator: str, motion: tuple[Array, Array, Array], step: float, at_start: ArrayLike
) -> Array:
    """Return the matrix (2n, 2n) by which a step moves [q, q'] about rest.

    Args:
        integrator, at_start: see `longest_step`. motion: M, D, K (n, n). step: h [s].
    """
    M, D, K = motion
    n, h, D0 = len(M), step, np.asarray(at_start, dtype=float)
    one = np.eye(2 * n)
    if integrator == "RK4":  # the exponential's series to fourth order, forces held to third
        X = h * state_matrix(M, D, K)
        held = np.zeros((2 * n, 2 * n))
        held[n:, n:] = -h * solve(M, D0)
        series = one + product(X / 2, one + product(X / 3, one + X / 4))
        return one + product(X, series) + product(series, held)
    ahead = M + h * D + (h**2 * K if integrator == "discrete" else 0.0)
    rate = solve(ahead, np.hstack([-h * K, M - h * D0]))  # (n, 2n)
    return np.vstack([np.eye(n, 2 * n) + h * rate, rate])


def radius(matrix: Array) -> float:
    """Return the largest |eigenvalue| of a matrix (n, n)."""
    return float(np.abs(eigenvalues(matrix)).max())


def halved(longest: float) -> float:
    """Return 1 ms, halved until it is below the longest step [s].

    Raises:
        ParameterError: that is below SHORTEST_STEP, or the longest is not a number.
    """
    step = LONGEST_STEP
    while step >= longest and step >= SHORTEST_STEP:
        step /= 2
    if not (longest > SHORTEST_STEP and step >= SHORTEST_STEP):
        raise ParameterError(
            f"the robot needs a physics step below {longest:.3g} s, less than the "
            f"{SHORTEST_STEP:g} s that can be simulated; make it less stiff, less damped or heavier"
        )
    return step
