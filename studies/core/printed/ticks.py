"""Ticks of logarithmic axes that can be read: round numbers, from three on, all in one manner.

>>> axis.set_major_locator(PlainLog())                   # doctest: +SKIP
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.ticker import Formatter, Locator, LogLocator, MaxNLocator

MINUS = "\u2212"


class PlainLog(Locator):
    """Ticks of a logarithmic axis that can be read: from three on, at round numbers."""

    STEPS = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
    LEAST = 3

    def __init__(self, most: int = 6):
        self.most = most

    def __call__(self) -> Any:
        """Return the ticks in view."""
        axis: Any = self.axis
        return self.tick_values(*axis.get_view_interval())

    def tick_values(self, vmin: float, vmax: float) -> Any:
        """Return ticks between two values."""
        return self._found(vmin, vmax)[0]

    def _found(self, vmin: float, vmax: float) -> tuple[Any, int]:
        """Return ticks, and how many decades apart they are, 0 for less than one."""
        low, high = sorted((max(vmin, 1e-300), max(vmax, 1e-300)))
        powers = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
        for steps in self.STEPS:
            ticks = np.sort(np.outer(10.0**powers, steps).ravel())
            ticks = ticks[(ticks >= low * (1 - 1e-9)) & (ticks <= high * (1 + 1e-9))]
            if len(ticks) >= self.LEAST:
                apart = -(-len(ticks) // self.most) if len(steps) == 1 else 0
                return ticks[:: max(apart, 1)], apart
        ticks = np.asarray(MaxNLocator(4).tick_values(low, high))
        return ticks[(ticks >= low) & (ticks <= high)], 0


class Between(PlainLog):
    """The small ticks between those: at 2 to 9 of a decade, or at the decades that are left out."""

    def tick_values(self, vmin: float, vmax: float) -> Any:
        """Return ticks between two values."""
        _, apart = self._found(vmin, vmax)
        subs = (1.0,) if apart > 1 else range(2, 10)
        return LogLocator(subs=subs, numticks=100).tick_values(vmin, vmax)


class PlainNumbers(Formatter):
    """Numbers as ticks show them: all plain, or all as powers of ten where some are far from 1."""

    _powers = False

    def format_ticks(self, values: Any) -> list[str]:
        """Return the texts of all ticks, in one manner."""
        self._powers = any(each != 0 and not 1e-3 <= abs(each) < 1e4 for each in values)
        return [self(each) for each in values]

    def __call__(self, value: float, pos: int | None = None) -> str:
        """Return one tick's text, as the last ticks' manner is."""
        if value == 0 or not self._powers:
            return f"{value:g}".replace("-", MINUS)
        digits, power = f"{value:e}".split("e")
        factor = "" if float(digits) == 1 else f"{float(digits):g}" + r"\cdot "
        return f"${factor}10^{{{int(power)}}}$"
