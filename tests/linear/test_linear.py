"""The linearised plants against exact frequencies, and against the nonlinear plants near rest."""

import math
from dataclasses import replace

import numpy as np
import pytest

from flexsim import ModelError, ParameterError, Parameters
from flexsim.arm.free_arm import joint_free_frequencies
from flexsim.linear.linearise import linearise, stepped_hold, zero_order_hold
from flexsim.loop.friction import Friction
from flexsim.loop.runs import drive
from flexsim.loop.settings import Setting, setting
from flexsim.mjcf.chain_file import load_chain
from flexsim.plants.assumed_modes import free_frequencies
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant

PARAMETERS = Parameters()
PERIOD = 1e-3  # [s]
POSES = (0.4, 1.2, 2.3)  # [rad]
TINY = 1e-6  # [rad], [m] and their rates: terms of second order are smaller by as much
TINY_TORQUE = 1e-6  # [N m]
AGREEMENT = 1e-6  # relative to the column's largest: TINY, and rounding over TINY
FINE_STEP = 2e-5  # [s]; RK4 is then exact to (1424 rad/s x 2e-5 s)^4 = 7e-7 and less per period
ROUNDING = 1e-9  # relative; eigenvalues of matrices with 1e5 between their entries
BEAM = 6e-4  # relative; three modes are 4.5e-4 above the exact third frequency, the chain 2e-4 off


@pytest.fixture(scope="module", params=["assumed-modes", "printed", "chain"])
def fine(request: pytest.FixtureRequest) -> Plant:
    """A plant whose steps are short enough to be exact."""
    if request.param == "chain":
        return ChainPlant.designed(PARAMETERS, step=FINE_STEP)
    form = "printed" if request.param == "printed" else "consistent"
    return AssumedModesPlant(PARAMETERS, step=FINE_STEP, form=form)


def frequencies(A: np.ndarray) -> np.ndarray:
    """Natural frequencies [rad/s] of a system matrix, rising, rigid motion left out."""
    found = np.sort(np.abs(np.linalg.eigvals(A).imag))
    return found[4:][::2]


def one_period(
    plant: Plant, theta2: float, how: Setting | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Measured (Ad, Bd): what the nonlinear plant makes of tiny deviations in a period."""
    rest, chosen = plant.rest_state((0.3, theta2)), how or setting("none")
    n = len(rest)
    A, B = np.empty((n, n)), np.empty((n, 2))
    for j in range(n):
        ends = []
        for sign in (1, -1):
            start = rest.copy()
            start[j] += sign * TINY
            ends.append(drive(plant, chosen, np.zeros((1, 2)), state=start).state[1])
        A[:, j] = (ends[0] - ends[1]) / (2 * TINY)
    for j in range(2):
        torque = np.zeros((1, 2))
        torque[0, j] = TINY_TORQUE
        B[:, j] = (drive(plant, chosen, torque, state=rest).state[1] - rest) / TINY_TORQUE
    return A, B


def mismatch(found: np.ndarray, measured: np.ndarray) -> float:
    """Largest difference, relative to the largest entry of its column."""
    return float((np.abs(found - measured).max(axis=0) / np.abs(measured).max(axis=0)).max())


@pytest.mark.parametrize("theta2", POSES)
def test_eigenvalues_are_the_joint_free_frequencies(plant: Plant, theta2: float) -> None:
    found = frequencies(linearise(plant, theta2).A)[:3]
    assert found == pytest.approx(joint_free_frequencies(PARAMETERS, 3, theta2), rel=BEAM)


def test_assumed_modes_frequencies_are_those_of_its_mass_and_stiffness() -> None:
    plant = AssumedModesPlant(PARAMETERS, modes=5, step=2e-4).undamped()
    found = frequencies(linearise(plant, 1.2).A)
    assert found == pytest.approx(free_frequencies(plant.coefficients, 1.2), rel=ROUNDING)


@pytest.mark.parametrize("theta2", POSES)
def test_exact_hold_is_one_period_of_the_nonlinear_plant(fine: Plant, theta2: float) -> None:
    A, B = zero_order_hold(linearise(fine, theta2), PERIOD)
    measured = one_period(fine, theta2)
    assert mismatch(A, measured[0]) < AGREEMENT
    assert mismatch(B, measured[1]) < AGREEMENT


def test_stepped_hold_is_one_period_as_simulated(plant: Plant) -> None:
    linear = linearise(plant, 1.2)
    found = stepped_hold(linear, PERIOD, plant.step)
    measured = one_period(plant, 1.2)
    assert mismatch(found[0], measured[0]) < AGREEMENT
    assert mismatch(found[1], measured[1]) < AGREEMENT
    exact = zero_order_hold(linear, PERIOD)[0]
    assert mismatch(exact, measured[0]) > 100 * AGREEMENT  # a step of 1 ms is not exact


@pytest.mark.parametrize("name", ["Euler", "implicit", "implicitfast", "discrete"])
def test_other_integrators_are_held_as_they_step(name: str) -> None:
    damped = replace(PARAMETERS, zeta=0.005)
    text = ChainPlant.designed(damped, step=PERIOD / 2).chain.text
    text = text.replace('integrator="RK4"', f'integrator="{name}"')
    plant = ChainPlant(PARAMETERS, load_chain(text=text))
    linear = linearise(plant, 1.2)
    measured = one_period(plant, 1.2)
    found = stepped_hold(linear, PERIOD, plant.step, plant.integrator)
    assert mismatch(found[0], measured[0]) < AGREEMENT
    assert mismatch(found[1], measured[1]) < AGREEMENT
    assert mismatch(stepped_hold(linear, PERIOD, plant.step)[0], measured[0]) > 100 * AGREEMENT


@pytest.mark.parametrize("gear", [1.0, 2.0])
def test_viscous_joint_friction_is_held_as_simulated(gear: float) -> None:
    """It is taken from the motors' torques once per step, and so counts times the transmission."""
    plant = AssumedModesPlant(replace(PARAMETERS, r_1=gear, r_2=gear), step=PERIOD / 2)
    mu = (0.2, 0.05)
    none = ((0.0, 0.0), (0.0, 0.0))
    law = Friction("opposing", dead_zone=none, tau_0=(0.0, 0.0), mu=mu)
    measured = one_period(plant, 1.2, Setting("viscous", law, "of the test"))
    linear = linearise(plant, 1.2)
    found = stepped_hold(linear, PERIOD, plant.step, held_friction=mu)
    assert mismatch(found[0], measured[0]) < AGREEMENT
    without = stepped_hold(linear, PERIOD, plant.step)
    assert mismatch(without[0], measured[0]) > 100 * AGREEMENT


def test_stepped_hold_converges_with_fourth_order(plant: Plant) -> None:
    linear = linearise(plant, 1.2)
    exact = zero_order_hold(linear, PERIOD)[0]
    steps = PERIOD / np.array([8, 16, 32])
    error = [mismatch(stepped_hold(linear, PERIOD, h)[0], exact) for h in steps]
    order = np.polyfit(np.log(steps), np.log(error), 1)[0]
    assert order == pytest.approx(4, abs=0.1)


def test_another_pose_would_be_noticed(fine: Plant) -> None:
    A, _ = zero_order_hold(linearise(fine, 1.3), PERIOD)
    assert mismatch(A, one_period(fine, 1.2)[0]) > 100 * AGREEMENT


def test_outputs_are_joint_angles_and_deflection(plant: Plant) -> None:
    rng = np.random.default_rng(1)
    state = TINY * rng.standard_normal(len(plant.rest_state((0, 0))))
    seen = plant.observe(state[None])
    expected = [*seen.joint[0], seen.v[0]]
    assert linearise(plant, 0.0).C @ state == pytest.approx(expected, rel=AGREEMENT, abs=1e-14)


def test_joint_damping_and_transmissions_count(plant: Plant) -> None:
    plain, damped = linearise(plant, 1.0), linearise(plant, 1.0, (0.3, 0.2))
    assert np.diag(damped.D - plain.D)[:2] == pytest.approx([0.3, 0.2])
    assert np.array_equal(plain.K, damped.K)
    geared = AssumedModesPlant(replace(PARAMETERS, r_1=5.0, r_2=2.0))
    rubbed = linearise(geared, 1.0, (0.3, 0.2)).D - linearise(geared, 1.0).D
    assert np.diag(rubbed)[:2] == pytest.approx([1.5, 0.4])
    assert linearise(geared, 1.0).S[:2].tolist() == [[5.0, 0.0], [0.0, 2.0]]


def test_an_edited_file_is_what_is_linearised() -> None:
    chain = ChainPlant.designed(PARAMETERS)
    text = chain.chain.text.replace('gear="1"', 'gear="3"')
    edited = ChainPlant(PARAMETERS, load_chain(text=text))
    tripled = 3 * linearise(chain).B  # a torque's effect on the far hinges is zero but for rounding
    assert linearise(edited).B == pytest.approx(tripled, abs=ROUNDING * np.abs(tripled).max())


def test_numbers_that_cannot_be_used_are_refused(modes_plant: AssumedModesPlant) -> None:
    for theta2 in (math.nan, math.inf):
        with pytest.raises(ParameterError, match="theta2"):
            linearise(modes_plant, theta2)
    with pytest.raises(ParameterError, match="damping"):
        linearise(modes_plant, 1.0, (math.nan, 0.0))
    linear = linearise(modes_plant)
    for period in (0.0, -1e-3, math.inf, math.nan):
        with pytest.raises(ParameterError, match="period"):
            zero_order_hold(linear, period)
    with pytest.raises(ParameterError, match="multiple"):
        stepped_hold(linear, 1e-3, 3e-4)


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('<joint name="hinge3"', '<joint name="hinge3" frictionloss="0.3"', "dry friction"),
        ('<joint name="hinge3"', '<joint name="hinge3" springref="0.2"', "not at rest"),
        ('gravity="disable"', "", "gravity is"),
    ],
)
def test_what_no_matrix_holds_is_refused(old: str, new: str, words: str) -> None:
    text = ChainPlant.designed(PARAMETERS).chain.text.replace(old, new)
    text = text.replace("<option ", '<option gravity="0 -9.81 0" ')
    with pytest.raises(ModelError, match=words):
        linearise(ChainPlant(PARAMETERS, load_chain(text=text)))


def test_springs_at_the_joints_are_in_the_matrices() -> None:
    text = ChainPlant.designed(PARAMETERS).chain.text
    sprung = text.replace('<joint name="joint1"', '<joint name="joint1" stiffness="2"')
    assert linearise(ChainPlant(PARAMETERS, load_chain(text=sprung))).K[0, 0] == 2.0
