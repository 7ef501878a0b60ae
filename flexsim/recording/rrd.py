"""One `.rrd` of a whole study: both arms over the reference and every curve, already arranged.

    >>> write_recording(run / "run.rrd", cases, metadata, parameters)    # doctest: +SKIP
    >>> open_recording(run / "run.rrd", web=False)                       # doctest: +SKIP

Columns are sent whole, after the run, on one timeline, `simulation_time`.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import rerun as rr

from flexsim.arm.parameters import Parameters, describe
from flexsim.errors import ParameterError
from flexsim.loop.motion import Motion
from flexsim.recording.case import Case
from flexsim.recording.layout import layout
from flexsim.recording.rerun_file import (
    APPLICATION,
    log_properties,
    log_text,
    markdown_table,
    new_stream,
    write_rrd,
)
from flexsim.recording.scene import LIFT, colour, corners, log_scene, time_column
from flexsim.recording.traces import ASSUMED_MODES, Trace, spoken, traces

BROAD, THIN = 3.5, 1.3  # of a curve [points]; the chain's lies on the one it mostly coincides with
EDGE = 0.7  # of a band's ends: width [points], brightness of their plant's colour
SHADES = (1.0, 0.62, 0.4)  # of a plant's colour, for its first, second, ... curve in one plot
DIFFERENCE_COLOURS = ((204, 121, 167), (0, 158, 115), (240, 228, 66))


def _identity(cases: Sequence[Case], metadata: Mapping[str, str]) -> uuid.UUID:
    """Return an id that only equal contents share: viewers merge recordings of one id."""
    digest = hashlib.sha256(repr(sorted(metadata.items())).encode())
    for case in cases:
        digest.update(f"{case.name} {case.trajectory} {case.controllers} {case.setting}".encode())
        digest.update(case.hardware.encode())
        digest.update(repr(sorted(case.shown.items())).encode())
        for plant, motion in case.motions.items():
            digest.update(plant.encode() + np.ascontiguousarray(motion.state).tobytes())
    return uuid.uuid5(uuid.NAMESPACE_URL, f"flexsim:{digest.hexdigest()}")


def _outcome(motion: Motion) -> str:
    """Return in words how a motion ended."""
    if motion.diverged is not None:
        return f"**diverged at t = {motion.diverged:.3f} s**"
    return f"ran to its end, t = {motion.time[-1]:.3f} s" if motion.time.size else "no samples"


def _told(case: Case, plant: str) -> str:
    """Return in words which run of a plant is shown, and how it ended."""
    which = case.shown.get(plant)
    return (f"{which}: " if which else "") + _outcome(case.motions[plant])


def _notes(case: Case) -> str:
    """Return what is to be known about a case, in markdown."""
    head = ("case", case.name)
    rows = [
        ("trajectory", case.trajectory),
        ("controllers", case.controllers),
        ("setting", case.setting),
        ("hardware", case.hardware),
        *((spoken(plant), _told(case, plant)) for plant in case.motions),
    ]
    return (
        f"{markdown_table(head, rows)}\n\n"
        f"The arm drawn with lines is lifted by {LIFT * 1000:.0f} mm, for display only. "
        "The tip error is the distance to the reference at the same time; an arm that diverged "
        "stays where it was last. Thin lines beside a plant's error and v are the least and the "
        "largest of all its runs."
    )


def _robot(parameters: Parameters) -> str:
    """Return the robot's parameters, in markdown."""
    rows = [
        (
            row["name"],
            f"{row['value']:g} {row['unit']}".removesuffix(" -"),
            row["meaning"] + (" (*assumed*)" if row["assumed"] else ""),
            row["source"],
        )
        for row in describe(parameters)
    ]
    note = "A case's setting may put other motor inertias in place of these."
    return f"# Robot\n\n{markdown_table(('', 'value', 'meaning', 'source'), rows)}\n\n{note}"


def _curve_colours(trace: Trace) -> list[tuple[int, int, int]]:
    """Return one colour per curve: the plant's, darker for each next curve."""
    owner = trace.path.rsplit("/", 1)[-1]
    if trace.path.startswith("difference/"):
        return [DIFFERENCE_COLOURS[i % 3] for i in range(len(trace.names))]
    red, green, blue = colour(owner)
    if "/band/" in trace.path:
        return [(int(red * EDGE), int(green * EDGE), int(blue * EDGE))] * len(trace.names)
    shades = [SHADES[i % len(SHADES)] for i in range(len(trace.names))]
    return [(int(red * s), int(green * s), int(blue * s)) for s in shades]


def _log_trace(stream: rr.RecordingStream, case: Case, trace: Trace) -> None:
    """Record the curves of one trace and their style."""
    path = f"{case.name}/{trace.path}"
    colours, count = _curve_colours(trace), len(trace.names)
    width = BROAD if trace.path.endswith(f"/{ASSUMED_MODES}") else THIN
    width = EDGE if "/band/" in trace.path else width
    style = rr.SeriesLines(colors=colours, names=list(trace.names), widths=[width] * count)
    stream.log(path, style, static=True)
    columns = rr.Scalars.columns(scalars=trace.values.ravel())
    counts = np.full(trace.time.size, trace.values.shape[1])
    stream.send_columns(path, [time_column(trace.time)], columns.partition(counts))


def _log_case(stream: rr.RecordingStream, case: Case, parameters: Parameters) -> None:
    """Record one case: properties, notes, arms and curves."""
    about = {
        "trajectory": case.trajectory,
        "controllers": case.controllers,
        "setting": case.setting,
        "hardware": case.hardware,
    }
    for plant, motion in case.motions.items():
        if motion.diverged is not None:
            about[f"diverged_{plant}"] = f"{motion.diverged:.6g} s"
    log_properties(stream, case.name, about)
    log_text(stream, f"{case.name}/notes", _notes(case))
    log_scene(stream, case, parameters)
    for trace in traces(case.motions, case.bands):
        _log_trace(stream, case, trace)


def _log(
    stream: rr.RecordingStream,
    cases: Sequence[Case],
    metadata: Mapping[str, str],
    parameters: Parameters,
) -> None:
    """Record all that there is."""
    stream.send_recording_name(APPLICATION)
    log_properties(stream, "run", metadata)
    log_text(stream, "run", f"# Run\n\n{markdown_table(('', ''), list(metadata.items()))}")
    log_text(stream, "parameters", _robot(parameters))
    for case in cases:
        _log_case(stream, case, parameters)


def write_recording(
    path: Path, cases: Sequence[Case], metadata: Mapping[str, str], parameters: Parameters
) -> None:
    """Write one recording of all cases, its layout inside, all of it or nothing.

    Args:
        path: the `.rrd` to write; a file already there is replaced.
        cases: at least one, all of different names. Curves have every sample of their motions.
        metadata: what else explains the run, such as versions and seed.
        parameters: the robot, for the arms' lengths and the text about it.

    Raises:
        ParameterError: no case, or two of one name.
        ModelError: a chain's motion and its MJCF do not belong together.
        RunError: the file cannot be written.
    """
    names = [case.name for case in cases]
    if not names or len(set(names)) < len(names):
        raise ParameterError(f"cases are named {names}; give one or more, each with its own name")
    stream = new_stream(APPLICATION, _identity(cases, metadata))
    arrangement = layout(cases, [corners(case, parameters) for case in cases])
    write_rrd(path, stream, arrangement, lambda to: _log(to, cases, metadata, parameters))
