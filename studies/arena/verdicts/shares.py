"""Of a full factorial of scores: which share of the variance is whose, with intervals.

>>> shares(scores, ("order", "structure", "reference", "plant", "trajectory"), seed=1)[0].factor

Balanced analysis of variance: a factor's share is the variance of the means over all else, that of
`interactions` what is left between the cells, and that of the tuning's seed what is left within
them. Intervals draw searches anew, each with all that its controller ran on.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array
from studies.arena.rows import ShareRow
from studies.core.evidence.intervals import LEVEL

RESAMPLES = 999
INTERACTIONS, SEED = "interactions", "tuning seed"


def within_tasks(scores: Array) -> Array:
    """Return scores less the mean of their task, which is the last axis but one, of the seeds.

    How hard a task is says nothing of who solves it.
    """
    others = tuple(k for k in range(scores.ndim) if k != scores.ndim - 2)
    return scores - scores.mean(axis=others, keepdims=True)


def variance_shares(scores: Array) -> Array:
    """Return the shares (F + 2,) of F factors, of interactions, and of seeds; they add up to 1.

    Args:
        scores: F axes of the factors, and a last one of the seeds. Without variance all are 0.
    """
    total = float(np.var(scores))
    if total == 0.0:
        return np.zeros(scores.ndim + 1)
    cells = scores.mean(axis=-1)
    factors = range(cells.ndim)
    mains = [np.var(cells.mean(axis=tuple(k for k in factors if k != j))) for j in factors]
    between = float(np.var(cells))
    return np.array([*mains, between - sum(mains), total - between]) / total


def shares(
    scores: Array, factors: Sequence[str], seed: int, searched: int, of: str = ""
) -> list[ShareRow]:
    """Return every factor's share, the largest first, then interactions and seeds.

    Args:
        scores: (L_1, ..., L_F, seeds). factors: names of the first F axes, '' of those that are
            left out of the rows, as without a share.
        searched: how many of them have searches of their own; the others share one search's
            controller. of: whose variance, for the rows.

    Raises:
        ParameterError: there are not as many names as axes.
    """
    if scores.ndim != len(factors) + 1:
        raise ParameterError(f"{len(factors)} factors of {scores.ndim} axes; give one for each")
    rng = np.random.default_rng(seed)
    cells, runs = scores.shape[:-1], scores.shape[-1]
    own_cells = (*cells[:searched], *(1,) * (len(cells) - searched))
    drawn = np.empty((RESAMPLES, len(factors) + 2))
    for i in range(RESAMPLES):
        picks = rng.integers(0, runs, size=(*own_cells, runs))
        all_picks = np.broadcast_to(picks, scores.shape)
        drawn[i] = variance_shares(np.take_along_axis(scores, all_picks, axis=-1))
    drawn.sort(axis=0)
    beyond = max(1, round((1 - LEVEL) / 2 * (RESAMPLES + 1)))
    own = variance_shares(scores)
    drawn += own - drawn.mean(axis=0)  # fewer different seeds in a draw: less variance of theirs
    drawn = drawn.clip(0.0, 1.0)
    names = [*factors, INTERACTIONS, SEED]
    levels = [*cells, int(np.prod(cells)), runs]
    rows = [
        ShareRow(of, *each, *map(float, ends))
        for *each, ends in zip(
            names,
            levels,
            map(float, own),
            zip(drawn[beyond - 1], drawn[-beyond], strict=True),
            strict=True,
        )
    ]
    mains = sorted((row for row in rows[: len(factors)] if row.factor), key=lambda r: -r.share)
    return list(chain(mains, rows[len(factors) :]))
