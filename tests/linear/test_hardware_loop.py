"""Delay and lag in the linear loop: against the simulation, in other forms, known facts."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from controllers import TUNED_IDEAL
from flexsim import Parameters, Plant, drive, setting
from flexsim.arm.parameters import paper
from flexsim.linear.linearise import linearise, stepped_hold, with_shafts, zero_order_hold
from flexsim.linear.loop_poles import LoopOptions, linear_loop, sampled_plant, spectral_radii
from flexsim.linear.margins import margins
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import Hardware, JointEffects
from flexsim.plants.modes_plant import AssumedModesPlant
from studies.stability.simulated import simulated_growth

PERIOD, POSE = 1e-3, 1.5
NAMES = tuple(TUNED_IDEAL)
SIMULATED = 1e-6  # relative to the rate, or to 1/s: what a tiny nonlinear motion shows of it
MEMORY = 150e6  # bytes: matrices of 2^20 complex numbers, a few times
SAME = 1e-9  # the same matrix in another form
BUILT = {
    "delay": Hardware(delay=1),
    "delays": Hardware(delay=3),
    "lag": Hardware(lag=1e-3),
    "slight": Hardware(lag=5e-5),
    "both": Hardware(delay=2, lag=2e-4),
    "amplifier": Hardware(delay=1, lag=3e-4, effects=JointEffects(amplifier=2e-4)),
}


def growth(plant: Plant, name: str, built: Hardware, hold: str = "exact") -> float:
    controllers = stack([TUNED_IDEAL[name]], PERIOD)
    options = LoopOptions(PERIOD, hold=hold, hardware=built)
    return linear_loop(plant, POSE, controllers, options).growth_rate


@pytest.mark.parametrize("gain", [(1.0, 1.0), (0.5, 0.8)], ids=["whole", "lessened"])
@pytest.mark.parametrize("built", BUILT)
def test_growth_is_the_simulations(built: str, gain: tuple[float, float], plant: Plant) -> None:
    options = LoopOptions(PERIOD, torque_gain=gain, hold="stepped", hardware=BUILT[built])
    loop = linear_loop(plant, POSE, stack([TUNED_IDEAL["line"]], PERIOD), options)
    found = simulated_growth(plant, loop, options)
    assert found == pytest.approx(loop.growth_rate, rel=SIMULATED, abs=SIMULATED)


def test_half_steps_of_physics_are_lagged_as_simulated() -> None:
    plant = AssumedModesPlant(Parameters(), step=PERIOD / 2)
    options = LoopOptions(PERIOD, hold="stepped", hardware=Hardware(delay=1, lag=7e-4))
    loop = linear_loop(plant, POSE, stack([TUNED_IDEAL["circle"]], PERIOD), options)
    found = simulated_growth(plant, loop, options)
    assert found == pytest.approx(loop.growth_rate, rel=SIMULATED, abs=SIMULATED)


@pytest.mark.parametrize("hold", ["exact", "stepped"])
def test_a_delay_is_as_many_zeros_before_the_filters_taps(plant: Plant, hold: str) -> None:
    pair = TUNED_IDEAL["two-loop"].filters(PERIOD)
    for delay in (1, 4):
        late = tuple((np.concatenate([np.zeros(delay), b]), a) for b, a in pair)
        options = LoopOptions(PERIOD, hold=hold, hardware=Hardware(delay=delay))
        found = spectral_radii(plant, POSE, stack([pair], PERIOD), options)
        ideal = LoopOptions(PERIOD, hold=hold)
        assert found == pytest.approx(
            spectral_radii(plant, POSE, stack([late], PERIOD), ideal), rel=SAME
        )


def test_margins_see_the_delay(modes_plant: AssumedModesPlant) -> None:
    pair = TUNED_IDEAL["circle"].filters(PERIOD)
    quiet = tuple((g * b, a) for g, (b, a) in zip((1.0, 0.05), pair, strict=True))
    late = tuple((np.concatenate([[0.0], b]), a) for b, a in quiet)
    built = LoopOptions(PERIOD, hardware=Hardware(delay=1))
    for joint in (0, 1):
        found = margins(linear_loop(modes_plant, POSE, stack([quiet], PERIOD), built), joint)
        other = margins(
            linear_loop(modes_plant, POSE, stack([late], PERIOD), LoopOptions(PERIOD)), joint
        )
        assert vars(found) == pytest.approx(vars(other), rel=1e-5)
        ideal = margins(
            linear_loop(modes_plant, POSE, stack([quiet], PERIOD), LoopOptions(PERIOD)), joint
        )
        assert ideal.gain_high != pytest.approx(found.gain_high, rel=0.01)


def test_margins_of_a_long_delay_need_little_memory(modes_plant: AssumedModesPlant) -> None:
    """A delay of 100 samples has 200 states: all frequencies at once would be gigabytes."""
    built = LoopOptions(PERIOD, hardware=Hardware(delay=20))
    loop = linear_loop(modes_plant, POSE, stack([TUNED_IDEAL["circle"]], PERIOD), built)
    tracemalloc.start()
    margins(loop, 0)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < MEMORY


def test_a_lag_held_in_steps_converges_on_the_exact_one(modes_plant: AssumedModesPlant) -> None:
    """A mean held over a step is right to second order."""
    linear, lag = linearise(modes_plant, POSE), 4e-4
    exact = np.hstack(zero_order_hold(linear, PERIOD, lag))
    steps = PERIOD / np.array([8, 16, 32])
    held = [np.hstack(stepped_hold(linear, PERIOD, h, lag=lag)) for h in steps]
    off = [np.abs(each - exact).max() for each in held]
    order = np.polyfit(np.log(steps), np.log(off), 1)[0]
    assert order == pytest.approx(2, abs=0.1)


def test_states_of_the_motors_are_what_the_matrix_makes_of_commands(
    modes_plant: AssumedModesPlant,
) -> None:
    options = LoopOptions(PERIOD, hardware=Hardware(delay=3, lag=2e-3), torque_gain=(0.3, 1.2))
    sampled = sampled_plant(modes_plant, POSE, options)
    torques = np.random.default_rng(2).standard_normal((12, 2))
    n = len(sampled.linear.A)
    state, expected = np.zeros(len(sampled.A)), []
    for torque in torques:
        expected.append(state[n:])
        state = sampled.A @ state + sampled.B @ torque
    found = sampled.motor_states(torques)
    assert found.shape == (12, 2 + 6)
    assert found == pytest.approx(np.array(expected), abs=1e-13)


def test_an_amplifier_is_two_more_states_in_either_order(modes_plant: AssumedModesPlant) -> None:
    linear = linearise(modes_plant, POSE)
    n, lags = len(linear.A), (7e-4, 2e-4)
    one, other = (
        zero_order_hold(linear, PERIOD, *lags),
        zero_order_hold(linear, PERIOD, *lags[::-1]),
    )
    assert one[0].shape == (n + 4, n + 4)
    assert np.abs(one[1][:n] - other[1][:n]).max() < 1e-12 * np.abs(one[1][:n]).max()
    steps = PERIOD / np.array([32, 64, 128])
    held = [np.hstack(stepped_hold(linear, PERIOD, h, "RK4", (0.0, 0.0), *lags)) for h in steps]
    off = [np.abs(each - np.hstack(one)).max() for each in held]
    assert np.polyfit(np.log(steps), np.log(off), 1)[0] == pytest.approx(2, abs=0.1)
    built = Hardware(delay=2, lag=lags[0], effects=JointEffects(amplifier=lags[1]))
    sampled = sampled_plant(modes_plant, POSE, LoopOptions(PERIOD, hardware=built))
    torques = np.random.default_rng(2).standard_normal((12, 2))
    state, expected = np.zeros(len(sampled.A)), []
    for torque in torques:
        expected.append(state[n:])
        state = sampled.A @ state + sampled.B @ torque
    assert sampled.motor_states(torques) == pytest.approx(np.array(expected), abs=1e-13)


SHAFTS = JointEffects(
    shaft=(500.0, 40.0), shaft_damping=(0.3, 0.01), motor_inertia=(0.05, 0.002), encoder="motor"
)


def test_the_linear_loop_behind_shafts_is_the_simulations(modes_plant: AssumedModesPlant) -> None:
    """Small torques, both joints behind shafts without gaps: the motion by matrix exponential."""
    tau = 1e-3 * np.random.default_rng(5).standard_normal((60, 2))
    off = []
    for parts in (1, 2, 4):
        fine = AssumedModesPlant(Parameters(), step=PERIOD / parts)
        chosen = replace(
            setting("none"), hardware=Hardware(effects=replace(SHAFTS, encoder="joint"))
        )
        motion = drive(fine, chosen, tau, PERIOD, theta=(0.0, POSE))
        linear = with_shafts(linearise(fine, POSE), SHAFTS)
        A, B = zero_order_hold(linear, PERIOD)
        state, seen = np.zeros(len(A)), [np.zeros(2)]
        for torque in tau:
            state = A @ state + B @ torque
            seen.append(state[:2])
        off.append(np.abs(motion.joint - [0.0, POSE] - seen).max() / np.abs(seen).max())
    assert off[0] < 0.02 and np.polyfit(np.log([4, 2, 1]), np.log(off), 1)[0] > 0.9


def test_shafts_add_their_motors_vibration(modes_plant: AssumedModesPlant) -> None:
    """One more coordinate each; stiff, the plant's own with I_m; encoders there see the motors."""
    linear = linearise(modes_plant, POSE)
    assert with_shafts(linear, JointEffects()) is linear
    stiff = replace(SHAFTS, shaft=(5e5, 4e4), shaft_damping=(0.0, 0.0))
    behind = with_shafts(linear, stiff)
    m = len(linear.M)
    assert len(behind.M) == m + 2 and np.allclose(behind.M, behind.M.T)
    rigid = linearise(AssumedModesPlant(Parameters(I_m1=0.05, I_m2=0.002)), POSE)
    for one, other in ((behind, rigid),):
        found = np.sort(eigh(one.K, one.M, eigvals_only=True))[2:m]
        assert found == pytest.approx(eigh(other.K, other.M, eigvals_only=True)[2:], rel=2e-3)
    at_motors = sampled_plant(modes_plant, POSE, LoopOptions(hardware=Hardware(effects=SHAFTS)))
    n = len(at_motors.A) // 2
    assert (at_motors.C[0, [0, n - 2]] == [0.0, -1.0]).all()
    assert (at_motors.C[1, [1, n - 1]] == [0.0, -1.0]).all()


@pytest.fixture(scope="module")
def papers_plant() -> AssumedModesPlant:
    """Return the robot that the figures measured elsewhere are of: undamped."""
    return AssumedModesPlant(paper())


@pytest.mark.parametrize("name", NAMES)
def test_one_sample_of_delay_or_a_lag_of_1_ms_makes_our_loops_grow(
    name: str, papers_plant: AssumedModesPlant
) -> None:
    controllers = stack([TUNED_IDEAL[name]], PERIOD)
    options = LoopOptions(PERIOD, hardware=Hardware(delay=1))
    loop = linear_loop(papers_plant, POSE, controllers, options)
    assert 46 < loop.growth_rate < 52  # measured elsewhere: 46 to 51 1/s, at 69.6 Hz
    hz = abs(np.angle(loop.poles[0])) / PERIOD / (2 * np.pi)
    assert hz == pytest.approx(69.6, abs=0.3)
    assert growth(papers_plant, name, Hardware(lag=1e-3)) > 30
    damped = AssumedModesPlant(Parameters())
    assert growth(damped, name, Hardware(delay=1)) > 40  # 0.1 % in mode 1 does not help


@pytest.mark.parametrize(
    ("name", "borne", "not_borne"), [("line", 2e-5, 5e-5), ("circle", 1e-4, 2e-4)]
)
def test_how_much_lag_a_loop_bears(
    name: str, borne: float, not_borne: float, papers_plant: AssumedModesPlant
) -> None:
    assert growth(papers_plant, name, Hardware(lag=borne)) < 0
    assert growth(papers_plant, name, Hardware(lag=not_borne)) > 0.05
