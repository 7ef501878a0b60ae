"""Oustaloup's band-limited fractional operator, the usual reference of the field.

    b, a = oustaloup(0.5, period=1e-3, terms=5, low=1.0, high=2000.0)
    sections = oustaloup_cascade(0.5, period=1e-3, terms=17, low=2e-3, high=2000.0)

Real poles and zeros alternate evenly along a logarithmic frequency band, so that
magnitude and phase follow s^order inside it and level off outside. Many poles over a wide band
crowd at z = 1, where a polynomial's coefficients round them away: those stay sections.
"""

import math
from functools import reduce

import numpy as np
import scipy  # its signal package, half a second, is loaded where it is used

from controllers.errors import (
    ControllerError,
    check_coefficients,
    check_order,
    check_positive,
    check_terms,
)
from controllers.sections import Cascade
from controllers.series import Array, Filter, convolve, gruenwald_letnikov

LOW = 0.01
"""Default lower edge times the period: 10 rad/s at 1 ms, what ten pairs allow."""
HIGH = 0.8 * math.pi
"""Default upper edge times the period: 0.8 of the Nyquist frequency."""
ROUNDING = 1e-3
"""Largest relative change of the response when poles become coefficients."""


def oustaloup(
    order: float,
    period: float,
    terms: int,
    low: float | None = None,
    high: float | None = None,
) -> Filter:
    """Return D^order as Oustaloup's recursive filter, discretised by Tustin's rule.

    The fractional part (order less its whole part, of the same sign) is
        high^f prod (s + z_k)/(s + p_k), k = 1 ... terms,
        z_k, p_k = low (high/low)^((2k - 1 -+ f) / (2 terms)),
    with s = 2/T (1 - z^-1)/(1 + z^-1), not prewarped: like (1) it is s^f up to
    Tustin's warping, +5 % in frequency at a quarter of the Nyquist frequency. The
    whole part is a power of the backward difference if positive (Tustin's would
    ring) and of Tustin's integrator (trapezoidal rule) if negative. So all poles
    lie inside the unit circle but for one at z = 1 per integration.

    Args:
        order: nu, any real number.
        period: sampling period T [s].
        terms: number of pole-zero pairs.
        low: lower edge of the band [rad/s]; default 0.01 / T.
        high: upper edge of the band [rad/s]; default 0.8 pi / T.

    Returns:
        b and a, each at most (terms + |whole part of order| + 1,), a[0] = 1.

    Raises:
        ControllerError: an argument is out of range, the band is empty or reaches
            above the Nyquist frequency, or it is so wide for this many terms that
            rounding the coefficients would move the poles.

    Source: Oustaloup, Levron, Mathieu, Nanot, IEEE Trans. Circuits Syst. I 47
    (2000) 25-39.
    """
    nu, T, n = check_order("order", order), check_positive("period", period), check_terms(terms)
    low, high = _band(low, high, T)
    whole = math.trunc(nu)
    b, a = _fractional_part(nu - whole, T, n, low, high) if nu != whole else _integers(0, T)
    b_whole, a_whole = _integers(whole, T)
    with np.errstate(over="ignore", invalid="ignore"):
        return check_coefficients(convolve(b, b_whole), convolve(a, a_whole), nu, T)


def oustaloup_cascade(
    order: float,
    period: float,
    terms: int,
    low: float | None = None,
    high: float | None = None,
) -> Cascade:
    """Return `oustaloup` as sections of first order in series, for any number of them.

    Each section's pole is its own coefficient: seventeen pairs over six decades are as accurate as
    three over two.

    Args: as `oustaloup`.

    Returns:
        `(b, a)` of every section, terms + |whole part of order| of them; one of gain 1 at order 0.

    Raises:
        ControllerError: an argument is out of range, or the band is empty or reaches above the
            Nyquist frequency.
    """
    nu, T, n = check_order("order", order), check_positive("period", period), check_terms(terms)
    low, high = _band(low, high, T)
    whole = math.trunc(nu)
    f, c = nu - whole, 2.0 / T
    sections: list[Filter] = []
    if f != 0.0:
        gain = high ** (f / n)  # shared out, so that nothing between sections is large
        for z, p in zip(*_corners(f, n, low, high), strict=True):
            b = gain * np.array([c + z, z - c]) / (c + p)
            sections.append((b, np.array([1.0, (p - c) / (c + p)])))
    one = np.array([1.0, -1.0])
    difference, integrator = (one / T, np.ones(1)), (np.array([T / 2.0, T / 2.0]), one)
    sections += [difference if whole > 0 else integrator] * abs(whole)
    return tuple(sections) or ((np.ones(1), np.ones(1)),)


def _corners(f: float, n: int, low: float, high: float) -> tuple[Array, Array]:
    """Return the frequencies z_k, p_k of zeros and poles (n,), (n,) [rad/s]."""
    ratio = high / low
    zeros = low * np.array([ratio ** ((2 * k - 1 - f) / (2 * n)) for k in range(1, n + 1)])
    poles = low * np.array([ratio ** ((2 * k - 1 + f) / (2 * n)) for k in range(1, n + 1)])
    return zeros, poles


def _band(low: float | None, high: float | None, T: float) -> tuple[float, float]:
    """Return the band's edges [rad/s], checked."""
    low = LOW / T if low is None else check_positive("low", low)
    high = HIGH / T if high is None else check_positive("high", high)
    if not low < high < math.pi / T:
        raise ControllerError(
            f"the band must satisfy low < high < pi/period = {math.pi / T:g} rad/s, "
            f"got low = {low:g} and high = {high:g} rad/s"
        )
    return low, high


def _fractional_part(f: float, T: float, n: int, low: float, high: float) -> Filter:
    zeros, poles = (-each for each in _corners(f, n, low, high))
    digital = scipy.signal.bilinear_zpk(zeros, poles, high**f, 1.0 / T)
    b, a = digital[2] * _from_roots(digital[0]), _from_roots(digital[1])
    edges = np.array([low, high]) * T
    exact, rounded = scipy.signal.freqz_zpk(*digital, edges)[1], scipy.signal.freqz(b, a, edges)[1]
    if not np.allclose(rounded, exact, rtol=ROUNDING, atol=0.0):
        raise ControllerError(
            f"terms = {n} are too many for a band from {low:g} to {high:g} rad/s at a period "
            f"of {T:g} s: the coefficients would be rounded away; take fewer, raise low, or use "
            "oustaloup_cascade"
        )
    return b, a


def _from_roots(roots: Array) -> Array:
    """Return the polynomial in z^-1 with these roots and a first coefficient of one."""
    return reduce(convolve, ([1.0, -root] for root in roots.real), np.ones(1))


def _integers(whole: int, T: float) -> Filter:
    """Return s^whole: backward differences, or trapezoidal integrators."""
    if whole > 0:
        return gruenwald_letnikov(whole, T, whole)
    b, a = np.ones(1), np.ones(1)
    for _ in range(-whole):
        b, a = convolve(b, [T / 2.0, T / 2.0]), convolve(a, [1.0, -1.0])
    return b, a
