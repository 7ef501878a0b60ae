"""The sentence that the data support, made from them.

>>> answer(result)      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence

from studies.arena.conditions import CORE, NOMINAL
from studies.arena.contestants import CLASSES
from studies.arena.rows import ArenaResult, ScoreRow, ShareRow
from studies.arena.showing.classes import class_rows, search_rows
from studies.arena.verdicts.judging import FACTORIAL, ISO_DAMPING, PIDS, TUNINGS
from studies.arena.verdicts.measures import ALL

HOW = {"first": "better than", "second": "worse than", "open": "not told from"}
FEWER = {"first": "varies less than", "second": "varies more than", "open": "varies as much as"}


def answer(result: ArenaResult) -> str:
    """Return who wins on the bench, what order and structure are worth, what models say."""
    classes = [row for row in class_rows(result) if row.score is not None]
    if not classes or classes[0].score is None:
        return "Nothing was run as it was tuned."
    best = classes[0].score
    said = [
        f"At equal effort {best.contestant} is best on {best.plant}, {best.score:.2f} "
        f"[{best.low:.2f}, {best.high:.2f}] decades below an arm that stands still."
    ]
    first = result.plants[0]
    most = max(classes, key=lambda row: row.borne)
    if most.levels:
        said.append(
            f"Of {most.levels} levels of what nobody was told {most.contestant} bears {most.borne} "
            f"without a run that diverges, {best.contestant} {classes[0].borne}."
        )
    for row in result.verdicts:
        chance = f"({row.chance:.2f} [{row.low:.2f}, {row.high:.2f}])."
        if row.plant == first and row.factor == "order":
            said.append(f"{row.first} is {HOW[row.verdict]} {row.second} {chance}")
        if row.plant == first and row.factor == ISO_DAMPING and row.verdict != "open":
            how = FEWER[row.verdict]
            said.append(f"The overshoot of {row.first} {how} that of {row.second} {chance}")
    none = [name for name, found in _found(result).items() if not found]
    if none:
        said.append(f"No search found a loop that does not grow of {', '.join(none)}.")
    spilt = sorted({row.contestant for row in result.scores if _spills(row, first)})
    if spilt:
        said.append(
            f"On a finer model or a chain more than half of the runs diverge of {', '.join(spilt)}."
        )
    more = (_least(result), _helped(result), _elsewhere(result))
    return " ".join([*said, *filter(None, more), *_spilling(result), *_shares(result)])


def _least(result: ArenaResult) -> str:
    """Say what the best of all searches of the PIDs found."""
    best = {row.contestant: row.best for row in search_rows(result) if row.best is not None}
    names = [name for pair in FACTORIAL for name in pair if name in best]
    found = [f"{name} {1e4 * best[name]:.3g}" for name in names]
    return f"The best search of each found [1e-4 m2 s]: {', '.join(found)}." if found else ""


def _helped(result: ArenaResult) -> str:
    """Say how many classes a reference helps that they were not tuned with."""
    parts = []
    for reference in ("true-tip", "feedforward"):
        rows = [r for r in result.verdicts if r.first.endswith(f", {reference}")]
        rows = [row for row in rows if row.factor == "reference"]
        if rows:
            better, worse = (sum(r.verdict == how for r in rows) for how in ("first", "second"))
            parts.append(f"{reference} helps {better} of {len(rows)} classes and harms {worse}")
    return f"As a reference {', '.join(parts)}." if parts else ""


def _elsewhere(result: ArenaResult) -> str:
    """Say how many classes do otherwise on another plant, and by how much at most."""
    rows = [row for row in result.verdicts if row.factor == "model"]
    if not rows:
        return ""
    apart = [row for row in rows if row.verdict != "open"]
    most = max(rows, key=lambda row: abs(row.difference))
    return (
        f"Of {len(rows)} pairs of a class on another plant and on that of its tuning {len(apart)} "
        f"are told apart, by {abs(most.difference):.2f} decades at most ({most.first})."
    )


def _found(result: ArenaResult) -> dict[str, int]:
    """Return in how many of the core's searches of each class anything held."""
    found: dict[str, int] = {}
    for row in result.tuned:
        if row.tuning == CORE:
            found[row.contestant] = found.get(row.contestant, 0) + (row.objective is not None)
    return found


def _spills(row: ScoreRow, first: str) -> bool:
    own = CLASSES[row.contestant].aid if row.contestant in CLASSES else "plain"
    usual = row.tuning == CORE and row.condition == NOMINAL and row.reference == own
    return usual and row.plant != first and row.diverged_low > 0.5


def _spilling(result: ArenaResult) -> list[str]:
    """Say what becomes of controllers that were tuned without asking whether their loops grow."""
    said = []
    for modes in dict.fromkeys(row.modes for row in result.spills):
        its = [row for row in result.spills if (row.contestant, row.modes) == (ALL, modes)]
        finer = next((row for row in its if row.plant.startswith("assumed-modes")), None)
        if finer is not None:
            ends = f"[{100 * finer.low:.0f}, {100 * finer.high:.0f}]"
            said.append(
                f"Of {finer.controllers} controllers tuned on {modes} modes without asking, "
                f"{finer.grows} have exact loops that grow, and {100 * finer.share:.0f} % {ends} "
                f"diverge on {finer.plant}."
            )
    return said


def _shares(result: ArenaResult) -> list[str]:
    """Say whose the variance is, of all factors by their share."""
    said = []
    for of, whose in (
        (PIDS, "Of the variance of the scores of PIDs that differ in order and structure alone"),
        (TUNINGS, "Of that of classes tuned otherwise"),
    ):
        its = [row for row in result.shares if row.of == of]
        if its:
            said.append(f"{whose}, {_listed(its)}.")
    return said


def _listed(rows: Sequence[ShareRow]) -> str:
    parts = [
        f"{row.factor} has {100 * row.share:.0f} % [{100 * row.low:.0f}, {100 * row.high:.0f}]"
        for row in rows
    ]
    return ", ".join(parts)


def budget_in_words(result: ArenaResult) -> str:
    """Return what twice as many simulations are worth."""
    if not result.budget:
        return ""
    short = [row.contestant for row in result.budget if not row.enough]
    most = max(result.budget, key=lambda row: row.moved)
    said = (
        f"Twice as many simulations lower the objective by at most {most.moved:.3f} decades "
        f"({most.contestant}), by less than the score's interval in "
        f"{len(result.budget) - len(short)} of {len(result.budget)} classes"
    )
    return f"{said}, not in {', '.join(short)}." if short else f"{said}."
