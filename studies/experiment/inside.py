"""Torques scaled until the nominal arm stays inside its bounds under them.

>>> tried = largest(model, shape, amplitudes, bounds, theta, period)
>>> tried.torque, tried.scale
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexsim.errors import DivergenceError, ParameterError
from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array
from studies.identify.records import Record
from studies.identify.simulated import Model

SHRUNK = 0.9  # from one try to the next
TRIES = 60  # to a five hundredth
STILL = 1e-5  # [rad] of a joint that does not move


class Bounds(NamedTuple):
    """Where the arm may go: ranges of the joints' angles [rad], the largest |v| [m]."""

    theta1: tuple[float, float]
    theta2: tuple[float, float]
    v: float


class Tried(NamedTuple):
    """Torques (K, 2) [N m] that keep the arm inside, their share of those asked for, the motion."""

    torque: Array
    scale: float
    motion: Motion


def largest(
    model: Model, asked: Array, bounds: Bounds, theta: tuple[float, float], period: float
) -> Tried:
    """Return the largest share of torques under which the nominal arm stays inside.

    Args:
        asked: (K, 2) [N m]. theta: joint angles at rest at the start [rad].

    Raises:
        ParameterError: it starts outside, leaves under the least of them, or does not move.
    """
    ranges = (bounds.theta1, bounds.theta2)
    for name, angle, (low, high) in zip(("theta1", "theta2"), theta, ranges, strict=True):
        if not low <= angle <= high:
            raise ParameterError(
                f"--{name} {angle:g} rad is not within --{name}-range {low:g} {high:g}; start "
                "inside"
            )
    left = ""
    for attempt in range(TRIES):
        scale = SHRUNK**attempt
        motion = _moved(model, scale * asked, theta, period)
        left = "the arm runs away" if motion is None else outside(motion, bounds)
        if motion is not None and not left:
            _require_moving(motion, scale, asked)
            return Tried(scale * asked, scale, motion)
    raise ParameterError(
        f"no share of these torques keeps the arm inside: at {scale:.2g} of them {left}; give a "
        "shorter --duration, wider ranges or another --kind"
    )


def _moved(model: Model, torque: Array, theta: tuple[float, float], period: float) -> Motion | None:
    nominal = {each.name: each.nominal for each in model.free}
    none = np.zeros(0)
    record = Record("", period, torque, none, (), none)
    try:
        return model.moved(nominal, record, np.array([*theta, 0.0, 0.0]), run=0)
    except DivergenceError:
        return None


def outside(motion: Motion, bounds: Bounds) -> str:
    """Return what of a motion is outside of the bounds, in words, '' if nothing is."""
    for i, (low, high) in enumerate((bounds.theta1, bounds.theta2)):
        angle = motion.joint[:, i]
        if angle.min() < low or angle.max() > high:
            return f"theta{i + 1} runs from {angle.min():.3g} to {angle.max():.3g} rad"
    most = float(np.abs(motion.v).max())
    return f"|v| grows to {1e3 * most:.3g} mm" if most > bounds.v else ""


def _require_moving(motion: Motion, scale: float, asked: Array) -> None:
    """Refuse torques under which no joint moves: friction or a dead zone holds it."""
    if np.ptp(motion.joint, axis=0).max() < STILL:
        first, second = scale * np.abs(asked).max(axis=0)
        raise ParameterError(
            f"nothing moves under torques up to {first:.3g} and {second:.3g} N m: friction or its "
            "dead zone holds the arm; give more --torques, or wider ranges that they may use"
        )
