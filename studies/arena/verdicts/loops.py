"""What the exact linear loops of tuned controllers say: growth, delay, sensitivity, overshoot.

>>> found = loop_numbers(controllers, plants, theta2, options)
>>> margin_row("pid", found, seed=1)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from flexsim.linear.delay_margin import delay_margin
from flexsim.linear.growth import quantised
from flexsim.linear.loop_poles import LinearLoop, LoopOptions, linear_loop
from flexsim.loop.control.stacking import stack
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from studies.arena.rows import MarginRow
from studies.arena.verdicts.scoring import estimated
from studies.rules.loops import curves_of


class LoopNumbers(NamedTuple):
    """Of S controllers; nan where a loop grows.

    growth (S,) [1/s]; delay (S,) borne [s]; peaks (S, 2) Ms of either joint; overshoot (S,) of
    joint 2's step without payload [-]; spread (S,) of it over payloads [-], nan where one grows.
    """

    growth: Array
    delay: Array
    peaks: Array
    overshoot: Array
    spread: Array


def loop_numbers(
    controllers: Sequence[Any], plants: Sequence[Plant], theta2: float, options: LoopOptions
) -> LoopNumbers:
    """Return what linear loops say of every controller.

    Args:
        controllers: S. plants: without payload, then with ever more. theta2: of the pose [rad].
        options: of the loops.
    """
    rows = []
    for each in controllers:
        stacked = stack([each], options.period)
        loops = [linear_loop(plant, theta2, stacked, options) for plant in plants]
        overshoots = [_overshoot(loop) for loop in loops]
        rows.append((*_of(loops[0]), overshoots[0], np.ptp(overshoots)))
    growth, delay, peak_1, peak_2, overshoot, spread = np.array(rows).reshape(-1, 6).T
    return LoopNumbers(growth, delay, np.column_stack([peak_1, peak_2]), overshoot, spread)


def margin_row(contestant: str, found: LoopNumbers, seed: int) -> MarginRow:
    """Return a class's medians over its searches; seed: of the interval's draws."""
    spread = found.spread[np.isfinite(found.spread)]
    low = high = None
    if spread.size:
        drawn = estimated(lambda each: np.median(each, axis=(-3, -2, -1)), [of_task(spread)], seed)
        low, high = drawn.low, drawn.high
    return MarginRow(
        contestant,
        seeds=len(found.growth),
        grows=float((found.growth > 0).mean()),
        delay_margin=_median(found.delay),
        peak_1=_median(found.peaks[:, 0]),
        peak_2=_median(found.peaks[:, 1]),
        overshoot=_median(found.overshoot),
        loaded=spread.size / len(found.growth),
        spread=_median(spread),
        spread_low=low,
        spread_high=high,
    )


def of_task(values: Array) -> Array:
    """Return one number a search (S,) as samples of one task without repeats (1, S, 1)."""
    return values[None, :, None]


def _median(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else None


def _of(loop: LinearLoop) -> tuple[float, float, float, float]:
    """Return growth [1/s], delay borne [s], Ms of both joints."""
    growth = float(quantised(loop.growth_rate))
    if growth > 0:
        return growth, np.nan, np.nan, np.nan
    late = float(delay_margin([loop.sampled], loop.controllers))
    curves = curves_of("", loop)
    peaks = (1.0 / np.abs(1.0 + curves.loops)).max(axis=1)
    return growth, late, float(peaks[0]), float(peaks[1])


def _overshoot(loop: LinearLoop) -> float:
    """Return that of joint 2's step [-], nan of a loop that grows."""
    if float(quantised(loop.growth_rate)) > 0:
        return np.nan
    return max(0.0, float(curves_of("", loop).steps[1].max()) - 1.0)
