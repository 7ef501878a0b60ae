"""MuJoCo's elastic rod beside the beam: a table of models/README.md.

python docs/made/rod.py
"""

from __future__ import annotations

import numpy as np
from asked import numbers, row

from flexsim import Parameters, Robot
from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.numerics.eigen import natural_modes
from studies.parity.motions import POSE, trial_torque

SIZES = (10, 14, 20)


def main() -> None:
    """Print the table's rows but for the costs."""
    robot = Robot()
    rods = [robot.plant(f"rod:{size}") for size in SIZES]
    clamped = clamped_frequencies(Parameters(), 3)
    free = joint_free_frequencies(Parameters(), 3)
    free_rows, clamped_rows = [], []
    for rod in rods:
        near = rod.linearised(0.0)
        squared, _ = natural_modes(near.K, near.M)
        free_rows.append(np.sqrt(squared[2:5]) / free - 1)
        held, _ = natural_modes(near.K[2:, 2:], near.M[2:, 2:])
        clamped_rows.append(np.sqrt(held[:3]) / clamped - 1)
    row("physics step [ms]", *(f"{1e3 * rod.step:g}" for rod in rods))
    title = "error of the clamped frequencies 1, 2, 3 [%]"
    row(title, *(numbers(each, "+.2f", 100) for each in clamped_rows))
    title = "error of the joint-free frequencies 1, 2, 3 [%]"
    row(title, *(numbers(each, "+.2f", 100) for each in free_rows))
    none, torque = setting("none"), trial_torque(1.0)
    undamped = Robot(Parameters(zeta=0.0))
    modes = drive(undamped.modes_plant(none), none, torque, theta=POSE)
    tips = [drive(undamped.plant(rod.name), none, torque, theta=POSE).tip for rod in rods]
    apart = [np.sqrt(np.mean(np.sum((tip - modes.tip) ** 2, axis=1))) for tip in tips]
    title = "tip against the assumed modes, 9 mm of deflection, undamped [mm rms]"
    row(title, *(f"{1e3 * each:.3f}" for each in apart))


if __name__ == "__main__":
    main()
