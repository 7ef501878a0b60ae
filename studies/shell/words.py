"""What a completion script offers, in the form that all shells' scripts are made from.

>>> words = words_of_all()
>>> words[0].command, words[0].flags[0].names
('compare', ('--controller', '--controllers'))
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from studies.commands import COMMANDS
from studies.shell.choices import ending, offered
from studies.shell.help import undoes
from studies.shell.parsed import parsed

MANY = 99  # values of an option that takes any number
LONGEST = 60  # characters of what is said of an option


@dataclass(frozen=True)
class Flag:
    """An option as it is completed.

    Attributes:
        names: that set or undo it. about: in a few words. most: how many values it takes.
        values: to offer. ending: of files, "/" of folders, "" of any, None if it takes none.
    """

    names: tuple[str, ...]
    about: str
    most: int
    values: tuple[str, ...]
    ending: str | None


@dataclass(frozen=True)
class Words:
    """A command as it is completed; `places` are values without a flag, in their order."""

    command: str
    about: str
    flags: Sequence[Flag]
    places: Sequence[Flag]


HELP = Flag(("--help",), "Show the options and end", 0, (), None)


def words_of_all() -> list[Words]:
    """Return the words of all commands, in the order of the help."""
    return [_words(command) for command in COMMANDS]


def _words(command: str) -> Words:
    flags: list[Flag] = []
    places: list[Flag] = []
    for option in parsed(command).options:
        names = tuple(each for each in option.flags if option.on or not undoes(each))
        most = 0 if not option.value else MANY if math.isinf(option.most) else int(option.most)
        files = ending(command, option)
        flag = Flag(names, _short(option.text), most, offered(command, option), files)
        (flags if option.flags else places).append(flag)
    return Words(command, COMMANDS[command].text, [*flags, HELP], places)


def _short(text: str) -> str:
    """Return the first clause of a help."""
    clause = re.split(r"[.;:] |[.;:]\Z", text)[0]
    return clause if len(clause) <= LONGEST else clause[: LONGEST - 4].rsplit(" ", 1)[0] + " ..."
