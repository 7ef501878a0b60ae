"""One process at a time in a run's folder.

>>> with locked(Path("runs/tune")):                        # doctest: +SKIP
...     go_on()
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flexsim.errors import RunError

if sys.platform != "win32":
    import fcntl


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other processes from running in a folder; a killed process gives it up at once.

    Raises:
        RunError: there is no such folder, or another process runs in it.
    """
    if not folder.is_dir():
        raise RunError(f"{folder} is not a run: there is no such folder")
    if sys.platform == "win32":  # where folders cannot be locked
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise RunError(
                f"{folder} is at work in another process; wait for it, or end it first"
            ) from None
        yield
    finally:
        os.close(handle)
