"""What a run holds beside its numbers, to be shown or saved: pictures and texts as data.

>>> pictures, left_out = pictures_of(Path("runs/compare"))
>>> pictures[0].name, pictures[0].source[:22]
('envelopes', 'data:image/png;base64,')

A picture is never markup of the page: the browser draws it as an image, without scripts.
"""

from __future__ import annotations

import base64
from pathlib import Path
from typing import NamedTuple

from flexsim.errors import RunError
from flexsim.files.reading import MIB
from studies.core.figures import CAPTIONS, FIGURES, captions_in
from studies.core.folder import CONFIG
from studies.report.entries import named, opened, size_of, text_of

PICTURE_MOST, PICTURES_MOST = 2 * MIB, 6 * MIB  # [bytes] of one, of all of a run
TEXT_MOST, TEXTS_MOST, SHOWN_MOST = 1 * MIB, 3 * MIB, 200_000
INPUTS = "inputs"  # files that a study names
SVG, PNG = ".svg", ".png"
PNG_BEGINS = b"\x89PNG\r\n\x1a\n"
KINDS = {SVG: "image/svg+xml", PNG: "image/png"}
TEXTS = (".csv", ".xml", ".toml", ".json")
READ = (".xml", ".toml")  # that are shown, too


class Picture(NamedTuple):
    """A figure of the run: its name, a data URI, its caption if it has one."""

    name: str
    source: str
    caption: str = ""


class Text(NamedTuple):
    """A file to save: its name, size [bytes], a data URI; the text if it is shown, else empty."""

    name: str
    size: int
    source: str
    shown: str


def data_uri(content: bytes, kind: str) -> str:
    """Return a data URI."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def pictures_of(folder: Path, most: int = PICTURES_MOST) -> tuple[list[Picture], list[str]]:
    """Return a run's figures, of each the drawing rather than the pixels, and what is left out.

    Args:
        folder: of the run. most: bytes of all.

    Raises:
        RunError: one is no picture of its kind.
    """
    by_name: dict[str, dict[str, Path]] = {}
    for path in named(folder / FIGURES, *KINDS):
        by_name.setdefault(path.stem, {})[path.suffix.lower()] = path
    pictures, left_out = [], []
    captions = _captions(folder / FIGURES)
    for name, paths in by_name.items():
        fits = [end for end in KINDS if end in paths and size_of(paths[end]) <= PICTURE_MOST]
        fits = [end for end in fits if size_of(paths[end]) <= most]
        if not fits:
            left_out.append(f"{FIGURES}/{name}: too large")
            continue
        content = opened(paths[fits[0]], PICTURE_MOST, "figure")
        _check(paths[fits[0]], content)
        most -= len(content)
        source = data_uri(content, KINDS[fits[0]])
        pictures.append(Picture(name, source, captions.get(name, "")))
    return pictures, left_out


def _captions(folder: Path) -> dict[str, str]:
    """Return the captions of a run's figures by their names, none if it keeps none."""
    found = [each for each in named(folder, CAPTIONS) if each.name == CAPTIONS]
    return captions_in(text_of(found[0], TEXT_MOST, "file of captions")) if found else {}


def _check(path: Path, content: bytes) -> None:
    right = b"<svg" in content if path.suffix.lower() == SVG else content.startswith(PNG_BEGINS)
    if not right:
        raise RunError(f"{path}: it is no {path.suffix[1:].upper()} picture; it is damaged")


def texts_of(folder: Path, most: int = TEXTS_MOST) -> tuple[list[Text], list[str]]:
    """Return a run's files of text to save, and what is left out; arguments as above."""
    texts, left_out = [], []
    paths = named(folder, *TEXTS, within=False)
    paths.sort(key=lambda path: (path.name != CONFIG, path.suffix == ".csv"))
    for path in [*paths, *named(folder / INPUTS, *TEXTS)]:
        name = path.relative_to(folder).as_posix()
        if size_of(path) > min(TEXT_MOST, most):
            left_out.append(f"{name}: {size_of(path):,} bytes")
            continue
        text = text_of(path, TEXT_MOST, "file")
        content = text.encode()
        most -= len(content)
        source = data_uri(content, "text/plain;charset=utf-8")
        shown = text if path.suffix in READ and len(text) <= SHOWN_MOST else ""
        texts.append(Text(name, len(content), source, shown))
    return texts, left_out
