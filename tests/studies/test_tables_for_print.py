"""Tables in LaTeX and markdown: balanced, as many cells in every line, no name an order."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from studies.core.printed.latex import LONG, escaped, number, strange, tabular, unit
from studies.core.table import Column, Table, write_files

HOSTILE = "%_&#$~^\\{}|[red]\\input{/etc/passwd}\n\\end{tabular}\x1b[31m <b>"
COLUMNS = (
    Column("name"),
    Column("length", "length_1 & so on", unit="mm", form=".1f", scale=1e3),
    Column("index", unit="m2 s", form=".2g"),
)


@dataclass(frozen=True)
class Row:
    name: str
    plant: str
    length: float | None
    index: float = 2e-4


def rows(count: int = 2, name: str = HOSTILE) -> list[Row]:
    return [Row(f"{name}{i // 2}", ("a", "b")[i % 2], 1e-3 * i) for i in range(2 * count)]


def table(count: int = 2, title: str = HOSTILE, section: bool = False) -> Table:
    how = {"section": (Column("plant"),)} if section else {"line": ("name",)}
    return Table(rows(count), COLUMNS, title, "note: 50 %", file="rows.csv", **how)  # type: ignore[arg-type]


def body(text: str) -> list[str]:
    """Return the lines of cells."""
    return [line for line in text.splitlines() if line.endswith(r"\\") and "caption" not in line]


def cells(line: str) -> int:
    return len(re.findall(r"(?<!\\)&", line)) + 1


@pytest.mark.parametrize("count", [1, LONG + 1])
@pytest.mark.parametrize("section", [False, True])
def test_latex_is_balanced_and_has_as_many_cells_in_every_line(count: int, section: bool) -> None:
    text = table(count, section=section).latex()
    open_now = []
    for order, name in re.findall(r"(?<!\\)\\(begin|end)\{(\w+\*?)\}", text):
        if order == "begin":
            open_now.append(name)
        else:
            assert open_now.pop() == name
    assert open_now == []
    assert ("longtable" in text) == (count > LONG or (section and 4 * count > LONG))
    lines = body(text)
    assert len(lines) >= count + 1 and {cells(line) for line in lines} == {len(COLUMNS)}
    for rule in ("toprule", "midrule", "bottomrule"):
        assert text.count(f"\\{rule}") == 1
    depth = 0
    for brace in re.findall(r"(?<!\\)[{}]", text):
        depth += 1 if brace == "{" else -1
        assert depth >= 0
    assert depth == 0
    assert len(re.findall(r"(?<!\\)\$", text)) % 2 == 0


def test_names_from_outside_are_no_orders() -> None:
    text = table().latex()
    assert r"\input" not in text and text.count(r"\end{tabular}") == 1 and "\x1b" not in text
    assert escaped("%_&#${}") == r"\%\_\&\#\$\{\}"
    assert escaped("~^\\") == r"\textasciitilde{}\textasciicircum{}\textbackslash{}"
    assert escaped("a\n b") == "a b"
    assert escaped("%") != "%"


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ("m2 s", r"$\mathrm{m}^{2}\,\mathrm{s}$"),
        ("1/s", r"$1/\mathrm{s}$"),
        ("us/ms", r"$\mathrm{us}/\mathrm{ms}$"),
        ("%", r"$\mathrm{\%}$"),
        ("N m ms^nu/rad", r"N m ms\textasciicircum{}nu/rad"),
        ("per run_1", r"per run\_1"),
        ("", ""),
    ],
)
def test_units_stand_upright(given: str, wanted: str) -> None:
    assert unit(given) == wanted


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ("-5.9e-07", r"$-5.9\cdot10^{-7}$"),
        ("1.02 [0.98, 1.03]", "1.02 [0.98, 1.03]"),
        ("-0.3|+0.2", r"$-0.3$\textbar{}+0.2"),
        ("2e+05 | -", r"$2\cdot10^{5}$ \textbar{} -"),
        ("seeds 3-5 of x-2", "seeds 3-5 of x-2"),
        ("inf", "inf"),
    ],
)
def test_numbers_have_a_minus_and_powers_of_ten(given: str, wanted: str) -> None:
    assert number(given) == wanted


def test_what_pdflatex_cannot_set_is_said() -> None:
    assert escaped('"a" ≤ Ωβ') == r"\char34{}a\char34{} $\leq$ $\Omega$$\beta$"
    assert escaped("λμν") == r"$\lambda$\textmu{}$\nu$"
    assert strange("Grünwald … “Letnikov” ø") == "" and strange("中 Ж中") == "Ж中"
    head = [("name", "")]
    assert "XeLaTeX" in tabular(head, [False], [["中"]]).splitlines()[0]
    assert "XeLaTeX" not in tabular(head, [False], [["θ é"]])


def test_a_name_is_no_argument_of_the_line_before() -> None:
    """Of `\\midrule`, or of the end of a line, which take one in brackets."""
    lines = tabular([("name", "")], [False], [["[3em] x"], ["[red]"], ["*"]]).splitlines()
    assert r"{}[3em] x \\" in lines and r"{}[red] \\" in lines and r"{}* \\" in lines


def test_markdown_has_the_same_cells_and_no_markup() -> None:
    lines = table().markdown().splitlines()
    grid = [line for line in lines if line.startswith("| ")]
    assert {len(re.findall(r"(?<!\\)\|", line)) for line in grid} == {len(COLUMNS) + 1}
    assert r"\<b\>" in lines[0] and r"\[red\]" in grid[2] and r"\$" in grid[2]
    assert grid[0].split(" | ")[1] == r"length\_1 \& so on \[mm\]"


def test_beside_a_csv_file_lie_both(tmp_path: Path) -> None:
    """What nothing shows has a column for every item; several of one file follow each other."""
    shown = Table(rows(), COLUMNS, "Shown", prints="other.csv", line=("name",))
    write_files(tmp_path, [table(), Table(rows(1), file="other.csv"), shown, shown])
    write_files(tmp_path, [Table(rows(1), file="plain.csv"), Table([], file="none.csv")])
    names = {f"{name}.{end}" for name in ("rows", "other", "plain") for end in ("csv", "md", "tex")}
    assert {path.name for path in tmp_path.iterdir()} == names
    with (tmp_path / "rows.csv").open(newline="") as file:
        assert next(csv.DictReader(file))["name"] == f"{HOSTILE}0"
    assert (tmp_path / "other.md").read_text().count("Shown") == 2
    head = (tmp_path / "plain.md").read_text().splitlines()[0]
    assert head == "| name | plant | length | index |"
    assert cells(body((tmp_path / "plain.tex").read_text())[0]) == 4


def test_what_is_wider_than_a_page_is_several_tables() -> None:
    headings = [("case", ""), *((f"quantity_{i}", "mm") for i in range(30))]
    lines = [["line", *(f"{i}.5" for i in range(30))], [], ["circle", *("1.25",) * 30]]
    text = tabular(headings, [False] + [True] * 30, lines, "Rows")
    parts = text.split("% needs the packages")[1:]
    assert len(parts) > 3 and f"Rows (part 1 of {len(parts)})." in parts[0]
    for part in parts:
        first, *others = [each.split(" & ") for each in body(part)]
        assert first[0] == "case" and all(len(each) == len(first) for each in others)
        assert [each[0] for each in others] == ["line", "circle"]
        widest = max(len(name.replace("$", "")) for name in first[1:])
        assert widest * len(first) < 3 * 110
    found = [name for part in parts for name in body(part)[0].rstrip("\\ ").split(" & ")[1:]]
    assert [name.split(" [")[0] for name in found] == [f"quantity\\_{i}" for i in range(30)]
    assert tabular(headings[:4], [True] * 4, [["1"] * 4], "Rows").count("needs the packages") == 1
