"""A rod's file as the robot: both models from it, or refused by name; and the rod linearised."""

import re
from pathlib import Path

import numpy as np
import pytest

from controllers import TUNED_IDEAL
from flexsim import ModelError, ParameterError, Parameters
from flexsim.linear.growth import loop_options
from flexsim.linear.linearise import linearise
from flexsim.linear.loop_poles import LoopOptions, linear_loop
from flexsim.loop.control.stacking import stack
from flexsim.loop.metrics import rms_distance
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import reference, trajectory
from flexsim.mjcf.as_parameters import parameters_of_rod
from flexsim.mjcf.differences import differences
from flexsim.mjcf.reading.text import is_rod
from flexsim.mjcf.rod_file import load_rod, rod_frequencies
from flexsim.mjcf.rod_xml import rod_mjcf
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.rod_plant import RodPlant
from flexsim.robot import Robot
from flexsim.shaping.true_tip import shaped_reference
from studies.main import main
from studies.parity.motions import POSE, trial_torque
from studies.stability.simulated import simulated_growth

FILE = Path(__file__).parents[2] / "models" / "rod.xml"
TEXT = FILE.read_text()
DIGITS = 1e-9  # relative: files have 12 digits
APART = 1e-3  # of v, tips of the rod and of three modes; measured: 3e-4
GROWTH = 0.01  # 1/s, of a linear loop and its simulation; measured: 0.002


def edited(old: str, new: str) -> str:
    assert old in TEXT, old
    return TEXT.replace(old, new, 1)


SOFT = re.sub(r'young="([^"]*)"', lambda m: f'young="{float(m[1]) / 2!r}"', TEXT)


def test_a_rod_is_told_from_a_chain() -> None:
    assert is_rod(TEXT)
    assert not is_rod((FILE.parent / "chain6.xml").read_text())
    assert not is_rod("<mujoco><!-- <flex/> --></mujoco>")


@pytest.mark.parametrize("robot", [Parameters(), Parameters(EI=0.2, L=0.6, rho=0.2, I_H=0.002)])
def test_the_robot_is_read_back_from_its_rod(robot: Parameters) -> None:
    found = parameters_of_rod(load_rod(text=rod_mjcf(robot)))
    for name, value in vars(robot).items():
        assert getattr(found, name) == pytest.approx(value, rel=DIGITS), name


def test_half_the_stiffness_is_half_on_every_plant() -> None:
    robot = Robot.of(text=SOFT)
    assert robot.parameters.EI == pytest.approx(0.349 / 2, rel=1e-6)
    modes, rod = robot.plant("assumed-modes"), robot.plant("rod")
    assert isinstance(rod, RodPlant) and rod.rod.text == SOFT
    torque = trial_torque(1.0)
    motions = [drive(plant, setting("none"), torque, theta=POSE) for plant in (modes, rod)]
    assert rms_distance(motions[0].tip, motions[1].tip) < APART * 5 * np.abs(motions[0].v).max()


def test_a_rod_of_negative_stiffness_is_refused_by_name() -> None:
    with pytest.raises(ModelError, match="EI"):
        parameters_of_rod(load_rod(text=re.sub(r'young="', 'young="-', TEXT)))


def test_differences_of_a_rod() -> None:
    assert differences(load_rod(FILE)) == []
    found = [tuple(row) for row in differences(load_rod(text=SOFT))]
    assert found == [
        ("beam, as a uniform one", "EI [N m2]", "0.349", "0.1745"),
        ("beam, as a uniform one", "zeta [-]", "0.001", "0.000707107"),
    ]
    shorter = [row.attribute for row in differences(load_rod(text=rod_mjcf(Parameters(), 10)))]
    assert "elements" in shorter


def test_the_papers_beam_on_a_rods_bodies() -> None:
    plant = Robot.of(text=SOFT, beam="analytic").plant("assumed-modes")
    assert isinstance(plant, AssumedModesPlant)
    assert plant.parameters.EI == Parameters().EI


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('mass="0.00544826813208', 'mass="0.050431', "body 'vertex1' has the mass 0.0504"),
        (
            '<joint name="joint2"',
            '<joint name="joint2" frictionloss="0.1"',
            "joint 'joint2' has dry friction.*--plant rod",
        ),
    ],
)
def test_what_only_the_rod_can_take_is_refused_by_name(old: str, new: str, words: str) -> None:
    robot = Robot.of(text=edited(old, new))
    assert robot.plant("rod").name == "rod"
    for name in ("assumed-modes", "chain", "rigid"):
        with pytest.raises(ModelError, match=words):
            robot.plant(name)


def test_numbers_that_contradict_the_file_are_refused() -> None:
    robot = Robot.of(FILE)
    assert robot.plant("rod:14").name == "rod:14"
    with pytest.raises(ParameterError, match="has elements 14, not 10"):
        robot.plant("rod:10")
    with pytest.raises(ParameterError, match=r"has step 0\.0005, not 0\.001"):
        robot.plant("rod", chain_step=1e-3)


def test_a_settings_motors_are_put_into_the_rod() -> None:
    rod = Robot.of(FILE).plant("rod", setting("reconstructed"))
    assert isinstance(rod, RodPlant)
    assert rod.rod.model.dof_armature[1] == setting("reconstructed").I_m2


def test_commands_take_a_rods_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, run = tmp_path / "soft.xml", tmp_path / "run"
    path.write_text(SOFT)
    assert main(["modes", str(path)]) == 0
    assert "EI [N m2]" in capsys.readouterr().out
    small = ["--population", "4", "--survivors", "2", "--generations", "1", "--plant", "rod"]
    assert main(["tune", "--mjcf", str(path), *small, "--out", str(run)]) == 0
    assert (run / "robot.xml").read_text() == SOFT
    assert main(["tune", "--resume", str(run)]) == 0
    assert main(["watch", str(path), "--once", "--no-viewer"]) == 0


def test_the_linear_rod_has_the_rods_frequencies() -> None:
    plant = RodPlant.designed(Parameters())
    linear = linearise(plant, 0.7)
    squared = np.linalg.eigvals(np.linalg.solve(linear.M, linear.K))
    found = np.sqrt(np.sort(np.abs(squared)))[2:]
    wanted = rod_frequencies(plant.rod.model, locked=False, theta2=0.7)[2:]
    assert found[:3] == pytest.approx(wanted[:3], rel=1e-6)


def test_the_linear_loop_grows_as_the_rods_simulation_does() -> None:
    plant = RodPlant.designed(Parameters(zeta=0.0))
    options: LoopOptions = loop_options(setting("none").friction, 1e-3, "stepped", None)
    loop = linear_loop(plant, 1.55, stack([TUNED_IDEAL["circle"]], 1e-3), options)
    simulated = simulated_growth(plant, loop, options)
    assert simulated == pytest.approx(loop.growth_rate, abs=GROWTH)
    assert loop.growth_rate > 0.5  # it does grow: a rod damps its highest modes less than a chain
    damped = linear_loop(
        RodPlant.designed(Parameters()), 1.55, stack([TUNED_IDEAL["circle"]], 1e-3), options
    )
    assert damped.growth_rate < 0.0  # which a ratio of 0.1 % in mode 1 stops


def test_a_rod_has_no_inversion_of_its_own() -> None:
    plant = RodPlant.designed(Parameters())
    with pytest.raises(ParameterError, match="no inversion"):
        shaped_reference(reference(trajectory("circle"), Parameters()), plant)
