"""Numbers of friction that may be identified: of the setting's law, and of its temperature.

>>> friction_number(setting("stribeck"), "friction.stiction_1")
1.5

A name has the joint behind it, `friction.mu_2`; without it both joints' are meant.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from flexsim.errors import ParameterError
from flexsim.loop.friction import LAWS, RESISTING
from flexsim.loop.settings import Setting

AT = "friction."
TABLE_4 = LAWS[1:]
STICKING = ("stribeck", "lugre")


class Place(NamedTuple):
    """Where a number is: the field, indices in it, its unit, and the laws that have it."""

    field: str
    at: tuple[int, ...]
    unit: str
    laws: tuple[str, ...]


def _pair(field: str, unit: str, laws: tuple[str, ...]) -> dict[str, Place]:
    return {f"{AT}{field}_{i + 1}": Place(field, (i,), unit, laws) for i in (0, 1)}


OF_LAW = {
    **_pair("tau_0", "N m", TABLE_4),
    **_pair("mu", "-", TABLE_4),
    **{
        f"{AT}dead_zone_{i + 1}_{end}": Place("dead_zone", (i, j), "N m", TABLE_4)
        for i in (0, 1)
        for j, end in enumerate(("low", "high"))
    },
    f"{AT}speed": Place("speed", (), "rad/s", RESISTING[:2]),
    **_pair("stiction", "-", STICKING),
    f"{AT}stribeck": Place("stribeck", (), "rad/s", STICKING),
    **_pair("sigma_0", "N m/rad", ("lugre",)),
    **_pair("sigma_1", "N m s/rad", ("lugre",)),
}
OF_TEMPERATURE = {  # of `flexsim.loop.hardware.effects`, whatever the law
    **_pair("cold", "-", TABLE_4),
    **_pair("warm", "-", TABLE_4),
    **_pair("warming", "s", TABLE_4),
}
FRICTION = {**OF_LAW, **OF_TEMPERATURE}
LEAST = {"stiction": 1.0}  # what a number may not fall below, where that is not 0
SCALES = {  # of what may begin at its least, or have either sign: a coordinate
    **{"tau_0": 0.1, "mu": 0.1, "dead_zone": 0.1, "stiction": 0.1, "sigma_0": 100.0},
    **{"sigma_1": 1.0, "cold": 0.1, "warm": 0.1},
}


def both_joints() -> dict[str, tuple[str, ...]]:
    """Return the names of both joints' numbers by the name without a joint."""
    found: dict[str, tuple[str, ...]] = {}
    for name, place in FRICTION.items():
        if place.at:
            found[f"{AT}{place.field}"] = (*found.get(f"{AT}{place.field}", ()), name)
    return found


def unit_of(name: str, chosen: Setting) -> str:
    """Return a number's unit, that of mu as the setting's law has it."""
    place = FRICTION[name]
    resists = place.field == "mu" and chosen.friction.law in RESISTING
    return "N m s/rad" if resists else place.unit


def is_there(name: str, chosen: Setting) -> bool:
    """Return whether the setting's law has a number."""
    return chosen.friction.law in FRICTION[name].laws


def require_there(name: str, chosen: Setting) -> None:
    """Refuse a number that the setting's law does not have.

    Raises:
        ParameterError: names the settings that would do.
    """
    laws = FRICTION[name].laws
    if not is_there(name, chosen):
        raise ParameterError(
            f"--free {name}: setting {chosen.name} has no such number; give --setting "
            f"{' or '.join(laws)}, or leave it out"
        )


def friction_number(chosen: Setting, name: str) -> float:
    """Return a number of a setting's friction by its name."""
    place = FRICTION[name]
    found: Any = getattr(
        chosen.hardware.effects if name in OF_TEMPERATURE else chosen.friction, place.field
    )
    for i in place.at:
        found = found[i]
    return float(found)


def with_friction(chosen: Setting, values: Mapping[str, float]) -> Setting:
    """Return a setting with these numbers of its friction in place of its own."""
    law: dict[str, Any] = {}
    effects: dict[str, Any] = {}
    for name in FRICTION:
        if name in values:
            place = FRICTION[name]
            source, changes = (
                (chosen.hardware.effects, effects)
                if name in OF_TEMPERATURE
                else (chosen.friction, law)
            )
            before = changes.get(place.field, getattr(source, place.field))
            changes[place.field] = _put(before, place.at, values[name])
    hardware = chosen.hardware
    if effects:
        hardware = replace(hardware, effects=replace(hardware.effects, **effects))
    return replace(chosen, friction=replace(chosen.friction, **law), hardware=hardware)


def _put(before: Any, index: tuple[int, ...], value: float) -> Any:
    """Return nested tuples with a value at an index."""
    if not index:
        return value
    i, *rest = index
    inner = _put(before[i], tuple(rest), value)
    return (*before[:i], inner, *before[i + 1 :])
