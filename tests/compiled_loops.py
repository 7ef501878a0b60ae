"""The compiled loops, made once before the tests of two processes ask for them at the same time.

On a new machine the compiler takes as long as a third of the tests; two processes that start with
the same loop would both compile it. Each takes loops from one list instead, and the tests begin
when all are in the cache.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from controllers import TUNED_IDEAL
from flexsim import Robot, closed_loop, drive, reference, setting
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.trajectories import Trajectory

PATH = Trajectory("line", duration=0.01, hold=0.0, start=(0.60, 0.30), end=(0.599, 0.301))
PATIENCE = 120.0  # [s] for the others' loops; what is missing then is compiled where it is needed
PAUSE = 0.05  # [s] between looks


def _closed(plant: str, hardware: str = "ideal") -> None:
    """Run a plant's closed loop for ten samples."""
    model, chosen = Robot().plant(plant), setting("none", HARDWARE[hardware])
    filters = [TUNED_IDEAL["line"].filters(1e-3)]
    closed_loop(model, chosen, reference(PATH, model.parameters), filters, energy=False)


def _worn(plant: str) -> None:
    _closed(plant, "worn")


def _bridges(plant: str) -> None:
    _closed(plant, "bridges")


def _open(plant: str) -> None:
    """Drive a plant for ten samples."""
    drive(Robot().plant(plant), setting("none"), np.zeros((10, 2)), theta=(0.0, 1.0))


JOBS: tuple[tuple[Callable[[str], None], str], ...] = (  # the longest first
    (_closed, "printed"),
    (_closed, "closed-chain"),
    (_open, "printed"),
    (_closed, "assumed-modes"),
    (_bridges, "assumed-modes"),
    (_worn, "assumed-modes"),
    (_worn, "chain"),
    (_closed, "rod"),
    (_closed, "chain"),
    (_open, "assumed-modes"),
    (_open, "chain"),
    (_open, "rod"),
    (_open, "closed-chain"),
    *(((_closed, "exudyn"), (_open, "exudyn")) if find_spec("exudyn") else ()),
)


def compile_together(folder: Path) -> None:
    """Compile the loops, shared with other processes that are given the same folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, (run, plant) in enumerate(JOBS):
        try:
            os.close(os.open(folder / f"{number}.taken", os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        except FileExistsError:
            continue
        run(plant)
        (folder / f"{number}.done").touch()
    end = time.monotonic() + PATIENCE
    while len(list(folder.glob("*.done"))) < len(JOBS) and time.monotonic() < end:
        time.sleep(PAUSE)
