"""Figures of a comparison: one per case, of errors, difference and torques; one of all envelopes.

>>> case_figure(case)                 # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexsim.errors import ParameterError
from flexsim.loop.metrics import along_across, tangents
from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array
from flexsim.recording.band import Band
from flexsim.recording.case import Case
from flexsim.recording.traces import MM, difference, spoken
from studies.compare.rows import CompareRow
from studies.core.figures import (
    BLACK,
    DOUBLE,
    SINGLE,
    VERMILION,
    beside,
    canvas,
    drawn,
    finish,
    interval,
    log_axis,
    mark,
    name_lines,
    shade,
    sheet,
    styles,
    thinned,
    unmathed,
)
from studies.core.paper import PAPER_MARKERS, case_envelopes

REFERENCE_STYLE: dict[str, Any] = {"color": "0.78", "linewidth": 3.4}
COLUMNS = (("path", "tau1", "tau2"), ("along", "across", "difference", "v"))
SHARES = ((2.2, 1, 1), (1, 1, 1, 1))  # of their heights
CASE_HEIGHT = 150.0  # [mm]
SHADE = 0.3  # opacity of what all runs cover
NEAR = 1.5  # of the largest torque: a limit farther away is not drawn
FINE = 0.1  # [mm] a difference below which is shown in micrometres
NAME_MOST = 22  # letters of a case's name beside a panel of one column
PARTS: dict[str, tuple[Any, Any]] = {
    "along": (BLACK, "-"),
    "across": (VERMILION, (0, (3, 1.2))),
}
Curve = Callable[[Motion], Array]


def _label(motion: Motion) -> str:
    """Return a plant's legend entry, with the time it diverged at if it did."""
    fate = "" if motion.diverged is None else f", diverged at {motion.diverged:.3f} s"
    return spoken(motion.plant) + fate


def _error(motion: Motion, part: int) -> Array:
    """Return the tip's error along (0) or across (1) the path [mm]."""
    apart = motion.tip - motion.reference_tip
    return MM * along_across(apart, tangents(motion.reference_tip))[part]


CURVES: dict[str, tuple[str, Curve, Callable[[Band], Array]]] = {
    "along": ("error [mm]", lambda m: _error(m, 0), lambda b: MM * b.along),
    "across": ("error [mm]", lambda m: _error(m, 1), lambda b: MM * b.across),
    "v": ("v [mm]", lambda m: MM * m.v, lambda b: MM * b.v),
    "tau1": ("torque [N m]", lambda m: m.torque[:, 0], lambda b: b.torque[..., 0]),
    "tau2": ("torque [N m]", lambda m: m.torque[:, 1], lambda b: b.torque[..., 1]),
}
TITLES = {
    "path": "path of the tip",
    "along": "tip error along the path",
    "across": "tip error across the path",
    "tau1": "commanded torque, joint 1",
    "tau2": "commanded torque, joint 2",
    "difference": "difference of the models' tips",
    "v": "tip deflection",
}


def _over_time(axes: Axes, case: Case, name: str, looks: dict[str, dict[str, Any]]) -> None:
    """Draw one quantity of all plants over time, over the bands of their runs."""
    label, curve, ends = CURVES[name]
    thin = {"linewidth": 0.6} if name.startswith("tau") else {}
    axes.axhline(0.0, color="0.6", linewidth=0.5)
    for plant, band in case.bands.items():
        shade(axes, band.time, *ends(band), color=looks[plant]["color"], alpha=SHADE)
    for motion in case.motions.values():
        values = curve(motion)
        axes.plot(*thinned(motion.time, values), **{**looks[motion.plant], **thin})
        _mark_divergence(axes, motion, (motion.time, values), looks)
    axes.set_ylabel(label)


def _mark_divergence(
    axes: Axes, motion: Motion, curve: Any, looks: dict[str, dict[str, Any]]
) -> None:
    """Mark where a motion's curve ends because it diverged."""
    x, y = curve
    if motion.diverged is not None and len(x):
        how = {"color": looks[motion.plant]["color"], "markeredgecolor": "white", "markersize": 7}
        axes.plot(x[-1:], y[-1:], "X", linestyle="none", label="end of a run that diverged", **how)


def _draw_path(axes: Axes, case: Case, looks: dict[str, dict[str, Any]]) -> None:
    """Draw the tips' paths over the reference path; the legend's entries are its curves'."""
    _, reference = case.reference_tip
    axes.plot(*reference.T, **REFERENCE_STYLE, label="reference")
    for plant, band in case.bands.items():
        for tip in band.paths:
            how = {"color": looks[plant]["color"], "alpha": SHADE, "linewidth": 0.4}
            axes.plot(*tip.T, **how, rasterized=True)
    for motion in case.motions.values():
        axes.plot(*motion.tip.T, **looks[motion.plant], label=_label(motion))
        _mark_divergence(axes, motion, motion.tip.T, looks)
    start = reference[:1].T
    axes.plot(*start, "o", color="0.15", markerfacecolor="none", markersize=6, label="start")
    if case.bands:
        axes.fill([], [], color="0.4", alpha=SHADE, linewidth=0, label="pale: all runs")
    axes.set(xlabel="x of the tip [m]", ylabel="y of the tip [m]")
    axes.set_aspect("equal", adjustable="datalim")


def _draw_difference(axes: Axes, case: Case) -> None:
    """Draw the second plant's tip minus the first's, along and across the path, on its own scale.

    Median, quartiles and range of pairs of runs; of the runs shown where there are no pairs.
    """
    if len(case.motions) != 2:
        axes.text(0.5, 0.5, "one plant only", ha="center", transform=axes.transAxes)
        axes.set_yticks([])
        return
    if case.pairs is not None:
        time, found = case.pairs.time, [case.pairs.along, case.pairs.across]
    else:
        time, apart = difference(case.motions, lambda motion: motion.tip)
        longest = max(case.motions.values(), key=lambda motion: len(motion.time))
        parts = along_across(apart, tangents(longest.reference_tip)[: len(time)])
        found = [each[None] for each in parts]
    most = MM * max((float(np.abs(each).max(initial=0.0)) for each in found), default=0.0)
    unit, scale = ("µm", 1e3 * MM) if most < FINE else ("mm", MM)
    axes.axhline(0.0, color="0.6", linewidth=0.5)
    for (name, (colour, dash)), values in zip(PARTS.items(), scale * np.array(found), strict=True):
        for i in range(len(values) // 2):  # the range, upon it what lies between the quartiles
            shade(axes, time, values[i], values[-1 - i], color=colour, alpha=0.2)
        how = {"color": colour, "linestyle": dash, "linewidth": 0.8}
        axes.plot(*thinned(time, values[len(values) // 2]), **how, label=f"difference {name} path")
    axes.set_ylabel(f"tips apart [{unit}]")


def _draw_limits(panels: dict[str, Axes], case: Case) -> None:
    """Draw the limits of torques where they are near."""
    for joint, limit in enumerate(case.torque_limit):
        most = max(np.abs(each.torque[:, joint]).max(initial=0.0) for each in case.motions.values())
        if limit < NEAR * most:
            for end in (-limit, limit):
                how: dict[str, Any] = {"color": "0.3", "linestyle": ":", "linewidth": 0.8}
                panels[f"tau{joint + 1}"].axhline(end, label="limit of the motor", **how)


def _difference_title(case: Case) -> str:
    """Return which tip is subtracted from which."""
    names = [spoken(plant) for plant in case.motions]
    return f"tips: {names[1]} minus {names[0]}" if len(names) == 2 else TITLES["difference"]


@drawn
def case_figure(case: Case) -> Figure:
    """Return path, errors along and across it, difference of the plants, v and torques.

    Pale: what all runs cover; on the path, the first of them as thin lines.

    Args:
        case: with at least one motion.
    """
    figure = sheet(CASE_HEIGHT)
    axes: dict[str, Axes] = {}
    halves = figure.add_gridspec(1, 2)
    for column, (names, shares) in enumerate(zip(COLUMNS, SHARES, strict=True)):
        grid = halves[column].subgridspec(len(names), 1, height_ratios=shares)
        axes |= {name: figure.add_subplot(grid[i], label=name) for i, name in enumerate(names)}
    looks = styles(case.motions)
    for name in CURVES:
        _over_time(axes[name], case, name, looks)
    _draw_path(axes["path"], case, looks)
    _draw_difference(axes["difference"], case)
    _draw_limits(axes, case)
    for name in (*CURVES, "difference"):
        axes[name].set_xlim(*case.reference_tip[0][[0, -1]].tolist())
        last = name in (names[-1] for names in COLUMNS)
        axes[name].tick_params(labelbottom=last)
        axes[name].set_xlabel("time [s]" if last else "")
    titles = TITLES | {"difference": _difference_title(case)}
    for letter, (name, title) in zip("abcdefg", titles.items(), strict=True):
        axes[name].set_title(f"({letter}) {title}", loc="left")
    for names in COLUMNS:
        figure.align_ylabels([axes[name] for name in names])
    return finish(figure, [axes[name] for name in TITLES], legend=4, caption=_caption(case))


def _caption(case: Case) -> str:
    """Return what a case's figure shows, of which runs, in words."""
    shown = "; ".join(
        f"{spoken(plant)}: {case.shown[plant]}" for plant in case.motions if plant in case.shown
    )
    names = [spoken(plant) for plant in case.motions]
    pairs = "of the runs shown"
    if case.pairs is not None:
        pairs = (
            f"median, quartiles and range at each time of {case.pairs.runs} pairs of equal gains "
            "and noise"
        )
    parts = [
        f"Trajectory {case.trajectory}; controllers {case.controllers}; setting {case.setting}; "
        f"hardware {case.hardware}.",
        "(a) Path of the tip. (b), (c) Its error along the path, positive ahead, and across it, "
        "positive to the left; where the reference stands still, by its last direction.",
        "(d), (e) Commanded torques.",
    ]
    if max(case.torque_limit) < math.inf:
        one, other = case.torque_limit
        parts.append(f"Motors give up to {one:g} and {other:g} N m.")
    if len(names) == 2:
        parts.append(f"(f) Tip of the {names[1]} minus tip of the {names[0]}, {pairs}.")
    parts.append("(g) Tip deflection.")
    if shown:
        parts.append(f"Curves: {shown}.")
    if case.bands:
        runs = ", ".join(f"{band.runs} of the {spoken(each)}" for each, band in case.bands.items())
        parts.append(
            f"Pale: least and largest of all runs ({runs}); in (a) the paths of the first."
        )
    return " ".join(parts)


def _draw_row(axes: Axes, row: CompareRow, height: float) -> None:
    """Draw one plant's half-width with its interval [mm], or a note that it diverged."""
    marker, how = mark(row.plant)
    if row.found.envelope is None or row.found.diverged:
        beside(axes, height, f"{spoken(row.plant)} diverged", how["color"])
        return
    low, high = (None if end is None else MM * end for end in row.found.interval("envelope"))
    colour = how["color"]
    interval(axes, MM * row.found.envelope, height, (low, high), marker, color=colour, zorder=3)


def _legend(axes: Axes, plants: Sequence[str]) -> None:
    """Name the markers."""
    for plant in plants:
        marker, how = mark(plant)
        axes.plot([], [], marker, **how)
    for label, marker in PAPER_MARKERS:
        axes.plot([], [], marker, color="0.15", markersize=6, linestyle="none", label=label)


def _names(rows: Sequence[CompareRow]) -> dict[int, str]:
    """Return what each row's case is called, by the row's identity, in what cases differ in."""
    differ = [key for key in ("setting", "hardware") if len({getattr(r, key) for r in rows}) > 1]
    groups = len({row.group for row in rows}) > 1
    found = {}
    for row in rows:
        more = [row.controllers] * groups + [str(getattr(row, key)) for key in differ]
        found[id(row)] = unmathed(" · ".join([row.trajectory if groups else row.case, *more]))
    return found


@drawn
def summary_figure(rows: Sequence[CompareRow]) -> Figure:
    """Return the envelope half-widths of all cases and plants beside the paper's, on a log axis.

    Raises:
        ParameterError: there are no rows.
    """
    if not rows:
        raise ParameterError("there is nothing to summarise; give the rows of one case or more")
    lines = _names(rows)
    names = list(dict.fromkeys(lines.values()))
    plants = list(dict.fromkeys(row.plant for row in rows))
    offsets = dict(zip(plants, np.linspace(-0.17, 0.17, len(plants)), strict=True))
    width = SINGLE if max(map(len, names)) <= NAME_MOST else DOUBLE
    figure, ((axes,),) = canvas(height=26 + 8 * len(names), width=width)
    for row in rows:
        height = names.index(lines[id(row)])
        _draw_row(axes, row, height + offsets[row.plant])
        paper = case_envelopes(row.trajectory, row.devised) or ()
        for value, (_, marker) in zip(paper, PAPER_MARKERS, strict=False):
            axes.plot(MM * value, height, marker, color="0.15", markersize=6)
    log_axis(axes.xaxis)
    name_lines(axes, names)
    axes.margins(x=0.08)
    axes.set_xlabel("envelope half-width [mm]")
    _legend(axes, plants)
    first = rows[0]
    caption = (
        "Half-width of the envelope of the tip around its reference: medians with 95 % intervals "
        "where there are six runs or more, beside the paper's. Setting "
        f"{first.setting}, hardware {first.hardware}, where not named."
    )
    return finish(figure, [axes], legend=2 if width == SINGLE else 4, caption=caption)
