"""An arm whose links both bend: exact frequencies, energy, MuJoCo against the closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from flexsim.arm.arms import Arm, FirstLink, named_arm
from flexsim.arm.parameters import Parameters
from flexsim.arm.series_beams import series_frequencies
from flexsim.errors import FlexsimError, ParameterError
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.two_flexible.beams_plant import TwoBeamsPlant
from flexsim.robot import Robot

FILE = Path(__file__).parents[2] / "models" / "two_flexible.xml"
NONE = setting("none")
ARM = "two-flexible"
START = (0.2, 1.2)  # [rad]
OF_MODES = 2e-6  # relative: six frequencies by five modes of each link
OF_CHAINS = 8e-3  # of tuned chains of six: the fifth, with motor 2 on the end of link 1
ROUNDING = 1e-9  # [rad] mj_step against the closed form after 200 steps of a moderate motion
STANDS = 1e-13  # [rad] of a locked joint: the closed form has sums of angles, to rounding
DRIFT = 1e-8  # relative, of energy over 0.03 s at 0.2 ms
APART = 1e-4  # [m] rms of the tip between the models over 0.5 s, v up to 2 mm


@pytest.fixture(scope="module")
def robot() -> Robot:
    return Robot.named("two-flexible")


def torque(rows: int) -> Array:
    """Return torques (rows, 2) that bend both links [N m]."""
    t = 1e-3 * np.arange(rows)
    return np.column_stack([0.3 * np.sin(9 * t), 0.05 * np.sin(13 * t)])


def frequencies(plant: Plant, theta2: float, n: int = 6) -> Array:
    linear = plant.linearised(theta2)
    return np.sqrt(natural_modes(linear.K, linear.M)[0][2 : 2 + n])


@pytest.mark.parametrize("theta2", [0.0, 1.2])
def test_frequencies_are_those_of_beams_in_series(robot: Robot, theta2: float) -> None:
    exact = series_frequencies(named_arm("two-flexible"), 6, theta2)
    modes, chain = robot.plant("assumed-modes:5"), robot.plant("chain")
    assert frequencies(modes, theta2) == pytest.approx(exact, rel=OF_MODES)
    assert frequencies(chain, theta2) == pytest.approx(exact, rel=OF_CHAINS)
    untuned = replace(  # the check sees a chain whose springs are off
        chain, chain=replace(chain.chain, model=_softer(chain.model))
    )
    assert np.abs(frequencies(untuned, theta2) / exact - 1).max() > OF_CHAINS


def _softer(model: mujoco.MjModel) -> mujoco.MjModel:
    changed = mujoco.MjModel.from_xml_string(FILE.read_text(encoding="utf-8"))
    changed.jnt_stiffness[:] = 0.98 * model.jnt_stiffness
    return changed


def test_mujoco_moves_as_the_closed_form(robot: Robot) -> None:
    rows = torque(200)
    chain = drive(robot.plant("chain"), NONE, rows, theta=START)
    closed = drive(robot.plant("closed-chain"), NONE, rows, theta=START)
    assert np.abs(chain.state - closed.state).max() < ROUNDING
    assert np.abs(chain.v).max() > 1e-4
    assert chain.link1 is not None
    assert chain.link1[-1, -1] != pytest.approx(  # joint 2 is not where a rigid link 1 has it
        0.5 * np.array([np.cos(chain.joint[-1, 0]), np.sin(chain.joint[-1, 0])]), abs=1e-4
    )


def test_the_tip_is_where_mujoco_has_it(robot: Robot) -> None:
    plant = robot.plant("chain")
    assert isinstance(plant, ChainPlant)
    data = mujoco.MjData(plant.model)
    angles = 0.05 * np.cos(np.arange(plant.model.nq))
    data.qpos[:] = angles
    mujoco.mj_forward(plant.model, data)
    state = np.concatenate([angles[plant.chain.order], np.zeros(plant.model.nq)])[None]
    seen = plant.observe(state)
    assert seen.tip[0] == pytest.approx(data.site("tip").xpos[:2], abs=1e-12)
    assert seen.v[0] == pytest.approx(data.sensor("tip_in_hub").data[1], abs=1e-12)
    assert seen.link1 is not None
    assert seen.link1[0, -1] == pytest.approx(data.body("hub").xpos[:2], abs=1e-12)


def free_motion(plant: TwoBeamsPlant, state: Array, steps: int) -> Array:
    """Return states (K+1, 2 m) of RK4 by the inverse dynamics, without compiling a loop."""
    m = len(state) // 2

    def rate(x: Array) -> Array:
        q, w = x[None, :m], x[None, m:]
        still = plant.needed_force(q, w, np.zeros((1, m)))[0]
        rows, turned = np.repeat(x[None], m, axis=0), np.eye(m)
        M = plant.needed_force(rows[:, :m], rows[:, m:], turned) - still
        return np.concatenate([x[m:], np.linalg.solve(M.T, -still)])

    found, h = [state], plant.step
    for _ in range(steps):
        x = found[-1]
        one = rate(x)
        two = rate(x + h / 2 * one)
        three = rate(x + h / 2 * two)
        found.append(x + h / 6 * (one + 2 * two + 2 * three + rate(x + h * three)))
    return np.array(found)


def test_energy_stays() -> None:
    for arm, kept in ((named_arm("two-flexible").undamped(), True), (named_arm(ARM), False)):
        plant = TwoBeamsPlant(arm, 3, 2e-4)
        state = plant.rest_state(START)
        state[2], state[5], state[8:10] = 0.02, -0.02, (2.0, -1.0)  # both bend and turn
        states = free_motion(plant, state, 150)
        energy = plant.observe(states).energy
        if kept:
            assert np.ptp(energy) < DRIFT * energy[0]
        else:
            assert energy[-1] < energy[0] * (1 - 10 * DRIFT)


@pytest.mark.slow
def test_the_compiled_motion_is_that_of_the_inverse_dynamics() -> None:
    plant = TwoBeamsPlant(named_arm(ARM), 3, 2e-4)
    state = plant.rest_state(START)
    state[8:10] = 2.0, -1.0
    motion = drive(plant, NONE, np.zeros((20, 2)), state=state)
    assert np.abs(motion.state[-1] - free_motion(plant, state, 100)[-1]).max() < ROUNDING


@pytest.mark.slow
def test_a_stiff_link_1_moves_as_the_papers_arm() -> None:
    """The tip's difference falls with 1/EI of link 1."""
    p, rows = Parameters(), torque(100)
    paper = drive(AssumedModesPlant(p, 3, 2.5e-4), NONE, rows, theta=START)
    apart = []
    for EI, step in ((100.0, 1e-3 / 16), (1000.0, 1e-3 / 64)):
        plant = TwoBeamsPlant(Arm(p, FirstLink(EI=EI, rho=0.05)), 3, step)
        motion = drive(plant, NONE, rows, theta=START)
        apart.append(float(np.abs(motion.tip - paper.tip).max()))
    assert 7 < apart[0] / apart[1] < 13
    assert apart[1] < 1e-5


@pytest.mark.slow
def test_the_models_agree_in_open_loop(robot: Robot) -> None:
    rows = torque(500)
    beams = drive(robot.plant("assumed-modes", step=2.5e-4), NONE, rows, theta=START)
    chain = drive(robot.plant("closed-chain"), NONE, rows, theta=START)
    assert np.sqrt(np.mean((beams.tip - chain.tip) ** 2)) < APART
    assert np.abs(chain.v).max() > 1e-3


def test_forces_that_a_motion_needs_are_alike() -> None:
    """Inverse dynamics of the equations: M from kinetic energy, at a bent and moving arm."""
    plant = TwoBeamsPlant(named_arm("two-flexible"), 2, 1e-4)
    rng = np.random.default_rng(3)
    q, w = 0.1 * rng.normal(size=(1, 6)), rng.normal(size=(1, 6))
    still = plant.needed_force(q, w, np.zeros((1, 6)))
    columns = [(plant.needed_force(q, w, row[None]) - still)[0] for row in np.eye(6)]
    M = np.array(columns)
    assert pytest.approx(M.T, abs=1e-13) == M
    elastic = plant.observe(np.hstack([q, 0 * w])).energy[0]
    kinetic = plant.observe(np.hstack([q, w])).energy[0] - elastic
    assert kinetic == pytest.approx(w[0] @ M @ w[0] / 2, rel=1e-12)


@pytest.mark.slow
def test_locked_joints_stand_still(robot: Robot) -> None:
    for name in ("assumed-modes", "closed-chain"):
        plant = robot.plant(name).locked(["joint2"])
        motion = drive(plant, NONE, torque(50), theta=START)
        assert np.ptp(motion.joint[:, 1]) < STANDS
        assert np.ptp(motion.joint[:, 0]) > 1e-4


def test_the_file_is_as_written_and_read_back(robot: Robot) -> None:
    chain = robot.plant("chain")
    assert chain.mjcf == FILE.read_text(encoding="utf-8")
    own = Robot.of(FILE)
    assert own.both_bend
    moved = drive(own.plant("chain"), NONE, torque(20), theta=START)
    assert np.array_equal(moved.state, drive(chain, NONE, torque(20), theta=START).state)


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (('pos="0.5 0 0"', 'pos="0.5 0 0"'), "made from two uniform beams"),
        (('<joint name="hinge1"', '<joint name="hinge1" axis="0 1 0"'), "must turn about z"),
        (('name="motor2"', 'name="motor3"'), "lacks the motor named 'motor2'"),
        (('timestep="0.001"', 'timestep="0.002"'), "too long for RK4"),
    ],
)
def test_what_a_file_cannot_be_is_one_line(edit: tuple[str, str], said: str) -> None:
    text = FILE.read_text(encoding="utf-8").replace(*edit)
    with pytest.raises(FlexsimError, match=said):
        Robot.of(text=text).plant("assumed-modes")


def test_what_has_a_rigid_link_1_is_refused(robot: Robot) -> None:
    for ask in (robot.both, lambda: robot.plant("rod"), lambda: robot.plant("rigid")):
        with pytest.raises(ParameterError, match="link 1"):
            ask()
    with pytest.raises(ParameterError, match="too long for RK4"):
        robot.plant("assumed-modes:5", step=1e-2)


def test_a_stiffer_robot_has_higher_frequencies(robot: Robot) -> None:
    softer, stiffer = robot.plant("assumed-modes"), robot.changed(4.0, 1.0, 0.0)
    found = frequencies(stiffer.plant("assumed-modes"), 1.2, 2)
    assert found == pytest.approx(2 * frequencies(softer, 1.2, 2), rel=1e-9)
