"""The laboratory study in words and tables.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from studies.core.evidence.digits import with_interval
from studies.core.table import Column, Table
from studies.laboratory.rows import (
    BaseRow,
    Ground,
    LaboratoryResult,
    ReachRow,
    ScoreRow,
    of_ground,
    paper_cases,
)
from studies.laboratory.scored import NONE
from studies.laboratory.showing.answering import DIVERGES, answer, likely, strongest, two_digits
from studies.laboratory.showing.figures import figures_of
from studies.laboratory.showing.more_tables import (
    case_columns,
    cause_table,
    growth_table,
    index_table,
    title,
)
from studies.laboratory.suspects import SUSPECTS

__all__ = ["answer", "facts", "figures", "tables", "verdict"]
MM = 1e3
SHOWN = 8  # of the table of hypotheses
NOTHING = 1.2  # a suspect that reaches no factor and exceeds this nowhere is left out
CASES = tuple(each.name for each in paper_cases())


@dataclass(frozen=True)
class ReachLine:
    """What a suspect alone does in all cases: a cell for each."""

    controllers: str
    plant: str
    suspect: str
    cells: Sequence[ReachRow]


def _two(number: float | None) -> str:
    return "?" if number is None else f"{number:.2g}"


def cell(row: ReachRow) -> str:
    """Return in words where a suspect reaches the factor: at a size, or how far it gets."""
    found, scale = row.found, SUSPECTS[row.suspect.split()[0]].scale
    lost = found.diverges
    if found.size is not None:
        low, high = (None if x is None else scale * x for x in (found.low, found.high))
        sized = SUSPECTS[row.suspect.split()[0]].sized
        if not sized:
            return "yes"
        ends = "" if low is None and high is None else f" [{_two(low)},{_two(high)}]"
        return f"{_two(scale * found.size)}{ends}"
    if found.most is None:
        return "diverges"
    until = "" if lost is None else f", {DIVERGES}{_two(scale * lost)}"
    if not SUSPECTS[row.suspect.split()[0]].sized and found.most_low is not None:
        until = f" [{_two(found.most_low)},{_two(found.most_high)}]"
    return f"x{_two(found.most)}{until}"


def _lines(result: LaboratoryResult) -> list[ReachLine]:
    """Return what suspects alone do, on every ground."""
    lines = []
    for ground in result.grounds:
        rows = of_ground(result.reach, ground)
        for name in dict.fromkeys(row.suspect for row in rows):
            mine = [row for row in rows if row.suspect == name]
            lines.append(ReachLine(ground.controllers, ground.plant, name, mine))
    return lines


def _does_something(line: ReachLine) -> bool:
    """Return whether a suspect reaches a factor, exceeds NOTHING or diverges in some case."""
    found = [row.found for row in line.cells]
    moved = any(each.size is not None or each.diverges is not None for each in found)
    return moved or any((each.most or 0.0) > NOTHING for each in found)


def _reach_table(result: LaboratoryResult) -> Table:
    factors = ", ".join(f"{each.factor:.1f}" for each in paper_cases())
    first = result.grounds[0].plant
    every = [line for line in _lines(result) if line.plant == first]
    lines = [line for line in every if _does_something(line)] or every
    return Table(
        lines,
        (Column("suspect", form=title), *case_columns(cell)),
        f"Alone: the size from which on the envelope is {factors} times as wide, {first}",
        f"x1.2: no more than that; {DIVERGES}5: half of the runs diverge from there on; yes: of "
        f"what has no size; what exceeds {NOTHING:g} nowhere is left out. 95 % intervals by a "
        "bootstrap of the runs.",
        section=(Column("controllers"), *(Column("controllers", form=lambda _: ""),) * 4),
        tight=True,
        prints="reach.csv",
    )


def _envelope(row: BaseRow) -> str:
    return with_interval(row.envelope, row.envelope_low, row.envelope_high, scale=MM)


def _factor(row: BaseRow) -> str:
    return f"{row.factor:.1f} [{row.factor_low:.1f}, {row.factor_high:.1f}]"


def _effort(name: str) -> Callable[[BaseRow], str]:
    return lambda row: f"{getattr(row, name + '_1'):.4g}, {getattr(row, name + '_2'):.4g}"


BASE_COLUMNS = (
    Column("case", "", once=True),
    Column("factor", "paper's factor", form=_factor, once=True),
    Column("envelope", "envelope [mm]", form=_envelope),
)
EFFORT_COLUMNS = (
    Column("case", "", once=True),
    Column("rms", "rms [N m]", form=_effort("rms"), once=True),
    Column("variation", "total variation [N m]", form=_effort("variation"), once=True),
)


def _base_table(result: LaboratoryResult, columns: tuple[Column, ...], title: str) -> Table:
    """Return a table of the cases without suspects."""
    plants = " | ".join(each for each in dict.fromkeys(row.plant for row in result.base))
    blank = (Column("controllers", form=lambda _: ""),) * (len(columns) - 1)
    return Table(
        result.base,
        columns,
        f"{title} ({plants})",
        line=("controllers", "case"),
        section=(Column("controllers"), *blank),
        tight=True,
        prints="base.csv",
    )


def _probability(row: ScoreRow) -> str:
    ends = (row.probability_low, row.probability_high)
    return with_interval(row.probability, *ends, scale=100.0, most=1)


def _recovered(row: ScoreRow) -> str:
    return "-" if row.recovered is None else f"{100 * row.recovered:.0f}"


def _predicted(row: ScoreRow) -> str:
    return "diverges" if row.fit is None else " ".join(f"{x:.1f}" for x in row.fit.factors)


def _p_value(row: ScoreRow) -> str:
    return "-" if row.fit is None else f"{row.fit.p_value:.2f}"


SCORE_COLUMNS = (
    Column("hypothesis"),
    Column("probability", "%", form=_probability),
    Column("bayes", "Bayes", form=lambda row: two_digits(row.bayes)),
    Column("recovered", "own %", form=_recovered),
    Column("predicted", "predicts", form=_predicted),
    Column("p_value", "p", form=_p_value),
)


def _score_rows(result: LaboratoryResult) -> Iterator[ScoreRow]:
    """Give the likeliest hypotheses of every ground, and none."""
    for ground in result.grounds:
        rows = likely(result, ground)
        yield from rows[:SHOWN]
        yield from (row for row in rows[SHOWN:] if row.hypothesis == NONE)


def _score_table(result: LaboratoryResult) -> Table:
    factors = ", ".join(f"{each.factor:.2g}" for each in paper_cases())
    count = len({row.hypothesis for row in result.scores})
    return Table(
        list(_score_rows(result)),
        SCORE_COLUMNS,
        f"Hypotheses, {count} of them equally likely before: the likeliest after, and none",
        f"%: probability given the factors {factors}; Bayes: how much likelier they are than under "
        "none; own: data of its own that are thought so; predicts: factors of its likeliest sizes; "
        "p: posterior predictive.",
        section=(
            Column("controllers", form=lambda row: f"{row.controllers}, {row.plant}"),
            *(Column("controllers", form=lambda _: ""),) * 5,
        ),
        tight=True,
        prints="hypotheses.csv",
    )


def tables(result: LaboratoryResult) -> list[Table]:
    """Return the bench, suspects alone, hypotheses, causes, indices, growth; and all for files."""
    return [
        Table(result.base, key="base", file="base.csv"),
        _base_table(result, BASE_COLUMNS, "Without suspects, by plant: medians"),
        _base_table(result, EFFORT_COLUMNS, "Torques as commanded, of joint 1, joint 2"),
        Table(result.reach, key="reach", file="reach.csv"),
        _reach_table(result),
        Table(result.scores, key="hypotheses", file="hypotheses.csv"),
        _score_table(result),
        Table(result.causes, key="causes", file="causes.csv"),
        cause_table(result),
        Table(result.indices, key="sobol", file="sobol.csv"),
        index_table(result),
        Table(result.growth, key="growth", file="growth.csv"),
        growth_table(result),
        Table(result.alone, file="alone.csv"),
        Table(result.confusion, file="confusion.csv"),
        Table(result.checks, key="checks", file="checks.csv"),
        Table(result.suspects, key="suspects", file="suspects.csv"),
    ]


def verdict(result: LaboratoryResult) -> str:
    """Return the answer, with what was checked on MuJoCo."""
    return answer(result) + _checked(result)


def _checked(result: LaboratoryResult) -> str:
    if not result.checks:
        return ""
    inside = sum(bool(row.check.check_inside) for row in result.checks)
    runs = sum(row.check.check_runs for row in result.checks)
    return (
        f" MuJoCo's own chain, {runs} runs: in {inside} of {len(result.checks)} places they belong "
        "among those in closed form."
    )


def facts(result: LaboratoryResult) -> dict[str, Any]:
    """Return the paper's factors, and the strongest suspects and likeliest hypotheses by ground."""
    return {
        "factors": {each.name: [each.factor, *each.ends] for each in paper_cases()},
        "grounds": [_facts(result, ground) for ground in result.grounds],
    }


def _facts(result: LaboratoryResult, ground: Ground) -> dict[str, Any]:
    best = likely(result, ground)[0]
    return {
        "plant": ground.plant,
        "controllers": ground.controllers,
        "likeliest": best.hypothesis,
        "probability": best.probability,
        "reach_all": strongest(result, ground),
        "scatter": [float(x) for x in np.round(ground.scatter, 3)],
    }


def figures(result: LaboratoryResult) -> Iterator[tuple[str, Figure]]:
    """Give factors over sizes, probabilities of hypotheses, and Sobol' indices."""
    yield from figures_of(result)
