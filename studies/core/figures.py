"""Figures of a study: one per case in the manner of the paper's Figures 3-6, and one of them all.

    >>> case_figure(case, run / "line_tuned.png")                 # doctest: +SKIP
    >>> summary_figure(rows, run / "envelopes.png")               # doctest: +SKIP

Drawn with matplotlib's objects, without pyplot: nothing global is touched, no window opens.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from flexsim.errors import ParameterError
from flexsim.loop.motion import Motion
from flexsim.numerics.atomic import replacing
from flexsim.recording.traces import MM, kind, spoken

if TYPE_CHECKING:
    from flexsim.recording.case import Case

# Okabe and Ito's colours, which the colour-blind tell apart. The plants often coincide, so what is
# drawn first is broad: every curve shows as a rim around the next
STYLES: dict[str, dict[str, Any]] = {
    "assumed-modes": {"color": "#E69F00", "linewidth": 4.2, "solid_capstyle": "round"},
    "chain": {"color": "#0072B2", "linewidth": 1.5, "solid_capstyle": "round"},
    "rigid": {"color": "#009E73", "linewidth": 1.5},
    "printed": {"color": "#D55E00", "linewidth": 1.5},
    "untuned": {"color": "#56B4E9", "linewidth": 1.5},
}
OTHER_STYLE: dict[str, Any] = {"color": "#CC79A7", "linewidth": 1.5}
REFERENCE_STYLE: dict[str, Any] = {"color": "0.74", "linewidth": 7.5, "linestyle": (0, (1.4, 0.6))}
DPI = 100
CASE_SIZE = (16.0, 9.5)  # [in], 1600 px wide
FONT = 13  # [pt]
PLANT_MARKERS = {"assumed-modes": "o", "chain": "s"}
PAPER_MARKERS = (("paper, simulation", "|"), ("paper, laboratory", "x"))

# Table 3: envelope half-width [m] in simulation and in the laboratory
PAPER_ENVELOPES = {
    "line": (0.016, 0.053),
    "two-loop": (0.014, 0.021),
    "circle": (0.006, 0.018),
    "transfer": (0.033, 0.042),  # Figure 6: the line, with the controllers of the two-loop
}


def _style(plant: str) -> dict[str, Any]:
    """Return how a plant's curve is drawn."""
    return STYLES.get(kind(plant), OTHER_STYLE)


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, all of it or nothing.

    Raises:
        RunError: the file cannot be written.
    """
    with replacing(path, "the figure") as temporary:
        figure.savefig(temporary, format="png", dpi=DPI, metadata={"Software": "flexsim"})


def _label(motion: Motion) -> str:
    """Return a plant's legend entry, with the time it diverged at if it did."""
    fate = "" if motion.diverged is None else f", diverged at {motion.diverged:.3f} s"
    return spoken(motion.plant) + fate


def _mark_divergence(axes: Axes, motion: Motion, x: Any, y: Any) -> None:
    """Mark where a motion ends because it diverged."""
    if motion.diverged is not None and len(x):
        colour = _style(motion.plant)["color"]
        axes.plot(x[-1:], y[-1:], "X", color=colour, markersize=11, markeredgecolor="white")


def _over_time(axes: Axes, case: Case, label: str, curve: str) -> None:
    """Draw one quantity of all plants over time: 'x' and 'y' of the tip [m], or 'v' [mm]."""
    time, tip = case.reference_tip
    if curve == "v":
        axes.axhline(0.0, color="0.68", linewidth=1.0)
    else:
        axes.plot(time, tip[:, "xy".index(curve)], **REFERENCE_STYLE)
    for motion in case.motions.values():
        value = MM * motion.v if curve == "v" else motion.tip[:, "xy".index(curve)]
        axes.plot(motion.time, value, **_style(motion.plant))
        _mark_divergence(axes, motion, motion.time, value)
    axes.set_ylabel(label)
    axes.margins(x=0)


def _path(axes: Axes, case: Case) -> None:
    """Draw the tips' paths over the reference path; the legend's entries are its curves'."""
    _, reference = case.reference_tip
    axes.plot(*reference.T, **REFERENCE_STYLE, label="reference")
    for motion in case.motions.values():
        axes.plot(*motion.tip.T, **_style(motion.plant), label=_label(motion))
        _mark_divergence(axes, motion, *motion.tip.T)
    start = reference[:1].T
    axes.plot(*start, "o", color="0.15", markerfacecolor="none", markersize=11, label="start")
    axes.set(xlabel="x [m]", ylabel="y [m]", title="path of the tip")
    axes.set_aspect("equal", adjustable="datalim")


def case_figure(case: Case, path: Path) -> None:
    """Write x(t), y(t), v(t) and the path of the tip, both plants over the dashed reference.

    Args:
        case: at least one motion.
        path: the PNG to write, 1600 pixels wide; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    figure = Figure(figsize=CASE_SIZE, dpi=DPI, layout="constrained")
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
    _path(axes["path"], case)
    finish(figure, axes.values())
    figure.suptitle(
        f"trajectory: {case.trajectory}   ·   controllers: {case.controllers}   ·   "
        f"setting: {case.setting}",
        fontsize=FONT + 3,
    )
    handles, labels = axes["path"].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=FONT + 1)
    save(figure, path)


def finish(figure: Figure, every: Any) -> None:
    """Give all axes of a figure the same grid and letters."""
    figure.set_facecolor("white")
    for axes in every:
        axes.grid(color="0.88", linewidth=0.8)
        axes.set_axisbelow(True)
        axes.tick_params(labelsize=FONT - 1)
        axes.spines[["top", "right"]].set_visible(False)
        for text in (axes.xaxis.label, axes.yaxis.label, axes.title):
            text.set_fontsize(FONT)


def paper_envelopes(trajectory: str, controllers: str) -> tuple[float, float] | None:
    """Return Table 3's half-widths [m], simulation and laboratory, or None where it has none.

    The line with controllers whose name speaks of the two-loop is the transfer of Figure 6.
    """
    trajectory, controllers = trajectory.replace("_", "-"), controllers.replace("_", "-")
    if trajectory == "line" and "two-loop" in controllers:
        return PAPER_ENVELOPES["transfer"]
    return PAPER_ENVELOPES.get(trajectory)


def _row_name(row: Mapping[str, Any]) -> str:
    """Return the summary's line for a row: what it shares with the other plant's."""
    return f"{row['trajectory']}\n{row['controllers']} · {row['setting']}"


def _draw_row(axes: Axes, row: Mapping[str, Any], height: float) -> None:
    """Draw one plant's half-width, or a note that it diverged."""
    colour = _style(row["plant"])["color"]
    marker = PLANT_MARKERS.get(kind(row["plant"]), "D")
    if row["diverged"]:
        place = axes.get_yaxis_transform()
        text = f"{spoken(row['plant'])} diverged"
        axes.text(1.01, height, text, color=colour, size=FONT - 2, va="center", transform=place)
        return
    axes.plot(row["envelope"], height, marker, color=colour, markersize=10, zorder=3)


def _draw_legend(axes: Axes, plants: Sequence[str]) -> None:
    """Draw the legend of the summary, above it."""
    for plant in plants:
        marker = PLANT_MARKERS.get(kind(plant), "D")
        axes.plot([], [], marker, color=_style(plant)["color"], markersize=10, label=spoken(plant))
    for label, marker in PAPER_MARKERS:
        axes.plot([], [], marker, color="0.15", markersize=13, markeredgewidth=2, label=label)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1.01), ncols=4, frameon=False, fontsize=FONT)


def summary_figure(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write the envelope half-widths of all cases and plants beside the paper's, on a log axis.

    Args:
        rows: each with controllers, trajectory, plant, setting, envelope [m] and diverged.
        path: the PNG to write, 1600 pixels wide; a file already there is replaced.

    Raises:
        ParameterError: there are no rows.
        RunError: the file cannot be written.
    """
    if not rows:
        raise ParameterError("there is nothing to summarise; give the rows of one case or more")
    names = list(dict.fromkeys(_row_name(row) for row in rows))
    plants = list(dict.fromkeys(row["plant"] for row in rows))
    offsets = dict(zip(plants, np.linspace(0.16, -0.16, len(plants)), strict=True))
    size = (CASE_SIZE[0], 1.8 + 0.72 * len(names))
    figure = Figure(figsize=size, dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    for row in rows:
        height = names.index(_row_name(row))
        _draw_row(axes, row, height - offsets[row["plant"]])
        paper = paper_envelopes(row["trajectory"], row["controllers"]) or ()
        for value, (_, marker) in zip(paper, PAPER_MARKERS, strict=False):
            axes.plot(value, height, marker, color="0.15", markersize=13, markeredgewidth=2)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlabel("half-width of the envelope around the reference [m]")
    _draw_legend(axes, plants)
    finish(figure, [axes])
    save(figure, path)
