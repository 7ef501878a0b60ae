"""`flexsim compare` at half the step, with finer models, other repeats and EXUDYN: studies/compare.

python docs/made/compared.py variations
python docs/made/compared.py exudyn
"""

from __future__ import annotations

import shlex

import numpy as np
from asked import asked, own_folder, row, run_part

from controllers import TUNED
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import trajectory
from flexsim.robot import Robot
from studies.core.evidence.digits import with_interval
from studies.core.evidence.holding import holding
from studies.core.evidence.repeats import perturbed

VARIED = (
    "--step 0.0005 --chain-step 0.0005",
    "--plants assumed-modes:5 chain:10 --step 0.00025",
    "--seed 7",
)
CASES = (("line", "line"), ("two-loop", "two-loop"), ("circle", "circle"), ("line", "two-loop"))
REPEATS = {"ideal": 20, "delayed": 20, "bench": 40}


def variations() -> None:
    """Print the ratios of both models' envelopes, varied."""
    for options in VARIED:
        found = asked("compare", *shlex.split(options), "--out", "run", "--force")
        cells = [
            with_interval(each["ratio"], each["ratio_low"], each["ratio_high"], most=3)
            for each in found["rows"]
            if each["ratio"] is not None
        ]
        row(f"`{options}`", *cells)


def exudyn() -> None:
    """Print how v's rms at the end of a hold is to that before, over repeats on EXUDYN's beam."""
    robot = Robot()
    for name, repeats in REPEATS.items():
        own = setting("simulink", HARDWARE[name])
        plant = robot.plant("exudyn", own)
        cells = []
        for path, devised in CASES:
            again = perturbed(TUNED[devised], repeats - 1, np.random.default_rng(1))
            case = trajectory(path), TUNED[devised], 1e-3, robot
            found = holding(plant, own, *case, repeats=again)
            cells.append(with_interval(found.ratio_pooled, found.ratio_low, found.ratio_high))
        row(f"`{name}`", *cells)


if __name__ == "__main__":
    with own_folder():
        run_part({"variations": variations, "exudyn": exudyn})
