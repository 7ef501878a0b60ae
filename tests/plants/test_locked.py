"""A locked joint: it stays, and all else moves as if the joint were not there."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from edits import DEFAULT, edited
from scipy.linalg import expm

from flexsim import ChainPlant, ParameterError, Parameters, Plant, Robot, RodPlant, drive, setting
from flexsim.arm.free_arm import clamped_frequencies
from flexsim.arm.locked import JOINTS, LOCKED
from flexsim.mjcf.chain_file import load_chain
from flexsim.mjcf.rod_file import load_rod
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array
from flexsim.plants.linear_plant import LinearPlant
from studies.parity.motions import trial_torque

NONE = setting("none")
PLANTS = ("rigid", "assumed-modes", "printed", "chain", "closed-chain", "untuned", "rod", "exudyn")
LINEAR = tuple(name for name in PLANTS if name != "rigid")
LOCKS = (("joint1",), ("joint2",), ("joint1", "joint2"))
POSE = (0.3, 1.2)  # [rad]
STAYS = 1e-9  # [rad] promised
MOVES = 1e-3  # [rad] a joint that is not locked does
TIP = 1e-5  # [m] rms over 2 s, promised of the two plants under small torques, locked or not
ROUNDING = 1e-12  # [rad, m] of a motion of 0.5 s against MuJoCo's own without the joint
FREQUENCY = 1e-9  # relative: eigenvalues of two matrices that differ in one row and column
BEAM = 1e-6  # relative, of the assumed modes' first three to the exact clamped beam
SMALL = 1e-3  # of the trial torque, so that what is not linear is a millionth
FOLLOWS = 1e-4  # relative to the largest: RK4 and the trapezoidal rule against the exponential
MODELS = Path(__file__).parents[2] / "models"


def locked(name: str, joints: tuple[str, ...]) -> Plant:
    return Robot().plant(name, NONE).locked(joints)


def without(linear: LinearPlant, joints: tuple[str, ...]) -> tuple[Array, Array, Array, Array]:
    """Return M, D, K, S without the rows and columns of joints."""
    keep = [i for i in range(len(linear.M)) if i >= 2 or JOINTS[i] not in joints]
    take = np.ix_(keep, keep)
    return linear.M[take], linear.D[take], linear.K[take], linear.S[keep]


@pytest.mark.parametrize("joints", LOCKS, ids="+".join)
@pytest.mark.parametrize("name", PLANTS)
def test_it_stays_and_the_other_moves(name: str, joints: tuple[str, ...]) -> None:
    motion = drive(locked(name, joints), NONE, trial_torque(1.0, duration=0.5), theta=POSE)
    away = np.abs(motion.joint - POSE).max(axis=0)
    for joint, moved in zip(JOINTS, away, strict=True):
        assert moved < STAYS if joint in joints else moved > MOVES


def test_a_heavy_motor_alone_is_no_lock() -> None:
    """Negative control: a joint of a hundred times the arm's inertia is seen to move."""
    heavy = Robot(Parameters(I_m1=100.0)).plant("assumed-modes", NONE)
    motion = drive(heavy, NONE, trial_torque(1.0), theta=POSE)
    assert np.abs(motion.joint[:, 0] - POSE[0]).max() > 1e3 * STAYS


def removed(text: str, joint: str, pose: float) -> mujoco.MjModel:
    """Return MuJoCo's model of a file without a joint, its bodies turned by the joint's angle."""
    name = re.escape(joint)
    text = re.sub(rf'<joint name="{name}"[^>]*/>', "", text)
    text = re.sub(rf'<(motor|jointpos|jointvel) [^>]*joint="{name}"[^>]*/>', "", text)
    text = re.sub(r"<keyframe>.*?</keyframe>", "", text, flags=re.DOTALL)
    body = {"joint1": '<body name="link1"', "joint2": '<body name="hub"'}[joint]
    model: mujoco.MjModel = mujoco.MjModel.from_xml_string(
        text.replace(body, f'{body} euler="0 0 {pose}"')
    )
    return model


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.parametrize("file", ["chain6.xml", "rod.xml"])
def test_mujoco_moves_as_without_the_joint(file: str, joint: str) -> None:
    """An independent truth: the same file, the joint deleted, stepped by MuJoCo alone."""
    text = (MODELS / file).read_text()
    plant: Plant
    if file == "rod.xml":
        plant = RodPlant(Parameters(), load_rod(text=text))
    else:
        plant = ChainPlant(Parameters(), load_chain(text=text))
    which = JOINTS.index(joint)
    torque = trial_torque(1.0, duration=0.5)
    found = drive(plant.locked([joint]), NONE, torque, theta=POSE).state
    model = removed(text, joint, POSE[which])
    data = mujoco.MjData(model)
    data.qpos[0] = POSE[1 - which]
    rows = [data.qpos.copy()]
    with quiet_warnings():
        for row in torque:
            data.ctrl[0] = row[1 - which]
            for _ in range(round(1e-3 / plant.step)):
                mujoco.mj_step(model, data)
            rows.append(data.qpos.copy())
    own = np.delete(found[:, : found.shape[1] // 2], which, axis=1)
    assert np.abs(np.array(rows) - rows[0]).max() > MOVES
    np.testing.assert_allclose(own, rows, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("joints", LOCKS, ids="+".join)
def test_the_closed_form_is_mujocos_chain_locked_too(joints: tuple[str, ...]) -> None:
    """In absolute angles joint 2's motor is on both links: no pivot may be lost beside it."""
    torque = trial_torque(1.0)
    one, other = (
        drive(locked(name, joints), NONE, torque, theta=POSE) for name in ("chain", "closed-chain")
    )
    np.testing.assert_allclose(one.state, other.state, rtol=0, atol=100 * ROUNDING)
    np.testing.assert_allclose(one.joint, other.joint, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("joints", LOCKS, ids="+".join)
@pytest.mark.parametrize("name", LINEAR)
def test_frequencies_are_those_without_its_row_and_column(
    name: str, joints: tuple[str, ...]
) -> None:
    free = Robot().plant(name, NONE)
    M, _, K, _ = without(free.linearised(POSE[1]), joints)
    wanted, _ = natural_modes(K, M)
    still = free.locked(joints).linearised(POSE[1])
    found, _ = natural_modes(still.K, still.M)
    rigid, bending = 2 - len(joints), slice(2, None)
    np.testing.assert_allclose(
        np.sqrt(found[bending]), np.sqrt(wanted[rigid:]), rtol=FREQUENCY, atol=0
    )
    highest, _ = natural_modes(free.linearised(POSE[1]).K, free.linearised(POSE[1]).M)
    assert found[-1] < highest[-1]  # so that the step need not be shorter


def test_with_both_locked_the_beam_is_the_clamped_one() -> None:
    still = locked("assumed-modes", JOINTS).linearised(POSE[1])
    found, _ = natural_modes(still.K, still.M)
    exact = clamped_frequencies(Parameters(), 3)
    np.testing.assert_allclose(np.sqrt(found[2:]), exact, rtol=BEAM)


@pytest.mark.parametrize("joints", LOCKS[:2], ids="+".join)
@pytest.mark.parametrize("name", ["assumed-modes", "printed", "chain", "rod", "exudyn"])
def test_small_motions_are_those_of_the_reduced_equations(
    name: str, joints: tuple[str, ...]
) -> None:
    """The linear plant with the joint's row and column taken out, by its exponential."""
    free = Robot().plant(name, NONE)
    torque = SMALL * trial_torque(1.0, duration=0.3)
    pose = (0.0, POSE[1])
    motion = drive(free.locked(joints), NONE, torque, theta=pose)
    linear = free.linearised(POSE[1])
    M, D, K, S = without(linear, joints)
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    B = np.vstack([np.zeros((n, 2)), np.linalg.solve(M, S)])
    whole = expm(1e-3 * np.block([[A, B], [np.zeros((2, 2 * n + 2))]]))
    state = np.zeros(2 * n)
    rows = [state]
    for row in torque:
        state = whole[: 2 * n] @ np.concatenate([state, row])
        rows.append(state)
    theta = np.array(rows)[:, 0]
    v = np.array(rows)[:, :n] @ np.delete(linear.tip, [JOINTS.index(each) for each in joints])
    moving = 1 - JOINTS.index(joints[0])
    for found, wanted in ((motion.joint[:, moving] - pose[moving], theta), (motion.v, v)):
        bound = FOLLOWS if name in ("assumed-modes", "printed", "chain") else 30 * FOLLOWS
        np.testing.assert_allclose(found, wanted, rtol=0, atol=bound * np.abs(wanted).max())


@pytest.mark.parametrize("joints", [(), *LOCKS[:2]], ids=["none", *LOCKS[0], *LOCKS[1]])
def test_the_models_agree_as_they_do_unlocked(joints: tuple[str, ...]) -> None:
    tips = [
        drive(locked(name, joints), NONE, trial_torque(1.0), theta=POSE).tip
        for name in ("assumed-modes", "chain")
    ]
    assert np.sqrt(np.mean(np.sum((tips[0] - tips[1]) ** 2, axis=1))) < TIP


def test_limits_and_dry_friction_of_a_locked_joint_do_not_move_it() -> None:
    """The file holds joint 1 within limits that the start is beyond, and rubs."""
    text = edited('<joint name="joint1"', '<joint name="joint1" range="0.5 1" frictionloss="0.1"')
    chain = ChainPlant(Parameters(), load_chain(text=text))
    torque = trial_torque(1.0, duration=0.2)
    free = drive(chain, NONE, torque, theta=POSE)
    assert np.abs(free.joint[:, 0] - POSE[0]).max() > MOVES
    still = drive(chain.locked(["joint1"]), NONE, torque, theta=POSE)
    plain = ChainPlant(Parameters(), load_chain(text=DEFAULT)).locked(["joint1"])
    wanted = drive(plain, NONE, torque, theta=POSE)
    np.testing.assert_allclose(still.state, wanted.state, rtol=0, atol=ROUNDING)


def test_one_after_the_other_is_both() -> None:
    for name in ("assumed-modes", "chain", "rod", "exudyn"):
        plant = Robot().plant(name, NONE)
        turn = plant.locked(["joint1"]).locked(["joint2"])
        torque = trial_torque(1.0, duration=0.05)
        one, both = (drive(each, NONE, torque, theta=POSE) for each in (turn, plant.locked(JOINTS)))
        np.testing.assert_array_equal(one.state, both.state)
    found = Robot().chain_plant().locked(["joint2"]).model
    assert found.dof_armature[:2].tolist() == [0.0, LOCKED]


def test_unknown_joints_are_refused() -> None:
    with pytest.raises(ParameterError, match="joint 'hinge1' is unknown; lock joint1 or joint2"):
        Robot().plant("chain").locked(["hinge1"])
