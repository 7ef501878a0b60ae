"""The ladder in figures: error against cost, and what a step does to the chain.

>>> cost_figure(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexsim.recording.traces import kind
from studies.core.figures import (
    BLUE,
    DASHES,
    GREEN,
    ORANGE,
    SMALL,
    VERMILION,
    canvas,
    drawn,
    finish,
    log_axis,
    no_minor_ticks,
    style,
)
from studies.ladder.report import MS, ROUNDING
from studies.ladder.rows import IntegratorRow, LadderResult, PlantRow, tip

HEIGHT = 90.0  # [mm]
PAD = 1.0  # pixels around a size
MARKERS = {
    **{"rigid": "D", "assumed-modes": "o", "printed": "X"},
    **{"chain": "s", "untuned": "^", "rule-of-thumb": "v"},
}
LOOKS: dict[
    str, dict[str, Any]
] = {  # of integrators: Euler and implicitfast nearly coincide, the former a broad rim
    "RK4": {"color": BLUE, "marker": "o", "linestyle": "-"},
    "Euler": {"color": VERMILION, "marker": "s", "linestyle": "-", "lw": 2.6, "ms": 6.5},
    "implicitfast": {"color": ORANGE, "marker": "^", "linestyle": DASHES[1]},
    "discrete": {"color": GREEN, "marker": "D", "linestyle": DASHES[3]},
}


def figures(result: LadderResult) -> Iterator[tuple[str, Figure]]:
    """Give error against cost, and what steps do."""
    yield "cost_accuracy", cost_figure(result)
    yield "integrators", integrator_figure(result.integrators)


@drawn
def cost_figure(result: LadderResult) -> Figure:
    """Return the tips' errors over the cost, small and large torques, with their Pareto fronts."""
    figure, ((*panels,),) = canvas(1, 2, height=HEIGHT, sharey=True)
    for axes, (torque, doubt) in zip(panels, result.reference.uncertainty.items(), strict=True):
        best = sorted(
            (row.us_per_ms, max(tip(row, torque) or 0.0, doubt))
            for row in result.rows
            if getattr(row, f"pareto_{torque}")
        )
        axes.plot(*zip(*best, strict=True), color="0.85", linewidth=4.5, label="Pareto front")
        for name in dict.fromkeys(kind(row.plant) for row in result.rows):
            _series(axes, [row for row in result.rows if kind(row.plant) == name], torque)
        axes.axhspan(0, doubt, color="0.93", label="within the reference's own error")
        for axis in (axes.xaxis, axes.yaxis):
            log_axis(axis)
        axes.set_title(f"{torque} torques")
        axes.set_xlabel("cost of the closed loop [µs per simulated ms]")
        axes.margins(x=0.08)
    panels[0].set_ylabel("rms distance of the tip from the reference [m]")
    caption = (
        "Error of the driven tip over the cost on one core, small and large torques, against "
        f"{result.reference.name}. Numbers beside some marks: modes or segments."
    )
    made = finish(figure, panels, legend=4, caption=caption)
    for axes in panels:
        _leave_out_covered(made, axes)
    return made


def _leave_out_covered(figure: Figure, axes: Axes) -> None:
    """Hide sizes that would cover one before: costs are measured, places differ from run to run."""
    figure.canvas.draw()
    kept: list[Any] = []
    for text in axes.texts:
        box = text.get_window_extent().padded(PAD)
        if any(box.overlaps(other) for other in kept):
            text.set_visible(False)
        else:
            kept.append(box)


def _series(axes: Axes, rows: Sequence[PlantRow], torque: str) -> None:
    """Draw the plants of one kind, each with its size."""
    name = kind(rows[0].plant)
    colour = style(name)["color"]
    held = [row for row in rows if math.isfinite(tip(row, torque) or 0.0)]
    points = [(row.us_per_ms, tip(row, torque) or 0.0) for row in held]
    how = {"color": colour, "linewidth": 0.7, "linestyle": style(name)["linestyle"]}
    label = name.replace("-", " ")
    axes.plot(*np.transpose(points), marker=MARKERS.get(name, "P"), label=label, **how)
    for row, point in zip(held, points, strict=True):
        size = row.plant.partition(":")[2]
        left = name == "chain" or row.plant == "assumed-modes:3"
        place = {"xytext": (-4, -3), "ha": "right"} if left else {"xytext": (3, 3)}
        how = {"color": colour, "size": SMALL, "textcoords": "offset points"}
        if size:
            axes.annotate(size, point, **how, **place)


@drawn
def integrator_figure(rows: Sequence[IntegratorRow]) -> Figure:
    """Return the tip's error and mode 3's numerical damping over the step, by integrator."""
    figure, ((*panels,),) = canvas(1, 3, height=70, sharex=True)
    titles = (
        "rms error of the tip [m]",
        "mode 3: |relative shift of frequency|",
        "mode 3: |damping ratio added|",
    )
    for name, look in LOOKS.items():
        mine = [row for row in rows if row.integrator == name and row.stable]
        steps = [MS * row.step for row in mine]
        damping = [abs(row.modal.damping_ratio[-1]) for row in mine]
        columns = (
            [row.tip_large for row in mine],
            [abs(row.modal.frequency_shift[-1]) for row in mine],
            [each if each > ROUNDING else np.nan for each in damping],
        )
        for axes, values in zip(panels, columns, strict=True):
            axes.plot(steps, values, **look, label=name)
    for axes, title in zip(panels, titles, strict=True):
        for axis in (axes.xaxis, axes.yaxis):
            log_axis(axis)
        axes.set(ylabel=title, xlabel="step [ms]")
        axes.set_xticks(list(dict.fromkeys(MS * row.step for row in rows)))
        no_minor_ticks(axes.xaxis)
    panels[2].set_ylim(bottom=1e-10)
    caption = (
        "What a step does to the chain, by integrator: the tip under large torques, and the third "
        f"mode. Unstable steps, and damping below {ROUNDING:g}, are not drawn."
    )
    return finish(figure, panels, legend=4, caption=caption)
