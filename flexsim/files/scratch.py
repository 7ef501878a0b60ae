"""A private folder beside what is being written, which cannot outlive us for long.

>>> with scratch(Path("runs/one")) as folder:              # doctest: +SKIP
...     make(folder / NEW)
...     (folder / NEW).rename("runs/one")

It holds a marker, locked while its process lives. What a killed process leaves is told by its
marker without a lock, and swept by the next one that writes there; nothing else ever is. What was
moved aside into it, as OLD, returns to its place unless something new stands there.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import shutil
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from flexsim.files.cleanup import undone

if sys.platform != "win32":
    import fcntl

NEW, OLD = "new", "old"  # what is being made, and what it replaces
MARKER = "flexsim-scratch.json"
NAME = re.compile(r"\.flexsim-[0-9a-f]{16}")
UNMARKED = 10.0  # [s] after which an empty one is taken for left behind, not for just made
MARKER_MOST = 1 << 16  # [bytes]


@contextmanager
def scratch(target: Path) -> Iterator[Path]:
    """Give a new private folder beside `target`, gone when the block ends.

    Raises:
        OSError: it cannot be made.
    """
    sweep(target.parent)
    folder = target.parent / f".flexsim-{secrets.token_hex(8)}"
    with undone(lambda: _discard(folder, target)):
        folder.mkdir(mode=0o700)
        handle = os.open(folder / MARKER, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        try:
            _lock(handle, wait=True)  # a sweeper may be looking at it
            os.write(handle, json.dumps({"flexsim": "scratch", "target": target.name}).encode())
            yield folder
        finally:
            os.close(handle)


def sweep(parent: Path) -> None:
    """Remove what killed processes of ours left in a folder."""
    with suppress(OSError), os.scandir(parent) as entries:
        for entry in entries:
            if NAME.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                with suppress(OSError):
                    _sweep_one(Path(entry.path))


def is_scratch(path: Path) -> bool:
    """Return whether a path is named as our private folders are."""
    return NAME.fullmatch(path.name) is not None


def _sweep_one(folder: Path) -> None:
    """Remove one such folder if it is ours and its process is dead."""
    if sys.platform == "win32" or folder.lstat().st_uid != os.geteuid():
        return
    try:
        handle = os.open(folder / MARKER, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    except FileNotFoundError:
        if _is_old(folder):
            folder.rmdir()  # only if it is empty
        return
    try:
        if not (stat.S_ISREG(os.fstat(handle).st_mode) and _lock(handle)):
            return
        marker = os.read(handle, MARKER_MOST)
        name = _target(marker)
        if name is not None:
            _discard(folder, folder.parent / name)
        elif not marker and _is_old(folder) and len(list(folder.iterdir())) == 1:
            _remove_marker(folder)  # killed before it was written
    finally:
        os.close(handle)


def _is_old(folder: Path) -> bool:
    return time.time() - folder.lstat().st_mtime > UNMARKED


def _lock(handle: int, wait: bool = False) -> bool:
    """Lock an open marker, if it is not; return whether it is ours now."""
    if sys.platform == "win32":
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:  # locked, or a file system without locks, where nothing is swept
        return False
    return True


def _target(marker: bytes) -> str | None:
    """Return the name that a marker gives, or None if it is no marker of ours, or torn."""
    try:
        content = json.loads(marker)
        name = content["target"]
        whole = content["flexsim"] == "scratch" and Path(name).name == name != ""
    except (ValueError, KeyError, TypeError):
        return None
    return name if whole else None


def _discard(folder: Path, target: Path) -> None:
    """Remove a private folder, its marker last; what it holds of OLD goes back if it must."""
    if os.path.lexists(folder / OLD) and not os.path.lexists(target):
        (folder / OLD).rename(target)
    if not folder.is_dir():
        return
    for entry in list(folder.iterdir()):
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry, ignore_errors=True)
        elif entry.name != MARKER:
            entry.unlink(missing_ok=True)
    _remove_marker(folder)


def _remove_marker(folder: Path) -> None:
    with suppress(OSError):
        (folder / MARKER).unlink(missing_ok=True)
        folder.rmdir()
