"""One `.rrd` of a whole study: both arms over the reference and every curve, already arranged.

    >>> write_recording(run / "run.rrd", cases, metadata, parameters)    # doctest: +SKIP
    >>> open_recording(run / "run.rrd", web=False)                       # doctest: +SKIP

Columns are sent whole, after the run, on one timeline, `simulation_time`.
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from flexsim.blueprint import layout
from flexsim.errors import FlexsimError, ParameterError, RunError
from flexsim.motion import Motion
from flexsim.parameters import Parameters, describe
from flexsim.scene import LIFT, colour, corners, log_scene, time_column
from flexsim.traces import ASSUMED_MODES, Array, Trace, longest, spoken, traces

if TYPE_CHECKING:
    import mujoco

    from flexsim.trajectories import Reference

APPLICATION = "flexsim"
# `python -m rerun_cli` would do, but ends with status 0 whatever happened
RERUN_TOOL = (
    sys.executable,
    "-c",
    "import sys; from rerun_cli.__main__ import main; sys.exit(main())",
)
BROAD, THIN = 3.5, 1.3  # of a curve [points]; the chain's lies on the one it mostly coincides with
SHADES = (1.0, 0.62, 0.4)  # of a plant's colour, for its first, second, ... curve in one plot
DIFFERENCE_COLOURS = ((204, 121, 167), (0, 158, 115), (240, 228, 66))


@dataclass(frozen=True, eq=False)
class Case:
    """One closed-loop case: what was asked, and how each plant moved.

    Attributes:
        name: entity root and tab; letters, digits, '_', '-' and '.'.
        trajectory, controllers, setting: for titles and tables.
        motions: by the plant's name; at least one. Of two, the difference is shown.
        chain_model: the compiled MJCF whose geometry draws the plant 'chain'; without it the
            chain is drawn as other arms are.
        reference: all of it, also after a divergence; without it, as far as the longer motion.

    Raises:
        ParameterError: a name that no entity path can carry, or no motion.
    """

    name: str
    trajectory: str
    controllers: str
    setting: str
    motions: Mapping[str, Motion]
    chain_model: mujoco.MjModel | None = None
    reference: Reference | None = None

    def __post_init__(self) -> None:
        """Refuse what could not be recorded."""
        if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", self.name):
            raise ParameterError(
                f"case name {self.name!r} cannot be used; give letters, digits, '_', '-' and '.'"
            )
        if not self.motions:
            raise ParameterError(f"case {self.name!r} has no motion; give one plant's or both's")

    @property
    def reference_tip(self) -> tuple[Array, Array]:
        """Time (M,) [s] and tip (M, 2) [m] of as much of the reference as is known."""
        if self.reference is not None:
            return self.reference.time, self.reference.tip
        whole = longest(self.motions)
        return whole.time, whole.reference_tip


@contextmanager
def _strict() -> Iterator[None]:
    """Have rerun raise what it would otherwise only warn of."""
    before = rr.strict_mode()
    rr.set_strict_mode(True)
    try:
        yield
    finally:
        rr.set_strict_mode(before)


def _identity(cases: Sequence[Case], metadata: Mapping[str, str]) -> uuid.UUID:
    """Return an id that only equal contents share: viewers merge recordings of one id."""
    digest = hashlib.sha256(repr(sorted(metadata.items())).encode())
    for case in cases:
        digest.update(f"{case.name} {case.trajectory} {case.controllers} {case.setting}".encode())
        for plant, motion in case.motions.items():
            digest.update(plant.encode() + np.ascontiguousarray(motion.state).tobytes())
    return uuid.uuid5(uuid.NAMESPACE_URL, f"flexsim:{digest.hexdigest()}")


def _outcome(motion: Motion) -> str:
    """Return in words how a motion ended."""
    if motion.diverged is not None:
        return f"**diverged at t = {motion.diverged:.3f} s**"
    return f"ran to its end, t = {motion.time[-1]:.3f} s" if motion.time.size else "no samples"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    escaped = ([cell.replace("|", "\\|") for cell in line] for line in lines)
    return "\n".join("| " + " | ".join(line) + " |" for line in escaped)


def _notes(case: Case) -> str:
    """Return what is to be known about a case, in markdown."""
    head = ("case", case.name)
    rows = [
        ("trajectory", case.trajectory),
        ("controllers", case.controllers),
        ("setting", case.setting),
        *((spoken(plant), _outcome(motion)) for plant, motion in case.motions.items()),
    ]
    return (
        f"{_table(head, rows)}\n\n"
        f"The arm drawn with lines is lifted by {LIFT * 1000:.0f} mm, for display only. "
        "The tip error is the distance to the reference at the same time; an arm that diverged "
        "stays where it was last."
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
    return f"# Robot\n\n{_table(('', 'value', 'meaning', 'source'), rows)}\n\n{note}"


def _log_text(stream: rr.RecordingStream, path: str, text: str) -> None:
    """Record a markdown text."""
    stream.log(path, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def _log_properties(stream: rr.RecordingStream, name: str, values: Mapping[str, Any]) -> None:
    """Record named texts among the recording's properties; rerun refuses an empty set."""
    if values:
        stream.send_property(name, rr.AnyValues(**values))


def _curve_colours(trace: Trace) -> list[tuple[int, int, int]]:
    """Return one colour per curve: the plant's, darker for each next curve."""
    owner = trace.path.rsplit("/", 1)[-1]
    if trace.path.startswith("difference/"):
        return [DIFFERENCE_COLOURS[i % 3] for i in range(len(trace.names))]
    red, green, blue = colour(owner)
    shades = [SHADES[i % len(SHADES)] for i in range(len(trace.names))]
    return [(int(red * s), int(green * s), int(blue * s)) for s in shades]


def _log_trace(stream: rr.RecordingStream, case: Case, trace: Trace) -> None:
    """Record the curves of one trace and their style."""
    path = f"{case.name}/{trace.path}"
    colours, count = _curve_colours(trace), len(trace.names)
    width = BROAD if trace.path.endswith(f"/{ASSUMED_MODES}") else THIN
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
    }
    for plant, motion in case.motions.items():
        if motion.diverged is not None:
            about[f"diverged_{plant}"] = f"{motion.diverged:.6g} s"
    _log_properties(stream, case.name, about)
    _log_text(stream, f"{case.name}/notes", _notes(case))
    log_scene(stream, case, parameters)
    for trace in traces(case.motions):
        _log_trace(stream, case, trace)


def _write(
    path: Path, cases: Sequence[Case], metadata: Mapping[str, str], parameters: Parameters
) -> None:
    """Write a whole recording to path, with rerun's global state left as it was."""
    stream = rr.RecordingStream(
        APPLICATION, recording_id=_identity(cases, metadata), send_properties=False
    )
    if not rr.is_enabled(stream):
        raise RunError("rerun is switched off by the environment variable RERUN; unset it")
    stream.set_log_tick_enabled(False)
    stream.set_log_time_enabled(False)
    stream.save(path, layout(cases, [corners(case, parameters) for case in cases]))
    try:
        stream.send_recording_name(APPLICATION)
        _log_properties(stream, "run", metadata)
        _log_text(stream, "run", f"# Run\n\n{_table(('', ''), list(metadata.items()))}")
        _log_text(stream, "parameters", _robot(parameters))
        for case in cases:
            _log_case(stream, case, parameters)
    finally:
        stream.flush()
        stream.disconnect()


def write_recording(
    path: Path, cases: Sequence[Case], metadata: Mapping[str, str], parameters: Parameters
) -> None:
    """Write one recording of all cases, its layout inside, all of it or nothing.

    Args:
        path: the `.rrd` to write; a file already there is replaced.
        cases: at least one, all of different names; thin long motions first (`Motion.thinned`).
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
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with _strict():
            _write(temporary, cases, metadata, parameters)
        rr.chunk.RrdReader(temporary).store()  # reads the footer, which comes last
        os.replace(temporary, path)
    except FlexsimError:
        raise
    except (OSError, RuntimeError) as error:
        raise RunError(f"cannot write the recording {path}: {error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def open_recording(path: Path, web: bool = False) -> None:
    """Show a recording in the rerun viewer, and return when that is closed.

    Args:
        path: an `.rrd` file.
        web: serve it to a browser on this machine instead of opening a window.

    Raises:
        RunError: there is no such file, or the viewer cannot start.
    """
    if not path.is_file():
        raise RunError(f"there is no recording {path}; give an .rrd file that exists")
    command = [*RERUN_TOOL, str(path.resolve()), "--bind", "127.0.0.1"]
    command += ["--web-viewer"] if web else []
    try:
        status = subprocess.run(command, check=False).returncode
    except KeyboardInterrupt:
        return
    if status not in (0, 130):
        hint = "see its message above" if web else "without a display, use --web"
        raise RunError(f"the rerun viewer ended with status {status}; {hint}")
