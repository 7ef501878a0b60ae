"""Random structured edits of MJCF: what a user may do to a file, and what nobody would.

>>> edit = random_edit(np.random.default_rng(1), text)
"""

from __future__ import annotations

import copy
import re
from xml.etree import ElementTree

import numpy as np

NUMBER = re.compile(r"[-+]?[0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?")
FACTORS = (0.0, 1e-6, 1e-3, 0.1, 0.5, 0.9, 1.1, 2.0, 10.0, 1e3, 1e6)
INSERTED = {  # by the tag that it goes into: elements, which are what files have
    "worldbody": (
        '<geom type="box" size="0.1 0.1 0.1" pos="0.4 0.4 0"/>',
        '<body pos="0 0 1"><geom size="0.01"/></body>',
        '<body name="ball" pos="0 0 1"><freejoint/><geom size="0.01"/></body>',
    ),
    "body": (
        '<geom size="0.01"/>',
        '<geom size="0.01" mass="0.02"/>',
        '<site name="extra" pos="0.01 0 0"/>',
        '<body pos="0.02 0 0"><inertial pos="0 0 0" mass="0.02" diaginertia="1e-6 1e-6 1e-6"/>'
        "</body>",
        '<body pos="0.02 0 0"><joint type="hinge" axis="0 0 1" stiffness="2"/><inertial pos="0 0 0"'
        ' mass="0.02" diaginertia="1e-6 1e-6 1e-6"/></body>',
        '<joint name="extra" type="hinge" axis="0 0 1" stiffness="3"/>',
    ),
    "mujoco": (
        '<tendon><fixed stiffness="5"><joint joint="joint1" coef="1"/></fixed></tendon>',
        '<tendon><fixed damping="0.1"><joint joint="joint2" coef="1"/></fixed></tendon>',
        '<equality><joint joint1="joint1" active="false"/></equality>',
        '<equality><joint joint1="joint2"/></equality>',
        '<option density="1.2"/>',
        '<option gravity="0 -9.81 0"/>',
        '<option wind="1 0 0" viscosity="1"/>',
        '<compiler settotalmass="2"/>',
        '<contact><exclude body1="link1" body2="hub"/></contact>',
    ),
    "option": (
        '<flag energy="enable"/>',
        '<flag sleep="enable"/>',
        '<flag damper="disable"/>',
        '<flag spring="disable"/>',
        '<flag constraint="disable"/>',
        '<flag eulerdamp="disable"/>',
        '<flag gravity="enable"/>',
    ),
    "actuator": (
        '<motor name="motor3" joint="joint1"/>',
        '<position name="servo" joint="joint2" kp="5"/>',
    ),
}
ATTRIBUTES = {  # by tag: (attribute, values) that files may have
    "joint": (
        ("damping", ("0.001", "0.02", "1", "0.01 0.1")),
        ("armature", ("1e-5", "0.01")),
        ("stiffness", ("0.5", "20", "3 0.2 0.1")),
        ("frictionloss", ("0.01",)),
        ("range", ("-3 1.001", "-0.1 0.1")),
        ("springref", ("0.1",)),
        ("ref", ("0.1",)),
        ("axis", ("0 0 -1", "0 1 0", "0 0 2")),
        ("pos", ("0.01 0 0", "0 0.01 0", "0 0 0.01")),
        ("actuatorfrcrange", ("-0.01 0.01",)),
        ("type", ("slide", "ball", "hinge")),
    ),
    "motor": (
        ("gear", ("-1", "0", "3", "0.1", "1 1 1 1 1 1")),
        ("ctrlrange", ("-0.01 0.01",)),
        ("forcerange", ("-0.01 0.01",)),
        ("damping", ("0.1",)),
        ("armature", ("0.01",)),
        ("joint", ("joint1", "joint2")),
        ("delay", ("0.01",)),
        ("group", ("1",)),
    ),
    "body": (
        ("pos", ("0.1 0 0", "0 0 0.1", "0 0.001 0")),
        ("euler", ("0 0 0.1", "0.1 0 0")),
        ("quat", ("0 1 0 0", "2 0 0 0")),
        ("gravcomp", ("1",)),
        ("sleep", ("allowed",)),
        ("mocap", ("true",)),
    ),
    "inertial": (
        ("pos", ("0 0.01 0", "0.02 0 0.1")),
        ("mass", ("0", "0.05", "5")),
        ("diaginertia", ("1e-6 1e-6 1e-6", "1e-3 1e-3 1e-3", "0.1 0.1 0.1")),
        ("euler", ("0.3 0.2 0.1",)),
    ),
    "option": (
        ("integrator", ("Euler", "implicit", "implicitfast", "discrete", "RK4")),
        ("timestep", ("0.0005", "0.00025", "0.002", "0.0001")),
        ("iterations", ("1", "5")),
        ("tolerance", ("1e-3",)),
        ("solver", ("PGS", "CG", "Newton")),
        ("cone", ("elliptic",)),
        ("jacobian", ("sparse", "dense")),
        ("gravity", ("0 0 -9.81", "1 0 0")),
        ("actuatorgroupdisable", ("0", "1")),
    ),
    "compiler": (
        ("angle", ("degree",)),
        ("inertiafromgeom", ("true", "auto")),
        ("autolimits", ("false",)),
        ("balanceinertia", ("true",)),
        ("boundmass", ("0.1",)),
        ("boundinertia", ("1e-4",)),
        ("fusestatic", ("true",)),
        ("discardvisual", ("true",)),
        ("coordinate", ("local",)),
    ),
    "flex": (
        ("radius", ("0.002", "0.01")),
        ("solref", ("0.02 1", "-1e4 -10")),
        ("solimp", ("0.5 0.9 0.01",)),
        ("active", ("false",)),
    ),
    "elasticity": (
        ("young", ("1e9", "1e10", "1e12")),
        ("damping", ("1e-5", "1e-4", "0.01")),
        ("poisson", ("0.3",)),
        ("thickness", ("0.001",)),
    ),
    "site": (("pos", ("0.01 0 0", "0 0.01 0")), ("euler", ("0 0 1",))),
    "flag": (
        ("warmstart", ("enable", "disable")),
        ("contact", ("enable",)),
        ("gravity", ("enable",)),
        ("island", ("disable", "enable")),
        ("actuation", ("disable",)),
        ("equality", ("disable",)),
        ("clampctrl", ("disable",)),
        ("refsafe", ("disable",)),
        ("autoreset", ("enable",)),
        ("invdiscrete", ("enable",)),
        ("fwdinv", ("enable",)),
    ),
}
SHOWN_ONLY = (  # nothing of it moves anything: not worth an edit
    "visual", "asset", "statistic", "keyframe", "sensor", "light", "camera", "headlight",
    "quality", "global", "texture", "material", "key", "mujoco",
)  # fmt: skip


def random_edit(rng: np.random.Generator, text: str) -> tuple[str, str]:
    """Return (what was done, edited text): one to three edits of MJCF."""
    root = ElementTree.fromstring(text)
    for section in list(root):
        if section.tag in ("keyframe", "sensor"):  # which would only no longer fit
            root.remove(section)
    done = [_one(rng, root) for _ in range(rng.choice([1, 1, 1, 2, 3]))]
    return "; ".join(done), ElementTree.tostring(root, encoding="unicode")


def _one(rng: np.random.Generator, root: ElementTree.Element) -> str:
    """Edit the tree in place; return what was done."""
    kinds = (
        scaled,
        scaled,
        negated,
        deleted,
        attribute_deleted,
        duplicated,
        swapped,
        inserted,
        given,
    )
    while True:
        edit = kinds[rng.integers(len(kinds))]
        done = edit(rng, root)
        if done:
            return f"{edit.__name__} {done}"


def _elements(root: ElementTree.Element) -> list[ElementTree.Element]:
    hidden: set[int] = set()
    for section in root:
        if section.tag in SHOWN_ONLY:
            hidden |= {id(element) for element in section.iter()}
    return [e for e in root.iter() if id(e) not in hidden and e.tag not in SHOWN_ONLY]


def _chosen(rng: np.random.Generator, found: list[ElementTree.Element]) -> ElementTree.Element:
    """Choose by tag first, so that many of a kind do not crowd out the few of another."""
    tags = sorted({element.tag for element in found})
    tag = tags[rng.integers(len(tags))]
    of_tag = [element for element in found if element.tag == tag]
    return of_tag[rng.integers(len(of_tag))]


def _said(element: ElementTree.Element) -> str:
    return f"{element.tag} {element.get('name') or element.get('class') or ''}".strip()


def _numeric(
    rng: np.random.Generator, root: ElementTree.Element
) -> tuple[ElementTree.Element, str, list[str], int] | None:
    """Choose an element, an attribute with numbers, and one of these."""
    element = _chosen(rng, _elements(root))
    names = [
        name for name, value in element.attrib.items()
        if value.split() and all(NUMBER.fullmatch(word) for word in value.split())
    ]  # fmt: skip
    if not names:
        return None
    name = names[rng.integers(len(names))]
    words = element.attrib[name].split()
    return element, name, words, int(rng.integers(len(words)))


def scaled(rng: np.random.Generator, root: ElementTree.Element) -> str:
    chosen = _numeric(rng, root)
    if chosen is None:
        return ""
    element, name, words, i = chosen
    factor = FACTORS[rng.integers(len(FACTORS))]
    every = name == "diaginertia" or rng.random() < 0.5
    for k in range(len(words)) if every else (i,):
        words[k] = f"{float(words[k]) * factor!r}"
    element.set(name, " ".join(words))
    return f"{_said(element)} {name} by {factor:g}"


def negated(rng: np.random.Generator, root: ElementTree.Element) -> str:
    chosen = _numeric(rng, root)
    if chosen is None:
        return ""
    element, name, words, i = chosen
    words[i] = f"{-float(words[i])!r}"
    element.set(name, " ".join(words))
    return f"{_said(element)} {name}"


def _with_parent(
    rng: np.random.Generator, root: ElementTree.Element
) -> tuple[ElementTree.Element, ElementTree.Element]:
    parents = {id(child): parent for parent in root.iter() for child in parent}
    element = _chosen(rng, [e for e in _elements(root) if id(e) in parents])
    return parents[id(element)], element


def deleted(rng: np.random.Generator, root: ElementTree.Element) -> str:
    parent, element = _with_parent(rng, root)
    parent.remove(element)
    return _said(element)


def attribute_deleted(rng: np.random.Generator, root: ElementTree.Element) -> str:
    element = _chosen(rng, _elements(root))
    if not element.attrib:
        return ""
    names = sorted(element.attrib)
    name = names[rng.integers(len(names))]
    del element.attrib[name]
    return f"{_said(element)} {name}"


def duplicated(rng: np.random.Generator, root: ElementTree.Element) -> str:
    parent, element = _with_parent(rng, root)
    twin = copy.deepcopy(element)
    if rng.random() < 0.7:  # else names are there twice, which MuJoCo refuses
        for each in twin.iter():
            if "name" in each.attrib:
                each.set("name", each.attrib["name"] + "_twin")
    parent.insert(list(parent).index(element) + 1, twin)
    return _said(element)


def swapped(rng: np.random.Generator, root: ElementTree.Element) -> str:
    """Swap two siblings, or one attribute of two elements of a kind."""
    parent, element = _with_parent(rng, root)
    if rng.random() < 0.4:
        siblings = list(parent)
        i, j = siblings.index(element), int(rng.integers(len(siblings)))
        parent[i], parent[j] = siblings[j], siblings[i]
        return f"{_said(element)} and {_said(siblings[j])}"
    others = [e for e in _elements(root) if e.tag == element.tag and e is not element]
    common = [name for name in element.attrib if any(name in e.attrib for e in others)]
    if not common:
        return ""
    name = common[rng.integers(len(common))]
    able = [e for e in others if name in e.attrib]
    other = able[rng.integers(len(able))]
    element.attrib[name], other.attrib[name] = other.attrib[name], element.attrib[name]
    return f"{name} of {_said(element)} and {_said(other)}"


def inserted(rng: np.random.Generator, root: ElementTree.Element) -> str:
    able = [e for e in root.iter() if e.tag in INSERTED]
    into = _chosen(rng, able)
    texts = INSERTED[into.tag]
    text = texts[rng.integers(len(texts))]
    into.append(ElementTree.fromstring(text))
    return f"{text} in {_said(into)}"


def given(rng: np.random.Generator, root: ElementTree.Element) -> str:
    """Give an element an attribute that it may have."""
    element = _chosen(rng, [e for e in _elements(root) if e.tag in ATTRIBUTES])
    able = ATTRIBUTES[element.tag]
    name, values = able[rng.integers(len(able))]
    value = values[rng.integers(len(values))]
    element.set(name, value)
    return f'{_said(element)} {name}="{value}"'
