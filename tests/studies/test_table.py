"""The one table: every number in its place, plants paired by name, files that read back."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from studies.core.table import Column, Table

WIDTH = 60  # columns of a terminal


@dataclass(frozen=True)
class Part:
    length: float | None


@dataclass(frozen=True, eq=False)
class Row:
    case: str
    plant: str
    part: Part
    gains: Mapping[str, float]
    modes: np.ndarray
    note: str | None = None

    @property
    def words(self) -> str:
        return f"{self.case} on {self.plant}"


def row(case: str, plant: str, length: float | None, modes: int = 2) -> Row:
    gains = {"k1": 0.1 + 0.2, "k2": 1e-300}
    return Row(case, plant, Part(length), gains, np.arange(1.0, modes + 1))


ROWS = [
    row("line", "modes", 0.0123),
    row("line", "chain", 0.5),
    row("circle", "chain", None),
    row("circle", "modes", 0.002),
]
LENGTH = Column("length", unit="mm", form=".1f", scale=1e3)


def cells(table: Table) -> list[list[str]]:
    return [table.cells(rows) for rows in table.lines()]


def shown(table: Table) -> str:
    out = io.StringIO()
    Console(file=out, width=WIDTH).print(table.render())
    return out.getvalue()


def test_a_row_is_taken_apart_in_its_order() -> None:
    (first, *_) = Table(ROWS).as_json()
    assert list(first) == ["case", "plant", "length", "k1", "k2", "modes", "note"]
    assert first["modes"].tolist() == [1.0, 2.0] and first["note"] is None


def test_files_read_back_to_the_same_doubles(tmp_path: Path) -> None:
    Table(ROWS).write_csv(tmp_path / "rows.csv")
    with (tmp_path / "rows.csv").open(newline="") as file:
        first, _, third, _ = csv.DictReader(file)
    assert list(first) == ["case", "plant", "length", "k1", "k2", "modes_1", "modes_2", "note"]
    assert (float(first["k1"]), float(first["k2"])) == (0.1 + 0.2, 1e-300)
    assert third["length"] == third["note"] == ""


def test_rows_of_two_kinds_share_a_file(tmp_path: Path) -> None:
    Table([Part(1.0), ROWS[0]]).write_csv(tmp_path / "rows.csv")
    first, second = csv.DictReader((tmp_path / "rows.csv").open(newline=""))
    assert (first["length"], first["case"]) == ("1.0", "")
    assert (second["length"], second["case"]) == ("0.0123", "line")


def test_plants_are_paired_by_name_in_whatever_order_rows_are() -> None:
    table = Table(ROWS, (Column("case"), LENGTH), line=("case",))
    assert cells(table) == [["line", "12.3 | 500.0"], ["circle", "2.0 | -"]]
    assert cells(Table(ROWS[:1], table.columns, line=("case",))) == [["line", "12.3"]]


def test_a_plant_that_is_missing_leaves_its_place() -> None:
    table = Table([*ROWS[:2], ROWS[3]], (Column("case"), LENGTH), line=("case",))
    assert cells(table)[1] == ["circle", "2.0 | -"]
    only = Table(ROWS[:3], (Column("case"), LENGTH), line=("case",), tight=True)
    assert cells(only)[1] == ["circle", "-|-"]


def test_two_rows_of_one_plant_in_a_cell_are_a_mistake() -> None:
    table = Table([ROWS[0], ROWS[0]], (LENGTH,), line=("case",))
    with pytest.raises(ValueError, match="length: several rows of one plant"):
        cells(table)


def test_columns_choose_rows_by_their_items() -> None:
    columns = [
        Column("length", shape, form="g", where={"case": shape}) for shape in ("circle", "line")
    ]
    (line,) = cells(Table(ROWS, (Column("k1", form="g", once=True), *columns), line=("k1",)))
    assert line == ["0.3", "0.002 | -", "0.0123 | 0.5"]


def test_cells_of_all_kinds() -> None:
    columns = (
        Column("words"),
        Column("modes", form=".0f", index=1),
        Column("note", missing="none"),
        Column("any", form=lambda each: each.case.upper()),
        Column("k2", form=".0e"),
    )
    assert cells(Table(ROWS[:1], columns)) == [["line on modes", "2", "none", "LINE", "1e-300"]]
    assert Column("length", form="g").text(Part(float("inf"))) == "-"
    assert [each.title for each in columns[:2]] == ["words", "modes"]


def test_the_terminal_shows_headings_units_sections_and_no_markup() -> None:
    table = Table(
        [row("[red]line", "modes", 0.001), row("x", "modes", 0.002)],
        (Column("plant"), LENGTH),
        "Title [b]",
        "note",
        section=(Column("case"),),
    )
    lines = [line.strip() for line in shown(table).splitlines()]
    assert lines[0] == "Title [b]" and lines[-1] == "note"
    assert lines[2].split() == ["plant", "length"] and lines[3].split() == ["mm"]
    assert [line.split() for line in lines[5:10]] == [
        *(["[red]line"], ["modes", "1.0"], [], ["x"], ["modes", "2.0"]),
    ]


def test_nothing_is_cut_off_on_a_narrow_terminal() -> None:
    text = "".join(shown(Table([row("x" * 2 * WIDTH, "modes", 1.0)], (Column("case"),))).split())
    assert text.count("x") == 2 * WIDTH


def test_markdown_escapes_what_would_be_a_cell() -> None:
    table = Table(ROWS, (Column("case"), LENGTH), "Lengths", line=("case",))
    assert table.markdown() == (
        "Lengths\n\n"
        "| case | length \\[mm\\] |\n| --- | ---: |\n"
        "| line | 12.3 \\| 500.0 |\n| circle | 2.0 \\| - |\n"
    )


def test_declared_lines_say_what_sections_say_once() -> None:
    section = (Column("case"), Column("words", form=lambda _: ""), Column("k1", form=".1f"))
    columns = (Column("plant"), LENGTH, Column("note", form=lambda _: ""))
    table = Table(ROWS[:2], columns, "Title", " note\n", file="rows.csv", section=section)
    found = table.declared()
    assert (found["title"], found["note"], found["file"]) == ("Title", "note", "rows.csv")
    assert [each["heading"] for each in found["columns"]] == ["case", "plant", "length", "note"]
    assert [each["number"] for each in found["columns"]] == [False, False, True, True]
    assert found["columns"][2]["unit"] == "mm"
    assert found["lines"] == [["line", "modes", "12.3", "0.3"], ["line", "chain", "500.0", "0.3"]]
