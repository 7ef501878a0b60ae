"""Runs that are kept while a long study is at work, so that the same command goes on with them.

>>> with going_on(Path("runs/laboratory"), decides=DECIDES) as kept:        # doctest: +SKIP
...     found = kept.of(what, lambda: simulated(what))

What is asked names its file: what is run, and the versions and sources that decide what comes of
it. So whatever was run before, by this command or by another one with runs in common, is not run
again, and nothing comes of older sources. Files lie in a folder beside the study's own, until that
stands.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from flexsim.errors import RunError
from flexsim.files.atomic import write_bytes
from flexsim.files.reading import MIB, read_regular
from flexsim.files.scratch import sweep
from flexsim.numerics.types import Array
from studies.core.ending import NOTHING_KEPT, saying
from studies.core.folder import require_free, versions
from studies.core.text import spelled
from studies.core.version import ROOT

ENDING = ".begun"  # of the folder's name
NAME = re.compile(r"[0-9a-f]{32}\.npy")
MOST = 64 * MIB


@dataclass(frozen=True)
class Kept:
    """Arrays in a folder, named by what they are of; made when there is the first.

    Attributes:
        folder: of the files. decides: patterns of the sources that what comes of a run depends on,
            from the root. counted: the files that there are, of this command.
    """

    folder: Path
    decides: tuple[str, ...]
    counted: list[Path] = field(default_factory=list)

    def of(self, what: str, made: Callable[[], Array]) -> Array:
        """Return an array from its file, or made and kept.

        Raises:
            RunError: it cannot be written; and what `made` raises.
        """
        path = self._path(what)
        with suppress(RunError, ValueError, EOFError):  # there is none, or it is no array
            content = read_regular(path, MOST, "runs that are kept")
            found = np.load(io.BytesIO(content), allow_pickle=False)
            self.counted.append(path)
            return np.asarray(found)
        array, buffer = made(), io.BytesIO()
        np.save(buffer, array, allow_pickle=False)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunError(f"{self.folder}: cannot write there: {error.strerror}") from None
        write_bytes(path, buffer.getvalue(), "the runs so far")
        self.counted.append(path)
        return array

    def has(self, what: str) -> bool:
        """Return whether there is a file of what is asked."""
        return self._path(what).is_file()

    def _path(self, what: str) -> Path:
        return self.folder / f"{_digest(what, self.decides)}.npy"


@cache
def _sources(decides: tuple[str, ...]) -> str:
    """Return a digest of the code that decides what comes of a run."""
    digest = hashlib.sha256()
    for path in sorted(path for pattern in decides for path in ROOT.glob(pattern)):
        digest.update(str(path.relative_to(ROOT)).encode() + path.read_bytes())
    return digest.hexdigest()


def _digest(what: str, decides: tuple[str, ...]) -> str:
    """Return a name for what is asked of these versions and sources."""
    by = versions() | {"sources": _sources(decides)}
    by.pop("platform")
    return hashlib.sha256(f"{json.dumps(by)}\n{what}".encode()).hexdigest()[:32]


def folder_of(out: Path) -> Path:
    """Return where a study's runs are kept until its folder stands."""
    return out.with_name(out.name + ENDING)


@contextmanager
def going_on(out: Path, decides: tuple[str, ...], force: bool = False) -> Iterator[Kept]:
    """Give what is kept of a study that will be written to `out`; Ctrl-C says how to go on.

    Args:
        decides: as of `Kept`. force: whether a run that is there will be replaced.

    Raises:
        RunError: as `require_free`: nothing is run for a folder that cannot be written.
    """
    require_free(out, force)
    kept = Kept(folder_of(out), decides)

    def interrupted() -> str:
        if not kept.counted:
            return NOTHING_KEPT
        where = spelled(kept.folder)
        return f"interrupted; what was run is kept in {where}, and the same command goes on"

    with saying(interrupted):
        yield kept


def forget(out: Path) -> None:
    """Remove what was kept of a study whose folder is written, and nothing else."""
    folder = folder_of(out)
    with suppress(OSError):
        sweep(folder)
        for path in folder.iterdir():
            if NAME.fullmatch(path.name) and not path.is_symlink():
                path.unlink()
        folder.rmdir()
