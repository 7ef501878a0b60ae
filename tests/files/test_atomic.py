"""Files appear whole or not at all, and replace nothing but regular files."""

from __future__ import annotations

import errno
import os
import socket
import stat
from pathlib import Path

import pytest

from flexsim import RunError
from flexsim.files.atomic import replacing, write_bytes, write_text
from flexsim.files.cleanup import _PENDING


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_appears_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "file.txt"
    with replacing(path) as temporary:
        temporary.write_text("content")
        assert not path.exists() and temporary.parent.stat().st_mode & 0o777 == 0o700
    assert path.read_text() == "content"
    assert names(tmp_path) == ["file.txt"] and _PENDING == []


def test_its_mode_is_the_users(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_bytes(tmp_path / "file", b"")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "file").stat().st_mode) == 0o640


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_a_failure_leaves_what_was_there(tmp_path: Path, failure: type[BaseException]) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    with pytest.raises(failure), replacing(path) as temporary:
        temporary.write_text("half")
        raise failure
    assert path.read_text() == "old" and names(tmp_path) == ["file"]


def test_a_full_disk_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"file: cannot write the figure: No space left"):
        with replacing(tmp_path / "file", "the figure"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert names(tmp_path) == []


def test_only_a_regular_file_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither a device node nor a pipe, a socket, a folder or any link."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    Path("folder").mkdir()
    Path("file").write_text("mine")
    Path("link").symlink_to("file")
    Path("dangling").symlink_to("nothing")
    Path("linked-folder").symlink_to("folder")
    kinds = {"pipe": "a pipe", "socket": "a socket", "folder": "a folder"}
    kinds |= dict.fromkeys(("link", "dangling", "linked-folder"), "a symbolic link")
    if os.geteuid() == 0:
        os.mknod("null", stat.S_IFCHR | 0o666, os.makedev(1, 3))
        kinds["null"] = "a device"
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        before = {path: path.lstat().st_ino for path in tmp_path.iterdir()}
        for name, kind in kinds.items():
            with pytest.raises(RunError, match=f"{name}: cannot write the file: it is {kind}"):
                write_text(name, "new")
    assert {path: path.lstat().st_ino for path in tmp_path.iterdir()} == before
    assert Path("file").read_text() == "mine"


def test_the_null_device_is_refused() -> None:
    with pytest.raises(RunError, match="/dev/null: cannot write the file: it is a device"):
        write_text("/dev/null", "new")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


def test_without_force_nothing_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "file"
    write_text(path, "first", force=False)
    with pytest.raises(RunError, match=r"file exists already; .*--force"):
        write_text(path, "second", force=False)
    with pytest.raises(RunError, match="exists already"):  # appearing meanwhile, too
        with replacing(tmp_path / "late", force=False) as temporary:
            temporary.write_text("second")
            (tmp_path / "late").write_text("first")
    assert path.read_text() == (tmp_path / "late").read_text() == "first"
    assert names(tmp_path) == ["file", "late"]


def test_where_there_are_no_hard_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", refuse)
    write_text(tmp_path / "file", "first", force=False)
    assert (tmp_path / "file").read_text() == "first"


@pytest.mark.parametrize("name", ["x" * 255, "two\nlines", "[red]", "-f", "\udcff"])
def test_any_name_that_a_file_can_have(tmp_path: Path, name: str) -> None:
    write_text(tmp_path / name, "content")
    assert names(tmp_path) == [name]


@pytest.mark.parametrize("name", ["x" * 256, "a\0b", "gone/file"])
def test_names_that_no_file_can_have(tmp_path: Path, name: str) -> None:
    with pytest.raises(RunError, match="cannot write the file"):
        write_text(tmp_path / name, "content")
    assert names(tmp_path) == []
