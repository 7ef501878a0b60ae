"""The question of the integer PIDs in a table, words and a figure.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexsim.recording.traces import spoken
from studies.core.evidence.digits import with_interval
from studies.core.evidence.intervals import share_interval
from studies.core.figures import (
    BLUE,
    INDEX,
    INDEX_UNIT,
    ORANGE,
    SMALL,
    canvas,
    drawn,
    finish,
    interval,
    log_axis,
    name_lines,
)
from studies.core.table import Column, Table

Kind = tuple[str, str, str]  # order, realisation, range

PAPERS: Kind = ("integer", "truncated", "table-1")  # those that the paper found no stable ones of
CHANGES: dict[str, Kind] = {  # what is different from the paper's
    "as in the paper": PAPERS,
    "other order": ("fractional", "truncated", "table-1"),
    "other realisation": ("integer", "textbook", "table-1"),
    "other range": ("integer", "truncated", "log-uniform"),
    "other realisation and range": ("integer", "textbook", "log-uniform"),
}
COLOURS = {"table-1": BLUE, "log-uniform": ORANGE}
MARKS = {"table-1": "o", "log-uniform": "s"}
BAR = 0.36
RARE = 0.1  # share below which tenths of a per cent are shown


@dataclass(frozen=True)
class Names:
    """What is searched: the three that are changed, and where the loop runs."""

    order: str
    realisation: str
    range: str
    plant: str
    setting: str

    @property
    def kind(self) -> Kind:
        """What distinguishes it among those of its plant and setting."""
        return self.order, self.realisation, self.range


@dataclass(frozen=True)
class SearchRow:
    """What became of one search; best index [m2 s] and parameters None if nothing was bounded.

    Shares of its first draws that are bounded, and that do not grow on the exact linear loop
    either; whether its best does not.
    """

    names: Names
    seed: int
    bounded_draws: float
    stable_draws: float
    best_stable: bool
    best_index: float | None
    generations: int
    evaluations: int
    parameters: Mapping[str, float | None]


@dataclass(frozen=True)
class CaseRow:
    """All searches of a case: shares of their draws and of the searches, best index (5) [m2 s].

    Low and high are the ends of 95 % intervals: of shares Wilson's, of the median order statistics,
    None for fewer than six. The median, quartiles, least and most of the best index are those of
    the searches that found anything bounded; None if none did. Evaluations and generations are of
    all searches, the most a search may have being `generations_most`.
    """

    names: Names
    seeds: int
    bounded_draws: float
    bounded_draws_low: float
    bounded_draws_high: float
    bounded_runs: float
    bounded_runs_low: float
    bounded_runs_high: float
    stable_draws: float
    stable_draws_low: float
    stable_draws_high: float
    stable_runs: float
    stable_runs_low: float
    stable_runs_high: float
    best_index: float | None
    best_index_low: float | None
    best_index_high: float | None
    best_index_quartile_1: float | None
    best_index_quartile_3: float | None
    best_index_least: float | None
    best_index_most: float | None
    draws: int
    evaluations: int
    generations_most: int


@dataclass(frozen=True, eq=False)
class PidQuestionResult:
    """A row per case, and one per search; the trajectory followed; whether there was an exact loop
    to tell the stable from the bounded by."""

    rows: list[CaseRow]
    searches: list[SearchRow]
    trajectory: str
    exact: bool = True


def _percent(share: float, low: float, high: float) -> str:
    """Return a share and its interval in per cent."""
    return with_interval(share, low, high, scale=100, most=int(share < RARE))


def _share(name: str, heading: str) -> Column:
    """Return the column of a share and its interval."""

    def text(row: CaseRow) -> str:
        return _percent(*(getattr(row, f"{name}{end}") for end in ("", "_low", "_high")))

    return Column(name, heading, form=text)


def _best(row: CaseRow) -> str:
    """Return the median of the best index and its interval, the range of too few searches."""
    if row.best_index is None:
        return "-"
    if row.best_index_low is not None:
        return with_interval(row.best_index, row.best_index_low, row.best_index_high, INDEX)
    ends = (row.best_index, row.best_index_least or 0.0, row.best_index_most or 0.0)
    return "{:.2g} ({:.2g} to {:.2g})".format(*(INDEX * each for each in ends))


CONTROLLERS = {  # by order and realisation
    ("fractional", "truncated"): "fractional",
    ("integer", "truncated"): "PID by (2)",
    ("integer", "textbook"): "textbook",
}
DRAWN = {"table-1": "Table 1", "log-uniform": "log"}
COLUMNS = (
    Column("order", "controller", form=lambda row: CONTROLLERS[row.names.kind[:2]]),
    Column("range", form=lambda row: DRAWN[row.names.range]),
    _share("bounded_draws", "bounded\n% draws"),
    _share("stable_draws", "stable\n% draws"),
    _share("stable_runs", "stable\n% runs"),
    Column("best_index", "best,\nmedian", form=_best),
)
SECTION = (
    Column("plant", form=lambda row: row.names.plant.removeprefix("assumed-")),
    Column("setting"),
    Column("seeds", form=lambda row: f"{row.seeds} seeds"),
)
NOTE = """\
bounded: in the simulation; stable: nor does it grow on the exact linear loop.
Runs: of the best of a search, all bounded where there are any. Shares with
Wilson's 95 % intervals; best index: medians of the searches that found any with
those by order statistics, or the range (of fewer than six), in 1e-4 m2 s."""

NO_EXACT = "This robot's beam has no exact linear loop: what is bounded counts as stable."


def tables(result: PidQuestionResult) -> list[Table]:
    """Return the cases: shares in per cent, best index (5) in 1e-4 m2 s; the searches."""
    return [
        Table(
            result.rows,
            COLUMNS,
            note=NOTE if result.exact else f"{NOTE}\n{NO_EXACT}",
            key="rows",
            file="results.csv",
            section=SECTION,
            tight=True,
        ),
        Table(result.searches, key="searches", file="searches.csv"),
    ]


def changed(rows: Sequence[CaseRow], what: Kind) -> tuple[str, str] | None:
    """Return the shares of stable draws and runs of one kind over all plants and settings [%].

    These have the same draws and seeds. So the intervals are of as many as one of them has.
    """
    mine = [row for row in rows if row.names.kind == what]
    if not mine:
        return None
    draws, runs = np.mean([[row.stable_draws, row.stable_runs] for row in mine], axis=0).tolist()
    sizes = ((draws, mine[0].draws), (runs, mine[0].seeds))
    shown = (
        _percent(share, *share_interval(round(share * count), count)) for share, count in sizes
    )
    return next(shown), next(shown)


def verdict(result: PidQuestionResult) -> str:
    """Return in words what becomes of the paper's integer PIDs when one thing is changed."""
    lines = ["Integer PIDs of the paper, one thing changed at a time, % stable, all plants:"]
    for name, what in CHANGES.items():
        shares = changed(result.rows, what)
        if shares is not None:
            draws, runs = shares
            lines.append(f"  {name:<28}{draws:>14} of draws {runs:>14} of runs")
    return "\n".join(lines)


def figures(result: PidQuestionResult) -> Iterator[tuple[str, Figure]]:
    """Give shares of stable draws (bars) and of searches (marks), best indices with their range."""
    yield "pid_question", shares_figure(result)


@drawn
def shares_figure(result: PidQuestionResult) -> Figure:
    """Return shares that are stable, and best indices, a line of panels per plant and setting."""
    rows = result.rows
    where = list(dict.fromkeys((row.names.plant, row.names.setting) for row in rows))
    loops = list(dict.fromkeys(row.names.kind[:2] for row in rows))
    height = 24 + (12 + 7.5 * len(loops)) * len(where)
    figure, panels = canvas(len(where), 2, height=height, sharex="col")
    for place, (shares, best) in zip(where, panels, strict=True):
        for row in rows:
            if (row.names.plant, row.names.setting) == place:
                side = -0.5 if row.names.range == "table-1" else 0.5
                _draw(shares, best, row, loops.index(row.names.kind[:2]) + side * BAR)
        for axes in (shares, best):
            name_lines(axes, ["\n".join(loop) for loop in loops])
        best.tick_params(labelleft=False)
        shares.set_xlim(0, 100)
        shares.set_title(f"{spoken(place[0])}, {place[1]}", loc="left")
    for axes in panels[:, 1]:
        log_axis(axes.xaxis)
    panels[-1][0].set_xlabel("share that is stable [%]")
    panels[-1][1].set_xlabel(f"best index (5) [{INDEX_UNIT}]")
    _name_marks(panels[0][0])
    caption = (
        f"Which controllers hold the {result.trajectory}? Left: shares of draws and of searches "
        "that are stable, with 95 % intervals. Right: the best index over seeds, its median with a "
        "95 % interval where there are six or more, and its range."
    )
    return finish(figure, panels.ravel(), legend=3, caption=caption)


def _name_marks(axes: Axes) -> None:
    """Name colours and marks in the legend."""
    for name, colour in COLOURS.items():
        axes.plot([], [], MARKS[name], color=colour, linestyle="none", label=name)
    axes.fill([], [], color="0.4", alpha=0.5, label="of draws; thin: its interval")
    interval(axes, np.nan, 0, (np.nan, np.nan), "o", color="0.4", label="of searches; best index")
    axes.plot([], [], color="0.4", linewidth=2.6, alpha=0.4, label="range over seeds")


def _draw(shares: Axes, best: Axes, row: CaseRow, height: float) -> None:
    """Draw one case, a line of both panels."""
    colour, marker = COLOURS[row.names.range], MARKS[row.names.range]
    shares.barh(height, 100 * row.stable_draws, BAR, color=colour, alpha=0.5)
    draws = 100 * row.stable_draws_low, 100 * row.stable_draws_high
    shares.plot(draws, [height - 0.3 * BAR] * 2, color="0.25", linewidth=0.8)
    runs = 100 * row.stable_runs_low, 100 * row.stable_runs_high
    interval(shares, 100 * row.stable_runs, height, runs, marker, color=colour, clip_on=False)
    if row.best_index is None:
        how: dict[str, Any] = {"transform": best.get_yaxis_transform(), "va": "center"}
        best.text(0.02, height, "none bounded", color=colour, size=SMALL, **how)
        return
    ends = INDEX * np.array([row.best_index_least, row.best_index_most], float)
    best.plot(ends, [height] * 2, color=colour, linewidth=2.6, alpha=0.4)
    low, high = (
        None if end is None else INDEX * end for end in (row.best_index_low, row.best_index_high)
    )
    interval(best, INDEX * row.best_index, height, (low, high), marker, color=colour)
