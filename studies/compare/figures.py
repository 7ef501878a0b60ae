"""Figures of a comparison: one per case in the manner of the paper's Figures 3-6, one of them all.

>>> case_figure(case)                 # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexsim.errors import ParameterError
from flexsim.loop.motion import Motion
from flexsim.recording.case import Case
from flexsim.recording.traces import MM, spoken
from studies.compare.rows import CompareRow
from studies.core.figures import (
    DPI,
    FONT,
    WIDTH,
    canvas,
    finish,
    log_ticks,
    mark,
    name_lines,
    style,
)
from studies.core.paper import PAPER_MARKERS, case_envelopes

REFERENCE_STYLE: dict[str, Any] = {"color": "0.74", "linewidth": 7.5, "linestyle": (0, (1.4, 0.6))}
CASE_HEIGHT = 9.5  # [in]
SHADE = 0.3  # opacity of what all runs cover


def _label(case: Case, motion: Motion) -> str:
    """Return a plant's legend entry: which run it is, and the time it diverged at if it did."""
    which = f": {case.shown[motion.plant]}" if motion.plant in case.shown else ""
    fate = "" if motion.diverged is None else f", diverged at {motion.diverged:.3f} s"
    return spoken(motion.plant) + which + fate


def _draw_bands(axes: Axes, case: Case, curve: str) -> None:
    """Shade what all runs of a plant cover, of 'x', 'y' or 'v', pale below the runs shown."""
    for plant, band in case.bands.items():
        ends = MM * band.v if curve == "v" else band.tip[..., "xy".index(curve)]
        axes.fill_between(band.time, *ends, color=style(plant)["color"], alpha=SHADE, linewidth=0)


def _mark_divergence(axes: Axes, motion: Motion, x: Any, y: Any) -> None:
    """Mark where a motion ends because it diverged."""
    if motion.diverged is not None and len(x):
        colour = style(motion.plant)["color"]
        axes.plot(x[-1:], y[-1:], "X", color=colour, markersize=11, markeredgecolor="white")


def _over_time(axes: Axes, case: Case, label: str, curve: str) -> None:
    """Draw one quantity of all plants over time: 'x' and 'y' of the tip [m], or 'v' [mm]."""
    time, tip = case.reference_tip
    if curve == "v":
        axes.axhline(0.0, color="0.68", linewidth=1.0)
    else:
        axes.plot(time, tip[:, "xy".index(curve)], **REFERENCE_STYLE)
    _draw_bands(axes, case, curve)
    for motion in case.motions.values():
        value = MM * motion.v if curve == "v" else motion.tip[:, "xy".index(curve)]
        axes.plot(motion.time, value, **style(motion.plant))
        _mark_divergence(axes, motion, motion.time, value)
    axes.set_ylabel(label)
    axes.margins(x=0)


def _draw_path(axes: Axes, case: Case) -> None:
    """Draw the tips' paths over the reference path; the legend's entries are its curves'."""
    _, reference = case.reference_tip
    axes.plot(*reference.T, **REFERENCE_STYLE, label="reference")
    for plant, band in case.bands.items():
        for tip in band.paths:
            axes.plot(*tip.T, color=style(plant)["color"], alpha=SHADE, linewidth=0.8)
    for motion in case.motions.values():
        axes.plot(*motion.tip.T, **style(motion.plant), label=_label(case, motion))
        _mark_divergence(axes, motion, *motion.tip.T)
    start = reference[:1].T
    axes.plot(*start, "o", color="0.15", markerfacecolor="none", markersize=11, label="start")
    if case.bands:
        axes.fill([], [], color="0.4", alpha=SHADE, linewidth=0, label="pale: all runs")
    axes.set(xlabel="x [m]", ylabel="y [m]", title="path of the tip")
    axes.set_aspect("equal", adjustable="datalim")


def case_figure(case: Case) -> Figure:
    """Return x(t), y(t), v(t) and the path of the tip, both plants over the dashed reference.

    Shaded: what all runs cover; on the path, the first of them as thin lines.

    Args:
        case: with at least one motion.
    """
    figure = Figure(figsize=(WIDTH, CASE_HEIGHT), dpi=DPI, layout="constrained")
    axes = figure.subplot_mosaic(
        [["x", "path"], ["y", "path"], ["v", "path"]], width_ratios=[1.15, 1]
    )
    _over_time(axes["x"], case, "x of the tip [m]", "x")
    _over_time(axes["y"], case, "y of the tip [m]", "y")
    _over_time(axes["v"], case, "tip deflection v [mm]", "v")
    axes["v"].set_xlabel("time [s]")
    for name in "xy":
        axes[name].sharex(axes["v"])
        axes[name].tick_params(labelbottom=False)
    _draw_path(axes["path"], case)
    title = (
        f"trajectory: {case.trajectory}   ·   controllers: {case.controllers}   ·   "
        f"setting: {case.setting}\nhardware: {case.hardware}"
    )
    return finish(figure, [axes["path"], axes["x"], axes["y"], axes["v"]], legend=5, title=title)


def _draw_row(axes: Axes, row: CompareRow, height: float) -> None:
    """Draw one plant's half-width with its interval, or a note that it diverged."""
    marker, how = mark(row.plant)
    if row.found.envelope is None or row.found.diverged:
        place = axes.get_yaxis_transform()
        text = f"{spoken(row.plant)} diverged"
        axes.text(
            1.01, height, text, color=how["color"], size=FONT - 2, va="center", transform=place
        )
        return
    axes.plot(row.found.envelope, height, marker, color=how["color"], markersize=10, zorder=3)
    low, high = row.found.interval("envelope")
    if low is not None and high is not None:
        axes.plot([low, high], [height] * 2, "|-", color="0.15", markersize=12, zorder=4)


def _draw_legend(axes: Axes, plants: Sequence[str]) -> None:
    """Draw the legend of the summary, above it."""
    for plant in plants:
        marker, how = mark(plant)
        axes.plot([], [], marker, markersize=10, **how)
    for label, marker in PAPER_MARKERS:
        axes.plot([], [], marker, color="0.15", markersize=13, markeredgewidth=2, label=label)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1.01), ncols=4, frameon=False, fontsize=FONT)


def summary_figure(rows: Sequence[CompareRow]) -> Figure:
    """Return the envelope half-widths of all cases and plants beside the paper's, on a log axis.

    Raises:
        ParameterError: there are no rows.
    """
    if not rows:
        raise ParameterError("there is nothing to summarise; give the rows of one case or more")
    lines = {
        row: f"{row.trajectory}\n{row.controllers} · {row.setting} · {row.hardware}" for row in rows
    }
    names = list(dict.fromkeys(lines.values()))
    plants = list(dict.fromkeys(row.plant for row in rows))
    offsets = dict(zip(plants, np.linspace(0.16, -0.16, len(plants)), strict=True))
    figure, ((axes,),) = canvas(height=1.8 + 0.72 * len(names))
    for row, name in lines.items():
        height = names.index(name)
        _draw_row(axes, row, height - offsets[row.plant])
        paper = case_envelopes(row.trajectory, row.devised) or ()
        for value, (_, marker) in zip(paper, PAPER_MARKERS, strict=False):
            axes.plot(value, height, marker, color="0.15", markersize=13, markeredgewidth=2)
    log_ticks(axes)
    name_lines(axes, names)
    axes.set_xlabel("half-width of the envelope around the reference [m]")
    _draw_legend(axes, plants)
    return finish(figure, [axes])
