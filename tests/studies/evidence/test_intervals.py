"""Intervals: exact against binomial tables, covering what they should, the same for equal runs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flexsim import ParameterError
from studies.core.evidence.intervals import (
    LEAST_RUNS,
    difference_interval,
    median_interval,
    medians_interval,
    quantile,
    quantile_interval,
    ratio_interval,
    share_interval,
    share_of,
)

REPETITIONS = 400
CHANCE = 4 * math.sqrt(0.05 * 0.95 / REPETITIONS)  # four standard deviations of a coverage
# ranks, counted from 1, of the two-sided 95 % interval of a median: tables of the sign test
SIGN_TABLE = {6: (1, 6), 9: (2, 8), 10: (2, 9), 20: (6, 15), 40: (14, 27), 100: (40, 61)}


@pytest.mark.parametrize(("runs", "ranks"), SIGN_TABLE.items())
def test_median_intervals_are_the_sign_tests(runs: int, ranks: tuple[int, int]) -> None:
    shuffled = np.random.default_rng(1).permutation(runs) + 1.0
    assert median_interval(shuffled) == ranks


def test_too_few_runs_have_no_interval() -> None:
    assert 2 * 0.5**LEAST_RUNS < 0.05 < 2 * 0.5 ** (LEAST_RUNS - 1)
    few = np.arange(LEAST_RUNS - 1.0)
    assert median_interval(few) is None
    assert ratio_interval(few + 1, few + 1, seed=1) is None
    assert quantile_interval(np.arange(10.0), 0.25) is None  # its lower end is below all ten
    assert quantile_interval(np.arange(20.0), 0.25) == (1.0, 9.0)


def test_median_intervals_cover_the_median() -> None:
    rng = np.random.default_rng(2)
    ends = [median_interval(rng.lognormal(size=20)) for _ in range(REPETITIONS)]
    within = np.mean([low <= 1.0 <= high for low, high in ends if high])
    exact = 1 - 2 * sum(math.comb(20, k) for k in range(6)) / 2**20  # 0.959
    assert within == pytest.approx(exact, abs=CHANCE)


def test_a_median_knows_nothing_of_units() -> None:
    sample = np.random.default_rng(3).lognormal(size=31)
    low, high = median_interval(sample) or (0.0, 0.0)
    assert median_interval(8 * sample) == (8 * low, 8 * high)
    assert median_interval(np.log(sample)) == (np.log(low), np.log(high))
    assert median_interval(sample[::-1]) == (low, high)


def test_diverged_runs_are_beyond_all_others() -> None:
    runs = [*range(1, 15), *[math.inf] * 6]  # 30 % of 20
    assert quantile(runs) == 10.5
    assert median_interval(runs) == (6.0, math.inf)  # the 15th diverged
    assert median_interval([*range(1, 16), *[math.inf] * 5]) == (6.0, 15.0)
    assert quantile(runs, 0.75) == math.inf
    assert quantile([1.0, math.inf]) == quantile([math.inf] * 3) == math.inf
    assert quantile([1.0, 2.0, math.inf]) == 2.0


def test_quantiles_are_numpys_where_nothing_diverged() -> None:
    sample = np.random.default_rng(4).normal(size=22)
    for share in (0.25, 0.5, 0.75):
        assert quantile(sample, share) == np.percentile(sample, 100 * share)


@pytest.mark.parametrize(
    ("count", "runs", "low", "high"),
    [  # Newcombe (1998), table I, method 3: Wilson's score without continuity correction
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_shares_are_wilsons(count: int, runs: int, low: float, high: float) -> None:
    assert share_interval(count, runs) == pytest.approx((low, high), abs=5e-5)
    other = share_interval(runs - count, runs)
    assert other == pytest.approx((1 - high, 1 - low), abs=5e-5)


@pytest.mark.parametrize(("count", "runs"), [(-1, 4), (5, 4), (0, 0)])
def test_no_share(count: int, runs: int) -> None:
    with pytest.raises(ParameterError, match="is no share; give a count"):
        share_interval(count, runs)


@pytest.mark.parametrize("wrong", [[], [1.0, math.nan], [[1.0], [2.0]]])
def test_no_sample(wrong: list[float]) -> None:
    with pytest.raises(ParameterError, match="give one number or more"):
        median_interval(wrong)


def test_paired_runs_that_are_proportional_have_an_exact_ratio() -> None:
    """And a ratio that resampling apart could not have."""
    sample = np.random.default_rng(5).lognormal(size=30)
    assert ratio_interval(2 * sample, sample, seed=1) == (2.0, 2.0)
    assert difference_interval(sample, sample, seed=1) == (0.0, 0.0)
    low, high = ratio_interval(2 * sample, sample, seed=1, paired=False) or (2.0, 2.0)
    assert low < 1.9 and 2.1 < high


def test_ratios_and_differences_cover_the_truth() -> None:
    rng, found = np.random.default_rng(6), []
    for seed in range(40):
        common = rng.normal(size=40)
        one, other = (10 + common + 0.3 * rng.normal(size=40) for _ in range(2))
        ratio, apart = (f(1.1 * one, other, seed) for f in (ratio_interval, difference_interval))
        assert ratio is not None and apart is not None
        found.append((ratio[0] <= 1.1 <= ratio[1], apart[0] <= 1.0 <= apart[1]))
        back = ratio_interval(other, 1.1 * one, seed)
        assert back is not None  # the same resamples, turned round
        assert back == pytest.approx((1 / ratio[1], 1 / ratio[0]), rel=1e-3)
    assert (np.mean(found, axis=0) >= 0.85).all()  # 0.95, less three standard deviations of 40


def test_a_bootstrap_is_its_seeds() -> None:
    one, other = np.random.default_rng(7).lognormal(size=(2, 50))
    first = ratio_interval(one, other, seed=1)
    assert first == ratio_interval(one, other, seed=1) != ratio_interval(one, other, seed=2)
    assert ratio_interval(4 * one, 4 * other, seed=1) == first


def test_ratios_of_runs_that_diverge() -> None:
    """An end is open where resamples may have a median that diverged; no digits are made up."""
    ran = np.random.default_rng(8).lognormal(size=20)
    some = np.where(np.arange(20) < 7, math.inf, ran)
    low, high = ratio_interval(some, ran, seed=1) or (0.0, 0.0)
    assert 0 < low < high == math.inf
    assert ratio_interval(np.full(20, math.inf), np.full(20, math.inf), seed=1) is None


def test_pairs_need_each_other() -> None:
    with pytest.raises(ParameterError, match="paired samples have 6 and 7 runs"):
        ratio_interval(np.ones(6), np.ones(7), seed=1)


def test_what_is_made_of_many_medians() -> None:
    """Pairs stay together in any number of samples; without, the mean of two is narrower."""
    one = np.random.default_rng(9).lognormal(size=40)

    def mean(*medians: np.ndarray) -> np.ndarray:
        return np.exp(np.mean(np.log(medians), axis=0))

    four = medians_interval(mean, (one, 2 * one, 4 * one, 8 * one), seed=1)
    alone = medians_interval(mean, (one,), seed=1)
    assert four is not None and alone is not None
    assert four == pytest.approx([8**0.5 * end for end in alone], rel=1e-12)
    apart = medians_interval(mean, (one,) * 4, seed=1, paired=False)
    assert apart is not None and apart[1] - apart[0] < 0.8 * (alone[1] - alone[0])
    assert medians_interval(mean, (one[:5],), seed=1) is None


def test_a_share_by_name() -> None:
    found = share_of("held", [True, False, False, True])
    assert found == {"held": 0.5} | dict(
        zip(("held_low", "held_high"), share_interval(2, 4), strict=True)
    )
