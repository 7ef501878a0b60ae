"""Which pairs (k, nu) keep the loop stable? Maps of the leading gain and order of each joint.

Gains are drawn and shown in N m ms^nu/rad, time in milliseconds, where Table 1's numbers and
Table 2's agree (`Gains.from_milliseconds`).
"""

from __future__ import annotations

from collections.abc import Sequence
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
from studies.tuning.found import AnyController, FoundController, label_of
from studies.tuning.individuals import TEXTBOOK, Filters

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


def has_map(devised: AnyController) -> bool:
    """Return whether a controller has orders to vary: textbook PIDs do not."""
    if isinstance(devised, FoundController):
        return devised.tuning.realisation != TEXTBOOK
    return isinstance(devised, Controller)


def stability_map(
    plant: Plant,
    devised: AnyController,
    joint: int,
    theta2: float,
    options: LoopOptions,
    points: int,
) -> StabilityMap:
    """Return the map of one joint's (k, nu), points x points; joint: 0 or 1."""
    mean = float(MEAN[5 * joint])
    k = mean * np.logspace(-MAP_DECADES, MAP_DECADES, points)
    nu = np.linspace(*MAP_ORDERS, points)
    pairs = _varied(devised, joint, np.tile(k, points), np.repeat(nu, points), options.period)
    able = [i for i, pair in enumerate(pairs) if pair is not None]
    growth = np.full(points * points, np.inf)
    stacked = stack([pairs[i] for i in able], options.period)
    growth[able] = growth_rates(spectral_radii(plant, theta2, stacked, options), options.period)
    grid = growth.reshape(points, points)
    own = _leading(devised, joint)
    return StabilityMap(plant.name, label_of(devised), joint + 1, theta2, k, nu, grid, own)


def _leading(devised: AnyController, joint: int) -> tuple[float, float]:
    """Return a joint's leading gain [N m ms^nu/rad] and order."""
    if isinstance(devised, FoundController):
        k, nu = devised.parameters[5 * joint : 5 * joint + 2]
        return float(k), float(nu)
    assert isinstance(devised, Controller)  # see `has_map`
    gains = devised.joint2 if joint else devised.joint1
    order = float(gains.nu1 or 0.0)
    return gains.k1 * 1000.0**order, order


def _varied(
    devised: AnyController, joint: int, k: Array, nu: Array, period: float
) -> Sequence[Filters | None]:
    """Return filters with a joint's leading gains (K,) [N m ms^nu/rad] and orders (K,) instead."""
    if isinstance(devised, FoundController):
        parameters = np.tile(devised.parameters, (len(k), 1))
        parameters[:, 5 * joint], parameters[:, 5 * joint + 1] = k, nu
        return devised.tuning.design.filters(parameters)
    assert isinstance(devised, Controller)
    gains = devised.joint2 if joint else devised.joint1
    fixed = devised.filters(period)
    pairs: list[Filters | None] = []
    for gain, order in zip(k, nu, strict=True):
        changed = replace(gains, k1=gain / 1000.0**order, nu1=float(order))
        mine = fractional_pid(changed, period)
        pairs.append((fixed[0], mine) if joint else (mine, fixed[1]))
    return pairs


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
