"""The study files that come with flexsim: each runs, and is found where the README says."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from studies.main import main
from studies.run.run import workshop_of
from studies.spec.corners import require_buildable
from studies.spec.example import EXAMPLE

BENT = (
    "payloads",
    "paper",
    "one-link",
)  # further than the equations of second order hold, by the figures
FILES = sorted((Path(__file__).parents[3] / "studies" / "files").glob("*.toml"))


SLOW = ("one-link", "two-flexible")  # long holds; a minute of compiling for two beams


def test_they_are_nine() -> None:
    assert [path.stem for path in FILES] == [
        *("arena", "damping", "integrators", "monte-carlo", "one-link", "paper", "payloads"),
        *("two-flexible", "waypoints"),
    ]


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=[pytest.mark.slow] if path.stem in SLOW else []) for path in FILES],
    ids=[path.stem for path in FILES],
)
def test_each_runs_quickly(path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    require_buildable(workshop_of(path))  # all of it, at its corners
    assert main(["run", str(path), "--quick", "--out", str(tmp_path / "run")]) == 0
    said = capsys.readouterr().out
    assert "diverged" in said
    beyond = "Note: assumed-modes: v/L reaches" in said
    assert beyond == (path.stem in BENT)
    assert tomllib.loads(path.read_text())["title"]


def test_the_example_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "--example"]) == 0
    text = capsys.readouterr().out
    assert text == EXAMPLE
    (tmp_path / "study.toml").write_text(text)
    out = tmp_path / "run"
    assert main(["run", str(tmp_path / "study.toml"), "--quick", "--out", str(out)]) == 0


def test_no_file_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run"]) == 2
    assert "no study file is given; write one: flexsim run --example" in capsys.readouterr().err
