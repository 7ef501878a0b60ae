"""The ladder in figures: error against cost, and what a step does to the chain.

>>> cost_figure(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from flexsim.recording.traces import kind
from studies.core.figures import BLUE, FONT, GREEN, ORANGE, VERMILION, canvas, finish, style
from studies.ladder.report import MS, ROUNDING
from studies.ladder.rows import IntegratorRow, LadderResult, PlantRow, tip

HEIGHT = 8.5  # [in]
MARKERS = {"rigid": "D", "assumed-modes": "o", "printed": "X", "chain": "s", "untuned": "^"}
CROWDED = ("7", "9", "11", "13", "14", "15")  # segments whose number would cover another
COLOURS = {"RK4": BLUE, "Euler": VERMILION, "implicitfast": ORANGE, "discrete": GREEN}


def figures(result: LadderResult) -> Iterator[tuple[str, Figure]]:
    """Give error against cost, and what steps do."""
    yield "cost_accuracy", cost_figure(result)
    yield "integrators", integrator_figure(result.integrators)


def cost_figure(result: LadderResult) -> Figure:
    """Return the tips' errors over the cost, small and large torques, with their Pareto fronts."""
    figure, ((*panels,),) = canvas(1, 2, height=HEIGHT, sharey=True)
    for axes, (torque, doubt) in zip(panels, result.reference.uncertainty.items(), strict=True):
        best = sorted(
            (row.us_per_ms, max(tip(row, torque) or 0.0, doubt))
            for row in result.rows
            if getattr(row, f"pareto_{torque}")
        )
        axes.plot(*zip(*best, strict=True), color="0.8", linewidth=9, label="Pareto front")
        for name in dict.fromkeys(kind(row.plant) for row in result.rows):
            _series(axes, [row for row in result.rows if kind(row.plant) == name], torque)
        axes.axhspan(0, doubt, color="0.93")
        axes.set(xscale="log", yscale="log", title=f"{torque} torques; n or N beside the marks")
        axes.set_xlabel("us per simulated ms, closed loop, one core")
    panels[0].set_ylabel("tip, rms distance to the reference [m]")
    return finish(figure, panels, legend=7)


def _series(axes: Axes, rows: Sequence[PlantRow], torque: str) -> None:
    """Draw the plants of one kind, each with its size."""
    name = kind(rows[0].plant)
    colour = style(name)["color"]
    held = [row for row in rows if math.isfinite(tip(row, torque) or 0.0)]
    points = [(row.us_per_ms, tip(row, torque) or 0.0) for row in held]
    how = {"color": colour, "linewidth": 1, "markersize": 8}
    axes.plot(*np.transpose(points), marker=MARKERS.get(name, "P"), label=name, **how)
    for row, point in zip(held, points, strict=True):
        size = row.plant.partition(":")[2]
        if size not in CROWDED or name not in ("chain", "untuned"):
            left = name == "chain" or row.plant == "assumed-modes:3"
            place = {"xytext": (-8, -5), "ha": "right"} if left else {"xytext": (5, 6)}
            how = {"color": colour, "size": FONT - 2, "textcoords": "offset points"}
            axes.annotate(size or name, point, **how, **place)


def integrator_figure(rows: Sequence[IntegratorRow]) -> Figure:
    """Return the tip's error and mode 3's numerical damping over the step, by integrator."""
    figure, ((*panels,),) = canvas(1, 3, height=HEIGHT, sharex=True)
    titles = (
        "tip, large torques, rms [m]",
        "mode 3, |frequency shift|",
        "mode 3, |added damping ratio|",
    )
    for name, colour in COLOURS.items():
        mine = [row for row in rows if row.integrator == name and row.stable]
        steps = [MS * row.step for row in mine]
        damping = [abs(row.modal.damping_ratio[-1]) for row in mine]
        columns = (
            [row.tip_large for row in mine],
            [abs(row.modal.frequency_shift[-1]) for row in mine],
            [each if each > ROUNDING else np.nan for each in damping],
        )
        broad = {"linewidth": 5, "markersize": 12} if name == "Euler" else {"linewidth": 1.6}
        for axes, values in zip(panels, columns, strict=True):
            axes.plot(steps, values, "o-", color=colour, label=name, **broad)
    for axes, title in zip(panels, titles, strict=True):
        axes.set(xscale="log", yscale="log", title=title, xlabel="step [ms]")
        axes.set_xticks(list(dict.fromkeys(MS * row.step for row in rows)))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_locator(NullLocator())
    panels[2].set_ylim(bottom=1e-10)
    note = {"transform": panels[2].transAxes, "ha": "right", "size": FONT}
    panels[2].text(0.97, 0.04, f"not drawn: below {ROUNDING:g}", **note)
    return finish(figure, panels, legend=4)
