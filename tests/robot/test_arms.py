"""Arms by their names: one link on a stand is the two-joint arm with joint 1 locked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexsim.arm.arms import named_arm
from flexsim.arm.free_arm import joint_free_frequencies
from flexsim.errors import FlexsimError, ParameterError
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import TURN, Turn, path_named, reference
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.types import Array
from flexsim.plants.chain_plant import ChainPlant
from flexsim.robot import Robot
from studies.parity.motions import fitting_torque

FILE = Path(__file__).parents[2] / "models" / "one_link.xml"
NONE = setting("none")


def torque(rows: int) -> Array:
    t = 1e-3 * np.arange(rows)
    return np.column_stack([5 * np.sin(9 * t), 0.3 * np.sin(13 * t)])


def test_one_link_is_the_arm_with_joint_1_locked() -> None:
    free = ChainPlant.designed(replace(named_arm("one-link").parameters, I_m1=0.0))
    locked = drive(free.locked(["joint1"]), NONE, torque(100))
    found = drive(Robot.named("one-link").plant("chain"), NONE, torque(100))
    assert np.array_equal(found.state[:, 1:8], locked.state[:, 1:8])
    assert np.abs(found.joint[:, 0]).max() < 1e-25
    assert np.ptp(drive(free, NONE, torque(100)).joint[:, 0]) > 1e-3  # free, it would turn


def test_one_links_frequencies_are_the_exact_ones() -> None:
    """Of a beam on a hub: the equation of `free_arm`, which knows no modes."""
    robot = Robot.named("one-link")
    exact = joint_free_frequencies(robot.parameters, 3)
    for name, error in (("assumed-modes:5", 1e-6), ("chain", 3e-3)):
        linear = robot.plant(name).linearised(0.4)
        found = np.sqrt(natural_modes(linear.K, linear.M)[0][2:5])
        assert found == pytest.approx(exact, rel=error)


def test_the_file_of_one_link_has_one_motor_and_moves_alike() -> None:
    text = FILE.read_text(encoding="utf-8")
    assert "joint1" not in text
    assert text.count("<motor ") == 1
    named, own = Robot.named("one-link"), Robot.of(FILE)
    assert named.plant("chain").mjcf == text
    first, second = (drive(each.plant("chain"), NONE, torque(50)) for each in (named, own))
    assert np.array_equal(first.state, second.state)
    modes = drive(own.plant("assumed-modes"), NONE, torque(50))
    assert modes.joint[-1, 1] == pytest.approx(first.joint[-1, 1], rel=1e-3)


def test_a_file_without_joint_2_is_refused() -> None:
    text = FILE.read_text(encoding="utf-8").replace('"joint2"', '"elbow"')
    with pytest.raises(FlexsimError, match="lacks the joint named 'joint2'"):
        Robot.of(text=text)


def test_a_turn_is_a_reference_of_the_joints() -> None:
    p = named_arm("one-link").parameters
    found = reference(path_named("turn"), p)
    assert found.joint[-1] == pytest.approx([0.0, np.pi / 2])
    assert found.tip[0] == pytest.approx([1.0, 0.0])
    assert found.tip[-1] == pytest.approx([0.5, 0.5])
    assert found.time[-1] == pytest.approx(TURN.end_time)
    with pytest.raises(ParameterError, match="two finite angles"):
        Turn(end=(0.0, np.inf))
    with pytest.raises(ParameterError, match="duration over 0"):
        Turn(duration=0.0)
    with pytest.raises(ParameterError, match="lead"):
        Turn(lead=-1.0)


def test_trial_torques_leave_a_joint_that_stands_still() -> None:
    """In proportion to the inertia that a joint feels they would be 1e30 N m."""
    torque = fitting_torque(Robot.named("one-link").plant("chain"), 1.0)
    assert not torque[:, 0].any()
    assert 1e-3 < np.abs(torque[:, 1]).max() < 10.0
