"""A check sample: do runs made in another way belong among the repeats that a figure rests on?

>>> check = check_sample(closed_form, mujoco)         # (320,), (20,) envelopes [m]
>>> check.inside
True

Repeats of MuJoCo's chain are simulated by its equations in closed form, which move as MuJoCo does
to rounding. Where motion is regular, each run of the sample then has the envelope of its repeat.
Where it is chaotic, rounding grows, and the sample is another draw from the same distribution. Its
ranks among the repeats are then those of exchangeable runs, whatever the distribution: how many
lie outside of all repeats, and where the sample's median does, has known odds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from studies.core.evidence.intervals import quantile

SAMPLE = 20  # runs
SAME = 1e-6  # [m] no figure has a digit below
ODDS = 0.01  # of a sample of the same distribution being called outside, by each of the two tests


@dataclass(frozen=True)
class Check:
    """What a check sample found.

    Attributes:
        check_runs: of the sample. check_median: its [m], None where half of it diverged.
        check_difference: the largest from the repeat with the same controller [m], over those of
            which neither diverged; None where there are none.
        check_outside: how many lie outside of all repeats.
        check_inside: whether each is the same as its repeat within SAME, or else the number
            outside and the median's rank are what chance gives in all but ODDS of samples; None
            where there is no sample.
    """

    check_runs: int
    check_median: float | None
    check_difference: float | None
    check_outside: int | None
    check_inside: bool | None


NO_CHECK = Check(0, None, None, None, None)  # of a plant that needs none


def outside_odds(outside: int, runs: int, sample: int) -> float:
    """Return the probability that so many of a sample or more lie outside of all runs.

    Both are draws from one distribution, so that all orders are equally likely: with j of the
    sample outside, split between both ends in j + 1 ways.
    """
    if runs < 2:
        return 1.0
    total = math.comb(runs + sample, sample)
    inside = sum(
        (j + 1) * math.comb(runs + sample - j - 2, sample - j) for j in range(min(outside, sample))
    )
    return 1.0 - inside / total


def rank_odds(below: int, runs: int, sample: int) -> float:
    """Return the probability, two-sided, that so many runs lie below a sample's lower median.

    The number of runs before the j-th of a sample in a random order is negative hypergeometric.
    """
    j = (sample + 1) // 2
    ways = [
        math.comb(j - 1 + r, r) * math.comb(sample - j + runs - r, runs - r)
        for r in range(runs + 1)
    ]
    total = math.comb(runs + sample, sample)
    return min(1.0, 2 * min(sum(ways[: below + 1]), sum(ways[below:])) / total)


def check_sample(repeats: ArrayLike, sample: Sequence[float]) -> Check:
    """Return how a sample lies among repeats, of which the first have the same controllers.

    Args:
        repeats: (n,) envelopes [m], inf where diverged; sample: (m,), m at most n.
    """
    runs, found = np.asarray(repeats, dtype=float), np.asarray(sample, dtype=float)
    same = runs[: len(found)]
    both = np.isfinite(found) & np.isfinite(same)
    apart = np.abs(found[both] - same[both])
    alike = bool(np.array_equal(np.isfinite(found), np.isfinite(same)) and (apart <= SAME).all())
    outside = int(((found < runs.min() - SAME) | (found > runs.max() + SAME)).sum())
    middle = float(np.sort(found)[(len(found) - 1) // 2])
    below = int((runs < middle).sum())
    chance = outside_odds(outside, len(runs), len(found)) >= ODDS
    chance = chance and rank_odds(below, len(runs), len(found)) >= ODDS
    median = quantile(found)
    return Check(
        len(found),
        median if math.isfinite(median) else None,
        float(apart.max()) if apart.size else None,
        outside,
        alike or chance,
    )
