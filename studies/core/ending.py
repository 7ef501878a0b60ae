"""Ctrl-C and SIGTERM end a command within two seconds, wherever it is, and nothing stays behind.

>>> with ends_on_signals():                                # doctest: +SKIP
...     command(configuration)

A signal raises KeyboardInterrupt or SystemExit in the main thread, which unwinds. But Python
raises only between its own instructions, and the thread may be in a compiled loop, in numba's or
MuJoCo's compiler, or somewhere that swallows exceptions. So another thread waits for the signals
too: if the command has not ended after a grace, it undoes what is pending (`cleanup`) and ends the
process.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from flexsim.files.cleanup import clean_up
from studies.core.text import one_line

INTERRUPTED, TERMINATED = 130, 143  # the shell's status for Ctrl-C and SIGTERM
GRACE = 0.7  # [s] for the main thread to end by itself
COMMITTED = 0.5  # [s] for a finished folder to be put in its place
SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
SHOW_CURSOR = "\x1b[?25h"  # a progress bar hides it
NOTHING_KEPT = "interrupted; nothing was kept"

_EXIT = threading.Lock()
_received: list[int] = []
_farewells: list[Callable[[], str]] = []


def received() -> int | None:
    """Return the signal that this command was told to end by, if any."""
    return _received[0] if _received else None


def status() -> int:
    """Return the shell's status of what a signal has ended."""
    return 128 + (received() or signal.SIGINT)


def leave(status: int) -> None:
    """End the process now, without the long way: what was to be undone is undone."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(status)


def farewell() -> str:
    """Return what to say to Ctrl-C."""
    return _farewells[-1]() if _farewells else NOTHING_KEPT


@contextmanager
def saying(text: Callable[[], str]) -> Iterator[None]:
    """Have Ctrl-C within the block answered by a text."""
    _farewells.append(text)
    try:
        yield
    finally:
        if received() is None:  # else it is said when all is unwound
            _farewells.remove(text)


@contextmanager
def ends_on_signals(afterwards: bool = False) -> Iterator[None]:
    """Have signals end what runs in the block; those that are ignored stay so, as under nohup.

    Args:
        afterwards: let them end the process at once, too, when the block has ended: it has done
            all that it has to do.
    """
    _received.clear()
    _farewells.clear()
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard = [each for each in SIGNALS if signal.getsignal(each) not in (signal.SIG_IGN, None)]
    before = {each: signal.signal(each, _end) for each in heard}
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    wakeup = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    hook = sys.unraisablehook
    sys.unraisablehook = lambda about: None if _received else hook(about)
    done = threading.Event()
    threading.Thread(target=_watch, args=(reading, heard, done), daemon=True).start()
    try:
        yield
    finally:
        with _EXIT:  # for ever, if the other thread is ending the process
            done.set()
        signal.set_wakeup_fd(wakeup)
        os.close(writing)  # which ends the thread
        for each, handler in before.items():
            signal.signal(each, signal.SIG_DFL if afterwards else handler)
        sys.unraisablehook = hook


def _end(number: int, _: FrameType | None) -> None:
    """Unwind the main thread, once: a second signal must not disturb the unwinding."""
    if _received:
        return
    _received.append(number)
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise SystemExit(128 + number)


def _watch(reading: int, heard: list[int], done: threading.Event) -> None:
    """End the process if a signal has not ended it after a grace."""
    with os.fdopen(reading, "rb", buffering=0) as signals:
        while number := signals.read(1):
            if number[0] in heard and not done.wait(GRACE):
                with _EXIT:
                    if not done.is_set():
                        _end_now(number[0])


def _end_now(number: int) -> None:
    """End the process from another thread, leaving nothing."""
    clean_up(COMMITTED)
    with suppress(OSError, ValueError):
        shown = SHOW_CURSOR if os.isatty(2) else ""
        if number == signal.SIGINT:
            shown += f"flexsim: {one_line(farewell())}\n"
        os.write(2, shown.encode(errors="backslashreplace"))
    os._exit(128 + number)
