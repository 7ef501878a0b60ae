"""The robot by its numbers: all commands take them, runs keep them, contradictions are one line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from studies.main import main

ROBOT = ["--robot.r", "0", "--robot.payload", "0.02", "--robot.payload-inertia", "1e-5"]
SMALL = ["--generations", "2", "--population", "6", "--survivors", "2"]


def run(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(words) == 0, capsys.readouterr().err
    return capsys.readouterr().out


def test_a_tuning_keeps_its_robot_and_resumes_with_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    damped = ["--modal-damping", "0.001", "0.002", "0.003"]
    run(["tune", "--plant", "both", *SMALL, *ROBOT, *damped, "--out", str(folder)], capsys)
    kept = json.loads((folder / "config.json").read_text())["configuration"]
    assert (kept["robot"]["r"], kept["robot"]["payload"]) == (0.0, 0.02)
    assert kept["modal_damping"] == [0.001, 0.002, 0.003]
    table = (folder / "generations.csv").read_bytes()
    (folder / "generations.csv").write_bytes(b"".join(table.splitlines(keepends=True)[:7]))
    (folder / "result.json").unlink()
    run(["tune", "--resume", str(folder)], capsys)
    assert (folder / "generations.csv").read_bytes() == table
    assert main(["tune", "--resume", str(folder), "--robot.r", "0.1"]) == 2
    assert "--robot" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        pytest.param(
            ["compare", "--quick", "--out", "run", "--format", "png"], marks=pytest.mark.slow
        ),
        ["stability", "--quick", "--map-points", "0", "--zero-draws", "0", "--out", "run"],
        ["modes"],
        ["crosscheck"],
    ],
    ids=lambda words: words[0],
)
def test_a_robot_with_a_payload_on_its_axis(
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert json.loads(run([*words, *ROBOT, "--json"], capsys))


def test_what_a_chain_does_not_follow_of_modal_damping_is_said(
    capsys: pytest.CaptureFixture[str],
) -> None:
    shown = " ".join(run(["modes", "--modal-damping", "0.001", "0.002", "0.0005"], capsys).split())
    assert "have the damping ratios 0.001, 0.002, 0.0005" in shown
    assert "in proportion to stiffness, 0.001, 0.00627, 0.0175" in shown
    assert "damping ratios" not in run(["modes"], capsys).split("Clamped")[0]


def test_a_chain_of_that_robot_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "loaded.xml"
    shown = run(["chain", *ROBOT, "--out", str(path)], capsys)
    assert "with the payload, clamped:" in shown
    text = path.read_text()
    assert '<body name="payload"' in text and 'name="beam_payload" data="0.02"' in text
    assert json.loads(run(["modes", str(path), "--json"], capsys))["clamped_hz"]["exact"]


def test_the_front_is_shown_and_nothing_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    rows = json.loads(run(["chain", "--front", "--json"], capsys))["front"]
    assert [row["chosen"] for row in rows].count("chosen") == 1
    assert [row["top"] for row in rows] == sorted(row["top"] for row in rows)
    assert "under payloads" in run(["chain", "--front"], capsys)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["modes", "--robot.zeta", "2"], "--robot.zeta is 2, mode 1's damping ratio"),
        (["modes", "--modal-damping", "0.1", "0.1"], "has 2 ratios for 3 modes"),
        (["modes", "--robot.payload", "-1"], "parameter payload (mass of a payload at the tip)"),
        (["modes", "--robot.payload", "1e6"], "give 785 kg at most"),
        (["chain", "--front", "--out", "x.xml"], "--out has no effect with --front"),
        (["chain", "--front", "--force"], "--force has no effect with --front"),
        (["chain", "--front", "--timestep", "5e-4"], "--timestep has no effect with --front"),
        (["chain"], "--out is missing"),
    ],
)
def test_one_line_says_what_is_wrong(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    complaint = capsys.readouterr().err
    assert said in complaint and complaint.count("\n") == 1
