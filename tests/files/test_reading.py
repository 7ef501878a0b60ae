"""Files of others: only regular ones, only up to a stated size, and no waiting."""

import os
from pathlib import Path

import pytest

from flexsim import RunError
from flexsim.files.reading import read_regular, read_text


def test_a_regular_file_is_read_to_the_byte(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(bytes(range(256)))
    assert read_regular(path, 256, "file") == bytes(range(256))
    (tmp_path / "link").symlink_to(path)
    assert read_regular(str(tmp_path / "link"), 256, "file") == bytes(range(256))


def test_one_byte_too_many_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(bytes(1001))
    assert len(read_regular(path, 1001, "file")) == 1001
    with pytest.raises(RunError, match="cannot read the table: it has more than 1,000 bytes"):
        read_regular(path, 1000, "table")


def test_what_never_ends_or_never_begins_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, kind in ((tmp_path / "pipe", "a pipe"), (tmp_path, "a folder"), ("/dev/zero", "a d")):
        with pytest.raises(RunError, match=f"cannot read the table: it is {kind}") as refused:
            read_regular(path, 1000, "table")
        assert "\n" not in str(refused.value)


def test_what_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="cannot read the table: No such file"):
        read_regular(tmp_path / "none", 1000, "table")
    with pytest.raises(RunError, match="cannot read the table"):
        read_regular("a\0b", 1000, "table")


def test_text_with_and_without_its_mark(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes("\ufeffä".encode())
    assert read_text(tmp_path / "a", 100, "table") == "ä"
    (tmp_path / "b").write_bytes(b"\xff\xfe")
    with pytest.raises(RunError, match="not text in UTF-8"):
        read_text(tmp_path / "b", 100, "table")
