"""Files written whole or not at all, over nothing but a regular file.

>>> write_text(Path("my.xml"), "<mujoco/>")                    # doctest: +SKIP
>>> with replacing(Path("figure.png"), "the figure") as path:  # doctest: +SKIP
...     figure.savefig(path)

A symbolic link is not followed, a device or a folder not replaced. (A folder on the way may be a
link: that is how people arrange their disks.)
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flexsim.errors import FlexsimError, RunError
from flexsim.files.cleanup import committing
from flexsim.files.reading import kind_of
from flexsim.files.scratch import scratch

NO_HARD_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK)


@contextmanager
def replacing(path: str | Path, what: str = "the file", force: bool = True) -> Iterator[Path]:
    """Give a path to write a file to, which becomes `path` when the block ends well.

    Args:
        path: of the file. what: it is, as a message says. force: whether one may be there already.

    Raises:
        RunError: there is something that is not to be replaced, or the file cannot be written.
    """
    path = Path(path)
    require_replaceable(path, what, force)
    try:
        with scratch(path) as folder:
            yield folder / path.name
            with committing():
                require_replaceable(path, what, force)
                _put(folder / path.name, path, force)
    except FlexsimError:
        raise
    except FileExistsError:
        raise RunError(_exists(path)) from None
    except OSError as error:
        raise RunError(f"{path}: cannot write {what}: {error.strerror or error}") from None


def write_bytes(
    path: str | Path, content: bytes, what: str = "the file", force: bool = True
) -> None:
    """Write a file; arguments and errors as `replacing`."""
    with replacing(path, what, force) as temporary:
        temporary.write_bytes(content)


def write_text(path: str | Path, text: str, what: str = "the file", force: bool = True) -> None:
    """Write a file in UTF-8, line ends as they are; arguments and errors as `replacing`."""
    write_bytes(path, text.encode(), what, force)


def require_replaceable(path: Path, what: str = "the file", force: bool = True) -> None:
    """Refuse a path that is taken.

    Raises:
        RunError: there is something else than a regular file, or that without `force`.
    """
    try:
        kind = kind_of(path.lstat().st_mode)
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "no file has such a name"
        raise RunError(f"{path}: cannot write {what}: {reason}") from None
    if kind is not None:
        raise RunError(f"{path}: cannot write {what}: it is {kind}, not a file; name another")
    if not force:
        raise RunError(_exists(path))


def _exists(path: Path) -> str:
    return f"{path} exists already; name another file, or give --force to overwrite it"


def _put(temporary: Path, path: Path, force: bool) -> None:
    """Move a file to its place; without force, one that appears there meanwhile is spared."""
    if not force:
        try:
            os.link(temporary, path)
            return
        except OSError as error:
            if error.errno not in NO_HARD_LINKS:
                raise
    os.replace(temporary, path)
