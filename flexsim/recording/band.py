"""What repeats of a case cover: at every sample the least and the largest of all runs.

>>> band = covered(None, time, tip, v, reference_tip)        # of one batch of runs
>>> band = covered(band, time, other_tip, other_v, reference_tip)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexsim.numerics.types import Array

PATHS = 20  # runs whose paths are kept


@dataclass(frozen=True, eq=False)
class Band:
    """Least and largest values of runs that went on to their end, sample by sample.

    Attributes:
        runs: how many. time: (K,) [s].
        tip: (2, K, 2) least, then largest [m]. v: (2, K) deflection [m]. error: (2, K) distance
            of the tip from its reference at the same time [m].
        paths: (P, K, 2) tips of the first runs, at most PATHS [m].
    """

    runs: int
    time: Array
    tip: Array
    v: Array
    error: Array
    paths: Array


def _ends(values: Array, *before: Array) -> Array:
    """Return least and largest of runs (P, K, ...) and of the ends found before (2, K, ...)."""
    every = np.concatenate([values, *before])
    return np.stack([every.min(axis=0), every.max(axis=0)])


def covered(
    band: Band | None, time: Array, tip: Array, v: Array, reference_tip: Array
) -> Band | None:
    """Return a band widened by more runs; None as long as no run went on to its end.

    Args:
        band: of runs before, None for none. time: (K,) [s].
        tip: (P, K, 2) [m]; v: (P, K) [m]; nan after a divergence. reference_tip: (K, 2) [m].
    """
    whole = np.isfinite(v[:, -1])
    if not whole.any():
        return band
    tip, v = tip[whole], v[whole]
    error = np.hypot(tip[..., 0] - reference_tip[:, 0], tip[..., 1] - reference_tip[:, 1])
    if band is None:
        return Band(len(v), time, _ends(tip), _ends(v), _ends(error), tip[:PATHS].copy())
    return Band(
        band.runs + len(v),
        time,
        _ends(tip, band.tip),
        _ends(v, band.v),
        _ends(error, band.error),
        np.concatenate([band.paths, tip[: PATHS - len(band.paths)]]),
    )
