"""The main study's parts: which cases, whose perturbations, what counts, and the same numbers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from controllers import TABLE_2, TUNED, Controller
from flexsim import FlexsimError, Parameters
from flexsim.loop.trajectories import TRAJECTORIES, trajectory
from studies.compare.compare import (
    CompareConfig,
    Task,
    plants_of,
    run,
    run_task,
    summary,
    tasks,
    tip_difference,
)
from studies.compare.report import Comparison, print_report, verdict
from studies.core.repeats import PERTURBATION, perturbed

PAIRS = [("line", "line"), ("two-loop", "two-loop"), ("circle", "circle"), ("line", "two-loop")]
FIGURES = {"line": "figure-3", "two-loop": "figure-4", "circle": "figure-5"}
PLANTS = ("assumed-modes", "chain")
SPREAD = 0.1  # relative: of a standard deviation over 1200 draws, five times its own
FEW = CompareConfig(perturbations=2)
DEFLECTION = 0.25  # [m] the loop stops a run whose v is half the beam's length
MEDIAN_DIGITS = 1e-15  # relative: of the mean of two numbers


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    return run(FEW)


def gains(controller: Controller) -> np.ndarray[Any, Any]:
    joints = (controller.joint1, controller.joint2)
    return np.array([(joint.k1, joint.k2, joint.k3) for joint in joints])


def named(name: str, config: CompareConfig = FEW) -> Task:
    (task,) = (each for each in tasks(config) if each.name == name)
    return task


def test_cases_are_the_papers_three_and_figure_6() -> None:
    found = [(task.label, task.trajectory.name, task.setting) for task in tasks(CompareConfig())]
    assert found == [
        *((f"tuned {devised}", path, "print") for path, devised in PAIRS),
        *((f"Table 2 {devised}", path, "reconstructed") for path, devised in PAIRS),
    ]
    for task, (path, devised) in zip(tasks(FEW), PAIRS * 2, strict=True):
        ours = task.setting == "print"
        assert task.controller == (TUNED[devised] if ours else TABLE_2[FIGURES[devised]])
        assert task.trajectory == (TRAJECTORIES[path] if ours else trajectory(path, True))


def test_configuration_reaches_the_cases() -> None:
    small = replace(TRAJECTORIES["circle"], half_width=0.05)
    found = tasks(CompareConfig(circle=small, setting="joint"))
    assert [task.setting for task in found] == ["joint"] * 4 + ["reconstructed"] * 4
    assert found[2].trajectory is small
    modes, chain = plants_of(CompareConfig(modes=2, segments=4, step=5e-4), "reconstructed")
    assert (modes.modes, modes.step, chain.chain.model.nv, chain.step) == (2, 5e-4, 6, 1e-3)
    assert modes.parameters.I_m2 == chain.parameters.I_m2 == 0.0557  # the fit's motor
    assert chain.chain.model.joint("joint2").armature[0] == 0.0557
    assert plants_of(FEW, "print")[0].parameters == Parameters()


def test_sixteen_rows_in_pairs(comparison: Comparison) -> None:
    rows = comparison.rows
    assert len(rows) == 16
    for row, name in zip(rows, PLANTS * 8, strict=True):
        assert row["plant"] == name
        assert row["diverged"] is False
        assert 0 < row["rms_error"] <= row["max_error"]
        assert 0 < row["envelope"] and 0 < row["max_v"] < DEFLECTION
        assert row["runs"] == 2
        assert row["envelope_quartile_1"] <= row["envelope"] <= row["envelope_quartile_3"]
    for first, second in zip(rows[::2], rows[1::2], strict=True):
        assert [first[key] for key in ("controllers", "trajectory", "setting")] == [
            second[key] for key in ("controllers", "trajectory", "setting")
        ]
        assert first["tip_difference"] == second["tip_difference"] > 0
        assert first["envelope"] != second["envelope"]


def test_a_case_per_pair_of_rows(comparison: Comparison) -> None:
    assert [case.name for case in comparison.cases] == [task.name for task in tasks(FEW)]
    for case in comparison.cases:
        assert tuple(case.motions) == PLANTS
        for motion in case.motions.values():
            assert motion.diverged is None
            assert motion.time[1] == pytest.approx(5e-3, rel=1e-12)  # thinned to 200 Hz
    assert sorted(comparison.mjcf) == ["chain_print.xml", "chain_reconstructed.xml"]
    for text in comparison.mjcf.values():
        assert mujoco.MjModel.from_xml_string(text).nv == 8


def test_report_has_every_row(comparison: Comparison, capsys: pytest.CaptureFixture[str]) -> None:
    print_report(comparison, Path("runs/x"))
    text = capsys.readouterr().out
    assert text.count("8 of 8 hold") == 2
    assert text.count("line by two-loop") == 2
    for modes, chain in zip(comparison.rows[::2], comparison.rows[1::2], strict=True):
        assert f"{1e3 * modes['envelope']:.1f} | {1e3 * chain['envelope']:.1f}" in text
    assert "flexsim view runs/x" in text


@pytest.mark.parametrize("plant", [0, 1])
@pytest.mark.parametrize("name", ["tuned_line", "table2_line"])
def test_rows_do_not_depend_on_threads(name: str, plant: int, comparison: Comparison) -> None:
    task = named(name)
    alone = replace(FEW, threads=1)
    row, motion = run_task(task, plants_of(alone, task.setting)[plant], alone)
    known = next(case for case in comparison.cases if case.name == name).motions[PLANTS[plant]]
    np.testing.assert_array_equal(motion.state, known.state)
    place = 2 * [each.name for each in tasks(FEW)].index(name) + plant
    assert {**row, "tip_difference": comparison.rows[place]["tip_difference"]} == (
        comparison.rows[place]
    )


def test_the_seed_moves_medians_and_nothing_else() -> None:
    """The nominal motion knows nothing of it."""
    other = replace(FEW, seed=2)
    for name, moves in (("table2_circle", True), ("tuned_circle", True)):
        task = named(name)
        plant = plants_of(FEW, task.setting)[0]
        (first, seen), (second, again) = (run_task(task, plant, each) for each in (FEW, other))
        assert (first["envelope"] != second["envelope"]) is moves
        np.testing.assert_array_equal(seen.state, again.state)


def test_perturbations_change_the_fourth_digit() -> None:
    controller = TABLE_2["figure-3"]
    shaken = perturbed(controller, 200, np.random.default_rng(1))
    assert len(shaken) == 200
    used = gains(controller) != 0
    ratios = np.array([gains(each)[used] / gains(controller)[used] - 1 for each in shaken])
    assert np.std(ratios) == pytest.approx(PERTURBATION, rel=SPREAD)
    assert abs(np.mean(ratios)) < SPREAD * PERTURBATION * 2
    assert (np.abs(np.corrcoef(ratios.T) - np.eye(ratios.shape[1])) < 0.4).all()  # each its own
    again = perturbed(controller, 200, np.random.default_rng(1))
    assert [gains(each).tolist() for each in again] == [gains(each).tolist() for each in shaken]
    for each in shaken[:3]:  # orders and lengths stay
        same = replace(
            each,
            joint1=replace(each.joint1, **_gains_of(controller.joint1)),
            joint2=replace(each.joint2, **_gains_of(controller.joint2)),
        )
        assert same == controller


def _gains_of(joint: Any) -> dict[str, float]:
    return {name: getattr(joint, name) for name in ("k1", "k2", "k3")}


def outcome(envelope: float | None, diverged_at: float | None = None) -> dict[str, Any]:
    shared = dict.fromkeys(("max_error", "rms_error", "max_v", "residual_v", "index"), envelope)
    return shared | {
        "envelope": envelope,
        "diverged": diverged_at is not None,
        "diverged_at": diverged_at,
    }


def test_summary_of_known_runs() -> None:
    found = summary([outcome(0.01 * k) for k in (4, 1, 2, 5, 3)])
    assert found["envelope"] == found["max_v"] == 0.03
    assert (found["envelope_quartile_1"], found["envelope_quartile_3"]) == (0.02, 0.04)
    assert (found["runs"], found["diverged"], found["diverged_share"]) == (5, False, 0.0)
    assert found["diverged_at"] is None


def test_a_diverged_run_is_never_a_success() -> None:
    """It takes no part in the medians, and the case says that it happened, and when first."""
    found = summary([outcome(0.01), outcome(None, 1.5), outcome(0.03), outcome(None, 0.5)])
    assert found["envelope"] == pytest.approx(0.02, rel=MEDIAN_DIGITS)
    assert found["diverged"] is True
    assert (found["diverged_share"], found["diverged_at"]) == (0.5, 0.5)
    lost = summary([outcome(None, 0.25)])
    assert lost["envelope"] is lost["envelope_quartile_1"] is lost["max_v"] is None
    assert lost["diverged_share"] == 1.0


@pytest.mark.parametrize("plant", [0, 1])
def test_an_unstable_controller_is_reported_as_diverged(
    plant: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    task = named("tuned_circle")
    wild = replace(
        task.controller,
        joint1=replace(task.controller.joint1, k1=-1e3 * task.controller.joint1.k1),
    )
    row, motion = run_task(replace(task, controller=wild), plants_of(FEW, task.setting)[plant], FEW)
    assert row["diverged"] is True and row["envelope"] is None
    assert motion.diverged is not None and 0 < row["diverged_at"] == motion.diverged < 5
    assert np.isfinite(motion.tip).all()
    assert capfd.readouterr() == ("", "") and not list(tmp_path.iterdir())


def test_verdict_counts_and_compares() -> None:
    given = [(False, 0.010), (False, 0.012), (False, 0.020), (True, None)]
    rows: list[dict[str, Any]] = [
        {"plant": plant, "diverged": diverged, "envelope": envelope}
        for plant, (diverged, envelope) in zip(["assumed-modes", "chain:8"] * 2, given, strict=True)
    ]
    assert verdict(rows) == (
        "3 of 4 hold; envelopes of the chain 8 are 1.20 to 1.20 times those of the assumed modes."
    )
    assert verdict(rows[2:]).startswith("1 of 2 hold; envelopes of the chain 8 are an unknown")


def test_tip_difference_is_over_what_both_ran() -> None:
    def motion(*tips: tuple[float, float]) -> Any:
        return SimpleNamespace(time=np.arange(len(tips)), tip=np.reshape(tips, (-1, 2)))

    first = motion((0.0, 0.0), (1.0, 0.0), (9.0, 9.0))
    assert tip_difference(first, motion((3.0, 4.0), (1.0, 0.0))) == np.sqrt(25 / 2)
    assert tip_difference(first, motion()) is None


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"perturbations": 0}, "perturbations is 0; give 1 or more"),
        ({"seed": -1}, "seed is -1; give 0 or more"),
        ({"setting": "ice"}, "setting 'ice' is unknown; choose one of none, print"),
        ({"period": 1.5e-3}, r"period 0\.0015 s is not a whole multiple of the physics step 0\.00"),
        ({"period": 1e-9}, "1e-09 s is not a whole multiple"),  # before memory runs out
        ({"period": float("nan")}, "control period nan s"),
        ({"chain_step": 5e-3}, r"timestep 0\.005 s is too long for RK4"),
        ({"step": 0.02}, r"physics step 0\.02 s is too long for RK4 with 3 modes"),
        ({"segments": 2}, "segments is 2; give a whole number from 3 to 16"),
        ({"line": replace(TRAJECTORIES["line"], end=(2.0, 2.0))}, "'line'.*out of reach"),
        ({"robot": Parameters(L=0.2, EI=0.005)}, "out of reach"),
    ],
)
def test_what_cannot_run_is_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(FlexsimError, match=words):
        run(replace(FEW, **wrong))
