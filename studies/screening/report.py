"""The study of screened draws in a table, words and a figure.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from flexsim.numerics.types import Array
from studies.core.evidence.digits import percent, with_interval
from studies.core.evidence.intervals import LEAST_RUNS, ratio_interval, share_of
from studies.core.figures import (
    BLUE,
    DASHES,
    INDEX,
    INDEX_UNIT,
    ORANGE,
    SINGLE,
    canvas,
    drawn,
    finish,
    log_axis,
)
from studies.core.table import Column, Table

COLOURS = {False: ORANGE, True: BLUE}  # by whether draws are screened
NAMES = {False: "plain", True: "screened"}
COSTS = ("simulations", "seconds")  # until the target


@dataclass(frozen=True)
class SearchRow:
    """One search.

    Attributes:
        seed, screen: as in `Tuning`. stable_first: share of the first generation that holds, with
            the ends of its 95 % interval, Wilson's.
        simulations_to_target, seconds_to_target: until the target was reached, None if never.
        best_index: of the whole search [m2 s], inf if nothing holds. candidates: screened.
        seconds, seconds_screening: in all, and of screening.
    """

    seed: int
    screen: int
    stable_first: float
    stable_first_low: float
    stable_first_high: float
    simulations_to_target: int | None
    seconds_to_target: float | None
    simulations: int
    best_index: float
    candidates: int
    seconds: float
    seconds_screening: float

    @property
    def draws(self) -> str:
        """Whether the search's draws are screened, in a word."""
        return NAMES[self.screen > 0]


@dataclass(frozen=True)
class CurveRow:
    """A search after one of its generations: best index so far [m2 s] and what it took."""

    seed: int
    screen: int
    generation: int
    simulations: int
    best: float
    seconds: float


@dataclass(frozen=True)
class Saving:
    """A cost until the target: medians of both kinds of searches, inf if most never reach it.

    Attributes:
        ratio: screened over plain, None where one is inf; with the ends of its 95 % interval.
    """

    plain: float
    screened: float
    ratio: float | None
    ratio_low: float | None
    ratio_high: float | None


@dataclass(frozen=True, eq=False)
class ScreeningResult:
    """Searches, their courses, what they are about, the index that counts as equal [m2 s].

    Attributes:
        seed: of the bootstrap of ratios.
    """

    rows: list[SearchRow]
    curves: list[CurveRow]
    title: str
    target: float
    seed: int = 1


def _stable_first(row: SearchRow) -> str:
    """Return the share of the first generation that holds, and its interval [%]."""
    ends = row.stable_first_low, row.stable_first_high
    return with_interval(row.stable_first, *ends, scale=100, most=1)


COLUMNS = (
    Column("seed", form="d"),
    Column("draws"),
    Column("stable_first", "first\nstable", "%", _stable_first),
    Column("simulations_to_target", "target\nruns", "", "d"),
    Column("seconds_to_target", "target", "s", ".1f"),
    Column("best_index", "best\nindex", "", ".4g", INDEX),
    Column("candidates", "candi-\ndates", "", "d"),
    Column("seconds_screening", "screen", "s", ".1f"),
    Column("seconds", "in all", "s", ".1f"),
)


def tables(result: ScreeningResult) -> list[Table]:
    """Return the searches seed by seed, plain above screened, and their courses for the file."""
    note = (
        f"Target: {INDEX * result.target:.4g}e-4 m2 s, median of what the plain searches end with: "
        "simulations and seconds until it is reached, - if never. Best index after the whole "
        "search [1e-4 m2 s]"
    )
    return [
        Table(
            result.rows,
            COLUMNS,
            note=note if math.isfinite(result.target) else "",
            key="rows",
            file="results.csv",
            tight=True,
        ),
        Table(result.curves, file="convergence.csv"),
    ]


def facts(result: ScreeningResult) -> dict[str, Any]:
    """Return the target; what screening takes over what plain draws take; how often it is better.

    A ratio's interval is a bootstrap's of the seeds' pairs, None for too few; the share's Wilson's.
    """
    ratios = [saved(result, cost) for cost in COSTS]
    return {
        "target": result.target,
        "ratios": {cost: asdict(each) for cost, each in zip(COSTS, ratios, strict=True)},
        **share_of("better_share", better(result.rows)),
    }


def to_target(rows: Sequence[SearchRow], screened: bool, cost: str) -> list[float]:
    """Return a cost until the target by seeds, inf for a search that never reaches it.

    Args:
        rows: of the study. screened: of the screened searches or the plain ones.
        cost: 'simulations' or 'seconds'.
    """
    costs = [getattr(row, f"{cost}_to_target") for row in rows if (row.screen > 0) == screened]
    return [math.inf if each is None else each for each in costs]


def saved(result: ScreeningResult, cost: str) -> Saving:
    """Return a cost's medians, plain and screened, and their ratio, pairs by seed."""
    plain, other = (to_target(result.rows, screened, cost) for screened in (False, True))
    medians = float(np.median(plain)), float(np.median(other))
    known = all(map(math.isfinite, medians))
    ends = ratio_interval(other, plain, result.seed) if known else None
    low, high = (x if math.isfinite(x) else None for x in ends) if ends else (None, None)
    return Saving(*medians, medians[1] / medians[0] if known else None, low, high)


def better(rows: Sequence[SearchRow]) -> list[bool]:
    """Return whether the screened search ends better than its seed's plain one, by seed."""
    ends = {row.seed: row.best_index for row in rows if not row.screen}
    return [row.best_index < ends[row.seed] for row in rows if row.screen]


def verdict(result: ScreeningResult) -> str:
    """Return what screening takes in simulations and in seconds, each over what plain draws do."""
    said = []
    for cost in COSTS:
        found = saved(result, cost)
        if found.ratio is None:
            each = (found.plain, found.screened)
            fate = [f"{x:.4g}" if math.isfinite(x) else "unreached" for x in each]
            said.append(f"{cost} {fate[0]} without, {fate[1]} with it")
            continue
        times = with_interval(found.ratio, found.ratio_low, found.ratio_high)
        medians = f"{found.plain:.4g} without, {found.screened:.4g} with it"
        said.append(f"{times} times the {cost} ({medians})")
    won = better(result.rows)
    share = share_of("better", won)
    return (
        f"Screening, until the target, medians: {'; '.join(said)}. At the end, after equal "
        f"simulations, it is better for {sum(won)} of {len(won)} seeds, "
        f"{percent(*share.values())}. Intervals of 95 %: of ratios by a bootstrap of the seeds "
        f"(none of fewer than {LEAST_RUNS}), of shares Wilson's."
    )


def _bests(rows: Sequence[CurveRow], screened: bool) -> tuple[Array, Array]:
    """Return simulations (G,) and best indices (seeds, G) of the plain or the screened searches."""
    mine = [row for row in rows if (row.screen > 0) == screened]
    first = [row.simulations for row in mine if row.seed == mine[0].seed]
    seeds = dict.fromkeys(row.seed for row in mine)
    best = [[row.best for row in mine if row.seed == seed] for seed in seeds]
    return np.array(first, dtype=float), np.array(best, dtype=float)


def figures(result: ScreeningResult) -> Iterator[tuple[str, Figure]]:
    """Give the best index so far against simulations: median and range over seeds."""
    yield "screening", course_figure(result)


@drawn
def course_figure(result: ScreeningResult) -> Figure:
    """Return the best index so far against simulations, median and range, screened and plain."""
    figure, panels = canvas(height=75, width=SINGLE)
    axes = panels[0, 0]
    held = [row.best for row in result.curves if math.isfinite(row.best)]
    for screened, colour in COLOURS.items():
        simulations, best = _bests(result.curves, screened)
        shown = np.where(np.isfinite(best), best, np.nan)
        middle = np.median(best, axis=0)
        top = np.where(np.isfinite(best).all(axis=0), best.max(axis=0), max(held, default=1.0))
        some = np.isfinite(best).any(axis=0)
        low = np.array([np.nanmin(column) for column in shown.T[some]])
        ends = INDEX * low, INDEX * top[some]
        axes.fill_between(simulations[some], *ends, color=colour, alpha=0.2, linewidth=0)
        middle = np.where(np.isfinite(middle), middle, np.nan)
        how = {"color": colour, "linewidth": 1.4, "linestyle": DASHES[int(screened)]}
        axes.plot(simulations, INDEX * middle, **how, label=f"{NAMES[screened]}: median")
        axes.fill([], [], color=colour, alpha=0.2, linewidth=0, label=f"{NAMES[screened]}: range")
    if math.isfinite(result.target):
        axes.axhline(INDEX * result.target, color="0.4", linestyle=":", label="target")
    if held:
        log_axis(axes.yaxis)
    axes.set(xlabel="simulations", ylabel=f"best index (5) so far [{INDEX_UNIT}]")
    axes.margins(x=0)
    caption = (
        f"Searches, {result.title}, with draws as they are and with screened draws: the best index "
        "(5) so far, median and range over seeds. Target: the median that the plain ones end with."
    )
    return finish(figure, [axes], legend=2, caption=caption)
