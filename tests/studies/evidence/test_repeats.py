"""Repeats: medians, how sure they are, how many runs they take, and which run is shown."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from studies.core.evidence.intervals import median_interval
from studies.core.evidence.repeats import (
    FIRST,
    MOST,
    OTHERS,
    are_enough,
    counts,
    medians,
    middle_run,
    single,
)

MEDIAN_DIGITS = 1e-15  # relative: of the mean of two numbers


def outcome(envelope: float | None, diverged_at: float | None = None) -> dict[str, Any]:
    return dict.fromkeys(OTHERS, envelope) | {
        "envelope": envelope,
        "diverged": diverged_at is not None,
        "diverged_at": diverged_at,
    }


def test_summary_of_known_runs() -> None:
    found = medians([outcome(0.01 * k) for k in (4, 1, 2, 5, 3)])
    assert found.envelope == found.max_v == 0.03
    assert (found.envelope_quartile_1, found.envelope_quartile_3) == (0.02, 0.04)
    assert (found.runs, found.diverged, found.diverged_share) == (5, False, 0.0)
    assert found.diverged_at is found.envelope_low is found.envelope_high is None


def test_every_figure_has_its_interval() -> None:
    found = medians([outcome(float(k)) for k in range(1, 21)])
    assert (found.envelope_low, found.envelope_high) == (6.0, 15.0)
    for name in ("envelope", *OTHERS):
        assert found.interval(name) == (6.0, 15.0)
    assert found.spread["rms_error_quartile_1"] == found.envelope_quartile_1 == 5.75
    assert found.interval("diverged_share") == pytest.approx((0.0, 0.1611), abs=5e-5)


def test_a_diverged_run_is_never_a_success() -> None:
    """It is worse than all others, and the case says that it happened, and when first."""
    found = medians([outcome(0.01), outcome(0.03), outcome(None, 1.5), outcome(0.02)])
    assert found.envelope == pytest.approx(0.025, rel=MEDIAN_DIGITS)
    assert found.diverged is True
    assert (found.diverged_share, found.diverged_at) == (0.25, 1.5)
    half = medians([outcome(0.01), outcome(None, 1.5), outcome(0.03), outcome(None, 0.5)])
    assert half.envelope is half.rms_torque_1 is None
    assert half.envelope_quartile_1 == pytest.approx(0.025, rel=MEDIAN_DIGITS)
    assert half.diverged_at == 0.5
    lost = medians([outcome(None, 0.25)])
    assert lost.envelope is lost.envelope_quartile_1 is lost.max_v is None
    assert lost.diverged_share == 1.0


def test_an_end_beyond_which_runs_diverge_is_open() -> None:
    found = medians([outcome(float(k)) for k in range(1, 15)] + [outcome(None, 1.0)] * 6)
    assert (found.envelope, found.envelope_low, found.envelope_high) == (10.5, 6.0, None)


def test_what_runs_do_not_have_is_none() -> None:
    found = medians([outcome(1.0) | {"growth": None}, outcome(2.0) | {"growth": 3.0}])
    assert found.growth == 3.0 and found.envelope == 1.5
    assert medians([outcome(1.0) | {"growth": None}]).growth is None


def test_one_run_has_no_quartiles() -> None:
    found = single(outcome(0.5))
    assert (found.envelope, found.runs) == (0.5, 1)
    assert found.envelope_quartile_1 is found.envelope_quartile_3 is found.envelope_low is None
    assert set(found.spread.values()) == {None}


def test_doubling() -> None:
    assert list(counts()) == [20, 40, 80, 160, 320]
    assert next(counts()) == FIRST and list(counts())[-1] == MOST
    assert list(counts(7)) == [7]


def test_runs_are_enough_when_the_interval_is_narrow() -> None:
    still = np.full(20, 5e-3)
    spread = np.linspace(-1, 1, 20)  # its 6th and 15th: +-0.47
    assert are_enough(still) and are_enough(still + 1e-4 * spread)
    assert not are_enough(still + 2e-4 * spread)
    assert are_enough(50e-3 + 1e-3 * spread)  # 1 % of the median
    assert not are_enough(still[:5])
    assert not are_enough([*still[:11], *[math.inf] * 9])  # the median may be one that diverged
    assert are_enough([*still[:3], *[math.inf] * 17])  # it surely is


def test_stopping_early_keeps_the_coverage() -> None:
    """Where it costs most, at a spread that 20 to 80 runs are enough for."""
    rng, within, taken = np.random.default_rng(5), [], set()
    for _ in range(150):
        sample = rng.normal(5e-3, 1e-4, MOST)
        runs = next((n for n in counts() if are_enough(sample[:n])), MOST)
        low, high = median_interval(sample[:runs]) or (0.0, 0.0)
        within.append(low <= 5e-3 <= high)
        taken.add(runs)
    assert np.mean(within) > 0.89  # 0.95, less three standard deviations
    assert {20, 40, 80} <= taken


def test_the_run_that_is_shown() -> None:
    envelopes = [0.4, 0.1, 0.3, 0.2]
    assert middle_run([outcome(each) for each in envelopes]) == 3  # the lower of the middle two
    assert middle_run([outcome(each) for each in [*envelopes, 0.25]]) == 4
    lost = [outcome(None, 0.5), outcome(0.2), outcome(None, 2.0), outcome(0.1), outcome(None, 1.0)]
    assert middle_run(lost) == 2  # the last to diverge comes after the two that did not
    assert middle_run(lost[:1]) == 0
