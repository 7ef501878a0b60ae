"""A folder that nobody else can write to: for what is loaded as code, or not to be replaced.

>>> private_folder()                                       # doctest: +SKIP
PosixPath('/home/me/.cache/flexsim')
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

PRIVATE = 0o700


def private_folder() -> Path | None:
    """Return the folder for what we keep, of this user alone, or None if there can be none.

    It is in XDG_CACHE_HOME, or else in ~/.cache. Where neither is writable, as without a home, it
    is in the folder for temporary files, under a name that anyone could have taken: so it is used
    only if it is ours.
    """
    for folder in _candidates():
        try:
            if claimed(folder, tighten=True):
                return folder
        except (OSError, ValueError):
            continue
    return None


def claimed(folder: Path, tighten: bool = False) -> bool:
    """Return whether a folder, made unless it is there, is ours alone and can be written to.

    Args:
        folder: of a parent that exists. tighten: take rights from others, if they have some.

    Raises:
        OSError: it cannot be made.
    """
    try:
        folder.mkdir(mode=PRIVATE)
    except FileExistsError:
        pass
    if sys.platform == "win32":  # where a profile is private by itself
        return True
    found = folder.lstat()  # a link is none of ours
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid():
        return False
    if stat.S_IMODE(found.st_mode) & 0o077:
        if not tighten:
            return False
        folder.chmod(PRIVATE)
    return os.access(folder, os.W_OK | os.X_OK) and all(map(_guarded, folder.parents))


def _candidates() -> Iterator[Path]:
    """Give the folders to try, their parents real and there."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    if not os.path.isabs(base):
        base = os.path.expanduser("~/.cache")  # unchanged without HOME and an entry in passwd
    if os.path.isabs(base):
        with suppress(OSError):
            os.makedirs(base, PRIVATE, exist_ok=True)
            yield Path(os.path.realpath(base)) / "flexsim"
    with suppress(OSError):
        yield Path(os.path.realpath(tempfile.gettempdir())) / f"flexsim-{_user()}"


def _user() -> int:
    return os.geteuid() if hasattr(os, "geteuid") else 0


def _guarded(parent: Path) -> bool:
    """Return whether nobody but its owner can replace what is in a folder, as in /tmp."""
    found = parent.stat()
    by_group = found.st_mode & stat.S_IWGRP and found.st_gid not in (0, os.getegid())
    return not (found.st_mode & stat.S_IWOTH or by_group) or bool(found.st_mode & stat.S_ISVTX)
