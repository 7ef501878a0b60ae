"""PID controllers, fractional and integer, as single filters."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from controllers import (
    REALISATIONS,
    Controller,
    ControllerError,
    Gains,
    fractional_pid,
    frequency_response,
    gruenwald_letnikov,
    integer_pid,
    operator,
    parallel,
    textbook_pid,
    tustin,
)

T = 1e-3
"""The paper's sampling period [s]."""
ROUNDING = 1e-12
"""Relative; some tens of operations in double precision."""
COMMON_DENOMINATOR = 1e-3
"""What `parallel` itself promises when it multiplies denominators out."""
SUM_OF_STEPS = 1e-10
"""Relative; a running sum of a thousand rounded products."""

OMEGA = np.geomspace(1.0, 3000.0, 30)
"""[rad/s]"""
GAINS = Gains(k1=100.0, nu1=0.6, k2=20.0, nu2=-0.7, k3=3.0)

gain = st.floats(-1e4, 1e4)
order = st.floats(-3.0, 3.0)


# The fractional PID ---------------------------------------------------------


@given(k1=gain, nu1=order, k2=gain, nu2=order, k3=gain)
def test_series_add_tap_by_tap(k1: float, nu1: float, k2: float, nu2: float, k3: float) -> None:
    b, a = fractional_pid(Gains(k1, nu1, k2, nu2, k3), T)
    wanted = k1 * tustin(nu1, T, 10)[0] + k2 * tustin(nu2, T, 10)[0]
    wanted[0] += k3
    assert np.array_equal(a, [1.0])
    padded = np.zeros(11)
    padded[: b.size] = b
    scale = np.abs(wanted).max() + abs(k3)
    np.testing.assert_allclose(padded, wanted, rtol=ROUNDING, atol=ROUNDING * scale)


@pytest.mark.parametrize("realisation", REALISATIONS)
def test_one_filter_responds_as_the_sum_of_its_parts(realisation: str) -> None:
    b, a = fractional_pid(GAINS, T, realisation, terms=4)
    wanted = GAINS.k3 + sum(
        k * frequency_response(*operator(realisation, nu, T, 4), OMEGA, T)
        for k, nu in ((100.0, 0.6), (20.0, -0.7))
    )
    got = frequency_response(b, a, OMEGA, T)
    np.testing.assert_allclose(got, wanted, rtol=COMMON_DENOMINATOR)
    assert a[0] == 1.0


@pytest.mark.parametrize("unread", [None, math.nan, 0.0])
def test_a_term_of_gain_zero_is_skipped(unread: float | None) -> None:
    b, a = fractional_pid(Gains(0.0, unread, 2.0, 0.5, 1.0), T)
    wanted = 2.0 * tustin(0.5, T, 10)[0]
    wanted[0] += 1.0
    np.testing.assert_allclose(b, wanted, rtol=ROUNDING)
    b, a = fractional_pid(Gains(0.0, unread, 0.0, unread, 5.0), T, "oustaloup")
    assert np.array_equal(b, [5.0])
    assert np.array_equal(a, [1.0])


@pytest.mark.parametrize(
    ("gains", "words"),
    [
        (Gains(1.0, None, 0.0, None, 0.0), "nu1 is missing though k1 = 1"),
        (Gains(0.0, None, 2.0, math.nan, 0.0), "nu2 must be a finite number, got nan"),
        (Gains(math.inf, 0.5, 0.0, None, 0.0), "k1 must be a finite number"),
        (Gains(1e308, 1.0, 0.0, None, 0.0), "k1 = 1e\\+308 times D\\^1 overflows"),
        (Gains(1.0, 0.5, 0.0, None, math.nan), "k3 must be a finite number"),
    ],
)
def test_errors_name_the_number(gains: Gains, words: str) -> None:
    with pytest.raises(ControllerError, match=words):
        fractional_pid(gains, T)


def test_period_is_checked_even_without_operators() -> None:
    with pytest.raises(ControllerError, match="period must be above zero"):
        fractional_pid(Gains(0.0, None, 0.0, None, 1.0), 0.0)


def test_unknown_realisation() -> None:
    with pytest.raises(ControllerError, match="available: tustin, "):
        fractional_pid(GAINS, T, "tusting")


def test_too_many_poles_for_one_polynomial_is_an_error() -> None:
    """Not a filter that is silently something else."""
    with pytest.raises(ControllerError, match="10 and 10 poles"):
        fractional_pid(GAINS, T, "oustaloup", terms=10)


def test_controller_builds_both_joints() -> None:
    other = Gains(7.0, -0.5, 0.0, None, 0.0)
    controller = Controller("mine", GAINS, other, "a test")
    first, second = controller.filters(T, "gruenwald-letnikov", terms=3)
    assert np.array_equal(first[0], fractional_pid(GAINS, T, "gruenwald-letnikov", 3)[0])
    np.testing.assert_allclose(second[0], 7.0 * gruenwald_letnikov(-0.5, T, 3)[0], rtol=ROUNDING)


# Sums of filters ------------------------------------------------------------


def test_parallel_keeps_a_shared_denominator() -> None:
    pole = np.array([1.0, -0.5])
    b, a = parallel((np.ones(1), pole), (np.ones(3), pole.copy()))
    assert np.array_equal(b, [2.0, 1.0, 1.0])
    assert np.array_equal(a, [1.0, -0.5])


@given(p=st.floats(-0.9, 0.9), q=st.floats(-0.9, 0.9))
def test_parallel_adds_impulse_responses(p: float, q: float) -> None:
    one, two = (np.array([1.0]), np.array([1.0, -p])), (np.array([2.0, 1.0]), np.array([1.0, -q]))
    impulse = np.eye(1, 30)[0]
    got = lfilter(*parallel(one, two), impulse)
    wanted = lfilter(*one, impulse) + lfilter(*two, impulse)
    np.testing.assert_allclose(got, wanted, atol=1e2 * ROUNDING)


# The integer PIDs -----------------------------------------------------------


def test_integer_pid_is_equation_2_at_orders_1_and_minus_1() -> None:
    b, a = integer_pid(kd=0.5, ki=40.0, kp=3.0, period=T, terms=4)
    derivative = 0.5 * 2.0 / T * np.array([1.0, -2.0, 2.0, -2.0, 2.0])
    integral = 40.0 * T / 2.0 * np.array([1.0, 2.0, 2.0, 2.0, 2.0])
    np.testing.assert_allclose(b, derivative + integral + [3.0, 0, 0, 0, 0], rtol=ROUNDING)
    assert np.array_equal(a, [1.0])


def test_textbook_integrator_is_exact_on_a_step() -> None:
    """Over n samples a unit error adds up to ki n T; nothing is forgotten."""
    b, a = textbook_pid(kp=0.0, ki=40.0, kd=0.0, period=T)
    n = np.arange(1, 1001)
    np.testing.assert_allclose(lfilter(b, a, np.ones(1000)), 40.0 * n * T, rtol=SUM_OF_STEPS)


def test_the_papers_integer_pid_has_no_integral_action() -> None:
    """Negative control: on the same step its output stops growing after p samples."""
    b, a = integer_pid(kd=0.0, ki=40.0, kp=0.0, period=T)
    out = lfilter(b, a, np.ones(1000))
    assert out[-1] == pytest.approx(40.0 * 10.5 * T, rel=ROUNDING)


def test_textbook_derivative_is_exact_on_a_ramp() -> None:
    b, a = textbook_pid(kp=0.0, ki=0.0, kd=2.0, period=T)
    out = lfilter(b, a, 3.0 * T * np.arange(100))
    np.testing.assert_allclose(out[1:], 6.0, rtol=SUM_OF_STEPS)
    b, a = textbook_pid(kp=0.0, ki=0.0, kd=2.0, period=T, filter_time=0.01)
    out = lfilter(b, a, 3.0 * T * np.arange(1000))
    n = np.arange(1000)
    np.testing.assert_allclose(out, 6.0 * (1.0 - (0.01 / (T + 0.01)) ** n), atol=SUM_OF_STEPS)


def test_textbook_pid_in_closed_form() -> None:
    kp, ki, kd = 3.0, 40.0, 0.5
    b, a = textbook_pid(kp, ki, kd, T)
    wanted = [kp + ki * T + kd / T, -kp - 2.0 * kd / T, kd / T]
    np.testing.assert_allclose(b, wanted, rtol=ROUNDING)
    np.testing.assert_allclose(a, [1.0, -1.0], rtol=ROUNDING)


@pytest.mark.parametrize("filter_time", [0.0, 0.002, 0.02])
def test_textbook_pid_tends_to_the_continuous_one_with_first_order(filter_time: float) -> None:
    kp, ki, kd, omega = 3.0, 40.0, 0.5, 20.0
    s = 1j * omega
    exact = kp + ki / s + kd * s / (1.0 + filter_time * s)
    periods = np.array([1e-3, 5e-4, 2.5e-4, 1.25e-4])
    error = [
        abs(frequency_response(*textbook_pid(kp, ki, kd, h, filter_time), omega, h)[0] - exact)
        for h in periods
    ]
    slope = np.polyfit(np.log(periods), np.log(error), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.05)  # next term: omega T / 2 = 1 % at most


def test_textbook_pid_of_zero_gains_is_zero() -> None:
    b, a = textbook_pid(0.0, 0.0, 0.0, T)
    assert np.array_equal(b, [0.0])
    assert np.array_equal(a, [1.0])


def test_textbook_pid_errors() -> None:
    with pytest.raises(ControllerError, match="filter_time must be zero or more, got -1"):
        textbook_pid(1.0, 1.0, 1.0, T, filter_time=-1.0)
    with pytest.raises(ControllerError, match="ki must be a finite number"):
        textbook_pid(1.0, math.nan, 1.0, T)
    with pytest.raises(ControllerError, match="period must be above zero"):
        textbook_pid(1.0, 1.0, 1.0, 0.0)
