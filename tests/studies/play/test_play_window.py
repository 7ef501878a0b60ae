"""The real window, under a virtual display: what it shows, its keys, and how it is closed."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from programs import required

from studies.play.window import interrupt_closes

LAUNCH = "import sys; from studies.main import main; sys.exit(main(sys.argv[1:]))"
OPENED = 60.0  # [s] for a window, where all is to be compiled first
SHOWN = 20.0  # [s] for a key to be heard, on a busy machine that draws by software
ORANGE, BLUE, GREEN = (230, 158, 0), (26, 89, 179), (0, 158, 115)  # ghost, MuJoCo's beam, path
NEAR = 0.12  # of a colour's direction, lit and blended
SEEN = 40  # pixels


class XClientMessage(ctypes.Structure):
    """Xlib's XClientMessageEvent, padded to the size of an XEvent."""

    _fields_ = (
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", ctypes.c_void_p),
        ("window", ctypes.c_ulong),
        ("message_type", ctypes.c_ulong),
        ("format", ctypes.c_int),
        ("data", ctypes.c_long * 5),
        ("rest", ctypes.c_long * 12),
    )


def close_window(display: str, window: int) -> None:
    """Do what a window's close button does."""
    X = ctypes.CDLL("libX11.so.6")
    X.XOpenDisplay.restype = ctypes.c_void_p
    X.XInternAtom.restype = ctypes.c_ulong
    server = ctypes.c_void_p(X.XOpenDisplay(display.encode()))
    protocols, delete = (
        X.XInternAtom(server, name, 0) for name in (b"WM_PROTOCOLS", b"WM_DELETE_WINDOW")
    )
    message = XClientMessage(33, 0, 1, server, window, protocols, 32, (delete, 0, 0, 0, 0))
    X.XSendEvent(server, ctypes.c_ulong(window), 0, ctypes.c_long(0), ctypes.byref(message))
    X.XFlush(server)
    X.XCloseDisplay(server)


class Screen:
    """A virtual display, whose pixels are in a file."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        reading, writing = os.pipe()
        screen = ("-screen", "0", "900x700x24", "-fbdir", str(folder), "-nolisten", "tcp")
        self.server = subprocess.Popen(
            [required("Xvfb"), "-displayfd", str(writing), *screen],
            pass_fds=(writing,),
            stderr=subprocess.DEVNULL,
        )
        os.close(writing)
        with os.fdopen(reading) as number:
            self.name = f":{number.readline().strip()}"

    def tool(self, *words: str) -> str:
        """Return what xdotool says."""
        done = subprocess.run(
            [required("xdotool"), *words],
            env=os.environ | {"DISPLAY": self.name},
            capture_output=True,
            text=True,
            timeout=SHOWN,
        )
        return done.stdout

    def window(self) -> int:
        """Return the viewer's window, when it is there."""
        end = time.monotonic() + OPENED
        while time.monotonic() < end:
            found = self.tool("search", "--name", "MuJoCo").split()
            if found:
                return int(found[-1])
            time.sleep(0.1)
        raise AssertionError("no window was opened")

    def pixels(self) -> np.ndarray:
        """Return what is shown (height, width, 3), of the X window dump that Xvfb keeps."""
        raw = (self.folder / "Xvfb_screen0").read_bytes()
        head = struct.unpack(">25I", raw[:100])
        size, width, height, row, colours = head[0], head[4], head[5], head[12], head[19]
        flat = np.frombuffer(raw, np.uint8, row * height, size + 12 * colours)
        return flat.reshape(height, row // 4, 4)[:, :width, 2::-1].astype(float)

    def shows(self, colour: tuple[int, int, int]) -> int:
        """Return how many pixels have a colour's direction."""
        pixels, wanted = self.pixels(), np.array(colour, dtype=float)
        size = np.linalg.norm(pixels, axis=2)
        off = pixels / np.maximum(size, 1.0)[..., None] - wanted / np.linalg.norm(wanted)
        return int(((np.linalg.norm(off, axis=2) < NEAR) & (size > 60)).sum())

    def wait_for(self, *colours: tuple[int, int, int]) -> None:
        """Return when all these colours are seen."""
        end = time.monotonic() + SHOWN
        while time.monotonic() < end:
            if all(self.shows(colour) >= SEEN for colour in colours):
                return
            time.sleep(0.1)
        raise AssertionError(f"pixels of {colours}: {[self.shows(each) for each in colours]}")


@pytest.fixture(scope="module")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Screen]:
    required("xdotool")
    found = Screen(tmp_path_factory.mktemp("screen"))
    yield found
    found.server.terminate()
    found.server.wait()


def started(screen: Screen, folder: Path, *words: str) -> subprocess.Popen[str]:
    """Start the command, its output to be read."""
    return subprocess.Popen(
        [sys.executable, "-c", LAUNCH, "play", "--json", *words],
        env=os.environ | {"DISPLAY": screen.name},
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )


def test_it_shows_both_arms_hears_keys_and_is_closed(screen: Screen, tmp_path: Path) -> None:
    process = started(screen, tmp_path, "--push", "0", "3", "3", "0.3")
    window = screen.window()
    screen.wait_for(ORANGE, BLUE, GREEN)
    for key in ("p", "Down", "Right", "v", "space"):
        screen.tool("key", "--window", str(window), key)
    end = time.monotonic() + SHOWN
    while not (tmp_path / "runs" / "play.rrd").exists() and time.monotonic() < end:
        time.sleep(0.1)
    close_window(screen.name, window)
    out, err = process.communicate(timeout=SHOWN)
    assert (process.returncode, err) == (0, "")
    found = json.loads(out)
    knobs = {event["knob"]: event["value"] for event in found["events"] if "knob" in event}
    assert knobs == {"payload": 0.05, "proportional": pytest.approx(1.05)}
    assert found["recorded"] == ["runs/play.rrd"] and found["periods"] > 0
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["play.json", "play.rrd", "runs"]


@pytest.mark.slow  # the window is opened and closed above
def test_it_ends_after_its_time(screen: Screen, tmp_path: Path) -> None:
    short = started(screen, tmp_path, "--seconds", "0.4")
    out, err = short.communicate(timeout=OPENED + SHOWN)
    assert (short.returncode, err) == (0, "") and json.loads(out)["periods"] == 400
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_is_as_closing_the_window(interruptible: None) -> None:
    """The first only; what was before is back afterwards."""
    with interrupt_closes() as closed:
        assert not closed.is_set()
        signal.raise_signal(signal.SIGINT)
        assert closed.is_set()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
