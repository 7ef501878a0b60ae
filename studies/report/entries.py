"""Files of a run's folder, which may be anybody's: regular ones of a stated size, never links.

>>> text_of(Path("runs/compare/config.json"), MIB, "configuration")
'{...'
"""

from __future__ import annotations

from pathlib import Path

from flexsim.errors import RunError
from flexsim.files.reading import kind_of, read_regular, read_text


def is_there(path: Path) -> bool:
    """Return whether there is a file.

    Raises:
        RunError: there is something else, such as a link or a pipe, which no run of ours has.
    """
    try:
        kind = kind_of(path.lstat().st_mode)
    except FileNotFoundError:
        return False
    except (OSError, ValueError) as error:
        raise RunError(f"{path}: cannot read it: {error}") from None
    if kind is not None:
        raise RunError(f"{path}: it is {kind}; a run has regular files only")
    return True


def opened(path: Path, most: int, what: str) -> bytes:
    """Return what a file holds; arguments and errors as `read_regular`, links refused."""
    is_there(path)
    return read_regular(path, most, what)


def text_of(path: Path, most: int, what: str) -> str:
    """Return a file's text; arguments and errors as `read_text`, links refused."""
    is_there(path)
    return read_text(path, most, what)


def size_of(path: Path) -> int:
    """Return a file's size [bytes]."""
    return path.lstat().st_size


def named(folder: Path, *ends: str, within: bool = True) -> list[Path]:
    """Return a folder's files whose names end so, sorted; none if there is no folder.

    Args:
        folder, ends: as named. within: whether the folder is within a run, and so is no link.

    Raises:
        RunError: one is no regular file, or the folder is a link.
    """
    if within and folder.is_symlink():
        raise RunError(f"{folder}: it is a symbolic link; a run has regular files only")
    if not folder.is_dir():
        return []
    try:
        found = sorted(path for path in folder.iterdir() if path.name.lower().endswith(ends))
    except OSError as error:
        raise RunError(f"{folder}: cannot read it: {error.strerror}") from None
    return [path for path in found if not path.name.startswith(".") and is_there(path)]
