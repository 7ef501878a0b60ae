"""A save in the rerun viewer: both arms in motion, curves, modes, frequencies and their history.

    >>> Viewer.running_or_new().show(saves)                   # doctest: +SKIP
    >>> RecordingFile(Path("watch.rrd")).show(saves)          # doctest: +SKIP

Each good save is a recording of its own, named after it, so that the viewer can go back to an
earlier one; what is wrong with the file goes into the text of the last.
"""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from flexsim.errors import RunError
from flexsim.files.atomic import require_replaceable
from flexsim.recording.case import Case
from flexsim.recording.colours import colour, dimmed
from flexsim.recording.curves import (
    CURVES,
    DIM,
    QUANTITIES,
    THIN,
    Columns,
    Quantity,
    columns,
    difference_panel,
    panel_of,
)
from flexsim.recording.drawn.map import sheet_of
from flexsim.recording.layout import Beside, arranged, plot, space_view, top_view
from flexsim.recording.panels import Panel, Plan, Series
from flexsim.recording.rerun_file import APPLICATION, log_text, new_stream, strict, write_rrd
from flexsim.recording.rrd import log_columns, plan_of
from flexsim.recording.scene import log_scene
from flexsim.recording.traces import CHAIN, MM
from flexsim.recording.viewer import DEFAULT_URL, require_viewer, running_or_new
from studies.core.options import DIFFERENCES
from studies.core.table import Table
from studies.watch.charts import BOUNDS, history_rows, log_chart, shape_rows
from studies.watch.loop_recording import log_loop, loop_text_view, loop_views
from studies.watch.report import BEAM, COLUMNS, frequency_rows, tip_line
from studies.watch.save import Save

SAVES = "save"  # the timeline of the history
ROOT = "arm"  # of the entities of the case
HERE = Beside("")
ANGLES = tuple(Quantity(f"theta_{j}_rad", f"angle of joint {j} [rad]") for j in (1, 2))
BEFORE = "before"  # the entity of the chain's v of the save before
SCENE_TITLE = "open loop from rest, from above · line: assumed modes · hollow: chain"
SHAPES_TITLE = "mode shapes · blue: chain · grey: paper's beam"
HISTORY_TITLE = "clamped frequencies over saves"
HISTORY_PLOT_TITLE = "on the timeline `save` [Hz]"
SENT = 10.0  # [s] for a viewer to take a recording


def text_of(saves: Sequence[Save], error: str | None) -> str:
    """Return in markdown what the last save brought, and what is wrong with the file now."""
    if not saves:
        return f"# Not usable\n\n**{error}**"
    save, before = saves[-1], saves[-2] if len(saves) > 1 else None
    title = f"# {save.chain.source}: {save.label}"
    if error is not None:
        title = f"# Not usable\n\n**{error}**\n\nAll that is shown is of {save.label}."
    since = f"Changes: since save {before.number}." if before else ""
    table = Table(frequency_rows(save, before), (*COLUMNS, BEAM), note=since)
    return f"{title}\n\n{tip_line(save, before)}\n\n{table.markdown()}"


def changes_of(save: Save, error: str | None) -> str:
    """Return in markdown what the file changes of the default, and what is wrong with it now."""
    found = "The same robot as the default."
    if save.changes:
        found = Table(save.changes, DIFFERENCES).markdown()
    return f"**{error}**\n\n{found}" if error else found


def case_of(save: Save) -> Case:
    """Return a save's motions as recordings have them."""
    return Case(ROOT, "open loop", "trial torques", "none", save.motions, save.chain.model)


def plan(saves: Sequence[Save]) -> Plan:
    """Return what the views of the last save show."""
    save, before = saves[-1], saves[-2] if len(saves) > 1 else None
    case = case_of(save)
    tables = columns(case)
    by_entity = {table.entity: table for table in tables}
    deflection = next(each for each in QUANTITIES if each.field == "v_mm")
    energy = next(each for each in QUANTITIES if each.field == "energy_J")
    apart = next(each for each in QUANTITIES if each.field == "tip_error_mm")
    found = [panel_of(case, by_entity, each) for each in (deflection, *ANGLES, energy)]
    found.insert(1, difference_panel(case, by_entity, apart))
    if before is not None and found[0] is not None:
        found[0] = _with_before(found[0], before)
    whole = plan_of(case, sheet_of(case, save.robot.parameters), tables)
    return replace(whole, title=SCENE_TITLE, panels=tuple(each for each in found if each))


def _with_before(panel: Panel, before: Save) -> Panel:
    """Return the plot of v with the chain's of the save before."""
    said = f"chain, save {before.number}"
    old = Series(BEFORE, CURVES, "v_mm", said, dimmed(colour(CHAIN), DIM), THIN)
    title = f"{panel.title} · dark: {said}"
    values = [panel.low, panel.high, *(MM * before.motions[CHAIN].v)]
    low, high = min(values), max(values)
    return replace(panel, title=title, low=low, high=high, series=(*panel.series, old))


def layout(saves: Sequence[Save]) -> rrb.Blueprint:
    """Return the arrangement of the last of some saves; without one there is only text."""
    text = rrb.TextDocumentView(origin="/frequencies", name="frequencies")
    root: rrb.Container = rrb.Vertical(text)
    if saves:
        save, shown = saves[-1], plan(saves)
        scene = rrb.Tabs(top_view(HERE, shown), space_view(HERE, shown))
        texts = rrb.Tabs(text, rrb.TextDocumentView(origin="/differences", name="differences"))
        looped = loop_views(save.loop) if save.loop is not None and not save.loop.problem else []
        if save.loop is not None:
            texts.contents = [*texts.contents, loop_text_view()]
        plots = [plot(HERE, shown, panel) for panel in shown.panels]
        shapes = rrb.Spatial2DView(origin="/mode_shapes", name=SHAPES_TITLE, visual_bounds=BOUNDS)
        drawn = rrb.Spatial2DView(origin="/history", name=HISTORY_TITLE, visual_bounds=BOUNDS)
        plotted = rrb.TimeSeriesView(origin="/history_hz", name=HISTORY_PLOT_TITLE)
        modes = rrb.Vertical(shapes, rrb.Tabs(drawn, plotted), name="modes")
        closed = [rrb.Vertical(*looped, name="closed loop")] if looped else []
        right = rrb.Tabs(rrb.Vertical(*plots, name="open loop"), modes, *closed)
        left = rrb.Vertical(scene, texts, row_shares=[6, 4])
        root = rrb.Horizontal(left, right, column_shares=[44, 56])
    return arranged(root, name="watch")


def fits(before: Plan, now: Plan) -> bool:
    """Return whether new curves lie within the ranges of an arrangement."""
    ranges = {panel.title.partition(" · ")[0]: (panel.low, panel.high) for panel in before.panels}
    for panel in now.panels:
        low, high = ranges.get(panel.title.partition(" · ")[0], (0.0, 0.0))
        if panel.low < low or panel.high > high:
            return False
    return True


def stream_of_its_own() -> rr.RecordingStream:
    """Return the stream of a new recording, which no viewer merges with another."""
    return new_stream(f"{APPLICATION} watch", uuid.uuid4())


def log_saves(stream: rr.RecordingStream, saves: Sequence[Save], error: str | None) -> None:
    """Record the last save, the history of all, and what is wrong with the file now.

    Raises:
        ModelError: the file has a geom that cannot be drawn.
    """
    stream.send_recording_name(saves[-1].label if saves else "no good save yet")
    log_texts(stream, saves, error)
    if not saves:
        return
    save, case = saves[-1], case_of(saves[-1])
    log_chart(stream, "mode_shapes", *shape_rows(save))
    log_chart(stream, "history", *history_rows(saves))
    _log_history(stream, saves)
    for table in columns(case):
        log_columns(stream, case.name, table)
    if len(saves) > 1:
        old = saves[-2].motions[CHAIN]
        log_columns(stream, case.name, Columns(BEFORE, old.time, {CURVES: {"v_mm": MM * old.v}}))
    parameters = save.robot.parameters
    log_scene(stream, case, parameters, sheet_of(case, parameters))
    if save.loop is not None:
        log_loop(stream, saves)


def log_texts(stream: rr.RecordingStream, saves: Sequence[Save], error: str | None) -> None:
    """Record what is said in words, in place of what was said before."""
    log_text(stream, "frequencies", text_of(saves, error))
    if saves:
        log_text(stream, "differences", changes_of(saves[-1], error))


def _log_history(stream: rr.RecordingStream, saves: Sequence[Save]) -> None:
    """Record the chain's clamped frequencies [Hz] over the saves."""
    hertz = np.array([save.modes.clamped_hz[CHAIN] for save in saves])  # (K, n)
    names = [f"mode {i + 1}" for i in range(hertz.shape[1])]
    stream.log("history_hz", rr.SeriesLines(names=names), static=True)
    columns = rr.Scalars.columns(scalars=hertz.ravel())
    numbers = rr.TimeColumn(SAVES, sequence=[save.number for save in saves])
    stream.send_columns("history_hz", [numbers], columns.partition([hertz.shape[1]] * len(hertz)))


class RecordingFile:
    """A recording of the last save, written anew each time, all of it or nothing."""

    def __init__(self, path: Path) -> None:
        if not path.absolute().parent.is_dir():
            raise RunError(f"{path}: cannot write the recording: there is no such folder")
        require_replaceable(path, "the recording")
        self.path = path

    def show(self, saves: Sequence[Save], error: str | None = None) -> None:
        """Write the file.

        Raises:
            ModelError: a geom cannot be drawn. RunError: the file cannot be written.
        """
        arrangement = layout(saves)
        write_rrd(
            self.path, stream_of_its_own(), arrangement, lambda to: log_saves(to, saves, error)
        )


class Viewer:
    """A rerun viewer that shows each save as it comes."""

    def __init__(self, url: str = DEFAULT_URL) -> None:
        require_viewer(url)
        self.url = url
        self.stream: rr.RecordingStream | None = None
        self.plan: Plan | None = None  # arranged once; then, as long as it fits, it is the user's

    @classmethod
    def running_or_new(cls) -> Viewer:
        """Return the viewer that runs on this machine, or else a new one.

        Raises:
            RunError: none can be started.
        """
        return cls(running_or_new())

    def show(self, saves: Sequence[Save], error: str | None = None) -> None:
        """Send a recording of a good save; else what is wrong, into the last recording.

        Raises:
            ModelError: a geom cannot be drawn. RunError: the viewer is gone.
        """
        require_viewer(self.url)
        try:
            with strict():
                if error is not None and self.stream is not None:
                    log_texts(self.stream, saves, error)
                else:
                    self._send(saves, error)
                assert self.stream is not None
                self.stream.flush(timeout_sec=SENT)
        except RunError:
            raise
        except (OSError, RuntimeError) as problem:
            raise RunError(f"cannot send to the viewer at {self.url}: {problem}") from problem

    def _send(self, saves: Sequence[Save], error: str | None) -> None:
        if self.stream is not None:
            self.stream.disconnect()
        self.stream = stream_of_its_own()
        self.stream.connect_grpc(self.url)
        now = plan(saves) if saves else None
        anew = self.plan is None or (now is not None and not fits(self.plan, now))
        self.stream.send_blueprint(layout(saves), make_active=anew)
        self.plan = now if anew else self.plan
        log_saves(self.stream, saves, error)
