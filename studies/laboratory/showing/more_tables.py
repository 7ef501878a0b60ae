"""Tables of causes, of Sobol' indices and of where the exact linear loops grow.

>>> [cause_table(result), index_table(result), growth_table(result)]      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flexsim.linear.growth import SLACK
from studies.core.table import Column, Table
from studies.laboratory.causes import FAMILIES, SEVERAL
from studies.laboratory.linear import GrowthRow
from studies.laboratory.rows import (
    CauseRow,
    IndexRow,
    LaboratoryResult,
    ReachRow,
    of_ground,
    paper_cases,
)
from studies.laboratory.scored import NONE
from studies.laboratory.suspects import FRICTION, MEASURED, MODES, OTHERS, SUSPECTS
from studies.laboratory.together import CAP, DIVERGED_MOST, LUCK, LUCKS, TOGETHER

SHORT = {
    **{NONE: NONE, MEASURED: "v", MODES: "modes", FRICTION: "friction"},
    **{OTHERS: "others", SEVERAL: SEVERAL},
}


def title(line: Any) -> str:
    """Return a line's suspect with its unit."""
    suspect = SUSPECTS.get(line.suspect.split()[0])
    return f"{line.suspect} [{suspect.unit}]" if suspect and suspect.unit else str(line.suspect)


def case_columns(form: Callable[[Any], str]) -> list[Column]:
    """Return a column for each case, of lines with as many cells."""

    def at(i: int) -> Callable[[Any], str]:
        return lambda line: form(line.cells[i])

    return [Column("suspect", each.name, form=at(i)) for i, each in enumerate(paper_cases())]


def _section(count: int, plant: bool = True) -> tuple[Column, ...]:
    """Return a section's columns: controllers, and the plant."""

    def name(row: Any) -> str:
        return f"{row.controllers}, {row.plant}" if plant else str(row.controllers)

    return (
        Column("controllers", form=name),
        *(Column("controllers", form=lambda _: ""),) * (count - 1),
    )


@dataclass(frozen=True)
class CauseLine:
    """How likely each cause is on a ground, under one way of scoring."""

    controllers: str
    plant: str
    scored: str
    best: str
    cells: Mapping[str, CauseRow]


def _cause_lines(result: LaboratoryResult) -> Iterator[CauseLine]:
    widest = max((row.decades for row in result.causes), default=0.0)
    for ground in result.grounds:
        rows = of_ground(result.causes, ground)
        for decades, alone in dict.fromkeys((row.decades, row.discrepancy) for row in rows):
            mine = [r for r in rows if (r.decades, r.discrepancy) == (decades, alone)]
            scored = "as stated" if decades == widest else "half as wide"
            if alone is not None:
                scored = f"models off by {alone:.2g}"
            best = f"{mine[0].best} {100 * mine[0].best_probability:.0f}"
            cells = {row.cause: row for row in mine}
            yield CauseLine(ground.controllers, ground.plant, scored, best, cells)


def _cause(name: str) -> Callable[[CauseLine], str]:
    def form(line: CauseLine) -> str:
        row = line.cells.get(name)
        return "-" if row is None else f"{100 * row.probability:.0f}"

    return form


def cause_table(result: LaboratoryResult) -> Table:
    """Return how likely causes are, and what moves that."""
    columns = (
        Column("scored"),
        *(Column("scored", SHORT[name], form=_cause(name)) for name in FAMILIES),
        Column("best", "likeliest hypothesis"),
    )
    return Table(
        list(_cause_lines(result)),
        columns,
        "Causes, equally likely before, and what moves that [%]",
        "v: measured inaccurately; several: hypotheses of more than one cause. As stated: the "
        "discrepancy between arm and models averaged over 5 to 50 % of the factors' logarithms; "
        "else of that size alone, or priors half as wide.",
        section=_section(len(columns)),
        tight=True,
        prints="causes.csv",
    )


@dataclass(frozen=True)
class IndexLine:
    """A suspect's indices of the factor in all cases."""

    controllers: str
    plant: str
    suspect: str
    cells: Sequence[IndexRow]


def index_lines(result: LaboratoryResult) -> list[IndexLine]:
    """Return the suspects whose index is told from nothing in some case, then luck and the rest."""
    lines: list[IndexLine] = []
    for ground in result.grounds:
        rows = [row for row in of_ground(result.indices, ground) if row.found.of == "factor"]
        names = dict.fromkeys(row.found.suspect for row in rows)
        mine = [
            IndexLine(
                ground.controllers,
                ground.plant,
                name,
                [row for row in rows if row.found.suspect == name],
            )
            for name in names
        ]
        own = [each for each in mine if each.suspect not in (LUCK, TOGETHER)]
        own = [each for each in own if any(row.found.told for row in each.cells)]
        own.sort(key=lambda line: -sum(row.found.first or 0.0 for row in line.cells))
        lines += own + [each for each in mine if each.suspect in (LUCK, TOGETHER)]
    return lines


def _index(row: IndexRow) -> str:
    found = row.found
    if not found.told:
        return "-"
    value, low, high = (100 * (x or 0.0) for x in (found.first, found.first_low, found.first_high))
    return f"{value:.0f} [{low:.0f},{high:.0f}]"


def _scales(result: LaboratoryResult) -> str:
    """Return by what the largest sizes were scaled, ground by ground."""
    found = {}
    for row in result.indices:
        if row.found.of == "factor":
            found[f"{row.controllers}, {row.plant}"] = row.found.scale
    return ", ".join(f"{scale:g} ({where})" for where, scale in found.items())


def index_table(result: LaboratoryResult) -> Table:
    """Return the indices that are told from nothing."""
    lost = max((r.found.diverged for r in result.indices if r.found.of == "factor"), default=0.0)
    return Table(
        index_lines(result),
        (Column("suspect"), *case_columns(_index)),
        "Together: Sobol' indices of log factor, what each explains alone [%]",
        f"Largest sizes times {_scales(result)}, so that about {100 * DIVERGED_MOST:.0f} % of runs "
        f"diverge at most, here {100 * lost:.0f} %, which count as a factor of {CAP:g}. {LUCK}: "
        f"what {LUCKS} runs of the same sizes differ by; {TOGETHER}: what none explains alone; -: "
        "not told from 0. 95 % intervals by a jackknife.",
        section=_section(5),
        tight=True,
        prints="sobol.csv",
    )


@dataclass(frozen=True)
class GrowthLine:
    """Where a suspect makes linear loops grow, and half of the runs diverge."""

    controllers: str
    suspect: str
    cells: Sequence[tuple[GrowthRow, ReachRow]]


def _growth_lines(result: LaboratoryResult) -> list[GrowthLine]:
    lines = []
    for controllers in dict.fromkeys(row.controllers for row in result.growth):
        rows = [row for row in result.growth if row.controllers == controllers]
        ground = next(each for each in result.grounds if each.controllers == controllers)
        reach = {(row.suspect, row.case): row for row in of_ground(result.reach, ground)}
        for name in dict.fromkeys(row.suspect for row in rows):
            mine = [row for row in rows if row.suspect == name]
            if any(row.grows is not None for row in mine):
                cells = [(row, reach[row.suspect, row.case]) for row in mine]
                lines.append(GrowthLine(controllers, name, cells))
    return lines


def _growth(cell: tuple[GrowthRow, ReachRow]) -> str:
    row, reach = cell
    suspect = SUSPECTS[row.suspect.split()[0]]
    if row.grows is None:
        grows = "no"
    elif row.grows == 0.0:
        grows = f"all, {row.growth:.0f}/s"
    else:
        grows = f"{suspect.scale * row.grows:.2g}"
    lost = reach.found.diverges
    return f"{grows} | {'-' if lost is None else f'{suspect.scale * lost:.2g}'}"


def growth_table(result: LaboratoryResult) -> Table:
    """Return from which size on the exact linear loops grow, and half of the runs diverge."""
    first = result.grounds[0].plant
    return Table(
        _growth_lines(result),
        (Column("suspect", form=title), *case_columns(_growth)),
        f"Size from which on the exact linear loop grows | half of the runs diverge, {first}",
        f"Grows: by more than {SLACK:g} 1/s at some pose, without friction or with its slope; all: "
        "at every size, at the least by that; no: at none; -: none diverge. Suspects that the "
        "linear loop does not know, or that never make it grow, are left out.",
        section=_section(5, plant=False),
        tight=True,
        prints="growth.csv",
    )
