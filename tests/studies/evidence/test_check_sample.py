"""Check samples: inside where they are the same or of the same distribution, else not."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from studies.core.evidence.check_sample import ODDS, SAME, check_sample, outside_odds, rank_odds

MANY = 400
EXACT = 1e-12  # rounding of sums of a few dozen terms


@pytest.mark.parametrize(("runs", "sample"), [(4, 3), (5, 2), (2, 4)])
def test_odds_are_those_of_equally_likely_orders(runs: int, sample: int) -> None:
    places = list(itertools.combinations(range(runs + sample), sample))
    outside, below = [], []
    for mine in places:
        theirs = sorted(set(range(runs + sample)) - set(mine))
        outside.append(sum(each < theirs[0] or each > theirs[-1] for each in mine))
        below.append(sum(each < mine[(sample - 1) // 2] for each in theirs))
    for k in range(sample + 1):
        share = np.mean([each >= k for each in outside])
        assert outside_odds(k, runs, sample) == pytest.approx(share, abs=EXACT)
    for k in range(runs + 1):
        tails = np.mean([b <= k for b in below]), np.mean([b >= k for b in below])
        assert rank_odds(k, runs, sample) == pytest.approx(min(1.0, 2 * min(tails)), abs=EXACT)


def test_the_same_runs_are_inside() -> None:
    repeats = np.random.default_rng(1).normal(5e-3, 1e-4, 40)
    found = check_sample(repeats, repeats[:20] + SAME / 2)
    assert found.check_inside and found.check_outside == 0
    assert found.check_difference == pytest.approx(SAME / 2, rel=1e-6)
    assert found.check_median == pytest.approx(np.median(repeats[:20]) + SAME / 2)


def test_another_draw_is_inside_in_all_but_the_odds() -> None:
    rng = np.random.default_rng(2)
    called = [
        not check_sample(*np.split(rng.lognormal(size=100), [80])).check_inside for _ in range(MANY)
    ]
    most = 2 * ODDS * MANY  # by either test
    assert 0 < sum(called) <= most + 3 * math.sqrt(most)


@pytest.mark.parametrize("change", ["shifted", "wider", "diverges", "one of many repeats"])
def test_another_distribution_is_outside(change: str) -> None:
    repeats = np.random.default_rng(3).normal(5.0, 0.1, 160)
    other = np.random.default_rng(4).normal(5.0, 0.1, 20)
    made = {
        "shifted": other + 0.1,
        "wider": 5 + 8 * (other - 5),
        "diverges": np.where(np.arange(20) < 5, math.inf, other),
        "one of many repeats": np.full(20, repeats.max()),
    }[change]
    found = check_sample(repeats, made)
    assert not found.check_inside
    assert check_sample(repeats, other).check_inside
    assert (found.check_outside > 2) is (change in ("wider", "diverges"))


def test_small_samples_say_nothing_against() -> None:
    assert check_sample([1.0, 1.0], [3.0, 3.0]).check_inside
    lost = check_sample([math.inf] * 20, [math.inf] * 20)
    assert lost.check_inside and lost.check_difference is None and lost.check_median is None
    assert lost.check_outside == 0
