"""What all studies share: options checked once, a quick run, one object for programs."""

from __future__ import annotations

import dataclasses
import importlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest
from matplotlib.figure import Figure
from quick_run import QuickRun

from flexsim import FlexsimError, ParameterError
from studies.core.carry_out import Study
from studies.core.figures import canvas, finish
from studies.core.study_options import Out, SeedOptions, StudyOptions, ThreadOptions
from studies.core.table import Column, Table
from studies.main import COMMANDS, main

STUDIES = (
    *("arena", "compare", "converge", "laboratory", "ladder", "misprints", "pid-question"),
    *("realisations", "reconstruct", "rules", "screening", "stability", "structures", "tables"),
)
FILES = ("run", "check")  # of a study file, which has the options that studies share
SHARED = ("--out", "--force", "--quick", "--json", "--mjcf", "--beam", "--format")


@dataclasses.dataclass(frozen=True)
class Options(ThreadOptions, SeedOptions, StudyOptions):
    QUICK: ClassVar = {"perturbations": 2, "plants": 1}

    out: Out = Path("runs/test")
    plants: tuple[str, ...] = ("a", "b")
    perturbations: int = 5


@dataclasses.dataclass(frozen=True)
class Row:
    x: float


STUDY: Study[Options, list[Row]] = Study(
    lambda config, progress: [Row(float(config.asked().perturbations))],
    lambda rows: [Table(rows, (Column("x", form="g"),), key="rows", file="rows.csv")],
    lambda rows: f"x is {rows[0].x:g}.",
    facts=lambda rows: {"count": len(rows)},
    question="What is x?",
)


def test_a_study_writes_and_tells_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = Options(out=tmp_path / "run", quick=True, json=True)
    STUDY(config)
    shown = json.loads(capsys.readouterr().out)
    about = {"count": 1, "hardware": "ideal", "run": str(config.out)}
    assert shown == {"rows": [{"x": 2.0}], **about}
    assert (config.out / "rows.csv").read_text() == "x\n2.0\n"
    assert (config.out / "rows.md").read_text() == "| x |\n| ---: |\n| 2 |\n"
    assert "\nx \\\\\n\\midrule\n2 \\\\\n" in (config.out / "rows.tex").read_text()
    about = json.loads((config.out / "config.json").read_text())
    assert about["configuration"]["perturbations"] == 5
    assert about["ran"]["perturbations"] == 2 and about["count"] == 1
    assert (about["question"], about["answer"]) == ("What is x?", "x is 2.")
    (table,) = json.loads((config.out / "tables.json").read_text())["tables"]
    assert table["lines"] == [["2"]] and table["columns"][0]["number"]
    STUDY(dataclasses.replace(config, json=False, force=True))
    assert capsys.readouterr().out.splitlines()[-2:] == ["x is 2.", f"{config.out}: rows.csv"]


def test_figures_come_in_the_formats_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def figures(rows: list[Row]) -> Iterator[tuple[str, Figure]]:
        figure, panels = canvas(height=30)
        yield "drawn", finish(figure, panels.flat, caption="Nothing.")

    study = dataclasses.replace(STUDY, figures=figures)
    study(Options(out=tmp_path / "run", json=True, format=("svg", "pdf")))
    names = {path.name for path in (tmp_path / "run" / "figures").iterdir()}
    assert names == {"drawn.svg", "drawn.pdf", "captions.md"}
    capsys.readouterr()
    assert main(["compare", "--format", "eps", "--out", str(tmp_path / "no")]) == 2
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1 and "format" in complaint and "eps" in complaint


def test_quick_cuts_numbers_and_lists_but_raises_none() -> None:
    asked = Options(quick=True).asked()
    assert (asked.perturbations, asked.plants) == (2, ("a",))
    assert Options(quick=True, perturbations=1).asked().perturbations == 1
    assert Options() == Options().asked()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"perturbations": 0}, "perturbations is 0; give 1 or more"),
        ({"seed": -1}, "seed is -1; give 0 or more"),
        ({"threads": 0}, "threads is 0; give 1 to"),
        ({"plants": ("a", "a")}, "plants are a a; name each once"),
        ({"plants": ()}, "plants are empty; name each once"),
        ({"format": ("png", "png")}, "formats are png png; name each once"),
    ],
)
def test_shared_options_are_checked_in_one_place(wrong: dict[str, Any], words: str) -> None:
    for quick in (False, True):
        with pytest.raises(ParameterError, match=words):
            Options(quick=quick, **wrong).asked()


def test_nothing_stays_of_a_study_that_fails(tmp_path: Path) -> None:
    with pytest.raises(FlexsimError):
        STUDY(Options(out=tmp_path / "run", seed=-1))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", STUDIES)
def test_every_study_has_the_shared_options(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, "--help"]) == 0
    text = capsys.readouterr().out
    assert all(option in text for option in SHARED)
    assert "Folder of the run, made anew." in " ".join(text.split())


@pytest.mark.parametrize("command", STUDIES)
def test_every_study_has_a_question(command: str) -> None:
    study = importlib.import_module(f"studies.{COMMANDS[command][0]}").command
    assert isinstance(study, Study) and study.question.endswith("?")


def test_studies_are_those_with_a_quick_run(capsys: pytest.CaptureFixture[str]) -> None:
    found = []
    for command in COMMANDS:
        assert main([command, "--help"]) == 0
        if "--quick" in capsys.readouterr().out:
            found.append(command)
    assert sorted(found) == sorted((*STUDIES, *FILES))


def test_a_run_says_where_its_recording_is_seen(quick: Callable[[str], QuickRun]) -> None:
    run = quick("stability")
    assert (
        run.text.splitlines()[-1] == f"{run.folder}: figures/, results.csv, screens.csv, zeros.csv"
    )
