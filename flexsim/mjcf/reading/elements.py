"""The elements of MJCF, found in its text as MuJoCo's own reader finds them.

    >>> elements('<mujoco><body name="a&amp;b"/></mujoco>')[1].attributes
    {'name': 'a&b'}

MuJoCo takes what stricter readers of XML refuse: two dashes in a comment, entities that nobody
defined, blanks before the declaration. Here nothing is refused: text that is no XML has the
elements that can be found in it, and MuJoCo says what is wrong when it compiles it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

TOKEN = re.compile(  # each from its first characters to its end, or to the end of the text
    r"""<!--.*?(?:-->|\Z)|<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?(?:\?>|\Z)|<![^>]*(?:>|\Z)
    |<(?P<closing>/?)(?P<tag>[^\s<>/"'=!?]++)(?P<inside>(?:[^<>"']|"[^"]*"|'[^']*')*+)>""",
    re.DOTALL | re.VERBOSE,
)
ATTRIBUTE = re.compile(r"""([^\s<>/"'=]++)\s*=\s*("[^"]*"|'[^']*')""")
ENTITY = re.compile(r"&(?:#x([0-9A-Fa-f]{1,8})|#([0-9]{1,8})|(quot|amp|apos|lt|gt));")
NAMED = {"quot": '"', "amp": "&", "apos": "'", "lt": "<", "gt": ">"}
ROOT = -1  # parent of what has none
MOST_ELEMENTS = 10_000  # that are looked for: more than any file may have


@dataclass(frozen=True)
class Element:
    """One element.

    Attributes:
        tag; attributes: values by name, entities resolved.
        parent: index of the element around it, ROOT without one; depth: how many are around it.
        start, inner: where its tag begins and what is in it begins, in the text.
        inner_end, end: where these end; both `inner` for one that is empty, None for one that is
            never closed.
    """

    tag: str
    attributes: dict[str, str]
    parent: int
    depth: int
    start: int
    inner: int
    inner_end: int | None = None
    end: int | None = None


def elements(text: str) -> list[Element]:
    """Return the elements of MJCF, in the order of their tags, MOST_ELEMENTS at most."""
    found: list[Element] = []
    open_ones: list[int] = []
    for token in TOKEN.finditer(text):
        tag = token["tag"]
        if tag is None:
            continue
        if token["closing"]:
            if open_ones and found[open_ones[-1]].tag == tag:
                last = open_ones.pop()
                ends = {"inner_end": token.start(), "end": token.end()}
                found[last] = Element(**{**vars(found[last]), **ends})
            continue
        if len(found) == MOST_ELEMENTS:
            break
        inside, end = token["inside"], token.end()
        alone = inside.endswith("/")
        found.append(
            Element(
                tag=tag,
                attributes={name: plain(value[1:-1]) for name, value in ATTRIBUTE.findall(inside)},
                parent=open_ones[-1] if open_ones else ROOT,
                depth=len(open_ones),
                start=token.start(),
                inner=end,
                inner_end=end if alone else None,
                end=end if alone else None,
            )
        )
        if not alone:
            open_ones.append(len(found) - 1)
    return found


def plain(value: str) -> str:
    """Return an attribute's value with its entities resolved; what is none stays as it is."""
    return ENTITY.sub(_character, value)


def _character(entity: re.Match[str]) -> str:
    if entity[3]:
        return NAMED[entity[3]]
    code = int(entity[1], 16) if entity[1] else int(entity[2])
    return chr(code) if 0 < code < 0x110000 else entity[0]


def quoted(value: str) -> str:
    """Return a value as an attribute's text, in quotation marks."""
    for mark in ("amp", "quot", "lt", "gt"):
        value = value.replace(NAMED[mark], f"&{mark};")
    return f'"{value}"'
