"""One loop at one pose: growth as it is and undamped, margins, poles, and what a simulation shows.

>>> loop_row(plant, undamped, controller, 1.5, options, slack=0.0).delay_margin
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexsim.linear.delay_margin import delay_margin
from flexsim.linear.growth import quantised
from flexsim.linear.loop_poles import LinearLoop, LoopOptions, linear_loop
from flexsim.linear.margins import common_gains, margins
from flexsim.loop.control.stacking import stack
from flexsim.plants.base import Plant
from studies.stability.rows import LoopRow
from studies.stability.simulated import simulated_growth
from studies.tuning.found import AnyController, label_of

POLES_SHOWN = 4
EXACT = "exact"  # the name of the beam that is not stepped


def held(plant: Plant, options: LoopOptions) -> LoopOptions:
    """Return the options with the hold that a plant can have."""
    return replace(options, hold="exact") if plant.name == EXACT else options


def loop_row(
    plant: Plant,
    undamped: Plant,
    devised: AnyController,
    theta2: float,
    options: LoopOptions,
    slack: float,
) -> LoopRow:
    """Return one line of the table.

    Args:
        plant, undamped: with and without damping in its beam. theta2: [rad].
        options: whose hold counts, but of the exact beam. slack: growth called stable [1/s].
    """
    own = held(plant, options)
    stacked = stack([devised], own.period)
    exact = linear_loop(plant, theta2, stacked, replace(own, hold="exact"))
    stepped = None
    if plant.name != EXACT:
        stepped = linear_loop(plant, theta2, stacked, replace(own, hold="stepped"))
    loop = exact if stepped is None or own.hold == "exact" else stepped
    growth = float(quantised(loop.growth_rate))
    free = float(quantised(linear_loop(undamped, theta2, stacked, own).growth_rate))
    each = {joint: margins(loop, joint) for joint in (0, 1)}
    both = common_gains(loop)
    lows = [both[0], *(found.gain_low for found in each.values())]
    highs = [both[1], *(found.gain_high for found in each.values())]
    return LoopRow(
        plant=plant.name,
        controllers=label_of(devised),
        theta2=theta2,
        hold=own.hold,
        stable=growth <= slack,
        growth=growth,
        growth_undamped=free,
        fastest_hz=float(np.abs(np.angle(loop.poles[0])) / (2 * np.pi * own.period)),
        delay_margin=delay_margin([exact.sampled], stacked),
        gain_margin=1.0 if growth > 0 else min(highs),
        gain_margin_low=1.0 if growth > 0 else max(lows),
        spectral_radius=loop.spectral_radius,
        growth_exact=exact.growth_rate,
        growth_stepped=None if stepped is None else stepped.growth_rate,
        growth_simulated=None if stepped is None else simulated_growth(plant, stepped, own),
        margins={
            f"{name}_{joint + 1}": getattr(found, name)
            for joint, found in each.items()
            for name in ("gain_low", "gain_high", "phase", "omega_phase")
        }
        | {"gain_low_both": both[0], "gain_high_both": both[1]},
        poles=_poles(loop),
    )


def _poles(loop: LinearLoop) -> dict[str, float]:
    """Return moduli and frequencies [rad/s] of the largest poles, conjugates once."""
    upper = loop.poles[loop.poles.imag >= 0][:POLES_SHOWN]
    found = {}
    for i, pole in enumerate(upper, start=1):
        found[f"pole_{i}_modulus"] = float(np.abs(pole))
        found[f"pole_{i}_omega"] = float(np.angle(pole)) / loop.sampled.period
    return found
