"""Digits: as many as an interval supports, no more and no fewer."""

from __future__ import annotations

import math

import pytest

from studies.core.evidence.digits import decimals, percent, supported, with_interval


@pytest.mark.parametrize(
    ("half", "digits"),
    [(0.03, 2), (0.0096, 2), (0.05, 2), (0.094, 2), (0.096, 1), (0.3, 1), (4.0, 0), (60.0, 0)],
)
def test_the_last_digit_is_the_half_widths_first(half: float, digits: int) -> None:
    assert decimals(7.0 - half, 7.0 + half) == digits
    assert decimals((7.0 - half) / 1e3, (7.0 + half) / 1e3, scale=1e3) == digits


def test_no_more_digits_than_asked_for() -> None:
    assert decimals(1.0, 1.0) == decimals(1.0, 1.0 + 1e-9) == 2
    assert decimals(1.0, 1.0 + 1e-9, most=3) == 3
    assert decimals(None, None) == decimals(1.0, math.inf) == 1  # nothing is known of it


def test_figures_as_text() -> None:
    assert with_interval(5.4137e-3, 5.38e-3, 5.441e-3, scale=1e3) == "5.41 [5.38, 5.44]"
    assert with_interval(13.02, 11.4, 15.1) == "13 [11, 15]"
    assert with_interval(5.26, None, None) == "5.3"
    assert with_interval(5.26, 4.2, None) == "5.3 [4.2, ?]"
    assert with_interval(None, 4.2, None) == "- [4.2, ?]"
    assert with_interval(None, None, None) == "-"
    assert supported(2.81, 2.6, 3.1, sign="+") == "+2.8"
    assert supported(math.inf, 2.6, 3.1) == "-"
    assert percent(0.05, 0.0089, 0.2361) == "5 % [1, 24]"
