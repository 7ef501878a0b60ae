"""Scores of runs and what is said of many: interquartile means, profiles, chances to be better.

>>> scores = decades(index, still)                 # (K,), 0 where diverged
>>> interquartile_mean(scores)
>>> improvement(first, second)                     # chance that a run of the first is better

A score is how many decades the index (5) lies below that of an arm that stands still where the
reference starts; a run that diverged, or that is no better, has 0. Scores are sorted by task, a
trajectory, by seed, a search, and by repeat: (T, S, R).

Intervals are percentiles of a bootstrap that draws searches anew, each with all of its tasks, since
one search's controller runs on all of them, and then repeats within task and search. Repeats differ
by a fourth digit: counted as runs of their own they would make intervals too short by their root.

Source: R. Agarwal et al., Deep reinforcement learning at the edge of the statistical precipice,
NeurIPS 2021: interquartile means, bootstrap by task, probability of improvement, profiles. Theirs
trains anew for every task, and so draws each task's runs by themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array
from studies.core.evidence.intervals import LEVEL

AT_ONCE = 200  # resamples: some megabytes of pairs
RESAMPLES = 1999  # of which the 50th and the 1950th are the ends of 95 %
QUARTER = 0.25  # of the scores left out at either end


class Estimate(NamedTuple):
    """A number with its interval."""

    value: float
    low: float
    high: float


def decades(index: ArrayLike, still: ArrayLike) -> Array:
    """Return the scores of indices [m2 s], 0 where diverged (not finite).

    Args:
        index: of any shape. still: of an arm that stands still, broadcast to it.
    """
    found, most = np.broadcast_arrays(np.asarray(index, float), np.asarray(still, float))
    held = np.isfinite(found) & (found > 0)
    below = np.zeros(found.shape)
    below[held] = np.log10(most[held] / found[held])
    return np.maximum(below, 0.0)


def interquartile_mean(scores: ArrayLike) -> Any:
    """Return the mean of the middle half of scores (..., T, S, R), over the last three axes."""
    found = np.asarray(scores, dtype=float)
    flat = np.sort(found.reshape(*found.shape[:-3], -1), axis=-1)
    cut = int(QUARTER * flat.shape[-1])
    return flat[..., cut : flat.shape[-1] - cut].mean(axis=-1)


def improvement(first: ArrayLike, second: ArrayLike) -> Any:
    """Return the chance that a run of the first scores more than one of the second, ties halved.

    Args:
        first, second: (..., T, S, R) each; the mean over tasks, within which alone is compared.
    """
    one, other = (_by_task(each) for each in (first, second))
    more = one[..., :, :, None] - other[..., :, None, :]
    return np.mean((more > 0) + 0.5 * (more == 0), axis=(-3, -2, -1))


def _by_task(scores: ArrayLike) -> Array:
    found = np.asarray(scores, dtype=float)
    return found.reshape(*found.shape[:-2], -1)


def difference(first: ArrayLike, second: ArrayLike) -> Any:
    """Return the difference of two interquartile means; arguments as of `improvement`."""
    return interquartile_mean(first) - interquartile_mean(second)


def profile(scores: ArrayLike, levels: ArrayLike) -> Array:
    """Return the share of runs (L,) that score more than each level (L,)."""
    found = np.sort(np.asarray(scores, dtype=float).ravel())
    return 1.0 - np.searchsorted(found, np.asarray(levels, float), side="right") / found.size


def estimated(
    of: Callable[..., Any],
    samples: Sequence[ArrayLike],
    seed: int,
    paired: bool = False,
    resamples: int = RESAMPLES,
) -> Estimate:
    """Return a statistic of samples with its interval, by a bootstrap of searches and repeats.

    Args:
        of: from samples (..., T, S, R) each to numbers (...).
        samples: (T, S, R) by task, search and repeat.
        seed: of the draws. paired: whether search i of all samples is the same one, and stays so.

    Raises:
        ParameterError: a sample has no runs, or paired ones have different numbers of them.
    """
    every = [np.asarray(each, dtype=float) for each in samples]
    if any(each.ndim != 3 or not each.size for each in every):
        raise ParameterError(
            "scores are given by task, search and repeat; give one or more of each"
        )
    if paired and len({each.shape for each in every}) > 1:
        raise ParameterError("paired scores need as many runs of each; give as many")
    rng = np.random.default_rng(seed)
    drawn = np.empty(resamples)
    for start in range(0, resamples, AT_ONCE):
        count = min(AT_ONCE, resamples - start)
        redrawn: list[Array] = []
        for each in every:
            if not redrawn or not paired:
                tasks, searches, repeats = each.shape
                chosen = rng.integers(0, searches, size=(count, 1, searches, 1))
                again = rng.integers(0, repeats, size=(count, *each.shape))
            redrawn.append(each[np.arange(tasks)[:, None, None], chosen, again])
        drawn[start : start + count] = of(*redrawn)
    drawn.sort()
    beyond = max(1, round((1 - LEVEL) / 2 * (resamples + 1)))
    return Estimate(float(of(*every)), float(drawn[beyond - 1]), float(drawn[-beyond]))
