"""How we compile: numba, cached on disk, under a folder named after the sources themselves.

numba's own cache looks only at the file that holds a function, not at those it calls; a folder
per digest of the package means that an edit anywhere recompiles everything, and nothing stale
runs. What is cached is code, loaded without a question: so the folder is this user's alone, and
where there can be none (`private`), every process compiles for itself. Code of other people, or for
a plant of theirs, whose sources the digest does not have, is not kept; what studies compile is,
since it calls only what is in its own file, which numba looks at, and in the package.
`NUMBA_DISABLE_JIT=1` turns the compiler off, for debugging the assumed-modes plant;
`NUMBA_CACHE_DIR` names another place for such folders, from which none is dropped.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import FunctionCache

from flexsim.files.private import claimed, private_folder

if sys.platform != "win32":
    import fcntl

CACHES_KEPT = 4  # of source versions, this one included, so that switching branches stays quick
NAME = re.compile(r"[0-9a-f]{16}")
MARKER = "flexsim-cache"  # in a cache of ours; locked by each process that uses it
ATTEMPTS = 3  # at a folder that another process is removing

_locks: list[int] = []  # held as long as the process lives


def sources_digest(package: Path = Path(__file__).parents[1]) -> str:
    """Return a name for the sources of the package, in all its rooms, and for their compiler."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.version}".encode())
    for source in sorted(package.rglob("*.py")):
        digest.update(str(source.relative_to(package)).encode() + source.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder(digest: str) -> Path | None:
    """Return the folder for what is compiled of these sources, None if there can be none.

    The oldest of other versions are dropped, unless a process uses them.
    """
    home = private_folder()
    if home is None:
        return None
    folder = home / digest
    for _ in range(ATTEMPTS):
        with suppress(OSError):
            if not claimed(folder):
                return None
            if _in_use(folder):
                break
    else:
        return None
    with suppress(OSError):
        _drop_oldest(home, folder)
    return folder


def _in_use(folder: Path) -> bool:
    """Mark a folder as used by this process; return whether it is still there then."""
    marker = folder / MARKER
    handle = os.open(marker, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o600)
    if sys.platform != "win32":
        with suppress(OSError):  # a file system without locks, where nothing is dropped
            fcntl.flock(handle, fcntl.LOCK_SH)
    try:
        if marker.stat().st_ino == os.fstat(handle).st_ino:
            os.utime(marker)
            _locks.append(handle)
            return True
    except FileNotFoundError:
        pass
    os.close(handle)
    return False


def _drop_oldest(home: Path, mine: Path) -> None:
    """Remove the caches of the oldest versions that no process uses; nothing else."""
    if sys.platform == "win32":
        return
    others = sorted(_caches(home), key=lambda marker: marker.stat().st_mtime, reverse=True)
    others = [marker for marker in others if marker.parent != mine]
    for marker in others[CACHES_KEPT - 1 :]:
        with suppress(OSError):
            handle = os.open(marker, os.O_RDWR | os.O_NOFOLLOW)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(marker.parent)
            finally:
                os.close(handle)


def _caches(home: Path) -> Iterator[Path]:
    """Give the markers of the caches in a folder."""
    for folder in home.iterdir():
        if NAME.fullmatch(folder.name) and stat.S_ISDIR(folder.lstat().st_mode):
            with suppress(OSError):
                if stat.S_ISREG((folder / MARKER).lstat().st_mode):
                    yield folder / MARKER


def _cached() -> bool:
    """Return whether what is compiled can be kept, after having told numba where."""
    digest, chosen = sources_digest(), os.environ.get("NUMBA_CACHE_DIR")
    folder = Path(chosen, digest) if chosen else cache_folder(digest)
    if folder is not None:
        numba.config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]
    return folder is not None


CACHED = _cached()
OURS = __name__.partition(".")[0]  # the package that the digest is of
KEPT = (OURS, "studies")  # whose functions are kept


def is_ours(of: Any) -> bool:
    """Return whether what numba takes for a type is made of this package's types alone."""
    kind = getattr(of, "instance_class", None)  # a named tuple's; a stack's says what it is of
    function = getattr(getattr(of, "dispatcher", None), "py_func", None)
    own = [getattr(each, "kind", each).__module__ for each in (kind, function) if each is not None]
    return all(name.partition(".")[0] == OURS for name in own) and all(
        is_ours(each) for each in getattr(of, "types", ())
    )


class _Cache(FunctionCache):
    """numba's cache of a function, but for what other people's types are compiled for."""

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for argument types, if they are ours."""
        if all(is_ours(each) for each in sig):
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]


def _compiled(function: Callable[..., Any], **how: Any) -> Callable[..., Any]:
    """Return the function compiled without Python objects, with IEEE division, cached on disk."""
    found = numba.njit(error_model="numpy", nogil=True, **how)(function)
    known = function.__module__.partition(".")[0] in KEPT
    if CACHED and known and hasattr(found, "_cache"):  # not where the compiler is off
        found._cache = _Cache(function)  # type: ignore[no-untyped-call]
    return found


def jit(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function compiled, its code copied into each place that uses it."""
    return _compiled(function, forceinline=True)


def jit_apart(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function compiled as `jit`, but called, not copied.

    For what takes longer than a call, and would make its users slow to compile.
    """
    return _compiled(function)
