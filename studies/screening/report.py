"""The study of screened draws in a table, words and a figure.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from flexsim.numerics.types import Array
from studies.core.figures import BLUE, FONT, ORANGE, canvas, finish
from studies.core.table import Column, Table

COLOURS = {False: ORANGE, True: BLUE}  # by whether draws are screened
NAMES = {False: "plain", True: "screened"}
INDEX = 1e4  # the table's indices are in 1e-4 m2 s
COLUMNS = (
    Column("seed", form="d"),
    Column("draws"),
    Column("stable_first", "first\nstable", "%", ".0f", 100),
    Column("simulations_to_target", "target\nruns", "", "d"),
    Column("seconds_to_target", "target", "s", ".1f"),
    Column("best_index", "best\nindex", "", ".4g", INDEX),
    Column("candidates", "candi-\ndates", "", "d"),
    Column("seconds_screening", "screen", "s", ".1f"),
    Column("seconds", "in all", "s", ".1f"),
)


@dataclass(frozen=True)
class SearchRow:
    """One search.

    Attributes:
        seed, screen: as in `Tuning`. stable_first: share of the first generation that holds.
        simulations_to_target, seconds_to_target: until the target was reached, None if never.
        best_index: of the whole search [m2 s], inf if nothing holds. candidates: screened.
        seconds, seconds_screening: in all, and of screening.
    """

    seed: int
    screen: int
    stable_first: float
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


@dataclass(frozen=True, eq=False)
class ScreeningResult:
    """Searches, their courses, what they are about, the index that counts as equal [m2 s]."""

    rows: list[SearchRow]
    curves: list[CurveRow]
    title: str
    target: float


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
        ),
        Table(result.curves, file="convergence.csv"),
    ]


def facts(result: ScreeningResult) -> dict[str, float]:
    """Return the target."""
    return {"target": result.target}


def median_to_target(rows: Sequence[SearchRow], screened: bool, cost: str) -> float:
    """Return the median over seeds of a cost until the target, inf if most never reach it.

    Args:
        rows: of the study. screened: of the screened searches or the plain ones.
        cost: 'simulations' or 'seconds'.
    """
    costs = [getattr(row, f"{cost}_to_target") for row in rows if (row.screen > 0) == screened]
    return float(np.median([math.inf if each is None else each for each in costs]))


def verdict(result: ScreeningResult) -> str:
    """Return what screening saves, or that it does not, in simulations and in seconds."""
    rows, said = result.rows, []
    for cost in ("simulations", "seconds"):
        plain, other = (median_to_target(rows, screened, cost) for screened in (False, True))
        if math.isfinite(plain) and math.isfinite(other):
            share = 1 - other / plain
            what = f"{100 * abs(share):.0f} % {'fewer' if share >= 0 else 'more'}"
            said.append(f"{what} {cost} ({plain:.4g} without, {other:.4g} with it)")
        else:
            fate = [f"{x:.4g}" if math.isfinite(x) else "unreached" for x in (plain, other)]
            said.append(f"{cost} {fate[0]} without, {fate[1]} with it")
    ends = {row.seed: row.best_index for row in rows if not row.screen}
    better = sum(row.best_index < ends[row.seed] for row in rows if row.screen)
    return (
        f"Screening, until the target, medians: {'; '.join(said)}. At the end, after equal "
        f"simulations, it is better for {better} of {len(ends)} seeds."
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
    figure, panels = canvas(height=8.0)
    axes = panels[0, 0]
    held = [row.best for row in result.curves if math.isfinite(row.best)]
    for screened, colour in COLOURS.items():
        simulations, best = _bests(result.curves, screened)
        shown = np.where(np.isfinite(best), best, np.nan)
        middle = np.median(best, axis=0)
        top = np.where(np.isfinite(best).all(axis=0), best.max(axis=0), max(held, default=1.0))
        some = np.isfinite(best).any(axis=0)
        low = np.array([np.nanmin(column) for column in shown.T[some]])
        axes.fill_between(simulations[some], low, top[some], color=colour, alpha=0.2, linewidth=0)
        middle = np.where(np.isfinite(middle), middle, np.nan)
        label = f"{NAMES[screened]}: median and range"
        axes.plot(simulations, middle, color=colour, linewidth=2.6, label=label)
    if math.isfinite(result.target):
        label = "target: median the plain end with"
        axes.axhline(result.target, color="0.4", linestyle="--", label=label)
    if held:
        axes.set_yscale("log")
    axes.set(xlabel="simulations", ylabel="best index (5) so far [m² s]", title=result.title)
    axes.legend(fontsize=FONT, frameon=False)
    yield "screening", finish(figure, [axes])
