"""Poles, margins and screenings in tables and words; maps of stable gains as figures.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from studies.core.figures import DPI
from studies.core.table import Column, Table
from studies.stability.maps import StabilityMap

RATE_SHOWN = 100.0  # [1/s] end of the colours
LEAST_SHOWN = 1e-3  # [1/s] start of the colours where the slack is less
STABLE_COLOUR = "#7fbf9f"
MAP_WIDTH = 12.0  # [in]


@dataclass(frozen=True)
class LoopRow:
    """One loop at one pose: rates in 1/s, angles in rad.

    Attributes:
        growth_simulated: None where no law of friction has both a torque gain and damping.
        margins: of both joints; of a loop that is not stable they are where it would next cross
            the unit circle. poles: moduli and frequencies [rad/s] of the largest.
    """

    plant: str
    controllers: str
    theta2: float
    hold: str
    stable: bool
    spectral_radius: float
    growth_exact: float
    growth_stepped: float
    growth_simulated: float | None
    margins: Mapping[str, float]
    poles: Mapping[str, float]

    @property
    def loop(self) -> str:
        """Plant and controllers in short."""
        return f"{self.plant.removeprefix('assumed-')}: {self.controllers}"


@dataclass(frozen=True)
class DrawsRow:
    """How many random draws hold, what each costs, and whether a simulation agrees."""

    plant: str
    theta2: float
    draws: int
    stable_share: float
    seconds_per_draw: float
    compared: int
    agreement: float


@dataclass(frozen=True, eq=False)
class StabilityResult:
    """Rows of the table, maps, rows of random draws; the growth called stable [1/s]."""

    rows: list[LoopRow]
    maps: list[StabilityMap]
    draws: list[DrawsRow]
    slack: float


def _growth(hold: str) -> Column:
    """Return the column of a hold's growth, marked where it is the one that counts."""

    def text(row: LoopRow) -> str:
        mark = "!" if row.hold == hold and not row.stable else ""
        return f"{getattr(row, f'growth_{hold}'):+.2g}{mark}"

    return Column(f"growth_{hold}", "growth" if hold == "stepped" else hold, form=text)


def _gains(joint: int) -> Column:
    """Return the column of a joint's gain margins."""

    def text(row: LoopRow) -> str:
        low, high = (row.margins[f"gain_{end}_{joint}"] for end in ("low", "high"))
        return f"{low:.1g}-{high:.2g}"

    return Column("margins", f"gain {joint}", form=text)


COLUMNS = (
    Column("loop", "plant: loop"),
    Column("theta2", form=".2f"),
    _growth("stepped"),
    Column("growth_simulated", "simulated", form="+.2g"),
    _growth("exact"),
    _gains(1),
    _gains(2),
)
NOTE = """\
Growth of the slowest-decaying motion [1/s] as stepped, ! above the slack; as
the nonlinear simulation shows it; without the steps' damping. Gains: factors of
the loop gain of a joint at which a pole crosses the unit circle."""
DRAWS = (
    Column("plant"),
    Column("draws", form="d"),
    Column("stable_share", "stable", "%", ".1f", 100),
    Column("seconds_per_draw", "each", "ms", ".2f", 1e3),
    Column("compared", "compared with\nsimulation", "", "d"),
    Column("agreement", "agree", "%", ".1f", 100),
)


def tables(result: StabilityResult) -> list[Table]:
    """Return loops and random draws."""
    return [
        Table(result.rows, COLUMNS, note=NOTE, key="rows", file="results.csv", tight=True),
        Table(result.draws, DRAWS, "\nRandom draws of Table 1", key="screens", file="screens.csv"),
    ]


def verdict(result: StabilityResult) -> str:
    """Return in words how many loops hold near rest, and on which joint the least is to spare."""
    held = sum(row.stable for row in result.rows)
    spare = {
        joint: min(row.margins[f"gain_high_{joint}"] for row in result.rows) for joint in (1, 2)
    }
    tight = min(spare, key=lambda joint: spare[joint])
    return (
        f"{held} of {len(result.rows)} loops grow by no more than {result.slack:g} 1/s; the least "
        f"gain margin is {spare[tight]:.2g}, of joint {tight}."
    )


def figures(result: StabilityResult) -> Iterator[tuple[str, Figure]]:
    """Give the maps, a figure per plant."""
    for plant in dict.fromkeys(each.plant for each in result.maps):
        mine = [each for each in result.maps if each.plant == plant]
        yield f"stable_{plant}", map_figure(mine, result.slack)


def map_figure(maps: list[StabilityMap], slack: float) -> Figure:
    """Return maps of one plant, a row per controller, a column per joint.

    slack: growth up to which a loop counts as stable [1/s].
    """
    rows = math.ceil(len(maps) / 2)
    figure = Figure(figsize=(MAP_WIDTH, 1.0 + 4.0 * rows), dpi=DPI, layout="constrained")
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
    return figure
