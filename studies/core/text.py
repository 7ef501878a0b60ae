"""Names from outside, as a line of text has them.

>>> spelled("two\\nlines.xml")
'two\\\\nlines.xml'
>>> one_line("first,\\n  then \\x1b[31mred")
'first, then \\\\x1b[31mred'
"""

from __future__ import annotations


def spelled(name: object) -> str:
    """Return a name with its control characters escaped, so that it is neither lines nor orders."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in str(name))


def one_line(text: object) -> str:
    """Return a text of several lines as one, control characters escaped."""
    return spelled(" ".join(str(text).split()))
