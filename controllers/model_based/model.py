"""The linear model that designs are made on, and what all of them need.

    model = LinearModel(*model_of(plant, theta2=1.2, hardware=bench))    # flexsim.linear
    controller = lqg.design([60.0, 60.0, 0.05, 0.0, 0.1, 200.0, 5.0], model)

A model is of small motions about rest at a pose. Designs read knobs, scaled numbers in stated
ranges, and give state spaces (A, B, C, D) from (e1, e2, v) to two torques: e the joints' reference
less their angles [rad], v the tip's deflection [m] as it is measured, not an error.
"""

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from controllers.errors import ControllerError, check_finite
from controllers.knobs import Knob
from controllers.series import Array

Space: TypeAlias = tuple[Array, Array, Array, Array]

DIGITS = 10
"""Significant digits of designed coefficients: linear algebra's last bits are left out."""
OUTSIDE = 1e-9
"""By how much a pole may lie outside of the unit circle and still count as on it."""
SIGNS = np.array([-1.0, -1.0, 1.0])
"""From (theta1, theta2, v) to (e1, e2, v) with the references at zero."""


class LinearModel(NamedTuple):
    """A sampled arm: x of the next sample is A x + B u, (theta1, theta2, v) is C x; n states."""

    A: Array
    """(n, n), over one period with the torques held."""
    B: Array
    """(n, 2) from the commanded torques [N m]."""
    C: Array
    """(3, n) to both joints' angles [rad] and the tip's deflection v [m]."""
    period: float
    """[s]"""
    reach: float
    """r + L [m]."""
    J: Array
    """(2, 2) inertia of the arm with its beam rigid, from accelerations to torques [kg m2]."""
    E: Array
    """(n, 2) what a period of each joint's unit acceleration, of the whole arm rigidly, adds to the
    states; less that is what a reference that accelerates does to deviations from it."""
    noise: Array
    """(3,) rms of what theta1, theta2 [rad] and v [m] are measured off by, all above zero."""


def delayed(model: LinearModel, samples: int) -> LinearModel:
    """Return a model whose torques arrive whole samples later; the waiting ones are states, last.

    Raises:
        ControllerError: samples is no whole number, 0 or more.
    """
    if isinstance(samples, bool) or not isinstance(samples, int) or samples < 0:
        raise ControllerError(f"samples must be a whole number, 0 or more, got {samples!r}")
    for _ in range(samples):  # x' = A x + B w, w' = u
        n = len(model.A)
        A = np.zeros((n + 2, n + 2))
        A[:n, :n], A[:n, n:] = model.A, model.B
        B = np.vstack([np.zeros((n, 2)), np.eye(2)])
        C, E = np.pad(model.C, ((0, 0), (0, 2))), np.pad(model.E, ((0, 2), (0, 0)))
        model = model._replace(A=A, B=B, C=C, E=E)
    return model


def read_knobs(values: Sequence[float], knobs: tuple[Knob, ...]) -> list[float]:
    """Return the values of knobs, checked.

    Raises:
        ControllerError: as many as there are knobs are not given, or one is out of its range.
    """
    given = np.asarray(values, dtype=float).ravel()
    if given.size != len(knobs):
        names = ", ".join(knob.name for knob in knobs)
        raise ControllerError(f"{given.size} knobs are given; give {len(knobs)}: {names}")
    found = [
        check_finite(knob.name, value) for knob, value in zip(knobs, given.tolist(), strict=True)
    ]
    for knob, value in zip(knobs, found, strict=True):
        if not knob.low <= value <= knob.high:
            raise ControllerError(
                f"{knob.name} is {value:g} {knob.unit}; give {knob.low:g} to {knob.high:g}"
            )
    return found


def middle(knobs: tuple[Knob, ...]) -> list[float]:
    """Return the middle of each knob's range, the geometric one of those drawn by logarithm."""
    return [(k.low * k.high) ** 0.5 if k.log else (k.low + k.high) / 2 for k in knobs]


def unit_torques(model: LinearModel, bandwidths: Sequence[float]) -> Array:
    """Return the torques (2, 2) [N m/rad] that turn the rigid arm by angles in its bandwidths.

    J Omega^2: each column accelerates one joint alone by its bandwidth squared.

    Args:
        bandwidths: of both joints [rad/s].
    """
    scaled: Array = model.J * np.square(np.asarray(bandwidths, dtype=float))
    return scaled


def solved(A: Array, right: Array) -> Array:
    """Return the solution of A x = right, an array of double precision."""
    return np.asarray(np.linalg.solve(A, right), dtype=np.float64)


def spectral_radius(A: Array) -> float:
    """Return the largest modulus of an eigenvalue, 0 without states."""
    return float(np.abs(np.linalg.eigvals(A)).max(initial=0.0))


def closed_loop(controller: Space, model: LinearModel) -> Array:
    """Return the matrix (n + c, n + c) of a controller's loop around a model, references zero."""
    F, G, H, D = controller
    C = SIGNS[:, None] * model.C
    return np.block([[model.A + model.B @ D @ C, model.B @ H], [G @ C, F]])


def without_unstable_poles(controller: Space, name: str) -> Space:
    """Return a controller, rounded, known to have no poles outside of the unit circle.

    Raises:
        ControllerError: it has, or a number is not finite.
    """
    A, B, C, D = (shortened(part) for part in controller)
    if not all(np.isfinite(part).all() for part in (A, B, C, D)):
        raise ControllerError(f"the {name} of these knobs overflows; choose lower bandwidths")
    radius = spectral_radius(A)
    if radius > 1.0 + OUTSIDE:
        raise ControllerError(
            f"the {name} of these knobs is unstable by itself, with a pole of modulus "
            f"{radius:.6g}; choose lower bandwidths"
        )
    return A, B, C, D


def shortened(numbers: Array, digits: int = DIGITS) -> Array:
    """Return numbers to so many significant digits each, what is not finite as it is."""
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.floor(np.log10(np.abs(numbers)))
    known = np.isfinite(size)
    scale = 10.0 ** (digits - 1 - np.where(known, size, 0.0))
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(np.where(known, np.round(numbers * scale) / scale, numbers))
