"""A run is a folder that explains itself: configuration, versions, MJCF, table, figures, recording.

    >>> with run_folder(Path("runs/compare"), force=False) as folder:
    ...     write_config(folder, config)

The folder appears only when everything in it is written, and replaces nothing but a run of ours.
"""

from __future__ import annotations

import dataclasses
import importlib.metadata
import json
import os
import platform
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from flexsim.errors import RunError
from flexsim.files.atomic import write_text
from flexsim.files.cleanup import committing, undone
from flexsim.files.reading import MIB, read_text
from flexsim.files.scratch import NEW, OLD, scratch
from flexsim.numerics.machine import machine
from studies.core.folders.crate import published, write_crate
from studies.core.folders.marker import is_unfinished, require_ours, sign
from studies.core.table import Table
from studies.core.version import sources, version

CONFIG = "config.json"
CONFIG_MOST = 16 * MIB
TABLES = "tables.json"
PACKAGES = ("flexsim", "mujoco", "numpy", "scipy", "numba", "rerun-sdk")


@contextmanager
def run_folder(
    out: Path, force: bool, later: Sequence[str] = (), unfinished: bool = False
) -> Iterator[Path]:
    """Give a new folder beside `out`, which becomes `out` when the block ends well.

    A run that is there is moved aside until the new one stands, and back if anything fails.

    Args:
        out: where the run goes. force: replace a run that is there already, if it is one of ours
            and holds nothing else. later: what the run writes after the block, as paths in it.
        unfinished: whether the run goes on after the block, and may be continued if it is killed.

    Raises:
        RunError: `out` exists and may not be replaced, or cannot be written; or the environment
            has a time that is none.
    """
    require_free(out, force)
    published()  # refused before the work
    with _beside(out) as private:
        with _spoken_of_as(out, private / NEW):
            yield private / NEW
            if (private / NEW / CONFIG).is_file() and not (later or unfinished):
                describe(private / NEW)
            sign(private / NEW, later, unfinished)
        with committing():
            require_free(out, force)
            _put_in_place(private, out)


@contextmanager
def _spoken_of_as(out: Path, private: Path) -> Iterator[None]:
    """Have errors about files in a private folder speak of where they were to be."""
    try:
        yield
    except RunError as error:
        raise RunError(str(error).replace(str(private), str(out))) from None
    except OSError as error:
        if str(private) not in str(error.filename):
            raise
        path = str(error.filename).replace(str(private), str(out))
        raise RunError(f"{path}: cannot write it: {error.strerror}") from None


def require_free(out: Path, force: bool) -> None:
    """Refuse a path that no run may be written to.

    Raises:
        RunError: it exists, and `force` is not given or it is not a run of ours alone.
    """
    if not os.path.lexists(out):
        return
    if not force and is_unfinished(out):
        raise RunError(
            f"{out} holds an unfinished run; continue it with flexsim run --out {out} --resume, or "
            "name another folder"
        )
    if not force:
        raise RunError(f"{out} exists already; name another folder with --out, or add --force")
    if out.name in ("", ".."):
        raise RunError(f"{out}: cannot replace it under this name; give the folder its own")
    require_ours(out)


@contextmanager
def _beside(out: Path) -> Iterator[Path]:
    """Give a private folder beside `out`, whose parents are made, and unmade if they stay empty."""
    made = [parent for parent in out.parents if not parent.exists()]  # nearest first
    with ExitStack() as stack:
        stack.enter_context(undone(lambda: _unmake(made)))
        try:
            out.parent.mkdir(parents=True, exist_ok=True)
            private = stack.enter_context(scratch(out))
            (private / NEW).mkdir()
        except FileExistsError:
            raise RunError(f"{out}: cannot write there: {out.parent} is not a folder") from None
        except OSError as error:
            raise RunError(f"{out}: cannot write there: {error.strerror}") from None
        yield private


def _unmake(parents: Sequence[Path]) -> None:
    """Remove those that are empty, the nearest first."""
    with suppress(OSError):
        for parent in parents:
            parent.rmdir()


def _put_in_place(private: Path, out: Path) -> None:
    """Let the new folder stand where the old one, if any, stood."""
    try:
        if out.exists():
            out.rename(private / OLD)
        (private / NEW).rename(out)  # if it fails, `scratch` puts the old one back
    except OSError as error:
        raise RunError(f"{out}: cannot write there: {error.strerror}") from None


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that a result depends on."""
    found = {name: importlib.metadata.version(name) for name in PACKAGES}
    return {"python": platform.python_version(), "platform": platform.platform()} | found


def origin() -> dict[str, str]:
    """Return what a run ran on and from which sources: what tells two differing tables apart."""
    return machine() | {"version": version(), "sources": sources()}


def write_config(folder: Path, config: Any, **more: Any) -> None:
    """Write config.json: configuration, command line, versions, machine, and what is given."""
    content = {
        "command": ["flexsim", *sys.argv[1:]],
        "configuration": dataclasses.asdict(config),
        "versions": versions(),
        "machine": origin(),
        **more,
    }
    (folder / CONFIG).write_text(json.dumps(content, indent=2, default=str) + "\n")


def add_to_config(folder: Path, **more: Any) -> None:
    """Add to the config.json of a run what is known only at its end.

    Raises:
        RunError: it cannot be read or written.
    """
    text = read_text(folder / CONFIG, CONFIG_MOST, "configuration")
    content = json.loads(text) | more
    write_text(folder / CONFIG, json.dumps(content, indent=2, default=str) + "\n")


def describe(folder: Path) -> None:
    """Write what a finished run is for an archive, from its config.json.

    Raises:
        RunError: a file cannot be read or written.
    """
    text = read_text(folder / CONFIG, CONFIG_MOST, "configuration")
    write_crate(folder, json.loads(text))


def write_tables(folder: Path, tables: Sequence[Table]) -> None:
    """Write tables.json: the tables that are for reading, as they are printed."""
    shown = [table.declared() for table in tables if table.columns and table.rows]
    text = json.dumps({"tables": shown}, indent=1, ensure_ascii=False)
    write_text(folder / TABLES, text + "\n", "the tables")


def to_json(content: Any) -> str:
    """Return strict JSON; numbers that are not finite become null."""

    def clean(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: clean(item) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [clean(item) for item in value]
        if hasattr(value, "tolist"):
            return clean(value.tolist())
        if isinstance(value, float) and (value != value or abs(value) == float("inf")):
            return None
        return value

    return json.dumps(clean(content), indent=2, allow_nan=False, default=str)
