"""PID controllers of fractional and of integer order, as single digital filters.

b, a = fractional_pid(Gains(100.0, 0.5, 1.0, -0.1, 0.0), period=1e-3)
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its signal package, half a second, is loaded where it is used

from controllers.errors import ControllerError, check_finite, check_order, check_positive
from controllers.operators import operator
from controllers.oustaloup import oustaloup_cascade
from controllers.sections import Cascade, Sections
from controllers.series import Array, Filter, convolve

ROUNDING = 1e-3
"""Largest relative change of the response when two filters become one."""
PROBES = np.array([1e-3, 1e-2, 1e-1, 1.0])
"""Where that is checked, [rad/sample]; poles crowd at the low end."""


@dataclass(frozen=True)
class Gains:
    """k1 D^nu1 + k2 D^nu2 + k3, the controller of one joint.

    The order of a term whose gain is zero is never read and may be None or nan.

    Source: (3), (4), where the second joint's are numbered 4 to 6.
    """

    k1: float
    """Gain of the first operator [N m s^nu1/rad]."""
    nu1: float | None
    """Order of the first operator."""
    k2: float
    """Gain of the second operator [N m s^nu2/rad]."""
    nu2: float | None
    """Order of the second operator."""
    k3: float
    """Proportional gain [N m/rad]."""

    @classmethod
    def from_milliseconds(cls, k1: float, nu1: float, k2: float, nu2: float, k3: float) -> "Gains":
        """Return gains in SI units of gains [N m ms^nu/rad] for time in milliseconds.

        k D^nu with T = 1 (ms) and k/1000^nu D^nu with T = 1e-3 (s) are the same filter. In
        milliseconds Table 2's leading gains fall inside Table 1's distributions.
        """
        return cls(k1 / 1000.0**nu1, nu1, k2 / 1000.0**nu2, nu2, k3)


@dataclass(frozen=True)
class Controller:
    """The controllers of both joints, with where they come from."""

    name: str
    joint1: Gains
    """C_1, (3)."""
    joint2: Gains
    """C_2, (4): k4, nu4, k5, nu5, k6."""
    source: str

    def filters(
        self, period: float, realisation: str = "tustin", terms: int = 10
    ) -> tuple[Filter, Filter]:
        """Return the filters ((b1, a1), (b2, a2)); see `fractional_pid`."""
        return (
            fractional_pid(self.joint1, period, realisation, terms),
            fractional_pid(self.joint2, period, realisation, terms),
        )

    def scaled(self, factors: Sequence[float]) -> "Controller":
        """Return the same with gains k1 to k6 times factors (6,)."""
        first, second = (
            replace(gains, k1=gains.k1 * f1, k2=gains.k2 * f2, k3=gains.k3 * f3)
            for gains, (f1, f2, f3) in zip(
                (self.joint1, self.joint2), (factors[:3], factors[3:]), strict=True
            )
        )
        return replace(self, joint1=first, joint2=second)


def fractional_pid(
    gains: Gains, period: float, realisation: str = "tustin", terms: int = 10
) -> Filter:
    """Return k1 D^nu1 + k2 D^nu2 + k3 as one filter.

    Args:
        gains: the five numbers of one joint.
        period: sampling period [s].
        realisation: a key of `REALISATIONS`.
        terms: length of each operator, p in (2).

    Returns:
        b and a in powers of z^-1, a[0] = 1; a = [1] if all parts are series.

    Raises:
        ControllerError: an argument is out of range, or an order is missing.

    Source: (3), (4).
    """
    check_positive("period", period)
    k3 = check_finite("k3", gains.k3)
    total: Filter = (np.array([k3]), np.ones(1))
    for i, k, nu in ((1, gains.k1, gains.nu1), (2, gains.k2, gains.nu2)):
        k = check_finite(f"k{i}", k)
        if k == 0.0:
            continue
        if nu is None:
            raise ControllerError(f"nu{i} is missing though k{i} = {k:g}; give it or set k{i} to 0")
        b, a = operator(realisation, check_order(f"nu{i}", nu), period, terms)
        with np.errstate(over="ignore"):
            b = k * b
        if not np.isfinite(b).all():
            raise ControllerError(f"k{i} = {k:g} times D^{nu:g} overflows; choose a smaller k{i}")
        total = parallel(total, (b, a))
    return total


def oustaloup_pid(
    gains: Gains,
    period: float,
    terms: int,
    low: float | None = None,
    high: float | None = None,
) -> Sections:
    """Return k1 D^nu1 + k2 D^nu2 + k3 with Oustaloup's operators, kept as sections.

    For more poles, or a wider band, than `fractional_pid` can write as one polynomial.

    Args:
        gains: the five numbers of one joint.
        period: sampling period [s].
        terms: number of pole-zero pairs of each operator.
        low, high: edges of the band [rad/s]; defaults as `controllers.oustaloup`.

    Returns:
        The sum of a cascade for each term; flexsim runs it as it is.

    Raises:
        ControllerError: an argument is out of range, or an order is missing.

    Source: (3), (4).
    """
    k3 = check_finite("k3", gains.k3)
    cascades: list[Cascade] = [((np.array([k3]), np.ones(1)),)]
    for i, k, nu in ((1, gains.k1, gains.nu1), (2, gains.k2, gains.nu2)):
        k = check_finite(f"k{i}", k)
        if k == 0.0:
            continue
        order = check_order(f"nu{i}", math.nan if nu is None else nu)
        (b, a), *others = oustaloup_cascade(order, period, terms, low, high)
        cascades.append(((k * b, a), *others))
    return Sections(tuple(cascades))


def integer_pid(kd: float, ki: float, kp: float, period: float, terms: int = 10) -> Filter:
    """Return the paper's integer PID, kd D + ki D^-1 + kp with D from (2).

    Truncated after `terms`, D^-1 forgets: this controller has no integral action.

    Args:
        kd: derivative gain [N m s/rad].
        ki: integral gain [N m/(rad s)].
        kp: proportional gain [N m/rad].
        period: sampling period [s].
        terms: p in (2).

    Returns:
        b (terms + 1,) and a = [1].

    Raises:
        ControllerError: an argument is out of range.

    Source: section 3.2, last paragraph: nu_1 = nu_4 = 1, nu_2 = nu_5 = -1.
    """
    return fractional_pid(Gains(kd, 1.0, ki, -1.0, kp), period, "tustin", terms)


def textbook_pid(
    kp: float, ki: float, kd: float, period: float, filter_time: float = 0.0
) -> Filter:
    """Return kp + ki/s + kd s/(1 + filter_time s) by backward differences.

    The integrator is a true one, the running sum: after n samples of a unit error
    it holds exactly ki n T.

    Args:
        kp: proportional gain [N m/rad].
        ki: integral gain [N m/(rad s)].
        kd: derivative gain [N m s/rad].
        period: sampling period T [s].
        filter_time: time constant of the derivative's low-pass filter [s]; at zero
            it is the plain backward difference.

    Returns:
        b and a in powers of z^-1, a[0] = 1.

    Raises:
        ControllerError: an argument is out of range.
    """
    kp, ki, kd = check_finite("kp", kp), check_finite("ki", ki), check_finite("kd", kd)
    T, lag = check_positive("period", period), check_finite("filter_time", filter_time)
    if lag < 0.0:
        raise ControllerError(f"filter_time must be zero or more, got {filter_time!r}")
    total: Filter = (np.array([kp]), np.ones(1))
    if ki != 0.0:
        total = parallel(total, (np.array([ki * T]), np.array([1.0, -1.0])))
    if kd != 0.0:
        pole = np.array([1.0, -lag / (T + lag)]) if lag else np.ones(1)
        total = parallel(total, (kd / (T + lag) * np.array([1.0, -1.0]), pole))
    return total


def parallel(first: Filter, second: Filter) -> Filter:
    """Return the sum of two filters as one, over one denominator if they share it.

    Raises:
        ControllerError: their poles together are too many or too close to one
            another to survive as the coefficients of one polynomial.
    """
    (b1, a1), (b2, a2) = first, second
    if np.array_equal(a1, a2):
        return _add(b1, b2), a1
    b, a = _add(convolve(b1, a2), convolve(b2, a1)), convolve(a1, a2)
    part1, part2 = scipy.signal.freqz(b1, a1, PROBES)[1], scipy.signal.freqz(b2, a2, PROBES)[1]
    error = np.abs(scipy.signal.freqz(b, a, PROBES)[1] - part1 - part2)
    if (error > ROUNDING * (np.abs(part1) + np.abs(part2))).any():
        raise ControllerError(
            f"two filters of {a1.size - 1} and {a2.size - 1} poles cannot be written as one "
            "without rounding the poles away; take fewer terms"
        )
    return b, a


def _add(p: Array, q: Array) -> Array:
    """Return the sum of two polynomials in z^-1, the shorter padded by zeros."""
    total = np.zeros(max(p.size, q.size))
    total[: p.size] += p
    total[: q.size] += q
    return total
