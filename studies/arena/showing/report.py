"""The arena in tables, and its files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from flexsim.files.atomic import replacing
from studies.arena.contestants import CLASSES
from studies.arena.rows import ArenaResult, MeasureRow, ScoreRow
from studies.arena.showing.answer import answer, budget_in_words
from studies.arena.showing.classes import (
    ClassRow,
    DisturbedRow,
    SearchRow,
    class_rows,
    disturbed_rows,
    knob_rows,
    search_rows,
)
from studies.core.table import Column, Table

RESULTS = "results.parquet"


def _score(name: str) -> Callable[[ClassRow], str]:
    """Return what shows a score with its interval, and the share that diverged, if any."""

    def text(row: ClassRow) -> str:
        found: ScoreRow | None = getattr(row, name)
        if found is None:
            return "-"
        lost = f", {100 * found.diverged:.0f} % diverge" if found.diverged else ""
        return f"{found.score:.2f} [{found.low:.2f}, {found.high:.2f}]{lost}"

    return text


def _measured(name: str, key: str, scale: float) -> Callable[[DisturbedRow], str]:
    """Return what shows a measure with its interval."""

    def text(row: DisturbedRow) -> str:
        found: MeasureRow | None = getattr(row, name)
        numbers = [getattr(found, f"{key}{end}", None) for end in ("", "_low", "_high")]
        if numbers[0] is None:
            return "-"
        middle, low, high = ("-" if n is None else f"{scale * n:.3g}" for n in numbers)
        return f"{middle} [{low}, {high}]"

    return text


def _worth(row: SearchRow) -> str:
    """Return what twice the simulations are worth, and the interval that it is held against."""
    its = row.budget
    return "-" if its is None else f"{its.moved:.3f} of {its.interval:.3f}"


CLASS_COLUMNS = (
    Column("contestant", "class"),
    Column("structure"),
    Column("score", "as tuned", form=_score("score")),
    Column("chain", "on a chain", form=_score("chain")),
)
HARD_COLUMNS = (
    Column("contestant", "class"),
    Column("delay", "delay 2", form=_score("delay")),
    Column("payload", "100 g untold", form=_score("payload")),
    Column("friction", "friction against motion", form=_score("friction")),
    Column("borne", "holds", form=lambda row: f"{row.borne} of {row.levels}"),
)
SEARCH_COLUMNS = (
    Column("contestant", "class"),
    Column("grew", "rejected", "%", ".0f", 100),
    Column("found", form=lambda row: f"{row.found} of {row.searches}"),
    Column("index", "index, median", "1e-4 m2 s", ".3g", 1e4),
    Column("best", "least", "1e-4 m2 s", ".3g", 1e4),
    Column("effort", "", "-", ".2f"),
    Column("budget", "twice moves", "decades", form=_worth),
)
DISTURBED_COLUMNS = (
    Column("contestant", "class"),
    Column("push", "push, rms error", "mm", form=_measured("push", "rms_error", 1e3)),
    Column("push", "residual v", "mm", form=_measured("push", "residual_v", 1e3)),
    Column("pulse", "pulse, rms error", "mm", form=_measured("pulse", "rms_error", 1e3)),
)
SCORE_NOTE = (
    "Scores: decades of the index (5) below an arm that stands still, interquartile means over "
    "searches, trajectories and repeats with 95 % intervals; a run that diverged has 0."
)
HARD_NOTE = "Holds: levels of all conditions under which none of its runs diverges."
SEARCH_NOTE = (
    "Rejected: individuals whose exact linear loop grows. Twice: decades by which twice as many "
    "simulations lower the objective, of those between the ends of the score's interval."
)
DAMPED_NOTE = (
    "Of joint 2's step. Hold loaded: with any of 0 to 200 g at the tip; spread: of these, largest "
    "less least overshoot."
)
VERDICT_COLUMNS = (
    Column("factor"),
    Column("first"),
    Column("second"),
    Column("plant"),
    Column(
        "chance",
        "chance that the first is better",
        form=lambda row: f"{row.chance:.2f} [{row.low:.2f}, {row.high:.2f}]",
    ),
    Column("verdict"),
)
MARGIN_COLUMNS = (
    Column("contestant", "class"),
    Column("grows", "grow", "%", ".0f", 100),
    Column("delay_margin", "delay borne", "ms", ".2f", 1e3),
    Column("peak_1", "Ms, joint 1", "-", ".2f"),
    Column("peak_2", "Ms, joint 2", "-", ".2f"),
    Column("overshoot", "overshoot", "%", ".0f", 100),
    Column("loaded", "hold loaded", "%", ".0f", 100),
    Column(
        "spread",
        unit="%",
        form=lambda row: (
            "-"
            if row.spread is None
            else f"{100 * row.spread:.0f} [{100 * row.spread_low:.0f}, {100 * row.spread_high:.0f}]"
        ),
    ),
)
SPILL_COLUMNS = (
    Column("modes", "tuned on modes", form="d"),
    Column("plant", "run on"),
    Column("controllers", form="d"),
    Column("grows", "whose exact loop grows", form="d"),
    Column(
        "share",
        "diverge",
        "%",
        form=lambda row: f"{100 * row.share:.0f} [{100 * row.low:.0f}, {100 * row.high:.0f}]",
    ),
)
SHARE_COLUMNS = (
    Column("of"),
    Column("factor"),
    Column("levels", form="d"),
    Column(
        "share",
        unit="%",
        form=lambda row: f"{100 * row.share:.0f} [{100 * row.low:.0f}, {100 * row.high:.0f}]",
    ),
)


def tables(result: ArenaResult) -> list[Table]:
    """Return what is to be read; in files also searches, scores, measures, fronts, profiles."""
    shown = [
        row
        for row in result.verdicts
        if row.plant in result.plants[:1] and (row.factor != "reference" or row.first in CLASSES)
    ]
    spilt = [row for row in result.spills if row.contestant == "all"]
    found = [
        Table(
            class_rows(result),
            CLASS_COLUMNS,
            "Classes, the best first",
            SCORE_NOTE,
            prints="classes.csv",
        ),
        Table(
            class_rows(result),
            HARD_COLUMNS,
            "\nOf what nobody was told",
            HARD_NOTE,
            prints="told.csv",
        ),
        Table(
            disturbed_rows(result),
            DISTURBED_COLUMNS,
            "\nAt rest, disturbed",
            prints="disturbed.csv",
        ),
        Table(
            search_rows(result), SEARCH_COLUMNS, "\nSearches", SEARCH_NOTE, prints="searches.csv"
        ),
        Table(shown, VERDICT_COLUMNS, "\nVerdicts", prints="verdicts.csv", tight=True),
        Table(
            result.margins,
            MARGIN_COLUMNS,
            "\nLinear loops, medians",
            DAMPED_NOTE,
            "margins",
            "margins.csv",
        ),
        Table(spilt, SPILL_COLUMNS, "\nTuned whatever grows, all classes", prints="spills.csv"),
        Table(result.shares, SHARE_COLUMNS, "\nWhose the variance is", "", "shares", "shares.csv"),
    ]
    return [table for table in found if table.rows] + [
        Table(result.verdicts, key="verdicts", file="verdicts.csv"),
        Table(knob_rows(result), key="knobs", file="knobs.csv"),
        Table(result.tuned, key="tuned", file="tuned.csv"),
        Table(result.scores, key="scores", file="scores.csv"),
        Table(result.measures, key="measures", file="measures.csv"),
        Table(result.fronts, key="fronts", file="fronts.csv"),
        Table(result.profiles, key="profiles", file="profiles.csv"),
        Table(result.spills, key="spills", file="spills.csv"),
        Table(result.budget, key="budget", file="budget.csv"),
    ]


def verdict(result: ArenaResult) -> str:
    """Return the sentence that the data support, and whether the budget was enough."""
    return f"{answer(result)} {budget_in_words(result)}".strip()


def facts(result: ArenaResult) -> dict[str, Any]:
    """Return on which plants."""
    return {"plants": list(result.plants), "runs": result.table.num_rows}


def write_runs(folder: Path, result: ArenaResult) -> None:
    """Write the table of all runs."""
    with replacing(folder / RESULTS, "the results") as path:
        pq.write_table(result.table, path, compression="zstd")
