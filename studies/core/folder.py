"""A run is a folder that explains itself: configuration, versions, MJCF, table, figures, recording.

    >>> with run_folder(Path("runs/compare"), force=False) as folder:
    ...     write_config(folder, config)

The folder appears only when everything in it is written.
"""

from __future__ import annotations

import csv
import dataclasses
import importlib.metadata
import json
import platform
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from flexsim.errors import RunError

CONFIG = "config.json"
PACKAGES = ("flexsim", "mujoco", "numpy", "scipy", "numba", "rerun-sdk")


@contextmanager
def run_folder(out: Path, force: bool) -> Iterator[Path]:
    """Give a new folder beside `out`, which becomes `out` when the block ends well.

    Args:
        out: where the run goes. force: replace a run that is there already.

    Raises:
        RunError: `out` exists and `force` is not given, or is not a run; or cannot be written.
    """
    if out.exists():
        if not force:
            raise RunError(f"{out} exists already; name another folder with --out, or add --force")
        if not (out / CONFIG).is_file():
            raise RunError(f"{out} is not a run of ours (no {CONFIG}); --force will not replace it")
    made = [parent for parent in out.parents if not parent.exists()]  # nearest first
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{out.name}-", dir=out.parent))
    except FileExistsError:
        raise RunError(f"{out}: cannot write there: {out.parent} is not a folder") from None
    except OSError as error:
        raise RunError(f"{out}: cannot write there: {error.strerror}") from None
    try:
        yield temporary
        temporary.chmod(0o755)
        if out.exists():
            shutil.rmtree(out)
        temporary.rename(out)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        if not out.exists():
            for parent in made:
                with suppress(OSError):  # somebody else's by now
                    parent.rmdir()


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that a result depends on."""
    found = {name: importlib.metadata.version(name) for name in PACKAGES}
    return {"python": platform.python_version(), "platform": platform.platform()} | found


def write_config(folder: Path, config: Any, **more: Any) -> None:
    """Write config.json: the configuration, the command line, versions, and what is given."""
    content = {
        "command": ["flexsim", *sys.argv[1:]],
        "configuration": dataclasses.asdict(config),
        "versions": versions(),
        **more,
    }
    (folder / CONFIG).write_text(json.dumps(content, indent=2, default=str) + "\n")


def write_rows(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write rows as CSV with a header; None becomes an empty field."""
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


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
