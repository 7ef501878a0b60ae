"""Which pairs (k, nu) keep the loop stable? Maps of the leading gain and order of each joint.

Gains are drawn and shown in N m ms^nu/rad, time in milliseconds, where Table 1's numbers and
Table 2's agree (`Gains.from_milliseconds`).
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from controllers import Controller, Gains, fractional_pid
from flexsim.errors import RunError
from flexsim.linear.growth import growth_rates
from flexsim.linear.loop_poles import LoopOptions, spectral_radii
from flexsim.loop.compiled_loop import stack_filters
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from studies.stability.simulated import simulated_rates

TABLE_1 = {  # means and standard deviations, gains for time in milliseconds
    "mean": np.array([1e4, 0, 1, 0, 1e-2, 1e2, 0, 1, 0, 1e-2]),
    "sd": np.array([2000, 2, 0.1, 0.1, 0.1, 20, 2, 0.1, 0.1, 0.1]),
}
MAP_DECADES = 1.0  # of k, to either side of Table 1's mean
MAP_ORDERS = (-0.5, 1.0)  # beyond, nothing is stable, though Table 1 draws nu from 0 +- 2
COMPARED = 200  # draws that are also simulated
SIMULATED = 1500  # samples
RATE_SHOWN = 100.0  # [1/s] end of the colours
STABLE_COLOUR = "#7fbf9f"
LEAST_SHOWN = 1e-3  # [1/s] start of the colours where the slack is less
DPI = 100


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
    mean = float(TABLE_1["mean"][5 * joint])
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
    radii = spectral_radii(plant, theta2, *stack_filters(pairs), options)
    growth = growth_rates(radii, options.period).reshape(points, points)
    order = float(gains.nu1 or 0.0)
    own = (gains.k1 * 1000.0**order, order)
    return StabilityMap(plant.name, devised.name, joint + 1, theta2, k, nu, growth, own)


def draw(count: int, rng: np.random.Generator) -> list[Any]:
    """Return filters of random controllers as Table 1 distributes them.

    Source: Table 1, with time in milliseconds.
    """
    numbers = TABLE_1["mean"] + TABLE_1["sd"] * rng.standard_normal((count, 10))
    return [
        tuple(
            fractional_pid(Gains.from_milliseconds(*(float(x) for x in half)), 1e-3)
            for half in (row[:5], row[5:])
        )
        for row in numbers
    ]


def screen(
    plant: Plant,
    theta2: float,
    options: LoopOptions,
    draws: int,
    slack: float,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Return the share of random draws that is stable, what a draw costs, and a simulation's view.

    The simulation knows nothing of the linear model: stable is where its errors do not grow.
    """
    b, a = stack_filters(draw(draws, rng))
    start = time.perf_counter()
    growth = growth_rates(spectral_radii(plant, theta2, b, a, options), options.period)
    seconds = time.perf_counter() - start
    part = slice(0, min(draws, COMPARED))
    rates = simulated_rates(plant, theta2, (b[part], a[part]), options, SIMULATED)
    agree = (growth[part] <= slack) == (rates <= slack)
    return {
        "plant": plant.name,
        "theta2": theta2,
        "draws": draws,
        "stable_share": float(np.mean(growth <= slack)),
        "seconds_per_draw": seconds / draws,
        "compared": len(agree),
        "agreement": float(np.mean(agree)),
    }


def map_figure(maps: Sequence[StabilityMap], slack: float, path: Path) -> None:
    """Write maps as one figure, a row per controller, a column per joint.

    Args:
        maps: of one plant. slack: growth up to which a loop counts as stable [1/s].
        path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    rows = math.ceil(len(maps) / 2)
    figure = Figure(figsize=(12.0, 1.0 + 4.0 * rows), dpi=DPI, layout="constrained")
    grid = figure.subplots(rows, 2, squeeze=False)
    lowest = max(slack, LEAST_SHOWN)
    norm = LogNorm(lowest, RATE_SHOWN)
    colours = colormaps["YlOrRd"].with_extremes(under=STABLE_COLOUR)
    for axes, each in zip(grid.ravel(), maps, strict=False):
        growth = np.where(each.growth <= slack, lowest / 2, np.maximum(each.growth, lowest))
        axes.pcolormesh(each.k, each.nu, growth, cmap=colours, norm=norm, shading="nearest")
        axes.plot(*each.own, "*", color="0.1", markersize=13)
        axes.set_xscale("log")
        axes.set(
            xlabel=f"$k_{3 * each.joint - 2}$ [N m ms$^\\nu$/rad]",
            ylabel=f"$\\nu_{3 * each.joint - 2}$",
            title=f"controllers {each.controllers}, joint {each.joint}",
        )
    label = "growth of the slowest-decaying motion [1/s]"
    figure.colorbar(ScalarMappable(norm, colours), ax=grid, label=label, extend="both")
    figure.suptitle(
        f"{maps[0].plant}, theta2 = {maps[0].theta2:.3f} rad: green is stable "
        f"(growth up to {slack:g} 1/s); star: the controller"
    )
    try:
        figure.savefig(path, metadata={"Software": "flexsim"})
    except OSError as error:
        raise RunError(f"cannot write the figure {path}: {error}") from error
