"""Is a file of a size that MuJoCo compiles at once? Stated limits, looked up in the text.

    >>> require_small("my.xml", text)

MuJoCo's compiler holds Python's lock, so that neither Ctrl-C nor SIGTERM ends it, and takes all
the memory that a file asks for: three million copies of a geom, a texture of 14 GB. What is within
the limits here compiles within half a second. An arm needs a hundredth of them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from flexsim.errors import ModelError
from flexsim.mjcf.reading.elements import ROOT, Element, elements

ELEMENTS = 2000  # copies by <replicate> and points of <flexcomp> counted
JOINTS = 256  # of bodies
DEPTH = 300  # of elements within others
PIXELS = 2**24  # of all textures together: 16 of 1024 x 1024
HEIGHTS = 10**6  # of all height fields together
MESHES, CORNERS = 20, 20_000  # meshes; vertices of all together
ACTUATORS = 50  # whose ranges of length may be simulated
RESOLUTION = 64.0  # of a mesh that MuJoCo builds
RECORDS = 10**5  # numbers that an attribute sets aside
RECORDED = {  # attributes that set numbers aside, by element; of all others `nsample`
    "numeric": ("size",),
    "user": ("dim", "nsample"),
    "contact": ("num", "nsample"),
}
MEMORY = 2**28  # bytes
UNITS = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40, "P": 2**50, "E": 2**60}
RANGE_STEPS = 10**4  # of the simulations that find actuators' ranges of length
FILES = ("mesh", "hfield", "texture", "skin", "model", "flexcomp", "attach")
SURROGATE = re.compile("[\ud800-\udfff]")
SHOWN = 60  # characters of a value that a message quotes
FACES = 6  # of a cube or a sky


def require_small(source: str, text: str) -> None:
    """Raise a ModelError unless the text of a file, its includes in place, is within the limits.

    The message names every limit that it is beyond, and the elements.
    """
    reasons = list(dict.fromkeys(_reasons(elements(text))))
    if reasons:
        raise ModelError(f"{source}: {'; '.join(reasons)}")


def _reasons(found: list[Element]) -> Iterator[str]:
    copies = _copies(found)
    counts = [copy * _points(element) for element, copy in zip(found, copies, strict=True)]
    jointed = zip(found, counts, strict=True)
    joints = sum(count for each, count in jointed if each.tag in ("joint", "freejoint", "flexcomp"))
    if sum(counts) > ELEMENTS:
        largest = found[max(range(len(found)), key=counts.__getitem__)].tag
        yield f"has more than {ELEMENTS} elements, most of them <{largest}>; MuJoCo would be long"
    elif joints > JOINTS:
        yield f"has more than {JOINTS} joints; the arm needs a tenth of that"
    if max((element.depth for element in found), default=0) > DEPTH:
        yield f"has elements within each other, {DEPTH} deep and more"
    pixels = sum(_pixels(each) * copy for each, copy in zip(found, copies, strict=True))
    if pixels > PIXELS:
        yield f"has textures of more than {PIXELS:,} pixels (width, height); make them smaller"
    heights = sum(_product(each, ("nrow", "ncol")) for each in found if each.tag == "hfield")
    if heights > HEIGHTS:
        yield f"has height fields of more than {HEIGHTS:,} heights (nrow, ncol); make them smaller"
    if any(each.tag == "rangefinder" and "camera" in each.attributes for each in found):
        rays = max((_resolution(each) for each in found if each.tag == "camera"), default=0.0)
        if rays > RECORDS:
            yield f"has a rangefinder of over {RECORDS:,} rays, a camera's resolution; lower it"
    yield from _of_meshes(found)
    acting = sum(found[each.parent].tag == "actuator" for each in found if each.parent != ROOT)
    if acting > ACTUATORS:
        yield f"has more than {ACTUATORS} actuators; the arm needs two"
    for element in found:
        yield from _of_one(element)


def _resolution(camera: Element) -> float:
    """Return the pixels of a camera, as `resolution` has them."""
    return math.prod(_numbers(camera.attributes.get("resolution", "")))


def _of_meshes(found: list[Element]) -> Iterator[str]:
    meshes = [element for element in found if element.tag == "mesh"]
    corners = sum(len(each.attributes.get("vertex", "").split()) / 3 for each in meshes)
    if len(meshes) > MESHES or corners > CORNERS:
        yield f"has more than {MESHES} meshes or {CORNERS:,} vertices of them; leave them out"
    if any(each.tag == "plugin" and found[each.parent].tag == "mesh" for each in found):
        yield "has a mesh that a plugin builds; leave it out"


def _of_one(element: Element) -> Iterator[str]:
    """Give what is too much of one element, and files that it needs."""
    tag, given = element.tag, element.attributes
    if any(SURROGATE.search(value) for value in given.values()):
        yield f"<{tag}> has an attribute with a character reference that is no character"
    files = [value for name, value in given.items() if name.startswith("file")]
    if tag in FILES and files:
        shown = f"{files[0]!r}"[:SHOWN]
        yield f"<{tag}> needs other files, which a run could not keep, {shown}; leave it out"
    if tag == "mesh" and "builtin" in given:
        if max(_numbers(given.get("params", "")), default=0) > RESOLUTION:
            yield f"<mesh> has params over {RESOLUTION:g}; MuJoCo would build millions of triangles"
    if tag == "size":
        for name, value in given.items():
            most = MEMORY if name in ("memory", "nstack") else RECORDS
            if _size(value) > most:
                yield f"<size> has {name} {value[:20]!r}; leave it out, or give at most {most:,}"
    for name in RECORDED.get(tag, ("nsample",)):
        if max(_numbers(given.get(name, "")), default=0) > RECORDS:
            yield f"<{tag}> has {name} over {RECORDS:,}; give less"
    if tag == "lengthrange":
        total, step = _first(given.get("inttotal"), 10.0), _first(given.get("timestep"), 0.01)
        if not total <= RANGE_STEPS * step:
            yield f"<lengthrange> asks for more than {RANGE_STEPS:,} steps; leave it out"


def _copies(found: list[Element]) -> list[float]:
    """Return how often each element is there, the <replicate>s around it multiplied."""
    copies: list[float] = []
    for element in found:
        around = 1.0
        if element.parent != ROOT:
            outer = found[element.parent]
            around = copies[element.parent]
            if outer.tag == "replicate":
                around *= max(1.0, _first(outer.attributes.get("count"), 1.0))
        copies.append(around)
    return copies


def _points(element: Element) -> float:
    """Return how many elements an element is: a <flexcomp> has a body and joints per point."""
    if element.tag not in ("flex", "flexcomp"):
        return 1.0
    listed = max(len(element.attributes.get(name, "").split()) for name in ("point", "vertex"))
    count = math.prod(max(1.0, value) for value in _numbers(element.attributes.get("count", "")))
    return max(count, listed / 3)


def _pixels(element: Element) -> float:
    if element.tag != "texture":
        return 0.0
    square = element.attributes.get("type", "cube") in ("cube", "skybox")
    width = _first(element.attributes.get("width"), 0.0)
    height = width if square else _first(element.attributes.get("height"), 0.0)
    return width * height * (FACES if square else 1)


def _product(element: Element, names: tuple[str, ...]) -> float:
    return math.prod(_first(element.attributes.get(name), 0.0) for name in names)


def _numbers(text: str) -> list[float]:
    """Return the numbers of an attribute; what is none, MuJoCo refuses itself."""
    found = []
    for word in text.split():
        try:
            value = float(word)
        except ValueError:
            continue
        if not math.isnan(value):
            found.append(value)
    return found


def _first(text: str | None, usual: float) -> float:
    return next(iter(_numbers(text or "")), usual)


def _size(text: str) -> float:
    """Return bytes of text such as 10M, or a number."""
    match = re.fullmatch(r"\s*(-?[0-9.]+(?:[eE][0-9]+)?)\s*([KMGTPE]?)B?\s*", text, re.IGNORECASE)
    return float(match[1]) * UNITS[match[2].upper()] if match else 0.0
