"""Other people's names for what the arm is addressed by: replaced in the text of their file.

>>> Names(joint1="shoulder", tip="gripper 0.02 0 0").applied(text, "my.xml")

A run keeps the text with the names replaced, so that its own file needs no such options.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields

import mujoco
import numpy as np

from flexsim.errors import ModelError
from flexsim.mjcf.reading.elements import ATTRIBUTE, ROOT, Element, elements, plain, quoted
from flexsim.numerics.mujoco_c import quiet_warnings

PLACES = ("body", "worldbody", "frame", "replicate")  # that joints and sites are put in
KINDS = {  # what kind of element each name is of
    "joint1": "joint",
    "joint2": "joint",
    "hub": "site",
    "tip": "site",
    "motor1": "actuator",
    "motor2": "actuator",
}
REFERENCES = {  # attributes with a name of the kind
    "joint": ("joint", "joint1", "joint2", "jointinparent"),
    "site": ("site", "site1", "site2", "refsite", "cranksite", "slidersite", "sidesite"),
    "actuator": ("actuator",),
}
NUMBER = r"[-+]?[0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?"
TYPED = {"objname": "objtype", "refname": "reftype"}  # whose kind another attribute says


@dataclass(frozen=True)
class Names:
    """What a file calls the parts of the arm; None: as we do.

    Attributes:
        joint1, joint2: joints. motor1, motor2: actuators.
        hub, tip: sites; or a body, on which a site is put, at the place [m] that follows the name
            ('gripper 0.02 0 0'), else the hub's in the body's origin, the tip's at its far end:
            as far along its x-axis as its geoms reach.
    """

    joint1: str | None = None
    joint2: str | None = None
    hub: str | None = None
    tip: str | None = None
    motor1: str | None = None
    motor2: str | None = None

    def given(self) -> dict[str, str]:
        """Return their names by ours, of those that differ."""
        pairs = ((item.name, getattr(self, item.name)) for item in fields(self))
        return {ours: theirs for ours, theirs in pairs if theirs not in (None, ours)}

    def applied(self, text: str, source: str) -> str:
        """Return MJCF with their names replaced by ours, and the sites that are asked for.

        Raises:
            ModelError: it has no element of that name, or another one of ours.
        """
        given = self.given()
        if not given:
            return text
        found = elements(text)
        renamed: dict[str, dict[str, str]] = {"joint": {}, "site": {}, "actuator": {}}
        placed: dict[int, str] = {}  # text to put behind an element's tag
        for ours, theirs in given.items():
            kind = KINDS[ours]
            if theirs in renamed[kind]:
                other = renamed[kind][theirs]
                raise ModelError(f"{source}: --{other} and --{ours} are both {theirs!r}")
            if theirs in _names_of(found, kind):
                renamed[kind][theirs] = ours
            elif kind == "site":
                body, place = _body_for(text, found, ours, theirs, source)
                placed[body] = placed.get(body, "") + f'<site name="{ours}" pos="{place}"/>'
            else:
                raise ModelError(_missing(found, ours, theirs, source))
        for ours in given:
            kind = KINDS[ours]
            if ours in _names_of(found, kind) and ours not in renamed[kind]:
                raise ModelError(
                    f"{source}: --{ours} {given[ours]!r}, but another {kind} is named {ours!r}; "
                    "rename that, or leave the option out"
                )
        return _edited(text, found, renamed, placed)


def _names_of(found: list[Element], kind: str) -> list[str]:
    """Return the names of all joints, sites or actuators."""
    return [
        each.attributes["name"]
        for each in found
        if "name" in each.attributes and _kind(found, each) == kind
    ]


def _kind(found: list[Element], element: Element) -> str:
    """Return what an element defines: a joint, a site, an actuator; or its tag."""
    outer = "" if element.parent == ROOT else found[element.parent].tag
    if element.tag in ("joint", "site"):
        return element.tag if outer in PLACES else ""
    return "actuator" if outer == "actuator" else element.tag


def _body_for(
    text: str, found: list[Element], ours: str, theirs: str, source: str
) -> tuple[int, str]:
    """Return the index of a body to put a site on, and the place as an attribute's text."""
    words = theirs.split()
    name, place = " ".join(words[:-3]), words[-3:]
    placed = len(words) > 3 and all(re.fullmatch(NUMBER, word) for word in place)
    if not placed:
        name = theirs
    for i, element in enumerate(found):
        if element.tag == "body" and element.attributes.get("name") == name:
            if placed:
                return i, " ".join(place)
            return i, f"{far_end(text, name):.12g} 0 0" if ours == "tip" else "0 0 0"
    raise ModelError(_missing(found, ours, theirs, source))


def far_end(text: str, name: str) -> float:
    """Return how far a body's geoms reach along its x-axis [m], 0 without any that do."""
    try:
        with quiet_warnings():
            model = mujoco.MjModel.from_xml_string(text)
    except (ValueError, mujoco.FatalError):
        return 0.0  # why it does not compile is said when it is read
    furthest = 0.0
    for i in np.flatnonzero(model.geom_bodyid == model.body(name).id):
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, model.geom_quat[i])
        along = axes[:3]  # the body's x-axis in the geom's frame
        centre, half = model.geom_aabb[i, :3], model.geom_aabb[i, 3:]
        reach = model.geom_pos[i, 0] + along @ centre + np.abs(along) @ half
        furthest = max(furthest, float(reach))
    return furthest


def _missing(found: list[Element], ours: str, theirs: str, source: str) -> str:
    kind = KINDS[ours]
    there = ", ".join(map(repr, _names_of(found, kind))) or "none with a name"
    if kind == "site":
        bodies = [e.attributes["name"] for e in found if e.tag == "body" and "name" in e.attributes]
        there += f"; nor is it one of its bodies: {', '.join(map(repr, bodies))}"
    return f"{source}: --{ours} {theirs!r}: it has no such {kind} (it has {there})"


def _edited(
    text: str,
    found: list[Element],
    renamed: Mapping[str, Mapping[str, str]],
    placed: Mapping[int, str],
) -> str:
    parts, position = [], 0
    for i, element in enumerate(found):
        tag = text[element.start : element.inner]
        new = _renamed(tag, _kind(found, element), element.attributes, renamed)
        if i in placed:
            alone = new.endswith("/>")
            new = new.removesuffix("/>").removesuffix(">") + ">" + placed[i]
            new += f"</{element.tag}>" if alone else ""
        if new != tag:
            parts += [text[position : element.start], new]
            position = element.inner
    return "".join([*parts, text[position:]])


def _renamed(
    tag: str, kind: str, given: Mapping[str, str], renamed: Mapping[str, Mapping[str, str]]
) -> str:
    """Return the text of a tag with names replaced, where it defines or refers to them."""

    def replaced(match: re.Match[str]) -> str:
        value = plain(match[2][1:-1])
        new = dict(_changes(match[1], kind, given, renamed)).get(value)
        return match[0] if new is None else f"{match[1]}={quoted(new)}"

    return ATTRIBUTE.sub(replaced, tag)


def _changes(
    attribute: str, kind: str, given: Mapping[str, str], renamed: Mapping[str, Mapping[str, str]]
) -> Iterator[tuple[str, str]]:
    """Give (their name, ours) as far as they hold for an attribute of an element."""
    for its, names in renamed.items():
        typed = attribute in TYPED and given.get(TYPED[attribute]) == its
        if (attribute == "name" and kind == its) or attribute in REFERENCES[its] or typed:
            yield from names.items()
