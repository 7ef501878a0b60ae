"""Which options has a command? As its parser knows them, each with what a person is told of it.

>>> options = parsed("compare").options
>>> next(each for each in options if "--period" in each.flags).unit
's'
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import math
import re
import warnings
from collections.abc import Sequence

from studies.commands import COMMANDS
from studies.shell.panels import panel_of

NONE = re.compile(r"\{None\}\||None,|\bNone\b")  # of metavars: what no one types
MORE = re.compile(r"\[(.+) \[\1 \.\.\.\]\]")  # of metavars: any number of the same
HINT = re.compile(r"\s*\((?:default: (.*?)|required|repeatable)\)\Z", re.DOTALL)
UNIT = re.compile(r"\[([^]:\[]+)\]")
PLURAL = " ..."
NOTHING = ("None", "False", "True", "")  # defaults that need other words, or none


@dataclasses.dataclass(frozen=True)
class Option:
    """An option, or a value by its place if it has no flags.

    Attributes:
        name: of its field, dotted within another. flags: those that set it, those that undo it.
        value: what to give, as FLOAT; empty of a switch. text: the help, without unit and default.
        unit: of its number; empty without one. default: as typed; empty if there is none to show.
        most: how many values it takes, inf for any number. choices: the only ones, if so declared.
        panel: the heading that it is under. required: whether nothing works without it.
        on: of a switch, whether it is set unless undone.
    """

    name: str
    flags: tuple[str, ...]
    value: str
    text: str
    unit: str
    default: str
    most: float
    choices: tuple[str, ...]
    panel: str
    required: bool
    on: bool


@dataclasses.dataclass(frozen=True)
class Parsed:
    """A command: what it is for, and its options in the order of its configuration."""

    name: str
    purpose: str
    options: Sequence[Option]


def parsed(command: str) -> Parsed:
    """Return a command's options, as tyro parses them.

    Args:
        command: its name, a key of `COMMANDS`.
    """
    import tyro

    home = COMMANDS[command]
    config = getattr(importlib.import_module(f"studies.{home.module}"), home.config)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of the view as argparse has it
        parser = tyro.extras.get_parser(config, prog=f"flexsim {command}")
    actions = [each for each in parser._actions if each.dest != "help"]
    purpose = " ".join((parser.description or "").split())
    return Parsed(command, purpose, [_option(config, each) for each in actions])


def _required(action: argparse.Action) -> bool:
    """Return whether nothing works without an option; of several words in their place, one."""
    if action.option_strings:
        return bool(action.required)
    return action.nargs == "*" or (bool(action.required) and action.nargs != "?")


def _option(config: type, action: argparse.Action) -> Option:
    """Return an option of a configuration's class."""
    metavar = action.metavar if isinstance(action.metavar, str) else ""
    text, default = _told(action.help or "")
    unit = ""
    if "FLOAT" in metavar:
        text, unit = _measured(text)
    switch = action.nargs == 0
    name = action.dest.replace("-", "_")
    return Option(
        name=name,
        flags=tuple(action.option_strings),
        value="" if switch else _value(metavar),
        text=text,
        unit=unit,
        default="" if default in NOTHING else default,
        most=_most(action, metavar),
        choices=tuple(str(each) for each in action.choices or () if str(each) != "None"),
        panel=panel_of(config, name),
        required=_required(action),
        on=switch and default == "True",
    )


def _told(text: str) -> tuple[str, str]:
    """Return what is said of an option, and its default; of argparse's own form of both."""
    said = text.replace("%%", "%")
    hint = HINT.search(said)
    if hint is None:
        return " ".join(said.split()), ""
    return " ".join(said[: hint.start()].split()), " ".join((hint[1] or "").split())


def _measured(text: str) -> tuple[str, str]:
    """Return the text of a number without its unit, and the unit, if it is the only one there."""
    units = UNIT.findall(text)
    if len(units) != 1:
        return text, ""
    return UNIT.sub("", text).replace("  ", " ").replace(" ,", ",").replace(" ;", ";").replace(
        " .", "."
    ).replace(" :", ":").strip(), units[0]


def _value(metavar: str) -> str:
    """Return what to give, without the None that no one types and without brackets of brackets."""
    found = NONE.sub("", metavar)
    if found.startswith("{[") and found.endswith("]}"):
        found = found[1:-1]
    if re.fullmatch(r"\{[^{},]*\}", found):
        found = found[1:-1]
    return MORE.sub(lambda many: many[1] + PLURAL, found)


def _most(action: argparse.Action, metavar: str) -> float:
    """Return how many values an option takes."""
    if action.nargs in ("*", "+"):
        fixed = _value(metavar)
        return math.inf if fixed.endswith(PLURAL) else len(fixed.split())
    return action.nargs if isinstance(action.nargs, int) else 1
