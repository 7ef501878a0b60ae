"""Places in a study file by their paths: `controllers[2].joint1.k1`, `robot.EI`, `robots[*].zeta`.

>>> document = {"robots": [{"EI": 0.349}]}
>>> put(document, "robot.zeta", 0.002)
>>> document["robots"]
[{'EI': 0.349, 'zeta': 0.002}]

`robot` is the only one of `robots`. [*] is every item of a list; an item may be named, too:
`controllers[mine].joint1.kp`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from flexsim.errors import ParameterError

STEP = re.compile(r"(?P<key>[A-Za-z_][\w-]*)(?P<items>(?:\[[^\[\]]+\])*)")
NUMBER = re.compile(r"[0-9]{1,9}")
NAMED = ("name", "use", "model", "shape", "law")  # what an item is called by, the first of these
ITEM = re.compile(r"\[([^\[\]]+)\]")
EVERY = "*"
Place = tuple[str | int, ...]


def parsed(path: str) -> tuple[str, ...]:
    """Return the keys and items of a path, `robot` as robots[0].

    Raises:
        ParameterError: it is none.
    """
    found: list[str] = []
    for step in re.split(r"\.(?![^\[]*\])", path):
        match = STEP.fullmatch(step)
        if match is None:
            raise ParameterError(
                f"{path!r} is no path; give one such as robot.EI or controllers[2].joint1.k1"
            )
        found += [match["key"], *ITEM.findall(match["items"])]
    return tuple(found)


def places(document: dict[str, Any], path: str) -> list[Place]:
    """Return the places that a path names, its last key there or not.

    Raises:
        ParameterError: a table or an item on the way is not there.
    """
    steps = parsed(path)
    if steps[0] == "robot":
        if len(document.get("robots", ())) > 1:
            raise ParameterError(f"{path}: there are several robots; give robots[0], robots[*]")
        steps = ("robots", "0", *steps[1:])
    return list(_walk(document, steps, (), path))


def _walk(node: Any, steps: tuple[str, ...], before: Place, path: str) -> Iterator[Place]:
    """Give the places below a node."""
    step, rest = steps[0], steps[1:]
    for at in _items(node, step, before, path):
        if not rest:
            yield (*before, at)
            continue
        within = node.get(at, {}) if isinstance(node, dict) else node[at]
        if within == {} and NUMBER.fullmatch(rest[0]):
            raise ParameterError(
                f"{path}: {spelled((*before, at))} is not in the file; give all of it"
            )
        yield from _walk(within, rest, (*before, at), path)


def _items(node: Any, step: str, before: Place, path: str) -> list[str | int]:
    """Return the key or the items of a node that a step names."""
    if isinstance(node, dict):
        return [step]
    where = spelled(before)
    if not isinstance(node, list):
        raise ParameterError(f"{path}: {where} has nothing within it")
    if step == EVERY:
        return list(range(len(node)))
    names = [_name(each) for each in node]
    if step in names:
        return [names.index(step)]
    if NUMBER.fullmatch(step) and int(step) < len(node):
        return [int(step)]
    named = [str(name) for name in names if name is not None]
    known = f"0 to {len(node) - 1}" if node else "none"
    raise ParameterError(
        f"{path}: {where} has no item {step!r}; it has {known}"
        + (f", named {', '.join(named)}" if named else "")
    )


def _name(item: Any) -> Any:
    """Return the name of a list's item, which may be that of what it uses."""
    if not isinstance(item, dict):
        return None
    return next((item[key] for key in NAMED if isinstance(item.get(key), str)), None)


def spelled(place: Place) -> str:
    """Return a place as text; that of the only robot as `robots[0]`.

    >>> spelled(("controllers", 2, "joint1", "k1"))
    'controllers[2].joint1.k1'
    """
    text = ""
    for step in place:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text


def get(document: Any, place: Place) -> Any:
    """Return what stands at a place, None if there is nothing."""
    for step in place:
        if isinstance(step, int):
            document = document[step] if step < len(document) else None
        else:
            document = document.get(step) if isinstance(document, dict) else None
        if document is None:
            return None
    return document


def set_at(document: Any, place: Place, value: Any) -> None:
    """Put a value at a place, tables on the way made where there are none."""
    for step in place[:-1]:
        document = document[step] if isinstance(step, int) else document.setdefault(step, {})
    document[place[-1]] = value


def changed(node: Any, place: Place, value: Any) -> Any:
    """Return a copy of tables with another value at a place; what is not on the way is shared."""
    if not place:
        return value
    step = place[0]
    if isinstance(step, int):
        return [*node[:step], changed(node[step], place[1:], value), *node[step + 1 :]]
    return {**(node or {}), step: changed((node or {}).get(step), place[1:], value)}


def put(document: dict[str, Any], path: str, value: Any) -> None:
    """Put a value at all places that a path names; errors as `places`."""
    if parsed(path)[0] == "robot":
        document.setdefault("robots", [{}])
    for place in places(document, path):
        set_at(document, place, value)
