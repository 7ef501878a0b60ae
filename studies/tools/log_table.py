"""The columns of a laboratory's log: a CSV file as loggers and spreadsheets write it.

    >>> table = read_table(Path("log.csv"), {"t": "Time", "tau1": "Torque 1", "tau2": "Torque 2"})
    >>> table.time, table.values                  # (N,) from the first stamp, (N, 2), nan: missing

Commas, semicolons or tabs between columns, as the first line has them; names in quotes; decimal
points, or commas throughout; columns in any order, others beside them. Stamps are subtracted as
they are written, in decimals: those since 1970 lose nothing.
"""

from __future__ import annotations

import csv
import difflib
import io
import math
import re
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import ParameterError, RunError
from flexsim.files.reading import MIB, read_text
from flexsim.numerics.types import Array

LOG_MOST = 64 * MIB  # of a file: half an hour of rows of 1 ms in full digits
LINE_MOST = 100_000  # characters of a line
QUOTED, SHOWN = 60, 20  # characters of a wrong line, names of columns in a message
DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs"}
TIME = "t"  # the signal that stamps are
UNITS = {"s": 1, "ms": 1_000, "us": 1_000_000, "ns": 1_000_000_000}  # of stamps, in a second
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?", re.ASCII)
ALIKE = 0.4  # of a name, so that 't' is near 'Time'


@dataclass(frozen=True, eq=False)
class LogTable:
    """A log's rows that have a stamp.

    Attributes:
        source: the file. time: (N,) since the first stamp [s], rising. start: that stamp, as it
            is written. values: (N, S) of the signals, nan where a cell is empty or NaN.
        lines: (N,) of the file, for messages. unstamped: rows without a stamp, left out.
        columns: the names of the signals' columns; ignored: of all others.
        delimiter: between columns; comma: whether numbers have decimal commas.
    """

    source: str
    time: Array
    start: Decimal
    values: Array
    lines: NDArray[np.int64]
    unstamped: int
    columns: tuple[str, ...]
    ignored: tuple[str, ...]
    delimiter: str
    comma: bool


def read_table(
    path: Path, names: Mapping[str, str], unit: str = "s", what: str = "log"
) -> LogTable:
    """Return the columns of a CSV file.

    Args:
        path: of the file. names: of the columns by their signals, `t` first. unit: of the stamps,
            of UNITS. what: the file is, for messages.

    Raises:
        RunError: the file cannot be read, or is no CSV file.
        ParameterError: a column is missing, a row malformed, a stamp not after the one before; the
            message names the line.
    """
    text = read_text(path, LOG_MOST, what)
    try:
        header, delimiter = _header(text, set(names.values()))
        return _Rows(str(path), header, names, unit).table(text, delimiter)
    except csv.Error as error:
        raise RunError(f"{path}: cannot read the {what}: not a CSV file: {error}") from None


def _lines(text: str) -> Iterator[str]:
    """Give the lines of a text.

    Raises:
        csv.Error: one is longer than any log's.
    """
    for number, line in enumerate(io.StringIO(text, newline=""), start=1):
        if len(line) > LINE_MOST:
            raise csv.Error(f"line {number} has more than {LINE_MOST:,} characters")
        yield line


def _rows(text: str, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Give the rows of a CSV text that are not blank, with the numbers of their lines."""
    reader = csv.reader(_lines(text), delimiter=delimiter)
    for row in reader:
        if len(row) > 1 or "".join(row).strip():
            yield reader.line_num, row


def _header(text: str, wanted: set[str]) -> tuple[list[str], str]:
    """Return the names in the first line, and the delimiter with which it has most of the wanted,
    or most at all."""
    found = []
    for delimiter in DELIMITERS:
        _, row = next(_rows(text, delimiter), (1, []))
        names = [name.strip() for name in row]
        found.append((len(wanted.intersection(names)), len(names), names, delimiter))
    *_, names, delimiter = max(found, key=lambda each: each[:2])
    return names, delimiter


def shown(text: str) -> str:
    """Return a cell or row as a message quotes it: one of a binary file can be endless."""
    return repr(text if len(text) <= QUOTED else f"{text[:QUOTED]}...")


def places(source: str, header: list[str], names: Mapping[str, str]) -> dict[str, int]:
    """Return where each signal's column is.

    Raises:
        ParameterError: it is not there, or twice; the message lists the file's columns.
    """
    if not header:
        raise ParameterError(
            f"{source}: is empty; its first line must name the columns, {','.join(names)}"
        )
    for signal, name in names.items():
        times = header.count(name)
        if times == 1:
            continue
        meant = "" if name == signal else f", which is to be {signal}"
        own = [each if len(each) <= QUOTED else f"{each[:QUOTED]}..." for each in header]
        more = f" and {len(own) - SHOWN} more" if len(own) > SHOWN else ""
        listed = f"the first line has {', '.join(map(repr, own[:SHOWN]))}{more}"
        if times:
            raise ParameterError(
                f"{source}: {times} columns are called {name!r}{meant}; {listed}; give "
                "each a name of its own"
            )
        lower = {each.lower(): each for each in reversed(own)}
        close = difflib.get_close_matches(name.lower(), lower, n=1, cutoff=ALIKE)
        hint = f", perhaps {f'{signal}={lower[close[0]]}'!r}" if close else ""
        raise ParameterError(
            f"{source}: no column is called {name!r}{meant}; {listed}; name the one with "
            f"--columns{hint}"
        )
    return {signal: header.index(name) for signal, name in names.items()}


class _Rows:
    """Rows as they are read: what has been seen so far."""

    def __init__(self, source: str, header: list[str], names: Mapping[str, str], unit: str) -> None:
        self.source, self.header, self.names = source, header, names
        self.per_second = UNITS[unit]
        self.places = places(source, header, names)
        self.mark: str | None = None  # of decimals
        self.marked = ""  # where it was seen first
        self.first = self.last = Decimal(0)
        self.last_line = 0

    def table(self, text: str, delimiter: str) -> LogTable:
        """Return the rows of the text, checked."""
        time, values, lines = array("d"), array("d"), array("q")
        signals = [signal for signal in self.names if signal != TIME]
        unstamped = 0
        rows = _rows(text, delimiter)
        next(rows)
        for number, row in rows:
            self.where = f"{self.source}, line {number}"
            self._require_whole(row, delimiter)
            stamp = self._number(TIME, row)
            if stamp is None:
                unstamped += 1
                continue
            time.append(self._time(Decimal(stamp), not time, number))
            lines.append(number)
            for signal in signals:
                cell = self._number(signal, row)
                values.append(math.nan if cell is None else self._finite(signal, cell))
        if not time:
            raise ParameterError(f"{self.source}: has no rows; give at least one after the header")
        used = set(self.places.values())
        return LogTable(
            source=self.source,
            time=np.array(time),
            start=self.first,
            values=np.array(values).reshape(len(time), len(signals)),
            lines=np.array(lines),
            unstamped=unstamped,
            columns=tuple(self.names[signal] for signal in signals),
            ignored=tuple(name for i, name in enumerate(self.header) if i not in used and name),
            delimiter=delimiter,
            comma=self.mark == ",",
        )

    def _require_whole(self, row: list[str], delimiter: str) -> None:
        """Refuse a row of other cells than the header's; blank ones at its end are none."""
        if len(row) == len(self.header) or (
            len(row) > len(self.header) and not "".join(row[len(self.header) :]).strip()
        ):
            return
        commas = "; decimal commas need semicolons between columns" if delimiter == "," else ""
        raise ParameterError(
            f"{self.where}: {shown(delimiter.join(row))} has {len(row)} cells, the first line "
            f"{len(self.header)}; give a cell for each, empty where a sample is missing{commas}"
        )

    def _number(self, signal: str, row: list[str]) -> str | None:
        """Return a cell as Python writes numbers, None if it is empty or NaN."""
        cell = row[self.places[signal]].strip()
        if not cell or cell.lower() == "nan":
            return None
        number = cell.replace(",", ".")
        if not NUMBER.fullmatch(number):
            self._refuse(signal, cell, "dates are not read" if signal == TIME else "")
        mark = "," if "," in cell else "." if "." in cell else None
        if mark is not None and mark != self.mark:
            if self.mark is not None:
                raise ParameterError(
                    f"{self.where}: {shown(cell)} has the decimal mark {mark!r}, {self.marked} has "
                    f"{self.mark!r}; use one of them throughout, and none between thousands"
                )
            self.mark, self.marked = mark, self.where.removeprefix(f"{self.source}, ")
        return number

    def _refuse(self, signal: str, cell: str, more: str = "") -> None:
        raise ParameterError(
            f"{self.where}: {shown(cell)} in column {self.names[signal]!r} is not a finite number; "
            f"give one, or an empty cell where a sample is missing{'; ' * bool(more)}{more}"
        )

    def _finite(self, signal: str, cell: str) -> float:
        """Return the number of a cell, which may be too large for a double."""
        value = float(cell)
        if not math.isfinite(value):
            self._refuse(signal, cell)
        return value

    def _time(self, stamp: Decimal, first: bool, line: int) -> float:
        """Return the time of a stamp since the first [s].

        Raises:
            ParameterError: it is not after the one before.
        """
        if first:
            self._finite(TIME, str(stamp))
            self.first = stamp
        elif stamp <= self.last:
            raise ParameterError(
                f"{self.where}: t = {stamp} is not after {self.last} of line {self.last_line}; "
                "stamps must rise: sort the rows and drop repeated ones"
            )
        self.last, self.last_line = stamp, line
        time = float(stamp - self.first) / self.per_second
        if not math.isfinite(time):
            self._refuse(TIME, str(stamp))
        return time


def names_in(path: Path, wanted: set[str], what: str = "log") -> list[str]:
    """Return the names of a CSV file's columns; wanted: names that tell its delimiter.

    Raises:
        RunError: the file cannot be read, or is no CSV file.
    """
    text = read_text(path, LOG_MOST, what)
    try:
        return _header(text, wanted)[0]
    except csv.Error as error:
        raise RunError(f"{path}: cannot read the {what}: not a CSV file: {error}") from None
