"""Private folders: gone with their block, swept after a kill, nothing of others ever touched."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import pytest
from processes import process, wait_for

from flexsim.files import scratch as scratch_module
from flexsim.files.atomic import write_text
from flexsim.files.scratch import MARKER, NEW, OLD, scratch, sweep

WHOLE = '{"flexsim": "scratch", "target": "file"}'
HOLDS = """
import sys, time
from pathlib import Path
from flexsim.files.scratch import scratch, OLD
with scratch(Path(sys.argv[1])) as folder:
    (folder / "deep").mkdir()
    (folder / "deep" / "file").write_text("half")
    if len(sys.argv) > 2:
        Path(sys.argv[1]).rename(folder / OLD)
    print(flush=True)
    time.sleep(600)
"""
WRITES = """
import itertools, sys
from pathlib import Path
from flexsim.files.atomic import write_text
for i in itertools.count():
    write_text(Path(sys.argv[1]), 1000 * f"{i:06d}")
"""
DELAYS = (0.0, 0.0007, 0.0131, 0.0173, 0.0222)  # [s] from the first write to the kill


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def killed_while_writing(*words: str) -> None:
    with process([sys.executable, "-c", HOLDS, *words]) as killed:
        assert killed.stdout and killed.stdout.readline()
        killed.send_signal(signal.SIGKILL)
        killed.wait()


def test_what_a_killed_process_leaves_is_swept(tmp_path: Path) -> None:
    """By the next one that writes beside it; while it lives nothing is touched."""
    with process([sys.executable, "-c", HOLDS, str(tmp_path / "file")]) as alive:
        assert alive.stdout and alive.stdout.readline()
        (left,) = tmp_path.iterdir()
        sweep(tmp_path)
        assert (left / "deep" / "file").read_text() == "half"
    assert names(left) == ["deep", MARKER]  # killed by now
    write_text(tmp_path / "other", "")
    assert names(tmp_path) == ["other"]


def test_what_it_had_moved_aside_returns(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "result").write_text("dear")
    killed_while_writing(str(tmp_path / "run"), "aside")
    assert not (tmp_path / "run").exists()
    sweep(tmp_path)
    assert (tmp_path / "run" / "result").read_text() == "dear" and names(tmp_path) == ["run"]


def test_killed_at_any_moment(tmp_path: Path) -> None:
    """The file is always one of those written, whole; the next write leaves nothing else."""
    path = tmp_path / "file"
    for delay in DELAYS:
        with process([sys.executable, "-c", WRITES, str(path)]) as killed:
            wait_for(path.exists, killed)
            time.sleep(delay)
            killed.send_signal(signal.SIGKILL)
            killed.wait()
        text = path.read_text()
        assert len(text) == 6000 and text == 1000 * text[:6]
    for left in tmp_path.glob(".flexsim-*"):
        os.utime(left, (0, 0))  # also one killed before its marker was there
    write_text(path, "")
    assert names(tmp_path) == ["file"]


def test_killed_before_the_marker_is_written(tmp_path: Path) -> None:
    """Both folders are swept, but not before a living process has had time to write it."""
    for name in "01":
        (tmp_path / f".flexsim-{name * 16}").mkdir()
    (tmp_path / f".flexsim-{'1' * 16}" / MARKER).touch()
    sweep(tmp_path)
    assert len(names(tmp_path)) == 2
    for folder in tmp_path.iterdir():
        os.utime(folder, (0, 0))
    sweep(tmp_path)
    assert names(tmp_path) == []


def test_only_what_is_ours_is_swept(tmp_path: Path) -> None:
    """A name is not enough: without our marker, or with a link for one, it is somebody else's."""
    folders = [tmp_path / f".flexsim-{name * 16}" for name in "0123"]
    for folder in folders:
        folder.mkdir()
        (folder / "dear").write_text("dear")
    (folders[1] / MARKER).write_text('{"flexsim": "something else"}')
    (tmp_path / "marker").write_text(WHOLE)
    (folders[2] / MARKER).symlink_to(tmp_path / "marker")
    os.mkfifo(folders[3] / MARKER)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / MARKER).write_text(WHOLE)
    (tmp_path / f".flexsim-{'4' * 16}").symlink_to(tmp_path / "elsewhere")
    (tmp_path / ".flexsim-run").mkdir()
    for folder in folders:
        os.utime(folder, (0, 0))
    before = sorted(tmp_path.rglob("*"))
    sweep(tmp_path)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_marker_cannot_name_a_path(tmp_path: Path) -> None:
    """Nothing is moved out of the folder that is swept."""
    left = tmp_path / "in" / f".flexsim-{'0' * 16}"
    (left / OLD).mkdir(parents=True)
    (left / MARKER).write_text('{"flexsim": "scratch", "target": "../out"}')
    sweep(tmp_path / "in")
    assert (left / OLD).is_dir() and not (tmp_path / "out").exists()


def test_another_users_is_not_swept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    left = tmp_path / f".flexsim-{'0' * 16}"
    left.mkdir()
    (left / MARKER).write_text(WHOLE)
    with monkeypatch.context() as other:
        other.setattr(scratch_module.os, "geteuid", lambda: left.stat().st_uid + 1)
        sweep(tmp_path)
        assert left.is_dir()
    sweep(tmp_path)
    assert not left.exists()


@pytest.mark.parametrize("new", [False, True])
def test_the_old_one_returns_unless_a_new_one_stands(tmp_path: Path, new: bool) -> None:
    target = tmp_path / "run"
    target.mkdir()
    (target / "a").write_text("old")
    with scratch(target) as folder:
        (folder / NEW).mkdir()
        target.rename(folder / OLD)
        if new:
            (folder / NEW).rename(target)
    assert names(target) == ([] if new else ["a"])
    assert names(tmp_path) == ["run"]
