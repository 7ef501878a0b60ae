"""Lines put into the text of an MJCF file at a body's end; every other character stays.

    >>> place = place_for(text, "wrist", "robot.xml")
    >>> text = with_part(text, place, body_lines(part), class_lines(part))
    >>> text = with_keys(text, Added(qpos=7, qvel=6, joints=6), "robot.xml")

Bodies go before the parent's end tag, so that no other body changes its place among its own;
defaults are a section of their own; keyframes get a zero for every new joint, where it belongs.
"""

from __future__ import annotations

import difflib
import re
from typing import NamedTuple

from flexsim.errors import ModelError, ParameterError
from flexsim.mjcf.reading.elements import ATTRIBUTE, ROOT, Element, elements

WORLD = ("world", "worldbody")
REPEATED = ("replicate",)  # what makes several of a body
SHOWN = 12  # names of bodies in a message


class Place(NamedTuple):
    """The element that a part is put into, of a file's text; None of a worldbody to be made."""

    element: Element | None


class Added(NamedTuple):
    """Where joints were added: the first one's place in qpos and in qvel, and how many."""

    qpos: int
    qvel: int
    joints: int


def place_for(text: str, parent: str, source: str, whole: str) -> Place:
    """Return the place for a part on a body.

    Args:
        text: of the file itself. parent: a body's name; world is the worldbody. whole: the text
            with all that it includes.

    Raises:
        ParameterError: there is no such body.
        ModelError: it is where a part cannot be put.
    """
    found = elements(text)
    if parent in WORLD:
        own = [each for each in found if each.tag == "worldbody" and each.end is not None]
        return Place(own[-1] if own else None)
    for element in found:
        if element.tag == "body" and element.attributes.get("name") == parent:
            if any(outer.tag in REPEATED for outer in _around(found, element)):
                raise ModelError(
                    f"{source}: body {parent!r} is in a <replicate>, which makes several of it; "
                    "choose another parent, or write the copies out"
                )
            return Place(element)
    bodies = [e.attributes.get("name", "") for e in elements(whole) if e.tag == "body"]
    if parent in bodies:
        raise ModelError(
            f"{source}: body {parent!r} is in a file that it includes; give that file as --mjcf"
        )
    there = list(dict.fromkeys(["world", *filter(None, bodies)]))
    close = difflib.get_close_matches(parent, there, n=1, cutoff=0.5)
    hint = f". Did you mean {close[0]!r}?" if close else ""
    more = f" and {len(there) - SHOWN} more" if len(there) > SHOWN else ""
    raise ParameterError(
        f"{source} has no body {parent!r}; choose {', '.join(there[:SHOWN])}{more}{hint}"
    )


def _around(found: list[Element], element: Element) -> list[Element]:
    """Return the elements around one, the innermost first."""
    outer = []
    while element.parent != ROOT:
        element = found[element.parent]
        outer.append(element)
    return outer


def with_part(text: str, place: Place, bodies: list[str], defaults: list[str]) -> str:
    """Return text with lines of bodies at the end of an element, and of a section of defaults."""
    newline = "\r\n" if "\r\n" in text else "\n"
    if place.element is None:
        text = _before_end(
            text, ["  <worldbody>", *_indented(bodies, "    "), "  </worldbody>"], newline
        )
    else:
        text = _within(text, place.element, bodies, newline)
    return _with_defaults(text, defaults, newline)


def _indented(lines: list[str], pad: str) -> list[str]:
    return [pad + line for line in lines]


def _margin(text: str, at: int) -> str | None:
    """Return the blanks between the start of a line and a place in it, None if it has more."""
    line = text[text.rfind("\n", 0, at) + 1 : at]
    return line if not line.strip() else None


def _within(text: str, element: Element, lines: list[str], newline: str) -> str:
    """Return text with lines as the last things in an element."""
    outer = _margin(text, element.start)
    pad = (outer or "") + ("\t" if (outer or "").endswith("\t") else "  ")
    block = newline.join(_indented(lines, pad)) + newline
    end = element.inner_end
    if end is None:
        raise ModelError(f"<{element.tag}> is never closed")
    if element.end == element.inner:  # an empty one: opened for what comes into it
        head = text[:end].rstrip()[:-2].rstrip() + ">"
        return f"{head}{newline}{block}{outer or ''}</{element.tag}>{text[end:]}"
    last = _margin(text, end)
    if last is None:
        return f"{text[:end]}{newline}{block}{outer or ''}{text[end:]}"
    start = end - len(last)
    return f"{text[:start]}{block}{text[start:]}"


def _with_defaults(text: str, lines: list[str], newline: str) -> str:
    """Return text with a section of defaults: behind the last one, else before the worldbody."""
    found = elements(text)
    top = [each for each in found if each.depth == 1]
    own = [each for each in top if each.tag == "default" and each.end is not None]
    if own and own[-1].end is not None:
        at = own[-1].end
        return f"{text[:at]}{newline}{newline.join(lines)}{text[at:]}"
    world = next((each for each in top if each.tag == "worldbody"), None)
    if world is None:
        return _before_end(text, lines, newline)
    margin = _margin(text, world.start)
    at = world.start - len(margin or "")
    block = newline.join(lines) + newline * 2
    return f"{text[:at]}{newline if margin is None else ''}{block}{text[at:]}"


def _before_end(text: str, lines: list[str], newline: str) -> str:
    """Return text with lines as the last ones of the model."""
    model = next((each for each in elements(text) if each.parent == ROOT), None)
    if model is None or model.inner_end is None:
        raise ModelError("the file has no outermost element, opened and closed")
    at = model.inner_end
    before = "" if text[:at].endswith("\n") else newline
    return f"{text[:at]}{before}{newline.join(lines)}{newline}{text[at:]}"


def with_keys(text: str, added: Added, source: str, whole: str) -> str:
    """Return text with zeros for added joints in the keyframes' positions and rates.

    whole: the text with all that it includes.

    Raises:
        ModelError: a keyframe that lists positions is in an included file.
    """
    own, every = _keys(text), _keys(whole)
    if len(own) != len(every):
        raise ModelError(
            f"{source}: a keyframe with positions is in a file that it includes, which is left as "
            f"it is; move the keyframes into {source}"
        )
    parts, position = [], 0
    for element in own:
        tag = text[element.start : element.inner]
        for name, at in (("qpos", added.qpos), ("qvel", added.qvel)):
            tag = _lengthened(tag, name, at, added.joints)
        parts += [text[position : element.start], tag]
        position = element.inner
    return "".join([*parts, text[position:]])


def _keys(text: str) -> list[Element]:
    """Return the keyframes that list positions or rates."""
    found = elements(text)
    return [
        each
        for each in found
        if each.tag == "key"
        and each.parent != ROOT
        and found[each.parent].tag == "keyframe"
        and {"qpos", "qvel"} & set(each.attributes)
    ]


def _lengthened(tag: str, name: str, at: int, count: int) -> str:
    """Return a tag with zeros before the number of this place in an attribute, if it has it."""
    for match in ATTRIBUTE.finditer(tag):
        if match[1] != name:
            continue
        numbers = list(re.finditer(r"\S+", match[2][1:-1]))
        zeros = " ".join(["0"] * count)
        start = match.start(2) + 1
        if at == 0 or not numbers:
            return f"{tag[:start]}{zeros}{' ' if numbers else ''}{tag[start:]}"
        behind = start + numbers[min(at, len(numbers)) - 1].end()
        return f"{tag[:behind]} {zeros}{tag[behind:]}"
    return tag
