"""Reports without a browser: what is read, what is compared, what is refused."""

from __future__ import annotations

import base64
import json
import math
import os
import re
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import report_runs

from studies.core.figures import sheet, write_figures
from studies.main import main
from studies.report.frames import read_csv, typed
from studies.report.images import pictures_of
from studies.report.kept import read
from studies.report.names import known
from studies.report.page import MARK, page
from studies.report.pairs import APART, DIFFERENT, NOT_BOTH, OVERLAP, SAME, Side, pairs_of, verdict
from studies.report.points import keys_of, points_of
from studies.report.sheets import of_frame, with_ends

MANY = 100_000  # runs of a study
LARGEST = 20_000_000  # [bytes] that a report of them may have


def said(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """Return the one line of a report that is refused."""
    assert main(["report", *map(str, words)]) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and shown.err.count("\n") == 1
    return shown.err


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *(("1", 1), ("-2", -2), ("1e-05", 1e-5), ("inf", math.inf), ("0.5", 0.5)),
        *(("", None), ("True", True), ("false", False), ("line", "line"), ("1_000", "1_000")),
        *(("Infinity", "Infinity"), ("12 34", "12 34"), ("²", "²"), ("9" * 16, 1e16)),
    ],
)
def test_fields_are_numbers_truth_text_or_nothing(text: str, value: object) -> None:
    found = typed(text)
    assert found == value and type(found) is type(value)


def test_a_number_stands_with_the_digits_that_its_interval_supports() -> None:
    assert with_ends(0.0054137, 0.00538, 0.005441) == "0.00541 [0.00538, 0.00544]"
    assert with_ends(4189.3, 4100.0, 4300.0) == "4189 [4100, 4300]"
    assert with_ends(1 / 3, None, None) == "0.333333"
    assert with_ends(1 / 3, 0.3, None) == "0.333333 [0.3, ?]"
    assert with_ends(2e-14, 1e-14, 3e-14) == "2e-14 [1e-14, 3e-14]"
    assert (with_ends(None, None, None), with_ends(math.inf, 1.0, None)) == ("-", "inf")


def test_intervals_stand_in_the_cells_of_their_figures(tmp_path: Path) -> None:
    run = read(report_runs.study(tmp_path / "run"))
    (frame,) = run.frames
    assert frame.figures == ["envelope"] and keys_of(frame) == ["case", "plant"]
    sheet = of_frame(frame)
    heads = [(head.text, head.unit) for head in sheet.heads]
    assert heads[2:4] == [("envelope [interval]", "m"), ("growth", "1/s")]
    assert sheet.rows[0][2].text == "0.0360 [0.0358, 0.0362]"
    assert sheet.rows[-1][2].text == "-" and sheet.rows[-1][2].key is None
    assert known("max_v_quartile_1").unit == known("max_v").unit == "m"
    assert len(points_of(frame)) == len(frame.rows)


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [
        ((1.0, 0.9, 1.1), (1.0, 0.9, 1.1), SAME),
        ((1.0, 0.9, 1.1), (1.2, 1.05, 1.3), OVERLAP),
        ((1.0, 0.9, 1.1), (1.3, 1.2, 1.4), APART),
        ((1.3, 1.2, 1.4), (1.0, 0.9, 1.1), APART),
        ((1.0, 0.9, None), (1.3, 1.2, 1.4), DIFFERENT),
        ((None, None, None), (1.3, 1.2, 1.4), NOT_BOTH),
    ],
)
def test_two_numbers_compare_by_their_intervals(
    first: tuple[float | None, ...], second: tuple[float | None, ...], found: str
) -> None:
    assert verdict(Side(*first), Side(*second)) == found


def test_rows_of_two_runs_are_paired_by_key_not_by_place(tmp_path: Path) -> None:
    one = read(report_runs.study(tmp_path / "one"))
    other = read(report_runs.study(tmp_path / "two", report_runs.rows(5e-4)[-2::-1]))
    pairs, unpaired = pairs_of(one, other)
    envelopes = [each for each in pairs if each.metric == "envelope"]
    assert len(envelopes) == 12 and {each.verdict for each in envelopes} == {APART}
    assert all(each.difference == pytest.approx(5e-4) for each in envelopes)
    assert {each.verdict for each in pairs if each.metric == "growth"} == {SAME}
    (alone,) = unpaired
    assert (alone.first, alone.second, alone.such_as) == (1, 0, "lost, chain")


def test_differences_name_configuration_versions_and_files(tmp_path: Path) -> None:
    one = report_runs.study(tmp_path / "one")
    two = report_runs.study(
        tmp_path / "two",
        configuration={"seed": 2, "robot": {"EI": 0.4}, "out": "elsewhere"},
        versions={"python": "3.99"},
    )
    report_runs.written(two, {"more.csv": "a\n1\n"})
    html = page([read(one), read(two)])
    between = html[html.index('<section id="differences">') : html.index('<section id="run-1"')]
    cells = re.findall(r"<td[^>]*>([^<]*)</td>", between)
    assert cells[cells.index("robot.EI") :][:3] == ["robot.EI", "0.349", "0.4"]
    assert cells[cells.index("seed") :][:3] == ["seed", "1", "2"]
    assert "out" not in cells and "3.99" in cells
    assert cells[cells.index("more.csv") :][:3] == ["more.csv", "no", "yes"]


def test_a_report_is_the_same_each_time_and_has_the_runs_files(tmp_path: Path) -> None:
    folder = report_runs.study_file(tmp_path / "run")
    html = page([read(folder)])
    assert html == page([read(folder)]) and html.startswith(MARK)
    (source,) = re.findall(r'href="data:[^,]*base64,([^"]*)" download="study.toml"', html)
    assert base64.b64decode(source) == (folder / "study.toml").read_bytes()
    assert f"flexsim run {folder}/study.toml" in html
    plain = re.sub(r"<script>.*?</script>", "", html, flags=re.DOTALL)
    assert "http:" not in plain and "https:" not in plain
    assert html.count("<script>") == 3  # plotly's once, and two of ours


def test_of_many_runs_some_are_shown_and_the_rest_named(tmp_path: Path) -> None:
    folder = report_runs.study_file(tmp_path / "run")
    content = {"run": range(MANY), "envelope": [0.1] * MANY}
    more = {name: ["x"] * MANY for name in ("plant", "robot", "controller", "trajectory")}
    more |= {name: ["x"] * MANY for name in ("setting", "hardware")}
    pq.write_table(pa.table({**content, **more}), folder / "results.parquet")
    html = page([read(folder)])
    assert "The first 200 of 100,000 rows." in html and len(html) < LARGEST


def test_figures_have_their_captions(tmp_path: Path) -> None:
    """As they were written, whatever is in them; a caption of none is none."""
    run = report_runs.study(tmp_path / "run")
    hostile = "**b** <b> [x](y) $x_1$ \\ 50 %"
    figure = sheet(20, 20)
    figure.set_label(hostile)
    write_figures(run, [("one_case", figure), ("bare", sheet(20, 20))], ("png",))
    shown = {each.name: each.caption for each in pictures_of(run)[0]}
    assert shown["one_case"] == hostile and shown["bare"] == ""
    assert "<b>one_case</b> **b** &lt;b&gt; [x](y)" in page([read(run)])
    (run / "figures" / "captions.md").write_text("anything\n**one")
    assert {each.caption for each in pictures_of(run)[0]} == {""}


def test_units_have_their_powers_raised(tmp_path: Path) -> None:
    run = report_runs.study(tmp_path / "run")
    (run / "more.csv").write_text("case,index\na,0.5\nb,0.25\n")
    html = page([read(run)])
    assert "<small>m² s</small>" in html and "<small>m2 s</small>" not in html


def test_an_unfinished_run_says_so(tmp_path: Path) -> None:
    tuning = report_runs.tuning(tmp_path / "tuning", finished=False)
    html = page([read(tuning)])
    assert "This tuning is unfinished: 3 generations are kept" in html
    assert "has no answer" not in html and 'id="run-1-convergence"' in html
    study = report_runs.study_file(tmp_path / "study")
    report_runs.written(study, {".flexsim-run": '{"flexsim": "run", "unfinished": true}'})
    (study / "results.parquet").unlink()
    report_runs.written(study, {"batches/0-1-x-y.arrow": ""})
    assert "This run is unfinished: 1 batches of runs are kept" in page([read(study)])


def test_a_run_from_before_answers_were_kept_is_shown(tmp_path: Path) -> None:
    run = report_runs.study(tmp_path / "run", question="", answer="")
    (run / "tables.json").unlink()
    html = page([read(run)])
    assert "This run has no answer kept." in html and "0.0360 [0.0358, 0.0362]" in html


def test_a_report_replaces_reports_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, out = report_runs.study(tmp_path / "run"), tmp_path / "report.html"
    out.write_text("<!DOCTYPE html>\nmine")
    assert "is no report of ours" in said(capsys, run, "--out", out)
    assert out.read_text() == "<!DOCTYPE html>\nmine"
    assert main(["report", str(run), "--out", str(out), "--force"]) == 0
    assert main(["report", str(run), "--out", str(out), "--json"]) == 0
    about = json.loads(capsys.readouterr().out.partition("\n")[2])
    assert about == {"out": str(out), "runs": [str(run)], "bytes": out.stat().st_size}
    assert {path.name for path in tmp_path.iterdir()} == {"run", "report.html"}


def test_outs_that_cannot_be(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = report_runs.study(tmp_path / "run")
    assert "there is no folder" in said(capsys, run, "--out", tmp_path / "none" / "x.html")
    assert "it is a folder" in said(capsys, run, "--out", tmp_path)
    (tmp_path / "link.html").symlink_to(tmp_path / "elsewhere")
    assert "a symbolic link" in said(capsys, run, "--out", tmp_path / "link.html", "--force")
    assert "--out" in said(capsys, run)
    assert {path.name for path in tmp_path.iterdir()} == {"run", "link.html"}


def test_runs_that_are_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run, out = report_runs.study(tmp_path / "run"), ("--out", tmp_path / "x.html")
    (tmp_path / "empty").mkdir()
    (tmp_path / "again").symlink_to(run)
    assert "there is no" in said(capsys, tmp_path / "none", *out)
    assert "is no run (no config.json in it)" in said(capsys, tmp_path / "empty", *out)
    assert "is no run" in said(capsys, run / "results.csv", *out)
    assert "is the same run as" in said(capsys, run, tmp_path / "again", *out)
    many = [tmp_path / str(i) for i in range(9)]
    assert "9 runs are given; give 1 to 8" in said(capsys, *many, *out)
    assert not (tmp_path / "x.html").exists()


def cut(name: str, size: int) -> Callable[[Path], object]:
    """Return what leaves the beginning of a file."""
    return lambda run: (run / name).write_bytes((run / name).read_bytes()[:size])


def put(name: str, content: str | bytes) -> Callable[[Path], object]:
    """Return what writes a file."""
    return lambda run: report_runs.written(run, {name: content})


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (cut("config.json", 80), r"config.json, line 1: no JSON"),
        (put("config.json", "[]"), "config.json: an object is wanted"),
        (put("config.json", "{}"), "config.json: no 'command' in it"),
        (put("config.json", "[" * 100_000), "config.json: no JSON"),
        (put("config.json", b"\xff\xfe"), "config.json: .* not text in UTF-8"),
        (put("results.csv", "a,b\n1,2\n1\n"), "results.csv, line 3: 1 fields where the header"),
        (put("results.csv", 'a,b\n1,"2\n'), "results.csv, line 2: no CSV"),
        (put("results.csv", "a,a\n"), "results.csv, line 1: two columns are called 'a'"),
        (put("results.csv", ""), "results.csv, line 1: the table has no header"),
        (put("results.parquet", "PAR1"), "results.parquet: no Parquet file"),
        (put("tables.json", '{"tables": [1]}'), "tables.json: not the tables"),
        (put("study.toml", "a = 1\nb\n"), "study.toml: no TOML: .*line 2"),
        (put("result.json", "{"), "result.json, line 1: no JSON"),
        (put("figures/curves.png", "GIF89a"), "curves.png: it is no PNG picture"),
        (lambda run: os.mkfifo(run / "more.csv"), "more.csv: it is a pipe"),
        (lambda run: (run / "more.csv").symlink_to("/etc/hostname"), "it is a symbolic link"),
        (lambda run: (run / "more.xml").mkdir(), "more.xml: it is a folder"),
    ],
)
def test_a_damaged_run_is_refused_in_one_line(
    spoil: Callable[[Path], object],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    run = report_runs.study(tmp_path / "run")
    spoil(run)
    assert re.search(words, said(capsys, run, "--out", tmp_path / "x.html"))
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_damaged_time_series_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = report_runs.study_file(tmp_path / "run")
    (path,) = (run / "traces").iterdir()
    path.write_bytes(path.read_bytes()[:-40])
    assert path.name in said(capsys, run, "--out", tmp_path / "x.html")


def test_a_table_without_names_is_shown_and_not_compared(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("x,x_low,x_high\n1,0,2\n1,0,2\n")
    frame = read_csv(tmp_path / "t.csv")
    assert keys_of(frame) == [] and points_of(frame) == []
    assert of_frame(frame).rows[0][0].text == "1 [0, 2]"
