"""The terminal: text is text. What looks like markup in a name stays as it is, on one line.

>>> console().print("[red]my[/] file.xml: done")
[red]my[/] file.xml: done
>>> shown(Path("two\nlines.xml"))
'two\\nlines.xml'
"""

from __future__ import annotations

from pathlib import Path

from rich.console import Console


def console(stderr: bool = False) -> Console:
    """Return a console that prints strings as they are: no markup, no emoji, no highlighting."""
    return Console(stderr=stderr, markup=False, emoji=False, highlight=False)


def shown(name: str | Path) -> str:
    """Return a name as a line of text has it, its control characters escaped."""
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in str(name))
