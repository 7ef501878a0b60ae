"""Whatever is done to the files of other arms: they move as MuJoCo moves them, or are refused.

As `test_random_edits` has it for the paper's arm; a file of one link has no joint 1, whose angle
and torque MuJoCo alone then knows nothing of.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest
from random_edits import random_edit

from flexsim import FlexsimError
from flexsim.loop.followed import FOLLOWED
from flexsim.loop.motion import Motion
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.mjcf.own_motion import POSE, TORQUE
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.robot import Robot

MODELS = Path(__file__).parents[2] / "models"
FILES = (MODELS / "one_link.xml", MODELS / "two_flexible.xml")
FEW, MANY = 50, 600
SECONDS, STEPS_MOST = 0.1, 2000  # of a motion that is compared
SAME = 1e-6  # of the motion: how far a plant may be off MuJoCo's own
ROUNDING = 1e-14  # [rad, m] of sums of angles and lengths near 1
FEWEST = 0.1  # of the edits that must be accepted, and refused: else nothing is tested


def own_motion(path: Path, steps: int) -> Array:
    """Return theta2 [rad], the tip's x and y [m] (K+1, 3) of MuJoCo alone."""
    with quiet_warnings():
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        for number, (angle, tau) in enumerate(zip(POSE, TORQUE, strict=True), start=1):
            if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"joint{number}") < 0:
                continue  # the stand of one link
            data.joint(f"joint{number}").qpos[:] = angle
            data.actuator(f"motor{number}").ctrl[:] = tau
        rows = np.empty((steps + 1, 3))
        for row in rows:
            mujoco.mj_kinematics(model, data)
            row[:] = data.joint("joint2").qpos[0], *data.site("tip").xpos[:2]
            mujoco.mj_step(model, data)
    return rows


def moved(plant: Plant, steps: int, period: float, stands: bool) -> Motion:
    torque, pose = np.array(TORQUE), np.array(POSE)
    if stands:
        torque[0] = pose[0] = 0.0
    return drive(plant, setting("none"), np.tile(torque, (steps, 1)), period, pose)


def off(found: Array, wanted: Array) -> float:
    """Return the largest difference of a column over that column's largest motion."""
    went = np.abs(wanted - wanted[0]).max(axis=0)
    apart = np.abs(found - wanted).max(axis=0) - ROUNDING
    return float((apart / np.maximum(went, ROUNDING)).max())


def outcome(path: Path) -> str:
    """Return what became of a file: 'refused' in one line, 'alone' without modes, or 'accepted'."""
    try:
        robot = Robot.of(path)
        assert robot.file is not None
        plant = robot.plant("chain")
    except FlexsimError as error:
        assert "\n" not in str(error) and str(path) in str(error), str(error)
        return "refused"
    step, stands = robot.file.step, path.read_text().find('"joint1"') < 0
    steps = min(max(1, round(SECONDS / step)), STEPS_MOST)
    found = moved(plant, steps, step, stands)
    apart = off(np.column_stack([found.joint[:, 1], found.tip]), own_motion(path, steps))
    assert apart <= SAME, f"{apart:.3g} off MuJoCo's own"
    if not stands:  # two beams: the modes are those of the arm by its numbers
        return "alone"
    try:
        modes = robot.plant("assumed-modes")
    except FlexsimError as error:
        assert "\n" not in str(error)
        return "alone"
    parts = max(1, int(np.ceil(step / modes.step)))
    finer = moved(type(modes)(**fields_of(modes) | {"step": step / parts}), steps, step, stands)
    tip = np.linalg.norm(finer.tip - found.tip, axis=1).max()
    tip /= np.linalg.norm(found.tip - found.tip[0], axis=1).max()
    assert tip <= FOLLOWED, f"modes {tip:.3g} off the plant"
    return "accepted"


def fields_of(plant: Plant) -> dict[str, object]:
    return {name: getattr(plant, name) for name in type(plant).__dataclass_fields__}


def edits(seed: int, count: int) -> Iterator[tuple[str, str]]:
    """Give (what was done to which file, text) of random edits."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        path = FILES[i % len(FILES)]
        done, text = random_edit(rng, path.read_text())
        yield f"{path.name} {i}: {done}", text


@pytest.mark.parametrize("count", [FEW, pytest.param(MANY, marks=pytest.mark.slow)])
def test_an_edited_file_moves_as_mujoco_moves_it_or_is_refused(count: int, tmp_path: Path) -> None:
    path, found, failures = tmp_path / "arm.xml", [], []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for done, text in edits(1, count):
            path.write_text(text)
            try:
                found.append(outcome(path))
            except (AssertionError, Exception) as error:
                failures.append(f"{done}: {type(error).__name__}: {error}")
    assert not failures, "\n".join([f"{len(failures)} of {count}", *failures])
    for each in ("refused", "alone", "accepted"):
        assert found.count(each) > FEWEST * count, found


@pytest.mark.parametrize(
    ("file", "edit"),
    [
        ("one_link.xml", ('inertiafromgeom="false"', 'inertiafromgeom="false" boundmass="0.1"')),
        (
            "two_flexible.xml",
            ('inertiafromgeom="false"', 'inertiafromgeom="false" boundmass="0.1"'),
        ),
        ("one_link.xml", ('timestep="0.0005"', 'timestep="0.00025"')),
        ("two_flexible.xml", ('timestep="0.001"', 'timestep="0.0001"')),
        ("one_link.xml", ("<worldbody>", '<worldbody><geom size="0.1"/>')),
        ("two_flexible.xml", ("<worldbody>", '<worldbody><geom size="0.1" pos="0.5 0.2 0"/>')),
        ("one_link.xml", ('name="beam_zeta" data="0.001"', 'name="beam_zeta" data="1000"')),
        ("two_flexible.xml", ('name="beam1_zeta" data="0.001"', 'name="beam1_zeta" data="nan"')),
        ("one_link.xml", ("</option>", '</option><option timestep="0.0002"/>')),
        ("two_flexible.xml", ("</option>", '</option><option timestep="0.0002"/>')),
        ("one_link.xml", ('<joint name="joint2"', '<joint name="joint2" stiffness="3"')),
        ("two_flexible.xml", ('<joint name="joint2"', '<joint name="joint2" stiffness="3"')),
        ("two_flexible.xml", ('name="hinge3" stiffness="', 'name="hinge3" stiffness="9')),
        (
            "two_flexible.xml",
            ('name="link1_hinge3" stiffness="', 'name="link1_hinge3" stiffness="0'),
        ),
    ],
)
def test_edits_that_were_suspect(file: str, edit: tuple[str, str], tmp_path: Path) -> None:
    text = (MODELS / file).read_text()
    assert edit[0] in text
    path = tmp_path / file
    path.write_text(text.replace(*edit, 1))
    outcome(path)  # asserts what it promises
