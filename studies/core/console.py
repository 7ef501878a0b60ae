"""The terminal: text is text. What looks like markup in a name stays as it is.

>>> console().print("[red]my[/] file.xml: done")
[red]my[/] file.xml: done
"""

from __future__ import annotations

from rich.console import Console


def console(stderr: bool = False) -> Console:
    """Return a console that prints strings as they are: no markup, no emoji, no highlighting."""
    return Console(stderr=stderr, markup=False, emoji=False, highlight=False)
