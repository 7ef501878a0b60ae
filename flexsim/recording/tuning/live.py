"""A tuning in the viewer while it runs: its course, and how the best individual moves.

>>> shown = LiveTuning(url, "index (5) [m2 s]", most=100, parameters=robot.parameters)
>>> shown.show(course, case)                                # doctest: +SKIP

Each better individual is a recording of its own, so that the viewer can go back to earlier ones;
the course is drawn into the last, as a chart over all generations to come.
"""

from __future__ import annotations

import math
import uuid
from dataclasses import replace
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from flexsim.arm.parameters import Parameters
from flexsim.errors import RunError
from flexsim.numerics.types import Array
from flexsim.recording.case import Case
from flexsim.recording.colours import FAINT, colour
from flexsim.recording.curves import TRACKING, columns
from flexsim.recording.drawn.map import sheet_of
from flexsim.recording.layout import Beside, arranged, plot, top_view
from flexsim.recording.rerun_file import APPLICATION, log_text, new_stream, strict
from flexsim.recording.rrd import log_case, plan_of
from flexsim.recording.tuning.convergence import BEST, MEDIAN, Course
from flexsim.recording.viewer import require_viewer

CHART = "course"
BOUNDS = rrb.VisualBounds2D(x_range=(-0.2, 1.08), y_range=(-0.56, 0.12))
HEIGHT = 0.5  # of the chart, its width being 1
SENT = 10.0  # [s] for a viewer to take what it is sent
NOTHING = 1e-300  # below which an index has no logarithm


class LiveTuning:
    """A viewer that is shown every generation.

    Args:
        url: of a viewer that answers. title: what the index is, with its unit.
        most: generations at most. parameters: the robot that is drawn.

    Raises:
        RunError: no viewer answers there.
    """

    def __init__(self, url: str, title: str, most: int, parameters: Parameters) -> None:
        require_viewer(url)
        self.url, self.title, self.most, self.parameters = url, title, most, parameters
        self.stream: rr.RecordingStream | None = None

    def show(self, course: Course, case: Case | None) -> None:
        """Send a generation; with a case, that of a better individual, a new recording of it.

        Raises:
            RunError: the viewer is gone.
        """
        require_viewer(self.url)
        try:
            with strict():
                if case is not None or self.stream is None:
                    self._begin(course, case)
                assert self.stream is not None
                log_chart(self.stream, course, self.most)
                log_text(self.stream, "words", _words(course, self.most))
                self.stream.flush(timeout_sec=SENT)
        except (OSError, RuntimeError) as problem:
            if isinstance(problem, RunError):
                raise
            raise RunError(f"cannot send to the viewer at {self.url}: {problem}") from problem

    def _begin(self, course: Course, case: Case | None) -> None:
        """Begin a recording of a better individual, or of none."""
        if self.stream is not None:
            self.stream.disconnect()
        self.stream = new_stream(f"{APPLICATION} tune", uuid.uuid4())
        self.stream.connect_grpc(self.url)
        number = len(course.best)
        self.stream.send_recording_name(f"generation {number}, {course.best[-1]:.4g}")
        self.stream.send_blueprint(layout(course, case, self.parameters), make_active=True)
        if case is not None:
            sheet = sheet_of(case, self.parameters)
            log_case(self.stream, case, self.parameters, sheet, columns(case))


def _words(course: Course, most: int) -> str:
    """Return in markdown how far the tuning is."""
    done, best = len(course.best), course.best[-1]
    said = f"{best:.5g}" if math.isfinite(best) else "none yet: all diverged"
    return (
        f"# Generation {done} of at most {most}\n\n{course.title}\n\n- best: {said}\n"
        f"- stable in the last generation: {100 * course.stable_share[-1]:.0f} %"
    )


def layout(course: Course, case: Case | None, parameters: Parameters) -> rrb.Blueprint:
    """Return the arrangement: the course above, the best individual's motion below."""
    key = f"{course.title}, log10 · broad blue: best · thin orange: median"
    chart = rrb.Spatial2DView(origin=f"/{CHART}", name=key, visual_bounds=BOUNDS)
    words = rrb.TextDocumentView(origin="/words", name="tuning")
    above = rrb.Horizontal(chart, words, column_shares=[7, 3])
    if case is None:
        return arranged(rrb.Vertical(above), name="live tuning")
    here, plan = Beside(""), plan_of(case, sheet_of(case, parameters), columns(case))
    title = f"the best individual · {plan.title}"
    plots = [plot(here, plan, panel) for panel in plan.panels if panel.tab == TRACKING]
    below = rrb.Horizontal(top_view(here, replace(plan, title=title)), rrb.Vertical(*plots))
    return arranged(rrb.Vertical(above, below, row_shares=[4, 6]), name="live tuning")


def log_chart(stream: rr.RecordingStream, course: Course, most: int) -> None:
    """Record the course as a chart: indices over all generations that there may be."""
    curves = [_placed(values, course, most) for values in (course.median, course.best)]
    frame = np.array([[0, 0], [0, -HEIGHT], [1, -HEIGHT], [1, 0], [0, 0]], float)
    lines = [frame, *(each for each in curves if len(each) > 1)]
    shades = [
        FAINT,
        *(rgb for rgb, each in zip((MEDIAN, BEST), curves, strict=True) if len(each) > 1),
    ]
    widths = rr.Radius.ui_points([0.6, 0.8, 1.8][: len(lines)])
    stream.log(f"{CHART}/lines", rr.LineStrips2D(lines, colors=shades, radii=widths), static=True)
    low, high = _range(course)
    ticks = [math.ceil(low) + i for i in range(int(math.floor(high) - math.ceil(low)) + 1)]
    places = [[-0.06, -HEIGHT * (tick - low) / (high - low) - 0.02] for tick in ticks]
    said = [f"{tick:d}" for tick in ticks]
    steps = sorted({1, *(max(1, k * most // 4) for k in (1, 2, 3)), most})
    places += [[across(step, most), 0.03] for step in steps]
    said += [f"generation {step}" if step == most else f"{step}" for step in steps]
    style: dict[str, Any] = {"colors": [colour("reference")], "radii": rr.Radius.ui_points(0.0)}
    texts = rr.Points2D(places, labels=said, show_labels=True, **style)
    stream.log(f"{CHART}/ticks", texts, static=True)


def _range(course: Course) -> tuple[float, float]:
    """Return the ends of the chart's axis, whole decades."""
    every = np.concatenate([course.best, course.median])
    every = every[np.isfinite(every) & (every > NOTHING)]
    if not every.size:
        return -1.0, 0.0
    low, high = math.floor(np.log10(every.min())), math.ceil(np.log10(every.max()))
    return float(low), float(max(high, low + 1))


def _placed(values: Array, course: Course, most: int) -> Array:
    """Return where the chart has indices (G,), those that are finite, (m, 2); y points down."""
    low, high = _range(course)
    shown = np.flatnonzero(np.isfinite(values) & (values > NOTHING))
    height = (np.log10(values[shown]) - low) / (high - low)
    return np.column_stack([across(shown + 1, most), -HEIGHT * height])


def across(generation: Any, most: int) -> Any:
    """Return where generations are on the chart, the first being 1, as the words say it."""
    return (generation - 1) / max(most - 1, 1)
