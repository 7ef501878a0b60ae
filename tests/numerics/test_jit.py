"""The compile cache: of all sources, where nobody else can write, and gone only if it is ours."""

from __future__ import annotations

import fcntl
import importlib
import os
import pwd
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from processes import FLEXSIM, PATIENCE, ROOT, process

from flexsim.files import private
from flexsim.files.private import private_folder
from flexsim.numerics import jit
from flexsim.numerics.jit import CACHES_KEPT, MARKER, cache_folder, sources_digest


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty home, with a folder for temporary files beside it."""
    for name in ("home", "temporary"):
        (tmp_path / name).mkdir()
    (tmp_path / "temporary").chmod(0o1777)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setattr(jit, "_locks", [])
    yield tmp_path / "home"
    for handle in jit._locks:
        os.close(handle)


@pytest.fixture
def own(home: Path) -> Path:
    """Where the cache is, as long as nothing is wrong with it."""
    return home / ".cache" / "flexsim"


@pytest.fixture
def fallback(home: Path) -> Path:
    return home.parent / "temporary" / f"flexsim-{os.geteuid()}"


def test_every_source_in_every_room_counts(tmp_path: Path) -> None:
    for path in ("a.py", "room/b.py", "room/inner/c.py"):
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text("1")
    seen = {sources_digest(tmp_path)}
    for path in ("a.py", "room/b.py", "room/inner/c.py"):
        (tmp_path / path).write_text("2")
        seen.add(sources_digest(tmp_path))
    (tmp_path / "a.py").rename(tmp_path / "d.py")
    assert len({*seen, sources_digest(tmp_path)}) == 5
    assert sources_digest() == sources_digest(ROOT / "flexsim")


def test_it_is_private(own: Path) -> None:
    before = os.umask(0)
    try:
        folder = cache_folder("0" * 16)
    finally:
        os.umask(before)
    assert folder == own / ("0" * 16)
    assert [stat.S_IMODE(path.stat().st_mode) for path in (own, folder)] == [0o700, 0o700]


def test_where_xdg_says(tmp_path: Path, own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert private_folder() == tmp_path / "xdg" / "flexsim"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # which the specification says to ignore
    assert private_folder() == own


def test_an_older_versions_folder_is_tightened(own: Path) -> None:
    own.mkdir(parents=True)
    own.chmod(0o755)
    assert private_folder() == own and stat.S_IMODE(own.stat().st_mode) == 0o700


def test_what_others_could_write_to_is_not_loaded(own: Path) -> None:
    (own / ("0" * 16)).mkdir(parents=True)
    (own / ("0" * 16)).chmod(0o770)
    assert cache_folder("0" * 16) is None


def test_a_link_in_its_place_is_not_followed(own: Path, fallback: Path, tmp_path: Path) -> None:
    (tmp_path / "theirs").mkdir(mode=0o700)
    own.parent.mkdir()
    own.symlink_to(tmp_path / "theirs")
    assert private_folder() == fallback
    fallback.rmdir()
    fallback.symlink_to(tmp_path / "theirs")
    assert private_folder() is None and cache_folder("0" * 16) is None
    assert list((tmp_path / "theirs").iterdir()) == []


def test_another_users_folder_is_not_used(
    own: Path, fallback: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The name in the folder for temporary files is known: somebody else may have taken it."""
    own.mkdir(parents=True)
    fallback.mkdir()
    user = os.geteuid()
    monkeypatch.setattr(private, "_user", lambda: user)
    monkeypatch.setattr(private.os, "geteuid", lambda: user + 1)
    assert private_folder() is None


@pytest.mark.parametrize("mode", [0o777, 0o1777])
def test_a_parent_that_others_write_to(own: Path, fallback: Path, mode: int) -> None:
    """They could put another folder in its place, unless the parent is sticky as /tmp is."""
    own.parent.mkdir()
    own.parent.chmod(mode)
    assert private_folder() == (own if mode & stat.S_ISVTX else fallback)


@pytest.mark.parametrize("home_is", [None, "", "/dev/null", "/proc/nonexistent", "relative"])
def test_without_a_home(
    home_is: str | None, fallback: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Nor an entry in passwd, as in a container: a folder of our own beside other temporary ones.

    (An empty HOME is the root folder, which root may write to.)
    """

    def unknown(_: int) -> None:
        raise KeyError

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pwd, "getpwuid", unknown)
    if home_is is None:
        monkeypatch.delenv("HOME")
    else:
        monkeypatch.setenv("HOME", home_is)
    if home_is == "":
        monkeypatch.setattr(os, "makedirs", refuse)
    assert private_folder() == fallback
    assert stat.S_IMODE(fallback.stat().st_mode) == 0o700


def refuse(*_: object, **__: object) -> None:
    raise PermissionError(13, "Permission denied")


def test_a_home_that_is_read_only(fallback: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "makedirs", refuse)
    assert private_folder() == fallback


def test_the_oldest_are_dropped_and_nothing_else(own: Path) -> None:
    """Neither what is not named as ours, nor what has no marker, nor what is in use."""
    names = [letter * 16 for letter in "0123456789"]
    for age, name in enumerate(names):
        assert cache_folder(name) is not None
        os.utime(own / name / MARKER, (1000 + age, 1000 + age))
    assert all((own / name).is_dir() for name in names)  # this process uses them all
    for handle in jit._locks[1:]:
        os.close(handle)
    del jit._locks[1:]
    foreign = [own / "matplotlib", own / ("a" * 16), own / "notes.txt"]
    for path in foreign[:2]:
        path.mkdir()
        (path / "dear").write_text("dear")
    foreign[2].write_text("dear")
    (own / ("b" * 16)).symlink_to(foreign[0])
    assert cache_folder("c" * 16) is not None
    left = {path.name for path in own.iterdir()}
    kept = names[-(CACHES_KEPT - 1) :]
    assert left == {*kept, names[0], "c" * 16, "b" * 16, *(path.name for path in foreign)}
    assert (foreign[1] / "dear").read_text() == "dear"


def test_one_that_is_removed_meanwhile_is_made_again(
    own: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between being found and being marked as used."""
    lock, removed = fcntl.flock, []

    def late(handle: int, how: int) -> None:
        if not removed:
            removed.append((own / ("0" * 16) / MARKER).unlink())
        lock(handle, how)

    monkeypatch.setattr(fcntl, "flock", late)
    assert cache_folder("0" * 16) == own / ("0" * 16)
    assert removed and (own / ("0" * 16) / MARKER).is_file()


def test_a_command_runs_without_any_cache(home: Path, fallback: Path) -> None:
    """And says nothing about it."""
    fallback.symlink_to(home)
    environment = {"PYTHONPATH": str(ROOT), "TMPDIR": str(fallback.parent), "PATH": os.defpath}
    words = [*FLEXSIM, "filter", "--order", "0.5"]
    with process(words, env={**environment, "HOME": "/dev/null"}) as started:
        out, err = started.communicate(timeout=PATIENCE)
        assert (started.returncode, err) == (0, "") and out
    code = "from flexsim.numerics.jit import CACHED; print(CACHED)"
    with process([sys.executable, "-c", code], env={**environment, "HOME": "/dev/null"}) as started:
        assert started.communicate(timeout=PATIENCE) == ("False\n", "")


def test_code_of_others_is_not_kept_however_it_is_called(own: Path, tmp_path: Path) -> None:
    """A plant of somebody's in two files: an edit of the one that is called is seen."""
    (tmp_path / "helper.py").write_text(HELPER.format(0))
    (tmp_path / "plant.py").write_text(CALLER)
    environment = {"PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}", "PATH": os.defpath}
    environment["HOME"] = str(own.parents[1])

    def called() -> str:
        with process([sys.executable, tmp_path / "plant.py"], env=environment) as started:
            out, err = started.communicate(timeout=PATIENCE)
            assert (started.returncode, err) == (0, "")
            return out

    assert called() == "2.0\n"
    (tmp_path / "helper.py").write_text(HELPER.format(100))
    assert called() == "102.0\n"
    assert not list(own.rglob("*.nb?"))


HELPER = """from flexsim.numerics.jit import jit

@jit
def twice(x):
    return 2.0 * x + {}
"""
CALLER = """from helper import twice

from flexsim.numerics.jit import jit

@jit
def called(x):
    return twice(x)

print(called(1.0))
"""


def test_a_folder_of_the_users_choice_has_one_per_digest(tmp_path: Path) -> None:
    code = "from flexsim.numerics.jit import CACHED; import numba; print(numba.config.CACHE_DIR)"
    environment = {"PYTHONPATH": str(ROOT), "PATH": os.defpath, "NUMBA_CACHE_DIR": str(tmp_path)}
    with process([sys.executable, "-c", code], env=environment) as started:
        out, _ = started.communicate(timeout=PATIENCE)
    assert out == f"{tmp_path / sources_digest()}\n"


def test_what_studies_compile_calls_nothing_of_another_file_of_theirs() -> None:
    """So that numba, which looks at the one file, sees every edit that the digest does not."""
    users = [path for path in (ROOT / "studies").rglob("*.py") if "jit import jit" in text(path)]
    assert len(users) >= 3
    for path in users:
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        module = importlib.import_module(name)
        compiled = {
            key: of.py_func.__module__ for key, of in vars(module).items() if hasattr(of, "py_func")
        }
        theirs = {of for of in compiled.values() if of.startswith("studies.")}
        assert compiled and theirs <= {name}


def text(path: Path) -> str:
    return path.read_text(encoding="utf-8")
