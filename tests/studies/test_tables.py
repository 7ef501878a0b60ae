"""Tables 2 and 3 and Figure 6 anew: rows, ratios, and that a row is what the tuner found."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from quick_run import QuickRun

from flexsim import ParameterError, Robot, measure, reference, setting, trajectory
from studies.main import main
from studies.tables import tables
from studies.tables.rows import RunRow
from studies.tables.tables import TablesConfig, run, tunings
from studies.tuning.found import found_in

PATHS = ("line", "two-loop", "circle")
PLANTS = ("assumed-modes", "chain")
TUNED_ON = (*PLANTS, "both")
PAPER = {"line": 3.3, "two-loop": 1.5, "circle": 3.0, "line by two-loop": 1.3}  # section 4
TENTH = 0.05  # the paper's ratios have one decimal


@pytest.fixture
def shown(quick: Callable[[str], QuickRun]) -> QuickRun:
    return quick("tables")


def test_every_controller_on_every_trajectory_and_plant(shown: QuickRun) -> None:
    rows = shown.content["rows"]
    names = [(r["tuned_on"], r["tuned_for"], r["run_on"], r["trajectory"]) for r in rows]
    assert names == list(product(TUNED_ON, PATHS, PLANTS, PATHS))
    for row in rows:
        share = row["diverged_share"]
        assert (share is None) is (row["runs"] == 0)
        if share is not None:
            assert row["runs"] == 2 and (share > 0) is row["diverged"]
            assert row["diverged_share_low"] <= share <= row["diverged_share_high"]
        figures = [row[name] for name in ("envelope", "rms_error", "max_v", "residual_v")]
        assert all(value is None for value in figures) is row["diverged"]
        if not row["diverged"]:
            assert 0 < row["rms_error"] <= row["max_error"] and row["residual_v"] <= row["max_v"]
    assert any(not row["diverged"] for row in rows)


def test_index_on_its_own_ground_is_what_the_tuner_found(shown: QuickRun) -> None:
    content = shown.content
    found = 0
    for controller in content["controllers"]:
        mine = [
            row["index"]
            for row in content["rows"]
            if (row["tuned_on"], row["tuned_for"]) == (controller["tuned_on"], row["trajectory"])
            and row["tuned_for"] == controller["tuned_for"]
            and controller["tuned_on"] in (row["run_on"], "both")
        ]
        if controller["index"] is None:
            assert mine == [None] * len(mine)
        else:
            assert max(mine) == pytest.approx(controller["index"], rel=1e-9)
            found += 1
    assert found >= 3  # seed 1 finds controllers that hold


def test_ratios_are_those_of_the_rows(shown: QuickRun) -> None:
    content = shown.content
    envelope = {
        (r["tuned_on"], r["tuned_for"], r["run_on"], r["trajectory"]): r["envelope"]
        for r in content["rows"]
    }
    assert len(content["ratios"]) == 12
    for case in content["ratios"]:
        before, after = (
            envelope[case["tuned_on"], case["tuned_for"], case[name], case["trajectory"]]
            for name in ("from_plant", "to_plant")
        )
        wanted = None if None in (before, after) else after / before
        assert case["ratio"] == wanted
        own = case["trajectory"] == case["tuned_for"]
        name = case["trajectory"] if own else f"{case['trajectory']} by {case['tuned_for']}"
        assert case["paper_ratio"] == pytest.approx(PAPER[name], abs=TENTH)
    chain = [c for c in content["ratios"] if c["tuned_on"] == "chain"]
    assert {(c["from_plant"], c["to_plant"]) for c in chain} == {("chain", "assumed-modes")}


def made(run_on: str, envelope: float | None) -> RunRow:
    lost = envelope is None
    names = ("assumed-modes", "line", run_on, "line")
    return RunRow(*names, envelope, *[None] * 5, diverged=lost, diverged_at=1.0 if lost else None)


def test_ratios_have_the_interval_of_their_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs twice as wide on the chain are so in every resample; without a median there is none."""
    monkeypatch.setattr(tables, "CASES", (("line", "line"),))
    monkeypatch.setattr(tables, "FROM_TO", {"assumed-modes": PLANTS})
    runs = [0.010 + 0.001 * k for k in range(20)]
    rows = [made(on, envelope) for on, envelope in zip(PLANTS, (0.0195, 0.039), strict=True)]
    (row,) = tables.ratios(rows, [runs, [2 * each for each in runs]], seed=1)
    assert row.ratio == row.ratio_low == row.ratio_high == 2.0
    (row,) = tables.ratios(rows, [runs, [2 * each for each in reversed(runs)]], seed=1)
    assert row.ratio_low < 1.9 < 2.1 < row.ratio_high
    lost = [rows[0], made("chain", None)]
    (row,) = tables.ratios(lost, [runs, [math.inf] * 20], seed=1)
    assert row.ratio is row.ratio_low is row.ratio_high is None


def test_run_explains_itself(shown: QuickRun) -> None:
    assert shown.content["run"] == str(shown.folder)
    names = {"config.json", "results.csv", "controllers.csv", "ratios.csv", "chain.xml", "figures"}
    assert shown.files == names | {"tables.json"}
    assert len(shown.table("results.csv")) == 54
    for name in ("envelopes.png", "transfer.png"):
        assert (shown.folder / "figures" / name).stat().st_size > 20_000
    assert shown.faults() == []


def test_cells_are_those_of_the_rows(shown: QuickRun) -> None:
    """Both plants in a cell, by name, where the trajectory's column and the tuning's line meet."""
    (wide,) = (row for row in shown.content["rows"] if (
        row["tuned_on"], row["tuned_for"], row["run_on"], row["trajectory"]
    ) == ("chain", "circle", "assumed-modes", "line"))  # fmt: skip
    text = shown.text[shown.text.index("Every controller on every trajectory") :]
    line = next(each for each in text.splitlines() if each.split()[:2] == ["circle", "chain"])
    assert line.split()[2] == ("div" if wide["diverged"] else f"{1e3 * wide['envelope']:.1f}")


@pytest.mark.slow  # a second run of the study
def test_given_controllers_are_run_and_nothing_is_tuned(
    tuned: Path, tuned_otherwise: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each at its own period and with its own v, on both plants and all trajectories."""
    out, names = tmp_path / "out", ("circle", str(tuned), str(tuned_otherwise))
    words = ["tables", "--quick", "--controller", *names, "--out", str(out)]
    assert main([*words, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    rows, labels = content["rows"], ("circle", "run small", "run otherwise")
    found = [(row["controllers"], row["run_on"], row["trajectory"]) for row in rows]
    assert found == list(product(labels, PLANTS, PATHS))
    assert {row["tuned_for"] for row in rows} == {"circle"}
    assert [each["parameters"]["k1"] for each in content["runs"]] == [
        found_in(each).parameters[0] for each in (tuned, tuned_otherwise)
    ]
    row = next(row for row in rows if row["controllers"] == "run otherwise")
    plant = Robot().plant("assumed-modes", setting("simulink"))
    ref = reference(trajectory("line"), plant.parameters, 2e-3)
    filters = found_in(tuned_otherwise).filters(2e-3)
    (nominal,) = measure(plant, setting("simulink"), ref, [filters], v_gain=0.0)
    assert row["index"] == pytest.approx(nominal["index"], rel=1e-9)
    assert len(content["ratios"]) == 9
    for case in content["ratios"]:
        assert case["ratio"] == case["to_envelope"] / case["from_envelope"]
    assert {path.stem for path in (out / "figures").iterdir()} == {"transfer", "captions"}
    assert main([*words, "--force"]) == 0
    said = capsys.readouterr().out
    assert "Ratio of envelopes, chain / modes" in said and "18 of 18 runs hold" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--controller circel", "Did you mean circle"),
        ("--controller circle circle", "name each once"),
        ("--controller circle --no-exact", "--no-exact has no effect"),
        ("--controller circle --generations 3", "--generations has no effect"),
        ("--controller circle --chain-generations 3", "--chain-generations has no effect"),
        ("--controller ./none", "not a run of flexsim tune"),
    ],
)
def test_given_controllers_that_cannot_be_run(
    words: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["tables", *words.split(), "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and shown.err.count("\n") == 1 and said in shown.err
    assert list(tmp_path.iterdir()) == []


def test_searches_are_the_tuners() -> None:
    chosen = tunings(TablesConfig(seed=7, generations=9, chain_generations=4, setting="opposing"))
    assert [(each.plant, each.trajectory) for each in chosen] == list(product(TUNED_ON, PATHS))
    assert {each.generations for each in chosen if each.plant == "assumed-modes"} == {9}
    assert {each.generations for each in chosen if each.plant != "assumed-modes"} == {4}
    assert {(each.seed, each.setting) for each in chosen} == {(7, "opposing")}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"chain_generations": 0}, "chain generations is 0"),
        ({"generations": 0}, "generations is 0"),
        ({"perturbations": 0}, "perturbations is 0"),
        ({"setting": "ice"}, "'ice' is unknown"),
        ({"seed": -1}, "seed is -1"),
        ({"threads": 0}, "threads is 0"),
    ],
)
def test_bad_options_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        run(TablesConfig(**options))
