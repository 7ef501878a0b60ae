"""Names from outside, as a line of text has them.

>>> spelled("two\\nlines.xml")
'two\\\\nlines.xml'
>>> one_line("first,\\n  then \\x1b[31mred")
'first, then \\\\x1b[31mred'
>>> plain("a*/b\\n$c"), word("2nd run (new)")
('a__b__c', '2nd_run_new')
>>> unmarked(markdown_text("50 % of a_b [mm]"))
'50 % of a_b [mm]'
"""

from __future__ import annotations

import re

LONGEST = 60  # characters of a plain name


def spelled(name: object) -> str:
    """Return a name with its control characters escaped, so that it is neither lines nor orders."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in str(name))


def one_line(text: object) -> str:
    """Return a text of several lines as one, control characters escaped."""
    return spelled(" ".join(str(text).split()))


def plain(name: object, longest: int = LONGEST) -> str:
    """Return a name of ASCII letters, digits, blanks and `-+.,:()`, all else an underscore.

    So it is neither markup, nor a formula, nor the end of a comment, wherever it is written.
    """
    return re.sub(r"[^A-Za-z0-9 +.,:()-]", "_", str(name))[:longest].strip() or "_"


def word(name: object) -> str:
    """Return a name as one word of ASCII letters, digits, dashes and underscores, for files."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", str(name)[: 2 * LONGEST]).strip("_-") or "unnamed"


def markdown_text(text: object) -> str:
    """Return a text on one line that markdown shows as it is, nothing in it markup."""
    return re.sub(r"([\\`*_{}\[\]<>#|~$&!])", r"\\\1", one_line(text))


def unmarked(text: str) -> str:
    """Return the text that `markdown_text` made another of."""
    return re.sub(r"\\([\\`*_{}\[\]<>#|~$&!])", r"\1", text)
