"""One `.rrd` of a whole study: both arms over the reference and every curve, already arranged.

    >>> write_recording(run / "run.rrd", cases, metadata, parameters)    # doctest: +SKIP
    >>> open_recording(run / "run.rrd", web=False)                       # doctest: +SKIP

Columns are sent whole, after the run, on one timeline, `simulation_time`: curves at the control
rate, poses at 50 Hz.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import rerun as rr

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.recording import texts
from flexsim.recording.case import Case
from flexsim.recording.curves import Columns, columns, panels, sent
from flexsim.recording.drawn.arms import FRAME
from flexsim.recording.drawn.map import Sheet, sheet_of
from flexsim.recording.drawn.states import DIVERGED, STATE_COLOURS, STATES, frames_of, joint_states
from flexsim.recording.layout import OVERVIEW, Beside, layout
from flexsim.recording.panels import Plan, plans_text
from flexsim.recording.rerun_file import (
    APPLICATION,
    PLANS,
    arranged_as,
    log_properties,
    log_text,
    new_stream,
    write_rrd,
)
from flexsim.recording.scene import log_scene, nanoseconds, remarks, time_column
from flexsim.recording.traces import TIMELINE, longest, spoken

MARKS = ("line", "hollow", "wider", "widest")  # of the plants' arms, as `HOLLOW` draws them


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


def plan_of(case: Case, sheet: Sheet, tables: Sequence[Columns]) -> Plan:
    """Return what the views of a case show."""
    whole = longest(case.motions)
    marks = [f"{MARKS[min(i, 3)]}: {spoken(plant)}" for i, plant in enumerate(case.motions)]
    title = " · ".join(["from above, grid 0.1 m", *marks, "dashed: reference"])
    glasses = [each for each in (sheet.about_reference, sheet.about_first) if each is not None]
    times = " and ".join(f"x {glass.factor:g}" for glass in glasses)
    short = " · ".join(["grid 0.1 m", *marks, *([f"circles {times}"] if times else [])])
    return Plan(
        case.name,
        float(whole.time[-1]) if whole.time.size else 0.0,
        title,
        sheet.bounds,
        sheet.within,
        short,
        panels(case, tables),
        has_states(case),
    )


def has_states(case: Case) -> bool:
    """Return whether a case has a dead zone, so that its joints have states."""
    return case.friction is not None and case.friction.law != "none"


def log_columns(stream: rr.RecordingStream, root: str, table: Columns) -> None:
    """Record curves below a path, 32-bit numbers, in one chunk."""
    stream.send_columns(f"{root}/{table.entity}", [time_column(table.time)], sent(table))


def _log_states(stream: rr.RecordingStream, case: Case) -> None:
    """Record when each joint is driven, in the dead zone, at rest."""
    if case.friction is None or not has_states(case):
        return
    style = rr.StateConfiguration(values=STATES, labels=STATES, colors=STATE_COLOURS)
    for plant, motion in case.motions.items():
        if motion.time.size < 2:
            continue
        found = joint_states(case.friction, motion)
        every = max(1, round(FRAME / float(motion.time[1] - motion.time[0])))
        for j in (0, 1):
            at, states = frames_of(found[:, j], every)
            if motion.diverged is not None:  # else the last state would seem to go on
                at, states = np.append(at, len(found) - 1), np.append(states, DIVERGED)
            path = f"{case.name}/states/joint_{j + 1}/{plant}"
            stream.log(path, style, static=True)
            times = rr.TimeColumn(TIMELINE, duration=nanoseconds(motion.time[at]))
            names = [STATES[i] for i in states]
            stream.send_columns(path, [times], rr.StateChange.columns(state=names))


def log_case(
    stream: rr.RecordingStream,
    case: Case,
    parameters: Parameters,
    sheet: Sheet,
    tables: Sequence[Columns],
) -> None:
    """Record one case: properties, notes, arms, curves and states."""
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
    log_text(stream, f"{case.name}/notes", texts.notes(case, remarks(case, sheet)))
    log_scene(stream, case, parameters, sheet)
    for table in tables:
        log_columns(stream, case.name, table)
    _log_states(stream, case)


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
    sheets = [sheet_of(case, parameters) for case in cases]
    curves = [columns(case) for case in cases]
    plans = [plan_of(*each) for each in zip(cases, sheets, curves, strict=True)]

    def log(stream: rr.RecordingStream) -> None:
        stream.send_recording_name(APPLICATION)
        log_properties(stream, "run", metadata)
        log_properties(stream, PLANS, {"json": plans_text(plans)})
        log_text(stream, "run", texts.run(metadata))
        log_text(stream, "parameters", texts.robot(parameters))
        log_text(stream, OVERVIEW, texts.overview(cases))
        for case, sheet, tables in zip(cases, sheets, curves, strict=True):
            log_case(stream, case, parameters, sheet, tables)

    stream = new_stream(arranged_as(plans_text(plans)), _identity(cases, metadata))
    write_rrd(path, stream, layout([Beside("", plans)]), log)
