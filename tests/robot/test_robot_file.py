"""Plants by name, for the paper's robot and for a file's; what a file changes, in rows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from edits import DEFAULT, EDITS, edited

from flexsim import ModelError, ParameterError, Parameters, load_chain, setting
from flexsim.mjcf.differences import differences
from flexsim.numerics.step_limits import SHORTEST_STEP
from flexsim.plants.assumed_modes import assumed_modes
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.robot import Robot, plant_kind

CHAIN6 = Path(__file__).parents[2] / "models" / "chain6.xml"


def test_names_and_sizes() -> None:
    robot = Robot()
    assert plant_kind("chain:10") == ("chain", 10) and plant_kind("rigid") == ("rigid", None)
    for name, modes in (("rigid", 0), ("assumed-modes", 3), ("assumed-modes:5", 5), ("printed", 3)):
        plant = robot.plant(name)
        assert isinstance(plant, AssumedModesPlant)
        assert (plant.name, plant.modes, plant.form == "printed") == (
            name,
            modes,
            name == "printed",
        )
    for name, segments in (("chain", 6), ("chain:4", 4), ("untuned:12", 12)):
        plant = robot.plant(name)
        assert isinstance(plant, ChainPlant)
        assert (plant.name, len(plant.chain.lengths)) == (name, segments)
    assert (robot.plant("rod").name, robot.plant("rod:10").name) == ("rod", "rod:10")
    assert robot.plant("untuned:12").step < 1e-3  # halved for RK4


@pytest.mark.parametrize("name", ["rope", "chain:", "chain:0", "chain:1.5", "rigid:2", "Chain", ""])
def test_no_such_plant(name: str) -> None:
    with pytest.raises(ParameterError, match="is unknown; choose rigid, assumed-modes"):
        plant_kind(name)


def test_rigid_link_is_the_modes_without_modes() -> None:
    """Its kinetic energy is that of two rigid links."""
    p, plant = Parameters(), Robot().modes_plant(modes=0)
    assert plant.coefficients.tip.shape == (0,)
    state = np.array([[0.3, 1.2, 0.7, -0.4]])
    shown = plant.observe(state)
    J = p.I_H + p.I_b
    mass, first = p.m_H + p.m_b, p.rho * ((p.r + p.L) ** 2 - p.r**2) / 2
    w1, wb = 0.7, 0.3
    energy = (p.I_R0 + mass * p.L_R**2) * w1**2 / 2 + J * wb**2 / 2
    energy += p.L_R * first * np.cos(1.2) * w1 * wb
    assert shown.energy[0] == pytest.approx(energy, rel=1e-12)
    assert shown.v[0] == 0.0
    wanted = np.array([np.cos(0.3), np.sin(0.3)]) * p.L_R
    wanted += np.array([np.cos(1.5), np.sin(1.5)]) * p.reach
    assert shown.tip[0] == pytest.approx(wanted)


def test_a_file_is_the_robot_of_both_plants() -> None:
    robot = Robot.of(text=EDITS["payload"])
    modes, chain = robot.both(setting("reconstructed"))
    assert modes.parameters == chain.parameters
    assert modes.parameters.I_m2 == 0.0557 and modes.coefficients.I_m2 == 0.0557
    assert chain.chain.model.dof_armature[1] == 0.0557
    assert robot.file is not None and robot.file.model.dof_armature[1] == 0.0  # left alone
    assert modes.parameters.m_b == pytest.approx(0.0785)
    assert modes.parameters.payload == 0.05
    assert modes.parameters.payload_inertia == pytest.approx(5e-6)


def test_the_papers_beam_on_the_files_rigid_bodies() -> None:
    plant = Robot.of(text=EDITS["heavy link"], beam="analytic").modes_plant()
    paper = assumed_modes(Parameters(), 3)
    np.testing.assert_array_equal(plant.coefficients.stiffness, paper.stiffness)
    assert plant.coefficients.A == pytest.approx(paper.A + 0.25)
    assert Robot.of(text=EDITS["payload"], beam="analytic").modes_plant().parameters.m_b == (
        Parameters().m_b
    )


AHEAD = '<inertial pos="0.02 0 0" mass="0.05"'


@pytest.mark.parametrize(
    "text, words",
    [
        (EDITS["longer"], "its beam is 0.6 m long, the paper's 0.5 m"),
        (
            edited('<inertial pos="0 0 0" mass="0.47"', '<inertial pos="0.03 0 0" mass="0.47"'),
            "'hub' has its centre of mass beside joint2",
        ),
        (
            edited('<joint name="hinge3"', '<joint name="hinge3" frictionloss="0.1"'),
            "'hinge3' has dry friction",
        ),
        (
            EDITS["payload"].replace('<inertial pos="0 0 0" mass="0.05"', AHEAD),
            "'payload' has its centre of mass 0.02 m ahead of the tip",
        ),
    ],
)
def test_what_the_papers_beam_cannot_stand_in_for_is_refused(text: str, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        Robot.of(text=text, beam="analytic").modes_plant()


@pytest.mark.parametrize("F_2", [5.0, 20.0])
def test_steps_are_halved_for_damped_joints_too(F_2: float) -> None:
    modes, chain = Robot(Parameters(F_2=F_2)).both()
    assert modes.step <= 5e-4 and chain.step <= 5e-4
    with pytest.raises(ParameterError, match="damping at"):
        AssumedModesPlant(Parameters(F_2=F_2))


def test_what_contradicts_a_file_is_refused() -> None:
    robot = Robot.of(text=DEFAULT)
    with pytest.raises(ParameterError, match="has segments 6, not 8; leave it out"):
        robot.plant("chain:8")
    with pytest.raises(ParameterError, match=r"has step 0\.001, not 0\.0005"):
        robot.chain_plant(step=5e-4)
    for name in ("untuned", "rod"):
        with pytest.raises(ParameterError, match="made from a uniform beam"):
            robot.plant(name)
    with pytest.raises(ParameterError, match="--robot and --mjcf contradict"):
        Robot.of(CHAIN6, parameters=Parameters(L=0.6))
    with pytest.raises(ParameterError, match="has no effect without --mjcf"):
        Robot.of(beam="analytic")
    with pytest.raises(ParameterError, match="beam 'steel' is unknown; choose file or analytic"):
        Robot.of(CHAIN6, beam="steel")
    with pytest.raises(ModelError, match="link1"):
        Robot.of(text=edited('diaginertia="0.25 0.25 0.25"', 'diaginertia="0 0 0"'))


def test_a_step_that_the_modes_cannot_take_is_halved() -> None:
    stiff = Robot.of(text=EDITS["16 segments"])
    assert stiff.modes_plant(modes=3).step == 1e-3
    assert stiff.modes_plant(modes=12).step < 1e-3


@pytest.mark.parametrize("text", [DEFAULT, EDITS["4 segments"], EDITS["16 segments"]])
def test_no_difference_but_the_number_of_segments(text: str) -> None:
    chain = load_chain(text=text)
    segments = len(chain.lengths)
    rows = [row for row in differences(chain) if row.attribute != "timestep [s]"]
    assert rows == ([] if segments == 6 else [("beam", "segments", "6", str(segments))])


def test_differences_name_element_attribute_and_both_values() -> None:
    def shown(text: str) -> list[tuple[str, ...]]:
        return [tuple(row) for row in differences(load_chain(text=text))]

    assert ("hinge3", "stiffness [N m/rad]", "3.45788", "1.72894") in shown(EDITS["soft hinge"])
    damped = shown(EDITS["damped"])
    assert ("hinge1", "damping [N m s/rad]", "0.000745092", "0.00745092") in damped
    assert ("beam, as a uniform one", "zeta [-]", "0.000999948", "0.00999948") in damped
    assert shown(EDITS["heavy link"]) == [
        ("link1", "inertia [kg m2]", "0.25 0.25 0.25", "0.5 0.5 0.5")
    ]
    assert ("payload, added", "mass [kg]", "-", "0.05") in shown(EDITS["payload"])
    assert ("beam, as a uniform one", "L [m]", "0.5", "0.6") in shown(EDITS["longer"])
    slower = edited('timestep="0.001"', 'timestep="0.0005"')
    assert shown(slower) == [("option", "timestep [s]", "0.001", "0.0005")]
    heavy = shown(
        edited('contact="disable" gravity="disable"', "").replace(
            "<option ", '<option gravity="0 -9.81 0" density="1.2" '
        )
    )
    assert ("option", "contact disabled", "1", "0") in heavy
    assert ("option", "gravity [m/s2]", "0 0 0", "0 -9.81 0") in heavy
    assert ("option", "density [kg/m3]", "0", "1.2") in heavy
    limited = shown(edited('<joint name="joint1"', '<joint name="joint1" actuatorfrcrange="-1 1"'))
    assert limited == [("joint1", "actuatorfrcrange [N m]", "0 0", "-1 1")]
    nameless = shown(EDITS["payload"].replace('<body name="payload" ', "<body "))
    assert any(row[0] == "body 10 in segment6, added" for row in nameless)
    extra = edited('<site name="hub"/>', '<site name="hub"/><site name="mark" pos="0.01 0 0"/>')
    assert shown(extra) == []  # a mark does not act on the motion


def test_a_chain_takes_steps_as_short_as_a_robots_may_be() -> None:
    """Its file is read back with the limit by which the step was chosen."""
    chain = Robot(Parameters(zeta=0.49, EI=50.0)).chain_plant()
    assert SHORTEST_STEP <= chain.step < 1e-6


@pytest.mark.parametrize("given", [0.1, "0.1", ("a", "b", "c"), (0.1, None, 0.1)])
def test_modal_damping_that_is_no_ratios_is_refused(given: Any) -> None:
    with pytest.raises(ParameterError, match=r"modal damping (is|has)"):
        Robot(modal_damping=given)
