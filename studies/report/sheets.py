"""Tables as the page shows them: cells with a text and what they are sorted by.

>>> sheet = of_frame(frame)
>>> sheet.rows[0][6]
Cell(text='0.0068', key=0.006846603792590136, number=True)
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

from studies.core.evidence.digits import decimals
from studies.report.frames import Frame, Value, finite, is_number
from studies.report.kept import Shown
from studies.report.names import ENDS, PLAIN, in_words

CELLS_MOST, ROWS_MOST = 20_000, 1_000  # of a table on the page
DECIMALS_MOST = 12
LEADING = re.compile(r"\s*([+-]?\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?)", re.IGNORECASE)
MISSING = "-"


class Cell(NamedTuple):
    """A cell: its text, the number it is sorted by if it is one, and whether it stands right."""

    text: str
    key: float | None = None
    number: bool = False


class Head(NamedTuple):
    """A column's heading, unit and meaning."""

    text: str
    unit: str
    meaning: str
    number: bool


class Sheet(NamedTuple):
    """A table of the page.

    Attributes:
        caption, lead: above. note: below. heads, rows: as named.
        left_out: how many rows are not shown, in words.
    """

    caption: str
    note: str
    heads: Sequence[Head]
    rows: Sequence[Sequence[Cell]]
    left_out: str = ""
    lead: str = ""


def of_shown(table: Shown) -> Sheet:
    """Return a table for reading, its cells sorted by the number that they begin with."""
    columns = zip(table.headings, table.units, table.numbers, strict=True)
    heads = [Head(text, unit, "", number) for text, unit, number in columns]
    rows = [
        [_printed(text, number) for text, number in zip(line, table.numbers, strict=True)]
        for line in table.lines
    ]
    return Sheet(table.title, table.note, heads, rows)


def _printed(text: str, number: bool) -> Cell:
    found = LEADING.match(text) if number else None
    return Cell(text, float(found[1].replace(",", "")) if found else None, number)


def of_frame(frame: Frame) -> Sheet:
    """Return a file's table, intervals in the cells of their figures, in the file's units."""
    figures = set(frame.figures)
    ends = {f"{name}{end}" for name in figures for end in ENDS}
    names = [name for name in frame.columns if name not in ends]
    heads = []
    for name in names:
        about = frame.known(name)
        unit = "" if about.unit in PLAIN else about.unit
        interval = " [interval]" if name in figures else ""
        heads.append(Head(f"{in_words(name)}{interval}", unit, about.meaning, frame.numeric(name)))
    most = max(1, min(ROWS_MOST, CELLS_MOST // max(1, len(names))))
    rows = [
        [_cell(frame, row, name, name in figures) for name in names] for row in frame.rows[:most]
    ]
    left = "" if len(rows) == frame.total else f"The first {len(rows):,} of {frame.total:,} rows."
    return Sheet(frame.name, "", heads, rows, left)


def _cell(frame: Frame, row: Sequence[Value], name: str, interval: bool) -> Cell:
    value = row[frame.places[name]]
    if not is_number(value):
        return Cell(plain(value), None, frame.numeric(name))
    low, high = (finite(row[frame.places[f"{name}{end}"]]) if interval else None for end in ENDS)
    return Cell(with_ends(value, low, high), _key(value), True)


def _key(value: Value) -> float | None:
    number = float(value or 0)
    return None if math.isnan(number) else number


def plain(value: Value) -> str:
    """Return a value that is no number as text."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return MISSING if value is None or value == "" else str(value)


def short(value: Value) -> str:
    """Return a value as text, a number in six digits."""
    return f"{value:.6g}" if isinstance(value, float) else plain(value)


def with_ends(value: Value, low: float | None, high: float | None) -> str:
    """Return a number with its interval, in the digits that this supports; six without one."""
    number = finite(value)
    if number is None or (low is None and high is None):
        return short(value)
    digits = decimals(low, high, most=DECIMALS_MOST)
    if low is None or high is None or not low < high or digits == DECIMALS_MOST:
        ends = ("?" if end is None else f"{end:.6g}" for end in (low, high))
        return f"{short(value)} [{', '.join(ends)}]"
    return f"{number:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"
