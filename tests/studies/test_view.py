"""`flexsim view` opens any run: its recording, or what else it has; several together."""

from __future__ import annotations

import json
import shutil
import socket
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from recorded_cases import made_up_cases
from rerun.chunk import Chunk, RrdReader

from flexsim import Parameters
from flexsim.recording import rerun_file
from flexsim.recording.rrd import write_recording
from flexsim.recording.tuning.convergence import write_convergence
from studies.core.figures import save
from studies.main import main

STUDY = """
title = "Which holds?"
repeats = 2
plants = ["assumed-modes", "closed-chain"]
controllers = ["line", "circle"]
[[trajectories]]
use = "line"
duration = 0.06
hold = 0.02
end = [0.69, 0.21]
"""


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[], list[list[str]]]:
    """Stand in for the viewer, which takes down its words and ends well; give what it took."""
    taken = tmp_path / "taken"
    keeps = f"import shutil; shutil.copy(sys.argv[1], {str(tmp_path / 'shown.rrd')!r})"
    tool = f"import json, sys; {keeps}; open({str(taken)!r}, 'a').write(json.dumps(sys.argv[1:]))"
    tool += f"; open({str(taken)!r}, 'a').write(chr(10))"
    monkeypatch.setattr(rerun_file, "RERUN_TOOL", (sys.executable, "-c", tool))
    return lambda: [json.loads(line) for line in taken.read_text().splitlines()]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of runs: two with recordings, one with figures and tables only, two tunings."""
    where = tmp_path_factory.mktemp("runs")
    for number, name in enumerate(("one", "two")):
        (where / name).mkdir()
        (where / name / "config.json").write_text(json.dumps({"command": ["flexsim", name]}))
        write_recording(
            where / name / "run.rrd", made_up_cases()[: 2 - number], {"seed": name}, Parameters()
        )
    plain = where / "plain"
    (plain / "figures").mkdir(parents=True)
    figure = Figure(figsize=(2, 1))
    figure.subplots().plot([0, 1])
    save(figure, plain / "figures" / "a_figure.png")
    (plain / "rows.csv").write_text("name,x\n*b* [l](u) <script>,0.123456789\n")
    config = {"configuration": {"out": "a|b", "list": [1, 2]}, "versions": {"python": "3"}}
    (plain / "config.json").write_text(json.dumps(config))
    for name in ("tune1", "tune2"):
        (where / name).mkdir()
        (where / name / "config.json").write_text("{}")
        best = np.array([3e-3, 1e-3])
        write_convergence(where / name / "convergence.rrd", "index", best, best, best, {"n": name})
    return where


def chunks(path: Path) -> dict[str, list[Chunk]]:
    found: dict[str, list[Chunk]] = {}
    for chunk in RrdReader(path).store().stream().to_chunks():
        found.setdefault(chunk.entity_path, []).append(chunk)
    return found


def moving(every: list[Chunk]) -> Chunk:
    (found,) = (chunk for chunk in every if not chunk.is_static)
    return found


def titles(path: Path) -> set[str]:
    """Return the names of all views and tabs of a recording's layout."""
    reader, found = RrdReader(path), set()
    for chunk in reader.stream(store=reader.blueprints()[0]).to_chunks():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if name.endswith("display_name"):
                found.update(batch.column(name)[0].as_py())
    return found


def text(path: Path, entity: str) -> str:
    (chunk,) = chunks(path)[entity]
    batch = chunk.to_record_batch()
    name = next(each for each in batch.schema.names if each.endswith("text"))
    said: str = batch.column(name)[0].as_py()[0]
    return said


def test_a_recording_is_opened_as_it_is(runs: Path, started: Callable[[], list[list[str]]]) -> None:
    assert main(["view", str(runs / "one")]) == 0
    assert main(["view", str(runs / "one" / "run.rrd"), "--web"]) == 0
    assert main(["view", str(runs / "tune1")]) == 0
    opened = [runs / "one" / "run.rrd"] * 2 + [runs / "tune1" / "convergence.rrd"]
    assert [words[0] for words in started()] == [str(path.resolve()) for path in opened]
    assert ["--web-viewer" in words for words in started()] == [False, True, False]


def test_two_may_be_shown_in_browsers_at_once(
    runs: Path, started: Callable[[], list[list[str]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        monkeypatch.setattr(rerun_file, "WEB_PORT", other.getsockname()[1])
        assert main(["view", str(runs / "one"), "--web"]) == 0
    assert main(["view", str(runs / "one"), "--web"]) == 0
    first, second = started()
    assert first[-5:] == ["--web-viewer", "--port", "auto", "--web-viewer-port", "0"]
    assert second[-3:] == ["--web-viewer", "--port", "auto"]


def test_several_stand_side_by_side(
    runs: Path, started: Callable[[], list[list[str]]], tmp_path: Path
) -> None:
    assert main(["view", str(runs / "one"), str(runs / "two")]) == 0
    (words,) = started()
    assert not Path(words[0]).exists()  # made for this, and gone
    shown = chunks(tmp_path / "shown.rrd")
    own = chunks(runs / "one" / "run.rrd")
    for entity in ("line_tuned/curves", "line_tuned/scene/chain/beam", "line_paper/curves"):
        mine, there = moving(own[f"/{entity}"]), moving(shown[f"/one/{entity}"])
        assert mine.to_record_batch().num_rows == there.to_record_batch().num_rows
        assert there.timeline_names == ["simulation_time"]
    assert "/two/line_tuned/curves" in shown and "/two/line_paper/curves" not in shown
    assert {"line_tuned", "line_paper", "one", "two"} <= titles(tmp_path / "shown.rrd")


def test_what_has_no_recording_shows_figures_and_tables(runs: Path, tmp_path: Path) -> None:
    path = tmp_path / "plain.rrd"
    assert main(["view", str(runs / "plain"), "--save", str(path)]) == 0
    found = chunks(path)
    (image,) = found["/pages/a_figure"]
    blob = image.to_record_batch().column("EncodedImage:blob")[0].as_py()
    assert bytes(blob[0]) == (runs / "plain" / "figures" / "a_figure.png").read_bytes()
    said = text(path, "/pages/tables")
    assert "\\*b\\* \\[l\\](u) \\<script\\>" in said and "0.123457" in said
    assert "| configuration.out | a\\|b |" in text(path, "/pages/config")
    assert {"a figure", "tables", "how it was made"} <= titles(path)


def test_a_table_for_reading_is_preferred(runs: Path, tmp_path: Path) -> None:
    run = Path(shutil.copytree(runs / "plain", tmp_path / "run"))
    (run / "rows.md").write_text("| x |\n| ---: |\n| 0.12 [0.11, 0.13] |\n")
    assert main(["view", str(run), "--save", str(tmp_path / "it.rrd")]) == 0
    said = text(tmp_path / "it.rrd", "/pages/tables")
    assert "# rows.csv" in said and "0.12 [0.11, 0.13]" in said and "0.123457" not in said


def test_anything_stands_beside_anything(runs: Path, tmp_path: Path) -> None:
    path = tmp_path / "all.rrd"
    words = [str(runs / name) for name in ("plain", "one", "tune1")]
    assert main(["view", *words, "--save", str(path)]) == 0
    found = chunks(path)
    assert {"/one/line_tuned/curves", "/plain/pages/tables", "/tune1/convergence/best"} <= set(
        found
    )


def test_two_tunings_share_their_timeline(runs: Path, tmp_path: Path) -> None:
    path = tmp_path / "both.rrd"
    assert main(["view", str(runs / "tune1"), str(runs / "tune2"), "--save", str(path)]) == 0
    found = chunks(path)
    for name in ("tune1", "tune2"):
        (chunk,) = found[f"/{name}/convergence/best"]
        assert chunk.timeline_names == ["generation"]


def test_a_study_is_carried_out_again(tmp_path: Path) -> None:
    """All plants of a cell are one case; their curves are those of the study's own figures."""
    (tmp_path / "study.toml").write_text(STUDY)
    run, path = tmp_path / "run", tmp_path / "it.rrd"
    assert main(["run", str(tmp_path / "study.toml"), "--out", str(run), "--format", "png"]) == 0
    assert main(["view", str(run), "--save", str(path), "--case", "circle"]) == 0
    found = chunks(path)
    assert "/circle/curves" in found and "/line/curves" not in found
    (chunk,) = found["/circle/curves"]
    batch = chunk.to_record_batch()
    assert {"assumed_modes", "closed_chain", "difference"} <= set(batch.schema.names)
    error = batch.column("assumed_modes").flatten().field("tip_error_mm").to_numpy()
    import pyarrow.parquet as pq

    rows = pq.read_table(run / "results.parquet").to_pylist()
    (row,) = (
        each
        for each in rows
        if (each["plant"], each["controller"], each["repeat"]) == ("assumed-modes", "circle", 0)
    )
    assert error.max() == pytest.approx(1e3 * row["max_error"], rel=1e-6)
    assert f"run {row['run']}" in text(path, "/circle/notes")


def test_any_name_of_a_figure_or_a_run_will_do(
    runs: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Names from outside are no paths of entities; runs of one name are told apart by folder."""
    odd = tmp_path / "plain"
    shutil.copytree(runs / "plain", odd)
    (odd / "figures" / "a_figure.png").rename(odd / "figures" / "a [b]\n'c'.png")
    path = tmp_path / "odd.rrd"
    assert main(["view", str(odd), str(runs / "plain"), "--save", str(path)]) == 0
    assert "WARN" not in capfd.readouterr().err
    found = chunks(path)
    assert {"/plain/pages/a\\ \\[b\\]\\n\\'c\\'", "/plain_/pages/a_figure"} <= set(found)
    (name,) = {
        each.to_record_batch().column("RecordingInfo:name")[0].as_py()[0]
        for each in found["/__properties"]
    }
    assert name == f"{odd} | {runs / 'plain'}"


def test_a_run_that_is_not_finished_says_so(runs: Path, tmp_path: Path) -> None:
    (tmp_path / "half").mkdir()
    (tmp_path / "half" / ".flexsim-run").write_text('{"flexsim": "run", "unfinished": true}')
    path = tmp_path / "half.rrd"
    assert main(["view", str(tmp_path / "half"), "--save", str(path)]) == 0
    assert "Unfinished" in text(path, "/pages/config")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "no run is named"),
        (["missing"], "there is no missing; give the folder of a run or an .rrd file"),
        (["empty"], "empty is no run of flexsim; give the folder of a run"),
        (["notes.txt"], "notes.txt is no recording; give the folder of a run"),
        (["one", "one"], "the same run is named twice; name each once"),
        (["one", "./one"], "the same run is named twice"),
        (
            ["one", "--case", "circle"],
            "there is no tab 'circle'; choose one of overview",
        ),
        (["one", "--save", "it.txt"], "--save it.txt: give a file that ends with .rrd"),
        (["one", "--save", "old.rrd"], "old.rrd exists already; name another file with --save, or"),
        (["one", "--save", "none/it.rrd"], "none/it.rrd: cannot write the recording"),
        (["bad.rrd"], "bad.rrd: cannot read the recording"),
        (["cut.rrd"], "cut.rrd: cannot read the recording"),
        (["one", "cut.rrd"], "cut.rrd: cannot read the recording"),
        (["one", "bad.rrd"], "bad.rrd: cannot read the recording"),
        (["one", "foreign.rrd"], "foreign.rrd does not say what it shows"),
        (["odd", "--save", "it.rrd"], "a.png: cannot read the figure: it is no PNG file"),
        (["json", "--save", "it.rrd"], "config.json: cannot read the configuration"),
    ],
)
def test_what_cannot_be_opened_is_one_line(
    words: list[str],
    said: str,
    runs: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    import rerun as rr

    monkeypatch.chdir(tmp_path)
    shutil.copytree(runs / "one", "one")
    Path("empty").mkdir()
    Path("notes.txt").touch()
    Path("old.rrd").write_text("old")
    Path("bad.rrd").write_text("no recording")
    whole = Path("one/run.rrd").read_bytes()
    Path("cut.rrd").write_bytes(whole[: len(whole) // 2])
    with rr.RecordingStream("other") as stream:
        stream.save("foreign.rrd")
        stream.log("a", rr.Scalars(1.0))
    stream.disconnect()
    for name in ("odd", "json"):
        Path(name).mkdir()
        Path(name, "config.json").write_text("{}" if name == "odd" else "{")
    Path("odd/figures").mkdir()
    Path("odd/figures/a.png").write_text("<svg>")
    before = sorted(Path().rglob("*"))
    assert main(["view", *words]) == 2
    complaint = capsys.readouterr().err
    assert said in complaint and complaint.count("\n") == 1
    assert sorted(Path().rglob("*")) == before and Path("old.rrd").read_text() == "old"


def test_a_file_is_replaced_if_asked(runs: Path, tmp_path: Path) -> None:
    path = tmp_path / "it.rrd"
    path.write_text("old")
    assert main(["view", str(runs / "one"), "--save", str(path), "--force"]) == 0
    again = tmp_path / "again.rrd"  # what was written can be opened beside others
    assert main(["view", str(path), str(runs / "two"), "--save", str(again)]) == 0
    assert {"/it/line_tuned/curves", "/two/line_tuned/curves"} <= set(chunks(again))
