"""A run's folder: there when all of it is written, and otherwise not at all."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from flexsim import RunError
from studies.core.folder import CONFIG, run_folder, to_json, versions, write_config, write_rows
from studies.main import TERMINATED

PATIENCE = 60.0  # [s] for a command to start


@dataclass(frozen=True)
class Config:
    out: Path
    seed: int = 1


def finished(out: Path, text: str = "first") -> Path:
    with run_folder(out, force=False) as folder:
        write_config(folder, Config(out))
        (folder / "results.csv").write_text(text)
    return out


def test_appears_whole_and_only_at_the_end(tmp_path: Path) -> None:
    out = tmp_path / "runs" / "one"
    with run_folder(out, force=False) as folder:
        (folder / "a").write_text("a")
        assert not out.exists() and folder.parent == out.parent
    assert [path.name for path in out.iterdir()] == ["a"]
    assert list(out.parent.iterdir()) == [out]
    assert out.stat().st_mode & 0o777 == 0o755  # others may read it


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_nothing_stays_of_a_run_that_fails(tmp_path: Path, failure: type[BaseException]) -> None:
    with pytest.raises(failure):
        with run_folder(tmp_path / "new" / "runs" / "one", force=False) as folder:
            (folder / "a").write_text("a")
            raise failure
    assert list(tmp_path.iterdir()) == []


def test_a_parent_that_was_there_stays(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    with pytest.raises(ValueError), run_folder(tmp_path / "runs" / "new" / "one", force=False):
        raise ValueError
    assert [path.name for path in tmp_path.rglob("*")] == ["runs"]


def test_force_replaces_a_run(tmp_path: Path) -> None:
    out = finished(tmp_path / "one")
    with run_folder(out, force=True) as folder:
        (folder / "b").write_text("b")
    assert [path.name for path in out.iterdir()] == ["b"]


def test_a_failing_run_keeps_the_one_before(tmp_path: Path) -> None:
    out = finished(tmp_path / "one")
    with pytest.raises(ValueError), run_folder(out, force=True) as folder:
        (folder / "results.csv").write_text("second")
        raise ValueError
    assert (out / "results.csv").read_text() == "first"
    assert list(tmp_path.iterdir()) == [out]


def test_force_spares_what_is_no_run(tmp_path: Path) -> None:
    mine = tmp_path / "thesis"
    mine.mkdir()
    (mine / "chapter1").write_text("words")
    for out in (mine, mine / "chapter1"):
        with pytest.raises(RunError, match=f"not a run of ours.*{CONFIG}"):
            with run_folder(out, force=True):
                pytest.fail("the block must not run")
    assert (mine / "chapter1").read_text() == "words"


def test_says_why_it_cannot_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = finished(tmp_path / "one")
    with pytest.raises(RunError, match=r"exists already.*--force"), run_folder(out, force=False):
        pytest.fail("the block must not run")
    file = out / "results.csv"
    for below in (file / "two", file / "two" / "three"):
        with pytest.raises(RunError, match=r"cannot write there: .*(folder|directory)"):
            with run_folder(below, force=False):
                pytest.fail("the block must not run")

    def refuse(**_: object) -> str:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "mkdtemp", refuse)  # root may write anywhere
    with pytest.raises(RunError, match="two: cannot write there: Permission denied"):
        with run_folder(tmp_path / "two", force=False):
            pytest.fail("the block must not run")


def test_config_names_what_made_the_run(tmp_path: Path) -> None:
    write_config(tmp_path, Config(Path("runs/one"), seed=7), cases=["line"])
    content = json.loads((tmp_path / CONFIG).read_text())
    assert content["configuration"] == {"out": "runs/one", "seed": 7}
    assert content["cases"] == ["line"]
    assert content["command"][0] == "flexsim"
    assert content["versions"] == versions()
    assert all(text[0].isdigit() for name, text in versions().items() if name != "platform")


def test_rows_read_back_to_the_same_doubles(tmp_path: Path) -> None:
    rows = [{"x": 0.1 + 0.2, "name": "a,b", "none": None}, {"x": 1e-300, "name": "c", "none": 1}]
    write_rows(tmp_path / "rows.csv", rows)
    with (tmp_path / "rows.csv").open(newline="") as file:
        back = list(csv.DictReader(file))
    assert [float(row["x"]) for row in back] == [row["x"] for row in rows]
    assert back[0]["name"] == "a,b" and back[0]["none"] == ""


def test_json_is_strict() -> None:
    content = {
        "array": np.array([1.0, np.nan, -np.inf]),
        "number": np.float64(0.1),
        "flag": np.bool_(True),
        "tuple": (1, None, float("inf")),
        "path": Path("a/b"),
    }

    def refuse(name: str) -> None:
        pytest.fail(f"{name} is not JSON")

    back = json.loads(to_json(content), parse_constant=refuse)
    assert back == {
        "array": [1.0, None, None],
        "number": 0.1,
        "flag": True,
        "tuple": [1, None, None],
        "path": "a/b",
    }


def test_a_study_that_is_ended_clears_its_folder_away(tmp_path: Path) -> None:
    code = "import sys; from studies.main import main; sys.exit(main(sys.argv[1:]))"
    words = ["ladder", "--out", str(tmp_path / "run")]
    process = subprocess.Popen([sys.executable, "-c", code, *words], stderr=subprocess.PIPE)
    deadline = time.monotonic() + PATIENCE
    while not any(tmp_path.iterdir()) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert any(tmp_path.iterdir())
    process.terminate()
    process.communicate()
    assert process.returncode == TERMINATED
    assert not any(tmp_path.iterdir())
