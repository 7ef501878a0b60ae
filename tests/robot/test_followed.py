"""Files whose assumed modes do not follow them; friction, held over a step, with light hubs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from flexsim import DivergenceError, ModelError, ParameterError, Parameters, drive, setting
from flexsim.loop.followed import FOLLOWED, deviation
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.robot import Robot

MODELS = Path(__file__).parents[2] / "models"
CHAIN, ROD = (MODELS / "chain6.xml").read_text(), (MODELS / "rod.xml").read_text()
UNDAMPED = re.sub(r'(name="hinge\d".*) damping="[^"]*"', r'\1 damping="0"', CHAIN)
HUB = 'mass="0.47" diaginertia="0.001322 0.001322 0.001322"'
SHIPPED = {"chain4": 1e-3, "chain6": 1e-3, "chain10": 1e-3, "rod": 1e-2}  # the rod's modes 2 and 3
# are low by a per cent; the chains' first three are the beam's
NUDGE = 1e-6  # [rad/s] of joint 2 at the start
LIGHT = Parameters(I_H=4e-4)  # friction of joint 2, held for 1 ms, is beyond 2 J/h


def edited(text: str, old: str, new: str) -> str:
    assert old in text, old
    return text.replace(old, new, 1)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_files_are_followed(name: str) -> None:
    robot = Robot.of(MODELS / f"{name}.xml")
    assert robot.given is not None
    assert deviation(robot.given, robot.modes_plant()) < SHIPPED[name]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            edited(UNDAMPED, HUB, 'mass="0.47" diaginertia="1e-6 1e-6 1e-6"'),
            r"3 assumed modes are 6\.\d+ % off the chain's own motion .*; 4 modes follow it",
        ),
        (edited(CHAIN, 'mass="0.011541855"', 'mass="10.541855"'), "4 modes follow it"),
        (
            edited(CHAIN, 'integrator="RK4"', 'integrator="discrete"'),
            "discrete damps the first modes with ratios of 0.028, 0.0",
        ),
        (
            re.sub('solref="[^"]*" solimp="[^"]*"', 'solref="0.05 1" solimp="0.5 0.9 0.01"', ROD),
            "off the rod's own motion",
        ),
    ],
    ids=["light hub", "heavy segment", "discrete", "soft edges"],
)
def test_a_file_that_its_modes_do_not_follow_is_refused_by_figures(text: str, words: str) -> None:
    robot = Robot.of(text=text)
    arm = robot.given
    assert arm is not None and robot.plant(arm.kind).step == arm.step  # alone it runs
    with pytest.raises(ModelError, match=words) as refused:
        robot.modes_plant()
    assert "\n" not in str(refused.value)
    assert robot.modes_plant(modes=1).modes == 1  # who asks for fewer modes knows


def test_more_modes_follow_where_it_is_said() -> None:
    robot = Robot.of(text=edited(CHAIN, HUB, 'mass="0.47" diaginertia="1e-6 1e-6 1e-6"'))
    plant = robot.modes_plant(modes=4)
    assert robot.file is not None and deviation(robot.file, plant) <= FOLLOWED


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('<inertial pos="0 0 0" mass="0.47"', '<inertial pos="0.03 0 0" mass="0.47"', "0.03 m"),
        ('name="root" pos', 'name="stump" pos', "body 'root' has the mass 0"),
        ('diaginertia="1e-14 1e-14 1e-14"', 'diaginertia="1e-4 1e-4 1e-4"', "inertias"),
    ],
)
def test_what_a_rods_modes_do_not_have_is_refused_by_name(old: str, new: str, words: str) -> None:
    text = edited(ROD, old, new)
    if "stump" in new:
        text = text.replace('body="root root', 'body="stump stump')
    robot = Robot.of(text=text)
    assert robot.plant("rod").name == "rod"
    with pytest.raises(ModelError, match=words):
        robot.plant("assumed-modes")


# ---- friction held over a step


@pytest.mark.parametrize("name", ["assumed-modes", "printed", "chain", "untuned"])
def test_a_light_hub_gets_a_shorter_step_for_friction(name: str) -> None:
    """And none where there is no such friction."""
    free, rubbed = (Robot(LIGHT).plant(name, setting(law)) for law in ("none", "opposing"))
    assert free.step == 1e-3
    assert rubbed.step < 1e-3
    assert Robot().plant(name, setting("opposing")).step == 1e-3


@pytest.mark.parametrize("name", ["assumed-modes", "chain"])
def test_a_step_too_long_for_friction_is_refused_in_one_line(name: str) -> None:
    with pytest.raises((ModelError, ParameterError), match="too long for friction") as refused:
        Robot(LIGHT).plant(name, setting("opposing"), step=1e-3, chain_step=1e-3)
    assert "\n" not in str(refused.value)
    file = Robot.of(text=edited(CHAIN, HUB, HUB.replace("0.001322", "0.0004")))
    with pytest.raises(ModelError, match=r"timestep 0\.001 s is too long for friction"):
        file.plant("chain", setting("opposing"))


def test_uncontrolled_the_light_hub_runs_away_at_the_longer_step_only() -> None:
    """So it is no controller's failure: nothing is commanded, and a millionth of a rad/s grows."""
    law, still = setting("opposing"), np.zeros((1500, 2))
    shorter, longer = Robot(LIGHT).modes_plant(law), AssumedModesPlant(LIGHT, step=1e-3)
    state = shorter.rest_state((0.0, 1.2))
    nudge = len(state) // 2 + 1
    state[nudge] = NUDGE
    motion = drive(shorter, law, still, 1e-3, state=state)
    assert np.abs(motion.state[-100:, nudge]).max() < NUDGE
    with pytest.raises(DivergenceError, match="ran away"):
        drive(longer, law, still, 1e-3, state=state)
