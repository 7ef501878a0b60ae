"""The convergence of a tuning run as a small recording, on a timeline that counts generations.

>>> write_convergence(run / "convergence.rrd", "index (5)", curves, metadata)  # doctest: +SKIP

Beside `recording`, `scene` and `blueprint`, the only module that knows rerun.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array
from flexsim.recording.rerun_file import (
    APPLICATION,
    fix_ids,
    log_properties,
    log_text,
    markdown_table,
    new_stream,
    write_rrd,
)

TIMELINE = "generation"
CURVES = {  # entity: (name in the legend, colour)
    "index/best": ("best", (0, 114, 178)),
    "index/median": ("median", (230, 159, 0)),
    "log10_index/best": ("best", (0, 114, 178)),
    "log10_index/median": ("median", (230, 159, 0)),
    "stable_share": ("stable share", (0, 158, 115)),
}
WIDTH = 2.0  # [points]


def _layout(title: str) -> rrb.Blueprint:
    """Return three plots over generations, and what is known about the run."""
    views = {
        "log10_index": f"log10 of {title}",
        "index": title,
        "stable_share": "share of the population that holds",
    }
    plots = [rrb.TimeSeriesView(origin=f"/{path}", name=name) for path, name in views.items()]
    notes = rrb.TextDocumentView(origin="/run", name="run")
    root = rrb.Horizontal(rrb.Vertical(*plots), notes, column_shares=[7, 3])
    fix_ids(root, uuid.uuid5(uuid.NAMESPACE_URL, "flexsim:convergence"))
    return rrb.Blueprint(
        root,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
        auto_views=False,
    )


def _identity(curves: Mapping[str, Array], metadata: Mapping[str, str]) -> uuid.UUID:
    """Return an id that only equal contents share."""
    digest = hashlib.sha256(repr(sorted(metadata.items())).encode())
    for path, values in curves.items():
        digest.update(path.encode() + np.ascontiguousarray(values).tobytes())
    return uuid.uuid5(uuid.NAMESPACE_URL, f"flexsim:{digest.hexdigest()}")


def _log_curve(stream: rr.RecordingStream, path: str, values: Array) -> None:
    """Record one curve where it is finite: a diverged best or median has no place on an axis."""
    name, colour = CURVES[path]
    style = rr.SeriesLines(colors=[colour], names=[name], widths=[WIDTH])
    stream.log(path, style, static=True)
    shown = np.flatnonzero(np.isfinite(values))
    if shown.size:
        times = rr.TimeColumn(TIMELINE, sequence=shown)
        stream.send_columns(path, [times], rr.Scalars.columns(scalars=values[shown]))


def _log(stream: rr.RecordingStream, curves: Mapping[str, Array], about: Mapping[str, str]) -> None:
    """Record all that there is."""
    stream.send_recording_name(f"{APPLICATION} tune")
    log_properties(stream, "run", about)
    log_text(stream, "run", f"# Run\n\n{markdown_table(('', ''), list(about.items()))}")
    for name, values in curves.items():
        _log_curve(stream, name, values)


def write_convergence(
    path: Path,
    title: str,
    best: Array,
    median: Array,
    stable_share: Array,
    metadata: Mapping[str, str],
) -> None:
    """Write the convergence of a run, all of it or nothing.

    Args:
        path: the `.rrd` to write; a file already there is replaced.
        title: what the index is, with its unit.
        best, median: (G,) indices of each generation, inf where diverged.
        stable_share: (G,) of each generation's population.
        metadata: what else explains the run.

    Raises:
        ParameterError: there is no generation.
        RunError: the file cannot be written.
    """
    if not len(best):
        raise ParameterError("there is no generation to record")
    with np.errstate(divide="ignore"):
        logs = np.log10(best), np.log10(median)
    columns = (best, median, *logs, stable_share)
    curves = {name: np.asarray(v, float) for name, v in zip(CURVES, columns, strict=True)}
    stream = new_stream(APPLICATION, _identity(curves, metadata))
    write_rrd(path, stream, _layout(title), lambda to: _log(to, curves, metadata))
