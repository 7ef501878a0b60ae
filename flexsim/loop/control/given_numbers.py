"""Numbers as they are given, checked: finite, real, of the right shape and sampling period."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array

SAME_PERIOD = 1e-9  # relative; what arithmetic makes of a sampling period
SHOWN = 60  # characters of a value in a message
CONJUGATE = 1e-9  # relative to the largest root, by which two conjugates may differ


def shape_of(part: Any) -> tuple[int, ...]:
    """Return the shape of what may be anything, (0, 0) where rows differ in length."""
    try:
        return np.shape(part)
    except ValueError:
        return 0, 0


def shown(value: Any) -> str:
    """Return numbers as one short line."""
    return textwrap.shorten(str(value), SHOWN, placeholder=" ...")


def same_period(dt: Any, period: float) -> None:
    """Refuse a sampling period that is none, or another."""
    if isinstance(dt, bool | np.bool_) or dt is None:
        raise ParameterError(f"a system without a sampling period; give it dt = {period:g}")
    number = float(real_numbers(dt, "its sampling period", 0))
    if number == 0:
        raise ParameterError(f"a continuous system; discretise it first, at {period:g} s")
    if not math.isclose(number, period, rel_tol=SAME_PERIOD):
        raise ParameterError(
            f"its sampling period is {number:g} s, the loop's {period:g}; design it for that"
        )


def real_numbers(value: Any, name: str, ndim: int) -> Array:
    """Return finite real numbers of so many dimensions."""
    try:
        numbers = np.asarray(value)
    except ValueError:
        raise ParameterError(f"{name} has rows of different lengths") from None
    if numbers.dtype.kind == "c":
        raise ParameterError(f"{name} is complex; give real numbers")
    if numbers.dtype.kind not in "iuf" or numbers.ndim != ndim:
        form = ("a number", "numbers in a row", "a matrix of numbers")[ndim]
        raise ParameterError(f"{name} has shape {numbers.shape}; give {form}")
    if not np.isfinite(numbers).all():
        raise ParameterError(f"{name} is {shown(value)}; give finite numbers")
    return numbers.astype(float)


def real_or_paired(given: Any, name: str) -> Any:
    """Return finite roots in a row, closed under conjugation."""
    try:
        roots = np.atleast_1d(np.asarray(given)).astype(complex)
    except (TypeError, ValueError):
        raise ParameterError(f"{name} are {shown(given)}; give numbers in a row") from None
    if roots.ndim != 1 or not np.isfinite(roots).all():
        raise ParameterError(f"{name} are {shown(given)}; give finite numbers in a row")
    upper, lower = (np.sort_complex(x[x.imag > 0]) for x in (roots, roots.conj()))
    if not _alike(upper, lower):
        raise ParameterError(f"{name} are {shown(given)}; give complex ones with their conjugates")
    return roots


def _alike(upper: Any, lower: Any) -> bool:
    """Return whether every root of one set has its own in the other, to rounding."""
    left = list(lower)
    for root in upper:
        if not left:
            return False
        nearest = min(left, key=lambda other: abs(other - root))
        if abs(nearest - root) > CONJUGATE * abs(root):
            return False
        left.remove(nearest)
    return not left
