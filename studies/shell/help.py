"""What `flexsim COMMAND --help` prints: the options under headings, each number with its unit.

>>> print(help_of("view", width=60))                               # doctest: +SKIP
"""

from __future__ import annotations

import shutil
import textwrap

from studies.headings import HEADINGS
from studies.shell.parsed import Option, parsed

WIDEST = 120  # columns beyond which lines are hard to read
INDENT = 2
KEPT = "\N{NO-BREAK SPACE}"  # where no line ends; printed as a space
LEADING = ("mjcf", "beam", "hardware", "out")  # of their panels
HELP = ("-h, --help", "Show this and end.")


def help_of(command: str, width: int | None = None) -> str:
    """Return a command's help.

    Args:
        command: its name. width: of the terminal, in columns; that of this one unless given.
    """
    found = parsed(command)
    columns = min(width or shutil.get_terminal_size().columns, WIDEST)
    places = [each for each in found.options if not each.flags]
    usage = " ".join([f"usage: flexsim {command} [OPTIONS]", *map(_place, places)])
    lines = [usage, "", *textwrap.wrap(found.purpose, columns)]
    for panel in HEADINGS:
        members = [each for each in found.options if each.panel == panel]
        members.sort(key=lambda each: (bool(each.flags), each.name not in LEADING))
        rows = [_row(each) for each in members]
        if panel == HEADINGS[-1]:
            rows.append(HELP)
        if rows:
            lines += ["", f"{panel}:"]
            for invocation, text in rows:
                lines += _entry(invocation, text, columns)
    return "\n".join(lines)


def _place(option: Option) -> str:
    """Return what to give by its place."""
    return option.value or option.name.upper()


def _row(option: Option) -> tuple[str, str]:
    """Return how an option is given, and what is said of it."""
    flags = option.flags
    if flags and not option.value and not option.on:
        flags = tuple(each for each in flags if not undoes(each))
    invocation = f"{', '.join(flags)} {option.value}".strip() if flags else _place(option)
    unit = f"[{option.unit}] " if option.unit else ""
    default = f" (default: {flags[0] if option.on else option.default})"
    if not (option.on or option.default):
        default = ""
    if option.required:
        default = " (required)"
    return invocation, f"{unit}{option.text} {default[1:].replace(' ', KEPT)}".strip()


def undoes(flag: str) -> bool:
    """Return whether a flag is a switch's second, which undoes it."""
    return flag.rpartition(".")[2].removeprefix("--").startswith("no-")


def _entry(invocation: str, text: str, columns: int) -> list[str]:
    """Return the lines of an option: how it is given, and beside or below it what it is."""
    at = 26 if columns < 100 else 30
    lines = textwrap.wrap(
        text,
        columns,
        initial_indent=" " * at,
        subsequent_indent=" " * at,
        break_on_hyphens=False,
    )
    given = textwrap.wrap(
        invocation,
        columns,
        initial_indent=" " * INDENT,
        subsequent_indent=" " * 2 * INDENT,
        break_on_hyphens=False,
    )
    if lines and len(given[-1]) + 2 <= at:
        lines[0] = given.pop().ljust(at) + lines[0][at:]
    return [line.replace(KEPT, " ") for line in given + lines]
