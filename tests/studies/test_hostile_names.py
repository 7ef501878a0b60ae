"""Text from files and options is text: neither markup, nor lines, nor orders to the terminal."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import numpy as np
import pytest
from edits import DEFAULT

from studies.core.console import console
from studies.core.text import one_line, spelled
from studies.main import main

FOLDER, FILE = "[red]a[", "]:smile: b\nc\x1b[31m\x07d"  # as a path, [red] ... [/] ...
SPELLED = "[red]a[/]:smile: b\\nc\\x1b[31m\\x07d"
STUDIES = Path(__file__).parents[2] / "studies"


@pytest.fixture
def hostile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A path like no other, within the current folder."""
    monkeypatch.chdir(tmp_path)
    Path(FOLDER).mkdir()
    return f"{FOLDER}/{FILE}"


def ran(capsys: pytest.CaptureFixture[str], status: int, *words: str) -> tuple[str, str]:
    """Return what a command prints, which gives the terminal no orders."""
    assert main(list(words)) == status
    out, err = capsys.readouterr()
    assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f-\x9f]", out + err)
    return out, err


def test_names_are_spelled_out() -> None:
    assert spelled(f"{FOLDER}/{FILE}") == SPELLED
    assert spelled("\udcff é ü 漢") == "\\udcff é ü 漢"
    assert one_line(" a\n  b\x1b[0m\x85c ") == "a b\\x1b[0m c"


def test_consoles_print_strings_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    console().print("[bold]a[/] [/nothing] :smile: [link=x]")
    assert capsys.readouterr().out == "[bold]a[/] [/nothing] :smile: [link=x]\n"


def test_every_console_is_ours() -> None:
    """So that no study reads markup: the one place where a console is made, and bars of text."""
    for path in STUDIES.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                if node.func.id == "Console":
                    assert path.name == "console.py", path
                if node.func.id == "TextColumn":
                    assert any(each.arg == "markup" for each in node.keywords), path
            if isinstance(node, ast.ImportFrom) and node.module:
                assert node.module != "rich.markup", path
                assert node.module != "rich" or "print" not in [a.name for a in node.names], path


@pytest.mark.parametrize(
    "words",
    [
        "modes FILE.xml",
        "crosscheck --mjcf FILE.xml",
        "compare --quick --mjcf FILE.xml",
        "drive --torque FILE.csv --out o.csv",
        "tune --distribution FILE.toml",
        "tune --resume FILE",
        "watch FILE.xml --no-viewer",
        "view FILE",
    ],
)
def test_a_file_that_is_not_there(
    words: str, hostile: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its name is in the one line of the complaint, as it is; a new line in it is a blank."""
    out, err = ran(capsys, 2, *[word.replace("FILE", hostile) for word in words.split()])
    assert out == "" and err.count("\n") == 1
    assert SPELLED.replace("\\n", " ") in err


@pytest.mark.parametrize(
    "words",
    [["HOSTILE"], ["modes", "--beam", "HOSTILE"], ["compare", "--HOSTILE"], ["tune", "HOSTILE"]],
)
def test_words_that_are_not_understood(
    words: list[str], hostile: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out, err = ran(capsys, 2, *[word.replace("HOSTILE", hostile) for word in words])
    assert out == "" and err.count("\n") == 1
    assert "[red]a[/]:smile:" in err


def test_a_file_that_is_there(hostile: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A robot, a torque, what is written: each name on one line of its own, as it is."""
    site = '<site name="[red]s&#10;1[/]" pos="0.1 0 0"/>'
    text = DEFAULT.replace('<site name="tip"', f'{site}\n<site name="tip"')
    Path(f"{hostile}.xml").write_text(text)
    lines = [f"{k * 1e-3:.3f},0,0" for k in range(3)]
    Path(f"{hostile}.csv").write_text("\n".join(["t,tau1,tau2", *lines, ""]))
    out, _ = ran(capsys, 0, "modes", f"{hostile}.xml")
    assert f"{SPELLED}.xml" in out
    drive = ("drive", "--mjcf", f"{hostile}.xml", "--torque", f"{hostile}.csv")
    out, _ = ran(capsys, 0, *drive, "--out", f"{hostile}.out")
    assert f"{SPELLED}.out: 3 rows" in out
    assert np.genfromtxt(f"{hostile}.out", delimiter=",", names=True).size == 3
    out, _ = ran(capsys, 0, "chain", "--out", f"{hostile}.chain.xml")
    assert f"{SPELLED}.chain.xml: tuned chain" in out
    out, _ = ran(capsys, 0, "watch", f"{hostile}.xml", "--once", "--no-viewer")
    assert "[red]" not in out or SPELLED in out


def test_a_run_in_a_folder_of_such_a_name(hostile: str, capsys: pytest.CaptureFixture[str]) -> None:
    small = ("--population", "4", "--survivors", "2", "--generations", "2", "--modes", "1")
    out, _ = ran(capsys, 0, "tune", *small, "--trajectory", "circle", "--out", hostile)
    assert out.splitlines()[-1].startswith(f"{SPELLED}: generations.csv")
    assert Path(hostile, "result.json").is_file()
    out, _ = ran(capsys, 0, "tune", "--resume", hostile)
    assert f"{SPELLED}: " in out
