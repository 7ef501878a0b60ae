"""The closed loop in the viewer: tip errors over time, poles in a chart, and both in words.

>>> log_loop(stream, saves)                                        # doctest: +SKIP

What is stable lies left of the chart's line. Both axes are logarithmic but near nothing: growth
from 0.01 1/s on, frequency from 0.1 Hz on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from flexsim.numerics.types import Array
from flexsim.recording.colours import colour
from flexsim.recording.panels import rounded
from flexsim.recording.rerun_file import log_text
from flexsim.recording.scene import time_column
from flexsim.recording.traces import ASSUMED_MODES
from studies.core.paper import PLANT_KEYS
from studies.watch.charts import BROAD, FAINT, GREY, THIN, log_labels
from studies.watch.closed_loop import LoopAnswer, PlantLoop
from studies.watch.loop_report import MM, loop_text
from studies.watch.save import Save

TEXT, ERRORS, POLES = "loop/words", "loop/tip_error", "loop/poles"
ERRORS_TITLE = "closed loop: tip error [mm] · broad orange: assumed modes · thin blue: chain"
POLES_TITLE = "poles · right of the line it grows · grey: before"
LEAST_GROWTH, LEAST_HZ = 0.01, 0.1  # [1/s], [Hz] up to which the axes are linear
GROWTHS = (-100.0, -1.0, 0.0, 1.0, 100.0)  # [1/s] of the ticks
HERTZ = (0.0, 1.0, 10.0, 100.0)  # [Hz]
WIDTH, HEIGHT = 1000.0, 500.0  # [1/s], [Hz] at the chart's edges
BOUNDS = rrb.VisualBounds2D(x_range=(-1.25, 1.1), y_range=(-1.1, 0.25))
RADII = (6.0, 4.0, 2.0)  # [points] of assumed modes, chain, exact beam: each on the one before
BEFORE = 1.5  # of the save before, as a rim of what has not moved [points]


def loop_text_view() -> rrb.TextDocumentView:
    """Return the view of what is said in words."""
    return rrb.TextDocumentView(origin=f"/{TEXT}", name="closed loop")


def loop_views(answer: LoopAnswer) -> list[rrb.View]:
    """Return the views of errors and poles."""
    found = [MM * loop.error for loop in answer.loops.values() if loop.error is not None]
    errors = rrb.TimeSeriesView(
        origin=f"/{ERRORS}",
        name=ERRORS_TITLE,
        axis_y=rrb.ScalarAxis(range=rounded(np.concatenate([[0.0], *found]))),
        plot_legend=rrb.PlotLegend(visible=False),
    )
    return [errors, rrb.Spatial2DView(origin=f"/{POLES}", name=POLES_TITLE, visual_bounds=BOUNDS)]


def log_loop(stream: rr.RecordingStream, saves: Sequence[Save]) -> None:
    """Record the loop of the last save, if it has one, beside that of the save before."""
    answer = saves[-1].loop
    before = saves[-2].loop if len(saves) > 1 else None
    log_text(stream, TEXT, loop_text(answer, before))
    if answer is None or answer.problem:
        return
    for key in PLANT_KEYS:
        _log_error(stream, key, answer.loops[key])
    _log_axes(stream)
    if before is not None and not before.problem:
        _log_poles(stream, "before", before, GREY)
    _log_poles(stream, "now", answer)


def _log_error(stream: rr.RecordingStream, key: str, loop: PlantLoop) -> None:
    """Record the tip's error of a plant [mm]."""
    if loop.time is None or loop.error is None:
        return
    path, plant = f"{ERRORS}/{key}", key.replace("_", "-")
    width = BROAD if plant == ASSUMED_MODES else THIN
    name = key.replace("_", " ")
    style = rr.SeriesLines(colors=[colour(plant)], names=[name], widths=[2 * width])
    stream.log(path, style, static=True)
    stream.send_columns(path, [time_column(loop.time)], rr.Scalars.columns(scalars=MM * loop.error))


def placed(poles: NDArray[np.complex128]) -> Array:
    """Return where the chart has poles (n,) [1/s, rad/s]: (n, 2), y points down in rerun."""
    hertz = np.abs(poles.imag) / (2 * np.pi)
    x = _axis(poles.real, LEAST_GROWTH, WIDTH)
    return np.column_stack([x, -_axis(hertz, LEAST_HZ, HEIGHT)])


def _axis(values: Array, least: float, most: float) -> Array:
    """Return values on an axis, logarithmic beyond `least`, from -1 to 1 at `most` and beyond."""
    scaled = np.log1p(np.abs(values) / least) / np.log1p(most / least)
    return np.asarray(np.sign(values) * np.minimum(scaled, 1.0))


def _log_poles(
    stream: rr.RecordingStream,
    name: str,
    answer: LoopAnswer,
    grey: tuple[int, int, int] | None = None,
) -> None:
    """Record the poles of all plants of a save, grey and below the rest if it is the one before."""
    rim = BEFORE if grey else 0.0
    for order, (key, loop) in enumerate(answer.loops.items(), start=1):
        dots = rr.Points2D(
            placed(loop.poles),
            colors=grey or colour(key.replace("_", "-")),
            radii=rr.Radius.ui_points(RADII[order - 1] + rim),
            draw_order=0.0 if grey else float(order),
        )
        stream.log(f"{POLES}/{name}/{key}", dots, static=True)


def _log_axes(stream: rr.RecordingStream) -> None:
    """Record the line of stability, the axis of frequency 0, and ticks."""
    strips = [[[0.0, 0.05], [0.0, -1.0]], [[-1.0, 0.0], [1.0, 0.0]]]
    widths = rr.Radius.ui_points([BROAD, THIN])
    lines = rr.LineStrips2D(strips, colors=[GREY, FAINT], radii=widths)
    stream.log(f"{POLES}/axes", lines, static=True)
    growth = np.array([complex(value, 0.0) for value in GROWTHS])
    hertz = 2j * np.pi * np.array(HERTZ[1:])
    feet = placed(growth) + np.array([0.0, 0.1])
    sides = placed(hertz) + np.array([-1.15, 0.0])
    labels = [f"{value:g} 1/s" for value in GROWTHS] + [f"{value:g} Hz" for value in HERTZ[1:]]
    log_labels(stream, f"{POLES}/ticks", np.vstack([feet, sides]), labels)
