"""Table 3 anew and the transfer of controllers, in figures.

>>> transfer_figure(result.rows)      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Rectangle

from flexsim.recording.traces import MM, spoken
from studies.core.figures import (
    GREEN,
    OTHER_MARKER,
    PLANT_MARKERS,
    SMALL,
    STYLES,
    VERMILION,
    beside,
    canvas,
    drawn,
    finish,
    interval,
    log_axis,
    name_lines,
    no_minor_ticks,
    unmathed,
)
from studies.core.paper import CASES, PAPER_MARKERS, PLANTS, case_name, paper_envelopes
from studies.core.printed.ticks import PlainLog, PlainNumbers
from studies.tables.rows import GivenRow, RunRow, TablesResult

COLOURS = {plant: STYLES[plant]["color"] for plant in PLANTS} | {"both": GREEN}  # tuned on
MARKERS = PLANT_MARKERS | {"both": OTHER_MARKER}
FRAME: dict[str, Any] = {"fill": False, "edgecolor": VERMILION, "linewidth": 1.4}
SPACING = 0.19  # of markers of one case, the paper's the lowest
PALE = 0.55  # of the colour map, where letters turn from white to black


def figures(result: TablesResult) -> Iterator[tuple[str, Figure]]:
    """Give the envelopes of Figures 3 to 6's cases, and of every controller everywhere."""
    if result.tuned:
        yield "envelopes", envelope_figure(result.rows)
    yield "transfer", transfer_figure(result.rows)


def distinct(rows: Sequence[RunRow], key: str) -> list[str]:
    """Return what rows have under a key, each once, in their order."""
    return list(dict.fromkeys(getattr(row, key) for row in rows))


def _draw_case(axes: Axes, row: RunRow, height: float) -> None:
    """Draw one envelope with its number [mm], or a note that it diverged."""
    colour, marker = COLOURS[row.tuned_on], MARKERS[row.tuned_on]
    if row.envelope is None:
        beside(axes, height, "diverged", colour)
        return
    length = MM * row.envelope
    low, high = (None if end is None else MM * end for end in (row.envelope_low, row.envelope_high))
    interval(axes, length, height, (low, high), marker, color=colour, zorder=3)


@drawn
def envelope_figure(rows: Sequence[RunRow]) -> Figure:
    """Return the envelopes of Figures 3 to 6's cases, a panel per plant, beside the paper's."""
    plants, tuned_ons = distinct(rows, "run_on"), distinct(rows, "tuned_on")
    height = 28 + 13 * len(CASES)
    figure, ((*panels,),) = canvas(1, len(plants), height=height, sharex=True, sharey=True)
    for axes, plant, which in zip(panels, plants, (0, 1), strict=True):
        label, marker = PAPER_MARKERS[which]
        axes.set_title(f"run on the {spoken(plant)}")
        axes.set_xlabel("envelope half-width [mm]")
        for k, case in enumerate(CASES):
            mine = [row for row in rows if (row.trajectory, row.tuned_for) == case]
            for row in mine:
                if row.run_on == plant:
                    side = tuned_ons.index(row.tuned_on) - len(tuned_ons) / 2
                    _draw_case(axes, row, k + SPACING * side)
            paper = paper_envelopes(*case)
            if paper:
                low = k + SPACING * len(tuned_ons) / 2
                axes.plot(MM * paper[which], low, marker, color="0.15", markersize=6)
        axes.plot([], [], marker, color="0.15", markersize=6, linestyle="none", label=label)
        log_axis(axes.xaxis)
    for tuned_on in tuned_ons:
        how = {"color": COLOURS[tuned_on], "linestyle": "none"}
        label = f"tuned on {spoken(tuned_on)}"
        panels[0].plot([], [], marker=MARKERS[tuned_on], label=label, **how)
    name_lines(panels[0], [case_name(*case) for case in CASES])
    panels[0].margins(x=0.12)
    caption = (
        "Half-width of the envelope of the tip around its reference in the cases of Figures "
        "3 to 6: medians with 95 % intervals where there are six runs or more, beside the paper's."
    )
    return finish(figure, panels, legend=5, caption=caption)


def _rank(row: RunRow, shapes: Sequence[str]) -> int:
    """Return where tuned controllers come, those for the first trajectory first; given as given."""
    return 0 if isinstance(row, GivenRow) else shapes.index(row.tuned_for)


def _heat(axes: Axes, rows: Sequence[RunRow], colours: LogNorm) -> AxesImage:
    """Draw the envelopes [mm] of one plant, controllers down and trajectories across."""
    shapes = distinct(rows, "trajectory")
    one_of = {row.origin: row for row in sorted(rows, key=lambda row: _rank(row, shapes))}
    names = list(one_of)
    lengths = np.full((len(names), len(shapes)), np.nan)
    ends = np.full(lengths.shape, "", dtype=object)
    for row in rows:
        if row.envelope is not None:
            place = names.index(row.origin), shapes.index(row.trajectory)
            lengths[place] = MM * row.envelope
            ends[place] = _ends(row)
    shown = np.ma.masked_invalid(lengths)
    image = axes.imshow(shown, cmap="viridis_r", norm=colours, aspect="auto")
    axes.set_facecolor("0.85")
    for (i, j), length in np.ndenumerate(lengths):
        known = np.isfinite(length)
        colour = "white" if known and colours(length) > PALE else "black"
        text = f"{length:.1f}{ends[i, j]}" if known else "diverged"
        axes.text(j, i, text, color=colour, size=SMALL, ha="center", va="center")
        if one_of[names[i]].tuned_for == shapes[j]:
            axes.add_patch(Rectangle((j - 0.48, i - 0.46), 0.96, 0.92, **FRAME))
    axes.set_xticks(range(len(shapes)), shapes)
    axes.set_xlabel("trajectory")
    axes.set_yticks(range(len(names)), [unmathed(row.origin_words) for row in one_of.values()])
    return image


def _ends(row: RunRow) -> str:
    """Return a row's interval [mm], for below its median; nothing where it has none."""
    low, high = row.envelope_low, row.envelope_high
    return "" if low is None or high is None else f"\n[{MM * low:.1f}, {MM * high:.1f}]"


@drawn
def transfer_figure(rows: Sequence[RunRow]) -> Figure:
    """Return the envelope of every controller on every trajectory, in mm, a panel per plant."""
    held = [MM * row.envelope for row in rows if row.envelope is not None]
    colours = LogNorm(min(held, default=1.0), max(held, default=10.0))
    plants = distinct(rows, "run_on")
    names = {row.origin for row in rows}
    height = 24 + 9.5 * len(names)
    figure, ((*panels,),) = canvas(1, len(plants), height=height, sharey=True)
    for axes, plant in zip(panels, plants, strict=True):
        image = _heat(axes, [row for row in rows if row.run_on == plant], colours)
        axes.set_title(f"run on the {spoken(plant)}")
        axes.grid(False)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
    panels[0].set_ylabel("controllers tuned")
    bar = figure.colorbar(image, ax=panels, ticks=PlainLog(), format=PlainNumbers(), aspect=30)
    no_minor_ticks(bar.ax.yaxis)
    bar.set_label("envelope half-width [mm]")
    caption = (
        "Half-width of the envelope [mm] of every controller on every trajectory: medians, below "
        "them their 95 % intervals, from six runs on. Framed: the trajectory that the controller "
        "was tuned for."
    )
    return finish(figure, panels, caption=caption)
