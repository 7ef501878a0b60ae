"""The compiled closed loop against a slow one written here; filters, outcomes, divergence."""

import math
import os
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.signal import lfilter

from controllers import TUNED_IDEAL
from flexsim import DivergenceError, ModelError, ParameterError, Parameters
from flexsim.loop.compiled_loop import Outcome
from flexsim.loop.control.compiled import filter_sample
from flexsim.loop.control.stacking import stack
from flexsim.loop.friction import Friction
from flexsim.loop.metrics import envelope_half_width, performance_index
from flexsim.loop.populations import Stage, run_population
from flexsim.loop.runs import closed_loop, drive, evaluate, loop_of
from flexsim.loop.settings import Setting, setting
from flexsim.loop.trajectories import Reference, Trajectory, reference, trajectory
from flexsim.numerics.clocks import whole_substeps
from flexsim.plants.assumed_modes import mass_matrix
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant

kernels = pytest.mark.kernels  # run once more under another BLAS kernel


ROOT = Path(__file__).parents[2]
PARAMETERS = Parameters()
NAMES = ("line", "two-loop", "circle")
FILTERING = (
    1e-12  # relative to the largest output; the same sums as lfilter's, maybe in other order
)
SLOW_LOOP = 1e-10  # relative to each column's largest; rounding through 200 samples: 4e-12
INTERPRETED = 1e-12  # relative; the same operations without the compiler
INDEX = 1e-12  # relative; the same sum over 5001 samples in another order: 5e-15
REST = 1e-14  # [rad], [m]; nothing acts
ENVELOPE = 0.07  # [m]; the widest of the eighteen is 0.051 m, on the two-loop path 0.3 m wide

SLOPPY = Setting(  # every part of the friction at work: limits, dead zone, Coulomb, viscous
    "sloppy",
    Friction(
        "opposing",
        dead_zone=((-0.05, 0.04), (-0.002, 0.003)),
        tau_0=(0.1, 0.01),
        mu=(0.05, 0.02),
        torque_limit=(0.2, 0.025),
    ),
    "for tests",
)
SHIFTED = replace(SLOPPY, name="shifted", friction=replace(SLOPPY.friction, law="simulink"))
SHORT = Trajectory("line", duration=0.15, hold=0.05, start=(0.60, 0.30), end=(0.58, 0.32))
PRINTED_PLANT = AssumedModesPlant(PARAMETERS, form="printed")
P_CONTROL = (np.array([20.0]), np.ones(1)), (np.array([2.0]), np.ones(1))
IIR = (  # lead on joint 1, low-pass on joint 2
    (np.array([300.0, -290.0]), np.array([1.0, -0.6])),
    (np.array([0.3, 0.2, 0.1]), np.array([1.0, -0.9, 0.1])),
)
RUNAWAY = (np.array([-1e6]), np.ones(1)), (np.array([-1e6]), np.ones(1))


@pytest.fixture(scope="module")
def short() -> Reference:
    return reference(SHORT, PARAMETERS)


# --- filters ------------------------------------------------------------------------------------

poles = arrays(complex, st.integers(0, 4), elements=st.complex_numbers(max_magnitude=0.95))
taps = arrays(float, st.integers(1, 12), elements=st.floats(-10, 10))


def run_filter(b: np.ndarray, a: np.ndarray, x: np.ndarray) -> np.ndarray:
    z = np.zeros(len(b))
    y = np.array([filter_sample(b, a, z, value) for value in x])
    assert z[-1] == 0.0
    return y


@given(taps=taps, pole=poles, seed=st.integers(0, 2**16))
def test_filter_sample_is_lfilter_for_every_stable_filter(
    taps: np.ndarray, pole: np.ndarray, seed: int
) -> None:
    denominator = np.atleast_1d(np.poly(np.concatenate([pole, pole.conj()]))).real
    x = np.random.default_rng(seed).normal(size=60)
    expected = lfilter(taps, denominator, x)
    pair = (taps, denominator)
    stacked = stack([(pair, pair)], 1e-3)
    found = run_filter(stacked.b[0, 0, 0, 0], stacked.a[0, 0, 0, 0], x)
    np.testing.assert_allclose(found, expected, atol=FILTERING * max(1.0, np.abs(expected).max()))


def test_filter_without_denominator_is_a_convolution() -> None:
    x = np.arange(5.0)
    stacked = stack([((np.array([2.0, -1.0]), np.ones(1)),) * 2], 1e-3)
    assert run_filter(stacked.b[0, 1, 0, 0], stacked.a[0, 1, 0, 0], x) == pytest.approx(
        [0.0, 2.0, 3.0, 4.0, 5.0]
    )


def test_filters_of_different_length_are_padded_and_normalised() -> None:
    long = (np.array([2.0, 4.0]), np.array([2.0, 0.0, 1.0]))
    stacked = stack([(long, (np.array([3.0]), np.array([1.0])))], 1e-3)
    assert stacked.b.shape == stacked.a.shape == (1, 2, 1, 1, 3)
    np.testing.assert_array_equal(stacked.b[0, :, 0, 0], [[1.0, 2.0, 0.0], [3.0, 0.0, 0.0]])
    np.testing.assert_array_equal(stacked.a[0, :, 0, 0], [[1.0, 0.0, 0.5], [1.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    "bad", [([1.0], [0.0]), ([np.nan], [1.0]), ([1.0], [1.0, np.inf])], ids=["lead", "b", "a"]
)
def test_filter_that_cannot_be_used_is_an_error_naming_it(bad: tuple[list, list]) -> None:
    good = (np.ones(1), np.ones(1))
    with pytest.raises(ParameterError, match="filter 2 of controller 1 "):
        stack([(good, good), (good, (np.array(bad[0]), np.array(bad[1])))], 1e-3)


# --- the compiled loop against a slow one -------------------------------------------------------


@dataclass
class SlowModes:
    """Classical Runge-Kutta of Lagrange's equations from the mass matrix alone."""

    plant: AssumedModesPlant

    def rates(self, state: np.ndarray, tau: np.ndarray) -> np.ndarray:
        p, m = self.plant.coefficients, len(state) // 2
        q, w = state[:m], state[m:]
        h = 1e-30

        def energy(at: np.ndarray) -> complex:
            value: complex = w @ mass_matrix(p, at) @ w / 2
            return value

        gradient = np.array([energy(q + 1j * h * e).imag for e in np.eye(m)]) / h
        transport = (mass_matrix(p, q + 1j * h * w) @ w).imag / h
        force = gradient - transport
        force[:2] += tau - np.array([p.F_1, p.F_2]) * w[:2]
        force[2:] -= p.stiffness * q[2:] + p.damping @ w[2:]
        return np.concatenate([w, np.linalg.solve(mass_matrix(p, q), force)])

    def step(self, state: np.ndarray, tau: np.ndarray) -> np.ndarray:
        h = self.plant.step
        k1 = self.rates(state, tau)
        k2 = self.rates(state + h / 2 * k1, tau)
        k3 = self.rates(state + h / 2 * k2, tau)
        k4 = self.rates(state + h * k3, tau)
        return state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def v(self, state: np.ndarray) -> float:
        return float(self.plant.coefficients.tip @ state[2 : len(state) // 2])


@dataclass
class SlowChain:
    """`mujoco.mj_step` from Python; v from the site's own position."""

    plant: ChainPlant

    def __post_init__(self) -> None:
        self.model = self.plant.chain.model
        self.data = mujoco.MjData(self.model)

    def step(self, state: np.ndarray, tau: np.ndarray) -> np.ndarray:
        self.data.qpos, self.data.qvel = np.split(state, 2)
        self.data.ctrl = tau
        mujoco.mj_step(self.model, self.data)
        return np.concatenate([self.data.qpos, self.data.qvel])

    def v(self, state: np.ndarray) -> float:
        self.data.qpos = state[: self.model.nq]
        mujoco.mj_kinematics(self.model, self.data)
        from_hub = self.data.site("tip").xpos - self.data.joint("joint2").xanchor
        along = state[0] + state[1]
        return float(-from_hub[0] * math.sin(along) + from_hub[1] * math.cos(along))


def slow_torque(f: Friction, joint: int, tau: float, w: float) -> float:
    limit, (low, high) = f.torque_limit[joint], f.dead_zone[joint]
    tau = max(-limit, min(limit, tau))
    if f.law == "none":
        return tau
    past = tau - min(max(tau, low), high)
    tau = past if f.law == "simulink" or past == 0.0 else tau
    if f.law == "opposing":
        return tau - f.tau_0[joint] * math.tanh(w / f.speed) - f.mu[joint] * w
    return math.copysign(f.mu[joint] * abs(tau) + f.tau_0[joint], tau) if tau else 0.0


def slow_loop(
    slow: SlowModes | SlowChain, friction: Friction, sampled: Reference, controller: tuple
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return states, torques and errors, the filters by lfilter over all errors so far."""
    state = slow.plant.rest_state(sampled.joint[0])
    m, reach = len(state) // 2, PARAMETERS.reach
    substeps = round((sampled.time[1] - sampled.time[0]) / slow.plant.step)
    states, torques, errors = [], [], []
    for target in sampled.joint:
        reflected = state[1] - math.atan(slow.v(state) / reach)
        errors.append((target[0] - state[0], target[1] - reflected))
        u = [lfilter(b, a, np.array(errors)[:, i])[-1] for i, (b, a) in enumerate(controller)]
        states.append(state)
        torques.append(u)
        for _ in range(substeps):
            tau = [slow_torque(friction, i, u[i], state[m + i]) for i in range(2)]
            state = slow.step(state, np.array(tau))
    return np.array(states), np.array(torques), np.array(errors)


@kernels
@pytest.mark.parametrize("controller", [P_CONTROL, IIR], ids=["P", "IIR"])
@pytest.mark.parametrize("chosen", [setting("none"), SLOPPY, SHIFTED], ids=lambda item: item.name)
def test_compiled_loop_is_the_slow_one(
    plant: Plant, chosen: Setting, controller: tuple, short: Reference
) -> None:
    slow = SlowChain(plant) if isinstance(plant, ChainPlant) else SlowModes(plant)
    expected = slow_loop(slow, chosen.friction, short, controller)
    (motion,) = closed_loop(plant, chosen, short, [controller])
    assert len(motion.time) == 201 and np.abs(motion.v).max() > 1e-4  # [m] it does bend
    if chosen is not setting("none"):
        assert (np.abs(motion.torque).max(axis=0) > SLOPPY.friction.torque_limit).all()
    for found, wanted in zip((motion.state, motion.torque, motion.error), expected, strict=True):
        scale = np.abs(wanted).max(axis=0)
        assert (np.abs(found - wanted).max(axis=0) <= SLOW_LOOP * scale).all()


@kernels
def test_compiled_loop_with_two_physics_steps_per_sample(short: Reference) -> None:
    fine = AssumedModesPlant(PARAMETERS, step=0.5e-3)
    first = Reference(short.time[:60], short.tip[:60], short.joint[:60])
    expected, _, _ = slow_loop(SlowModes(fine), SLOPPY.friction, first, IIR)
    (motion,) = closed_loop(fine, SLOPPY, first, [IIR])
    assert np.abs(motion.state - expected).max() < SLOW_LOOP * np.abs(expected).max()


def test_pushed_tip_enters_the_second_error_with_its_sign_changed(
    plant: Plant, short: Reference
) -> None:
    initial = plant.rest_state(short.joint[0])
    initial[2] = 0.02
    v = float(plant.observe(initial[None]).v[0])
    assert v > 0.001  # [m] a positive first coordinate pushes the tip to positive v
    for v_gain in (-1.0, 1.0, 0.0):
        loop = loop_of(plant, short, v_gain=v_gain)
        friction, filters = setting("none").friction.numbers(), stack([P_CONTROL], 1e-3)
        outcome = run_population(Stage(plant, friction, loop, initial), filters, stride=1)
        expected = short.joint[0, 1] - (initial[1] + v_gain * math.atan(v / PARAMETERS.reach))
        assert outcome.errors[0, 0] == pytest.approx([0.0, expected], abs=1e-15)
        assert outcome.torques[0, 0, 1] == pytest.approx(2.0 * expected, rel=1e-12)


# --- outcomes of populations --------------------------------------------------------------------


def tuned_population() -> list:
    return [*(TUNED_IDEAL[name].filters(1e-3) for name in NAMES), RUNAWAY, P_CONTROL]


def population(plant: Plant, controllers: list, threads: int, short: Reference) -> Outcome:
    return evaluate(plant, setting("none"), short, controllers, stride=10, threads=threads)


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="needs two threads")
def test_outcomes_are_identical_on_one_thread_and_two(plant: Plant, short: Reference) -> None:
    one, two = (population(plant, tuned_population(), threads, short) for threads in (1, 2))
    assert np.isfinite(one.indices).any() and np.isinf(one.indices).any()
    for first, second in zip(one, two, strict=True):
        np.testing.assert_array_equal(first, second)


def test_outcomes_do_not_depend_on_the_neighbours(plant: Plant, short: Reference) -> None:
    order = [3, 1, 4, 0, 2]
    controllers = tuned_population()
    straight = population(plant, controllers, 1, short)
    shuffled = population(plant, [controllers[i] for i in order], 1, short)
    for first, second in zip(straight, shuffled, strict=True):
        np.testing.assert_array_equal(first[order], second)
    assert len(set(straight.indices)) == len(controllers)  # no two alike, or order could not show


@pytest.mark.parametrize("stride", [1, 7, 200, 1000])
def test_stride_records_every_so_many_samples(plant: Plant, short: Reference, stride: int) -> None:
    full = evaluate(plant, SLOPPY, short, [IIR], stride=1)
    thin = evaluate(plant, SLOPPY, short, [IIR], stride=stride)
    np.testing.assert_array_equal(thin.states, full.states[:, ::stride])
    np.testing.assert_array_equal(thin.torques, full.torques[:, ::stride])
    np.testing.assert_array_equal(thin.errors, full.errors[:, ::stride])
    assert np.isfinite(thin.states).all() and thin.indices == full.indices
    (motion,) = closed_loop(plant, SLOPPY, short, [IIR], stride=stride)
    np.testing.assert_array_equal(motion.time, short.time[::stride])


def test_without_recording_the_index_is_the_same(plant: Plant, short: Reference) -> None:
    full, bare = (evaluate(plant, SLOPPY, short, [IIR], stride=stride) for stride in (1, 0))
    assert bare.states.shape[1] == 0 and bare.indices == full.indices


@kernels
@pytest.mark.parametrize("name", NAMES)
def test_tuned_controllers_hold_every_trajectory_and_the_index_is_5(
    plant: Plant, name: str
) -> None:
    sampled = reference(trajectory(name), PARAMETERS)
    controllers = [TUNED_IDEAL[tuned].filters(1e-3) for tuned in NAMES]
    motions = closed_loop(plant, setting("simulink"), sampled, controllers)
    outcome = evaluate(plant, setting("simulink"), sampled, controllers)
    for motion, index in zip(motions, outcome.indices, strict=True):
        assert motion.diverged is None and len(motion.time) == 5001
        assert envelope_half_width(motion.tip, sampled.tip) < ENVELOPE
        assert performance_index(motion) == pytest.approx(index, rel=INDEX)


def test_weights_of_the_index_reach_the_compiled_loop(plant: Plant, short: Reference) -> None:
    weights = (2.0, 0.5, 1e4)
    (motion,) = closed_loop(plant, SLOPPY, short, [IIR])
    outcome = evaluate(plant, SLOPPY, short, [IIR], weights=weights)
    assert outcome.indices[0] == pytest.approx(performance_index(motion, weights), rel=INDEX)
    assert outcome.indices[0] != pytest.approx(performance_index(motion), rel=0.01)


def test_printed_form_runs_in_the_same_loop_and_moves_otherwise(short: Reference) -> None:
    (consistent,) = closed_loop(AssumedModesPlant(PARAMETERS), SLOPPY, short, [IIR])
    (as_printed,) = closed_loop(PRINTED_PLANT, SLOPPY, short, [IIR])
    difference = np.abs(consistent.v - as_printed.v).max()
    assert 1e-7 < difference < np.abs(consistent.v).max()  # [m]


# --- divergence and rest ------------------------------------------------------------------------


@kernels
def test_divergence_has_a_time_and_nothing_after_it(plant: Plant, short: Reference) -> None:
    bent = Reference(short.time, short.tip, short.joint + (0.0, 1e-3) * (short.time > 0)[:, None])
    outcome = evaluate(plant, setting("none"), bent, [RUNAWAY, P_CONTROL], stride=1)
    assert outcome.indices[0] == np.inf and np.isfinite(outcome.indices[1])
    time = outcome.diverged[0]
    assert 0 < time < 0.2 and np.isnan(outcome.diverged[1])
    rows = round(time / 1e-3)
    assert np.isfinite(outcome.states[0, :rows]).all()
    for column in (outcome.states, outcome.torques, outcome.errors):
        assert np.isnan(column[0, rows:]).all() and np.isfinite(column[1]).all()
    gone, held = closed_loop(plant, setting("none"), bent, [RUNAWAY, P_CONTROL])
    assert gone.diverged == time and len(gone.time) == len(gone.tip) == rows
    assert performance_index(gone) == np.inf
    assert held.diverged is None and len(held.time) == 201


def test_controller_that_overflows_is_a_divergence(plant: Plant, short: Reference) -> None:
    huge = (np.array([1e308, -1e308]), np.array([1.0, -1e10])), P_CONTROL[1]
    outcome = evaluate(plant, setting("none"), short, [huge])
    assert np.isinf(outcome.indices[0]) and np.isfinite(outcome.diverged[0])


@pytest.mark.parametrize("size", [9e9, 1e11, 1e300])  # [N m]; MuJoCo drops controls above 1e10
def test_absurd_torque_is_a_divergence_and_never_dropped(
    plant: Plant, short: Reference, size: float
) -> None:
    with pytest.raises(DivergenceError, match=rf"{plant.name} .* at t = .* s"):
        drive(plant, setting("none"), np.full((50, 2), size))
    gain = (np.array([-1e8 * size]), np.ones(1))  # the first error is about 1e-7 rad
    outcome = evaluate(plant, setting("none"), short, [(gain, gain), P_CONTROL])
    assert np.isinf(outcome.indices[0]) and np.isfinite(outcome.indices[1])


def quiet_environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT)}


DIVERGING_CHAIN = """
import sys
import numpy as np
import mujoco
from flexsim import DivergenceError, Parameters
from flexsim.plants.chain_plant import ChainPlant
from flexsim.loop.settings import setting
from flexsim.loop.runs import closed_loop, drive
from flexsim.loop.trajectories import reference, trajectory

parameters = Parameters()
plant = ChainPlant.designed(parameters)
if sys.argv[1] == "loop":
    huge = (np.array([float(sys.argv[2])]), np.ones(1))
    sampled = reference(trajectory("line"), parameters)
    (motion,) = closed_loop(plant, setting("none"), sampled, [(huge, huge)], v_gain=1.0)
    print(motion.diverged, np.isfinite(motion.state).all())
elif sys.argv[1] == "drive":
    try:
        drive(plant, setting("none"), np.full((50, 2), float(sys.argv[2])))
    except DivergenceError:
        print("diverged")
else:
    data = mujoco.MjData(plant.chain.model)
    data.ctrl[:] = float(sys.argv[2])
    mujoco.mj_step(plant.chain.model, data, 50)
"""


def diverge(how: str, size: str, folder: Path) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-c", DIVERGING_CHAIN, how, size],
        cwd=folder,
        env=quiet_environment(),
        capture_output=True,
        text=True,
        timeout=120,
    )


@pytest.mark.parametrize(
    ("how", "size"), [("loop", "-1e15"), pytest.param("drive", "9e9", marks=pytest.mark.slow)]
)
def test_diverging_chain_says_nothing_and_writes_no_log(
    how: str, size: str, tmp_path: Path
) -> None:
    run = diverge(how, size, tmp_path)
    assert run.returncode == 0 and run.stderr == ""
    if how == "loop":
        time, finite = run.stdout.split()
        assert 0 < float(time) < 0.1 and finite == "True"
    else:
        assert run.stdout.strip() == "diverged"
    assert list(tmp_path.iterdir()) == []


def test_the_same_motion_in_plain_mujoco_does_write_a_log(tmp_path: Path) -> None:
    """Control: outside our loops MuJoCo's warnings work as ever."""
    diverge("plain", "9e9", tmp_path)
    assert (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_zero_torque_stays_at_rest(plant: Plant) -> None:
    for chosen in ("none", "simulink", "jump", "opposing"):
        motion = drive(plant, setting(chosen), np.zeros((100, 2)), theta=(0.4, 1.2))
        assert len(motion.time) == 101
        assert np.abs(motion.state - plant.rest_state((0.4, 1.2))).max() < REST
        assert np.abs(motion.energy).max() < REST


def test_drive_holds_each_torque_for_its_period(plant: Plant) -> None:
    torque = np.array([[0.2, 0.01], [-0.1, 0.02], [0.0, 0.0]])
    coarse = drive(plant, SLOPPY, torque, period=4e-3, theta=(0.0, 1.2))
    fine = drive(plant, SLOPPY, np.repeat(torque, 4, axis=0), theta=(0.0, 1.2))
    np.testing.assert_array_equal(coarse.state, fine.state[::4])
    again = drive(plant, SLOPPY, torque[1:], period=4e-3, state=coarse.state[1])
    np.testing.assert_array_equal(again.state, coarse.state[1:])


# --- without the compiler -----------------------------------------------------------------------

FEW_SAMPLES = """
import sys
import numpy as np
from flexsim import Parameters
from flexsim.loop.friction import Friction
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.loop.settings import Setting
from flexsim.loop.runs import closed_loop
from flexsim.loop.trajectories import Trajectory, reference

parameters = Parameters()
sampled = reference(
    Trajectory("line", duration=0.02, hold=0.0, start=(0.60, 0.30), end=(0.601, 0.301)), parameters
)
pair = (np.array([30.0, -20.0]), np.array([1.0, -0.5]))
chosen = Setting("t", Friction("opposing", dead_zone=((0, 0), (0, 0)), tau_0=(0.1, 0)), "for tests")
plant = AssumedModesPlant(parameters, form=sys.argv[2])
(motion,) = closed_loop(plant, chosen, sampled, [(pair, pair)], threads=1)
np.save(sys.argv[1], np.hstack([motion.state, motion.torque, motion.error]))
"""


@pytest.mark.parametrize("form", ["consistent", pytest.param("printed", marks=pytest.mark.slow)])
def test_interpreted_loop_is_the_compiled_one(form: str, tmp_path: Path) -> None:
    results = []
    for disabled in ("0", "1"):
        path = tmp_path / f"jit{disabled}.npy"
        run = subprocess.run(
            [sys.executable, "-c", FEW_SAMPLES, str(path), form],
            env=quiet_environment() | {"NUMBA_DISABLE_JIT": disabled},
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert run.returncode == 0, run.stderr
        results.append(np.load(path))
    compiled, interpreted = results
    assert compiled.shape == (21, 14)
    scale = np.abs(compiled).max(axis=0)
    assert (np.abs(interpreted - compiled).max(axis=0) <= INTERPRETED * scale).all()


# --- what is refused ----------------------------------------------------------------------------


@given(step=st.floats(1e-5, 1e-2), substeps=st.integers(1, 50))
def test_whole_substeps_counts_and_refuses_anything_between(step: float, substeps: int) -> None:
    assert whole_substeps(substeps * step, step) == substeps
    with pytest.raises(ParameterError):
        whole_substeps((substeps + 0.3) * step, step)


def test_period_that_is_no_multiple_names_both_and_what_would_do() -> None:
    with pytest.raises(ParameterError, match=r"0\.001 s .* 0\.0003 s.*0\.00025 s"):
        whole_substeps(1e-3, 3e-4)
    coarse = AssumedModesPlant(PARAMETERS, step=0.75e-3)
    with pytest.raises(ParameterError, match=r"0\.001 s .* 0\.00075 s"):
        closed_loop(coarse, setting("none"), reference(SHORT, PARAMETERS), [P_CONTROL])
    with pytest.raises(ParameterError, match=r"0\.001 s .* 0\.00075 s"):
        drive(coarse, setting("none"), np.zeros((3, 2)))


@pytest.mark.parametrize(("period", "step"), [(0.0, 1e-3), (1e-3, -1e-3), (1e-3, math.nan)])
def test_impossible_period_or_step_is_an_error(period: float, step: float) -> None:
    with pytest.raises(ParameterError, match="over 0"):
        whole_substeps(period, step)


def test_step_beyond_the_integrators_limit_names_one_that_would_do() -> None:
    with pytest.raises(
        ParameterError, match=r"step 0\.01 s is too long for RK4.*use less than"
    ) as e:
        AssumedModesPlant(PARAMETERS, step=0.01)
    allowed = float(str(e.value).split("use less than ")[1].split()[0])
    assert AssumedModesPlant(PARAMETERS, step=0.99 * allowed).step < 0.01
    with pytest.raises(ModelError, match=r"timestep 0\.005 s is too long for RK4"):
        ChainPlant.designed(PARAMETERS, step=5e-3)


@pytest.mark.parametrize("step", [0.0, -1e-3, math.nan, math.inf])
def test_impossible_step_is_an_error(step: float) -> None:
    with pytest.raises(ParameterError, match="physics step is"):
        AssumedModesPlant(PARAMETERS, step=step)


def test_unknown_form_is_an_error_naming_the_choices() -> None:
    with pytest.raises(ParameterError, match="'modal' is unknown; choose consistent or printed"):
        replace(PRINTED_PLANT, form="modal")


@pytest.mark.parametrize("threads", [0, -1, 10_000])
def test_impossible_number_of_threads_is_an_error(short: Reference, threads: int) -> None:
    with pytest.raises(ParameterError, match=f"threads is {threads}"):
        evaluate(AssumedModesPlant(PARAMETERS), SLOPPY, short, [IIR], threads=threads)


@pytest.mark.parametrize(
    "torque", [np.zeros(3), np.zeros((3, 3)), np.full((3, 2), np.nan)], ids=["1d", "wide", "nan"]
)
def test_torque_of_another_shape_is_an_error(torque: np.ndarray) -> None:
    with pytest.raises(ParameterError, match=r"\(K, 2\) finite"):
        drive(AssumedModesPlant(PARAMETERS), setting("none"), torque)
