"""The error of this package, and the checks that raise it.

Every message is one line: what was wrong, what was given, what would do.
"""

import math
from numbers import Integral

import numpy as np
from numpy.typing import NDArray

MOST_ORDER = 100.0
"""Largest magnitude of an order: a typing error far more likely than a wish."""


class ControllerError(ValueError):
    """A controller was asked for that cannot be built."""


def check_finite(name: str, value: float) -> float:
    """Return `value` as a float.

    Raises:
        ControllerError: it is no finite number.
    """
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise ControllerError(f"{name} must be a finite number, got {value!r}")
    return number


def check_positive(name: str, value: float) -> float:
    """Return `value` as a float.

    Raises:
        ControllerError: it is no finite number above zero.
    """
    number = check_finite(name, value)
    if number <= 0.0:
        raise ControllerError(f"{name} must be above zero, got {value!r}")
    return number


def check_order(name: str, value: float) -> float:
    """Return `value` as a float.

    Raises:
        ControllerError: it is no finite number from -100 to 100.
    """
    number = check_finite(name, value)
    if abs(number) > MOST_ORDER:
        raise ControllerError(
            f"{name} must lie from {-MOST_ORDER:g} to {MOST_ORDER:g}, got {value!r}"
        )
    return number


def check_terms(terms: int, most: int | None = None) -> int:
    """Return `terms` as an int.

    Raises:
        ControllerError: it is no whole number from 1 to `most`.
    """
    whole = isinstance(terms, Integral) and not isinstance(terms, bool)
    if not whole or terms < 1 or (most is not None and terms > most):
        wanted = "1 or more" if most is None else f"from 1 to {most}"
        raise ControllerError(f"terms must be a whole number, {wanted}, got {terms!r}")
    return int(terms)


def check_coefficients(
    b: NDArray[np.float64], a: NDArray[np.float64], order: float, period: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the filter `(b, a)` as given.

    Raises:
        ControllerError: a coefficient overflowed.
    """
    if not (np.isfinite(b).all() and np.isfinite(a).all()):
        raise ControllerError(
            f"order {order:g} at a period of {period:g} s overflows; "
            "choose an order of smaller magnitude"
        )
    return b, a
