"""What must not stay behind if we are ended now? Temporary folders and child processes, one list.

>>> with undone(lambda: print("gone")):
...     pass
gone

Whoever makes something temporary says how it is undone. It is undone when the block ends, or by
`clean_up` if the process must end while the main thread cannot be reached: in a compiled loop, in
MuJoCo's compiler.
"""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

_PENDING: list[Callable[[], None]] = []
_COMMITTING = threading.RLock()


@contextmanager
def undone(undo: Callable[[], None]) -> Iterator[None]:
    """Call `undo` when the block ends, however it ends."""
    _PENDING.append(undo)
    try:
        yield
    finally:
        try:
            undo()
        finally:
            _PENDING.remove(undo)


@contextmanager
def committing() -> Iterator[None]:
    """Keep `clean_up` from interfering with a block that puts something finished in its place."""
    with _COMMITTING:
        yield


def clean_up(patience: float) -> None:
    """Undo all that is pending, the newest first, and let nothing be put in place from now on.

    Called by another thread just before the process ends.

    Args:
        patience: how long to wait for a block of `committing` [s].
    """
    _COMMITTING.acquire(timeout=patience)
    for undo in reversed(tuple(_PENDING)):
        with suppress(Exception):
            undo()


@contextmanager
def child(command: Sequence[str], **how: Any) -> Iterator[subprocess.Popen[bytes]]:
    """Give a process, killed when the block ends with all that it started itself.

    Args:
        command: without a terminal to read from. how: as `subprocess.Popen` has it.
    """
    settings: dict[str, Any] = {"stdin": subprocess.DEVNULL, "process_group": 0}
    process = subprocess.Popen(command, **settings | how)
    with undone(lambda: kill_group(process)):
        yield process


def kill_group(process: subprocess.Popen[bytes]) -> None:
    """Kill a process that leads a group, and its children, which may outlive it."""
    with suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
    process.wait()
