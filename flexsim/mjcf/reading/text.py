"""MJCF as text that needs no files beside it, so that a run can keep it.

>>> text = read_mjcf("my.xml")
>>> text = with_includes(text, Path("my.xml").parent)
"""

from __future__ import annotations

from pathlib import Path

from flexsim.errors import ModelError, RunError
from flexsim.files.reading import read_text
from flexsim.mjcf.reading.elements import ROOT, Element, elements

MOST_BYTES = 2_000_000  # of a file with all that it includes: 200 times the default's
INCLUDES_MOST = 100  # deep, and in all
FLEXES = ("flex", "flexcomp")


def read_mjcf(path: str | Path) -> str:
    """Return the text of an MJCF file.

    Raises:
        ModelError: it cannot be read, is not a regular file of at most MOST_BYTES, or is empty.
    """
    try:
        text = read_text(path, MOST_BYTES, "MJCF file")
    except RunError as error:
        raise ModelError(str(error)) from None
    if not text.strip():
        raise ModelError(f"{path}: the MJCF file is empty")
    return text


def with_includes(text: str, folder: Path) -> str:
    """Return MJCF with the files that it includes in the includes' place.

    Text without includes stays as it is, to the byte. As MuJoCo has it, an include is named from
    the folder of the first file, else from that of the file with the include; each file is
    included once; and what is taken is all that is in its outermost element.

    Args:
        text: of the file. folder: that it is in.

    Raises:
        ModelError: a file cannot be included.
    """
    return _spliced(text, folder, folder, {})


def included(element: Element, folder: Path, here: Path) -> Path:
    """Return the file that an include names.

    Args:
        element: the include. folder: of the first file. here: of the file with the include.
    """
    name = element.attributes.get("file", "")
    first = folder / name
    return first if first.exists() else here / name


def _spliced(text: str, folder: Path, here: Path, done: dict[Path, int]) -> str:
    """Return text with its includes in place, all the way down.

    done: bytes of the files that are included already.
    """
    parts, position = [], 0
    for element in elements(text):
        if element.tag != "include" or element.end is None:
            continue  # one that is not closed, MuJoCo refuses
        name = element.attributes.get("file", "")
        try:
            inner = _include(element, folder, here, done)
        except ModelError as error:
            raise ModelError(f"includes {name!r}: {error}") from None
        parts += [text[position : element.start], inner]
        position = element.end
    return "".join([*parts, text[position:]]) if parts else text


def _include(element: Element, folder: Path, here: Path, done: dict[Path, int]) -> str:
    """Return what takes the place of an include."""
    path = included(element, folder, here)
    if not element.attributes.get("file") or element.inner != element.inner_end:
        raise ModelError("an include needs a file, and nothing within")
    if path in done or len(done) >= INCLUDES_MOST:
        raise ModelError("it is included twice; MuJoCo takes each file once")
    text = read_mjcf(path)
    done[path] = len(text)
    if sum(done.values()) > MOST_BYTES:
        raise ModelError(f"all included files have more than {MOST_BYTES:,} bytes")
    return _within(text, path, folder, done)


def _within(text: str, path: Path, folder: Path, done: dict[Path, int]) -> str:
    """Return what is in the outermost element of an included file, its own includes in place."""
    outermost = next((each for each in elements(text) if each.parent == ROOT), None)
    if outermost is None or outermost.inner_end is None:
        raise ModelError(f"{path}: the included file has no outermost element, opened and closed")
    return _spliced(text[outermost.inner : outermost.inner_end], folder, path.parent, done)


def is_rod(text: str) -> bool:
    """Return whether MJCF has a flex, which no chain has."""
    return any(element.tag in FLEXES for element in elements(text))
