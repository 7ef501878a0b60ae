"""How well, and at what cost, does a filter act as a fractional operator?

>>> response_row("tustin", 10, 0.5)["phase_max_deg"]
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from controllers import operator, response_error
from flexsim.loop.control.compiled import filter_sample
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array

ORDERS = (-0.9, -0.5, -0.1, 0.1, 0.5, 0.9)
BAND_HZ = (1.0, 100.0)  # from the trajectories' own frequencies past the third flexible mode
POINTS = 200  # of the band, evenly on a logarithmic scale
TIMED_SAMPLES, TIMED_ROUNDS = 200_000, 5


def band() -> Array:
    """Return the angular frequencies of the band (POINTS,) [rad/s]."""
    return 2 * np.pi * np.geomspace(*BAND_HZ, POINTS)


@dataclass(frozen=True)
class ResponseRow:
    """Errors of D^order against (j omega)^order over the band, and the cost of a sample [ns]."""

    part: str
    realisation: str
    terms: int
    order: float
    magnitude_rms_db: float
    magnitude_max_db: float
    phase_rms_deg: float
    phase_max_deg: float
    cost_ns: float


def response_row(realisation: str, terms: int, order: float, cost_ns: float = 0.0) -> ResponseRow:
    """Return the errors of D^order over the band, rms and largest, beside the cost given."""
    b, a = operator(realisation, order, PERIOD, terms)
    error = response_error(b, a, order, 1.0, band(), PERIOD)
    (db, most_db), (deg, most_deg) = (
        (float(np.sqrt(np.mean(x**2))), float(np.abs(x).max()))
        for x in (error.magnitude_db, error.phase_deg)
    )
    return ResponseRow("response", realisation, terms, order, db, most_db, deg, most_deg, cost_ns)


@jit
def _filtered(b: Array, a: Array, z: Array, x: Array) -> float:
    """Return the sum of a filter's outputs for inputs x."""
    total = 0.0
    for value in x:
        total += filter_sample(b, a, z, value)
    return total


def sample_cost(b: Array, a: Array, rounds: int = TIMED_ROUNDS) -> float:
    """Return the least time [ns] that the compiled loop's filter takes for a sample.

    The loop pads numerator and denominator to one length, so series pay for zeros, too.
    """
    length = max(len(b), len(a))
    padded = [np.concatenate([part, np.zeros(length - len(part))]) for part in (b, a)]
    x = np.random.default_rng(0).standard_normal(TIMED_SAMPLES)
    _filtered(*padded, np.zeros(length), x[:1])  # compiles
    least = np.inf
    for _ in range(rounds):
        start = time.perf_counter()
        _filtered(*padded, np.zeros(length), x)
        least = min(least, time.perf_counter() - start)
    return float(1e9 * least / TIMED_SAMPLES)
