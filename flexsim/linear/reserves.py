"""How far is the exact linear loop from growing? Growth, its pole, delay and gains to spare.

>>> found = reserves(exact_loops(Parameters(), (0.8, 1.5, 2.2)), stack([controller], period=1e-3))
>>> found.growth, found.delay_margin, found.gain_margin
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexsim.errors import ParameterError
from flexsim.linear.delay_margin import delay_margin
from flexsim.linear.growth import quantised
from flexsim.linear.loop_poles import LinearLoop, SampledPlant
from flexsim.linear.margins import common_gains, margins
from flexsim.loop.control.compiled import Controllers


@dataclass(frozen=True)
class Reserves:
    """What loops have to spare, the least over several plants.

    Attributes:
        growth: the largest [1/s], in whole multiples of 1e-6. fastest_hz: of that pole [Hz].
        delay_margin: extra delay of both torques at which one grows [s]; 0 if one does already.
        gain_margin, gain_margin_low: factors nearest to 1, above and below, of either joint's loop
            gain or of both at once at which one grows; 1 if one does already.
        gains: (low, high) of joint 1's, of joint 2's and of both; 0 and inf where there is none.
    """

    growth: float
    fastest_hz: float
    delay_margin: float
    gain_margin: float
    gain_margin_low: float
    gains: tuple[tuple[float, float], ...]

    @property
    def grows(self) -> bool:
        """Whether a motion grows."""
        return self.growth > 0


def reserves(loops: Sequence[SampledPlant], controllers: Controllers) -> Reserves:
    """Return growth and margins of one controller, the worst over plants.

    Args:
        loops: under exact hold, one or more. controllers: one.

    Raises:
        ParameterError: no plant, more than one controller, or another hold.
    """
    if not loops or len(controllers.b) != 1:
        raise ParameterError(
            f"{len(loops)} plants and {len(controllers.b)} controllers are given; "
            "give one plant or more, and one controller"
        )
    closed = [LinearLoop(each, controllers) for each in loops]
    worst = max(closed, key=lambda loop: loop.growth_rate)
    growth = float(quantised(worst.growth_rate))
    each = [
        [_ends(loop, joint) for joint in (0, 1)] + [common_gains(loop)] for loop in closed
    ]  # loops, then joint 1, joint 2, both
    gains = tuple(
        (max(low for low, _ in one), min(high for _, high in one))
        for one in zip(*each, strict=True)
    )
    return Reserves(
        growth=growth,
        fastest_hz=float(np.abs(np.angle(worst.poles[0])) / (2 * np.pi * worst.sampled.period)),
        delay_margin=delay_margin(loops, controllers),
        gain_margin=1.0 if growth > 0 else min(high for _, high in gains),
        gain_margin_low=1.0 if growth > 0 else max(low for low, _ in gains),
        gains=gains,
    )


def _ends(loop: LinearLoop, joint: int) -> tuple[float, float]:
    found = margins(loop, joint)
    return found.gain_low, found.gain_high
