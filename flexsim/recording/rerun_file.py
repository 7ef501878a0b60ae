"""What every recording of ours does with rerun: strict errors, texts, tables, ids, the viewer."""

from __future__ import annotations

import hashlib
import socket
import sys
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from flexsim.errors import FlexsimError, RunError
from flexsim.files.atomic import write_bytes
from flexsim.files.cleanup import child

APPLICATION = "flexsim"
WEB_PORT = 9090  # rerun's own
PLANS = "plans"  # the property that has what a recording's layout is made from
# `python -m rerun_cli` would do, but ends with status 0 whatever happened
RERUN_TOOL = (
    sys.executable,
    "-c",
    "import sys; from rerun_cli.__main__ import main; sys.exit(main())",
)


@contextmanager
def strict() -> Iterator[None]:
    """Have rerun raise what it would otherwise only warn of."""
    before = rr.strict_mode()
    rr.set_strict_mode(True)
    try:
        yield
    finally:
        rr.set_strict_mode(before)


def arranged_as(text: str) -> str:
    """Return the application of recordings that are arranged alike.

    The viewer keeps one arrangement for each application, so what shows other things is another.
    """
    return f"{APPLICATION} {hashlib.sha256(text.encode()).hexdigest()[:8]}"


def new_stream(application: str, identity: uuid.UUID) -> rr.RecordingStream:
    """Return the stream of a new recording, not yet connected.

    Raises:
        RunError: rerun is switched off.
    """
    stream = rr.RecordingStream(application, recording_id=identity, send_properties=False)
    if not rr.is_enabled(stream):
        raise RunError("rerun is switched off by the environment variable RERUN; unset it")
    stream.set_log_tick_enabled(False)
    stream.set_log_time_enabled(False)
    return stream


def write_rrd(
    path: Path,
    stream: rr.RecordingStream,
    arrangement: rrb.Blueprint,
    log: Callable[[rr.RecordingStream], None],
) -> None:
    """Write a recording, whole or not at all, with rerun's global state left as it was.

    Args:
        path: the `.rrd` to write; a file already there is replaced.
        stream: new. arrangement: which the viewer opens it with. log: what is in it.

    Raises:
        RunError: the file cannot be written; and what `log` raises.
    """
    try:
        with strict():
            kept = stream.memory_recording()  # rerun's own file sink may hang on a full disk
            stream.send_blueprint(arrangement, make_active=False, make_default=True)
            log(stream)
            content = kept.drain_as_bytes()
    except FlexsimError:
        raise
    except RuntimeError as error:
        raise RunError(f"{path}: cannot write the recording: {error}") from error
    finally:
        stream.disconnect()
    write_bytes(path, content, "the recording")


def entity_part(name: str) -> str:
    """Return a name from outside as one part of an entity's path."""
    return rr.escape_entity_path_part(name)


def log_text(stream: rr.RecordingStream, path: str, text: str) -> None:
    """Record a markdown text."""
    stream.log(path, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def log_properties(stream: rr.RecordingStream, name: str, values: Mapping[str, Any]) -> None:
    """Record named texts among the recording's properties; rerun refuses an empty set."""
    if values:
        stream.send_property(name, rr.AnyValues(**values))


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
    command += ["--web-viewer", *_other_ports()] if web else []
    try:
        with child(command) as viewer:
            status = viewer.wait()
    except KeyboardInterrupt:
        return
    if status not in (0, 130):
        hint = "see its message above" if web else "without a display, use --web"
        raise RunError(f"the rerun viewer ended with status {status}; {hint}")


def _other_ports() -> list[str]:
    """Return how a web viewer is told to leave the ports of another that runs to it."""
    with socket.socket() as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as rerun does
        try:
            tried.bind(("127.0.0.1", WEB_PORT))
        except OSError:
            return ["--port", "auto", "--web-viewer-port", "0"]
    return ["--port", "auto"]


def fix_ids(part: rrb.Container | rrb.View, seed: uuid.UUID) -> None:
    """Replace the random ids of a part and all it holds, so that equal runs give equal files."""
    part.id = seed
    if isinstance(part, rrb.Container):
        for i, inner in enumerate(part.contents):
            fix_ids(inner, uuid.uuid5(seed, str(i)))
