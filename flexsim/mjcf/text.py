"""MJCF as text that needs no files beside it, so that a run can keep it.

>>> text = read_mjcf("my.xml")
>>> text = with_includes(text, Path("my.xml").parent)    # of a file that compiles
"""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

from flexsim.errors import ModelError


def read_mjcf(path: str | Path) -> str:
    """Return the text of an MJCF file.

    Raises:
        ModelError: it cannot be read, or is empty.
    """
    try:
        text = Path(path).read_text()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not text"
        raise ModelError(f"{path}: cannot read the MJCF file: {reason}") from None
    if not text.strip():
        raise ModelError(f"{path}: the MJCF file is empty")
    return text


def with_includes(text: str, folder: Path) -> str:
    """Return MJCF with the files that it includes in the includes' place.

    Text without includes stays as it is, to the byte. Includes are valid: MuJoCo has compiled the
    file, which refuses those that are not there and those that include themselves.

    Args:
        text: of the file. folder: that it is in, from which all includes start.
    """
    root = _parsed(text)
    return ElementTree.tostring(root, encoding="unicode") if _include(root, folder) else text


def _parsed(text: str) -> ElementTree.Element:
    builder = ElementTree.TreeBuilder(insert_comments=True)
    return ElementTree.fromstring(text, ElementTree.XMLParser(target=builder))


def _include(parent: ElementTree.Element, folder: Path) -> bool:
    """Put included elements in place, all the way down; return whether there were any."""
    found = False
    for child in list(parent):
        if child.tag != "include":
            found = _include(child, folder) or found
            continue
        inner = _parsed((folder / child.attrib["file"]).read_text())
        _include(inner, folder)
        place = list(parent).index(child)
        parent.remove(child)
        for offset, element in enumerate(inner):
            parent.insert(place + offset, element)
        found = True
    return found


COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


def is_rod(text: str) -> bool:
    """Return whether MJCF has a flex, which no chain has."""
    return re.search(r"<flex(comp)?\b", COMMENT.sub("", text)) is not None
