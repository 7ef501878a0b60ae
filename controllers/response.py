"""How well does a digital filter act as gain (j omega)^order?

error = response_error(b, a, order=0.5, gain=1.0, omega=w, period=1e-3)
error.magnitude_db, error.phase_deg
"""

import math
from typing import NamedTuple

import numpy as np
import scipy  # its signal package, half a second, is loaded where it is used
from numpy.typing import ArrayLike, NDArray

from controllers.errors import ControllerError, check_finite, check_order, check_positive
from controllers.series import Array

NYQUIST_SLACK = 1e-9
"""Relative; a frequency grid that ends at pi/period may miss it by rounding."""


class ResponseError(NamedTuple):
    """What a filter's response misses the wanted one by, at every frequency."""

    relative: NDArray[np.complex128]
    """(n,) response / wanted - 1."""
    magnitude_db: Array
    """(n,) magnitude of response / wanted [dB]."""
    phase_deg: Array
    """(n,) phase of response / wanted [deg], from -180 to 180."""


def frequency_response(
    b: ArrayLike, a: ArrayLike, omega: ArrayLike, period: float
) -> NDArray[np.complex128]:
    """Return the filter's response at the angular frequencies, infinite at a pole.

    Args:
        b: numerator, in powers of z^-1.
        a: denominator.
        omega: angular frequencies [rad/s] (n,).
        period: sampling period [s].

    Returns:
        b(z)/a(z) at z = exp(j omega period), (n,).

    Raises:
        ControllerError: the period is not above zero.
    """
    T = check_positive("period", period)
    with np.errstate(divide="ignore", invalid="ignore"):
        _, response = scipy.signal.freqz(b, a, worN=np.atleast_1d(np.asarray(omega, float)) * T)
    return np.asarray(response, dtype=np.complex128)


def response_error(
    b: ArrayLike, a: ArrayLike, order: float, gain: float, omega: ArrayLike, period: float
) -> ResponseError:
    """Return the error of the filter against gain (j omega)^order.

    Args:
        b: numerator, in powers of z^-1.
        a: denominator.
        order: nu, any real number.
        gain: factor in front, not zero.
        omega: angular frequencies [rad/s] (n,), above 0 up to pi/period.
        period: sampling period [s].

    Returns:
        The relative, magnitude and phase errors, (n,) each.

    Raises:
        ControllerError: an argument is out of range.
    """
    nu, k = check_order("order", order), check_finite("gain", gain)
    T = check_positive("period", period)
    if k == 0.0:
        raise ControllerError("gain must not be zero: an error relative to it has no meaning")
    w = np.atleast_1d(np.asarray(omega, float))  # (n,)
    if not ((w > 0.0) & (w <= math.pi / T * (1.0 + NYQUIST_SLACK))).all():
        raise ControllerError(
            f"omega must lie above 0 and up to pi/period = {math.pi / T:g} rad/s, "
            f"got {w.min():g} to {w.max():g}"
        )
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = frequency_response(b, a, w, T) / (k * (1j * w) ** nu)
        magnitude_db = 20.0 * np.log10(np.abs(ratio))
    return ResponseError(ratio - 1.0, magnitude_db, np.degrees(np.angle(ratio)))
