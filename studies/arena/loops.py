"""What the exact linear loops of tuned controllers say: growth, delay, sensitivity, overshoot.

>>> margin_row("pid", controllers, plant, loaded, theta2, options, v_gain=-1.0)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from flexsim.linear.delay_margin import delay_margin
from flexsim.linear.growth import quantised
from flexsim.linear.loop_poles import LinearLoop, LoopOptions, linear_loop
from flexsim.loop.control.stacking import stack
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from studies.arena.rows import MarginRow
from studies.rules.loops import curves_of


def margin_row(
    contestant: str,
    controllers: Sequence[Any],
    plant: Plant,
    loaded: Plant,
    theta2: float,
    options: LoopOptions,
) -> MarginRow:
    """Return a class's medians over seeds.

    Args:
        controllers: one a seed. plant: that they were tuned on. loaded: the same with a payload.
        theta2: of the pose [rad]. options: of the loops.
    """
    found = []
    for each in controllers:
        stacked = stack([each], options.period)
        loops = [linear_loop(its, theta2, stacked, options) for its in (plant, loaded)]
        found.append((*_of(loops[0]), _overshoot(loops[1])))
    values = np.array(found)  # (seeds, 6): growth, delay, Ms, Ms, overshoot, overshoot loaded
    grows = values[:, 0] > 0
    middle = [_median(values[~grows, k]) for k in range(1, values.shape[1])]
    return MarginRow(contestant, len(values), float(grows.mean()), *middle)


def _median(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else None


def _of(loop: LinearLoop) -> tuple[float, float, float, float, float]:
    """Return growth [1/s], delay borne [s], Ms of both joints, overshoot of joint 2."""
    growth = float(quantised(loop.growth_rate))
    if growth > 0:
        return growth, np.nan, np.nan, np.nan, np.nan
    late = float(delay_margin([loop.sampled], loop.controllers))
    curves = curves_of("", loop)
    peaks = (1.0 / np.abs(1.0 + curves.loops)).max(axis=1)
    return growth, late, float(peaks[0]), float(peaks[1]), _overshoot(loop)


def _overshoot(loop: LinearLoop) -> float:
    """Return that of joint 2's step [-], nan of a loop that grows."""
    if float(quantised(loop.growth_rate)) > 0:
        return np.nan
    return max(0.0, float(curves_of("", loop).steps[1].max()) - 1.0)
