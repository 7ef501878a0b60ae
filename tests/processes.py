"""Commands in processes of their own, which never outlive the test that starts them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PATIENCE = 60.0  # [s] for a process to start or to stop on a busy machine
# What `nohup` and a shell's & leave ignored is inherited; these processes are to be interrupted
COMMAND = (
    "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from studies.main import main; sys.exit(main())"
)
FLEXSIM = [sys.executable, "-c", COMMAND]


@contextmanager
def process(words: list[str], **how: Any) -> Iterator[subprocess.Popen[str]]:
    """Give a process in a session of its own, killed with all it started when the block ends."""
    settings: dict[str, Any] = {
        "stdin": subprocess.DEVNULL,
        "stdout": subprocess.PIPE,
        "stderr": subprocess.PIPE,
        "text": True,
        "start_new_session": True,
        "env": {**os.environ, "PYTHONPATH": str(ROOT)},
    }
    started = subprocess.Popen(words, **settings | how)
    try:
        yield started
    finally:
        for pid in of_session(started.pid):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        started.wait()
        for pipe in (started.stdout, started.stderr):
            if pipe is not None:
                pipe.close()


def of_session(session: int) -> list[int]:
    """Return the processes that run in a session: what its first one started, and what those did.

    Without /proc it is the first one alone.
    """
    found = [] if Path("/proc/self/stat").exists() else [session]
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _, _, of = stat.read_text().rpartition(")")[2].split()[:4]
            if int(of) == session and state != "Z":
                found.append(int(stat.parent.name))
    return found


@contextmanager
def flexsim(*words: object, **how: Any) -> Iterator[subprocess.Popen[str]]:
    """Give a process that runs a command of ours, as `process`."""
    with process([*FLEXSIM, *map(str, words)], **how) as started:
        yield started


def wait_for(there: Callable[[], bool], started: subprocess.Popen[str]) -> None:
    """Wait until a process has done something; fail if it ends before, or never does."""
    until = time.monotonic() + PATIENCE
    while not there():
        assert started.poll() is None, started.communicate()
        assert time.monotonic() < until
        time.sleep(0.002)
