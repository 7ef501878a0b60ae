"""What repeats of a case cover: at every sample the least and the largest of all runs.

>>> band = covered(None, time, tip, v, torque, reference_tip)        # of one batch of runs
>>> band = covered(band, time, other_tip, other_v, other_torque, reference_tip)
>>> pairs = pair_band(time, differences, reference_tip)              # of two plants' runs
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from flexsim.loop.metrics import along_across, tangents
from flexsim.numerics.types import Array

PATHS = 20  # runs whose paths are kept
QUANTILES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of pairs


@dataclass(frozen=True, eq=False)
class Band:
    """Least and largest values of runs that went on to their end, sample by sample.

    Attributes:
        runs: how many. time: (K,) [s].
        tip: (2, K, 2) least, then largest [m]. v: (2, K) deflection [m]. error: (2, K) distance
            of the tip from its reference at the same time [m]; along, across: (2, K) its parts,
            see `flexsim.loop.metrics`. torque: (2, K, 2) as commanded [N m].
        paths: (P, K, 2) tips of the first runs, at most PATHS [m].
    """

    runs: int
    time: Array
    tip: Array
    v: Array
    error: Array
    along: Array
    across: Array
    torque: Array
    paths: Array


ENDS = tuple(item.name for item in fields(Band) if item.name not in ("runs", "time", "paths"))


def _ends(values: Array, *before: Array) -> Array:
    """Return least and largest of runs (P, K, ...) and of the ends found before (2, K, ...)."""
    every = np.concatenate([values, *before])
    return np.stack([every.min(axis=0), every.max(axis=0)])


def covered(
    band: Band | None, time: Array, tip: Array, v: Array, torque: Array, reference_tip: Array
) -> Band | None:
    """Return a band widened by more runs; None as long as no run went on to its end.

    Args:
        band: of runs before, None for none. time: (K,) [s].
        tip: (P, K, 2) [m]; v: (P, K) [m]; torque: (P, K, 2) [N m]; nan after a divergence.
        reference_tip: (K, 2) [m].
    """
    whole = np.isfinite(v[:, -1])
    if not whole.any():
        return band
    tip = tip[whole]
    apart = tip - reference_tip
    along, across = along_across(apart, tangents(reference_tip))
    values = {
        "tip": tip,
        "v": v[whole],
        "error": np.hypot(apart[..., 0], apart[..., 1]),
        "along": along,
        "across": across,
        "torque": torque[whole],
    }
    if band is None:
        ends = {name: _ends(values[name]) for name in ENDS}
        return Band(len(tip), time, **ends, paths=tip[:PATHS].copy())
    ends = {name: _ends(values[name], getattr(band, name)) for name in ENDS}
    paths = np.concatenate([band.paths, tip[: PATHS - len(band.paths)]])
    return Band(band.runs + len(tip), time, **ends, paths=paths)


@dataclass(frozen=True, eq=False)
class PairBand:
    """How far apart two plants' tips are in pairs of runs with the same gains and noise.

    Attributes:
        runs: pairs that both went on to their end. time: (K,) [s].
        along, across: (5, K) least, quartiles with the median between them, and largest at each
            sample, of the second plant's tip minus the first's, along and across the path [m].
    """

    runs: int
    time: Array
    along: Array
    across: Array


def pair_band(time: Array, differences: Array, reference_tip: Array) -> PairBand | None:
    """Return what pairs of runs cover; None without any.

    Args:
        time: (K,) [s]. differences: (P, K, 2) of the tips [m]. reference_tip: (K, 2) [m].
    """
    if not len(differences):
        return None
    parts = along_across(differences, tangents(reference_tip))
    along, across = (np.quantile(each, QUANTILES, axis=0) for each in parts)
    return PairBand(len(differences), time, along, across)
