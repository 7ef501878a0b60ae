"""Is there a rerun viewer to send to? Its address, and a new one where there is none.

>>> answers(DEFAULT_URL) or start_viewer()              # doctest: +SKIP
"""

from __future__ import annotations

import socket
import subprocess
import time
from urllib.parse import urlsplit

from flexsim.errors import ParameterError, RunError
from flexsim.files.cleanup import kill_group, undone
from flexsim.recording.rerun_file import RERUN_TOOL

DEFAULT_URL = "rerun+http://127.0.0.1:9876/proxy"
SCHEMES = ("rerun", "rerun+http", "rerun+https")
REACHED = 0.5  # [s] for a viewer to take a connection
STARTED = 15.0  # [s] for a new viewer to do so
STAYS = 1.0  # [s] after which a viewer that has started does run


def answers(url: str) -> bool:
    """Return whether something takes connections at a viewer's address.

    Raises:
        ParameterError: it is no such address.
    """
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        port = None
    if port is None or parts.scheme not in SCHEMES or parts.path != "/proxy":
        raise ParameterError(f"{url!r} is no viewer's address; give one as {DEFAULT_URL}")
    try:
        socket.create_connection((parts.hostname or "", port), REACHED).close()
    except OSError:
        return False
    return True


def running_or_new(url: str | None = None) -> str:
    """Return the address of a viewer: the given one, that on this machine, or a new one's.

    Raises:
        ParameterError: it is no address of a viewer.
        RunError: the given one does not answer, or none can be started.
    """
    if url is not None:
        require_viewer(url)
        return url
    if not answers(DEFAULT_URL):
        start_viewer()
    return DEFAULT_URL


def require_viewer(url: str) -> None:
    """Raise a RunError unless a viewer answers there."""
    if not answers(url):
        raise RunError(f"no viewer answers at {url}; start one: rerun --port {urlsplit(url).port}")


def start_viewer() -> None:
    """Start a viewer on this machine that outlives us.

    Raises:
        RunError: it ends at once, as without a display.
    """
    process = subprocess.Popen(
        [*RERUN_TOOL, "--bind", "127.0.0.1", "--hide-welcome-screen"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    stays = False
    with undone(lambda: None if stays else kill_group(process)):  # with the viewer it started
        start = time.monotonic()
        while process.poll() is None and time.monotonic() - start < STARTED:
            if answers(DEFAULT_URL):
                time.sleep(STAYS)  # it listens before it opens its window
                stays = process.poll() is None
                break
            time.sleep(0.1)
    if not stays:
        raise RunError("the rerun viewer cannot start, as without a display")
