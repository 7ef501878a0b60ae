"""Figures as text, with the digits that their interval supports.

>>> with_interval(5.4137e-3, 5.38e-3, 5.441e-3, scale=1e3)
'5.41 [5.38, 5.44]'

The last digit is the first one of the interval's half-width, rounded: what comes after would be
moved by another set of repeats.
"""

from __future__ import annotations

import math

MOST = 2  # decimals, unless told otherwise
UNKNOWN = 1  # decimals of a figure without interval


def decimals(low: float | None, high: float | None, scale: float = 1.0, most: int = MOST) -> int:
    """Return how many decimals an interval supports, 0 to `most`.

    Args:
        low, high: None where there is no interval. scale: from its unit to the one printed.
    """
    if low is None or high is None or not math.isfinite(high - low):
        return min(UNKNOWN, most)
    half = scale * (high - low) / 2
    if half <= 0:
        return most
    exponent = int(f"{half:.0e}".partition("e")[2])  # of the half-width, rounded to one digit
    return min(max(-exponent, 0), most)


def supported(
    value: float | None,
    low: float | None,
    high: float | None,
    scale: float = 1.0,
    most: int = MOST,
    sign: str = "",
) -> str:
    """Return a figure with the decimals that its interval supports; '-' for None.

    Args: as `decimals`; sign: '+' to show that of what is above 0, too.
    """
    if value is None or not math.isfinite(value):
        return "-"
    return f"{scale * value:{sign}.{decimals(low, high, scale, most)}f}"


def with_interval(
    value: float | None,
    low: float | None,
    high: float | None,
    scale: float = 1.0,
    most: int = MOST,
) -> str:
    """Return a figure and its interval, 'value [low, high]', in the digits that this supports.

    An end that is not known, as where runs diverged, is written '?'; without any, neither is.
    """
    shown = supported(value, low, high, scale, most)
    if low is None and high is None:
        return shown
    digits = decimals(low, high, scale, most)
    ends = (
        "?" if end is None or not math.isfinite(end) else f"{scale * end:.{digits}f}"
        for end in (low, high)
    )
    return f"{shown} [{', '.join(ends)}]"


def percent(share: float, low: float, high: float) -> str:
    """Return a share and its interval in per cent: '5 % [1, 24]'."""
    return f"{100 * share:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"
