"""What searches end with, seed by seed: tables of studies/tuning.

python docs/made/searches.py robustness     # what must be borne, and what it costs
python docs/made/searches.py peers          # the genetic algorithm against its peers
python docs/made/searches.py shares         # of v in the index (5)
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence

import numpy as np
from asked import asked, own_folder, row, run_part

from controllers import TUNED_IDEAL
from flexsim import Robot, closed_loop, reference, setting, trajectory
from flexsim.loop.metrics import performance_index
from studies.core.evidence.digits import with_interval
from studies.core.evidence.intervals import median_interval, ratio_interval

SEEDS = range(1, 7)
LINE = (
    "--trajectory line --plant assumed-modes:5 --tuner cma --distribution wide --population 20 "
    "--generations 40 --exact --effort 3e-8"
)
SPREAD = "--exact-spread 0.2 --exact-payload 0.05"
BENCHES = "--hardware ideal delayed bench"
LATER = "--hardware bench --hardware-delay 2"
BORNE = (  # what, as the table has the options, the options
    ("the ideal loop", "`--hardware ideal`", "--hardware ideal"),
    ("and a sample of delay, and the bench", f"`{BENCHES}`", BENCHES),
    (
        "and EI 20 % less or more, and 50 g at the tip",
        f"`{SPREAD}` beside",
        f"{BENCHES} {SPREAD}",
    ),
    (
        "two samples of delay instead of one and none",
        f"`{LATER}`, and these",
        f"{LATER} {SPREAD}",
    ),
)
CIRCLE = "--trajectory circle --plant assumed-modes --hardware ideal --exact"
PEERS = {"genetic, section 3.2": "genetic", "differential evolution": "de", "CMA-ES": "cma"}


def searched(options: str) -> list[dict]:
    """Return what `flexsim tune` ends with for every seed."""
    words = shlex.split(options)
    return [asked("tune", *words, "--seed", seed, "--out", "run", "--force") for seed in SEEDS]


def median(values: Sequence[float], scale: float = 1.0) -> str:
    """Return a median with its interval, by order statistics."""
    return with_interval(float(np.median(values)), *median_interval(values), scale=scale)


def ratio(values: Sequence[float], of: Sequence[float]) -> str:
    """Return a ratio of medians with its interval, by a bootstrap of the seeds' pairs."""
    return with_interval(float(np.median(values) / np.median(of)), *ratio_interval(values, of, 1))


def robustness() -> None:
    """Print what a search ends with that must bear more and more."""
    before: list[float] | None = None
    for name, shown, options in BORNE:
        index = [each["best_index"] for each in searched(f"{LINE} {options}")]
        times = "" if before is None else ratio(index, before)
        row(name, shown, median(index, 1e4), times)
        before = index


def peers() -> None:
    """Print what three algorithms end with."""
    genetic: list[float] | None = None
    for name, tuner in PEERS.items():
        found = searched(f"{CIRCLE} --tuner {tuner}")
        index = [each["best_index"] for each in found]
        spent = sorted({each["evaluations"] for each in found})
        ends = str(spent[0]) if len(spent) == 1 else f"{spent[0]} to {spent[-1]}"
        row(name, median(index, 1e4), "" if genetic is None else ratio(index, genetic), ends)
        genetic = genetic or index


def shares() -> None:
    """Print v's share of the index of the controllers of the ideal loop, unperturbed."""
    for name in ("none", "simulink", "jump"):
        own = setting(name)
        plant = Robot().plant("assumed-modes", own)
        found = []
        for path, controller in TUNED_IDEAL.items():
            if path not in ("line", "two-loop", "circle"):
                continue
            wanted = reference(trajectory(path), plant.parameters)
            (motion,) = closed_loop(plant, own, wanted, [controller.filters(1e-3)])
            part = performance_index(motion, (0, 0, 1)) / performance_index(motion)
            found.append(f"{part:.1e}".replace("e-0", "e-"))
        row(f"friction `{name}`" if name == "none" else f"`{name}`", *found)


if __name__ == "__main__":
    with own_folder():
        run_part({"robustness": robustness, "peers": peers, "shares": shares})
