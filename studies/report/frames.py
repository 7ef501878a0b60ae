"""Tables of a run as its files have them: columns with a type, rows of numbers and text.

>>> frame = read_csv(Path("runs/compare/results.csv"))
>>> frame.name, frame.columns[0], frame.rows[0][0]
('results.csv', 'controllers', 'tuned line')
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from flexsim.errors import RunError
from flexsim.files.reading import MIB
from studies.report.entries import opened, text_of
from studies.report.names import ENDS, Known, known

CSV_MOST, PARQUET_MOST = 64 * MIB, 256 * MIB
ROWS_READ = 20_000  # of a CSV file; more are counted
COLUMNS_MOST = 1000
Value = str | float | int | bool | None
TRUTH = {"True": True, "False": False, "true": True, "false": False}


@dataclass(frozen=True, eq=False)
class Frame:
    """A file's table, or its first rows.

    Attributes:
        name: of the file. columns: names. rows: values, None where there is none.
        total: rows of the file. about: units and meanings that the file itself gives.
    """

    name: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Value]]
    total: int
    about: Mapping[str, Known] = field(default_factory=dict)

    @cached_property
    def places(self) -> dict[str, int]:
        """The number of each column."""
        return {name: i for i, name in enumerate(self.columns)}

    def column(self, name: str) -> list[Value]:
        """Return a column's values."""
        i = self.places[name]
        return [row[i] for row in self.rows]

    def numeric(self, name: str) -> bool:
        """Return whether a column has numbers, and nothing else."""
        return name in self._numeric

    @cached_property
    def _numeric(self) -> frozenset[str]:
        return frozenset(
            name
            for i, name in enumerate(self.columns)
            if all(row[i] is None or is_number(row[i]) for row in self.rows)
            and any(row[i] is not None for row in self.rows)
        )

    @cached_property
    def figures(self) -> list[str]:
        """Columns of numbers with an interval beside them, `NAME_low` and `NAME_high`."""
        own = set(self.columns)
        return [
            name
            for name in self.columns
            if all(f"{name}{end}" in own for end in ENDS) and self.numeric(name)
        ]

    def known(self, name: str) -> Known:
        """Return a column's unit and meaning, as the file or its name gives them."""
        return self.about.get(name) or known(name)


def is_number(value: Value) -> bool:
    """Return whether a value is a number, which truth is not."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def finite(value: Value) -> float | None:
    """Return a value as a number, None if it is none or not finite."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) else None


def typed(text: str) -> Value:
    """Return what a field of a CSV file says: a number, truth, text, or nothing."""
    if not text:
        return None
    if text in TRUTH:
        return TRUTH[text]
    if "_" in text or (text[-1].isalpha() and text.lstrip("+-") not in ("inf", "nan")):
        return text  # Python's 1_000 is a name here
    try:
        return int(text) if text.lstrip("+-").isdigit() and len(text) < 16 else float(text)
    except ValueError:
        return text


def read_csv(path: Path) -> Frame:
    """Return a CSV file's table.

    Raises:
        RunError: it cannot be read, or a line is not what its header promises.
    """
    reader = csv.reader(io.StringIO(text_of(path, CSV_MOST, "table"), newline=""), strict=True)
    rows: list[list[Value]] = []
    total = 0
    try:
        header = next(reader, [])
        _check_header(path, header)
        for fields in reader:
            if len(fields) != len(header):
                raise RunError(
                    f"{path}, line {reader.line_num}: {len(fields)} fields where the header has "
                    f"{len(header)}; the table is damaged"
                )
            total += 1
            if total <= ROWS_READ:
                rows.append([typed(each) for each in fields])
    except csv.Error as error:
        raise RunError(f"{path}, line {reader.line_num}: no CSV: {error}") from None
    return Frame(path.name, header, rows, total)


def _check_header(path: Path, header: Sequence[str]) -> None:
    if not header:
        raise RunError(f"{path}, line 1: the table has no header; it is damaged")
    if len(header) > COLUMNS_MOST:
        raise RunError(f"{path}: {len(header)} columns, more than the {COLUMNS_MOST} that are read")
    twice = sorted({name for name in header if header.count(name) > 1})
    if twice:
        raise RunError(f"{path}, line 1: two columns are called {twice[0]!r}; it is damaged")


def parquet(path: Path) -> pq.ParquetFile:
    """Return a Parquet file, its bytes in memory.

    Raises:
        RunError: it cannot be read, or is none.
    """
    content = opened(path, PARQUET_MOST, "table")
    try:
        return pq.ParquetFile(pa.BufferReader(content))
    except (pa.ArrowException, OSError) as error:
        raise RunError(f"{path}: no Parquet file: {error}") from None


def first_rows(path: Path, most: int) -> Frame:
    """Return the first rows of a Parquet file, with the units and meanings that it has.

    Raises:
        RunError: as `parquet`.
    """
    file = parquet(path)
    try:
        batch = next(file.iter_batches(batch_size=most), None)
        columns: dict[str, list[Any]] = {} if batch is None else batch.to_pydict()
    except (pa.ArrowException, OSError, ValueError) as error:
        raise RunError(f"{path}: damaged: {error}") from None
    about = {}
    for item in file.schema_arrow:
        words = {key.decode(): text.decode() for key, text in (item.metadata or {}).items()}
        about[item.name] = Known(words.get("unit", ""), words.get("meaning", ""))
    rows = [list(each) for each in zip(*columns.values(), strict=True)][:most]
    return Frame(path.name, list(columns), rows, file.metadata.num_rows, about)
