"""Torques that excite an arm and leave it where it was: shapes over time, without a net push.

>>> shape = shapes("multisine", time, Band(0.5, 12.0), seed=1)      # (K, 2), of amplitude 1

A torque's sum and that of its sums over time are made zero, so that a free joint ends at rest where
it began, but for friction and what the joints do to each other.

Source: Schroeder, IEEE Trans. Information Theory 16 (1970) 85, for the phases of a multisine.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array

KINDS = ("step", "impulse", "chirp", "multisine", "friction-ramp")
PULSE = 0.02  # [s] width of an impulse
RAMPS = 4  # triangles of a friction ramp, each higher than the one before


class Band(NamedTuple):
    """The frequencies that a chirp or multisine has [Hz]."""

    low: float
    high: float


def shapes(kind: str, time: Array, band: Band) -> Array:
    """Return torques (K, 2) over time (K,) whose largest is 1 at either joint.

    Joint 2 has what joint 1 has, a quarter of the time later or between its frequencies, so that
    what either does can be told apart.

    Raises:
        ParameterError: there is no such kind, or the band is none.
    """
    if kind not in KINDS:
        raise ParameterError(f"kind {kind!r} is unknown; choose one of {', '.join(KINDS)}")
    duration = float(time[-1] + time[1] - time[0])
    if not 0 < band.low < band.high < 0.5 / (time[1] - time[0]):
        raise ParameterError(
            f"band is {band.low:g} to {band.high:g} Hz; give two rising frequencies above 0, below "
            "half the sampling rate"
        )
    if kind in ("chirp", "multisine") and duration * (band.high - band.low) < 4:
        raise ParameterError(
            f"{duration:g} s are too short for frequencies from {band.low:g} to {band.high:g} Hz; "
            "give a wider --band or a longer --duration"
        )
    u = time / duration
    if kind == "multisine":
        columns = [multisine(time, duration, band, first) for first in (0, 1)]
    elif kind == "chirp":
        columns = [chirp(time, duration, band), chirp(time, duration, band)[::-1]]
    else:
        made = {"step": steps, "impulse": impulses, "friction-ramp": ramps}[kind]
        width = PULSE / duration
        columns = [made(u, width), made((u * 2) % 1.0, 2 * width)]
    found = np.column_stack([balanced(each) for each in columns])
    return found / np.abs(found).max(axis=0)


def steps(u: Array, width: float) -> Array:
    """Return steps forth, back, back and forth over u from 0 to 1: quarters each."""
    return np.where((u < 0.25) | (u >= 0.75), 1.0, -1.0)


def impulses(u: Array, width: float) -> Array:
    """Return pulses of a width at the beginning of those quarters."""
    return np.where((4 * u) % 1.0 < 4 * width, steps(u, width), 0.0)


def ramps(u: Array, width: float) -> Array:
    """Return triangles forth and back, each of RAMPS higher than the one before."""
    number = np.minimum(np.floor(RAMPS * u), RAMPS - 1)
    phase = RAMPS * u - number
    triangle = 1 - np.abs(4 * (phase % 0.5) - 1)
    return (number + 1) / RAMPS * np.where(phase < 0.5, triangle, -triangle)


def chirp(time: Array, duration: float, band: Band) -> Array:
    """Return a sine whose frequency rises by a constant factor in equal times."""
    rate = math.log(band.high / band.low) / duration
    phase = 2 * math.pi * band.low * np.expm1(rate * time) / rate
    return np.sin(phase)


def multisine(time: Array, duration: float, band: Band, first: int) -> Array:
    """Return a sum of sines with Schroeder's phases: every other line of the band from `first`."""
    lines = np.arange(math.ceil(band.low * duration), math.floor(band.high * duration) + 1)
    lines = lines[first::2]
    number = np.arange(1, len(lines) + 1)
    phases = -math.pi * number * (number - 1) / len(lines)
    weights = 1 / np.sqrt(lines)  # more where the arm is slow, less where the beam rings
    return np.sum(weights * np.cos(2 * math.pi * np.outer(time, lines) / duration + phases), axis=1)


def balanced(column: Array) -> Array:
    """Return a torque (K,) without a net push, and without a net way under it.

    Two smooth pushes that begin and end at zero are taken away, of the sizes that it takes.
    """
    u = (np.arange(len(column)) + 0.5) / len(column)
    pushes = np.column_stack([np.sin(math.pi * u) ** 2, np.sin(2 * math.pi * u)])
    ahead = np.vstack([np.ones(len(u)), 1 - u])  # speed and way at the end
    sizes = np.linalg.solve(ahead @ pushes, ahead @ column)
    return column - pushes @ sizes
