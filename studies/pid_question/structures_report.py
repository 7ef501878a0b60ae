"""Structures at equal search effort, in tables, words and a figure.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from studies.core.evidence.digits import percent, with_interval
from studies.core.evidence.holding import Holding
from studies.core.evidence.repeats import summary
from studies.core.figures import (
    BLUE,
    INDEX_UNIT,
    ORANGE,
    canvas,
    drawn,
    finish,
    interval,
    log_axis,
    name_lines,
)
from studies.core.table import Column, Table

INDEX = 1e4  # tables have indices in 1e-4 m2 s
DECIMALS, RATIO = 3, 2  # most that are shown, of indices and of ratios
COLOURS = {"mirrored": BLUE, "ignored": ORANGE}
MARKS = {"mirrored": "o", "ignored": "s"}


@dataclass(frozen=True)
class Design:
    """A structure of controller, and whether v is mirrored or ignored in the measured angle."""

    structure: str
    v: str


REFERENCE = Design("fractional", "mirrored")  # the paper's


@dataclass(frozen=True)
class SearchRow:
    """What became of one search; cost [m2 s], filter time [s], parameters None if nothing held.

    The cost is what was minimised: the index (5), worst over the hardware, and the effort's share.
    """

    ground: str
    design: Design
    seed: int
    cost: float | None
    filter_time: float | None
    evaluations: int
    parameters: Mapping[str, float | None]


@dataclass(frozen=True)
class StructureRow:
    """All searches of a design on a ground: the cost's median and interval over seeds [m2 s].

    Attributes:
        found: how many found anything that held. evaluations: of each search.
        cost_low, cost_high: 95 % interval, of six seeds the range; None for fewer.
        ratio, ratio_low, ratio_high: of medians, to the fractional one's with v mirrored.
    """

    ground: str
    design: Design
    seeds: int
    found: int
    evaluations: int
    cost: float | None
    cost_low: float | None
    cost_high: float | None
    ratio: float | None
    ratio_low: float | None
    ratio_high: float | None


@dataclass(frozen=True)
class WinnerRow:
    """The best of all seeds' controllers repeated on a plant, medians and 95 % intervals.

    Attributes:
        seed: that found it. filter_time: [s]. index: (5) [m2 s]. envelope: [m].
        ratio: of index medians, to the fractional one's with v mirrored.
        to_mirrored: the same, to the same structure's with v mirrored.
        variation: of both torques together per second [N m/s].
        error_over_v: rms tip error over rms v of the run with the gains as they are.
    """

    ground: str
    plant: str
    design: Design
    seed: int
    filter_time: float
    runs: int
    index: float | None
    index_low: float | None
    index_high: float | None
    ratio: float | None
    ratio_low: float | None
    ratio_high: float | None
    to_mirrored: float | None
    to_mirrored_low: float | None
    to_mirrored_high: float | None
    envelope: float | None
    envelope_low: float | None
    envelope_high: float | None
    diverged_share: float
    diverged_share_low: float
    diverged_share_high: float
    variation: float | None
    error_over_v: float | None
    holds: bool
    holding: Holding = field(repr=False)


@dataclass(frozen=True, eq=False)
class StructuresResult:
    """A row per design and ground; per search; per winner and plant. Budget, in words."""

    rows: list[StructureRow]
    searches: list[SearchRow]
    winners: list[WinnerRow]
    budget: str


def spread_of(costs: Sequence[float]) -> dict[str, float | None]:
    """Return the median and the interval of costs over seeds, inf where nothing was found."""
    found = summary("cost", costs)
    return {name: found[name] for name in ("cost", "cost_low", "cost_high")}


def _with(name: str, scale: float = 1.0, most: int = DECIMALS) -> Callable[[Any], str]:
    """Return how a column shows a figure with its interval."""

    def form(row: Any) -> str:
        middle, low, high = (getattr(row, f"{name}{end}") for end in ("", "_low", "_high"))
        return with_interval(middle, low, high, scale, most)

    return form


def _diverged(row: WinnerRow) -> str:
    return percent(row.diverged_share, row.diverged_share_low, row.diverged_share_high)


def _holds(row: WinnerRow) -> str:
    found = row.holding
    if row.holds:
        return "yes"
    if found.diverged_at is not None:
        return f"to {found.diverged_at:.1f} s"
    return "grows" if found.grows else "v grows"


STRUCTURE, V = Column("structure"), Column("v")
GROUND, PLANT, BLANK = Column("ground"), Column("plant"), Column("v", form=lambda _: "")
SEARCHES = (
    STRUCTURE,
    V,
    Column("cost", "cost [1e-4 m2 s]", form=_with("cost", INDEX)),
    Column("ratio", "to fractional", form=_with("ratio", 1.0, RATIO)),
    Column("found", form=lambda row: f"{row.found}/{row.seeds}"),
    Column("evaluations", form="d"),
)
WINNERS = (
    STRUCTURE,
    V,
    Column("index", "index [1e-4]", form=_with("index", INDEX)),
    Column("ratio", "to fractional", form=_with("ratio", 1.0, RATIO)),
    Column("to_mirrored", "to mirrored", form=_with("to_mirrored", 1.0, RATIO)),
)
MARGINS = (
    STRUCTURE,
    V,
    Column("diverged_share", "diverged", form=_diverged),
    Column("variation", "variation\n[N m/s]", form=".3g"),
    Column("error_over_v", "error\n/ v", form=".2f"),
    Column("growth", "growth\n[1/s]", form=lambda row: f"{_most_growth(row):+.2g}"),
    Column("delay_margin", "delay m.\n[ms]", form=lambda row: _delay(row)),
    Column("holds", "holds\n20 s", form=_holds),
)


def _most_growth(row: WinnerRow) -> float:
    return max(row.holding.growth, row.holding.growth_friction)


def _delay(row: WinnerRow) -> str:
    return f"{1e3 * row.holding.delay_margin:.2f}"


def tables(result: StructuresResult) -> list[Table]:
    """Return searches, winners repeated, their margins; costs and indices in 1e-4 m2 s."""
    where = (GROUND, BLANK, PLANT)
    return [
        Table(
            result.rows,
            SEARCHES,
            "What searches find (index and effort), median over seeds [95 %]",
            key="rows",
            file="results.csv",
            section=(GROUND,),
            tight=True,
        ),
        Table(
            result.winners,
            WINNERS,
            "\nThe best of all seeds, repeated: medians [95 %], of the index and of its ratios",
            key="winners",
            file="winners.csv",
            section=where,
            tight=True,
        ),
        Table(
            result.winners,
            MARGINS,
            "\nThe same controllers",
            section=where,
            tight=True,
            prints="winners.csv",
        ),
        Table(result.searches, key="searches", file="searches.csv"),
    ]


def compared(rows: Sequence[WinnerRow], structure: str) -> tuple[int, int, int]:
    """Return in how many places a structure with v mirrored surely does better, worse; of how many.

    Surely: the whole interval of its ratio to the fractional one's index is below 1, or above.
    """
    mine = [
        row for row in rows if row.design == Design(structure, "mirrored") and row.ratio is not None
    ]
    better = sum(row.ratio_high is not None and row.ratio_high < 1 for row in mine)
    worse = sum(row.ratio_low is not None and row.ratio_low > 1 for row in mine)
    return better, worse, len(mine)


def verdict(result: StructuresResult) -> str:
    """Return in words whether order or the mirrored tip decides quality."""
    lines = []
    for name in ("pid", "pd"):
        better, worse, places = compared(result.winners, name)
        lines.append(
            f"{name.upper()} with v mirrored: index surely below the fractional controller's in "
            f"{better} of {places} places, surely above in {worse}."
        )
    ratios = [each.to_mirrored for each in result.winners if each.to_mirrored is not None]
    if ratios:
        lines.append(
            f"Ignoring v, the index is {min(ratios):.2g} to {max(ratios):.2g} of that with v "
            f"mirrored, below 1 in {sum(each < 1 for each in ratios)} of {len(ratios)} places."
        )
    return "\n".join([*lines, result.budget])


def figures(result: StructuresResult) -> Iterator[tuple[str, Figure]]:
    """Give the cost that every seed found, by structure, a panel for each ground."""
    yield "structures", cost_figure(result)


@drawn
def cost_figure(result: StructuresResult) -> Figure:
    """Return medians with intervals and every seed's cost, by structure, a panel per ground."""
    grounds = list(dict.fromkeys(row.ground for row in result.rows))
    structures = list(dict.fromkeys(row.design.structure for row in result.rows))
    figure, panels = canvas(len(grounds), 1, height=22 + 33 * len(grounds))
    for ground, axes in zip(grounds, panels.ravel(), strict=True):
        for v, colour in COLOURS.items():
            shift = -0.17 if v == "mirrored" else 0.17
            found = [
                (INDEX * row.cost, structures.index(row.design.structure))
                for row in result.searches
                if row.ground == ground and row.design.v == v and row.cost is not None
            ]
            costs, heights = np.array(found, dtype=float).reshape(-1, 2).T
            dots: dict[str, Any] = {"color": colour, "alpha": 0.45, "linestyle": "none"}
            axes.plot(costs, heights + shift, ".", **dots, label=f"v {v}: a seed's")
            for row in result.rows:
                if row.ground == ground and row.design.v == v and row.cost is not None:
                    line = structures.index(row.design.structure) + shift
                    ends = [None if e is None else INDEX * e for e in (row.cost_low, row.cost_high)]
                    sure = (ends[0], ends[1])
                    interval(axes, INDEX * row.cost, line, sure, MARKS[v], color=colour)
            axes.plot([], [], MARKS[v], color=colour, linestyle="none", label=f"v {v}: median")
        name_lines(axes, structures)
        axes.set_title(ground, loc="left")
        log_axis(axes.xaxis)
        axes.margins(x=0.05)
    panels.ravel()[-1].set_xlabel(f"index and effort [{INDEX_UNIT}]")
    caption = (
        "Index (5) with the effort's share that searches of equal effort found, by structure: "
        "every seed's, and the median with its 95 % interval."
    )
    return finish(figure, panels.ravel(), legend=4, caption=caption)
