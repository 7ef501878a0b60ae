"""Which pairs (k, nu) keep the loop stable? Maps of the leading gain and order of each joint.

Gains are drawn and shown in N m ms^nu/rad, time in milliseconds, where Table 1's numbers and
Table 2's agree (`Gains.from_milliseconds`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from controllers import Controller, Gains, fractional_pid
from flexsim.linear.growth import growth_rates
from flexsim.linear.loop_poles import LoopOptions, spectral_radii
from flexsim.loop.control.stacking import stack
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from studies.tuning.distributions import TABLE_1

MEAN, DEVIATION = np.transpose([draw.numbers for draw in TABLE_1.draws])  # time in milliseconds
MAP_DECADES = 1.0  # of k, to either side of Table 1's mean
MAP_ORDERS = (-0.5, 1.0)  # beyond, nothing is stable, though Table 1 draws nu from 0 +- 2


@dataclass(frozen=True, eq=False)
class StabilityMap:
    """Growth rates over leading gain and order of one joint, all else as in the controller.

    Attributes:
        plant, controllers: names. joint: 1 or 2. theta2: pose [rad].
        k: (N,) [N m ms^nu/rad]; nu: (N,); growth: (N, N), a row per nu [1/s].
        own: (k, nu) of the controller itself.
    """

    plant: str
    controllers: str
    joint: int
    theta2: float
    k: Array
    nu: Array
    growth: Array
    own: tuple[float, float]


def stability_map(
    plant: Plant, devised: Controller, joint: int, theta2: float, options: LoopOptions, points: int
) -> StabilityMap:
    """Return the map of one joint's (k, nu), points x points; joint: 0 or 1."""
    mean = float(MEAN[5 * joint])
    k = mean * np.logspace(-MAP_DECADES, MAP_DECADES, points)
    nu = np.linspace(*MAP_ORDERS, points)
    gains = devised.joint2 if joint else devised.joint1
    fixed = devised.filters(options.period)
    pairs = []
    for order in nu:
        for gain in k:
            changed = replace(gains, k1=gain / 1000.0**order, nu1=float(order))
            mine = fractional_pid(changed, options.period)
            pairs.append((fixed[0], mine) if joint else (mine, fixed[1]))
    radii = spectral_radii(plant, theta2, stack(pairs, options.period), options)
    growth = growth_rates(radii, options.period).reshape(points, points)
    order = float(gains.nu1 or 0.0)
    own = (gains.k1 * 1000.0**order, order)
    return StabilityMap(plant.name, devised.name, joint + 1, theta2, k, nu, growth, own)


def draw(count: int, rng: np.random.Generator) -> list[Any]:
    """Return filters of random controllers as Table 1 distributes them.

    Source: Table 1, with time in milliseconds.
    """
    numbers = MEAN + DEVIATION * rng.standard_normal((count, 10))
    return [
        tuple(
            fractional_pid(Gains.from_milliseconds(*(float(x) for x in half)), PERIOD)
            for half in (row[:5], row[5:])
        )
        for row in numbers
    ]
