"""What a study writes: rows that are the library's to the bit, medians, pairs, sensitivity."""

from __future__ import annotations

import csv
import json
import math
import os
import re
from pathlib import Path

import numpy as np
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest
from scipy import stats
from scipy.io import loadmat

from controllers import TUNED
from flexsim import HARDWARE, Parameters, Robot, Trajectory, measure, reference, setting
from flexsim.loop.measuring import yardstick
from flexsim.loop.runs import evaluate, measured_figures
from studies.core.evidence.intervals import ratio_interval, share_interval
from studies.core.evidence.repeats import perturbed
from studies.core.study_options import FORMATS
from studies.main import main
from studies.run.batches import carried_out, prepare, prepared
from studies.run.columns import FIGURES
from studies.run.run import workshop_of
from studies.run.sensitivity import _correlations, _indices
from studies.spec.draws import Draws
from studies.spec.parts import NumbersPart, SweepPart

STUDY = """
title = "Is it so?"
repeats = 4
batch = 50
plants = ["assumed-modes", "closed-chain"]
controllers = ["line", { use = "circle", name = "other" }]
hardware = ["bench"]
[[trajectories]]
use = "line"
duration = 0.06
hold = 0.02
end = [0.69, 0.21]
[sweep]
robot.EI = { values = [0.349, 0.4] }
"settings[0].mu[0]" = { uniform = [0.2, 0.3] }
samples = 8
"""
PATH = Trajectory("line", duration=0.06, hold=0.02, end=(0.69, 0.21))
CONTRACT = ("plant", "controller", "trajectory", "setting", "hardware", "repeat", "envelope",
            "rms_error", "index", "diverged", "robot.EI", "settings[0].mu[0]")  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run, with the time series of nominal runs."""
    where = tmp_path_factory.mktemp("study")
    (where / "study.toml").write_text(STUDY)
    words = ["run", str(where / "study.toml"), "--out", str(where / "run"), "--traces", "nominal"]
    assert main(words) == 0
    return where / "run"


def rows_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "summary.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_contract_of_results(folder: Path) -> None:
    table = pq.read_table(folder / "results.parquet")
    assert set(CONTRACT) <= set(table.column_names)
    assert table.num_rows == 2 * 2 * 8 * 2 * 4
    assert table.column("run").to_pylist() == list(range(table.num_rows))
    units = {f.name: f.metadata[b"unit"].decode() for f in table.schema}
    assert units["envelope"] == "m" and units["index"] == "m2 s" and units["robot.EI"] == "N m2"
    assert all(f.metadata[b"meaning"] for f in table.schema)
    with (folder / "results.csv").open(newline="") as file:
        written = list(csv.DictReader(file))
    assert [float(row["envelope"]) for row in written] == table.column("envelope").to_pylist()


def test_rows_are_the_librarys_to_the_bit(folder: Path) -> None:
    """Nominal and perturbed gains, the bench's noise of its own repeat, both plants."""
    table = pq.read_table(folder / "results.parquet").filter(
        (pc.field("robot.EI") == 0.349) & (pc.field("controller") == "line")
    )
    first = table.filter(pc.field("draw") == 0).to_pylist()
    mu = first[0]["settings[0].mu[0]"]
    law = setting("simulink", HARDWARE["bench"])
    own = law.friction.__class__(**{**vars(law.friction), "mu": (mu, law.friction.mu[1])})
    chosen = law.__class__(**{**vars(law), "friction": own,
                              "hardware": HARDWARE["bench"].__class__(
                                  **{**vars(HARDWARE["bench"]), "seed": 1})})  # fmt: skip
    others = perturbed(TUNED["line"], 3, np.random.default_rng(1))
    ref = reference(PATH, Parameters())
    for name in ("assumed-modes", "closed-chain"):
        plant = Robot().plant(name, chosen)
        filters = [each.filters(1e-3) for each in (TUNED["line"], *others)]
        expected = measure(plant, chosen, ref, filters, hold=0.02)
        mine = [row for row in first if row["plant"] == name]
        assert [row["repeat"] for row in mine] == [0, 1, 2, 3]
        for row, figures in zip(mine, expected, strict=True):
            for figure in FIGURES:
                assert row[figure.name] == figures[figure.name], figure.name


def test_noise_is_of_the_draw_and_the_repeat(folder: Path) -> None:
    shop = workshop_of(folder / "study.toml")
    batch = prepare(shop, 0, 64)
    numbers = np.concatenate([group.numbers for group in batch.groups])
    rows = np.concatenate([group.rows for group in batch.groups])
    i = batch.indices
    assert (numbers == (i.repeat + 4 * i.draw)[rows]).all()
    assert len(set(numbers.tolist())) == 8 * 4  # alike for both controllers


@pytest.mark.parametrize("threads", [1, 2])
def test_a_row_depends_neither_on_its_batch_nor_on_threads(folder: Path, threads: int) -> None:
    whole = pq.read_table(folder / "results.parquet")
    shop = workshop_of(folder / "study.toml")
    for runs in ([200], [3, 77, 120, 130], list(range(90, 140))):
        rows = carried_out(shop, prepared(shop, np.array(runs)), threads)
        assert rows.to_pylist() == whole.take(runs).to_pylist()


def test_the_summary_is_of_the_rows(folder: Path) -> None:
    table = pq.read_table(folder / "results.parquet").to_pylist()
    rows = rows_of(folder)
    cells = [row for row in rows if row["what"] == "cells"]
    assert len(cells) == 2 * 2 * 2 * len(FIGURES)

    def own(row: dict[str, str], **other: str) -> list[float]:
        wanted = {k: row[k] for k in ("plant", "controller", "robot.EI")} | other
        return [r[row["figure"]] for r in table if all(str(r[k]) == v for k, v in wanted.items())]

    for row in cells:
        values = own(row)
        assert int(row["runs"]) == len(values) == 32
        assert float(row["median"]) == pytest.approx(np.median(values), rel=1e-15)
        assert float(row["low"]) <= float(row["median"]) <= float(row["high"])
        assert float(row["quartile_1"]) == pytest.approx(np.percentile(values, 25), rel=1e-12)
        assert row["diverged"] == "0"
        assert float(row["diverged_share_high"]) == share_interval(0, 32)[1]
    pairs = [row for row in rows if row["what"] == "plants"]
    assert len(pairs) == 2 * 2 * 4
    for row in pairs:
        mine, others = own(row), own(row, plant=row["against"])
        expected = ratio_interval(mine, others, 1)
        assert expected is not None and row["against"] == "assumed-modes"
        assert (float(row["ratio_low"]), float(row["ratio_high"])) == expected
    against = {row["against"] for row in rows if row["what"] == "controllers"}
    assert against == {"line"}


def test_diverged_runs_are_counted_and_never_look_good(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(
        STUDY.replace("[sweep]", '[[controllers]]\nname = "bad"\njoint1 = { kp = -1e6 }\n'
                      'joint2 = { kp = 1.0 }\n[sweep]')
        .replace('controllers = ["line", { use = "circle", name = "other" }]', "")
        .replace("duration = 0.06", "duration = 0.6")
    )  # fmt: skip
    assert main(["run", str(tmp_path / "s.toml"), "--out", str(tmp_path / "r")]) == 0
    table = pq.read_table(tmp_path / "r" / "results.parquet")
    assert all(table.column("diverged").to_pylist())
    for name in ("envelope", "rms_error", "index", "effort"):
        assert set(table.column(name).to_pylist()) == {math.inf}
    assert table.column("residual_v").null_count == table.num_rows
    assert all(0 < t < 0.6 for t in table.column("diverged_at").to_pylist())
    row = rows_of(tmp_path / "r")[0]
    assert row["median"] == "" and row["diverged_share"] == "1.0"
    assert float(row["diverged_share_low"]) == share_interval(32, 32)[0]


def test_a_run_says_how_to_repeat_it(folder: Path, tmp_path: Path) -> None:
    assert main(["run", str(folder / "study.toml"), "--out", str(tmp_path / "r")]) == 0
    again = (tmp_path / "r" / "results.parquet").read_bytes()
    assert again == (folder / "results.parquet").read_bytes()


def test_a_run_keeps_its_question_its_answer_and_its_tables(folder: Path) -> None:
    config = json.loads((folder / "config.json").read_text())
    assert config["question"] == "Is it so?"
    assert re.match(r"[\d,]+ runs, \d+ diverged", config["answer"])
    (table,) = json.loads((folder / "tables.json").read_text())["tables"]
    assert table["columns"][0]["heading"] == "case" and len(table["lines"]) > 1


def test_json_says_four_things(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["run", "--out", str(tmp_path / "r"), "--json", "--quick", "--set", "seed=3"]
    words += ["--set", "repeats=1", "robot.zeta=0.002", str(folder / "study.toml")]
    assert main(words) == 0
    content = json.loads(capsys.readouterr().out)
    assert set(content) == {"run", "runs", "diverged", "seconds"}
    assert (content["runs"], content["diverged"]) == (64, 0)
    text = (tmp_path / "r" / "study.toml").read_text()
    assert "zeta = 0.002" in text and "seed = 3" in text and "repeats = 1\n" in text


# --- time series --------------------------------------------------------------------------------


def test_traces_are_the_motions(folder: Path) -> None:
    kept = [pq.read_table(path) for path in sorted((folder / "traces").glob("*.parquet"))]
    runs = [run for table in kept for run in dict.fromkeys(table.column("run").to_pylist())]
    assert runs == list(range(0, 256, 4))  # those of repeat 0
    (first,) = [t for t in kept if 0 in t.column("run").to_pylist()]
    mine = first.filter(pc.field("run") == 0)
    results = pq.read_table(folder / "results.parquet").slice(0, 1).to_pylist()[0]
    x, y, xr, yr = (mine.column(name).to_numpy() for name in ("x", "y", "x_ref", "y_ref"))
    error = np.hypot(x - xr, y - yr)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(results["rms_error"], rel=1e-12)
    assert mine.column("t").to_numpy()[-1] == pytest.approx(0.08)
    assert mine.schema.field("tau1").metadata[b"unit"] == b"N m"


@pytest.mark.parametrize("form", ["csv", "parquet", "mat"])
def test_export_of_kept_and_of_repeated_runs(folder: Path, tmp_path: Path, form: str) -> None:
    for case in ("0", "1"):  # kept; not kept, so run again
        out = tmp_path / f"{case}.{form}"
        words = ["export", str(folder), "--case", case, "--format", form, "--out", str(out)]
        assert main(words) == 0
    if form == "mat":
        found = loadmat(tmp_path / "1.mat", squeeze_me=True)
        assert found["v"].shape == (81,) and str(found["units"]["tau1"]) == "N m"
        assert found["about"]["repeat"] == 1
    elif form == "csv":
        lines = (tmp_path / "1.csv").read_text().splitlines()
        assert len(lines) == 82 and lines[0].startswith('"t","x","y"')
    else:
        kept, again = (pq.read_table(tmp_path / f"{case}.parquet") for case in "01")
        assert kept.schema == again.schema
        shop = workshop_of(folder / "study.toml")
        from studies.run.batches import traces

        assert traces(shop, prepared(shop, np.array([0])), "all").equals(kept)


@pytest.mark.parametrize(
    ("case", "said"),
    [
        ("999", "there are runs 0 to 255"),
        ("plant=chain", "choose of assumed-modes, closed-chain"),
        ("plnt=chain", "Did you mean plant?"),
        ("plant=closed-chain", "128 runs (128, 129, 130, 131, 132, ...), which differ in"),
        ("plant=closed-chain,repeat=0,draw=3,controller=lime", "Did you mean line?"),
    ],
)
def test_cases_that_name_no_run(
    folder: Path, case: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(folder), "--case", case]) == 2
    assert said in capsys.readouterr().err


def test_export_by_names_beside_the_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = "plant=closed-chain,repeat=2,draw=3,controller=other"
    assert main(["export", str(folder), "--case", case, "--json"]) == 0
    about = json.loads(capsys.readouterr().out)
    assert Path(about["out"]).parent == folder.parent and about["robot.EI"] == 0.349
    assert main(["export", str(folder), "--case", case]) == 2  # the file is there
    assert "exists already" in capsys.readouterr().err


def test_export_of_what_is_no_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(tmp_path), "--case", "0"]) == 2
    assert "is no finished run of a study file" in capsys.readouterr().err


def test_names_with_commas_and_dollars(tmp_path: Path) -> None:
    """As plants of integrators.toml have; and what a figure would take for mathematics."""
    text = STUDY.replace(
        '"line", {', '{ use = "line", name = "a, b=1, $\\\\frac{$ \\u001b[31m" }, {'
    )
    (tmp_path / "s.toml").write_text(text)
    assert main(["run", str(tmp_path / "s.toml"), "--quick", "--out", str(tmp_path / "r")]) == 0
    name = pq.read_table(tmp_path / "r" / "results.parquet").column("controller")[0].as_py()
    case = f"controller={name},plant=closed-chain,draw=0,repeat=0"
    out = str(tmp_path / "o.mat")
    words = ["export", str(tmp_path / "r"), "--case", case, "--format", "mat", "--out", out]
    assert main(words) == 0


# --- what matters -------------------------------------------------------------------------------


def numbers(count: int, samples: int, sampler: str) -> Draws:
    parts = {f"x{i}": NumbersPart(uniform=(-math.pi, math.pi)) for i in range(count)}
    return Draws.of(SweepPart(sampler=sampler, samples=samples, numbers=parts), 1)  # type: ignore[arg-type]


def test_rank_correlations_are_spearmans_with_the_truth_inside() -> None:
    draws = numbers(3, 256, "sobol")
    columns = draws.columns(np.arange(256))
    values = np.exp(columns[0]) + 0.1 * columns[1] ** 2
    rows = _correlations(draws, columns, values, 1)
    for row, column in zip(rows, columns, strict=True):
        expected = stats.spearmanr(column, values).statistic
        assert row["value"] == pytest.approx(expected, abs=1e-12)
        assert row["low"] <= row["value"] <= row["high"]
    assert rows[0]["low"] > 0.9 and rows[2]["low"] < 0 < rows[2]["high"]


def test_a_run_that_diverged_is_the_largest() -> None:
    draws = numbers(1, 64, "sobol")
    (column,) = draws.columns(np.arange(64))
    values = np.where(column > 1.0, math.inf, column)
    (row,) = _correlations(draws, [column], values, 1)
    assert row["value"] > 0.9
    (none,) = _correlations(draws, [column], np.full(64, 3.0), 1)
    assert none["value"] is None and none["low"] is None


def test_sobol_indices_of_ishigami() -> None:
    """Closed form: first-order 0.3139, 0.4424, 0; total 0.5576, 0.4424, 0.2437.

    Source: T. Ishigami and T. Homma, ISUMA '90, with a = 7, b = 0.1.
    """
    draws = numbers(3, 4096, "saltelli")
    assert draws.samples == 4096 * 5
    x = draws.columns(np.arange(draws.samples))
    values = np.sin(x[0]) + 7 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])
    rows = _indices(draws, values, 1)
    expected = [0.3139, 0.5576, 0.4424, 0.4424, 0.0, 0.2437]
    assert [row["value"] for row in rows] == pytest.approx(expected, abs=0.02)
    assert all(row["low"] <= row["value"] <= row["high"] for row in rows)
    lost = _indices(draws, np.where(values > 8, math.inf, values), 1)
    assert {row["value"] for row in lost} == {None}


def test_sensitivity_is_written(folder: Path) -> None:
    with (folder / "sensitivity.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["number"] for row in rows} == {"settings[0].mu[0]"}
    assert len(rows) == 2 * 2 * 2 * 4
    names = {path.name for path in (folder / "figures").iterdir()}
    drawn = {f"{name}.{end}" for name in ("envelopes", "sensitivity") for end in FORMATS}
    assert names == drawn | {"captions.md"}
    for name in ("summary", "sensitivity"):
        assert {f"{name}.{end}" for end in ("csv", "md", "tex")} <= set(os.listdir(folder))


def test_check_says_what_it_means(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(folder / "study.toml"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["runs"], found["batches"]) == (256, 6)
    assert found["shape"] == {"plants": 2, "robots": 1, "draws": 16, "cases": 2, "repeats": 4}
    assert 0 < found["seconds"] < 60 and all(row["seconds_per_run"] > 0 for row in found["plants"])
    assert main(["check", str(folder / "study.toml")]) == 0
    assert "= 256 runs in 6 batches" in capsys.readouterr().out


def test_mujoco_repeats_some_of_the_closed_form(tmp_path: Path) -> None:
    text = STUDY.replace("repeats = 4", "repeats = 4\ncheck = 5").replace('"assumed-modes", ', "")
    (tmp_path / "s.toml").write_text(text)
    assert main(["run", str(tmp_path / "s.toml"), "--out", str(tmp_path / "r")]) == 0
    with (tmp_path / "r" / "check.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4 and {row["check_runs"] for row in rows} == {"5"}
    assert all(float(row["check_difference"]) < 1e-9 for row in rows)  # so short, it is regular


def test_evaluate_and_measure_agree_on_first_runs() -> None:
    """The noise of a run's number, whichever call it is in."""
    plant = Robot().plant("assumed-modes", setting("simulink"))
    chosen, ref = setting("simulink", HARDWARE["bench"]), reference(PATH, Parameters())
    filters = [TUNED["line"].filters(1e-3)] * 3
    yard = yardstick(ref, 0.02)
    every = measured_figures(evaluate(plant, chosen, ref, filters, yard=yard), ref, 0.02)
    last = evaluate(plant, chosen, ref, filters[:1], yard=yard, first_run=2)
    assert measured_figures(last, ref, 0.02)[0] == every[2]
