"""A run's folder: there when all of it is written, and otherwise not at all."""

from __future__ import annotations

import errno
import json
import os
import signal
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from processes import PATIENCE, flexsim, wait_for

from flexsim import RunError
from flexsim.files.scratch import NEW
from studies.core.ending import TERMINATED
from studies.core.folder import CONFIG, origin, run_folder, to_json, versions, write_config
from studies.core.folders.marker import MARKER


@dataclass(frozen=True)
class Config:
    out: Path
    seed: int = 1


def finished(out: Path, text: str = "first") -> Path:
    with run_folder(out, force=False) as folder:
        write_config(folder, Config(out))
        (folder / "results.csv").write_text(text)
        (folder / "figures").mkdir()
    return out


def test_appears_whole_and_only_at_the_end(tmp_path: Path) -> None:
    out = tmp_path / "runs" / "one"
    with run_folder(out, force=False) as folder:
        (folder / "a").write_text("a")
        assert not out.exists() and folder.parent.parent == out.parent
    assert {path.name for path in out.iterdir()} == {"a", MARKER}
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
    assert {path.name for path in out.iterdir()} == {"b", MARKER}


def test_a_failing_run_keeps_the_one_before(tmp_path: Path) -> None:
    out = finished(tmp_path / "one")
    with pytest.raises(ValueError), run_folder(out, force=True) as folder:
        (folder / "results.csv").write_text("second")
        raise ValueError
    assert (out / "results.csv").read_text() == "first"
    assert list(tmp_path.iterdir()) == [out]


def refused(out: Path, words: str) -> None:
    """Check that --force does not replace a folder, nor touches anything about it."""
    before = {path: path.lstat() for path in out.parent.rglob("*")}
    with pytest.raises(RunError, match=words), run_folder(out, force=True):
        pytest.fail("the block must not run")
    after = {path: path.lstat() for path in out.parent.rglob("*")}
    assert after.keys() == before.keys()
    assert all(after[path].st_ino == before[path].st_ino for path in before)


def test_force_spares_what_is_no_run(tmp_path: Path) -> None:
    """Whatever its files are called: another program's folder may well have a config.json."""
    mine = tmp_path / "thesis"
    mine.mkdir()
    (mine / "chapter1").write_text("words")
    for _ in range(2):
        refused(mine, f"not a run of ours.*{MARKER}")
        refused(mine / "chapter1", "not a run of ours")
        (mine / CONFIG).write_text("{}")
    (mine / MARKER).write_text("")
    refused(mine, f"not a run of ours.*{MARKER}")
    (mine / MARKER).write_text('{"flexsim": "run", "holds": 7}')
    refused(mine, f"not a run of ours.*{MARKER}")
    (mine / MARKER).unlink()
    (mine / MARKER).symlink_to(finished(tmp_path / "run") / MARKER)
    refused(mine, f"not a run of ours.*{MARKER}")


@pytest.mark.parametrize("where", ["notes.txt", "figures/mine.png", "empty/", "figures/deep/"])
def test_force_spares_a_run_with_something_foreign_in_it(tmp_path: Path, where: str) -> None:
    out = finished(tmp_path / "one")
    if where.endswith("/"):
        (out / where).mkdir()
    else:
        (out / where).write_text("dear")
    refused(out, f"holds {where.rstrip('/')}, which the run did not write")


def test_force_spares_a_run_whose_file_became_something_else(tmp_path: Path) -> None:
    out = finished(tmp_path / "one")
    (out / "results.csv").rename(tmp_path / "results.csv")
    (out / "results.csv").symlink_to(tmp_path / "results.csv")
    refused(out, "holds results.csv, which the run did not write")


def test_force_spares_links(tmp_path: Path) -> None:
    """To a run, to nothing: what they stand for is the user's business."""
    finished(tmp_path / "one")
    (tmp_path / "link").symlink_to("one")
    (tmp_path / "dangling").symlink_to("nothing")
    refused(tmp_path / "link", "not a run of ours")
    refused(tmp_path / "dangling", "not a run of ours")
    with pytest.raises(RunError, match="exists already"), run_folder(tmp_path / "dangling", False):
        pytest.fail("the block must not run")


def test_what_a_run_writes_later_is_its_own(tmp_path: Path) -> None:
    out = tmp_path / "one"
    with run_folder(out, force=False, later=["late/result.json"]):
        pass
    (out / "late").mkdir()
    (out / "late" / "result.json").write_text("{}")
    with run_folder(out, force=True):
        pass
    assert [path.name for path in out.iterdir()] == [MARKER]


def test_a_run_appearing_meanwhile_stays(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="exists already"):
        with run_folder(tmp_path / "one", force=False):
            (tmp_path / "one").mkdir()
            (tmp_path / "one" / "theirs").write_text("theirs")
    assert [path.name for path in tmp_path.rglob("*")] == ["one", "theirs"]


def test_the_old_run_returns_if_the_new_one_cannot_stand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = finished(tmp_path / "one")
    rename = Path.rename

    def fail(self: Path, target: Path) -> Path:
        if self.name == NEW:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", fail)
    with pytest.raises(RunError, match="cannot write there: Input/output error"):
        with run_folder(out, force=True):
            pass
    assert (out / "results.csv").read_text() == "first"
    assert list(tmp_path.iterdir()) == [out]


def test_a_run_that_was_killed_is_swept_by_the_next(tmp_path: Path) -> None:
    """Of the same folder or another beside it; resumable runs, under their own names, stay."""
    (tmp_path / "runs").mkdir()
    resumable = finished(tmp_path / "runs" / "tune")
    with flexsim("ladder", "--out", tmp_path / "runs" / "one") as killed:
        wait_for(lambda: any((tmp_path / "runs").glob(".flexsim-*/new")), killed)
        killed.send_signal(signal.SIGKILL)
        killed.wait()
    assert len(list((tmp_path / "runs").iterdir())) == 2
    out = finished(tmp_path / "runs" / "two")
    assert set((tmp_path / "runs").iterdir()) == {resumable, out}


def test_says_why_it_cannot_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = finished(tmp_path / "one")
    with pytest.raises(RunError, match=r"exists already.*--force"), run_folder(out, force=False):
        pytest.fail("the block must not run")
    file = out / "results.csv"
    for below in (file / "two", file / "two" / "three"):
        with pytest.raises(RunError, match=r"cannot write there: .*(folder|directory)"):
            with run_folder(below, force=False):
                pytest.fail("the block must not run")

    def refuse(self: Path, *_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "mkdir", refuse)  # root may write anywhere
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
    assert content["machine"] == origin()
    assert {"processor", "blas", "numpy_simd", "version", "sources"} <= set(content["machine"])


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


@pytest.mark.slow  # commands that end are, too, in test_ending
def test_a_study_that_is_ended_clears_its_folder_away(tmp_path: Path) -> None:
    with flexsim("ladder", "--out", tmp_path / "run") as process:
        wait_for(lambda: any(tmp_path.iterdir()), process)
        process.terminate()
        assert process.communicate(timeout=PATIENCE) == ("", "")
        assert process.returncode == TERMINATED
    assert not any(tmp_path.iterdir())
