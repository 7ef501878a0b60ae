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
    """Give a process in a group of its own, killed with all it started when the block ends."""
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
        with suppress(ProcessLookupError):
            os.killpg(started.pid, signal.SIGKILL)
        started.communicate()


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
