"""What a study's run shows: a table of its cells, the answer in words, figures.

>>> report.tables(found), report.verdict(found)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from matplotlib.figure import Figure

from studies.core.evidence.check_sample import Check
from studies.core.evidence.digits import percent, with_interval
from studies.core.evidence.intervals import share_interval
from studies.core.figures import (
    COLOURS,
    DASHES,
    MARKERS,
    beside,
    canvas,
    drawn,
    finish,
    interval,
    name_lines,
    raised,
    styles,
    unmathed,
)
from studies.core.table import Column, Table
from studies.core.text import spelled
from studies.run.columns import unit_of
from studies.run.sensitivity import SensitivityRow
from studies.run.summary import PLANTS, CellRow, PairRow
from studies.spec.matrix import Matrix

MM = 1e3
SHOWN = 60  # lines of the table
LONGEST = 60  # characters of a name
LINES_MOST = 60  # of a figure
ROOM = 1.03  # of the largest: its marker has room, however near one another all are


@dataclass(frozen=True)
class CheckRow:
    """MuJoCo's own runs of a cell whose runs are those of the chain in closed form."""

    factors: dict[str, str]
    point: dict[str, float]
    check: Check


@dataclass(frozen=True, eq=False)
class Found:
    """What came of a study.

    Attributes:
        matrix: its runs. rows: cells, then pairs. sensitivity: of numbers with distributions.
        checks: of closed-form chains, if they were asked for. notes: on models beyond themselves.
    """

    matrix: Matrix
    rows: Sequence[CellRow | PairRow]
    sensitivity: Sequence[SensitivityRow] = ()
    checks: Sequence[CheckRow] = field(default_factory=list)
    notes: Sequence[str] = ()

    def cells(self, figure: str) -> list[CellRow]:
        """Return the cells' rows of a figure."""
        return [r for r in self.rows if isinstance(r, CellRow) and r.figure == figure]

    def pairs(self, figure: str, what: str) -> list[PairRow]:
        """Return the rows of a figure of plants against the first, or of controllers."""
        every = (r for r in self.rows if isinstance(r, PairRow))
        return [r for r in every if r.figure == figure and r.what == what]

    @property
    def runs(self) -> int:
        """Number of runs."""
        return sum(row.runs for row in self.cells("envelope"))

    @property
    def diverged(self) -> int:
        """How many of them diverged."""
        return sum(row.diverged for row in self.cells("envelope"))


@dataclass(frozen=True)
class ShownRow:
    """A cell as the terminal shows it."""

    plant: str
    case: str
    envelope: str
    rms_error: str
    ratio: str
    diverged: str


def case_of(matrix: Matrix, factors: dict[str, str], point: dict[str, float]) -> str:
    """Return a cell in words: of what it is of only that of which there are several."""
    several = {
        key: len(matrix.names[{"robot": "robots", "setting": "settings"}.get(key, key)]) > 1
        for key in ("robot", "setting", "hardware")
    }
    words = [factors["trajectory"], f"by {factors['controller']}"]
    words += [factors[key] for key in ("setting", "hardware", "robot") if several[key]]
    words += [f"{path.rpartition('.')[2]} {value:g}" for path, value in point.items()]
    return plainly(", ".join([" ".join(words[:2]), *words[2:]]))


def plainly(name: str) -> str:
    """Return a name as tables and figures have it: no control characters, no endless ones."""
    return spelled(name if len(name) <= LONGEST else f"{name[:LONGEST]}...")


def written(name: str) -> str:
    """Return a name as a figure has it, neither endless nor mathematics."""
    return unmathed(plainly(name))


def shown_rows(found: Found) -> list[ShownRow]:
    """Return the cells as the terminal shows them."""
    ratios = {
        (tuple(row.factors.values()), tuple(row.point.values())): row
        for row in found.pairs("envelope", PLANTS)
    }
    rms = found.cells("rms_error")
    shown = []
    for row, other in zip(found.cells("envelope"), rms, strict=True):
        pair = ratios.get((tuple(row.factors.values()), tuple(row.point.values())))
        share = (row.diverged_share, row.diverged_share_low, row.diverged_share_high)
        shown.append(
            ShownRow(
                plant=plainly(row.factors["plant"]),
                case=case_of(found.matrix, row.factors, row.point),
                envelope=with_interval(row.median, row.low, row.high, MM),
                rms_error=with_interval(other.median, other.low, other.high, MM),
                ratio=with_interval(pair.ratio, pair.ratio_low, pair.ratio_high) if pair else "",
                diverged=percent(*share) if row.diverged else "0",
            )
        )
    return shown


COLUMNS = (
    Column("plant", "case, and models"),
    Column("envelope", unit="mm", form=lambda row: row.envelope),
    Column("rms_error", "rms error", "mm", form=lambda row: row.rms_error),
    Column("ratio", "ratio to\nthe first", form=lambda row: row.ratio),
    Column("diverged", form=lambda row: row.diverged),
)


def tables(found: Found) -> list[Table]:
    """Return the tables of a study: cells for reading, everything for files."""
    rows = sorted(shown_rows(found), key=_order(found))  # the plants of a case together
    more = f"and {len(rows) - SHOWN} lines more in summary.csv" if len(rows) > SHOWN else ""
    runs = f"{found.rows[0].runs} run{'s' * (found.rows[0].runs > 1)}"
    title = f"Medians over {runs}, 95 % intervals"
    section = (Column("case"),)
    return [
        Table(rows[:SHOWN], COLUMNS, title, more, section=section, tight=True),
        Table(found.rows, file="summary.csv"),
        Table(found.sensitivity, file="sensitivity.csv"),
        Table(found.checks, file="check.csv"),
    ]


def whole(found: Found) -> Table:
    """Return the cells' table with every line, as it lies beside summary.csv."""
    rows = sorted(shown_rows(found), key=_order(found))
    return replace(tables(found)[0], rows=rows, note="", prints="summary.csv")


def _order(found: Found) -> Callable[[ShownRow], int]:
    cases = [case_of(found.matrix, r.factors, r.point) for r in found.cells("envelope")]
    places = {case: place for place, case in enumerate(dict.fromkeys(cases))}
    return lambda row: places[row.case]


def verdict(found: Found) -> str:
    """Return the answer in words."""
    low, high = share_interval(found.diverged, found.runs)
    said = [f"{found.runs:,} runs, {found.diverged:,} diverged"]
    if found.diverged:
        said[0] += f" ({percent(found.diverged / found.runs, low, high)})"
    said[0] += "."
    pairs = [row for row in found.pairs("envelope", PLANTS) if row.ratio is not None]
    for plant in found.matrix.names["plants"][1:]:
        own = [row for row in pairs if row.factors["plant"] == plant]
        if not own:
            continue
        ratios = [row.ratio for row in own if row.ratio is not None]
        sure = [row for row in own if row.ratio_low is not None and row.ratio_high is not None]
        ends = dict.fromkeys((f"{min(ratios):.3g}", f"{max(ratios):.3g}"))
        words = " to ".join(ends)
        if sure:
            inside = sum((row.ratio_low or 0) <= 1 <= (row.ratio_high or 0) for row in sure)
            words += f"; 1 lies in the interval in {inside} of {len(sure)}"
        names = plainly(plant), plainly(own[0].against)
        said.append(f"Envelopes of {names[0]} over those of {names[1]}: {words}.")
    for row in _strongest(found):
        if row.value is not None:
            value = with_interval(row.value, row.low, row.high)
            said.append(f"{row.figure} and {row.number}: {row.measure} {value}.")
    outside = [row for row in found.checks if row.check.check_inside is False]
    if found.checks:
        count = len(found.checks)
        said.append(
            f"MuJoCo's own runs belong among those in closed form in {count - len(outside)} of "
            f"{count} cases."
        )
    return "\n".join([*said, *(f"Note: {spelled(note)}" for note in found.notes)])


def _strongest(found: Found) -> list[SensitivityRow]:
    """Return the number that matters most to the envelope, of the first cell."""
    first = found.sensitivity[0] if found.sensitivity else None
    own = [
        row
        for row in found.sensitivity
        if first and (row.factors, row.point) == (first.factors, first.point)
        if row.figure == "envelope" and row.value is not None
    ]
    return sorted(own, key=lambda row: -abs(row.value or 0.0))[:1]


def figures(found: Found) -> Iterator[tuple[str, Figure]]:
    """Give the figures with the names of their files."""
    gridded = found.matrix.draws.gridded
    if len(gridded) == 1 and len(found.matrix.draws.grid) > 1:
        yield "envelopes", over_number(found, gridded[0])
    else:
        yield "envelopes", by_case(found)
    if found.sensitivity:
        yield "sensitivity", sensitivity_figure(found)


@drawn
def by_case(found: Found) -> Figure:
    """Return the envelopes of all cells with their intervals, a line each."""
    rows = found.cells("envelope")
    cases = list(dict.fromkeys(case_of(found.matrix, r.factors, r.point) for r in rows))
    kept = cases[:LINES_MOST]
    plants = found.matrix.names["plants"]
    figure, panels = canvas(height=24 + (2 + 3 * len(plants)) * len(kept))
    (axes,) = panels[0]
    for number, (plant, look) in enumerate(styles(plants).items()):
        shift = 0.6 * ((number + 0.5) / len(plants) - 0.5)
        colour, marker = look["color"], MARKERS[number % len(MARKERS)]
        axes.plot([], [], marker, color=colour, linestyle="none", label=written(plant))
        for row in rows:
            case = case_of(found.matrix, row.factors, row.point)
            if row.factors["plant"] != plant or case not in kept:
                continue
            line = kept.index(case) + shift
            if row.median is None:
                beside(axes, line, f"{written(plant)}: half of the runs diverged", colour)
            else:
                ends = _in_mm(row.low), _in_mm(row.high)
                interval(axes, MM * row.median, line, ends, marker, color=colour)
    name_lines(axes, [written(case) for case in kept])
    axes.set_xlabel("envelope half-width [mm]")
    axes.set_xlim(0, ROOM * axes.get_xlim()[1])
    caption = "Half-width of the envelope: medians with their 95 % intervals."
    if len(cases) > len(kept):
        caption += f" The first {len(kept)} of {len(cases)} cases."
    return finish(figure, [axes], legend=min(len(plants), 4), caption=caption)


def _in_mm(length: float | None) -> float | None:
    return None if length is None else MM * length


@drawn
def over_number(found: Found, path: str) -> Figure:
    """Return envelopes over the one number on the grid, with bands of their intervals."""
    rows = found.cells("envelope")
    plants = found.matrix.names["plants"]
    figure, panels = canvas(height=90)
    (axes,) = panels[0]
    curves: dict[tuple[str, str], list[CellRow]] = {}
    for row in rows:
        case = case_of(found.matrix, row.factors, {})
        curves.setdefault((case, row.factors["plant"]), []).append(row)
    cases = list(dict.fromkeys(case for case, _ in curves))
    for (case, plant), own in curves.items():  # a colour for a case, line and marker for a plant
        known = [row for row in own if row.median is not None]
        x = [row.point[path] for row in known]
        colour = COLOURS[cases.index(case) % len(COLOURS)]
        number = plants.index(plant)
        how: dict[str, Any] = {
            "color": colour,
            "linestyle": DASHES[number % len(DASHES)],
            "marker": MARKERS[number % len(MARKERS)],
        }
        middle = [MM * (row.median or 0.0) for row in known]
        axes.plot(x, middle, **how, label=written(f"{plant}: {case}"))
        low = [MM * (row.low if row.low is not None else row.median or 0.0) for row in known]
        high = [MM * (row.high if row.high is not None else row.median or 0.0) for row in known]
        axes.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0)
    unit = unit_of(path)
    axes.set_xlabel(written(f"{path} [{raised(unit)}]" if unit not in ("", "-") else path))
    axes.set_ylabel("envelope half-width [mm]")
    axes.set_ylim(bottom=0)
    caption = unmathed(
        f"Half-width of the envelope over {plainly(path)}: medians, and bands of their 95 % "
        "intervals."
    )
    return finish(figure, [axes], legend=min(len(curves), 2), caption=caption)


@drawn
def sensitivity_figure(found: Found) -> Figure:
    """Return how the envelope depends on each varied number, cell by cell."""
    own = [row for row in found.sensitivity if row.figure == "envelope"]
    cases = {_case(found, row): row for row in own}
    kept = list(cases)[: LINES_MOST // max(1, len(found.matrix.draws.sampled))]
    names = [f"{row.number}: {_case(found, row)}" for row in own if _case(found, row) in kept]
    lines = list(dict.fromkeys(names))
    figure, panels = canvas(height=24 + 6 * len(lines))
    (axes,) = panels[0]
    measures = list(dict.fromkeys(row.measure for row in own))
    for number, measure in enumerate(measures):
        colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
        axes.plot([], [], marker, color=colour, linestyle="none", label=measure)
        for row in (r for r in own if r.measure == measure):
            name = f"{row.number}: {_case(found, row)}"
            if name in lines and row.value is not None:
                line = lines.index(name) + 0.3 * (number - (len(measures) - 1) / 2)
                interval(axes, row.value, line, (row.low, row.high), marker, color=colour)
    axes.axvline(0.0, color="0.6", linewidth=0.6)
    name_lines(axes, [written(line) for line in lines])
    axes.set_xlabel(f"{' and '.join(measures)} of the envelope")
    caption = "How the envelope depends on the numbers varied, with 95 % intervals."
    return finish(figure, [axes], legend=len(measures), caption=caption)


def _case(found: Found, row: SensitivityRow) -> str:
    return f"{row.factors['plant']}, {case_of(found.matrix, row.factors, row.point)}"
