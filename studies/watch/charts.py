"""Curves over a distance or over saves, drawn: rerun's own plots have time on their axis.

>>> log_chart(stream, "mode_shapes", shape_rows(save), ticks)        # doctest: +SKIP

A chart is a stack of rows of equal height, each with a baseline, curves and a label at its end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from flexsim.arm.beam import mode_shapes
from flexsim.arm.parameters import Parameters
from flexsim.numerics.types import Array
from flexsim.recording.colours import colour
from studies.watch.save import Save

Colour = tuple[int, int, int]

PITCH, HALF_HEIGHT = 0.3, 0.13  # of rows, in widths of the chart
LABEL_AT, TICK_AT = 1.32, 0.24  # right of the start, below the last baseline, in widths
BOUNDS = rrb.VisualBounds2D(
    x_range=(-0.08, 1.6), y_range=(-HALF_HEIGHT - 0.05, 2 * PITCH + TICK_AT + 0.05)
)
GREY, FAINT = colour("reference"), (90, 94, 100)
BROAD, THIN = 1.6, 0.8  # radii [points]
TICKS_MOST = 8
POINTS = 60  # of the beam's curves


@dataclass(frozen=True, eq=False)
class Curve:
    """Points (P, 2), x from 0 to 1 and y from -1 to 1, in one colour, marked where `marked`."""

    points: Array
    colour: Colour
    marked: bool = True


@dataclass(frozen=True, eq=False)
class Row:
    """One row of a chart."""

    label: str
    curves: Sequence[Curve]


def shape_rows(save: Save) -> tuple[list[Row], dict[float, str]]:
    """Return a row per mode, of the chain and of the paper's beam, and ticks of distance [m]."""
    paper, chain = Parameters(), save.chain
    span = max(paper.L, chain.reach - chain.clamp)
    s = np.linspace(0.0, 1.0, POINTS)
    beam = mode_shapes(save.shapes.shape[1], s)  # (P, n)
    nodes = np.concatenate([[0.0], chain.hinges, [chain.reach - chain.clamp]])
    highest = max(np.abs(beam).max(), np.abs(save.shapes).max())
    rows = []
    for i, hertz in enumerate(save.modes.clamped_hz["chain"]):
        theirs = np.column_stack([s * paper.L / span, beam[:, i] / highest])
        own = np.column_stack([nodes / span, save.shapes[:, i] / highest])
        curves = [Curve(theirs, GREY, marked=False), Curve(own, colour("chain"))]
        rows.append(Row(f"mode {i + 1}: {hertz:#.5g} Hz", curves))
    marks = np.arange(0.0, span + 1e-9, 0.1)
    return rows, {float(x / span): f"{x:.1f} m" for x in marks}


def history_rows(saves: Sequence[Save]) -> tuple[list[Row], dict[float, str]]:
    """Return a row per clamped frequency of the chain, relative to the first save, and ticks."""
    hertz = np.array([save.modes.clamped_hz["chain"] for save in saves])  # (K, n)
    change = hertz / hertz[0] - 1
    highest = np.abs(change).max() or 1.0
    x = np.linspace(0.0, 1.0, len(saves)) if len(saves) > 1 else np.zeros(1)
    rows = []
    for i in range(hertz.shape[1]):
        curve = Curve(np.column_stack([x, change[:, i] / highest]), colour("chain"))
        label = f"{hertz[-1, i]:#.5g} Hz, {100 * change[-1, i]:+.2f} %"
        rows.append(Row(label, [curve]))
    shown = np.unique(np.linspace(0, len(saves) - 1, TICKS_MOST).astype(int))
    return rows, {float(x[k]): f"save {saves[k].number}" for k in shown}


def log_chart(
    stream: rr.RecordingStream, path: str, rows: Sequence[Row], ticks: dict[float, str]
) -> None:
    """Record a chart below a path: lines, marks and labels; ticks are texts by x from 0 to 1."""
    strips: list[Array] = []
    colours: list[Colour] = []
    radii: list[float] = []
    marks: list[Array] = []
    mark_colours: list[Colour] = []
    for i, row in enumerate(rows):
        baseline = np.array([[0.0, 0.0], [1.0, 0.0]])
        for curve in (Curve(baseline, FAINT, marked=False), *row.curves):
            points = _placed(curve.points, i)
            strips.append(points)
            colours.append(curve.colour)
            radii.append(BROAD if curve.marked else THIN)
            if curve.marked:
                marks.append(points)
                mark_colours += [curve.colour] * len(points)
    style = {"static": True}
    widths = rr.Radius.ui_points(radii)
    stream.log(f"{path}/lines", rr.LineStrips2D(strips, colors=colours, radii=widths), **style)
    dots = rr.Points2D(np.concatenate(marks), colors=mark_colours, radii=rr.Radius.ui_points(3.0))
    stream.log(f"{path}/marks", dots, **style)
    ends = np.array([[LABEL_AT, PITCH * i - 0.04] for i in range(len(rows))])
    log_labels(stream, f"{path}/labels", ends, [row.label for row in rows])
    below = PITCH * (len(rows) - 1) + TICK_AT - 0.06
    feet = np.array([[x, below] for x in ticks])
    log_labels(stream, f"{path}/ticks", feet, list(ticks.values()))


def _placed(points: Array, row: int) -> Array:
    """Return points of a row (P, 2) where the chart has them; y points down in rerun."""
    x, y = points.T
    return np.column_stack([x, PITCH * row - HALF_HEIGHT * y])


def log_labels(
    stream: rr.RecordingStream, path: str, positions: Array, labels: Sequence[str]
) -> None:
    """Record texts, each under its position."""
    texts = rr.Points2D(
        positions, labels=labels, show_labels=True, colors=GREY, radii=rr.Radius.ui_points(0.0)
    )
    stream.log(path, texts, static=True)
