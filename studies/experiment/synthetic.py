"""Logs as a bench would write them: a motion, its angles in counts, noise on v."""

from __future__ import annotations

import math

import numpy as np

from flexsim.loop.hardware import Hardware
from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array
from studies.identify.records import NEEDED, Record

EXACT = (1e-6, 1e-6)  # [rad], [m] noise of hardware that has none: nothing is measured better


def quanta(bench: Hardware) -> Array:
    """Return the angles (2,) of a count at the joints [rad], 0 for exact."""
    gear = np.array(bench.sensing.gear)
    return 2 * math.pi / (bench.counts * gear) if bench.counts else np.zeros(2)


def sigmas(bench: Hardware) -> Array:
    """Return the noise (3,) of theta1, theta2 [rad] and v [m]: of a count, that over sqrt(12)."""
    angles = np.maximum(quanta(bench) / math.sqrt(12), EXACT[0])
    return np.array([*angles, max(bench.noise_v, EXACT[1])])


def logged(
    motion: Motion, torque: Array, period: float, bench: Hardware, rng: np.random.Generator
) -> Record:
    """Return a motion's log (K rows): rounded to counts, noise on v."""
    rows = len(torque)
    values = np.column_stack([motion.joint, motion.v])[:rows]
    for i, count in enumerate(quanta(bench)):
        if count:
            values[:, i] = count * np.floor(values[:, i] / count + 0.5)
    values[:, 2] += bench.noise_v * rng.standard_normal(rows)
    return Record("synthetic", period, torque, motion.time[:rows], NEEDED, values)
