"""Poles, margins and screenings in tables and words; maps of stable gains as figures.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from flexsim.numerics.types import Array
from studies.core.evidence.digits import with_interval
from studies.core.figures import (
    canvas,
    drawn,
    finish,
    log_axis,
    no_minor_ticks,
    unmathed,
)
from studies.core.printed.ticks import PlainLog, PlainNumbers
from studies.core.table import Column, Table
from studies.stability.loops import EXACT
from studies.stability.maps import StabilityMap
from studies.stability.rows import DrawsRow, LoopRow, StabilityResult

RATE_SHOWN = 100.0  # [1/s] end of the colours
LEAST_SHOWN = 1e-3  # [1/s] start of the colours where the slack is less
STABLE_COLOUR = "#7fbf9f"
NU = "\u03bd"
SUBSCRIPTS = {1: "₁", 4: "₄"}  # of the leading gains of joints 1 and 2


def _growth(row: LoopRow) -> str:
    return f"{row.growth:+.2g}" + "!" * (not row.stable)


def _gains(joint: str) -> Column:
    """Return the column of the gain margins of a joint, or of both."""

    def text(row: LoopRow) -> str:
        low, high = (row.margins[f"gain_{end}_{joint}"] for end in ("low", "high"))
        return f"{low:.1g}-{high:.{2 if high < 100 else 3}g}"

    return Column("margins", joint if joint == "both" else f"gain {joint}", form=text)


COLUMNS = (
    Column("loop", "plant: loop"),
    Column("theta2", form=".2f"),
    Column("growth", form=_growth),
    Column("growth_simulated", "seen", form="+.2g"),
    Column("growth_undamped", "zeta 0", form="+.2g"),
    Column("fastest_hz", "Hz", form=".3g"),
    Column("delay_margin", "delay", form=".2f", scale=1e3, missing="20+"),
    _gains("1"),
    _gains("2"),
    _gains("both"),
)
NOTE = """\
Growth of the slowest-decaying motion [1/s], ! above the slack: of the exact
beam, of the others as stepped; as the nonlinear simulation shows it; without
damping in the beam; that motion's frequency. Extra delay that is borne [ms];
factors of joint 1's, joint 2's and both gains at which a pole crosses the
unit circle."""
ZEROS = (
    Column("controllers"),
    Column("factor", "gain", "times", ".3g"),
    Column("growth", "growth", "1/s", "+.3g"),
    Column("pole_hz", "pole", "Hz", ".3f"),
    Column("pole_decay", "decays", "1/s", ".4f"),
    Column("apart", "from zero", "1/s", ".3f"),
    Column("seen", "error", "of v", ".3f"),
)
ZEROS_NOTE = """\
The nearest pole, its distance from the zero, and the second error in its
motion over v/(r+L). What no controller of these two errors moves is the zero."""


def _share(name: str, heading: str) -> Column:
    """Return the column of a share and its interval [%]."""

    def text(row: DrawsRow) -> str:
        found, low, high = (getattr(row, f"{name}{end}") for end in ("", "_low", "_high"))
        return with_interval(found, low, high, scale=100, most=1)

    return Column(name, heading, "%", text)


DRAWS = (
    Column("plant"),
    Column("draws", form="d"),
    _share("stable_share", "stable"),
    Column("seconds_per_draw", "each", "ms", ".2f", 1e3),
    Column("compared", "simu-\nlated", "", "d"),
    _share("agreement", "agree"),
)
DRAWS_NOTE = "Shares with their 95 % intervals (Wilson's)."


def tables(result: StabilityResult) -> list[Table]:
    """Return loops, poles beside the zero, and random draws."""
    return [
        Table(result.rows, COLUMNS, note=NOTE, key="rows", file="results.csv", tight=True),
        Table(result.zeros, ZEROS, _zero(result), ZEROS_NOTE, "zeros", "zeros.csv"),
        Table(
            result.draws, DRAWS, "\nRandom draws of Table 1", DRAWS_NOTE, "screens", "screens.csv"
        ),
    ]


def _zero(result: StabilityResult) -> str:
    """Return the title of the poles' table."""
    if not result.zeros:
        return ""
    zero = result.zeros[0]
    return (
        f"\nThe mirrored tip's zero on the exact beam, at any pose: {zero.zero_hz:.3f} Hz, decays "
        f"at\n{zero.zero_decay:.4f} 1/s"
    )


def verdict(result: StabilityResult) -> str:
    """Return in words how many loops grow near rest, and what the least is that they bear."""
    exact = [row for row in result.rows if row.plant == EXACT]
    said = []
    if exact:
        held = sum(row.growth <= 0 for row in exact)
        free = sum(row.growth_undamped <= 0 for row in exact)
        said.append(
            f"Of the exact beam {held} of {len(exact)} loops do not grow, {free} without damping."
        )
    if stepped := [row for row in result.rows if row.plant != EXACT]:
        held = sum(row.stable for row in stepped)
        said.append(
            f"As stepped, {held} of {len(stepped)} loops grow by no more than {result.slack:g} 1/s."
        )
    tight = min(result.rows, key=lambda row: row.gain_margin)
    late = min(row.delay_margin for row in result.rows)
    ways = {way: tight.margins[f"gain_high_{way}"] for way in ("1", "2", "both")}
    if tight.growth > 0:
        said.append(f"{tight.loop} grows and has no margin.")
    else:
        least = min(ways, key=lambda way: ways[way])
        whose = "both joints" if least == "both" else f"joint {least}"
        said.append(
            f"The least gain margin is {tight.gain_margin:.3g}, of {whose}; the least delay margin "
            f"{1e3 * late:.3g} ms."
        )
    return " ".join(said)


def facts(result: StabilityResult) -> dict[str, Any]:
    """Return the controllers of runs of flexsim tune, if there are any."""
    return {"runs": result.given} if result.given else {}


def figures(result: StabilityResult) -> Iterator[tuple[str, Figure]]:
    """Give the maps, a figure per plant."""
    for plant in dict.fromkeys(each.plant for each in result.maps):
        mine = [each for each in result.maps if each.plant == plant]
        yield f"stable_{plant}", map_figure(mine, result.slack)


def _between(values: Array) -> Array:
    """Return where the cells about values (n,) end, (n + 1,)."""
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


def outline(x: Array, y: Array, held: np.ndarray[Any, np.dtype[np.bool_]]) -> list[Array]:
    """Return the sides (2, 2) of cells between those that hold (m, n) and those that do not.

    x, y: where cells end, (n + 1,) and (m + 1,).
    """
    upright = [(j + 1, i) for i, j in np.argwhere(held[:, 1:] != held[:, :-1])]
    level = [(j, i + 1) for i, j in np.argwhere(held[1:] != held[:-1])]
    sides = [np.array([[x[j], y[i]], [x[j], y[i + 1]]]) for j, i in upright]
    return sides + [np.array([[x[j], y[i]], [x[j + 1], y[i]]]) for j, i in level]


@drawn
def map_figure(maps: list[StabilityMap], slack: float) -> Figure:
    """Return maps of one plant, a row per controller, a column per joint.

    slack: growth up to which a loop counts as stable [1/s].
    """
    rows = math.ceil(len(maps) / 2)
    figure, grid = canvas(rows, 2, height=18 + 58 * rows)
    lowest = max(slack, LEAST_SHOWN)
    norm = LogNorm(lowest, RATE_SHOWN)
    colours = colormaps["YlOrRd"].with_extremes(under=STABLE_COLOUR)
    for axes, each in zip(grid.ravel(), maps, strict=False):
        growth = np.where(each.growth <= slack, lowest / 2, np.maximum(each.growth, lowest))
        ends = np.exp(_between(np.log(each.k))), _between(each.nu)
        axes.pcolormesh(*ends, growth, cmap=colours, norm=norm, rasterized=True)
        star: dict[str, Any] = {
            "color": "0.1",
            "markersize": 7,
            "linestyle": "none",
            "clip_on": False,
        }
        axes.plot(*each.own, "*", **star, label="the controller")
        edge = outline(ends[0], ends[1], each.growth <= slack)  # seen in grey, too
        axes.add_collection(LineCollection(edge, colors="0.1", linewidths=0.6))
        log_axis(axes.xaxis)
        number = 3 * each.joint - 2
        axes.grid(False)
        axes.set(
            xlabel=f"gain k{SUBSCRIPTS[number]} [N m ms$^\\nu$/rad]",
            ylabel=f"order {NU}{SUBSCRIPTS[number]}",
            title=f"{unmathed(each.controllers)}, joint {each.joint}",
        )
    for axes in grid.ravel()[len(maps) :]:
        axes.set_axis_off()
    scale: dict[str, Any] = {"ticks": PlainLog(), "format": PlainNumbers(), "aspect": 35}
    bar = figure.colorbar(ScalarMappable(norm, colours), ax=grid, extend="both", **scale)
    no_minor_ticks(bar.ax.yaxis)
    bar.set_label("growth of the slowest-decaying motion [1/s]")
    grid.ravel()[0].fill([], [], color=STABLE_COLOUR, label="stable")
    caption = (
        f"Growth over leading gain and order of one joint, all else as in the controller; plant "
        f"{maps[0].plant}, at rest with theta2 = {maps[0].theta2:.3f} rad. Stable: growth up to "
        f"{slack:g} 1/s, within the line."
    )
    return finish(figure, grid.ravel()[: len(maps)], legend=2, caption=caption)
