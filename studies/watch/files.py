"""When was a file saved? Its contents with those it includes, each time they have settled.

    >>> for snapshot in snapshots(Path("my.xml")):        # doctest: +SKIP
    ...     answer(snapshot.contents)

Polled, so that it works wherever files do: an editor may write in place, in two steps, or
replace the file by another. `sleep` may be replaced, by a test's own clock.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from flexsim.errors import RunError
from flexsim.files.reading import read_regular
from flexsim.mjcf.reading.elements import elements
from flexsim.mjcf.reading.text import MOST_BYTES, included

Sleep = Callable[[float], None]
Stamp = tuple[int, int, int] | None  # of a file: modified [ns], size, inode; None if it is gone

POLL = 0.1  # [s] between two looks
QUIET = 2  # looks without a change after which a save is complete
PATIENCE = 5  # looks more before a file is called broken: its other half may be on its way


@dataclass(frozen=True)
class Snapshot:
    """A file and all it includes at one time.

    Attributes:
        stamps: by path. contents: by path, the file itself first; None if it cannot be read.
    """

    stamps: Mapping[Path, Stamp]
    contents: Mapping[Path, bytes | None]

    @property
    def current(self) -> bool:
        """Whether nothing was written since."""
        return all(_stamp(path) == stamp for path, stamp in self.stamps.items())


def snapshot_of(path: Path) -> Snapshot:
    """Return the file as it is now, with what it includes, directly or not.

    What is not a regular file of the size that is read has no contents.
    """
    stamps: dict[Path, Stamp] = {}
    contents: dict[Path, bytes | None] = {}
    ahead = [path]
    while ahead:
        file = ahead.pop(0)
        if file in stamps:
            continue
        stamps[file] = _stamp(file)  # before the contents, so that a later write is noticed
        contents[file] = _contents(file)
        for element in elements((contents[file] or b"").decode(errors="replace")):
            if element.tag == "include":
                ahead.append(included(element, path.parent, file.parent))
    return Snapshot(stamps, contents)


def snapshots(path: Path, sleep: Sleep = time.sleep) -> Iterator[Snapshot]:
    """Give the file at once, and again each time it, or what it includes, has been written."""
    while True:
        snapshot = settled(path, sleep)
        yield snapshot
        while snapshot.current:
            sleep(POLL)


def settled(path: Path, sleep: Sleep = time.sleep) -> Snapshot:
    """Return the file once it has been left alone for QUIET looks."""
    snapshot = snapshot_of(path)
    while not lasts(snapshot, sleep, QUIET):
        snapshot = snapshot_of(path)
    return snapshot


def lasts(snapshot: Snapshot, sleep: Sleep = time.sleep, looks: int = PATIENCE) -> bool:
    """Return whether nothing is written during some looks."""
    for _ in range(looks):
        sleep(POLL)
        if not snapshot.current:
            return False
    return True


def _stamp(path: Path) -> Stamp:
    try:
        status = path.stat()
    except (OSError, ValueError):  # also a name that no file can have
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


def _contents(path: Path) -> bytes | None:
    try:
        return read_regular(path, MOST_BYTES, "MJCF file")
    except RunError:
        return None
