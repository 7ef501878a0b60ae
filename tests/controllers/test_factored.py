"""Filters taken apart into sections: the same outputs, or left whole."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from controllers import (
    TUNED,
    ControllerError,
    Filter,
    Sections,
    factored,
    fractional_pid,
    frequency_response,
    operator,
    oustaloup_cascade,
    state_space,
    textbook_pid,
)

T = 1e-3  # [s]
SAME = 1e-10  # of the largest output: what roots of up to ten poles near z = 1 leave of 1e-16
EXACT = 1e-12  # of the largest output: sections run one way or the other
INPUT = np.random.default_rng(1).standard_normal(3000)


def output(sections: Sections) -> np.ndarray:
    total = np.zeros(INPUT.size)
    for cascade in sections.cascades:
        passed = INPUT
        for b, a in cascade:
            passed = signal.lfilter(b, a, passed)
        total = total + passed
    return total


def orders(sections: Sections) -> list[int]:
    return [max(b.size, a.size) - 1 for cascade in sections.cascades for b, a in cascade]


@pytest.mark.parametrize("realisation", ["tustin", "gruenwald-letnikov", "impulse-response"])
@pytest.mark.parametrize("terms", [10, 300])
def test_taps_stay_as_they_are(realisation: str, terms: int) -> None:
    b, a = operator(realisation, -0.5, T, terms)
    found = factored((b, a))
    ((taps, one),) = found.sections.cascades[0]
    assert np.array_equal(taps, b) and np.array_equal(one, a) and found.whole == ()


@pytest.mark.parametrize(
    ("realisation", "terms"),
    [("tustin-fraction", 5), ("tustin-fraction", 8), ("backward-fraction", 5), ("oustaloup", 3)],
)
def test_polynomials_become_sections_of_second_order(realisation: str, terms: int) -> None:
    whole = fractional_pid(TUNED["line"].joint1, T, realisation, terms)
    assert whole[1].size == 2 * terms + 1
    found = factored(whole)
    assert orders(found.sections) == [2] * terms and found.whole == ()
    wanted = signal.lfilter(*whole, INPUT)
    assert np.abs(output(found.sections) - wanted).max() <= SAME * np.abs(wanted).max()


def test_what_cannot_be_taken_apart_stays_whole_to_the_bit() -> None:
    """Poles of a backward difference of ten terms crowd at z = 1; an integrator's is on it."""
    for whole in (
        operator("backward-fraction", 0.5, T, 10),
        operator("oustaloup", -1.3, T, 5),
        (np.ones(3), np.concatenate([[1.0], np.zeros(99), [0.5]])),
    ):
        found = factored(whole)
        ((b, a),) = found.sections.cascades[0]
        assert np.array_equal(a, whole[1]) and np.array_equal(b, np.trim_zeros(whole[0], "b"))
        assert found.whole == (max(b.size, a.size) - 1,)


def test_second_order_is_kept_to_the_bit() -> None:
    whole = textbook_pid(30.0, 200.0, 1.5, T, 2e-3)
    ((b, a),) = factored(whole).sections.cascades[0]
    assert np.array_equal(b, whole[0]) and np.array_equal(a, whole[1])


@pytest.mark.parametrize(
    ("b", "a"),
    [
        ([0.0, 0.0, 1.0, 0.5], [1.0, -0.5, 0.2, 0.1]),  # late by two samples
        ([1.0, 0.3, 0.2, 0.1, 0.7], [1.0, -0.5]),  # more zeros than poles
        ([1.0], [1.0, -0.5, 0.2, 0.1]),  # none
        ([2.0, 1.0, 0.0], [4.0, -2.0, 0.8, 0.4]),  # a[0] is not one
        ([0.0, 0.0], [1.0, -0.5, 0.2, 0.1]),  # nothing
    ],
)
def test_delays_and_gains_are_kept(b: list[float], a: list[float]) -> None:
    found = factored((np.array(b), np.array(a)))
    assert max(orders(found.sections)) <= 2 and found.whole == ()
    wanted = signal.lfilter(b, a, INPUT)
    assert np.abs(output(found.sections) - wanted).max() <= EXACT * max(np.abs(wanted).max(), 1)


def test_sums_of_cascades_are_taken_as_they_are() -> None:
    cascade = oustaloup_cascade(0.5, T, 17, 2.5e-3, 2500.0)
    found = factored(Sections((cascade, ((np.array([3.0]), np.ones(1)),))))
    assert found.whole == () and orders(found.sections) == [1] * 17 + [0]
    for (b, a), (c, d) in zip(cascade, found.sections.cascades[0], strict=True):
        assert np.array_equal(b, c) and np.array_equal(a, d)


@pytest.mark.parametrize(
    "given",
    [
        operator("tustin", 0.3, T, 10),
        fractional_pid(TUNED["circle"].joint2, T, "tustin-fraction", 5),
        Sections((oustaloup_cascade(-0.5, T, 4), ((np.array([3.0, 1.0]), np.ones(1)),))),
    ],
)
def test_the_state_space_is_the_same_system(given: Filter | Sections) -> None:
    sections = factored(given).sections
    space = state_space(sections)
    wanted = output(sections)
    _, out, _ = signal.dlsim((*space, T), INPUT)
    assert np.abs(out[:, 0] - wanted).max() <= EXACT * np.abs(wanted).max()
    omega = np.array([1.0, 100.0, 2000.0])
    A, B, C, D = space
    z = np.exp(1j * omega * T)
    direct = [(C @ np.linalg.solve(each * np.eye(len(A)) - A, B) + D)[0, 0] for each in z]
    if isinstance(given, Sections):
        assert np.allclose(direct, given.response(omega, T), rtol=1e-9)
    else:
        assert np.allclose(direct, frequency_response(*given, omega, T), rtol=1e-9)


@pytest.mark.parametrize(
    ("b", "a"), [([1.0], [0.0, 1.0]), ([np.nan], [1.0]), ([], [1.0]), ([1.0], [1.0, np.inf])]
)
def test_what_is_no_filter_is_refused(b: list[float], a: list[float]) -> None:
    with pytest.raises(ControllerError, match=r"coefficients|a\[0\]"):
        factored((np.array(b), np.array(a)))
