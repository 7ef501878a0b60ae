"""Other people's files, read with care: regular ones only, of a stated size.

>>> read_text("torque.csv", 10_000_000, "torque file")
't,tau1,tau2...'
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from flexsim.errors import RunError

MIB = 1 << 20  # [bytes]


def read_regular(path: str | Path, most_bytes: int, what: str) -> bytes:
    """Return the contents of a file that is one: no pipe, device or folder, which may never end.

    Args:
        path: of the file; a link to a regular file is one. most_bytes: it may have.
        what: it is, for messages, such as 'torque file'.

    Raises:
        RunError: it cannot be read, is not a regular file, or is longer.
    """
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)  # no wait for a writer
    except (OSError, ValueError) as error:  # a name with a zero character
        reason = getattr(error, "strerror", None) or str(error)
        raise RunError(f"{path}: cannot read the {what}: {reason}") from None
    kind = kind_of(os.fstat(handle).st_mode)
    if kind is not None:
        os.close(handle)
        raise RunError(f"{path}: cannot read the {what}: it is {kind}; give a regular file")
    try:
        with open(handle, "rb") as file:
            contents = file.read(most_bytes + 1)  # what is appended meanwhile counts, too
    except OSError as error:
        raise RunError(f"{path}: cannot read the {what}: {error.strerror}") from None
    if len(contents) > most_bytes:
        raise RunError(
            f"{path}: cannot read the {what}: it has more than {most_bytes:,} bytes, the most "
            "that is read; give a shorter one"
        )
    return contents


def read_text(path: str | Path, most_bytes: int, what: str) -> str:
    """Return the text of a regular file, as `read_regular`; UTF-8, with a mark of that or without.

    Raises:
        RunError: as there, or it is not text.
    """
    try:
        return read_regular(path, most_bytes, what).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise RunError(f"{path}: cannot read the {what}: it is not text in UTF-8") from None


def kind_of(mode: int) -> str | None:
    """Return in words what `os.stat` or `os.lstat` found, None for a regular file."""
    if stat.S_ISREG(mode):
        return None
    for test, name in (
        (stat.S_ISLNK, "a symbolic link"),
        (stat.S_ISDIR, "a folder"),
        (stat.S_ISFIFO, "a pipe"),
        (stat.S_ISCHR, "a device"),
        (stat.S_ISBLK, "a device"),
        (stat.S_ISSOCK, "a socket"),
    ):
        if test(mode):
            return name
    return "no regular file"
