"""The linear closed loop against textbook loops and against the nonlinear simulation."""

import json
import math
import shutil
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from quick_run import QuickRun
from scipy.signal import lfilter
from trial_controllers import TRIAL

from controllers import Controller, Gains, fractional_pid, textbook_pid
from flexsim import ParameterError, Parameters
from flexsim.linear.linearise import linearise
from flexsim.linear.loop_poles import (
    LinearLoop,
    LoopOptions,
    SampledPlant,
    linear_loop,
    small_signal,
    spectral_radii,
)
from flexsim.linear.margins import margins
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.control.linear_kinds import filter_space
from flexsim.loop.control.stacking import stack
from flexsim.loop.friction import Friction
from flexsim.plants.base import Plant
from flexsim.plants.modes_plant import AssumedModesPlant
from studies.core.evidence.intervals import share_interval
from studies.main import main
from studies.stability.maps import growth_rates, stability_map
from studies.stability.report import outline
from studies.stability.simulated import simulated_errors, simulated_growth, simulated_rates
from studies.stability.stability import StabilityConfig, run
from studies.stability.zeros import zero_rows
from studies.tuning.found import found_in

PERIOD = 1e-3  # [s]
POSE = 1.2  # [rad]
AS_SIMULATED = LoopOptions(hold="stepped")
CLOSED_FORM = 1e-9  # relative; crossings are found to rounding
ON_CIRCLE = 1e-9  # distance of a pole from the unit circle at a gain margin
GROWTH = 0.01  # relative: predicted against simulated rate
FITTED = 0.02  # relative: a rate read off the motion's own peaks
DRAWS, SAMPLES = 120, 2000
SLACK = 0.5  # [1/s]; slower growth does not show in 2 s beside what decays
AGREEMENT = 0.97  # share of draws; measured: 0.992 on both plants
FILTERING = 1e-10  # relative to the largest output


def around_stability(count: int, seed: int) -> Controllers:
    """Filters of random fractional PIDs, about a fifth of them stable."""
    rng = np.random.default_rng(seed)
    pairs = []
    for _ in range(count):
        halves = []
        for k in (1e4, 1e2):
            gain, nu = k * 10 ** rng.uniform(-0.7, 0.7), rng.uniform(0, 0.8)
            gains = Gains.from_milliseconds(gain, nu, 1.0, 0.1 * rng.standard_normal(), 0.1)
            halves.append(fractional_pid(gains, PERIOD))
        pairs.append(tuple(halves))
    return stack(pairs, PERIOD)


def tuned_loop(plant: Plant, name: str, options: LoopOptions = AS_SIMULATED) -> LinearLoop:
    return linear_loop(plant, POSE, stack([TRIAL[name]], PERIOD), options)


def integrators(gain: float) -> LinearLoop:
    """Two uncoupled sampled integrators, T/(z - 1), under proportional control."""
    linear = linearise(AssumedModesPlant())
    sampled = SampledPlant(np.eye(2), PERIOD * np.eye(2), -np.eye(3, 2), PERIOD, linear)
    return LinearLoop(sampled, stack([(([gain, 0.0], [1.0]),) * 2], PERIOD))


@pytest.mark.parametrize("gain", [20.0, 700.0, 1900.0])
@pytest.mark.parametrize("joint", [0, 1])
def test_margins_of_a_sampled_integrator(gain: float, joint: int) -> None:
    found = margins(integrators(gain), joint)  # L = k T/(z - 1): |z - 1| = k T at the crossing
    crossing = 2 * math.asin(gain * PERIOD / 2)
    assert found.gain_high == pytest.approx(2 / (gain * PERIOD), rel=CLOSED_FORM)
    assert found.gain_low == 0
    assert found.phase == pytest.approx(math.pi / 2 - crossing / 2, rel=CLOSED_FORM)
    assert found.omega_phase == pytest.approx(crossing / PERIOD, rel=CLOSED_FORM)


@pytest.mark.parametrize("gain", [700.0, 1500.0])
def test_the_phase_margin_of_an_unstable_loop_is_negative(gain: float) -> None:
    """L = k T/(z (z - 1)), a period late: pi/2 - 3/2 of the crossing, below 0 for k T > 1."""
    plain = integrators(gain)
    late = LinearLoop(
        plain.sampled, plain.controllers._replace(b=plain.controllers.b[..., ::-1].copy())
    )
    crossing = 2 * math.asin(gain * PERIOD / 2)
    found = margins(late, 0).phase
    assert found == pytest.approx(math.pi / 2 - 1.5 * crossing, rel=CLOSED_FORM)
    assert (found < 0) == (gain * PERIOD > 1) == (late.spectral_radius > 1)


def test_poles_of_a_sampled_integrator() -> None:
    loop = integrators(700.0)
    assert loop.spectral_radius == pytest.approx(0.3)  # 1 - k T, twice
    assert loop.growth_rate == pytest.approx(math.log(0.3) / PERIOD)


@pytest.mark.parametrize("joint", [0, 1])
def test_a_pole_lies_on_the_circle_at_the_gain_margins(plant: Plant, joint: int) -> None:
    loop = tuned_loop(plant.undamped(), "circle")  # with damping joint 1 may be left alone
    found = margins(loop, joint)
    assert 0 < found.gain_low < 1 < found.gain_high
    for factor in (found.gain_low, found.gain_high):
        scaled = loop.controllers.b.copy()
        scaled[0, joint] *= factor
        moduli = np.abs(LinearLoop(loop.sampled, loop.controllers._replace(b=scaled)).poles)
        assert np.abs(moduli - 1).min() < ON_CIRCLE


@pytest.mark.parametrize("joint", [0, 1])
def test_closing_a_broken_loop_gives_the_closed_one(plant: Plant, joint: int) -> None:
    loop = tuned_loop(plant, "line")
    A, B, C = loop.broken_at(joint)
    assert A - np.outer(B, C) == pytest.approx(loop.matrix, abs=1e-12 * np.abs(loop.matrix).max())


@given(
    st.lists(st.floats(-2, 2), min_size=2, max_size=6),
    st.lists(st.floats(-0.3, 0.3), min_size=1, max_size=5),
    st.integers(0, 1000),
)
def test_filters_as_state_space_filter_alike(b: list[float], tail: list[float], seed: int) -> None:
    width = max(len(b), len(tail) + 1)
    padded = np.zeros((2, width))
    padded[0, : len(b)], padded[1, : len(tail) + 1] = b, [1.0, *tail]
    A, B, C, D = filter_space(*padded)
    x = np.random.default_rng(seed).standard_normal(30)
    state, out = np.zeros(len(A)), []
    for each in x:
        out.append(C @ state + D * each)
        state = A @ state + B * each
    expected = lfilter(b, [1.0, *tail], x)
    assert out == pytest.approx(expected, abs=FILTERING * max(1.0, np.abs(expected).max()))


def test_population_and_single_loop_agree(plant: Plant) -> None:
    drawn = around_stability(8, seed=1)
    alone = [drawn.chosen(slice(i, i + 1)) for i in range(8)]
    one = [linear_loop(plant, POSE, each).spectral_radius for each in alone]
    assert spectral_radii(plant, POSE, drawn) == pytest.approx(one, rel=CLOSED_FORM)
    several = spectral_radii(plant, [0.5, POSE, 2.0], drawn)
    each = [spectral_radii(plant, pose, drawn) for pose in (0.5, POSE, 2.0)]
    assert several == pytest.approx(np.max(each, axis=0))


@pytest.mark.parametrize("name", list(TRIAL))
def test_growth_rate_is_that_of_the_simulation(plant: Plant, name: str) -> None:
    loop = tuned_loop(plant, name)
    assert simulated_growth(plant, loop, AS_SIMULATED) == pytest.approx(
        loop.growth_rate, rel=GROWTH
    )


def test_growth_rate_can_be_read_off_the_motion(plant: Plant) -> None:
    loop = tuned_loop(plant, "two-loop")
    errors = simulated_errors(plant, POSE, loop.controllers, AS_SIMULATED, 2500).errors
    window = round(2 * np.pi / np.angle(loop.poles[0]))  # one swing
    peaks = np.abs(errors[0, :, 1][: 2500 // window * window]).reshape(-1, window).max(axis=1)
    late = np.log(peaks[len(peaks) // 2 :])
    rate = np.polyfit(window * PERIOD * np.arange(len(late)), late, 1)[0]
    assert rate == pytest.approx(loop.growth_rate, rel=FITTED)


def agreement(plant: Plant, options: LoopOptions) -> tuple[float, float]:
    """Share of draws that both call stable or both unstable, and share of stable ones."""
    drawn = around_stability(DRAWS, seed=3)
    growth = growth_rates(spectral_radii(plant, POSE, drawn, options), PERIOD)
    rates = simulated_rates(plant, POSE, drawn, AS_SIMULATED, SAMPLES)
    stable = growth <= SLACK
    return float(np.mean(stable == (rates <= SLACK))), float(np.mean(rates <= SLACK))


def test_screening_agrees_with_the_simulation(plant: Plant) -> None:
    share, stable = agreement(plant, AS_SIMULATED)
    assert share >= AGREEMENT
    assert 0.1 < stable < 0.5  # both outcomes are there to be told apart


def test_the_wrong_sign_of_v_would_be_noticed(modes_plant: AssumedModesPlant) -> None:
    share, _ = agreement(modes_plant, LoopOptions(hold="stepped", v_gain=1.0))
    assert share < AGREEMENT - 0.1


def test_torque_gain_is_what_a_slope_of_the_friction_does(plant: Plant) -> None:
    options = LoopOptions(hold="stepped", torque_gain=(0.2585, 1.0231))
    loop = tuned_loop(plant, "two-loop", options)
    assert simulated_growth(plant, loop, options) == pytest.approx(loop.growth_rate, rel=GROWTH)
    assert abs(loop.growth_rate / tuned_loop(plant, "two-loop").growth_rate - 1) > 10 * GROWTH


def test_a_beam_without_damping_keeps_the_reflected_tips_own_swing(plant: Plant) -> None:
    """The reflected tip held still leaves the beam a swing at 13.8 rad/s that nothing damps."""
    swing = tuned_loop(plant, "circle").poles[0]
    assert np.angle(swing) / PERIOD == pytest.approx(13.8, abs=0.1)
    assert abs(math.log(abs(swing)) / PERIOD) < 0.01


def test_small_signal_friction() -> None:
    assert small_signal(Friction("none")) == ((1.0, 1.0), (0.0, 0.0))
    assert small_signal(Friction("jump")) == ((0.2585, 1.0231), (0.0, 0.0))
    assert small_signal(Friction("opposing")) == ((1.0, 1.0), (0.2585, 1.0231))


def test_a_textbook_pd_of_both_joints_is_stable(plant: Plant) -> None:
    pair = (textbook_pid(50.0, 0.0, 8.0, PERIOD), textbook_pid(1.0, 0.0, 0.1, PERIOD))
    assert spectral_radii(plant, POSE, stack([pair], PERIOD), AS_SIMULATED)[0] < 1


def test_map_holds_the_controller_it_was_made_for(modes_plant: AssumedModesPlant) -> None:
    found = stability_map(modes_plant, TRIAL["circle"], 0, POSE, AS_SIMULATED, 5)
    assert found.growth.shape == (5, 5)
    assert found.own == pytest.approx((8660.0, 0.06911))
    assert np.diff(np.log(found.k)) == pytest.approx(np.full(4, math.log(100) / 4))


def test_a_maps_line_parts_what_holds_from_what_does_not() -> None:
    """Along the sides of the cells, each once; none about a map that holds everywhere."""
    held = np.array([[True, False, False], [True, True, False]])
    x, y = np.arange(4.0), np.arange(3.0)
    sides = {tuple(map(tuple, each.tolist())) for each in outline(x, y, held)}
    assert sides == {((1, 0), (1, 1)), ((2, 1), (2, 2)), ((1, 1), (2, 1))}
    assert outline(x, y, np.ones_like(held)) == []


def test_study_writes_a_run_that_explains_itself(quick: Callable[[str], QuickRun]) -> None:
    run = quick("stability")
    assert [row["plant"] for row in run.content["rows"]] == ["exact", "assumed-modes", "chain"]
    names = ("exact", "assumed-modes", "chain")
    assert run.figures == {f"stable_{name}.png" for name in names}
    assert run.faults() == []
    tables = {"results.csv", "screens.csv", "zeros.csv"}
    assert run.files == {"config.json", "tables.json", "figures"} | tables
    screens = run.content["screens"]
    assert [each["draws"] for each in screens] == [20, 20]
    for each in screens:
        for name, count in (("stable_share", each["draws"]), ("agreement", each["compared"])):
            ends = share_interval(round(each[name] * count), count)
            assert (each[f"{name}_low"], each[f"{name}_high"]) == ends
    assert "Of the exact beam 1 of 1 loops do not grow, 0 without damping." in run.text
    assert "2 of 2 loops grow by no more than 0.05 1/s" in run.text


def test_rows_say_what_a_loop_bears(quick: Callable[[str], QuickRun]) -> None:
    exact, modes, chain = quick("stability").content["rows"]
    for row in (exact, modes, chain):
        assert row["growth"] == pytest.approx(-0.0121, abs=1e-4)
        assert row["fastest_hz"] == pytest.approx(2.227, abs=1e-3)
        assert row["delay_margin"] == pytest.approx(1.1e-4, rel=0.1)
        highs = [row[f"gain_high_{way}"] for way in ("1", "2", "both")]
        assert row["gain_margin"] == min(highs) == pytest.approx(1.32, abs=0.05)
        assert row["gain_margin_low"] == 0
    assert exact["growth_undamped"] == pytest.approx(1.5, abs=0.1)
    assert exact["growth_stepped"] is None and exact["growth_simulated"] is None
    assert modes["growth_undamped"] < 0 and chain["growth_undamped"] < 0  # their steps damp it


def test_the_slow_pole_is_drawn_to_the_mirrored_tips_zero(
    quick: Callable[[str], QuickRun],
) -> None:
    rows = quick("stability").content["zeros"]
    ours = [row for row in rows if row["controllers"] == "ideal-line"]
    assert [row["factor"] for row in ours] == [0.3, 1.0, 3.0]
    for below, above in pairwise(ours):
        ratio = above["factor"] / below["factor"]
        for item in ("apart", "seen"):  # both as the gain's inverse
            assert below[item] / above[item] == pytest.approx(ratio, rel=0.05)
    assert all(row["zero_hz"] == pytest.approx(2.25517, abs=1e-5) for row in rows)
    little = next(row for row in rows if row["controllers"].startswith("PD"))
    assert little["apart"] > 1 and little["pole_decay"] > 100 * little["zero_decay"]
    assert "2.255 Hz" in quick("stability").text


def test_draws_of_table_1_have_their_pole_there() -> None:
    found = zero_rows(Parameters(), POSE, [], LoopOptions(), 500, 1)
    draws = [row for row in found if row.controllers.startswith("draw")]
    assert draws
    for row in draws:
        assert row.growth <= 0 and row.apart < 0.5 and row.seen < 0.15
        assert row.pole_hz == pytest.approx(row.zero_hz, rel=0.05)


def test_both_are_the_stepped_ones() -> None:
    config = StabilityConfig(
        plant="both", theta2=(POSE,), controllers=("ideal-line",), map_points=0
    )
    found = run(replace(config, zero_draws=0))
    assert [row.plant for row in found.rows] == ["assumed-modes", "chain"]
    exact = run(replace(config, plant="exact", zero_draws=0, hardware="bench")).rows[0]
    assert exact.growth > 40 and exact.delay_margin == 0 and exact.gain_margin == 1
    assert not exact.stable and exact.hold == "exact"


@pytest.mark.parametrize("setting_name", ["simulink", "jump", "opposing", "reconstructed"])
def test_every_setting_can_be_asked_for(setting_name: str) -> None:
    config = StabilityConfig(
        setting=setting_name, plant="assumed-modes", theta2=(POSE,), controllers=("figure-5",)
    )
    row = run(replace(config, map_points=0, zero_draws=0)).rows[0]
    assert row.growth_stepped is not None and math.isfinite(row.growth_stepped)
    assert row.growth_simulated == pytest.approx(row.growth_stepped, rel=GROWTH)


def test_a_runs_loop_has_its_own_period_and_v(
    tuned_otherwise: Path, modes_plant: AssumedModesPlant
) -> None:
    """Beside one of ours; the zero is of loops that mirror the tip alone."""
    names = ("line", str(tuned_otherwise))
    config = StabilityConfig(plant="assumed-modes", theta2=(POSE,), controllers=names)
    found = run(replace(config, map_points=3, zero_draws=0))
    ours, row = found.rows
    assert (ours.controllers, row.controllers) == ("line", "run otherwise")
    own = LoopOptions(2e-3, 0.0, hold="stepped")
    filters = found_in(tuned_otherwise).filters(2e-3)
    loop = linear_loop(modes_plant, POSE, stack([filters], 2e-3), own)
    assert row.growth_stepped == loop.growth_rate
    assert row.growth_simulated == pytest.approx(loop.growth_rate, rel=GROWTH)
    assert {each.controllers for each in found.zeros} == {"line", "PD of little gain"}
    assert [each.controllers for each in found.maps] == ["line"] * 2 + ["run otherwise"] * 2
    assert found.given == [found_in(tuned_otherwise).facts]


def test_the_map_of_a_run_is_of_its_own_filters(
    tuned: Path, tuned_otherwise: Path, modes_plant: AssumedModesPlant
) -> None:
    """In its middle, at a gain and an order of its own; as of ours where the filters are (2)."""
    for folder, period, v_gain in ((tuned, 1e-3, -1.0), (tuned_otherwise, 2e-3, 0.0)):
        found, own = found_in(folder), LoopOptions(period, v_gain, hold="stepped")
        shown = stability_map(modes_plant, found, 1, POSE, own, 5)
        assert shown.own == tuple(found.parameters[5:7])
        parameters = found.parameters.copy()
        parameters[5:7] = shown.k[2], shown.nu[2]
        (filters,) = found.tuning.design.filters(parameters[None])
        radii = spectral_radii(modes_plant, POSE, stack([filters], period), own)
        assert shown.growth[2, 2] == pytest.approx(growth_rates(radii, period)[0], rel=CLOSED_FORM)
        if period == PERIOD:
            halves = (found.parameters[:5], found.parameters[5:])
            ours = Controller("", *(Gains.from_milliseconds(*half) for half in halves), "")
            other = stability_map(modes_plant, ours, 1, POSE, own, 5)
            assert np.allclose(other.growth, shown.growth, rtol=1e-6)


def test_a_textbook_pid_has_no_orders_to_map(tuned: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(tuned, tmp_path / "pid"))
    content = json.loads((folder / "config.json").read_text())
    content["configuration"] |= {"controller": "pid", "realisation": "textbook"}
    (folder / "config.json").write_text(json.dumps(content))
    config = StabilityConfig(plant="assumed-modes", theta2=(POSE,), controllers=(str(folder),))
    found = run(replace(config, map_points=3, zero_draws=0))
    assert len(found.rows) == 1 and found.maps == []


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("--controllers lines", "lines"),
        ("--controller no/such/run", "not a run of flexsim tune"),
        ("--trajectory square", "square"),
        ("--plant beam", "beam"),
        ("--setting wet", "wet"),
        ("--hold euler", "euler"),
        ("--map-points 1", "map points"),
        ("--zero-draws -1", "zero-draws"),
        ("--screen -1", "screen"),
        ("--plant exact:5", "exact"),
        ("--slack -1", "slack"),
        ("--theta2 nan", "theta2"),
        ("--theta2 1 --trajectory circle", "contradict"),
        ("--torque-gain 0 1", "torque gain"),
        ("--torque-gain 1 inf", "torque gain"),
    ],
)
def test_a_wrong_option_is_one_line_and_leaves_nothing(
    words: str, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    assert main(["stability", *words.split(), "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert named in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_loops_that_cannot_be_built_are_refused(modes_plant: AssumedModesPlant) -> None:
    with pytest.raises(ParameterError, match="2 controllers are given"):
        linear_loop(modes_plant, POSE, around_stability(2, seed=1))
    with pytest.raises(ParameterError, match="joint"):
        margins(tuned_loop(modes_plant, "line"), 2)
    with pytest.raises(ParameterError, match="torque gain"):
        LoopOptions(torque_gain=(math.nan, 1.0))
