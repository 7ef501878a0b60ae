"""The main study's parts: which cases, whose perturbations, what counts, and the same numbers."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from quick_run import QuickRun

from controllers import TABLE_2, TUNED, TUNED_IDEAL, Controller
from flexsim import FlexsimError, Parameters, Robot, closed_loop, measure
from flexsim.loop.hardware import HARDWARE, Hardware
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import TRAJECTORIES, trajectory
from studies.compare.compare import plants_of, run, run_task
from studies.compare.holding import holding_rows
from studies.compare.repeats import Batch, apart
from studies.compare.report import answer, group_verdict, tables, true_tip_rows, verdict
from studies.compare.rows import Against, CompareRow, Comparison
from studies.compare.tasks import CompareConfig, Task, hardware_name, tasks
from studies.core.evidence.check_sample import Check
from studies.core.evidence.holding import exact_numbers
from studies.core.evidence.repeats import PERTURBATION, medians, perturbed
from studies.main import main

kernels = pytest.mark.kernels  # run once more under another BLAS kernel


TRUE_TIP_SHARE = 0.2  # of the uncompensated envelope: the aim of the shaped references
PAIRS = [("line", "line"), ("two-loop", "two-loop"), ("circle", "circle"), ("line", "two-loop")]
FIGURES = {"line": "figure-3", "two-loop": "figure-4", "circle": "figure-5"}
PLANTS = ("assumed-modes", "chain")
ROUNDING = 1e-12  # relative: sums over samples in another order
SPREAD = 0.1  # relative: of a standard deviation over 1200 draws, five times its own
BOTH_SETS = ("ours", "table2")
BENCH = replace(HARDWARE["bench"], seed=1)
FEW = CompareConfig(perturbations=2, controllers=BOTH_SETS)
SHORT = replace(TRAJECTORIES["circle"], duration=1.5, hold=0.2)
DEFLECTION = 0.25  # [m] the loop stops a run whose v is half the beam's length


@pytest.fixture
def compared(quick: Callable[[str], QuickRun]) -> QuickRun:
    return quick("compare")


@pytest.fixture
def comparison(compared: QuickRun) -> Comparison:
    result: Comparison = compared.result
    return result


def gains(controller: Controller) -> np.ndarray[Any, Any]:
    joints = (controller.joint1, controller.joint2)
    return np.array([(joint.k1, joint.k2, joint.k3) for joint in joints])


def named(name: str, config: CompareConfig = FEW) -> Task:
    (task,) = (each for each in tasks(config) if each.name == name)
    return task


@kernels
def test_cases_are_the_papers_three_and_figure_6() -> None:
    every = CompareConfig(controllers=("ours", "ideal", "table2"))
    found = [(task.label, task.trajectory.name, task.setting) for task in tasks(every)]
    assert found == [
        *((f"tuned {devised}", path, "simulink") for path, devised in PAIRS),
        *((f"ideal {devised}", path, "simulink") for path, devised in PAIRS),
        *((f"Table 2 {devised}", path, "reconstructed") for path, devised in PAIRS),
    ]
    for task, (path, devised) in zip(tasks(every), PAIRS * 3, strict=True):
        of_paper = task.group == "table2"
        own = TUNED if task.group == "ours" else TUNED_IDEAL
        assert task.controller == (TABLE_2[FIGURES[devised]] if of_paper else own[devised])
        assert task.trajectory == (trajectory(path, True) if of_paper else TRAJECTORIES[path])
        assert task.hardware == (BENCH if task.group == "ours" else Hardware(seed=1))
    assert tasks(CompareConfig()) == [task for task in tasks(every) if task.group == "ours"]


@kernels
def test_hardware_that_is_named_is_everybodys() -> None:
    every = CompareConfig(controllers=("ours", "table2"), hardware="delayed", hardware_noise=1e-5)
    assert {task.hardware for task in tasks(every)} == {Hardware(1, noise_v=1e-5, seed=1)}
    assert {hardware_name(task.hardware) for task in tasks(every)} == {
        "delay of 1 sample, 0.01 mm rms of noise on v (seed 1)"
    }
    assert [hardware_name(each) for each in HARDWARE.values()] == list(HARDWARE)
    assert hardware_name(BENCH) == "bench"  # whatever the seed
    words = CompareConfig(controllers=("ours", "ideal")).hardware_words
    assert words.startswith("ours: delay of 1 sample") and words.endswith("; ideal: ideal")
    assert CompareConfig(controllers=("ideal", "table2")).hardware_words == "ideal"
    assert every.hardware_words == every.built.words()
    with pytest.raises(
        FlexsimError, match="'mine' is unknown; choose of ours, ideal, table2, line"
    ):
        tasks(CompareConfig(controllers=("mine",)))


@kernels
def test_one_of_a_set_is_run_on_every_trajectory() -> None:
    """As in its set, each case once."""
    found = tasks(CompareConfig(controllers=("ideal-circle", "figure-4")))
    assert [(each.label, each.trajectory.name, each.group, each.setting) for each in found] == [
        *(("ideal circle", path, "ideal", "simulink") for path in TRAJECTORIES),
        *(("Table 2 two-loop", path, "table2", "reconstructed") for path in TRAJECTORIES),
    ]
    assert {each.hardware for each in found} == {Hardware(seed=1)}
    both = tasks(CompareConfig(controllers=("circle", "ours")))
    names = [each.name for each in both]
    assert len(names) == len(set(names)) == 6 and names[:3] == [
        *("tuned_line_by_circle", "tuned_two-loop_by_circle", "tuned_circle"),
    ]


def test_a_run_is_a_group_of_its_own(tuned: Path, tuned_otherwise: Path, tmp_path: Path) -> None:
    """On every trajectory, with the hardware that it is for unless told otherwise."""
    found = tasks(CompareConfig(controllers=("ours", str(tuned))))[4:]
    assert [(each.label, each.trajectory.name, each.group, each.name) for each in found] == [
        ("run small circle", path, "run small", f"run_small_{path}") for path in TRAJECTORIES
    ]
    assert {(each.hardware, each.setting, each.holder) for each in found} == {
        (Hardware(seed=1), "simulink", "run small")
    }
    (bench,) = {
        each.hardware
        for each in tasks(CompareConfig(controllers=(str(tuned),), hardware="bench", seed=1))
    }
    assert bench == BENCH
    with pytest.raises(
        FlexsimError, match=r"0\.002 s, got 0\.001 s; give its own, with --period 0\.002"
    ):
        tasks(CompareConfig(controllers=(str(tuned_otherwise),)))
    copy = Path(shutil.copytree(tuned, tmp_path / "small"))
    names = [each.name for each in tasks(CompareConfig(controllers=(str(tuned), str(copy))))]
    assert len(set(names)) == 6


def test_the_hardware_of_a_run_is_the_last_that_it_was_tuned_with(
    tuned: Path, tmp_path: Path
) -> None:
    run = Path(shutil.copytree(tuned, tmp_path / "run"))
    content = json.loads((run / "config.json").read_text())
    content["configuration"] |= {"hardware": ["delayed", "bench", "ideal"], "hardware_counts": 99}
    (run / "config.json").write_text(json.dumps(content))
    config = CompareConfig(controllers=(str(run), "ideal"))
    assert config.built == replace(BENCH, counts=99)
    assert replace(config, hardware_counts=7).built == replace(BENCH, counts=7)
    assert config.hardware_words.endswith("; ideal: ideal")


def test_a_runs_loop_has_its_own_v(tuned_otherwise: Path) -> None:
    config = CompareConfig(
        controllers=(str(tuned_otherwise),), period=2e-3, perturbations=2, circle=SHORT
    )
    task = tasks(config)[2]
    plants = plants_of(config, task.setting)
    rows, found = run_task(task, plants, config)
    mine = perturbed(task.controller, 2, np.random.default_rng(config.seed))
    chosen = setting(task.setting, task.hardware)
    for row, each in zip(rows, found, strict=True):
        ref = each.stage.reference
        how = (each.stage.simulated, chosen, ref, [one.filters(2e-3) for one in mine])
        ignored, mirrored = (
            medians(measure(*how, SHORT.hold, v_gain=v_gain)) for v_gain in (0.0, -1.0)
        )
        assert row.found.envelope == pytest.approx(ignored.envelope, rel=ROUNDING)
        assert ignored.envelope != mirrored.envelope
        (shown,) = closed_loop(
            each.stage.plant, chosen, ref, [mine[row.shown - 1].filters(2e-3)], v_gain=0.0
        )
        np.testing.assert_array_equal(each.motion.v, shown.v)


PLAIN = pytest.param("mine", marks=pytest.mark.slow)  # the other is the harder one


@pytest.mark.parametrize("name", [PLAIN, "$x$ |*red*] \n '"])
def test_a_run_is_compared_by_the_command(
    name: str, tuned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever its folder is called: tables, figures and recording are written."""
    run, out = Path(shutil.copytree(tuned, tmp_path / name)), tmp_path / "out"
    words = ["compare", "--quick", "--controller", str(run), "--out", str(out)]
    assert main(words) == 0
    said = capsys.readouterr().out
    plain_name = "mine" if name == "mine" else "_x_ __red__ _ _"
    assert f"Controllers of run {plain_name}, tuned for the circle, setting simulink" in said
    figures = {path.name for path in (out / "figures").iterdir()}
    assert len(figures) == 3 * 4 + 1 and any(each.endswith("_two-loop.pdf") for each in figures)
    kept = json.loads((out / "config.json").read_text())
    assert kept["configuration"]["controllers"] == [str(run)]
    (given,) = kept["runs"]
    result = json.loads((run / "result.json").read_text())
    assert given["parameters"] == result["best_parameters"]
    assert given["trajectory"] == "circle" and (out / "run.rrd").stat().st_size > 10_000


def test_a_run_is_said_to_hold_or_not(tuned_otherwise: Path) -> None:
    """By its own loop, which ignores v, in the exact linear loop as in the runs."""
    config = CompareConfig(
        controllers=(str(tuned_otherwise),), period=2e-3, perturbations=1, circle=SHORT
    )
    task = tasks(config)[2]
    found = run_task(task, plants_of(config, task.setting)[:1] * 2, config)[1]
    mine = (task.trajectory, task.holder, task.controller, config.period, Robot())
    chosen = setting(task.setting, task.hardware)
    row = holding_rows(found, chosen, *mine)[0]
    own = exact_numbers(chosen, SHORT, task.controller, 2e-3, Robot(), v_gain=0.0)
    other = exact_numbers(chosen, SHORT, task.controller, 2e-3, Robot())
    assert (row.case, row.controllers) == ("circle by run otherwise", "run otherwise")
    assert row.holding.growth == own["growth"] != other["growth"]


@kernels
def test_configuration_reaches_the_cases() -> None:
    small = replace(TRAJECTORIES["circle"], half_width=0.05)
    found = tasks(CompareConfig(controllers=BOTH_SETS, circle=small, setting="opposing"))
    assert [task.setting for task in found] == ["opposing"] * 4 + ["reconstructed"] * 4
    assert found[2].trajectory is small
    modes, chain = plants_of(CompareConfig(modes=2, segments=4, step=5e-4), "reconstructed")
    assert (modes.modes, modes.step, chain.chain.model.nv, chain.step) == (2, 5e-4, 6, 1e-3)
    assert modes.parameters.I_m2 == chain.parameters.I_m2 == 0.0557  # the fit's motor
    assert chain.chain.model.joint("joint2").armature[0] == 0.0557
    assert plants_of(FEW, "simulink")[0].parameters == Parameters()


@kernels
def test_sixteen_rows_in_pairs(comparison: Comparison) -> None:
    rows = comparison.rows
    assert len(rows) == 16
    for row, name in zip(rows, PLANTS * 8, strict=True):
        assert row.plant == name
        assert row.found.diverged is False
        assert 0 < row.found.rms_error <= row.found.max_error
        assert 0 < row.found.envelope and 0 < row.found.max_v < DEFLECTION
        assert row.found.runs == 2
        assert row.found.envelope_quartile_1 <= row.found.envelope <= row.found.envelope_quartile_3
    for first, second in zip(rows[::2], rows[1::2], strict=True):
        assert (first.controllers, first.case, first.setting) == (
            *(second.controllers, second.case, second.setting),
        )
        assert first.tips.tip_difference == second.tips.tip_difference > 0
        assert first.found.envelope != second.found.envelope
        assert first.against == Against()
        apart = second.found.envelope - first.found.envelope
        assert (second.against.difference, second.against.ratio_low) == (apart, None)
        assert second.against.ratio == second.found.envelope / first.found.envelope
        assert (first.simulated, second.simulated) == ("assumed-modes", "closed-chain")
        ours = first.group == "ours"
        assert (first.hardware, first.zeta) == ("bench" if ours else "ideal", 1e-3)
        assert first.check.check_runs == 0 and second.check.check_runs == 2
        assert second.check.check_inside is True


@kernels
def test_a_case_per_pair_of_rows(comparison: Comparison) -> None:
    assert [case.name for case in comparison.cases] == [task.name for task in tasks(FEW)]
    for case in comparison.cases:
        assert tuple(case.motions) == PLANTS
        for motion in case.motions.values():
            assert motion.diverged is None
            assert motion.time[1] == pytest.approx(1e-3, rel=1e-12)  # the control rate
        assert tuple(case.bands) == PLANTS
        assert {band.runs for band in case.bands.values()} == {2}
        own = ("of 2, the median", "of MuJoCo's 2, nearest to the median of 2")  # where chaotic
        assert all(words.endswith(own) for words in case.shown.values())
    assert sorted(comparison.mjcf) == ["chain_reconstructed.xml", "chain_simulink.xml"]
    for text in comparison.mjcf.values():
        assert mujoco.MjModel.from_xml_string(text).nv == 8


@kernels
def test_tables_have_every_row(comparison: Comparison) -> None:
    written, ours, errors, torques, papers, _, holding, none = tables(comparison)
    assert holding.rows == []
    assert written.rows == comparison.rows and not none.rows
    for table in (ours, papers):
        assert "8 of 8 stay bounded" in table.note
        lines = [table.cells(rows) for rows in table.lines()]
        assert [line[0] for line in lines] == ["line", "two-loop", "circle", "line by two-loop"]
        for line, (first, second) in zip(lines, pairs(table.rows), strict=True):
            assert line[1] == f"{1e3 * first.found.envelope:.1f}"
            assert line[2] == f"{1e3 * second.found.envelope:.1f}"
            assert line[3] == f"{second.found.envelope / first.found.envelope:.1f}"
    for line, pair in zip(errors.lines(), pairs(errors.rows), strict=True):
        case, runs, _, error, v = errors.cells(line)
        assert case == ours.cells(line)[0] and runs == "2 | 2"
        assert error == " | ".join(f"{1e3 * row.found.rms_error:.1f}" for row in pair)
        assert v == " | ".join(f"{1e3 * row.found.max_v:.1f}" for row in pair)
    for line, pair in zip(torques.lines(), pairs(torques.rows), strict=True):
        case, first, _, *variations, growth = torques.cells(line)
        assert case == ours.cells(line)[0]
        assert first == "|".join(f"{row.found.rms_torque_1:.1f}" for row in pair)
        for joint, variation in enumerate(variations, 1):
            sums = [getattr(row.found, f"variation_{joint}") for row in pair]
            assert variation == "|".join(f"{each:.1f}" for each in sums)
        assert growth == "|".join(f"{row.found.growth:+.1f}" for row in pair)


@kernels
def test_envelopes_are_shown_with_their_intervals() -> None:
    """In the digits that these support, in columns by the plants' names."""
    config = CompareConfig(perturbations=7, circle=SHORT, hardware="ideal")
    task = named("tuned_circle", config)
    plants = plants_of(config, task.setting)
    rows, _ = run_task(task, plants, config)
    result = Comparison([*rows, *(replace(row, group="table2") for row in rows)], [], *[None] * 2)
    table = tables(result)[1]
    assert table.headings() == ["trajectory", "assumed modes", "chain", "ratio"]
    ((_, *cells),) = (table.cells(line) for line in table.lines())
    for cell, row in zip(cells, rows, strict=False):
        assert float(cell.split()[0]) == pytest.approx(1e3 * row.found.envelope, abs=0.05)
        assert cell.endswith("]") and row.found.envelope_low is not None
    against = rows[1].against
    assert against.ratio_low <= against.ratio <= against.ratio_high
    assert against.difference_low <= against.difference <= against.difference_high
    assert float(cells[2].split()[0]) == pytest.approx(against.ratio, abs=5e-3)


@kernels
def test_holding_is_said_of_every_plant() -> None:
    """By name, with the exact loop's numbers once; both plants run in closed form."""
    config = CompareConfig(perturbations=1, setting="none")
    task = named("tuned_line", config)
    rows, found = run_task(task, plants_of(config, task.setting), config)
    given = (task.trajectory, task.holder, task.controller, config.period, Robot())
    held = holding_rows(found, setting("none"), *given)
    assert [row.plant for row in held] == [row.plant for row in rows] == list(PLANTS)
    assert all(row.holds and row.case == "line" for row in held)
    both = [*rows, *(replace(row, group="table2") for row in rows)]
    result = Comparison(both, [], Robot(), {}, held)
    table = next(each for each in tables(result) if each.key == "holding")
    ((case, verdict_of, ratio, _, growth, *_),) = (table.cells(line) for line in table.lines())
    assert (case, verdict_of, growth) == ("line", "yes|yes", f"{held[0].holding.growth:+.2g}")
    assert growth and ratio == "|".join(f"{row.holding.v_ratio:.2f}" for row in held)
    assert "Note: 2 of 2 loops hold." in verdict(result)
    late = holding_rows(found, setting("none", HARDWARE["bench"]), *given)
    assert all(row.holding.growth < 0 for row in late)  # the bench's delay is what they are for
    ideal = replace(task, controller=TUNED_IDEAL["line"])
    given = (ideal.trajectory, ideal.label, ideal.controller, config.period, Robot())
    late = holding_rows(found, setting("none", HARDWARE["bench"]), *given)
    assert not any(row.holds for row in late)
    assert late[0].holding.growth > 40


def test_a_quick_run_leaves_holding_out(compared: QuickRun) -> None:
    assert compared.content["holding"] == []
    assert "holding.csv" not in compared.files


@kernels
def test_cells_are_paired_by_name(comparison: Comparison) -> None:
    """However the rows are ordered, the first plant named is the first of every cell."""
    again = replace(comparison, rows=[comparison.rows[0], *reversed(comparison.rows[1:])])
    ours, other = (tables(each)[1] for each in (comparison, again))
    assert sorted(ours.headings()) == sorted(other.headings())
    ours, other = (tables(each)[2] for each in (comparison, again))
    assert {tuple(ours.cells(rows)) for rows in ours.lines()} == {
        tuple(other.cells(rows)) for rows in other.lines()
    }


def pairs(rows: list[CompareRow]) -> list[tuple[CompareRow, CompareRow]]:
    return list(zip(rows[::2], rows[1::2], strict=True))


@kernels
@pytest.mark.parametrize("name", ["tuned_line", "table2_line"])
def test_rows_do_not_depend_on_threads(name: str, comparison: Comparison) -> None:
    task = named(name)
    alone = replace(FEW, threads=1)
    rows, found = run_task(task, plants_of(alone, task.setting), alone)
    known = next(case for case in comparison.cases if case.name == name).motions
    for each in found:
        np.testing.assert_array_equal(each.motion.state, known[each.motion.plant].state)
    place = 2 * [each.name for each in tasks(FEW)].index(name)
    assert rows == comparison.rows[place : place + 2]


@kernels
def test_the_seed_moves_medians() -> None:
    task = named("tuned_circle")
    plants = plants_of(FEW, task.setting)[:1]
    (first,), (second,) = (run_task(task, plants, replace(FEW, seed=seed))[0] for seed in (1, 2))
    assert first.found.envelope != second.found.envelope


@kernels
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


@kernels
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
    (row,), (found,) = run_task(
        replace(task, controller=wild), plants_of(FEW, task.setting)[plant : plant + 1], FEW
    )
    motion = found.motion
    assert row.found.diverged is True and row.found.envelope is None and found.band is None
    assert motion.diverged is not None and 0 < row.found.diverged_at <= motion.diverged < 5
    assert np.isfinite(motion.tip).all()
    assert capfd.readouterr() == ("", "") and not list(tmp_path.iterdir())


def made(plant: str, envelope: float | None, shape: str, ratio: float | None = None) -> CompareRow:
    run = {"envelope": envelope, "diverged": envelope is None, "diverged_at": 1.0}
    names = (f"tuned {shape}", shape, plant, "simulink", "ours", "mirrored tip")
    return CompareRow(*names, medians([run] * 20), None, None, 0.0, against=Against(ratio))


@kernels
def test_verdict_counts_and_compares() -> None:
    given = [(0.010, "line"), (0.012, "line", 1.2), (0.020, "circle"), (None, "circle")]
    plants = ["assumed-modes", "chain:8"] * 2
    rows = [made(plant, *each) for plant, each in zip(plants, given, strict=True)]
    assert group_verdict(rows) == (
        "3 of 4 stay bounded; envelopes of the chain 8 are 1.20 to 1.20 times those of the assumed "
        "modes.\n circle, chain 8: 100 % [84, 100] of 20 diverged"
    )
    bounded = group_verdict(rows[2:])
    assert bounded.startswith("1 of 2 stay bounded; envelopes of the chain 8 are an unkn")
    kept = answer(Comparison(rows, [], Robot(), {}))
    assert "setting simulink, hardware ideal: 3 of 4 stay bounded; envelopes of the" in kept
    assert kept.endswith(verdict(Comparison(rows, [], Robot(), {})))


@kernels
def test_a_check_sample_outside_is_said() -> None:
    rows = [made("assumed-modes", 0.01, "line"), made("chain", 0.01, "line")]
    outside = replace(rows[1], check=Check(20, 0.013, 0.004, 17, False))
    same = replace(rows[1], check=Check(20, 0.010, 1e-12, 0, True))
    said = verdict(Comparison([rows[0], outside, same], [], Robot(), {}))
    assert "in 1 of 2 cases the same to a micrometre, in 1 inside" in said
    assert "17 of 20 beyond them all, median 13.0 mm" in said


@kernels
def test_tip_difference_is_over_what_both_ran() -> None:
    def ran(*tips: tuple[float, float]) -> Batch:
        tip = np.reshape(tips, (1, -1, 2))
        return Batch([], tip, np.zeros((1, len(tips))), np.zeros_like(tip))

    nan = (np.nan, np.nan)
    first = ran((0.0, 0.0), (1.0, 0.0), (9.0, 9.0))
    assert apart(first, ran((3.0, 4.0), (1.0, 0.0), nan)) == [np.sqrt(25 / 2)]
    assert apart(first, ran(nan, nan, nan)) == []


@kernels
@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"perturbations": 0}, "perturbations is 0; give 1 or more"),
        ({"seed": -1}, "seed is -1; give 0 or more"),
        ({"setting": "ice"}, "setting 'ice' is unknown; choose one of none, simulink"),
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


def test_compare_has_every_case_on_both_plants(compared: QuickRun) -> None:
    rows = compared.table("results.csv")
    cases = {(row["controllers"], row["trajectory"], row["plant"], row["setting"]) for row in rows}
    assert len(rows) == len(cases) == 16
    pairs = [("line", "line"), ("two-loop", "two-loop"), ("circle", "circle"), ("line", "two-loop")]
    for path, devised in pairs:
        for plant in ("assumed-modes", "chain"):
            assert (f"tuned {devised}", path, plant, "simulink") in cases
            assert (f"Table 2 {devised}", path, plant, "reconstructed") in cases


def test_every_controller_holds_on_both_plants(compared: QuickRun) -> None:
    for row in compared.table("results.csv"):
        assert row["diverged"] == "False"
        assert 1e-3 < float(row["envelope"]) < 0.1
        assert 0 < float(row["rms_error"]) <= float(row["max_error"])


def test_run_folder_explains_itself(compared: QuickRun) -> None:
    about = json.loads((compared.folder / "config.json").read_text())
    assert about["configuration"]["seed"] == 1
    assert {"mujoco", "numpy", "python", "rerun-sdk"} <= set(about["versions"])
    for name in ("chain_simulink.xml", "chain_reconstructed.xml"):
        mujoco.MjModel.from_xml_path(str(compared.folder / name))
    model = mujoco.MjModel.from_xml_path(str(compared.folder / "chain_reconstructed.xml"))
    assert model.joint("joint2").armature[0] == 0.0557  # the fit's motor 2
    for case in about["cases"]:
        assert (compared.folder / "figures" / f"{case}.png").stat().st_size > 10_000
    assert compared.faults() == []
    for end in ("md", "tex"):
        assert (compared.folder / f"results.{end}").stat().st_size > 500
    assert (compared.folder / "run.rrd").stat().st_size > 100_000
    assert not list(compared.folder.parent.glob(".*"))


@pytest.mark.slow
def test_same_seed_same_rows_on_one_thread(
    compared: QuickRun, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "again"
    words = ["--perturbations", "2", "--no-holding", "--threads", "1", "--json"]
    words += ["--controllers", *BOTH_SETS]
    assert main(["compare", "--out", str(out), *words]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["run"] == str(out)
    written = (out / "results.csv").read_text()
    assert written == (compared.folder / "results.csv").read_text()
    for row, cells in zip(shown["rows"], compared.table("results.csv"), strict=True):
        assert row["envelope"] == float(cells["envelope"])
        assert isinstance(row["diverged"], bool)
        assert {"rms_error", "max_v", "paper_simulation"} <= set(row)


@kernels
@pytest.mark.slow
def test_references_for_the_true_tip() -> None:
    """A shaped reference takes off four fifths of the envelope, under friction with a dither."""
    config = CompareConfig(perturbations=1, true_tip=True, hardware="ideal")
    rows = true_tip_rows(
        [
            row
            for task in tasks(config)
            if task.group == "true tip"
            for row in run_task(task, plants_of(config, task.setting), config)[0]
        ]
    )
    assert len(rows) == 2 * 3 * (2 + 3)
    for row in rows:
        if row.reference == ("true tip" if row.setting == "none" else "true tip, dithered"):
            assert row.share is not None and row.share < TRUE_TIP_SHARE
        assert (row.dead_zone_error > 0.004) == (row.setting == "simulink")


def test_force_replaces_a_run_only(compared: QuickRun, capsys: pytest.CaptureFixture[str]) -> None:
    before = (compared.folder / "results.csv").read_text()
    assert main(["compare", "--out", str(compared.folder)]) == 2
    assert main(["compare", "--out", str(compared.folder.parent), "--force"]) == 2
    assert (compared.folder / "results.csv").read_text() == before
    capsys.readouterr()
