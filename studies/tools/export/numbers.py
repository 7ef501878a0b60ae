"""Numbers as every language here reads them back: 17 significant digits, a few on a line."""

from __future__ import annotations

from collections.abc import Iterable

from flexsim.numerics.types import Array

ON_A_LINE = 3


def number(value: float) -> str:
    """Return a number that reads back to the same double, and as one in C."""
    return f"{value:.16e}"


def listed(values: Iterable[float] | Array, indent: str, end: str = "") -> str:
    """Return numbers with commas, ON_A_LINE on a line, later lines indented.

    Args:
        values: as named. indent: of later lines. end: of a line that goes on, as MATLAB needs.
    """
    texts = [number(float(each)) for each in values]
    lines = [texts[i : i + ON_A_LINE] for i in range(0, len(texts), ON_A_LINE)]
    return f",{end}\n{indent}".join(", ".join(line) for line in lines)
