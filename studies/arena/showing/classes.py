"""Classes at a glance: what was found of each, and how it did where it was tuned and elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from studies.arena.conditions import CORE, NOMINAL
from studies.arena.contestants import CLASSES
from studies.arena.rows import ArenaResult, BudgetRow, KnobRow, MeasureRow, ScoreRow

HARD = (("hardware", "delay 2"), ("payload", "100 g"), ("friction", "opposing"))
DISTURBED = ("push", "pulse")


@dataclass(frozen=True)
class ClassRow:
    """A class at a glance, as it was tuned and on the bench; scores with their intervals [decades].

    Attributes:
        contestant, structure, order: its name, what it reads, its orders.
        index, effort: medians over seeds of what the searches found [m2 s], [-].
        score, chain: rows on the plant of the tuning and on the first chain; None without.
        delay, payload, friction: rows with two samples of delay, 100 g, friction against the
            motion, on the plant of the tuning.
        borne, levels: under how many levels of what nobody was told none of its runs diverges
            there, and how many there are.
    """

    contestant: str
    structure: str
    order: str
    index: float | None
    effort: float | None
    score: ScoreRow | None
    chain: ScoreRow | None
    delay: ScoreRow | None
    payload: ScoreRow | None
    friction: ScoreRow | None
    borne: int
    levels: int


def class_rows(result: ArenaResult) -> list[ClassRow]:
    """Return the classes, the best score first."""
    by: dict[tuple[str, ...], ScoreRow] = {}
    for row in result.scores:
        own = CLASSES[row.contestant].aid if row.contestant in CLASSES else "plain"
        if row.tuning == CORE and row.reference == own:
            by[row.contestant, row.condition, row.level, row.plant] = row
    first = result.plants[0]
    chain = next((each for each in result.plants if "chain" in each), first)
    rows = []
    for name in dict.fromkeys(row.contestant for row in result.tuned):
        its = [each for each in result.tuned if each.contestant == name and each.tuning == CORE]
        delay, payload, friction = (by.get((name, *each, first)) for each in HARD)
        usual = by.get((name, NOMINAL, NOMINAL, first))
        untold = [
            row
            for (whose, _, level, plant), row in by.items()
            if (whose, plant) == (name, first) and level != NOMINAL
        ]
        rows.append(
            ClassRow(
                name,
                CLASSES[name].structure,
                CLASSES[name].order,
                _median([each.index for each in its]),
                _median([each.effort for each in its]),
                usual,
                by.get((name, NOMINAL, NOMINAL, chain)),
                delay,
                payload,
                friction,
                sum(row.diverged == 0.0 for row in untold),
                len(untold),
            )
        )
    return sorted(rows, key=lambda row: -(row.score.score if row.score else -1.0))


def _median(values: list[float | None]) -> float | None:
    known = [math.inf if each is None else each for each in values]
    middle = float(np.median(known)) if known else math.inf
    return middle if math.isfinite(middle) else None


@dataclass(frozen=True)
class SearchRow:
    """A class's searches: medians over seeds.

    Attributes:
        contestant: the class. grew: share of individuals that were rejected [-]. found: searches
            in which any held. index [m2 s], effort [-]: of what was found.
        best: the least index [m2 s].
        budget: what twice the simulations are worth, None where it was not looked for.
    """

    contestant: str
    grew: float
    found: int
    searches: int
    index: float | None
    best: float | None
    effort: float | None
    budget: BudgetRow | None


def search_rows(result: ArenaResult) -> list[SearchRow]:
    """Return the core's searches, classes in their order."""
    budget = {row.contestant: row for row in result.budget}
    rows = []
    for name in dict.fromkeys(row.contestant for row in result.tuned):
        its = [row for row in result.tuned if row.contestant == name and row.tuning == CORE]
        rows.append(
            SearchRow(
                name,
                float(np.median([row.grew for row in its])),
                sum(row.objective is not None for row in its),
                len(its),
                _median([row.index for row in its]),
                min((row.index for row in its if row.index is not None), default=None),
                _median([row.effort for row in its]),
                budget.get(name),
            )
        )
    return rows


@dataclass(frozen=True)
class DisturbedRow:
    """A class at rest, pushed at the tip or by its motors, on the plant of the tuning."""

    contestant: str
    push: MeasureRow | None
    pulse: MeasureRow | None


def disturbed_rows(result: ArenaResult) -> list[DisturbedRow]:
    """Return how classes bear a push and a pulse, in the order of their scores."""
    first = result.plants[0]
    by = {
        (row.contestant, row.trajectory): row
        for row in result.measures
        if row.plant == first and row.trajectory in DISTURBED and row.level == NOMINAL
    }
    names = [row.contestant for row in class_rows(result)]
    rows = [DisturbedRow(name, *(by.get((name, each)) for each in DISTURBED)) for name in names]
    return [row for row in rows if row.push or row.pulse]


def knob_rows(result: ArenaResult) -> list[KnobRow]:
    """Return the knobs of all classes that were tuned."""
    names = dict.fromkeys(row.contestant for row in result.tuned)
    return [KnobRow(name, *knob) for name in names for knob in CLASSES[name].knobs]
