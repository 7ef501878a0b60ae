"""The arena in tables, figures and a sentence.

>>> answer(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from matplotlib.figure import Figure

from flexsim.files.atomic import replacing
from studies.arena.conditions import CORE, NOMINAL
from studies.arena.contestants import CLASSES
from studies.arena.rows import ArenaResult, ScoreRow
from studies.core.figures import COLOURS, DASHES, canvas, drawn, finish, log_axis
from studies.core.table import Column, Table

RESULTS = "results.parquet"
HARD = (("hardware", "delay 2"), ("payload", "200 g"), ("friction", "opposing"))


@dataclass(frozen=True)
class ClassRow:
    """A class at a glance, as it was tuned and on the bench; scores with their intervals [decades].

    Attributes:
        contestant, structure, order: its name, what it reads, its orders.
        index, effort: medians over seeds of what the searches found [m2 s], [-].
        score, chain: rows on the plant of the tuning and on the first chain; None without.
        delay, payload, friction: rows with two samples of delay, 200 g, friction against the
            motion, on the plant of the tuning.
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
        hard = [by.get((name, *each, first)) for each in HARD]
        usual = by.get((name, NOMINAL, NOMINAL, first))
        rows.append(
            ClassRow(
                name,
                CLASSES[name].structure,
                CLASSES[name].order,
                _median([each.index for each in its]),
                _median([each.effort for each in its]),
                usual,
                by.get((name, NOMINAL, NOMINAL, chain)),
                *hard,
            )
        )
    return sorted(rows, key=lambda row: -(row.score.score if row.score else -1.0))


def _median(values: list[float | None]) -> float | None:
    known = [math.inf if each is None else each for each in values]
    middle = float(np.median(known)) if known else math.inf
    return middle if math.isfinite(middle) else None


def _cell(name: str) -> Any:
    """Return what shows a score with its interval, and the share that diverged, if any."""

    def text(row: ClassRow) -> str:
        found: ScoreRow | None = getattr(row, name)
        if found is None:
            return "-"
        lost = f", {100 * found.diverged:.0f} % diverge" if found.diverged else ""
        return f"{found.score:.2f} [{found.low:.2f}, {found.high:.2f}]{lost}"

    return text


CLASS_COLUMNS = (
    Column("contestant", "class"),
    Column("structure"),
    Column("index", "index found", "1e-4 m2 s", ".3g", 1e4),
    Column("effort", "", "-", ".2f"),
    Column("score", "as tuned", form=_cell("score")),
    Column("chain", "on a chain", form=_cell("chain")),
)
HARD_COLUMNS = (
    Column("contestant", "class"),
    Column("delay", "delay 2", form=_cell("delay")),
    Column("payload", "200 g untold", form=_cell("payload")),
    Column("friction", "friction against motion", form=_cell("friction")),
)
SCORE_NOTE = (
    "Scores: decades of the index (5) below an arm that stands still, interquartile means over "
    "seeds, trajectories and repeats with 95 % intervals; a run that diverged has 0."
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
    Column("overshoot_loaded", "with 200 g", "%", ".0f", 100),
)
SHARE_COLUMNS = (
    Column("factor"),
    Column("levels", form="d"),
    Column(
        "share",
        unit="%",
        form=lambda row: f"{100 * row.share:.0f} [{100 * row.low:.0f}, {100 * row.high:.0f}]",
    ),
)


def tables(result: ArenaResult) -> list[Table]:
    """Return classes, verdicts, linear loops, shares; in files also searches, scores, fronts."""
    classes = class_rows(result)
    shown = [row for row in result.verdicts if row.factor != "model" or row.verdict != "open"]
    shown = [row for row in shown if row.plant in result.plants[:1] or row.factor == "model"]
    return [
        Table(classes, CLASS_COLUMNS, "Classes, the best first", SCORE_NOTE, prints="classes.csv"),
        Table(classes, HARD_COLUMNS, "\nOf what nobody was told", "", prints="told.csv"),
        Table(shown, VERDICT_COLUMNS, "\nVerdicts", prints="verdicts.csv", tight=True),
        Table(
            result.margins, MARGIN_COLUMNS, "\nLinear loops, medians", "", "margins", "margins.csv"
        ),
        Table(result.shares, SHARE_COLUMNS, "\nWhose the variance is", "", "shares", "shares.csv"),
        Table(result.verdicts, key="verdicts", file="verdicts.csv"),
        Table(result.tuned, key="tuned", file="tuned.csv"),
        Table(result.scores, key="scores", file="scores.csv"),
        Table(result.fronts, key="fronts", file="fronts.csv"),
        Table(result.profiles, key="profiles", file="profiles.csv"),
    ]


def verdict(result: ArenaResult) -> str:
    """Return the sentence that the data support, and whether the budget was enough."""
    return f"{answer(result)} {_budget(result)}".strip()


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
    for row in result.verdicts:
        if row.plant == first and row.factor == "order":
            how = {"first": "better than", "second": "worse than", "open": "not told from"}
            said.append(
                f"{row.first} is {how[row.verdict]} {row.second} "
                f"({row.chance:.2f} [{row.low:.2f}, {row.high:.2f}])."
            )
    spilt = sorted({row.contestant for row in result.scores if _spills(row, first)})
    if spilt:
        said.append(
            f"On a finer model or a chain more than half of the runs diverge of {', '.join(spilt)}."
        )
    if result.shares:
        most = result.shares[0]
        said.append(
            f"Of the four PIDs' scores, {most.factor} has the largest share of the variance, "
            f"{100 * most.share:.0f} % [{100 * most.low:.0f}, {100 * most.high:.0f}]."
        )
    return " ".join(said)


def _spills(row: ScoreRow, first: str) -> bool:
    own = CLASSES[row.contestant].aid if row.contestant in CLASSES else "plain"
    usual = row.tuning == CORE and row.condition == NOMINAL and row.reference == own
    return usual and row.plant != first and row.diverged_low > 0.5


def _budget(result: ArenaResult) -> str:
    """Return what twice as many simulations are worth, in words."""
    gains = [
        (row.objective / row.twice - 1.0, row.contestant)
        for row in result.tuned
        if row.twice is not None and row.objective is not None
    ]
    if not gains:
        return ""
    most, whose = max(gains)
    return f"Twice as many simulations lower the objective by at most {100 * most:.0f} % ({whose})."


def facts(result: ArenaResult) -> dict[str, Any]:
    """Return on which plants."""
    return {"plants": list(result.plants), "runs": result.table.num_rows}


def write_runs(folder: Path, result: ArenaResult) -> None:
    """Write the table of all runs."""
    with replacing(folder / RESULTS, "the results") as path:
        pq.write_table(result.table, path, compression="zstd")


def figures(result: ArenaResult) -> Iterator[tuple[str, Figure]]:
    """Give scores with their intervals, and fronts of error against effort."""
    yield "scores", scores_figure(result)
    yield "profiles", profiles_figure(result)
    if any(row.condition == "search" for row in result.fronts):
        yield "fronts", fronts_figure(result)


@drawn
def scores_figure(result: ArenaResult) -> Figure:
    """Return every class's score on every plant, as it was tuned."""
    classes = [row.contestant for row in class_rows(result)]
    figure, panels = canvas(1, 1, height=30 + 6 * len(classes))
    axes = panels[0, 0]
    for k, plant in enumerate(result.plants):
        rows = {
            row.contestant: row
            for row in result.scores
            if row.plant == plant
            and row.condition == NOMINAL
            and row.tuning == CORE
            and row.reference == CLASSES[row.contestant].aid
        }
        its = [(i, rows[name]) for i, name in enumerate(classes) if name in rows]
        places = np.array([i + 0.18 * (k - (len(result.plants) - 1) / 2) for i, _ in its])
        values = np.array([[row.score, row.low, row.high] for _, row in its]).T
        ends = np.abs(values[1:] - values[0])
        how = {"color": COLOURS[k % len(COLOURS)], "fmt": "os^vD"[k % 5], "markersize": 3.5}
        axes.errorbar(values[0], places, xerr=ends, linewidth=1.0, label=plant, **how)
    axes.set_yticks(range(len(classes)), classes)
    axes.invert_yaxis()
    axes.set(xlabel="decades of the index (5) below an arm that stands still")
    axes.set_xlim(0.0, 1.03 * axes.get_xlim()[1])
    caption = (
        "Classes tuned alike on the first plant, and run on all: interquartile means over seeds "
        "and trajectories, 95 % intervals. A run that diverged scores 0."
    )
    return finish(figure, panels.ravel(), legend=4, caption=caption)


def _look(k: int) -> dict[str, Any]:
    """Return how the k-th of many lines is drawn."""
    dash = DASHES[k // len(COLOURS) % len(DASHES)]
    return {"color": COLOURS[k % len(COLOURS)], "linestyle": dash}


@drawn
def profiles_figure(result: ArenaResult) -> Figure:
    """Return performance profiles, a panel for the plant of the tuning and one for a chain."""
    chain = next((each for each in result.plants if "chain" in each), result.plants[0])
    plants = list(dict.fromkeys((result.plants[0], chain)))
    figure, panels = canvas(1, len(plants), height=80, sharey=True)
    for k, row in enumerate(class_rows(result)):
        for j, plant in enumerate(plants):
            its = [
                (each.level, each.share)
                for each in result.profiles
                if (each.contestant, each.plant) == (row.contestant, plant)
            ]
            if its:
                levels, shares = np.array(its).T
                panels[0, j].plot(levels, shares, label=row.contestant, **_look(k))
    for j, plant in enumerate(plants):
        panels[0, j].set(title=plant, xlabel="score [decades]", ylim=(0.0, 1.0))
        panels[0, j].margins(x=0)
    panels[0, 0].set(ylabel="share of runs that score more")
    caption = (
        "Performance profiles of classes as they were tuned. Scores are decades of the index (5) "
        "below that of an arm that stands still."
    )
    return finish(figure, panels.ravel(), legend=4, caption=caption)


@drawn
def fronts_figure(result: ArenaResult) -> Figure:
    """Return the index against effort of what searches tried, a line a class."""
    figure, panels = canvas(1, 1, height=100)
    axes = panels[0, 0]
    rows = [row for row in result.fronts if row.condition == "search"]
    for k, name in enumerate(dict.fromkeys(row.contestant for row in rows)):
        its = sorted((row.effort, row.index) for row in rows if row.contestant == name)
        efforts, indices = np.array(its).T
        axes.plot(efforts, 1e4 * indices, drawstyle="steps-post", label=name, **_look(k))
    axes.set(xscale="log", yscale="log", xlabel="effort over that of PIDs that ignore v")
    axes.set(ylabel="index (5) [1e-4 m\u00b2 s]")
    log_axis(axes.xaxis)
    log_axis(axes.yaxis)
    caption = (
        "Fronts of error against effort: what no other individual of its class's searches "
        "dominates. Effort is the largest of total variation and rms of either torque."
    )
    return finish(figure, panels.ravel(), legend=4, caption=caption)
