"""Is this folder a run of ours, and nothing else? A marker in it names all that it may hold.

>>> sign(folder, later=["result.json"])                    # doctest: +SKIP
>>> require_ours(folder)                                   # doctest: +SKIP
"""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Iterator, Sequence
from pathlib import Path

from flexsim.errors import RunError
from flexsim.files.atomic import write_text
from flexsim.files.reading import MIB, read_regular
from flexsim.files.scratch import is_scratch, sweep

MARKER = ".flexsim-run"
MARKER_MOST = 16 * MIB


def sign(folder: Path, later: Sequence[str] = (), unfinished: bool = False) -> None:
    """Write the marker, which names all that is in a folder and what may be `later`.

    Args:
        unfinished: whether the run may be continued, and is spared until it has ended.
    """
    parents = {str(parent) for name in later for parent in Path(name).parents} - {"."}
    holds = sorted({*(name for name, _ in _entries(folder)), *later, *parents})
    content = {"flexsim": "run", **({"unfinished": True} if unfinished else {}), "holds": holds}
    write_text(folder / MARKER, json.dumps(content, indent=1) + "\n", "the marker")


def is_unfinished(folder: Path) -> bool:
    """Return whether a folder holds a run of ours that may be continued."""
    try:
        content = json.loads(read_regular(folder / MARKER, MARKER_MOST, "marker"))
        return bool(content["flexsim"] == "run" and content.get("unfinished"))
    except (RunError, ValueError, KeyError, TypeError):
        return False


def require_ours(folder: Path) -> None:
    """Refuse a path that is not a run of ours, or holds what the run did not write.

    Raises:
        RunError: as said; the message names what is foreign.
    """
    spared = "--force will not replace it"
    if folder.is_symlink() or not folder.is_dir():
        raise RunError(f"{folder} is not a run of ours (it is not a folder); {spared}")
    try:
        if not stat.S_ISREG((folder / MARKER).lstat().st_mode):
            raise ValueError
        content = json.loads(read_regular(folder / MARKER, MARKER_MOST, "marker"))
        if content["flexsim"] != "run":
            raise ValueError
        holds = {MARKER, *content["holds"]}
        unfinished = bool(content.get("unfinished"))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise RunError(f"{folder} is not a run of ours (no {MARKER} in it); {spared}") from None
    if unfinished:
        raise RunError(
            f"{folder} holds an unfinished run; continue it with flexsim run --out {folder} "
            f"--resume, or remove it yourself: {spared}"
        )
    for name, regular in _entries(folder):
        if name not in holds or not regular:
            raise RunError(
                f"{folder} holds {name}, which the run did not write; move it away first, or name "
                f"another folder with --out: {spared}"
            )


def _entries(folder: Path, below: str = "") -> Iterator[tuple[str, bool]]:
    """Give each path within a folder, and whether it is a regular file or a folder."""
    sweep(folder / below)
    with os.scandir(folder / below) as entries:
        for entry in sorted(entries, key=lambda entry: entry.name):
            name = f"{below}{entry.name}"
            if entry.is_dir(follow_symlinks=False):
                yield name, not is_scratch(Path(name))  # one at work still
                yield from _entries(folder, f"{name}/")
            else:
                yield name, entry.is_file(follow_symlinks=False)
