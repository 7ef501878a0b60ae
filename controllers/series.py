"""Fractional operators as finite impulse responses: taps of z^0 to z^-terms.

    b, a = tustin(-0.5, period=1e-3, terms=10)  # half an integration, a = [1]

Every function returns `(b, a)` in scipy.signal's convention; `terms` is the p of
(2), so there are p + 1 taps, and the operator forgets whatever is older than
`terms` samples: below about 1 / (terms * period) rad/s it acts as a gain.
"""

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import rgamma

from controllers.errors import check_coefficients, check_order, check_positive, check_terms

Array: TypeAlias = NDArray[np.float64]
Filter: TypeAlias = tuple[Array, Array]


def tustin(order: float, period: float, terms: int) -> Filter:
    """Return D^order as the truncated MacLaurin series of Tustin's operator.

    At order 1 this is 2/T (1, -2, 2, -2, ...) cut after `terms`, and at order -1
    T/2 (1, 2, 2, ...): neither a differentiator nor an integrator of the kind
    that textbooks build; see `controllers.textbook_pid`.

    Args:
        order: nu, any real number.
        period: sampling period T [s].
        terms: p, the number of delays kept.

    Returns:
        b (terms + 1,) [s^-order] and a = [1].

    Raises:
        ControllerError: an argument is out of range.

    Source: (2), its Gamma functions as the binomial recursion, which is the same
    number but has no poles at integer orders.
    """
    nu, T, p = _check(order, period, terms)
    scale = _power(2.0 / T, nu)
    taps = convolve(_binomial(nu, p, -1.0), _binomial(-nu, p, 1.0))[: p + 1]  # (p + 1,)
    return _fir(scale, taps, nu, T)  # (2)


def gruenwald_letnikov(order: float, period: float, terms: int) -> Filter:
    """Return D^order as the truncated series of the backward difference.

    Args:
        order: nu, any real number.
        period: sampling period T [s].
        terms: p, the number of delays kept.

    Returns:
        b (terms + 1,) [s^-order] and a = [1].

    Raises:
        ControllerError: an argument is out of range.

    Source: section 3.1, "a first-order backward finite difference": the series of
    ((1 - z^-1)/T)^nu, known as the Gruenwald-Letnikov derivative.
    """
    nu, T, p = _check(order, period, terms)
    return _fir(_power(1.0 / T, nu), _binomial(nu, p, -1.0), nu, T)


def impulse_response(order: float, period: float, terms: int) -> Filter:
    """Return D^order as the sampled impulse response of s^order.

    The impulse response h(t) = t^(-nu-1) / Gamma(-nu) is singular at t = 0, for
    positive nu not even integrable, and the paper does not say how it was
    sampled. Assumed here: tap i is the integral of h over the sampling interval
    (i T, (i+1) T), that is, the increment of the step response t^-nu /
    Gamma(1-nu); a positive order is s^m s^(nu-m) with m = ceil(nu), the s^m as
    backward differences. That is defined at every order (-1: the rectangle rule,
    0: one, 1: the backward difference), and for 0 < nu < 1 it is the L1 scheme of
    fractional calculus, whose error falls with T^(2-nu).

    Point samples T h(i T) agree with it from the second tap on to first order in
    1/i, and need a first tap by convention, as in Valerio's toolbox ninteger.

    Args:
        order: nu, any real number.
        period: sampling period T [s].
        terms: p, the number of delays kept.

    Returns:
        b (terms + 1,) [s^-order] and a = [1].

    Raises:
        ControllerError: an argument is out of range.

    Source: section 3.1, "the expected impulse response".
    """
    nu, T, p = _check(order, period, terms)
    m = max(math.ceil(nu), 0)
    mu = m - nu  # order of the integral that is left, mu >= 0
    with np.errstate(over="ignore", invalid="ignore"):
        powers = np.array([np.float64(i) ** mu for i in range(p + 2)])
        step = powers * rgamma(mu + 1.0)  # at t/T = 0, 1, ..., p + 1
        if mu == 0.0:
            step[0] = 0.0  # the unit step, just before it
        taps = convolve(np.diff(step), _binomial(m, p, -1.0))[: p + 1]  # (p + 1,)
    return _fir(_power(1.0 / T, nu), taps, nu, T)


def convolve(p: ArrayLike, q: ArrayLike) -> Array:
    """Return the product of two polynomials, as numpy's of this name.

    Numpy's is made of BLAS's inner products, whose last bits depend on the processor; here every
    product is added where it belongs, the shorter polynomial's in turn.
    """
    long, short = np.asarray(p, dtype=float), np.asarray(q, dtype=float)
    if short.size > long.size:
        long, short = short, long
    total = np.zeros(long.size + short.size - 1)
    for i, factor in enumerate(short):
        total[i : i + long.size] += factor * long
    return total


def _check(order: float, period: float, terms: int) -> tuple[float, float, int]:
    return check_order("order", order), check_positive("period", period), check_terms(terms)


def _binomial(power: float, terms: int, sign: float) -> Array:
    """Return the coefficients of (1 + sign x)^power, (terms + 1,)."""
    i = np.arange(1.0, terms + 1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        return np.concatenate(([1.0], np.cumprod(sign * (power - i + 1.0) / i)))


def _power(base: float, exponent: float) -> float:
    """Return base^exponent, infinite where it overflows."""
    with np.errstate(over="ignore"):
        return float(np.float64(base) ** exponent)


def _fir(scale: float, taps: Array, order: float, period: float) -> Filter:
    with np.errstate(over="ignore", invalid="ignore"):
        return check_coefficients(scale * taps, np.ones(1), order, period)
