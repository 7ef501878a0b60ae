"""Strain bridges: v of strains in closed form, each error as algebra says, the loop by rows."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter, lfilter_zi

from flexsim import ParameterError, Parameters, Plant, closed_loop, drive, reference, setting
from flexsim.arm.beam import mode_shapes
from flexsim.loop.hardware import HARDWARE, Hardware, Sensing, bridge_numbers, overridden
from flexsim.loop.hardware.bridges import ramp_filter
from flexsim.loop.hardware.estimators import kalman_filter, static_estimator
from flexsim.loop.motion import Motion
from flexsim.loop.settings import Setting
from flexsim.loop.trajectories import Trajectory
from flexsim.numerics.noise import normal
from flexsim.plants.curvature import curvature_of_modes
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.robot import Robot

P = Parameters()
PLACES, D = (0.025, 0.25), 0.0005
SAME = 1e-9  # rows have ten digits
PERIOD = 1e-3
SHORT = Trajectory("line", duration=0.15, hold=0.05, start=(0.60, 0.30), end=(0.58, 0.32))
IIR = (
    (np.array([30.0, -29.0]), np.array([1.0, -0.6])),
    (np.array([0.3, 0.2, 0.1]), np.array([1.0, -0.9, 0.1])),
)


def strains(n: int, places: tuple[float, float] = PLACES) -> np.ndarray:
    """Return strains (2, n) of a unit of each of n clamped modes."""
    return np.asarray(D * mode_shapes(n, np.array(places) / P.L, 2) / P.L**2)


def sensing(**fields: Any) -> Hardware:
    return Hardware(sensing=Sensing(**fields))


def driven(plant: Plant, built: Hardware, run: int = 0) -> Motion:
    """Return a motion that bends the beam, as measured."""
    t = np.arange(60) * PERIOD
    torque = np.column_stack([0.5 * np.sin(90 * t), 0.1 * np.cos(200 * t)])
    return drive(
        plant,
        Setting("test", setting("none").friction, "", hardware=built),
        torque,
        theta=(0.1, 1.2),
        run=run,
    )


def test_two_bridges_are_exact_in_two_modes_and_spill_the_third() -> None:
    """What is read of mode 3 is taken for modes 1 and 2: its spillover in closed form."""
    J = static_estimator("two-bridges", P, PLACES, D)
    tip = mode_shapes(3, 1.0)
    E = strains(3)
    assert J @ E[:, :2] == pytest.approx(tip[:2], rel=1e-12)
    spilled = tip[:2] @ np.linalg.solve(E[:, :2], E[:, 2])
    assert J @ E[:, 2] == pytest.approx(spilled, rel=1e-12)
    assert abs(spilled - tip[2]) > 1  # far from the third mode's own deflection
    nodes = (0.13235 * P.L, 0.49657 * P.L)  # where chi_3'' is zero: nothing is spilled
    quiet = static_estimator("two-bridges", P, nodes, D) @ strains(3, nodes)[:, 2]
    assert abs(quiet) < 1e-3 * abs(spilled)


def test_the_other_static_estimators_are_exact_in_their_own_shapes() -> None:
    one = static_estimator("one-bridge", P, PLACES, D)
    assert one @ strains(1)[:, 0] == pytest.approx(2.0, rel=1e-12) and one[1] == 0.0
    under_force = D * (P.L - np.array(PLACES)) / P.EI
    found = static_estimator("quasi-static", P, PLACES, D) @ under_force
    assert found == pytest.approx(P.static_compliance, rel=1e-12)


@pytest.mark.parametrize(
    "name", ["assumed-modes", pytest.param("closed-chain", marks=pytest.mark.slow), "rod"]
)
def test_bridges_read_the_plants_curvature(name: str) -> None:
    """Gain, mounting error, offset and drift as written; and v is J of that."""
    plant = Robot().plant(name)
    change: dict[str, Any] = {
        "bridge_gain": (0.02, -0.01),
        "bridge_shift": (0.002, -0.003),
        "bridge_offset": (1e-6, -2e-6),
        "bridge_drift": (1e-4, 2e-4),
    }
    motion = driven(plant, sensing(estimator="two-bridges", **change))
    q = motion.state[:, : motion.state.shape[1] // 2]
    true = D * q @ plant.curvature_rows(np.add(PLACES, change["bridge_shift"])).T
    wanted = true * (1 + np.array(change["bridge_gain"])) + change["bridge_offset"]
    wanted += motion.time[:, None] * change["bridge_drift"]
    assert motion.sensed is not None
    assert motion.sensed[:, :2] == pytest.approx(wanted, rel=SAME, abs=1e-14)
    J = static_estimator("two-bridges", plant.parameters, PLACES, D)
    assert motion.measured[:, 2] == pytest.approx(wanted @ J, rel=SAME, abs=1e-11)
    assert np.abs(motion.measured[:, 2] - motion.v).max() > 1e-5


def test_without_errors_two_modes_are_seen_as_they_are() -> None:
    """A plant of two modes: v is exact. Of three: off by the third mode's spillover."""
    built = sensing(estimator="two-bridges")
    two = driven(AssumedModesPlant(P, 2), built)
    assert two.measured[:, 2] == pytest.approx(two.v, rel=1e-7, abs=1e-12)
    three = driven(AssumedModesPlant(P, 3), built)
    spilled = static_estimator("two-bridges", P, PLACES, D) @ strains(3)[:, 2] + 0.0
    off = (spilled - mode_shapes(3, 1.0)[2]) * three.modal[:, 2]
    assert three.measured[:, 2] - three.v == pytest.approx(off, rel=1e-6, abs=1e-12)
    assert np.abs(off).max() > 1e-5


def test_a_gain_error_scales_what_a_bridge_tells(modes_plant: AssumedModesPlant) -> None:
    clean = driven(modes_plant, sensing(estimator="two-bridges"))
    wrong = driven(modes_plant, sensing(estimator="two-bridges", bridge_gain=(0.05, 0.0)))
    J = static_estimator("two-bridges", P, PLACES, D)
    assert clean.sensed is not None
    more = wrong.measured[:, 2] - clean.measured[:, 2]
    assert more == pytest.approx(0.05 * J[0] * clean.sensed[:, 0], rel=SAME, abs=1e-12)


def test_the_filter_is_scipys_and_settled_at_the_start(modes_plant: AssumedModesPlant) -> None:
    raw = driven(modes_plant, sensing(bridges="on", bridge_offset=(1e-5, 2e-5)))
    lag = sensing(bridges="on", bridge_offset=(1e-5, 2e-5), bridge_filter=2e-3)
    slow = driven(modes_plant, lag)
    assert raw.sensed is not None and slow.sensed is not None
    keep, now, before = ramp_filter(2e-3, PERIOD)
    b, a = [now, before], [1.0, -keep]
    for i in range(2):
        x = raw.sensed[:, i]
        wanted, _ = lfilter(b, a, x, zi=lfilter_zi(b, a) * x[0])
        assert slow.sensed[:, i] == pytest.approx(wanted, rel=1e-12)
    assert np.array_equal(slow.measured, raw.measured)  # v is exact: bridges are for the log
    fine = np.linspace(0, PERIOD, 100_001)  # a ramp, whose answer is known: t - T + T e^(-t/T)
    assert now * PERIOD == pytest.approx(PERIOD - 2e-3 + 2e-3 * math.exp(-fine[-1] / 2e-3))
    assert ramp_filter(0.0, PERIOD) == (0.0, 1.0, 0.0) and keep + now + before == pytest.approx(1)


def test_noise_has_channels_runs_and_rms(modes_plant: AssumedModesPlant) -> None:
    noisy: dict[str, Any] = {
        "bridges": "on",
        "bridge_noise": (1e-6, 2e-6),
        "tachometers": "on",
        "tachometer_noise": (0.01, 0.02),
        "tachometer_gain": (0.03, 0.0),
    }
    built = replace(sensing(**noisy), noise_v=1e-4, seed=3)
    clean = driven(modes_plant, sensing(bridges="on"))
    for run in (0, 4):
        motion = driven(modes_plant, built, run)
        assert motion.sensed is not None and clean.sensed is not None
        drawn = np.array(
            [[normal(3, run, k, c) for c in range(5)] for k in range(len(motion.time))]
        )
        assert np.array_equal(motion.state, clean.state)
        assert motion.measured[:, 2] - motion.v == pytest.approx(1e-4 * drawn[:, 0], abs=1e-15)
        assert motion.sensed[:, :2] - clean.sensed[:, :2] == pytest.approx(
            drawn[:, 1:3] * [1e-6, 2e-6], abs=1e-17
        )
        rates = motion.state[:, 5:7] * [1.03, 1.0]
        assert motion.sensed[:, 2:] - rates == pytest.approx(drawn[:, 3:] * [0.01, 0.02], abs=1e-14)
        assert abs(np.corrcoef(drawn.T) - np.eye(5)).max() < 0.5
    assert np.array_equal(
        [normal(3, 0, k) for k in range(9)], [normal(3, 0, k, 0) for k in range(9)]
    )


def test_encoders_behind_gears_count_finer(modes_plant: AssumedModesPlant) -> None:
    built = replace(sensing(gear=(50.0, 1.0)), counts=1000)
    motion = driven(modes_plant, built)
    quantum = 2 * math.pi / 1000
    off = np.abs(motion.measured[:, :2] - motion.joint).max(axis=0)
    assert off[0] <= quantum / 100 * (1 + 1e-9) and quantum / 100 < off[1] <= quantum / 2
    for i, q in enumerate((quantum / 50, quantum)):
        turns = motion.measured[:, i] / q
        assert np.abs(turns - np.round(turns)).max() < 1e-6


def model_run(filtered: Any, samples: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return innovations (K, 4) and errors of v (K,) of a filter on data of its own model."""
    rng = np.random.default_rng(seed)
    n = len(filtered.F)
    x, found = np.zeros(n), np.full(n, 1e-3)
    told = np.zeros(2)
    innovations, errors = [], []
    rms, torque = np.array([1e-3, 1e-3, 1e-6, 1e-6]), np.array([0.1, 0.02])
    for _ in range(samples):
        y = filtered.C @ x + rms * rng.standard_normal(4)
        innovations.append(y - filtered.C @ (filtered.A @ found + filtered.B @ told))
        found = filtered.F @ found + filtered.G @ np.concatenate([y, told])
        errors.append(filtered.H @ (found - x))
        told = 0.3 * rng.standard_normal(2)
        x = filtered.A @ x + filtered.B @ (told + torque * rng.standard_normal(2))
    return np.array(innovations), np.array(errors)


@pytest.mark.parametrize("modes", [1, 2, 3])
def test_innovations_on_the_filters_own_model_are_white(modes: int) -> None:
    torque, noise = (0.1, 0.02), (1e-3, 1e-3, 1e-6, 1e-6)
    filtered = kalman_filter(P, modes, PLACES, D, PERIOD, 1.2, torque, noise)
    innovations, errors = model_run(filtered, 6000, seed=modes)
    late = innovations[1000:]
    whitened = np.linalg.solve(np.linalg.cholesky(filtered.innovation), late.T).T
    bound = 4 / math.sqrt(len(late))  # four standard deviations
    assert np.abs(np.cov(whitened.T) - np.eye(4)).max() < 2 * bound
    for lag in (1, 2, 5, 20):
        assert np.abs(whitened[lag:].T @ whitened[:-lag] / len(whitened)).max() < bound, lag
    assert np.abs(errors[:3]).max() > 3 * np.abs(errors[1000:]).max()  # it did converge
    worse = filtered._replace(G=filtered.G * [1, 1, 0.2, 0.2, 1, 1])  # negative control
    off = model_run(worse, 6000, seed=modes)[0][1000:]
    scaled = np.linalg.solve(np.linalg.cholesky(filtered.innovation), off.T).T
    assert np.abs(scaled[1:].T @ scaled[:-1] / len(scaled)).max() > 2 * bound


def test_the_filter_in_the_loop_is_the_filter(modes_plant: AssumedModesPlant) -> None:
    """Row by row in numpy, from what was measured; three modes see what one does not."""
    off = {}
    for n in (1, 3):
        built = sensing(estimator=f"kalman:{n}", bridge_noise=(1e-7, 1e-7), kalman_pose=1.2)
        built = replace(built, delay=1, torque_limit=(0.3, 0.3))
        motion = driven(modes_plant, built)
        b = bridge_numbers(built, modes_plant, PERIOD)
        size = b.states
        F, G = b.F.reshape(size, size), b.G.reshape(size, 6)
        x, told, wanted = np.zeros(size), np.zeros(2), []
        assert motion.sensed is not None
        for k in range(len(motion.time)):
            turned = motion.measured[k, :2] - motion.measured[0, :2]
            y = np.concatenate([turned, motion.sensed[k, :2], told])
            x = F @ x + G @ y
            wanted.append(b.H[:size] @ x)
            told = motion.applied[k]
        assert motion.measured[:, 2] == pytest.approx(np.array(wanted), rel=1e-8, abs=1e-12)
        off[n] = np.abs(motion.measured[:, 2] - motion.v).max() / np.abs(motion.v).max()
    assert off[3] < 0.02 < off[1]


@pytest.mark.parametrize(
    "name", ["assumed-modes", pytest.param("chain", marks=pytest.mark.slow)]
)  # compiled once more for each
def test_the_closed_loop_reads_as_the_rows_say(name: str) -> None:
    """What the controllers get in the batch's loop, noise by run; and two threads are the same."""
    plant, sampled = Robot().plant(name), reference(SHORT, P)
    built = replace(HARDWARE["bridges"], seed=2)
    chosen = Setting("test", setting("none").friction, "", hardware=built)
    one, two = closed_loop(plant, chosen, sampled, [IIR, IIR], threads=2)
    again = closed_loop(plant, chosen, sampled, [IIR, IIR], threads=1)
    assert np.array_equal(one.state, again[0].state) and np.array_equal(two.state, again[1].state)
    assert not np.array_equal(one.state, two.state)  # noise of its own
    s = built.sensing
    q = one.state[:, : one.state.shape[1] // 2]
    read = D * q @ plant.curvature_rows(PLACES).T * (1 + np.array(s.bridge_gain))
    read += s.bridge_offset
    noisy = read + 5e-7 * np.array(
        [[normal(2, 0, k, c) for c in (1, 2)] for k in range(len(one.time))]
    )
    keep, now, before = ramp_filter(s.bridge_filter, PERIOD)
    passed, _ = lfilter(
        [now, before],
        [1.0, -keep],
        noisy,
        axis=0,
        zi=((before + keep) * read[0])[None],
    )
    assert one.sensed is not None
    assert one.sensed[:, :2] == pytest.approx(passed, rel=1e-7, abs=1e-13)
    v = passed @ static_estimator("two-bridges", plant.parameters, PLACES, D)
    assert one.measured[:, 2] == pytest.approx(v, rel=1e-7, abs=1e-10)
    wanted = sampled.joint[:, 1] - one.measured[:, 1] + np.arctan(v / P.reach)
    assert one.error[:, 1] == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"estimator": "guess"}, "estimator .* is guess; choose one of exact, two-bridges"),
        ({"estimator": "kalman:0"}, "kalman:0; give kalman:n with 1 to 8 modes"),
        ({"estimator": "kalman:x"}, "give kalman:n"),
        ({"bridges": "yes"}, "bridges .* is yes; choose one of off, on"),
        ({"bridge_places": (-0.1, 0.2)}, "bridge_places .* from 0"),
        ({"bridge_gain": (-2.0, 0.0)}, "bridge_gain .* from -1"),
        ({"bridge_distance": 0.0}, "bridge_distance .* above 0"),
    ],
)
def test_numbers_that_cannot_be_used_are_named(change: dict[str, Any], what: str) -> None:
    with pytest.raises(ParameterError, match=what) as refused:
        Sensing(**change)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"bridge_places": (0.1, 0.1)}, "0.1 m and 0.1 m tell two modes not apart"),
        ({"bridge_places": (0.1, 0.7)}, "0.7 m from the clamp, off the beam; give 0 to 0.5 m"),
        (
            {"bridge_shift": (-0.1, 0.0)},
            "1, 0.025 m from the clamp, is off the beam by its",
        ),
        ({"estimator": "one-bridge", "bridge_places": (0.5, 0.1)}, "reads nothing of mode 1"),
        ({"estimator": "quasi-static", "bridge_places": (0.5, 0.5)}, "both .* at the tip"),
        ({"estimator": "kalman:2", "bridge_places": (0.5, 0.6)}, "off the beam"),
    ],
)
def test_places_that_cannot_be_used_are_named(
    change: dict[str, Any], what: str, modes_plant: AssumedModesPlant
) -> None:
    with pytest.raises(ParameterError, match=what) as refused:
        bridge_numbers(sensing(**{"estimator": "two-bridges"} | change), modes_plant, PERIOD)
    assert "\n" not in str(refused.value)
    with pytest.raises(ParameterError, match="does not bend"):
        bridge_numbers(sensing(estimator="two-bridges"), Robot().plant("rigid"), PERIOD)


def test_given_as_text_and_by_name() -> None:
    found = overridden("ideal", hardware_with=("estimator=kalman:2", "bridge_places=0.01,0.2"))
    assert found.sensing.kalman_modes == 2 and found.sensing.bridge_places == (0.01, 0.2)
    named = HARDWARE["bridges"].sensing
    assert named.estimator == "two-bridges" and named.bridge_noise == (5e-7, 5e-7)
    assert curvature_of_modes(P, 1, PLACES).shape == (2, 1)
