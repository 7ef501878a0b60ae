"""Fractional operators: closed forms, properties, orders of convergence, errors."""

import json
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.signal import lfilter
from scipy.special import gamma

from controllers import (
    REALISATIONS,
    Array,
    ControllerError,
    Realisation,
    backward_fraction,
    frequency_response,
    gruenwald_letnikov,
    impulse_response,
    operator,
    oustaloup,
    response_error,
    tustin,
    tustin_fraction,
)
from controllers.fractions import _tustin_pade
from studies.tools.filter import FilterConfig, command, run

T = 1e-3
"""The paper's sampling period [s]."""
P = 10
"""The paper's number of terms."""
ROUNDING = 1e-12
"""Relative to the largest coefficient: some hundred operations in double precision."""
GAMMA_ROUNDING = 1e-9
"""The printed form divides Gamma values of 1e6 and loses digits near integer orders."""
SERIES_OF_FRACTION = 1e-7
"""Twelve poles that crowd at z = 1 lose eight of sixteen digits; measured, 5e-9."""
SLOPE = 0.1
"""An order of convergence fitted over 1.5 decades; the next term of the error shows."""
IN_BAND_DB = 0.1
"""Ten pairs over 2.4 decades ripple by 0.01 dB; the band's ends leak the rest."""
IN_BAND_DEG = 6.0
"""The band's ends pull the phase by f * 11 deg one decade away; the test has f <= 0.5."""
DIGITS = 1e-3
"""Half a unit in the last of the four digits quoted, rounded up."""

FIR = (tustin, gruenwald_letnikov, impulse_response)
FRACTIONS = ((tustin_fraction, tustin), (backward_fraction, gruenwald_letnikov))
orders = st.floats(-4.0, 4.0)
fractional_orders = st.floats(-0.999, 0.999)
terms_of = st.integers(1, 12)


def assert_close(given: ArrayLike, wanted: ArrayLike, tolerance: float = ROUNDING) -> None:
    """Compare coefficients on the scale of the largest."""
    one, two = np.asarray(given), np.asarray(wanted)
    assert one.shape == two.shape
    assert np.abs(one - two).max() <= tolerance * np.abs(two).max()


def printed_taps(nu: float, period: float, p: int) -> Array:
    """Return the taps of (2) exactly as printed."""
    taps = np.zeros(p + 1)
    for i in range(p + 1):
        for j in range(i + 1):
            taps[i] += (
                (-1) ** j
                * (2.0 / period) ** nu
                * gamma(nu + 1)
                * gamma(-nu + 1)
                / (gamma(nu - j + 1) * gamma(j + 1) * gamma(i - j + 1) * gamma(-nu + j - i + 1))
            )  # (2)
    return taps


# Closed forms ---------------------------------------------------------------


@pytest.mark.parametrize("nu", [-3.63, -3.54, -0.498, -0.114, 0.0101, 0.298, 0.5, 0.715, 1.3])
def test_tustin_is_the_printed_equation_2(nu: float) -> None:
    b, a = tustin(nu, T, P)
    assert_close(b, printed_taps(nu, T, P), GAMMA_ROUNDING)
    assert_close(a, np.ones(1))


def test_tustin_at_integer_orders() -> None:
    signs = (-1.0) ** np.arange(1, P + 1)
    assert_close(tustin(1.0, T, P)[0], 2.0 / T * np.r_[1.0, 2.0 * signs])
    assert_close(tustin(-1.0, T, P)[0], T / 2.0 * np.r_[1.0, 2.0 * np.ones(P)])
    ones = 4.0 * np.arange(1, P + 1)  # of (1 + x)^2/(1 - x)^2 = 1 + 4 x + 8 x^2 + ...
    assert_close(tustin(-2.0, T, P)[0], (T / 2.0) ** 2 * np.r_[1.0, ones])


@given(nu=orders, p=st.integers(1, 40))
def test_tustin_obeys_its_differential_equation(nu: float, p: int) -> None:
    """As f = ((1 - x)/(1 + x))^nu has (1 - x^2) f' = -2 nu f: another recursion altogether."""
    f = tustin(nu, 2.0, p)[0]
    left = np.arange(1, p + 1) * f[1:]  # (p,), coefficients of f'
    left[2:] -= np.arange(1, p - 1) * f[1 : p - 1]
    scale = (p + 2.0 * abs(nu)) * np.abs(f).max()
    np.testing.assert_allclose(left, -2.0 * nu * f[:-1], rtol=0.0, atol=ROUNDING * scale)


@pytest.mark.parametrize("realise", [gruenwald_letnikov, impulse_response])
def test_order_one_is_the_backward_difference(realise: Realisation) -> None:
    assert_close(realise(1.0, T, P)[0], np.r_[1.0, -1.0, np.zeros(P - 1)] / T)
    assert_close(realise(2.0, T, P)[0], np.r_[1.0, -2.0, 1.0, np.zeros(P - 2)] / T**2)
    assert_close(realise(-1.0, T, P)[0], T * np.ones(P + 1))


@pytest.mark.parametrize("name", REALISATIONS)
def test_order_zero_is_one(name: str) -> None:
    b, a = operator(name, 0.0, T, P)
    assert_close(frequency_response(b, a, [1.0, 100.0, 3000.0], T), np.ones(3))


@pytest.mark.parametrize("nu", [-0.1, -0.5, -1.7, -3.63])
def test_impulse_response_has_the_exact_step_response(nu: float) -> None:
    t = T * np.arange(1, P + 2)  # (P + 1,)
    assert_close(np.cumsum(impulse_response(nu, T, P)[0]), t**-nu / gamma(1.0 - nu))


def test_impulse_response_of_a_half_derivative_is_the_l1_scheme() -> None:
    i = np.arange(1.0, P + 1.0)
    inner = np.sqrt(i + 1.0) - 2.0 * np.sqrt(i) + np.sqrt(i - 1.0)
    wanted = T**-0.5 / gamma(1.5) * np.r_[1.0, inner]
    assert_close(impulse_response(0.5, T, P)[0], wanted)


@given(nu=st.floats(-1.0, 0.9))
def test_impulse_response_tends_to_point_samples(nu: float) -> None:
    """Cell averages and T h(t) at the cells' middles agree where h is smooth."""
    assume(abs(nu) > 1e-3)
    p = 400
    taps = impulse_response(nu, T, p)[0]
    point = T * ((p + 0.5) * T) ** (-nu - 1.0) / gamma(-nu)
    if nu > 0.0:  # the backward difference looks half an interval further back
        point = T * (p * T) ** (-nu - 1.0) / gamma(-nu)
    assert taps[p] == pytest.approx(point, rel=10.0 / p**2)


# Properties -----------------------------------------------------------------


@pytest.mark.parametrize("realise", [tustin, gruenwald_letnikov])
@given(first=st.floats(-2.0, 2.0), second=st.floats(-2.0, 2.0), p=st.integers(1, 30))
def test_orders_add(realise: Realisation, first: float, second: float, p: int) -> None:
    one, two = realise(first, T, p)[0], realise(second, T, p)[0]
    both = realise(first + second, T, p)[0]
    scale = np.convolve(np.abs(one), np.abs(two))[: p + 1].max()
    product = np.convolve(one, two)[: p + 1]
    np.testing.assert_allclose(product, both, rtol=0.0, atol=ROUNDING * scale)


def test_orders_do_not_add_for_the_impulse_response() -> None:
    """Negative control: cell averages of a convolution are not a convolution."""
    half = impulse_response(-0.5, T, P)[0]
    whole = impulse_response(-1.0, T, P)[0]
    assert np.abs(np.convolve(half, half)[: P + 1] - whole).max() > 0.1 * T


@pytest.mark.parametrize("realise", FIR)
@given(nu=orders, p=st.integers(1, 40), factor=st.floats(0.1, 10.0))
def test_series_scale_with_the_period_and_extend(
    realise: Realisation, nu: float, p: int, factor: float
) -> None:
    taps, a = realise(nu, T, p)
    assert taps.shape == (p + 1,)
    assert np.array_equal(a, [1.0])
    assert_close(realise(nu, T * factor, p)[0], factor**-nu * taps)
    assert_close(realise(nu, T, p + 5)[0][: p + 1], taps)


@given(nu=fractional_orders)
def test_tustin_is_odd_in_the_delay(nu: float) -> None:
    """((1 - x)/(1 + x))^nu at -x is its own inverse."""
    taps = tustin(nu, 2.0, P)[0]
    mirrored = taps * (-1.0) ** np.arange(P + 1)
    assert_close(mirrored, tustin(-nu, 2.0, P)[0])


# Continued fractions --------------------------------------------------------


def laguerre(nu: float, x: complex, n: int) -> complex:
    """Return ((1 - x)/(1 + x))^nu by its continued fraction, from the inside out."""
    tail: complex = 2.0 * n - 1.0
    for k in range(n - 1, 0, -1):
        tail = 2.0 * k - 1.0 + (nu**2 - k**2) * x**2 / tail
    return 1.0 - 2.0 * nu * x / (nu * x + tail)


def gauss(nu: float, x: complex, n: int) -> complex:
    """Return (1 - x)^nu by Gauss's continued fraction, from the inside out."""
    c = [nu]
    for k in range(1, n + 1):
        c += [(k - nu) / (2.0 * (2.0 * k - 1.0)), (k + nu) / (2.0 * (2.0 * k + 1.0))]
    value: complex = 1.0
    for c_k in reversed(c[: 2 * n]):
        value = 1.0 - c_k * x / value
    return value


@given(nu=fractional_orders, n=terms_of, angle=st.floats(0.3, 2.8))
def test_fractions_are_the_continued_fractions(nu: float, n: int, angle: float) -> None:
    x, omega = np.exp(-1j * angle), angle / T
    got = frequency_response(*tustin_fraction(nu, T, n), omega, T)[0]
    assert got == pytest.approx((2.0 / T) ** nu * laguerre(nu, x, n), rel=SERIES_OF_FRACTION)
    got = frequency_response(*backward_fraction(nu, T, n), omega, T)[0]
    assert got == pytest.approx(T**-nu * gauss(nu, x, n), rel=SERIES_OF_FRACTION)


@pytest.mark.parametrize(("fraction", "series"), FRACTIONS)
@given(nu=orders, n=terms_of)
def test_fractions_share_twice_their_terms_with_the_series(
    fraction: Realisation, series: Realisation, nu: float, n: int
) -> None:
    b, a = fraction(nu, T, n)
    expanded = lfilter(b, a, np.eye(1, 2 * n + 1)[0])
    assert_close(expanded, series(nu, T, 2 * n)[0], SERIES_OF_FRACTION)


def test_fractions_leave_the_series_after_twice_their_terms() -> None:
    """Negative control of the test above: one coefficient more must differ."""
    b, a = tustin_fraction(0.5, T, 3)
    expanded = lfilter(b, a, np.eye(1, 8)[0])
    assert abs(expanded[7] / tustin(0.5, T, 7)[0][7] - 1.0) > 0.01


@pytest.mark.parametrize("fraction", [tustin_fraction, backward_fraction])
@given(nu=fractional_orders, n=terms_of)
def test_fractional_parts_are_stable_and_minimum_phase(
    fraction: Realisation, nu: float, n: int
) -> None:
    b, a = fraction(nu, T, n)
    assert np.abs(np.roots(a)).max(initial=0.0) < 1.0
    assert np.abs(np.roots(b)).max(initial=0.0) < 1.0
    assert a[0] == 1.0


def test_fraction_at_the_most_terms_is_stable() -> None:
    for nu in (-0.9999, 0.9999):
        assert np.abs(np.roots(tustin_fraction(nu, T, 20)[1])).max() < 1.0
        assert np.abs(np.roots(backward_fraction(nu, T, 12)[1])).max() < 1.0


def test_splitting_off_the_whole_part_is_what_keeps_the_poles_inside() -> None:
    """Negative control: the same fraction, fed the whole order, has a pole outside."""
    split = tustin_fraction(1.5, T, 4)[1]
    unsplit = _tustin_pade(1.5, 4)[1]
    assert np.abs(np.roots(split)).max() < 1.0 + ROUNDING
    assert np.abs(np.roots(unsplit)).max() > 1.03


def test_fractions_at_integer_orders_are_exact() -> None:
    b, a = tustin_fraction(1.0, T, P)
    assert_close(b, 2.0 / T * np.array([1.0, -1.0]))
    assert_close(a, np.array([1.0, 1.0]))
    b, a = backward_fraction(-2.0, T, P)
    assert_close(b, np.array([T**2]))
    assert_close(a, np.array([1.0, -2.0, 1.0]))


def test_more_terms_of_a_fraction_come_closer_geometrically() -> None:
    """At a quarter of Nyquist the convergents of (1) gain a factor per term.

    The recursion 1 : 2 k : -k^2 x^2 of Laguerre's fraction has solutions that grow
    as 1 +- r, r = sqrt(1 - x^2), per term, and their ratio is the rate. The limit is
    (j 2/T tan(omega T/2))^nu.
    """
    omega = 0.25 * math.pi / T
    limit = (2.0 / T * 1j * math.tan(omega * T / 2.0)) ** 0.5
    n = list(range(2, 11))
    error = [abs(frequency_response(*tustin_fraction(0.5, T, k), omega, T)[0] - limit) for k in n]
    rate = np.polyfit(n, np.log(error), 1)[0]
    x = np.exp(-1j * omega * T)
    root = np.sqrt(1.0 - x**2)
    assert rate == pytest.approx(math.log(abs((1.0 - root) / (1.0 + root))), rel=SLOPE)


# Orders of convergence ------------------------------------------------------


@pytest.mark.parametrize(
    ("realise", "nu", "wanted"),
    [
        (gruenwald_letnikov, 0.5, 1.0),
        (gruenwald_letnikov, -0.5, 1.0),
        (impulse_response, 0.5, 1.5),  # 2 - nu, the L1 scheme
        (impulse_response, 0.2, 1.8),
        (impulse_response, -0.5, 1.0),  # the rectangle rule
        (tustin, 0.5, 2.0),
        (tustin, -0.5, 2.0),
        (tustin, -1.5, 2.0),
    ],
)
def test_order_of_convergence(realise: Realisation, nu: float, wanted: float) -> None:
    """Keeping its whole memory, D^nu t^3 at t = 1 tends to 6 t^(3 - nu)/Gamma(4 - nu)."""
    exact = 6.0 / gamma(4.0 - nu)
    steps = np.array([40, 80, 160, 320, 640, 1280])
    error = []
    for n in steps:
        taps = realise(nu, 1.0 / n, int(n))[0]
        error.append(abs(taps @ (np.arange(n, -1, -1) / n) ** 3 - exact))
    assert -np.polyfit(np.log(steps), np.log(error), 1)[0] == pytest.approx(wanted, abs=SLOPE)


@pytest.mark.parametrize("realise", FIR)
def test_a_truncated_series_is_a_gain_at_low_frequency(realise: Realisation) -> None:
    """Eleven taps know nothing below 1/(p T) = 100 rad/s: no integral action."""
    b, a = realise(-1.0, T, P)
    low = frequency_response(b, a, [0.01, 0.1, 1.0], T)
    np.testing.assert_allclose(np.abs(low), b.sum(), rtol=DIGITS)


# Oustaloup ------------------------------------------------------------------


@given(nu=st.floats(-0.5, 0.5))
def test_oustaloup_holds_magnitude_and_phase_inside_its_band(nu: float) -> None:
    b, a = oustaloup(nu, T, P)
    inside = np.geomspace(100.0, 400.0, 20)  # a decade from either edge, or nearly
    warped = 2.0 / T * np.tan(inside * T / 2.0)  # it is Tustin's s that it follows
    ratio = frequency_response(b, a, inside, T) / (1j * warped) ** nu
    assert np.abs(20.0 * np.log10(np.abs(ratio))).max() < IN_BAND_DB
    assert np.abs(np.degrees(np.angle(ratio))).max() < IN_BAND_DEG
    assert np.abs(np.roots(a)).max(initial=0.0) < 1.0


def test_a_wider_band_makes_oustaloup_better() -> None:
    centre = 100.0
    narrow = response_error(*oustaloup(0.5, T, 5, 50.0, 200.0), 0.5, 1.0, 20.0, T)
    wide = response_error(*oustaloup(0.5, T, 5, 5.0, 2000.0), 0.5, 1.0, 20.0, T)
    assert abs(wide.phase_deg[0]) < abs(narrow.phase_deg[0])
    middle = frequency_response(*oustaloup(0.5, T, 5, 50.0, 200.0), centre, T)
    assert abs(middle[0]) == pytest.approx(10.0, rel=DIGITS)  # 100^0.5, at the band's centre


@pytest.mark.parametrize(("nu", "on_circle"), [(1.5, 0), (-0.5, 0), (-1.5, 1), (-2.0, 2)])
def test_oustaloup_has_one_pole_at_1_per_integration(nu: float, on_circle: int) -> None:
    a = oustaloup(nu, T, 5)[1]
    poles = np.roots(a)
    # a double root moves by the square root of the rounding
    assert np.count_nonzero(np.abs(poles - 1.0) < 1e-6) == on_circle
    assert np.count_nonzero(np.abs(poles) < 1.0 - 1e-6) == poles.size - on_circle


# Response -------------------------------------------------------------------


def test_response_error_of_known_filters() -> None:
    """Backward difference: magnitude sin(x)/x and phase -x, x = omega T/2."""
    omega = np.geomspace(1.0, math.pi / T, 9)
    x = omega * T / 2.0
    error = response_error(*gruenwald_letnikov(1.0, T, 1), 1.0, 1.0, omega, T)
    np.testing.assert_allclose(error.magnitude_db, 20.0 * np.log10(np.sin(x) / x), atol=1e-9)
    np.testing.assert_allclose(error.phase_deg, -np.degrees(x), atol=1e-9)
    np.testing.assert_allclose(error.relative, np.sin(x) / x * np.exp(-1j * x) - 1.0, atol=1e-9)


def test_response_at_a_pole_is_infinite_without_a_warning() -> None:
    b, a = tustin_fraction(-1.0, T, 1)
    assert not np.isfinite(frequency_response(b, a, 0.0, T)[0])


# Errors ---------------------------------------------------------------------


@pytest.mark.parametrize("name", REALISATIONS)
@pytest.mark.parametrize(
    ("order", "period", "terms", "words"),
    [
        (math.nan, T, P, "order must be a finite number, got nan"),
        (math.inf, T, P, "order must be a finite number"),
        (None, T, P, "order must be a finite number, got None"),
        (101.0, T, P, "order must lie from -100 to 100"),
        (0.5, 0.0, P, "period must be above zero, got 0.0"),
        (0.5, -1.0, P, "period must be above zero"),
        (0.5, math.nan, P, "period must be a finite number"),
        (0.5, T, 0, "terms must be a whole number, "),
        (0.5, T, 2.5, "got 2.5"),
        (0.5, T, True, "got True"),
        (99.5, 1e-9, 1, "overflows"),
        (99.0, 1e-9, P, "overflows"),
    ],
)
def test_errors(name: str, order: float, period: float, terms: int, words: str) -> None:
    with pytest.raises(ControllerError, match=words) as caught:
        operator(name, order, period, terms)
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, ValueError)


def test_unknown_realisation_lists_the_known() -> None:
    with pytest.raises(ControllerError, match="unknown realisation 'euler'") as caught:
        operator("euler", 0.5, T, P)
    assert all(name in str(caught.value) for name in REALISATIONS)


@pytest.mark.parametrize(
    ("low", "high", "terms", "words"),
    [
        (10.0, 5.0, 5, "low < high < pi/period"),
        (10.0, 4000.0, 5, "high = 4000"),
        (0.0, 100.0, 5, "low must be above zero"),
        (1.0, 2000.0, 10, "terms = 10 are too many"),
    ],
)
def test_oustaloup_errors(low: float, high: float, terms: int, words: str) -> None:
    with pytest.raises(ControllerError, match=words):
        oustaloup(0.5, T, terms, low, high)


def test_response_errors() -> None:
    with pytest.raises(ControllerError, match="gain must not be zero"):
        response_error([1.0], [1.0], 0.5, 0.0, [1.0], T)
    with pytest.raises(ControllerError, match="omega must lie above 0"):
        response_error([1.0], [1.0], 0.5, 1.0, [1.0, 4000.0], T)


def test_realisations_cannot_be_changed() -> None:
    with pytest.raises(TypeError):
        REALISATIONS["tustin"] = gruenwald_letnikov  # type: ignore[index]


# The study of one filter ----------------------------------------------------


def test_filter_study_prints_one_json_object(capsys: pytest.CaptureFixture[str]) -> None:
    command(FilterConfig(order=-3.63, gain=4.81e14, json=True))
    printed = json.loads(capsys.readouterr().out)
    assert_close(np.array(printed["b"]), 4.81e14 * tustin(-3.63, T, P)[0])
    assert printed["a"] == [1.0]
    wanted = {"order": -3.63, "gain": 4.81e14, "realisation": "tustin", "terms": 10, "period": T}
    assert {key: printed[key] for key in wanted} == wanted
    sizes = {len(printed[k]) for k in ("omega", "magnitude_error_db", "phase_error_deg")}
    assert sizes == {12}


def test_filter_study_prints_tables(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    command(FilterConfig(order=0.5, realisation="backward-fraction", terms=4))
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    assert "z^-4" in out
    assert "phase error" in out


def test_filter_study_refuses_what_it_cannot_show() -> None:
    with pytest.raises(ControllerError, match="gain must not be zero"):
        run(FilterConfig(order=0.5, gain=0.0))
    with pytest.raises(ControllerError, match="overflow"):
        run(FilterConfig(order=1.0, gain=1e308))
    with pytest.raises(ControllerError, match="order must be a finite number"):
        run(FilterConfig(order=math.nan))
