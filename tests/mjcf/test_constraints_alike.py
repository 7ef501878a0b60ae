"""Files with limits, dry friction and contacts: a run is the same alone, after others, on threads.

What a solver of constraints hands from one step to the next is the run's own, so no run sees
another's, and each is MuJoCo's own to the bit.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.numerics.types import Array
from flexsim.robot import Robot

MODELS = Path(__file__).parents[2] / "models"
CHAIN, ROD = (MODELS / "chain6.xml").read_text(), (MODELS / "rod.xml").read_text()
JOINT2, HINGE2 = '<joint name="joint2"', '<joint name="hinge2"'
POSE = (0.2, 1.25)
TORQUE = (0.02, 0.3)  # [N m] drives joint 2 against its limit


def edited(text: str, old: str, new: str) -> str:
    assert old in text, old
    return text.replace(old, new, 1)


FILES = {
    "range": edited(CHAIN, JOINT2, f'{JOINT2} range="-3 1.3"'),
    "range, few iterations": edited(
        edited(CHAIN, JOINT2, f'{JOINT2} range="-3 1.3"'),
        "<option ",
        '<option iterations="2" solver="PGS" ',
    ),
    "dry friction": edited(CHAIN, HINGE2, f'{HINGE2} frictionloss="0.001"'),
    "contact": edited(
        edited(CHAIN, 'contact="disable" ', ""),
        "<worldbody>",
        '<worldbody><geom type="box" size="0.05 0.05 0.05" pos="0.1 0.81 0"/>',
    ).replace('material="tip"/>', 'material="tip" contype="1" conaffinity="1"/>'),
    "rod, warm": edited(ROD, ' warmstart="disable"', ""),
}
CODE = """
import sys, numpy as np
from controllers import TUNED_IDEAL
from flexsim import reference, setting, trajectory
from flexsim.loop.runs import closed_loop
from flexsim.loop.trajectories import Reference
from flexsim.robot import Robot
(b1, a1), (b2, a2) = TUNED_IDEAL["circle"].filters(1e-3)
pairs = [((g * b1, a1), (g * b2, a2)) for g in (1.0, -0.5, 0.7, 1.3, 0.9, 0.2)]
def states(plant, short, pairs, threads):
    runs = closed_loop(plant, setting("opposing"), short, pairs, threads=threads, energy=False)
    return [run.state for run in runs]
for path in sys.argv[1:]:
    robot = Robot.of(path)
    whole = reference(trajectory("circle"), robot.parameters)
    short = Reference(whole.time[:150], whole.tip[:150], whole.joint[:150])
    run = robot.plant(robot.given.kind), short
    alone = [states(*run, [pair], 1)[0] for pair in pairs]
    for threads in (1, 2, 4):
        for found, wanted in zip(states(*run, pairs, threads), alone):
            assert found.shape == wanted.shape and (found == wanted).all(), (path, threads)
    for found, wanted in zip(states(*run, pairs[::-1], 4), alone[::-1]):
        assert (found == wanted).all(), path
print("same")
"""


def own_motion(path: Path, steps: int) -> Array:
    """Return [qpos, qvel] (K+1, 2 nq) of MuJoCo alone."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    data.qpos[:2], data.ctrl[:] = POSE, TORQUE
    rows = np.empty((steps + 1, 2 * model.nq))
    for row in rows:
        row[:] = np.append(data.qpos, data.qvel)
        mujoco.mj_step(model, data)
    return rows


@pytest.mark.parametrize("name", FILES)
def test_a_run_is_mujocos_own_to_the_bit_after_any_other(name: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(FILES[name])
    robot = Robot.of(path)
    assert robot.given is not None
    plant = robot.plant(robot.given.kind)
    wanted = own_motion(path, 200)
    torque = np.tile(TORQUE, (200, 1))
    for _ in range(2):
        found = drive(plant, setting("none"), torque, plant.step, POSE).state
        np.testing.assert_array_equal(found, wanted)


def test_the_limit_is_reached() -> None:
    """Else the test above would test nothing."""
    robot = Robot.of(text=FILES["range"])
    motion = drive(robot.plant("chain"), setting("none"), np.tile(TORQUE, (200, 1)), theta=POSE)
    assert motion.joint[:, 1].max() > 1.3


def test_runs_are_the_same_on_one_two_and_four_threads(tmp_path: Path) -> None:
    paths = []
    for name in ("range", "range, few iterations", "dry friction", "contact"):
        paths.append(tmp_path / f"{name}.xml")
        paths[-1].write_text(FILES[name])
    done = subprocess.run(
        [sys.executable, "-c", CODE, *map(str, paths)],
        env=os.environ | {"NUMBA_NUM_THREADS": "4"},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "same\n", done.stderr
