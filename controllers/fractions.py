"""Fractional operators as truncated continued fractions: recursive filters.

    b, a = tustin_fraction(0.5, period=1e-3, terms=5)  # five poles, five zeros

A continued fraction of (1) cut where numerator and denominator both have degree
`terms` is the diagonal Pade approximant, which shares the first 2 * terms + 1
coefficients with the series of (2) at half the length.

Stability. For |order| < 1 all poles and zeros are real and inside the unit
circle. For a larger order some poles leave it, so only the fractional part
(order less its whole part, of the same sign) is expanded, and the whole part is
a power of the rational operator itself: exact, and the filter grows by as many
delays. That whole part keeps what is inherent in it: negative orders of either
operator and positive orders of Tustin's have poles *on* the unit circle, at
z = 1 (integration) and z = -1 (Tustin's derivative rings at the Nyquist
frequency). One such pole is marginally stable; at Tustin orders of 2 and more
they repeat, and the ringing grows, just as the taps of (2) do. Below order -2
several poles sit at or near z = 1, which rounded coefficients hold to three or
four digits only: take few terms there.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.polynomial import polynomial

from controllers.errors import check_coefficients, check_order, check_positive, check_terms
from controllers.series import Array, Filter, convolve

MOST_TUSTIN_TERMS = 20
MOST_BACKWARD_TERMS = 12
"""Beyond this the outermost pole, which lies at 1 - z^-1 of about 1e-6 for an order
near -1, may round to the outside of the unit circle once the poles are written out
as a polynomial. Those of the backward difference crowd at z = 1 and are lost sooner.
"""


def tustin_fraction(order: float, period: float, terms: int) -> Filter:
    """Return D^order as the truncated continued fraction of Tustin's operator.

    Args:
        order: nu, any real number.
        period: sampling period T [s].
        terms: poles and zeros of the fractional part, at most 20.

    Returns:
        b and a, each (terms + |whole part of order| + 1,), a[0] = 1.

    Raises:
        ControllerError: an argument is out of range.

    Source: section 3.1, "a truncated continued fraction expansion" of (1).
    """
    n = check_terms(terms, MOST_TUSTIN_TERMS)
    forward, back = np.array([1.0, -1.0]), np.array([1.0, 1.0])
    return _assemble(order, period, n, 2.0, forward, back, _tustin_pade)


def backward_fraction(order: float, period: float, terms: int) -> Filter:
    """Return D^order as the truncated continued fraction of ((1 - z^-1)/T)^order.

    Args:
        order: nu, any real number.
        period: sampling period T [s].
        terms: poles and zeros of the fractional part, at most 12.

    Returns:
        b and a, each at most (terms + |whole part of order| + 1,), a[0] = 1.

    Raises:
        ControllerError: an argument is out of range.

    Source: section 3.1, "a truncated continued fraction expansion" of the
    backward difference.
    """
    n = check_terms(terms, MOST_BACKWARD_TERMS)
    return _assemble(order, period, n, 1.0, np.array([1.0, -1.0]), np.ones(1), _backward_pade)


def _assemble(
    order: float,
    period: float,
    n: int,
    scale: float,
    forward: Array,
    back: Array,
    pade: Callable[[float, int], Filter],
) -> Filter:
    """Return ((scale/T) forward/back)^order, its fractional part by `pade`."""
    nu, T = check_order("order", order), check_positive("period", period)
    whole = math.trunc(nu)
    b, a = pade(nu - whole, n) if nu != whole else (np.ones(1), np.ones(1))
    if whole < 0:
        forward, back = back, forward
    with np.errstate(over="ignore", invalid="ignore"):
        b = convolve(b, polynomial.polypow(forward, abs(whole)))
        a = convolve(a, polynomial.polypow(back, abs(whole)))
        return check_coefficients(np.float64(scale / T) ** nu * b, a, nu, T)


def _tustin_pade(nu: float, n: int) -> Filter:
    """Return the [n/n] Pade approximant of ((1 - x)/(1 + x))^nu.

    The convergents of Laguerre's continued fraction in x,
        1 - 2 nu x / (1 + nu x + (nu^2 - 1) x^2 / (3 + (nu^2 - 4) x^2 / (5 + ...))),
    are (P - nu x Q) / (P + nu x Q) with P and Q even, here each over (2k - 1)!!.
    For |nu| < 1 the recursion adds terms of one sign only, so nothing cancels.
    """
    P, P_last = np.eye(1, n + 1)[0], np.eye(1, n + 1)[0]  # (n + 1,)
    Q, Q_last = P.copy(), np.zeros(n + 1)
    for k in range(2, n + 1):
        c = (nu**2 - (k - 1) ** 2) / ((2 * k - 1) * (2 * k - 3))
        P, P_last = P + c * _delay(P_last, 2), P
        Q, Q_last = Q + c * _delay(Q_last, 2), Q
    return P - nu * _delay(Q, 1), P + nu * _delay(Q, 1)


def _backward_pade(nu: float, n: int) -> Filter:
    """Return the [n/n] Pade approximant of (1 - x)^nu.

    2F1(-n, -n-nu; -2n; x) / 2F1(-n, -n+nu; -2n; x), each coefficient a product.
    """
    j = np.arange(float(n))

    def numerator(nu: float) -> Array:
        ratio = -(n - j) * (n + nu - j) / ((2 * n - j) * (j + 1.0))
        return np.concatenate(([1.0], np.cumprod(ratio)))  # (n + 1,)

    return numerator(nu), numerator(-nu)


def _delay(c: Array, by: int) -> Array:
    """Return the coefficients of x^by times the polynomial, cut to its length."""
    return np.concatenate((np.zeros(by), c))[: c.size]
