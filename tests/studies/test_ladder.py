"""The ladder: orders of convergence, who is nearer, the Pareto front, the integrators' theory."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from quick_run import QuickRun

from controllers import TUNED_IDEAL
from flexsim import Parameters, setting
from flexsim.arm.chain_design import design_chain
from flexsim.arm.free_arm import clamped_frequencies
from flexsim.arm.parameters import paper
from flexsim.loop.runs import measure
from flexsim.loop.trajectories import reference, trajectory
from flexsim.mjcf.chain_file import ChainModel, highest_frequency, longest_step
from flexsim.mjcf.edits import stepped
from flexsim.plants.chain_plant import ChainPlant
from flexsim.robot import Robot
from studies.core.evidence.intervals import median_interval
from studies.core.evidence.repeats import medians, perturbed
from studies.ladder.integrators import exact_rates, frequencies, modal_figures
from studies.ladder.ladder import QUICK_RUNGS, LadderConfig, extrapolated, run, rungs, tracking
from studies.ladder.report import cheapest, front, tables, verdict
from studies.ladder.rows import Converged, LadderResult, PlantRow, Tips
from studies.main import main

ROOT = Path(__file__).parents[2]
KEYS = (
    "plant step clamped_hz joint_free_hz tip_small tip_large us_per_ms pareto_small envelope "
    "envelope_low envelope_high runs diverged_share diverged_share_low diverged_share_high"
)
STEPS = np.array([2.5e-4, 5e-4, 1e-3])  # [s] where mode 3 is resolved and its damping no rounding
ORDER = 0.1  # of a fitted order: the next term of the series at omega step = 0.37


@pytest.fixture
def ladder(quick: Callable[[str], QuickRun]) -> QuickRun:
    return quick("ladder")


@pytest.fixture
def content(ladder: QuickRun) -> dict[str, Any]:
    """What `flexsim ladder --quick --json` prints."""
    return ladder.content


def row_of(content: dict[str, Any], plant: str) -> dict[str, Any]:
    (row,) = (row for row in content["rows"] if row["plant"] == plant)
    return row


def order(sizes: Any, errors: Any) -> float:
    return float(np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0])


def test_rows_are_the_rungs(ladder: QuickRun, content: dict[str, Any]) -> None:
    assert [row["plant"] for row in content["rows"]] == list(QUICK_RUNGS)
    for row in content["rows"]:
        assert set(KEYS.split()) <= set(row)
        assert 0 < row["tip_small"] < row["tip_large"] <= row["peak_large"]
        assert row["us_per_ms"] > 0
        assert row["runs"] == 2 and row["envelope"] > 0 == row["diverged_share"]
        assert row["envelope_low"] is None  # of two runs there is no interval
    assert row_of(content, "rigid")["clamped_hz"] == [None] * 3
    assert ladder.files == {"config.json", "tables.json", "figures", "integrators.csv", "rows.csv"}
    assert ladder.figures == {"cost_accuracy.png", "integrators.png"}
    assert ladder.faults() == []


def test_the_reference_is_finer_than_what_is_held_against_it(content: dict[str, Any]) -> None:
    for torque, doubt in content["reference"]["uncertainty"].items():
        assert 0 < doubt < min(row[f"tip_{torque}"] for row in content["rows"])


def test_unfitted_chains_converge_with_order_two(content: dict[str, Any]) -> None:
    sizes = np.array([8, 16, 32])
    exact = clamped_frequencies(Parameters(), 3) / (2 * np.pi)
    found = np.array(
        [frequencies(Robot(paper()).plant(f"untuned:{n}", chain_step=2e-5))[0] for n in sizes]
    )
    for errors in (found / exact - 1).T:
        assert order(sizes, errors) == pytest.approx(-2, abs=ORDER)
    tips = [row_of(content, f"untuned:{n}")["tip_small"] for n in (6, 8, 10)]
    assert order([6, 8, 10], tips) == pytest.approx(-2, abs=0.2)  # 6 is few


def test_a_moment_at_the_tip_turns_a_chain_by_the_sum_of_its_springs(
    content: dict[str, Any],
) -> None:
    """Of N hinges with EI/h: L/EI if h is L/N, N/(N+1) of it if h is L/(N+1)."""
    assert row_of(content, "untuned:6")["rotation_error"] == pytest.approx(0.0, abs=1e-10)
    assert row_of(content, "rule-of-thumb:6")["rotation_error"] == pytest.approx(-1 / 7, rel=1e-9)
    assert abs(row_of(content, "chain:6")["rotation_error"]) < 3e-3
    assert row_of(content, "rigid")["rotation_error"] is None


def test_a_payload_is_as_the_chain_design_has_it(content: dict[str, Any]) -> None:
    """MuJoCo has compiled what the chain's closed form says; the rule of thumb is 40 % off."""
    p = paper()
    laden = replace(p, payload=p.m_b, payload_inertia=0.04 * p.m_b * p.L**2)
    for n in (4, 6):
        found = row_of(content, f"chain:{n}")["loaded_error"]
        np.testing.assert_allclose(found, design_chain(laden, n).loaded_error, atol=1e-9)
    errors = [row_of(content, name)["loaded_error"] for name in ("untuned:6", "rule-of-thumb:6")]
    np.testing.assert_allclose(errors[0], [0.0035, 0.0079, 0.0389], atol=1e-4)
    np.testing.assert_allclose(errors[1], [0.1225, 0.1877, 0.4053], atol=1e-4)
    assert row_of(content, "assumed-modes:3")["loaded_error"] == pytest.approx([0.0] * 3, abs=1e-9)
    for name in ("rigid", "printed:3", "rod"):
        assert row_of(content, name)["loaded_error"] == [None] * 3


def test_extrapolation_is_exact_for_a_square_law() -> None:
    coarse, fine = (np.array([[3.0, -1.0]]) + np.array([[0.5, 2.0]]) / n**2 for n in (28, 40))
    np.testing.assert_allclose(extrapolated(coarse, fine, 40 / 28), [[3.0, -1.0]], rtol=1e-12)


@pytest.mark.parametrize(
    ("nearer", "farther"),
    [
        ("assumed-modes:1", "rigid"),
        ("assumed-modes:3", "assumed-modes:1"),
        ("assumed-modes:3", "printed:3"),
        ("chain:6", "chain:4"),
        ("chain:6", "untuned:6"),
        ("chain:6", "rod"),
        ("untuned:6", "rule-of-thumb:6"),
    ],
)
def test_who_is_nearer(content: dict[str, Any], nearer: str, farther: str) -> None:
    for torque in ("tip_small", "tip_large"):
        assert 2 * row_of(content, nearer)[torque] < row_of(content, farther)[torque]


def test_the_front_holds_no_beaten_row(content: dict[str, Any]) -> None:
    for torque in ("small", "large"):
        best = [row for row in content["rows"] if row[f"pareto_{torque}"]]
        assert best
        for row in best:
            for other in content["rows"]:
                cheaper = other["us_per_ms"] < row["us_per_ms"]
                assert not (cheaper and other[f"tip_{torque}"] < row[f"tip_{torque}"])


def test_front_by_hand() -> None:
    assert front([1, 2, 3, 2, 4], [9, 5, 5, 6, np.inf]) == [True, True, False, False, False]
    assert front([1, 1], [2, 2]) == [True, True]  # equal rows do not beat each other


def test_cheapest_by_hand() -> None:
    rows = [
        SimpleNamespace(us_per_ms=cost, tip_small=tip)
        for cost, tip in ((3, 1e-4), (5, 1e-6), (1, None))
    ]
    assert cheapest(rows, "small", 1e-3) == rows[0]
    assert cheapest(rows, "small", 1e-5) == rows[1]
    assert cheapest(rows, "small", 1e-7) is None


@pytest.fixture(scope="module")
def chain_plant() -> ChainPlant:
    """Return the default chain without damping, as the ladder has it."""
    return ChainPlant.designed(paper())


def mode_3(chain: ChainModel, integrator: str) -> tuple[np.ndarray, np.ndarray]:
    """Shifts and damping ratios of mode 3 at STEPS."""
    figures = [modal_figures(stepped(chain, integrator, step)) for step in STEPS]
    return tuple(  # type: ignore[return-value]
        np.array([getattr(each, name)[2] for each in figures])
        for name in ("frequency_shift", "damping_ratio")
    )


def test_rk4_shifts_and_damps_as_its_theory_says(chain_plant: ChainPlant) -> None:
    shift, damping = mode_3(chain_plant.chain, "RK4")
    z = exact_rates(chain_plant.chain)[2].imag * STEPS
    np.testing.assert_allclose(shift, -(z**4) / 120, rtol=0.1)  # next term: z^2/2 of it
    np.testing.assert_allclose(damping, z**5 / 144, rtol=0.1)
    assert order(STEPS, shift) == pytest.approx(4, abs=ORDER)
    assert order(STEPS, damping) == pytest.approx(5, abs=ORDER)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_euler_shifts_and_damps_nothing(chain_plant: ChainPlant, integrator: str) -> None:
    shift, damping = mode_3(chain_plant.chain, integrator)
    z = exact_rates(chain_plant.chain)[2].imag * STEPS
    np.testing.assert_allclose(shift, z**2 / 24, rtol=0.02)
    assert order(STEPS, shift) == pytest.approx(2, abs=ORDER)
    assert np.abs(damping).max() < 1e-9


def test_discrete_damps_strongly(chain_plant: ChainPlant) -> None:
    _, damping = mode_3(chain_plant.chain, "discrete")
    z = exact_rates(chain_plant.chain)[2].imag * STEPS
    np.testing.assert_allclose(damping, z / 2, rtol=0.05)
    assert damping[-1] > 0.15


def test_limits_of_stability_are_those_of_the_map(chain_plant: ChainPlant) -> None:
    """The map has its hub locked, `longest_step` joints free, which swing faster by under 5 %."""
    chain = chain_plant.chain
    for integrator, limit in (("RK4", 2.828), ("Euler", 2.0), ("implicitfast", 2.0)):
        radius = [
            modal_figures(stepped(chain, integrator, part * limit / highest_frequency(chain.model)))
            for part in (0.98, 1.06)
        ]
        assert radius[0].radius < 1 + 1e-8 < radius[1].radius
    assert longest_step(stepped(chain, "discrete", 1e-3).model) is None
    assert modal_figures(stepped(chain, "discrete", 2e-2)).radius < 1


def test_unstable_steps_are_rows(content: dict[str, Any]) -> None:
    rows = {(row["integrator"], row["step"]): row for row in content["integrators"]}
    assert len(rows) == 4 * 3
    for name in ("Euler", "implicitfast"):
        row = rows[name, 2e-3]
        assert not row["stable"] and row["radius"] > 1
        assert row["tip_small"] is row["energy_drift"] is row["us_per_ms"] is None
    held = rows["RK4", 1e-3]
    assert held["stable"] and held["energy_drift"] < 1e-8 and held["tip_large"] < 1e-6
    assert rows["Euler", 2.5e-4]["tip_large"] > 100 * held["tip_large"]


def test_a_file_is_held_against_itself(chain_plant: ChainPlant) -> None:
    robot = Robot.of(ROOT / "models/chain4.xml")
    names = rungs(robot, quick=False)
    assert names == (
        *("rigid", "assumed-modes:1", "assumed-modes:2", "assumed-modes:3", "assumed-modes:4"),
        *("printed:3", "chain"),
    )
    result = run(LadderConfig(quick=True, mjcf=ROOT / "models/chain4.xml", rounds=1))
    assert tuple(row.plant for row in result.rows) == names
    rows = {row.plant: row.tips.tip_small for row in result.rows}
    assert result.reference.uncertainty["small"] < rows["chain"] < 1e-6  # its step of 1 ms
    assert rows["chain"] < rows["assumed-modes:3"] < rows["assumed-modes:1"] < rows["rigid"]
    assert "1 mm: " in verdict(result)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--rounds", "0"], "rounds is 0; give 1 or more"),
        (["--threads", "0"], "threads is 0; give 1 to"),
        (["--mjcf", "nowhere.xml"], "nowhere.xml: cannot read the MJCF file"),
        (["--beam", "analytic"], "--beam analytic has no effect without --mjcf"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    assert main(["ladder", "--quick", "--out", str(out), *arguments]) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and words in shown.err and len(shown.err.splitlines()) == 1
    assert not out.exists()


def test_a_loop_is_a_median_of_runs_with_its_interval() -> None:
    plant = Robot(paper()).plant("assumed-modes:1")
    found = tracking(plant, setting("simulink"), None, 10)
    assert found.runs == 10 and found.envelope and found.envelope_low and found.envelope_high
    assert found.envelope_low <= found.envelope <= found.envelope_high
    shaken = perturbed(TUNED_IDEAL["circle"], 10, np.random.default_rng(1))
    ref = reference(trajectory("circle"), plant.parameters)
    widths = [each["envelope"] for each in measure(plant, setting("simulink"), ref, shaken)]
    assert (found.envelope_low, found.envelope_high) == median_interval(widths)


def test_loops_that_are_lost_are_a_share() -> None:
    runs = [{"envelope": 1e-2 + i * 1e-5, "diverged": False, "diverged_at": None} for i in range(7)]
    lost = [{"envelope": None, "diverged": True, "diverged_at": 0.5 + i} for i in range(3)]
    rows = [
        PlantRow(name, 1e-3, np.zeros(3), np.zeros(3), Tips(0.0, 0.0, 0.0, 0.0), medians(some))
        for name, some in (("rigid", [*runs, *lost]), ("rod", runs), ("chain:4", lost))
    ]
    shown = LadderResult(rows, [], Converged("none", {}, {}, np.zeros(3), np.zeros(3)))
    words = verdict(shown)
    assert "median envelopes from 10.0 to 10.0 mm" in words
    assert "rigid: 30 % [11, 60] of 10 diverged" in words and "rod:" not in words
    assert "chain:4: 100 % [44, 100] of 3 diverged" in words
    cells = [tables(shown)[1].cells([row])[2] for row in rows]
    assert cells == ["10.0 [10.0, ?]", "10.03 [10.00, 10.06]", "lost, 0.50 s"]


def test_exudyn_has_rungs_if_asked_for() -> None:
    usual = rungs(Robot(), quick=True)
    assert rungs(Robot(), quick=True, exudyn=True) == (*usual, "exudyn:4")
    assert not any("exudyn" in name for name in (*usual, *rungs(Robot(), quick=False)))
