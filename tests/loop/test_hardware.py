"""Hardware: each part against a slow loop of its own, noise by seed and run, bad numbers."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from flexsim import ParameterError, Parameters, Plant, closed_loop, drive, reference, setting
from flexsim.loop.friction import Friction, joint_torques
from flexsim.loop.hardware import HARDWARE, IDEAL, Hardware, lag_factors, named
from flexsim.loop.runs import evaluate
from flexsim.loop.settings import Setting
from flexsim.loop.trajectories import Reference, Trajectory
from flexsim.numerics.noise import normal
from flexsim.plants.modes_plant import AssumedModesPlant

PARAMETERS = Parameters()
SHORT = Trajectory("line", duration=0.15, hold=0.05, start=(0.60, 0.30), end=(0.58, 0.32))
IIR = (
    (np.array([30.0, -29.0]), np.array([1.0, -0.6])),
    (np.array([0.3, 0.2, 0.1]), np.array([1.0, -0.9, 0.1])),
)
SAME = 1e-12  # relative to the largest; the same sums in another order
BENCH = HARDWARE["bench"]
ALL = Hardware(2, (0.1, 0.05), 4096, 2e-4, 3e-4, seed=5)
RUBBING = Friction(
    "opposing",
    dead_zone=((-0.05, 0.04), (-0.002, 0.003)),
    tau_0=(0.1, 0.01),
    mu=(0.05, 0.02),
    torque_limit=(9.0, 0.02),
)
WAYS = {
    "delay": Hardware(delay=3),
    "limit": Hardware(torque_limit=(0.1, 0.01)),
    "counts": Hardware(counts=2000),
    "noise": Hardware(noise_v=1e-3, seed=4),
    "lag": Hardware(lag=2e-3),
    "all": ALL,
}


@pytest.fixture(scope="module")
def short() -> Reference:
    return reference(SHORT, PARAMETERS)


def with_hardware(built: Hardware, friction: Friction | None = None) -> Setting:
    return Setting("test", friction or Friction(), "for tests", hardware=built)


def slow_hardware(
    plant: Plant, built: Hardware, friction: Friction, sampled: Reference
) -> dict[str, np.ndarray]:
    """Return what a loop does that is written down sample by sample, the plant by `drive`.

    The lag is in closed form; its mean over a step is a fine sum of its values.
    """
    state, period = plant.rest_state(sampled.joint[0]), 1e-3
    errors, commands, states, applied, measured = [], [], [], [], []
    motor = np.zeros(2)
    limit = np.minimum(built.torque_limit, friction.torque_limit)
    m = len(state) // 2
    unlimited = replace(friction, torque_limit=(math.inf, math.inf)).numbers()
    for k, target in enumerate(sampled.joint):
        v = float(plant.observe(state[None]).v[0])
        angles = state[:2].copy()
        if built.counts:
            count = 2 * math.pi / built.counts
            angles = count * np.floor(angles / count + 0.5)
        v += built.noise_v * normal(built.seed, 0, k)
        measured.append([*angles, v])
        e = target - angles
        e[1] += math.atan(v / PARAMETERS.reach)
        errors.append(e)
        commands.append([lfilter(b, a, np.array(errors)[:, i])[-1] for i, (b, a) in enumerate(IIR)])
        states.append(state)
        waited = commands[k - built.delay] if k >= built.delay else [0.0, 0.0]
        due = np.clip(waited, -limit, limit)
        given = due
        if built.lag:
            fine = (np.arange(1000) + 0.5) / 1000 * period
            given = due + (motor - due) * np.mean(np.exp(-fine / built.lag))
            motor = due + (motor - due) * math.exp(-period / built.lag)
        applied.append(given)
        tau = joint_torques(unlimited, *given, *state[m : m + 2])
        state = drive(plant, setting("none"), [tau], period, state=state).state[1]
    names = ("state", "torque", "error", "applied", "measured")
    columns = (states, commands, errors, applied, measured)
    return dict(zip(names, map(np.array, columns), strict=True))


@pytest.mark.parametrize("friction", [Friction(), RUBBING], ids=lambda each: each.law)
@pytest.mark.parametrize("way", WAYS)
def test_each_part_is_the_slow_loops(
    way: str, friction: Friction, modes_plant: AssumedModesPlant, short: Reference
) -> None:
    built = WAYS[way]
    expected = slow_hardware(modes_plant, built, friction, short)
    (motion,) = closed_loop(modes_plant, with_hardware(built, friction), short, [IIR])
    (ideal,) = closed_loop(modes_plant, with_hardware(IDEAL, friction), short, [IIR])
    assert np.abs(motion.torque - ideal.torque).max() > 1e-4  # [N m]: it does matter
    tolerance = 1e-6 if built.lag else SAME  # the midpoint sum of the lag
    for name, wanted in expected.items():
        scale = np.abs(wanted).max(axis=0) + 1e-9
        assert (np.abs(getattr(motion, name) - wanted).max(axis=0) <= tolerance * scale).all(), name


def test_ideal_is_no_hardware_to_the_bit(plant: Plant, short: Reference) -> None:
    """What is measured is the state, what is applied the command."""
    (motion,) = closed_loop(plant, setting("none"), short, [IIR])
    assert np.array_equal(motion.applied, motion.torque)
    assert np.array_equal(motion.measured[:, :2], motion.joint)
    assert motion.measured[:, 2] == pytest.approx(motion.v, abs=1e-15)
    loose = Hardware(torque_limit=(1e6, 1e6))
    (other,) = closed_loop(plant, with_hardware(loose), short, [IIR])
    assert np.array_equal(motion.state, other.state)


def test_noise_is_the_same_on_both_plants_any_threads_and_another_in_each_run(
    plant: Plant, modes_plant: AssumedModesPlant, short: Reference
) -> None:
    noisy = with_hardware(Hardware(noise_v=1e-3, seed=9))
    runs = [
        evaluate(each, noisy, short, [IIR] * 3, stride=1, threads=threads)
        for each in (plant, modes_plant)
        for threads in (1, 2)
    ]
    for one, other in (runs[:2], runs[2:]):
        assert np.array_equal(one.states, other.states)
    clean = evaluate(modes_plant, with_hardware(IDEAL), short, [IIR], stride=1)
    drawn = np.array([[normal(9, i, k) for k in range(len(short.time))] for i in range(3)])
    for run, each in ((runs[0], plant), (runs[2], modes_plant)):
        for i in range(3):
            v = each.observe(run.states[i], energy=False).v
            assert run.measured[i, :, 2] - v == pytest.approx(1e-3 * drawn[i], abs=1e-15)
    assert clean.measured[0, 0, 2] == 0.0
    alike = evaluate(modes_plant, noisy, short, [IIR] * 3, stride=1, same_noise=True)
    assert np.array_equal(alike.states[0], runs[2].states[0])
    assert np.array_equal(alike.states[1], alike.states[0])
    last = evaluate(modes_plant, noisy, short, [IIR], stride=1, first_run=2)
    assert np.array_equal(last.states[0], runs[2].states[2])
    other = evaluate(modes_plant, with_hardware(Hardware(noise_v=1e-3, seed=8)), short, [IIR])
    assert other.indices[0] != alike.indices[0]


def test_a_driven_plant_gets_what_the_motors_give(modes_plant: AssumedModesPlant) -> None:
    torque = np.array([[0.5, 0.02], [-0.3, 0.3], [0.2, -0.1], [0.0, 0.0]])
    built = Hardware(delay=1, torque_limit=(0.4, 0.2), lag=5e-4)
    motion = drive(modes_plant, with_hardware(built), torque, theta=(0.0, 1.2))
    assert np.array_equal(motion.torque[:4], torque)
    decay, mean = lag_factors(5e-4, 1e-3)
    motor, expected = np.zeros(2), []
    for due in ([0.0, 0.0], [0.4, 0.02], [-0.3, 0.2], [0.2, -0.1]):
        expected.append(due + mean * (motor - due))
        motor = due + decay * (motor - due)
    assert motion.applied[:4] == pytest.approx(np.array(expected), abs=1e-15)
    plain = drive(modes_plant, setting("none"), np.array(expected), theta=(0.0, 1.2))
    assert motion.state == pytest.approx(plain.state, abs=1e-14)


def test_a_lags_mean_torque_is_exact() -> None:
    """Momentum given over a step: the exponential's integral."""
    for lag, time in ((1e-3, 1e-3), (1e-6, 1e-3), (10.0, 1e-3)):
        t = np.linspace(0, time, 200_001)
        decay, mean = lag_factors(lag, time)
        assert decay == pytest.approx(math.exp(-time / lag), rel=1e-14)
        assert mean == pytest.approx(np.trapezoid(np.exp(-t / lag), t) / time, rel=1e-4)
    assert lag_factors(0.0, 1e-3) == (0.0, 0.0)


def test_named_hardware() -> None:
    assert named("ideal") == Hardware() == IDEAL and IDEAL.ideal
    assert Hardware(seed=7).ideal and not BENCH.ideal
    assert (BENCH.delay, BENCH.torque_limit, BENCH.counts) == (1, (10.0, 5.0), 8192)
    assert (BENCH.noise_v, BENCH.lag) == (1e-4, 0.0)
    assert setting("jump", BENCH).hardware == BENCH and setting("jump").hardware == IDEAL
    assert BENCH.words() == (
        "delay of 1 sample, torques up to 10 and 5 N m, 8192 counts a turn, "
        "0.1 mm rms of noise on v (seed 0)"
    )
    assert Hardware(lag=1e-3).words() == "motor lag of 1 ms" and IDEAL.words() == "ideal"
    with pytest.raises(ParameterError, match=r"hardware is 'bench'; give a Hardware"):
        setting("jump", "bench")  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match=r"'desk' is unknown; choose one of ideal, delayed,"):
        named("desk")


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"delay": -1}, "delay is -1.*0 to 100"),
        ({"delay": 101}, "delay is 101"),
        ({"delay": 0.5}, "delay is 0.5.*whole"),
        ({"torque_limit": (0.0, 1.0)}, "torque limit is .*above 0"),
        ({"torque_limit": (1.0, math.nan)}, "torque limit is .*nan"),
        ({"torque_limit": (1.0,)}, "torque limit is .*two"),
        ({"counts": -1}, "counts are -1"),
        ({"counts": 8.5}, "counts are 8.5.*whole"),
        ({"counts": 10**400}, "counts are 1000.*up to 9.0e"),
        ({"torque_limit": ("ten", "five")}, "torque limit is .*ten"),
        ({"noise_v": "1e-4"}, "noise is 1e-4 m; give a finite number"),
        ({"lag": None}, "lag is None s; give a finite number"),
        ({"noise_v": -1e-3}, "noise is -0.001 m"),
        ({"noise_v": math.inf}, "noise is inf"),
        ({"lag": -1.0}, "lag is -1.0 s"),
        ({"lag": math.nan}, "lag is nan"),
        ({"seed": -1}, "seed of the noise is -1"),
        ({"seed": 2**63}, "seed of the noise"),
    ],
)
def test_numbers_that_cannot_be_used_are_named(change: dict[str, Any], what: str) -> None:
    with pytest.raises(ParameterError, match=what) as refused:
        Hardware(**change)
    assert "\n" not in str(refused.value)
