"""Linear quadratic regulator, integral action and Kalman filter, for the sampled arm and its delay.

    A, B, C, D = design([60.0, 60.0, 0.02, 0.0, 0.3, 300.0, 5.0], model)

What is estimated are *deviations*: the arm's state less that of the arm moved rigidly with its
reference. Their angles are -e1 and -e2, their deflection is v, so the filter needs no reference.
It pays for that: a reference that accelerates pushes the deviations, by -E times its acceleration,
which the filter counts as noise, like the friction's torques. Both are assumed white and as large
as one another, of the size that gives the rigid arm's filter the bandwidth `observer`; measurement
noise is the model's: an encoder's rounding, uniform, and v's. Delay is in the model's states, the
torques on their way, which the filter knows without error. Errors are integrated exactly, outside
of the filter.

Minimised is the sum over the samples of

    |e - aim v/(r+L) (0, 1)|^2 + (integral w_j)^2 |integral of e|^2 + |vibration v'/(w_2 (r+L))|^2
        + |torques / (J w^2)|^2

so that a rigid arm has a pole pair at each bandwidth w_j, of damping 1/sqrt(2), and a pole near
-integral w_j. `aim` is what the regulator tracks: 0 the joint, 1 the tip, -1 the mirrored tip.

Source: K. J. Astrom and B. Wittenmark, Computer-Controlled Systems, 3rd ed., Prentice Hall, 1997,
ch. 11, from memory, not checked against the print; choice of weights our own.
"""

from collections.abc import Sequence

import numpy as np

from controllers.knobs import Knob
from controllers.model_based.model import (
    SIGNS,
    LinearModel,
    Space,
    read_knobs,
    shortened,
    solved,
    unit_torques,
    without_unstable_poles,
)
from controllers.model_based.riccati import filter_gain, regulator
from controllers.series import Array

KNOBS = (
    Knob("bandwidth_1", "rad/s", 15.0, 250.0, True),
    Knob("bandwidth_2", "rad/s", 15.0, 250.0, True),
    Knob("integral", "-", 1e-3, 0.3, True),
    Knob("aim", "-", -1.0, 1.0, False),
    Knob("vibration", "-", 0.01, 3.0, True),
    Knob("observer", "rad/s", 80.0, 2000.0, True),
    Knob("v_noise", "-", 1.0, 30.0, True),
)
"""Both joints' bandwidths; integral action as a share of them; share of v/(r+L) in joint 2's error;
weight of the beam's rate; bandwidth of the Kalman filter; noise of v that it counts with, as a
multiple of the model's: the less v is believed, the less the filter leans on the modes' exact
frequencies."""

GAIN_DIGITS = 7
"""Significant digits of the gains, fewer than Riccati equations have on any machine."""


def design(knobs: Sequence[float], model: LinearModel) -> Space:
    """Return (A, B, C, D) from (e1, e2, v) to two torques, of n + 2 states.

    Args:
        knobs: in the order of `KNOBS`. model: of n states, delay included.

    Raises:
        ControllerError: a knob is missing or out of its range, a Riccati equation has no solution
            to working precision, or the controller would be unstable by itself.
    """
    w1, w2, integral, aim, vibration, observer, v_noise = read_knobs(knobs, KNOBS)
    K = shortened(servo_gain(model, (w1, w2), integral, aim, vibration), GAIN_DIGITS)
    M = shortened(observer_gain(model, observer, v_noise), GAIN_DIGITS)
    return without_unstable_poles(compensator(model, K, M), "LQG controller")


def servo_gain(
    model: LinearModel,
    bandwidths: tuple[float, float],
    integral: float,
    aim: float = 0.0,
    vibration: float = 0.0,
) -> Array:
    """Return K (2, n + 2) of u = -K (deviations, integrals of the errors).

    Args: as the knobs of these names.

    Raises:
        ControllerError: the Riccati equation has no solution to working precision.
    """
    seen, over = servo_weights(model, bandwidths, integral, aim, vibration)
    return regulator(*with_integrals(model), seen.T @ seen, over.T @ over)


def servo_weights(
    model: LinearModel,
    bandwidths: tuple[float, float],
    integral: float,
    aim: float,
    vibration: float,
) -> tuple[Array, Array]:
    """Return what is minimised, of the states (5, n + 2) and of the torques (2, 2)."""
    n, w = len(model.A), np.asarray(bandwidths, dtype=float)
    error = -model.C[:2].copy()  # (2, n)
    error[1] -= aim / model.reach * model.C[2]
    rate = model.C[2] @ (model.A - np.eye(n)) / model.period  # (n,), v' over the period to come
    seen = np.zeros((5, n + 2))
    seen[:2, :n], seen[3:, n:] = error, np.diag(integral * w)
    seen[2, :n] = vibration / (w[1] * model.reach) * rate
    return seen, solved(unit_torques(model, bandwidths), np.eye(2))


def with_integrals(model: LinearModel) -> tuple[Array, Array]:
    """Return A (n + 2, n + 2) and B (n + 2, 2) with the integrals of the errors as states, last."""
    n = len(model.A)
    A = np.eye(n + 2)
    A[:n, :n] = model.A
    A[n:, :n] = -model.period * model.C[:2]
    return A, np.vstack([model.B, np.zeros((2, 2))])


def observer_gain(model: LinearModel, observer: float, v_noise: float = 1.0) -> Array:
    """Return M (n, 3), the Kalman filter's gain on what it did not foresee of (-e1, -e2, v).

    Args:
        observer: bandwidth [rad/s]; that of a rigid arm whose angles are measured alone.
        v_noise: factor of the model's noise of v.

    Raises:
        ControllerError: the Riccati equation has no solution to working precision.
    """
    size = observer**2 * model.noise[:2] / np.sqrt(2.0)  # [rad/s2] rms, of either half
    drive = np.hstack([model.B @ (model.J * size), model.E * size])  # (n, 4)
    noise = model.noise * np.array([1.0, 1.0, v_noise])
    return filter_gain(model.A, drive @ drive.T, model.C, np.diag(noise**2))


def compensator(model: LinearModel, K: Array, M: Array) -> Space:
    """Return (A, B, C, D) of a regulator and a filter, n + 2 states: the estimate from the sample
    before, and the integrals.

    Args:
        K: (2, n + 2), see `servo_gain`. M: (n, 3), see `observer_gain`.
    """
    n = len(model.A)
    Kx, Ki = K[:, :n], K[:, n:]
    left, moved = np.eye(n) - M @ model.C, model.A - model.B @ Kx
    A = np.eye(n + 2)
    A[:n, :n], A[:n, n:] = moved @ left, -model.B @ Ki
    B = np.zeros((n + 2, 3))
    B[:n] = moved @ M * SIGNS
    B[n:, :2] = model.period * np.eye(2)
    return A, B, np.hstack([-Kx @ left, -Ki]), -Kx @ M * SIGNS
