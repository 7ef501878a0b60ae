"""EXUDYN's beam: against the exact one, against our plants, and what it is like to work with."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from controllers import TUNED_IDEAL
from flexsim import DivergenceError, ParameterError, Parameters, Robot
from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies
from flexsim.linear.linearise import linearise, stepped_hold
from flexsim.loop.metrics import rms_distance
from flexsim.loop.motion import Motion
from flexsim.loop.runs import closed_loop, drive
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import Reference, reference, trajectory
from flexsim.numerics.state_matrix import state_matrix
from flexsim.plants.exudyn_beam import system
from flexsim.plants.exudyn_beam.calls import serving
from flexsim.plants.exudyn_beam.frames import all_to_world, from_world
from flexsim.plants.exudyn_beam.plant import ExudynPlant
from studies.parity.motions import POSE, trial_torque

pytest.importorskip("exudyn", reason="an extra: pip install 'flexsim[exudyn]'")

P = Parameters(zeta=0.0, F_1=0.0, F_2=0.0)
ROUNDING = 1e-12  # relative, of masses and coordinates
DIFFERENCES = 1e-6  # relative: EXUDYN's stiffness is differentiated
STATIC = 1e-6  # cubics are exact for a force at the tip
ORDER, NEAR = 4.0, 0.1  # of frequencies in the number of elements, and how near 8 to 16 come
FREQUENCY = 7e-4  # of three with 8 elements: 6.1e-4
RATIO = 1e-4  # relative, of damping ratios about the frequencies' own errors
STEPS = (2e-3, 1e-3, 5e-4)  # [s], held torques of 2 ms
SECOND, AT = 2.0, 0.1  # order in the step, and how near
DRIFT, SWING = 1e-6, 0.02  # relative, of energy in 0.5 s of free motion, v swinging so far [m]
OPEN, BENT = 1.6e-6, 0.05  # [m rms] of the assumed modes' tip in 0.5 s, and what shows a difference
LOST = 1e-2  # [s] within which both are lost with v as it is: v is 0.25 m then
TINY, LINEAR = 1e-6, 1e-4  # of a state, and what is left of a step's difference from a linear one
CLOSED = 2e-7  # [m rms] of the tip in closed loop, 0.5 s of the circle, of five modes at 0.125 ms


@pytest.fixture(scope="module")
def plant() -> ExudynPlant:
    return ExudynPlant(P)


def swinging(plant: ExudynPlant, theta2: float, n: int) -> np.ndarray:
    """Return the first n frequencies [rad/s] with both joints free."""
    linear = plant.linearised(theta2)
    return np.sqrt(eigh(linear.K, linear.M, eigvals_only=True)[2 : n + 2])


def clamped(plant: ExudynPlant, n: int) -> np.ndarray:
    """Return the first n frequencies [rad/s] with the joints locked."""
    linear = plant.linearised(0.0)
    return np.sqrt(eigh(linear.K[2:, 2:], linear.M[2:, 2:], eigvals_only=True)[:n])


def test_a_force_at_the_tip_bends_it_as_in_closed_form(plant: ExudynPlant) -> None:
    linear = plant.linearised(0.0)
    compliance = np.linalg.inv(linear.K[2:, 2:])[-2, -2]
    assert compliance == pytest.approx(P.L**3 / (3 * P.EI), rel=STATIC)


def test_frequencies_converge_to_the_exact_ones_with_the_fourth_order() -> None:
    sizes = (8, 12, 16)
    plants = [ExudynPlant(P, n) for n in sizes]
    for exact, found in (
        (clamped_frequencies(P, 3), [clamped(each, 3) for each in plants]),
        (joint_free_frequencies(P, 3, 1.2), [swinging(each, 1.2, 3) for each in plants]),
    ):
        errors = np.array(found) / exact - 1
        assert (np.abs(errors[0]) < FREQUENCY).all()
        orders = -np.polyfit(np.log(sizes), np.log(np.abs(errors[:, 1:])), 1)[0]
        np.testing.assert_allclose(orders, ORDER, atol=NEAR)


def test_masses_are_those_of_the_robot(plant: ExudynPlant) -> None:
    """The rigid part of the mass matrix, at rest, motors and payload included."""
    heavy = Parameters(I_m1=0.02, I_m2=0.05, payload=0.03, payload_inertia=2e-4, r_1=2.0, r_2=0.5)
    for p in (P, heavy):
        ours = Robot(p).plant("assumed-modes").linearised(1.2)
        its = ExudynPlant(p).linearised(1.2)
        np.testing.assert_allclose(its.M[:2, :2], ours.M[:2, :2], rtol=ROUNDING)
        np.testing.assert_array_equal(its.S[:2], ours.S[:2])
        np.testing.assert_allclose(its.D[:2, :2], ours.D[:2, :2], rtol=DIFFERENCES, atol=1e-12)


def test_damping_ratios_grow_with_the_frequency_from_zeta() -> None:
    p = replace(P, zeta=5e-3)
    linear = ExudynPlant(p).linearised(0.0)
    rates = np.linalg.eigvals(state_matrix(linear.M[2:, 2:], linear.D[2:, 2:], linear.K[2:, 2:]))
    rates = rates[rates.imag > 0]
    rates = rates[np.argsort(np.abs(rates))][:3]
    wanted = p.zeta * np.abs(rates) / clamped_frequencies(p, 1)[0]
    np.testing.assert_allclose(-rates.real / np.abs(rates), wanted, rtol=RATIO)


def test_a_state_goes_to_the_world_and_back(plant: ExudynPlant) -> None:
    loaded = ExudynPlant(replace(P, payload=0.02))
    state = np.random.default_rng(1).normal(size=2 * plant.m) * 0.1
    for each in (plant, loaded):
        (world,) = all_to_world(each.beam, state[None])
        back = np.full_like(state, np.nan)
        from_world(each.beam, world, back)
        np.testing.assert_allclose(back, state, atol=ROUNDING)
        h = 1e-6  # [s] of a difference: the rates are the coordinates' own
        ahead = np.concatenate([state[: plant.m] + h * state[plant.m :], state[plant.m :]])
        (later,) = all_to_world(each.beam, ahead[None])
        np.testing.assert_allclose((later[0] - world[0]) / h, world[1], atol=1e-5)


def test_the_tip_is_observed_where_the_loop_has_it(plant: ExudynPlant) -> None:
    motion = drive(plant, setting("none"), trial_torque(4.0, 0.1), theta=POSE)
    (world,) = all_to_world(plant.beam, motion.state[-1:])
    np.testing.assert_allclose(motion.tip[-1], (world[0] + plant.beam.straight)[-4:-2], atol=1e-12)
    ours = drive(
        Robot(P).plant("assumed-modes"), setting("none"), trial_torque(4.0, 0.1), theta=POSE
    )
    assert motion.modal[-1, 0] == pytest.approx(ours.modal[-1, 0], rel=1e-2)
    assert motion.energy[-1] == pytest.approx(ours.energy[-1], rel=1e-3)


def test_energy_stays(plant: ExudynPlant) -> None:
    bent = drive(plant, setting("none"), trial_torque(4.0, 0.2), theta=POSE).state[-1]
    motion = drive(plant, setting("none"), np.zeros((500, 2)), state=bent)
    assert np.ptp(motion.v) > SWING
    assert np.abs(motion.energy / motion.energy[0] - 1).max() < DRIFT


def test_torques_are_held_exactly_so_steps_converge_with_the_second_order() -> None:
    """The rule by itself would have a torque come half a step late: first order."""
    torque, period = trial_torque(1.0, 0.3, period=2e-3), 2e-3

    def tip(step: float) -> np.ndarray:
        plant = ExudynPlant(P, elements=4, step=step)
        return drive(plant, setting("none"), torque, period=period, theta=POSE).tip

    fine = tip(6.25e-5)
    errors = [rms_distance(tip(step), fine) for step in STEPS]
    order = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert order == pytest.approx(SECOND, abs=AT)


def test_open_loop_is_that_of_the_assumed_modes(plant: ExudynPlant) -> None:
    torque = trial_torque(1.0, 0.5)
    ours = drive(
        Robot(P).plant("assumed-modes:5", step=1.25e-4), setting("none"), torque, theta=POSE
    )
    its = drive(plant, setting("none"), torque, theta=POSE)
    assert rms_distance(its.tip, ours.tip) < OPEN
    turned = drive(plant, setting("none"), torque * (1, -1), theta=POSE)
    assert rms_distance(turned.tip, ours.tip) > BENT


def test_closed_loop_is_that_of_five_modes() -> None:
    """The same compiled controllers, no friction, torques held: only the plant is another."""
    whole = reference(trajectory("circle"), P)
    ref = Reference(whole.time[:501], whole.tip[:501], whole.joint[:501])
    robot, filters = Robot(P), [TUNED_IDEAL["circle"].filters(1e-3)]

    def run(name: str, **options: float) -> Motion:
        plant = robot.plant(name, step=1.25e-4)
        return closed_loop(plant, setting("none"), ref, filters, energy=False, **options)[0]

    its, ours = run("exudyn"), run("assumed-modes:5")
    assert len(its.tip) == len(ours.tip) == len(ref.tip)
    assert rms_distance(its.tip, ours.tip) < CLOSED
    mirrored = [run(name, v_gain=1.0).diverged for name in ("exudyn", "assumed-modes:5")]
    assert mirrored[0] is not None and mirrored[0] == pytest.approx(mirrored[1], abs=LOST)


def test_its_steps_are_known_to_the_linear_loop() -> None:
    """So that `flexsim stability --plant exudyn` speaks of the loop that is simulated."""
    plant = ExudynPlant(replace(P, zeta=5e-3, F_2=0.1))
    linear = linearise(plant, POSE[1])
    A, B = stepped_hold(linear, 1e-3, plant.step, plant.integrator)
    start = np.random.default_rng(1).normal(size=len(A)) * TINY
    state, tau = plant.rest_state(POSE), np.array([[3.0, -2.0]]) * TINY
    state[np.concatenate([linear.coordinates, linear.coordinates + plant.m])] += start
    moved = drive(plant, setting("none"), tau, state=state).state
    rest = linear.state(plant.rest_state(POSE)[None])[0]
    found = linear.state(moved)[1] - rest
    scale = np.abs(found).max()
    np.testing.assert_allclose((A @ start + B @ tau[0]) / scale, found / scale, atol=LINEAR)
    other = stepped_hold(linear, 1e-3, 2 * plant.step, plant.integrator)[0]
    assert np.abs(other @ start - found).max() > 10 * LINEAR * scale


def test_runs_repeat_to_the_bit_whatever_ran_before(plant: ExudynPlant) -> None:
    torque = trial_torque(4.0, 0.05)
    first = drive(plant, setting("none"), torque, theta=POSE).state
    drive(plant, setting("none"), -torque, theta=(1.0, 0.5))
    np.testing.assert_array_equal(drive(plant, setting("none"), torque, theta=POSE).state, first)


def test_populations_on_threads_are_computed_alike(plant: ExudynPlant) -> None:
    whole = reference(trajectory("circle"), P)
    ref = Reference(whole.time[:51], whole.tip[:51], whole.joint[:51])
    filters = [TUNED_IDEAL["circle"].filters(1e-3)] * 4
    alone = closed_loop(plant, setting("simulink"), ref, filters[:1], energy=False)[0].state
    for motion in closed_loop(plant, setting("simulink"), ref, filters, energy=False, threads=2):
        np.testing.assert_array_equal(motion.state, alone)


def test_a_runaway_is_a_divergence(plant: ExudynPlant, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(DivergenceError, match="exudyn plant ran away"):
        drive(plant, setting("none"), np.full((50, 2), 1e6))
    assert capfd.readouterr() == ("", "")


@pytest.mark.usefixtures("interruptible")
def test_what_comes_up_in_a_run_is_raised_after_it() -> None:
    class Broken:
        def advance(self, slot: int, begins: bool, tau_1: float, tau_2: float) -> bool:
            raise KeyError("in there")

    from flexsim.plants.exudyn_beam.calls import _advance

    with pytest.raises(KeyError, match="in there"), serving(Broken()) as handle:
        assert _advance(handle, 0, 1, 0.0, 0.0) == 0


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_ends_a_run(plant: ExudynPlant) -> None:
    import signal
    import threading

    timer = threading.Timer(0.3, lambda: signal.raise_signal(signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        drive(plant, setting("none"), np.zeros((100_000, 2)), theta=POSE)
    timer.cancel()


def test_without_the_package_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "exudyn", None)
    with pytest.raises(ParameterError, match=r"pip install 'flexsim\[exudyn\]'"):
        Robot().plant("exudyn")


def test_nothing_else_imports_it() -> None:
    code = (
        "import sys; from flexsim import Robot; Robot().plant('chain'); import studies.main\n"
        "assert 'exudyn' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_nothing_is_printed_or_written(tmp_path: object) -> None:
    code = (
        "import numpy as np; from flexsim import Robot, drive, setting\n"
        "p = Robot().plant('exudyn:2'); p.linearised(1.0)\n"
        "drive(p, setting('none'), np.zeros((3, 2)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=str(tmp_path), check=True, capture_output=True
    )
    assert (done.stdout, done.stderr) == (b"", b"")
    import pathlib

    assert list(pathlib.Path(str(tmp_path)).iterdir()) == []


def test_refusals(plant: ExudynPlant) -> None:
    with pytest.raises(ParameterError, match="no inversion of its tip"):
        plant.needed_force(np.zeros((1, 35)), np.zeros((1, 35)), np.zeros((1, 35)))
    with pytest.raises(ParameterError, match="elements is 65; give 1 to 64"):
        Robot().plant("exudyn:65")
    with pytest.raises(ParameterError, match="made from a uniform beam"):
        Robot.of("models/chain6.xml").plant("exudyn")
    for step in (0.0, np.nan):
        with pytest.raises(ParameterError, match="physics step"):
            ExudynPlant(P, step=step)


def test_friction_held_over_a_step_bounds_it() -> None:
    light = Robot(Parameters(I_H=1e-6, r=1e-3, rho=1e-4, m_H=1e-3, I_R0=1e-4))
    plant = light.plant("exudyn", setting("opposing"))
    assert plant.step < ExudynPlant(P).step
    with pytest.raises(ParameterError, match="too long for friction that opposes"):
        light.plant("exudyn", setting("opposing"), chain_step=1e-3)
    assert system.HALVES == (2.0, 0.0) and np.mean(system.HALVES) == 1.0
