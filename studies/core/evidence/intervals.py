"""Intervals: of a median by order statistics, of a share by Wilson, of a ratio by bootstrap.

>>> median_interval([4.9, 5.0, 5.1, 5.2, 5.3, 5.4])
(4.9, 5.4)
>>> share_interval(0, 20)
(0.0, 0.161...)
>>> ratio_interval(chain, modes, seed=1)      # of medians of paired runs

A run that diverged is `inf` in a sample: larger than any that did not. So order statistics keep
their meaning as long as the rank that is asked for is a run's that ended; beyond, they are `inf`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import scipy  # its stats package, half a second, is loaded where it is used
from numpy.typing import ArrayLike, NDArray

from flexsim.errors import ParameterError

Array = NDArray[np.float64]
Interval = tuple[float, float]

LEVEL = 0.95  # probability with which an interval has the true value in it
LEAST_RUNS = 6  # the median of fewer lies outside of all of them with more than 1 - LEVEL
RESAMPLES = 4999  # of which the 125th and the 4875th are the ends of 95 %, without interpolation
FEWER, MANY = 499, 20_000  # resamples of more runs than this: their ends are as good
BATCH, BATCH_NUMBERS = 500, 4_000_000  # resamples at a time, and numbers in them: 32 MB


def _sample(values: ArrayLike) -> Array:
    """Return a sample (n,), n at least 1, none of it nan.

    Raises:
        ParameterError: it is not.
    """
    found = np.asarray(values, dtype=float)
    if found.ndim != 1 or not found.size or np.isnan(found).any():
        raise ParameterError(
            f"a sample has shape {found.shape}; give one number or more in a row, inf for a run "
            "that diverged, and no nan"
        )
    return found


def quantile(values: ArrayLike, share: float = 0.5) -> float:
    """Return a quantile, between two runs by interpolation; inf where one of them diverged.

    Args:
        values: (n,), inf where diverged. share: of the runs below it.
    """
    sample = np.sort(_sample(values))
    place = share * (sample.size - 1)
    above = sample[math.ceil(place)]
    if math.isinf(above):
        return float(above)
    known = sample[np.isfinite(sample)]
    padded = np.append(known, np.full(sample.size - known.size, known[-1]))
    return float(np.percentile(padded, 100 * share))


def quantile_interval(
    values: ArrayLike, share: float = 0.5, level: float = LEVEL
) -> Interval | None:
    """Return two order statistics between which a quantile lies; None if the runs are too few.

    Whatever the distribution, at least `level` of such intervals have the true quantile in them:
    the number of runs below it is binomial. An end is inf where that run diverged.

    Args:
        values: (n,), inf where diverged. share: of the runs below the quantile.
    """
    sample = np.sort(_sample(values))
    ranks = _ranks(sample.size, share, level)
    return None if ranks is None else (float(sample[ranks[0]]), float(sample[ranks[1]]))


@lru_cache(maxsize=4096)
def _ranks(runs: int, share: float, level: float) -> tuple[int, int] | None:
    """Return which of sorted runs, counted from 0, are the ends of a quantile's interval."""
    places = np.arange(runs, dtype=float)
    ends = scipy.stats.quantile_test(places, p=share).confidence_interval(level)
    return (
        None if math.isnan(ends.low) or math.isnan(ends.high) else (int(ends.low), int(ends.high))
    )


def median_interval(values: ArrayLike, level: float = LEVEL) -> Interval | None:
    """Return the interval of a median; see `quantile_interval`."""
    return quantile_interval(values, 0.5, level)


def known_ends(ends: Interval | None) -> tuple[float | None, float | None]:
    """Return the ends of an interval, None for one that is open, both where there is none."""
    low, high = ends or (math.inf, math.inf)
    return (low if math.isfinite(low) else None), (high if math.isfinite(high) else None)


def share_interval(count: int, runs: int, level: float = LEVEL) -> Interval:
    """Return Wilson's interval of a share, count of runs.

    Raises:
        ParameterError: count is not from 0 to runs, or there are no runs.
    """
    if not 0 <= count <= runs or runs < 1:
        raise ParameterError(f"{count} of {runs} is no share; give a count from 0 to the runs")
    ends = scipy.stats.binomtest(int(count), int(runs)).proportion_ci(level, method="wilson")
    return float(ends.low), float(ends.high)


def share_of(name: str, held: ArrayLike) -> dict[str, float]:
    """Return a share of runs and its interval by name, `name_low`, `name_high`.

    Args:
        held: (n,) whether each counts, n at least 1.
    """
    each = np.asarray(held, dtype=bool)
    low, high = share_interval(int(each.sum()), each.size)
    return {name: float(each.mean()), f"{name}_low": low, f"{name}_high": high}


def ratio_interval(
    first: ArrayLike, second: ArrayLike, seed: int, paired: bool = True, level: float = LEVEL
) -> Interval | None:
    """Return the interval of median(first) / median(second); see `medians_interval`."""
    return medians_interval(np.divide, (first, second), seed, paired, level)


def difference_interval(
    first: ArrayLike, second: ArrayLike, seed: int, paired: bool = True, level: float = LEVEL
) -> Interval | None:
    """Return the interval of median(first) - median(second); see `medians_interval`."""
    return medians_interval(np.subtract, (first, second), seed, paired, level)


def rms_ratio_interval(
    first: ArrayLike, second: ArrayLike, seed: int, level: float = LEVEL
) -> Interval | None:
    """Return the interval of sqrt(mean(first) / mean(second)), of mean squares run by run."""

    def ratio(one: Array, other: Array) -> Array:
        return np.sqrt(one / other)

    return medians_interval(ratio, (first, second), seed, True, level, np.mean)


def medians_interval(
    of: Callable[..., Array],
    samples: Sequence[ArrayLike],
    seed: int,
    paired: bool = True,
    level: float = LEVEL,
    centre: Callable[..., Array] = np.median,
) -> Interval | None:
    """Return a percentile bootstrap of what is made of samples' medians.

    None for too few runs, or where neither end is known: an end is infinite where resamples'
    medians diverged.

    Args:
        of: from the samples' medians, arrays of one shape, to what is made of them.
        samples: (n,) each, inf where diverged; of one length where paired.
        seed: of the resampling. paired: whether runs i of all belong together, and stay so.
        centre: instead of the median.

    Raises:
        ParameterError: paired samples of different lengths.
    """
    every = [_sample(each) for each in samples]
    sizes = [each.size for each in every]
    if paired and len(set(sizes)) > 1:
        raise ParameterError(
            f"paired samples have {' and '.join(map(str, sizes))} runs; give as many of all"
        )
    if min(sizes) < LEAST_RUNS:
        return None

    resamples = RESAMPLES if max(sizes) <= MANY else FEWER

    def statistic(*drawn: Array, axis: int = -1) -> Array:
        return of(*(centre(each, axis=axis) for each in drawn))

    with warnings.catch_warnings(), np.errstate(divide="ignore", invalid="ignore"):
        # an interval of scipy's own, which we do not use, may have no end
        warnings.simplefilter("ignore", scipy.stats.DegenerateDataWarning)
        drawn = scipy.stats.bootstrap(
            every,
            statistic,
            n_resamples=resamples,
            batch=max(1, min(BATCH, BATCH_NUMBERS // max(sizes))),
            vectorized=True,
            paired=paired,
            method="percentile",
            rng=np.random.default_rng(seed),
        ).bootstrap_distribution
    beyond = max(1, round((1 - level) / 2 * (resamples + 1)))
    unknown = np.isnan(drawn)  # several medians diverged: it may be anything
    low = float(np.sort(np.where(unknown, -math.inf, drawn))[beyond - 1])
    high = float(np.sort(np.where(unknown, math.inf, drawn))[-beyond])
    return None if math.isinf(low) and math.isinf(high) else (low, high)
