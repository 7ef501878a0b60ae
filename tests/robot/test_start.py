"""Keyframes as starts: the file's own state on its own plant, its shape on the assumed modes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from edits import DEFAULT, edited

from flexsim import ParameterError, Robot, drive, setting
from flexsim.plants.chain_as_modes import vibration
from flexsim.robot.start import start_of
from studies.parity.motions import trial_torque

NONE = setting("none")
MODELS = Path(__file__).parents[2] / "models"
PLANTS = (
    *("rigid", "assumed-modes", "printed", "chain", "closed-chain"),
    *("untuned", "rule-of-thumb", "rod", "exudyn"),
)
BENT = 0.05 * 0.5  # [m] v of the keyframe `bent`, 5 % of the beam
STATIC = 3e-3  # relative: a beam bent by a force at its tip, of three modes, and large angles
ENERGY = 3e-3  # relative, of the same
RELEASED = 1e-4  # [m] rms over 0.5 s from 25 mm: 5 % of the beam, beyond the modes' 2 %
MOVING = edited(
    '<key name="home"',
    '<key name="swung" qpos="0.1 0.2 0 0 0 0 0 0" qvel="1 -2 0 0 0 0 0 0"/>\n'
    '    <key name="whipped" qpos="0.1 0.2 0.01 0.01 0 0 0 0" qvel="0 0 1 0.5 0 0 0 0.2"/>\n'
    '    <key qpos="0 0 0 0 0 0 0 0"/>\n    <key name="home"',
)


@pytest.mark.parametrize("plant", PLANTS)
def test_a_straight_keyframe_is_every_plants(plant: str) -> None:
    robot = Robot()
    start = start_of(robot, robot.plant(plant, NONE), "home")
    assert start.theta.tolist() == [0.3, 1.2] and start.at_rest and start.v == 0.0
    assert not start.state[2:].any()


def test_a_plant_of_the_file_has_its_own_state() -> None:
    robot = Robot.of(text=MOVING)
    for name in ("chain", "closed-chain"):
        start = start_of(robot, robot.plant(name, NONE), "whipped")
        model = robot.chain_plant().model
        i = model.key("whipped").id
        wanted = np.concatenate([model.key_qpos[i], model.key_qvel[i]])
        np.testing.assert_array_equal(start.state, wanted)
        assert start.v == start.v_of_file != 0.0 and not start.at_rest


def test_a_rod_has_its_own() -> None:
    robot = Robot.of(MODELS / "rod.xml")
    start = start_of(robot, robot.plant("rod", NONE), "bent")
    model = robot.rod.model if robot.rod else None
    assert model is not None
    np.testing.assert_array_equal(start.state[: model.nq], model.key("bent").qpos)


def test_rates_of_the_joints_are_every_plants() -> None:
    robot = Robot.of(text=MOVING)
    for name in ("rigid", "assumed-modes", "chain"):
        start = start_of(robot, robot.plant(name, NONE), "swung")
        assert start.theta.tolist() == [0.1, 0.2] and start.rates.tolist() == [1.0, -2.0]


@pytest.mark.parametrize("source", [None, "chain6.xml", "rod.xml", "analytic"])
def test_a_bent_beam_is_projected_on_the_modes(source: str | None) -> None:
    """Under a force at the tip: known deflection, and nearly all of the energy."""
    robot = Robot()
    if source is not None:
        beam = "analytic" if source == "analytic" else "file"
        robot = Robot.of(MODELS / ("chain6.xml" if beam == "analytic" else source), beam)
    plant = robot.plant("assumed-modes", NONE)
    start = start_of(robot, plant, "bent")
    assert start.at_rest and start.theta.tolist() == [0.3, 1.2]
    assert start.v == pytest.approx(BENT, rel=STATIC)
    assert start.v_of_file == pytest.approx(BENT, rel=STATIC)
    p = plant.parameters
    stored = float(plant.observe(start.state[None]).energy[0])
    assert stored == pytest.approx(BENT**2 / (2 * p.static_compliance), rel=ENERGY)


def test_with_all_modes_of_the_file_nothing_is_lost() -> None:
    """Six modes are all that six hinges have: every hinge angle comes back, and every rate."""
    robot = Robot.of(text=MOVING)
    plant = robot.plant("assumed-modes:6", NONE)
    start = start_of(robot, plant, "whipped")
    chain = robot.chain_plant()
    hinges = vibration(chain.chain, chain.parameters, 6).hinges
    key = chain.model.key("whipped")
    np.testing.assert_allclose(hinges @ start.state[2:8], key.qpos[2:], atol=1e-12)
    np.testing.assert_allclose(hinges @ start.state[10:], key.qvel[2:], atol=1e-12)


@pytest.mark.parametrize("beam", ["file", "analytic"])
def test_rates_are_the_derivative_of_positions(beam: str) -> None:
    """Two keyframes a hair apart along the rates are projected that far apart."""
    hair = 1e-6
    key = '<key name="whipped" qpos="0.1 0.2 0.01 0.01 0 0 0 0"'
    moved = f"0.1 0.2 {0.01 + hair} {0.01 + 0.5 * hair} 0 0 0 {0.2 * hair}"
    later = edited(key, f'<key name="whipped" qpos="{moved}"', MOVING)
    one, two = (
        start_of(robot, robot.plant("assumed-modes"), "whipped").state
        for robot in (Robot.of(text=text, beam=beam) for text in (MOVING, later))
    )
    m = len(one) // 2
    np.testing.assert_allclose((two - one)[2:m] / hair, one[m + 2 :], rtol=1e-4)


def test_released_beams_swing_alike() -> None:
    """From the same keyframe the two models stay together as far as their equations do."""
    robot = Robot.of(MODELS / "chain6.xml")
    tips = []
    for name in ("assumed-modes", "chain"):
        plant = robot.plant(name, NONE)
        start = start_of(robot, plant, "bent")
        tips.append(drive(plant, NONE, np.zeros((500, 2)), state=start.state).tip)
    assert np.abs(tips[0] - tips[0][0]).max() > BENT / 2
    assert np.sqrt(np.mean(np.sum((tips[0] - tips[1]) ** 2, axis=1))) < RELEASED


def test_a_locked_plant_starts_there_too() -> None:
    robot = Robot()
    plant = robot.plant("chain", NONE)
    state = start_of(robot, plant, "bent").state
    motion = drive(plant.locked(["joint1"]), NONE, trial_torque(1.0, duration=0.1), state=state)
    assert (motion.joint[:, 0] == 0.3).all() and motion.v[0] == pytest.approx(BENT, rel=STATIC)


@pytest.mark.parametrize(
    ("text", "plant", "name", "words"),
    [
        (DEFAULT, "chain", "bend", "has no keyframe 'bend'; choose home, bent. Did you mean bent?"),
        (DEFAULT, "chain", "", "has no keyframe ''; choose home, bent"),
        (MOVING, "chain", "", "choose swung, whipped, home, bent"),
        (DEFAULT, "rigid", "bent", "plant 'rigid' cannot be bent as keyframe 'bent'"),
        ((MODELS / "rod.xml").read_text(), "chain", "bent", "choose assumed-modes or rod"),
        (
            None,
            "exudyn",
            "bent",
            "plant 'exudyn' cannot be bent as keyframe 'bent' of the designed",
        ),
        (None, "rod", "bend", "the designed rod has no keyframe 'bend'"),
    ],
)
def test_what_cannot_be_taken_is_refused(
    text: str | None, plant: str, name: str, words: str
) -> None:
    robot = Robot() if text is None else Robot.of(text=text)
    with pytest.raises(ParameterError) as caught:
        start_of(robot, robot.plant(plant, NONE), name)
    assert words in str(caught.value)


def test_a_file_without_names_says_so() -> None:
    text = DEFAULT.replace('name="home" ', "").replace('name="bent" ', "")
    robot = Robot.of(text=text)
    with pytest.raises(ParameterError, match="it has none with a name; give the joint angles"):
        start_of(robot, robot.chain_plant(), "home")
