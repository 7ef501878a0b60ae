"""Whatever is done to a file: it moves as MuJoCo moves it and its modes follow, or it is refused.

MuJoCo's own motion is that of the file as it is, compiled from its path and stepped by `mj_step`,
without a line of ours. Edits are random but the same at every run.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pytest
from random_edits import random_edit

from flexsim import FlexsimError
from flexsim.loop.followed import DURATION, FOLLOWED
from flexsim.loop.motion import Motion
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.mjcf.own_motion import POSE, TORQUE
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.robot import Robot

OTHER_ARMS = ("one_link.xml", "two_flexible.xml")  # tests/mjcf/test_other_arms.py
FILES = sorted((Path(__file__).parents[2] / "models").glob("*.xml"))
MODELS = [path for path in FILES if path.name not in OTHER_ARMS]
FEW, MANY = 60, 1000
SAME = 1e-6  # of the motion: how far a plant may be off MuJoCo's own
ROUNDING = 1e-14  # [rad, m] of sums of angles and lengths near 1
STEPS_MOST = 20_000  # of a file's own that are compared: shorter ones compare a shorter motion
FEWEST = 0.1  # of the edits that must be accepted, and refused: else nothing is tested


@dataclass
class Tally:
    """What became of the edits: accepted, refused as a whole, refused as modes only; the worst."""

    accepted: int = 0
    refused: int = 0
    alone: int = 0
    plant: float = 0.0
    modes: float = 0.0


def own_motion(path: Path, steps: int) -> Array:
    """Return theta1, theta2 [rad], the tip's x and y [m] (K+1, 4) of MuJoCo alone."""
    with quiet_warnings():
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        first, second = (int(model.joint(name).qposadr[0]) for name in ("joint1", "joint2"))
        data.qpos[:] = 0.0
        data.qpos[[first, second]] = POSE
        for name, tau in zip(("motor1", "motor2"), TORQUE, strict=True):
            data.actuator(name).ctrl[:] = tau
        rows = np.empty((steps + 1, 4))
        for row in rows:
            mujoco.mj_kinematics(model, data)
            row[:] = data.qpos[first], data.qpos[second], *data.site("tip").xpos[:2]
            mujoco.mj_step(model, data)
    return rows


def driven(plant: Plant, steps: int, period: float) -> Motion:
    return drive(plant, setting("none"), np.tile(TORQUE, (steps, 1)), period, POSE)


def places(motion: Motion) -> Array:
    return np.column_stack([motion.joint, motion.tip])


def off(found: Array, wanted: Array) -> float:
    """Return the largest difference of a column over that column's largest motion."""
    moved = np.abs(wanted - wanted[0]).max(axis=0)
    apart = np.abs(found - wanted).max(axis=0) - ROUNDING
    return float((apart / np.maximum(moved, ROUNDING)).max())


def modes_off(modes: Motion, own: Motion) -> float:
    """Return how far assumed modes are off: angles and tip by the worst sample, v by its mean."""
    angles = off(modes.joint, own.joint)
    tip = np.linalg.norm(modes.tip - own.tip, axis=1).max()
    tip /= np.linalg.norm(own.tip - own.tip[0], axis=1).max()
    bending = np.sqrt(np.mean((modes.v - own.v) ** 2) / np.mean(own.v**2))
    return float(max(angles, tip, bending))


def tried(path: Path, text: str, tally: Tally) -> None:
    """Check an edited file, or count its refusal."""
    path.write_text(text)
    try:
        robot = Robot.of(path)
        arm = robot.given
        assert arm is not None
        plant = robot.plant(arm.kind)
    except FlexsimError as error:
        assert "\n" not in str(error) and str(path) in str(error)
        tally.refused += 1
        return
    steps = min(round(DURATION / arm.step), STEPS_MOST)
    wanted = own_motion(path, steps)
    found = driven(plant, steps, arm.step)
    tally.accepted += 1
    apart = off(places(found), wanted)
    tally.plant = max(tally.plant, apart)
    assert apart <= SAME, f"plant {apart:.3g} off MuJoCo's own"
    try:
        modes = robot.plant("assumed-modes")
    except FlexsimError as error:
        assert "\n" not in str(error)
        tally.alone += 1
        return
    parts = max(1, int(np.ceil(arm.step / modes.step)))
    finer = driven(type(modes)(**vars_of(modes) | {"step": arm.step / parts}), steps, arm.step)
    apart = modes_off(finer, found)
    tally.modes = max(tally.modes, apart)
    assert apart <= FOLLOWED, f"modes {apart:.3g} off the plant"


def vars_of(plant: Plant) -> dict[str, object]:
    return {name: getattr(plant, name) for name in type(plant).__dataclass_fields__}


def edits(seed: int, count: int) -> Iterator[tuple[str, str]]:
    """Give (what was done to which model, text) of random edits."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        path = MODELS[i % len(MODELS)]
        done, text = random_edit(rng, path.read_text())
        yield f"{path.name} {i}: {done}", text


def run_edits(seed: int, count: int, path: Path) -> Tally:
    tally, failures = Tally(), []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for done, text in edits(seed, count):
            try:
                tried(path, text, tally)
            except (AssertionError, Exception) as error:
                failures.append(f"{done}: {type(error).__name__}: {error}")
    assert not failures, "\n".join([f"{len(failures)} of {count}, {tally}", *failures])
    return tally


@pytest.mark.parametrize("count", [FEW, pytest.param(MANY, marks=pytest.mark.slow)])
def test_an_edited_file_moves_as_mujoco_moves_it_or_is_refused(count: int, tmp_path: Path) -> None:
    tally = run_edits(1, count, tmp_path / "arm.xml")
    assert tally.accepted > FEWEST * count and tally.refused > FEWEST * count
    assert tally.accepted - tally.alone > FEWEST * count
