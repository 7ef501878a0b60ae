"""Logs as a bench would write them: what `flexsim drive --log measured` writes of a motion.

>>> record = logged(motion, torque, period)
>>> record.signals
('theta1', 'theta2', 'v')
"""

from __future__ import annotations

import numpy as np

from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array
from studies.identify.records import SIGNALS, STRAINS, Record, noise_of
from studies.tools.drive import measured_table
from studies.tools.logs import TORQUES

EXACT = {"theta1": 1e-6, "theta2": 1e-6, "v": 1e-6, "w1": 1e-5, "w2": 1e-5}  # [rad], [m], [rad/s]
EXACT |= dict.fromkeys(STRAINS, 1e-8)  # [-]; nothing is measured better


def logged(motion: Motion, torque: Array, period: float) -> Record:
    """Return a motion's log, a row for every torque (K, 2) [N m]."""
    header, table = measured_table(motion)
    names = header[1 + len(TORQUES) :]
    signals = tuple(name for name in SIGNALS if name in names)
    columns = [table[: len(torque), header.index(name) - 1] for name in signals]
    time = motion.time[: len(torque)]
    return Record("synthetic", period, torque, time, signals, np.column_stack(columns))


def sigmas(record: Record) -> Array:
    """Return the noise (S,) of a record's signals, as an identification sees it."""
    return np.maximum(noise_of(record), [EXACT[name] for name in record.signals])
