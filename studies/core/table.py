"""One table for every study: typed rows, declared columns; CSV, JSON, terminal, markdown, LaTeX.

    >>> columns = (Column("trajectory"), Column("envelope", unit="mm", scale=1e3, form=".1f"))
    >>> table = Table(rows, columns, line=("trajectory",))   # both plants on a line, by name
    >>> table.write_csv(folder / "results.csv"); console.print(table.render())
    >>> write_files(folder, [table])              # CSV, markdown and LaTeX

A row is a frozen dataclass in SI units. In files an item that is a mapping or itself a dataclass
is taken apart into its own items, and in CSV an array into one column per number.
"""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from rich import box
from rich.console import Group, RenderableType
from rich.table import Table as Grid
from rich.text import Text

from flexsim.files.atomic import write_text
from studies.core.printed.latex import tabular
from studies.core.text import markdown_text

ACROSS = "plant"  # what rows on one line differ in
BESIDE = " | "  # between the plants of a cell


def items(row: Any) -> dict[str, Any]:
    """Return a row's items by name, those of nested rows and mappings in their place."""
    found: dict[str, Any] = {}
    for item in dataclasses.fields(row):
        content = getattr(row, item.name)
        if isinstance(content, Mapping):
            found.update(content)
        elif dataclasses.is_dataclass(content):
            found.update(items(content))
        else:
            found[item.name] = content
    return found


def value(row: Any, key: str) -> Any:
    """Return an item or a property of a row."""
    return getattr(row, key) if hasattr(row, key) else items(row)[key]


def _flat(row: Any) -> dict[str, Any]:
    """Return a row's items with arrays spread, 'x_1', 'x_2'."""
    found: dict[str, Any] = {}
    for key, content in items(row).items():
        if isinstance(content, np.ndarray):
            found |= {f"{key}_{i}": each for i, each in enumerate(content.tolist(), 1)}
        else:
            found[key] = content
    return found


@dataclass(frozen=True)
class Column:
    """How an item of the rows is shown.

    Attributes:
        key: of an item or a property.
        heading: the key in words unless given. unit: below it.
        form: format specification of a number, text without one; or a function of the row.
        scale: from SI to the unit. index: of an array's number.
        where: of the rows on a line only those with these items count.
        once: the rows on a line have it in common.
        missing: what stands for None and for what is not finite.
    """

    key: str
    heading: str | None = None
    unit: str = ""
    form: str | Callable[[Any], str] = ""
    scale: float = 1
    index: int | None = None
    where: Mapping[str, Any] = field(default_factory=dict)
    once: bool = False
    missing: str = "-"

    @property
    def title(self) -> str:
        """The heading."""
        return self.key.replace("_", " ") if self.heading is None else self.heading

    def text(self, row: Any) -> str:
        """Return a row's cell."""
        if callable(self.form):
            return self.form(row)
        content = value(row, self.key)
        if self.index is not None:
            content = content[self.index]
        if content is None or (self.form and not math.isfinite(content)):
            return self.missing
        return format(self.scale * content, self.form) if self.form else str(content)

    def counts(self, row: Any) -> bool:
        """Return whether the column shows this row."""
        return all(value(row, key) == wanted for key, wanted in self.where.items())


@dataclass(frozen=True, eq=False)
class Table:
    """Rows and how they are shown; `key` and `file` say where else they go.

    Attributes:
        rows: dataclasses. columns: none if it is not for reading.
        title, note: lines above and below.
        key: in the JSON object. file: name of the CSV file.
        prints: CSV file beside which it is written in markdown and LaTeX; its own unless given.
        line: items in common to the rows on one line; without, each row has its own.
        across: what those rows differ in; every cell names all of them in the same order.
        section: columns in common to several lines, written once above them.
        tight: one blank between columns, not three, none between plants, no edge.
    """

    rows: Sequence[Any]
    columns: Sequence[Column] = ()
    title: str = ""
    note: str = ""
    key: str = ""
    file: str = ""
    line: tuple[str, ...] = ()
    across: str = ACROSS
    section: tuple[Column, ...] = ()
    tight: bool = False
    prints: str = ""

    def as_json(self) -> list[dict[str, Any]]:
        """Return the rows' items, in SI units."""
        return [items(row) for row in self.rows]

    def write_csv(self, path: Path) -> None:
        """Write the rows' items, in SI units; None and what a row does not have are empty."""
        rows = [_flat(row) for row in self.rows]
        text = io.StringIO()
        names = list(dict.fromkeys(key for row in rows for key in row))
        writer = csv.DictWriter(text, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        write_text(path, text.getvalue(), "the table")

    def lines(self) -> Iterator[list[Any]]:
        """Give the rows of each line."""
        groups: dict[Any, list[Any]] = {}
        for i, row in enumerate(self.rows):
            names = tuple(value(row, key) for key in self.line) or i
            groups.setdefault(names, []).append(row)
        yield from groups.values()

    def cells(self, rows: Sequence[Any]) -> list[str]:
        """Return the cells of a line."""
        sides = dict.fromkeys(value(row, self.across) for row in self.rows) if self.line else {}
        return [self._cell(column, rows, tuple(sides)) for column in self.columns]

    def _cell(self, column: Column, rows: Sequence[Any], sides: tuple[Any, ...]) -> str:
        """Return a column's text of the rows on a line, side by side in the order of `sides`."""
        mine = [row for row in rows if column.counts(row)]
        if not self.line or column.once or column.key in self.line:
            return column.text(mine[0]) if mine else column.missing
        by_side = {value(row, self.across): column.text(row) for row in mine}
        if len(by_side) < len(mine):
            raise ValueError(f"{column.key}: several rows of one {self.across} on a line")
        return (BESIDE.strip() if self.tight else BESIDE).join(
            by_side.get(side, column.missing) for side in sides
        )

    def headings(self) -> list[str]:
        """Return the columns' headings, with a second line if any has a unit."""
        units = any(column.unit for column in self.columns)
        return [c.title + (f"\n{c.unit}" if units else "") for c in self.columns]

    def render(self) -> RenderableType:
        """Return the table for the terminal."""
        padding = (0, 0 if self.tight else 1)
        grid = Grid(box=box.SIMPLE_HEAD, pad_edge=False, padding=padding, show_edge=not self.tight)
        for column, heading in zip(self.columns, self.headings(), strict=True):
            side: Literal["left", "right"] = "right" if column.form else "left"
            grid.add_column(Text(heading), justify=side, overflow="fold")
        above: list[str] | None = None
        for rows in self.lines():
            head = [column.text(rows[0]) for column in self.section]
            if head and head != above:
                if above is not None:
                    grid.add_row()
                grid.add_row(*map(Text, head))
                above = head
            grid.add_row(*map(Text, self.cells(rows)))
        title, note = ([Text(words)] if words else [] for words in (self.title, self.note))
        return Group(*title, grid, *note)

    def _written(self) -> Iterator[tuple[bool, list[str]]]:
        """Give the lines of cells, sections as lines of their own, and whether it is one."""
        above: list[str] = []
        for rows in self.lines():
            head = [column.text(rows[0]) for column in self.section]
            if head != above:
                yield True, head + [""] * (len(self.columns) - len(head))
                above = head
            yield False, self.cells(rows)

    def markdown(self) -> str:
        """Return the table in markdown, all text as it is."""
        units = [f" [{column.unit}]" * bool(column.unit) for column in self.columns]
        written = [[c.title + u for c, u in zip(self.columns, units, strict=True)]]
        written += [cells for _, cells in self._written()]
        lines = ["| " + " | ".join(map(markdown_text, each)) + " |" for each in written]
        sides = ["---:" if column.form else "---" for column in self.columns]
        lines.insert(1, "| " + " | ".join(sides) + " |")
        blocks = [markdown_text(self.title), "\n".join(lines), markdown_text(self.note)]
        return "\n\n".join(block for block in blocks if block) + "\n"

    def declared(self) -> dict[str, Any]:
        """Return the table for reading as JSON has it: title, note, file, columns, cells by line.

        What a section says once above several lines, each of them says itself.
        """
        lines: list[list[str]] = []
        for rows in self.lines():
            cells = self.cells(rows)
            head = [column.text(rows[0]) for column in self.section]
            for i, said in enumerate(head[1:], 1):
                if said and not cells[i]:
                    cells[i] = said
            lines.append([*head[:1], *cells])
        shown = (*self.section[:1], *self.columns)
        names = len(self.section[:1])  # what a section is of is no number
        columns = [
            {
                "key": c.key,
                "heading": c.title,
                "unit": c.unit,
                "number": bool(c.form) and i >= names,
            }
            for i, c in enumerate(shown)
        ]
        about = {"title": self.title, "note": self.note.strip(), "file": self.file}
        return {**about, "columns": columns, "lines": lines}

    def latex(self) -> str:
        """Return the table in LaTeX, all text as it is; title and note are its caption."""
        lines: list[list[str]] = []
        for section, cells in self._written():
            lines += [[], cells] if section and lines else [cells]
        headings = [(column.title, column.unit) for column in self.columns]
        right = [bool(column.form) for column in self.columns]
        return tabular(headings, right, lines, self.title, self.note)

    def itemised(self) -> Table:
        """Return the table with a column for every item of its rows, unless it has columns."""
        if self.columns:
            return self
        names = dict.fromkeys(key for row in self.rows for key in _flat(row))
        return replace(self, columns=tuple(map(_item_column, names)))


def _item_column(name: str) -> Column:
    """Return a column that shows an item as it is, numbers in six digits."""

    def shown(row: Any) -> str:
        content = _flat(row).get(name)
        if content is None:
            return "-"
        return f"{content:.6g}" if isinstance(content, float) else str(content)

    return Column(name, form=shown)


def write_files(folder: Path, tables: Sequence[Table]) -> None:
    """Write the tables into a run: each CSV file, and beside it what is read, as `.md` and `.tex`.

    Several tables that are of one CSV file follow each other; one that nothing shows has a column
    for every item, in SI units.

    Raises:
        RunError: a file cannot be written.
    """
    present = [table for table in tables if table.rows]
    shown: dict[str, list[Table]] = {}
    for table in present:
        if table.columns and (table.prints or table.file):
            shown.setdefault(table.prints or table.file, []).append(table)
    for table in present:
        if not table.file:
            continue
        table.write_csv(folder / table.file)
        write_prints(folder / table.file, shown.get(table.file) or [table.itemised()])


def write_prints(path: Path, tables: Sequence[Table]) -> None:
    """Write tables in markdown and in LaTeX beside a CSV file.

    Raises:
        RunError: a file cannot be written.
    """
    text = "\n".join(table.markdown() for table in tables)
    write_text(path.with_suffix(".md"), text, "the table")
    text = "\n".join(table.latex() for table in tables)
    write_text(path.with_suffix(".tex"), text, "the table")
