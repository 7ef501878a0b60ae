"""How does a laboratory make v of strains? Linear systems of what is measured, of a nominal beam.

    >>> J = static_estimator("two-bridges", Parameters(), (0.025, 0.25), distance=0.0005)
    >>> F, G, H = kalman_filter(Parameters(), 3, rows, period=1e-3)

`two-bridges` solves for two clamped modes, `one-bridge` takes mode 1 of the first bridge,
`quasi-static` the shape under a force at the tip, of both by least squares. `kalman:n` is the
steady-state filter of n modes, joints free, about rest at a pose: it knows the commands that reach
the motors and both angles and strains, and nothing of friction, lag or the bridges' filter.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from flexsim.arm.beam import load_of, mode_shapes
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.step_limits import SHORTEST_STEP
from flexsim.numerics.types import Array
from flexsim.plants.curvature import curvature_of_modes, on_beam
from flexsim.plants.modes_plant import AssumedModesPlant

READINGS, COMMANDS = 4, 2  # theta1, theta2 and two strains; torques
SINGULAR = 1e-3  # of the product of the rows' lengths: bridges that see the same of both modes
DOUBLINGS, SETTLED = 60, 1e-13  # of the Riccati equation
DIGITS = 10  # of numbers that loops use: LAPACK's last bits are left out
ANGLE_LEAST, STRAIN_LEAST = 1e-6, 1e-8  # [rad], [-] rms that a filter counts with at least


def static_estimator(
    kind: str, parameters: Parameters, places: tuple[float, float], distance: float
) -> Array:
    """Return J (2,) of v = J . strains [m].

    Args:
        kind: two-bridges, one-bridge or quasi-static. parameters: of the nominal beam.
        places: of the bridges, nominal [m]. distance: of the gauges from the neutral axis [m].

    Raises:
        ParameterError: a bridge off the beam, or bridges that tell nothing apart.
    """
    p = parameters
    if kind == "quasi-static":  # v'' = F (L - s)/EI, v = F L^3/(3 EI)
        arm = distance * (p.L - on_beam(places, p.L))
        if not arm.any():
            raise ParameterError(f"both strain bridges are at the tip, {p.L:g} m; move one")
        found: Array = p.L**3 / 3 * arm / np.sum(arm**2)
        return found
    tip = mode_shapes(2, 1.0, 0, load_of(p))
    rows = distance * curvature_of_modes(p, 2, places)  # (2, 2)
    if kind == "one-bridge":
        if abs(rows[0, 0]) <= SINGULAR * 3 * distance / p.L**2:
            raise ParameterError(
                f"the strain bridge at {places[0]:g} m reads nothing of mode 1; move it inwards"
            )
        return np.array([tip[0] / rows[0, 0], 0.0])
    determinant = rows[0, 0] * rows[1, 1] - rows[0, 1] * rows[1, 0]
    sizes = math.hypot(*rows[0]) * math.hypot(*rows[1])
    if not abs(determinant) > SINGULAR * sizes:
        raise ParameterError(
            f"strain bridges at {places[0]:g} m and {places[1]:g} m tell two modes not apart; "
            "move one, as to 0.025 and 0.25 m"
        )
    inverse = np.array([[rows[1, 1], -rows[0, 1]], [-rows[1, 0], rows[0, 0]]]) / determinant
    return np.array([tip[0] * inverse[0, i] + tip[1] * inverse[1, i] for i in range(2)])


class KalmanFilter(NamedTuple):
    """A steady-state Kalman filter, updated by what is read at a sample, n states.

    x = F x + G [theta1, theta2, strain1, strain2, tau1, tau2], these torques those held since the
    sample before; v = H x. F (n, n), G (n, 6), H (n,); innovation (4, 4): covariance of what it did
    not foresee of the readings. A, B, C: of its model over a period, x before x after.
    """

    F: Array
    G: Array
    H: Array
    innovation: Array
    A: Array
    B: Array
    C: Array


def kalman_filter(
    parameters: Parameters,
    modes: int,
    places: ArrayLike,
    distance: float,
    period: float,
    pose: float,
    torque: ArrayLike,
    noise: ArrayLike,
) -> KalmanFilter:
    """Return the filter of a nominal beam.

    Args:
        modes: n of its model. places, distance: as in `static_estimator`. period: [s].
        pose: theta2 of the model [rad]. torque: (2,) rms torques unknown to it, held over a
            period [N m]. noise: (4,) rms of angles [rad] and strains [-].

    Raises:
        ParameterError: a bridge off the beam, or bridges that do not see what moves.

    Source: K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd ed., ch. 11.
    """
    plant = AssumedModesPlant(parameters, modes, SHORTEST_STEP, name="observer")
    linear = plant.linearised(pose)
    n = len(linear.A)
    held = np.zeros((n + COMMANDS, n + COMMANDS))
    held[:n, :n], held[:n, n:] = linear.A, linear.B
    over = expm(held * period)
    A, B = over[:n, :n], over[:n, n:]
    C = np.zeros((READINGS, n))
    C[:2] = linear.C[:2]
    C[2:, : n // 2] = distance * plant.curvature_rows(places)
    rms = np.asarray(noise, dtype=float)
    force = B * np.asarray(torque, dtype=float)
    innovation, gain = _steady(A, force, C / rms[:, None], period)
    gain = gain / rms  # (n, 4)
    left = np.eye(n) - gain @ C
    if not np.abs(np.linalg.eigvals(left @ A)).max() < 1:
        raise ParameterError(
            f"a Kalman filter of {modes} modes with strain bridges at {np.asarray(places)} m has "
            "no steady state; move the bridges, or take fewer modes"
        )
    return KalmanFilter(
        left @ A, np.hstack([gain, left @ B]), linear.C[2], innovation * np.outer(rms, rms), A, B, C
    )


def _steady(A: Array, force: Array, C: Array, period: float) -> tuple[Array, Array]:
    """Return innovations' covariance (4, 4) and gain (n, 4), readings in units of their noise.

    The Riccati equation by doubling, in coordinates of the size of what is read: after k steps it
    is that of 2^k periods. Other than a generalised Schur form it bears angles and strains that are
    known to a millionth.

    Source: E. K.-W. Chu, H.-Y. Fan, W.-W. Lin, C.-S. Wang, Structure-preserving algorithms for
    periodic discrete-time algebraic Riccati equations, Int. J. Control 77 (2004) 767-788.
    """
    n = len(A)
    size = np.repeat([ANGLE_LEAST, ANGLE_LEAST / period], n // 2)
    a, c = (A * size / size[:, None]).T, C * size
    G, P = c.T @ c, (force / size[:, None]) @ (force / size[:, None]).T
    for _ in range(DOUBLINGS):
        through = np.linalg.solve(np.eye(n) + G @ P, np.hstack([a, G]))
        before = P
        P = P + a.T @ P @ through[:, :n]
        G = G + a @ through[:, n:] @ a.T
        a = a @ through[:, :n]
        P, G = (P + P.T) / 2, (G + G.T) / 2
        if np.abs(P - before).max() <= SETTLED * np.abs(P).max():
            break
    else:
        raise ParameterError(
            "the Kalman filter has no steady state: strain bridges do not see what moves; move "
            "them, or take fewer modes"
        )
    innovation: Array = c @ P @ c.T + np.eye(READINGS)
    gain: Array = np.linalg.solve(innovation, c @ P).T * size[:, None]
    return innovation, gain


def shortened(numbers: Array) -> Array:
    """Return numbers to DIGITS of the largest, the same whatever a library's last bits are."""
    most = float(np.abs(numbers).max(initial=0.0))
    if not 0 < most < math.inf:
        return numbers
    scale = 10.0 ** math.floor(math.log10(most))
    rounded: Array = np.round(numbers / scale, DIGITS) * scale
    return rounded
