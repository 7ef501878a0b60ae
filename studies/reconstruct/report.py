"""The reconstruction's study in words, tables and figures.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from flexsim.recording.traces import spoken
from studies.core.evidence.digits import supported, with_interval
from studies.core.evidence.intervals import share_interval
from studies.core.figures import (
    canvas,
    drawn,
    finish,
    interval,
    log_axis,
    mark,
    name_lines,
    style,
    thinned,
)
from studies.core.paper import PLANTS
from studies.core.table import Column, Table
from studies.reconstruct.rows import MM, FigureRow, ReconstructResult

LEAST = 1e-15  # [rad]; distances below are rounding


def tables(result: ReconstructResult) -> list[Table]:
    """Return both plants' envelopes by variant, how runs part, and Table 2's units."""
    paper = {row.figure: MM * row.paper_simulation for row in result.rows}
    factors = {row.variant: row for row in result.misfits}

    def factor(row: FigureRow) -> str:
        known = factors[row.variant]
        return supported(known.factor, known.factor_low, known.factor_high)

    envelopes = (
        Column("variant", "variant\nTable 3"),
        *(
            Column("outcome", f"Figure {figure}\n{envelope:.0f}", form=lambda row: row.outcome,
                   where={"figure": figure})
            for figure, envelope in paper.items()
        ),
        Column("off", form=factor, once=True),
    )  # fmt: skip
    chaos = (
        Column("variant"),
        Column("figure"),
        Column("amplification", "growth", form="5.0e"),
        *(
            Column(hair, hair.removeprefix("apart_"), form="3.0f", scale=100)
            for hair in result.chaos[0].apart
            if not hair.endswith(("_low", "_high"))
        ),
        Column("kind", form=lambda row: f"{row.kind:>7}"),
    )
    units = (
        Column("figure"),
        Column("gain"),
        Column("order", form="g"),
        Column("seconds", "with s", form=".4g"),
        Column("deviations_seconds", "deviations", form="+.3g"),
        Column("milliseconds", "with ms", form=".4g"),
        Column("deviations_milliseconds", "deviations", form="+.3g"),
    )
    return [
        Table(
            result.rows,
            envelopes,
            "Median envelope in mm, assumed modes | chain; †t: all diverge, median time in s;\n"
            "n%: only so many runs stay bounded; off: mean factor to Table 3. Digits are those\n"
            "that 95 % intervals support, which are in results.csv and misfits.csv",
            key="rows",
            file="results.csv",
            line=("group", "variant"),
            tight=True,
        ),
        Table(
            result.chaos,
            chaos,
            "Pairs of runs that start a hair apart: growth of the least hair, and % of pairs\n"
            "whose tips come to be over 1 mm apart, by hair in rad",
            key="chaos",
            file="chaos.csv",
            line=("variant", "figure"),
            tight=True,
        ),
        Table(result.misfits, key="misfits", file="misfits.csv"),
        Table(result.units, key="units", file="units.csv"),
        Table(
            [row for row in result.units if row.seconds != 0.0],
            units,
            "Table 2's gains other than 0, and how many deviations from Table 1's means",
            prints="units.csv",
        ),
    ]


def verdict(result: ReconstructResult) -> str:
    """Return in words which variants stay bounded, and how wide the placement's effect is."""
    rows = result.rows
    shares: dict[str, list[float]] = {}
    for row in rows:
        shares.setdefault(row.variant, []).append(row.bounded_share)
    held = sum(min(share) == 1.0 for share in shares.values())
    lost = [name for name, share in shares.items() if max(share) == 0.0]
    lines = [
        f"{held} of {len(shares)} variants keep every run bounded, in all figures on both plants.",
        f"Nothing stays bounded with: {', '.join(lost) or 'none of them'}.",
    ]
    known = [row for row in result.misfits if row.factor is not None]
    if known:
        nearest = min(known, key=lambda row: row.factor or 0.0)
        ends = nearest.factor_low, nearest.factor_high
        factor = with_interval(nearest.factor, *ends)
        lines.append(f"Nearest to Table 3: {nearest.variant}, off by a factor {factor}.")
    lines += [_spread(rows), *_placements(rows)]
    kinds = [row.kind for row in result.chaos]
    counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
    lines.append(f"Of {len(kinds)} motions looked at closely: {counts}.")
    return "\n".join([*lines, _sure(rows)])


def _sure(rows: Sequence[FigureRow]) -> str:
    """Return in words how much is known where every run stays bounded, or none does."""
    runs = max(row.runs for row in rows)
    least, most = share_interval(runs, runs)[0], share_interval(0, runs)[1]
    return (
        f"Where all of {runs} runs stay bounded at least {100 * least:.0f} % do, where none does "
        f"at most {100 * most:.0f} % (95 %)."
    )


def _spread(rows: Sequence[FigureRow]) -> str:
    """Return in words how far the gains' fourth digits move envelopes."""
    spread = np.array([
        (row.envelope_quartile_3 - row.envelope_quartile_1) / row.envelope
        for row in rows
        if row.envelope and row.envelope_quartile_1 is not None
        and row.envelope_quartile_3 is not None
    ])  # fmt: skip
    return (
        f"The gains' fourth digits move an envelope by {100 * np.median(spread):.0f} % (median of "
        f"the quartiles' distances), by over 25 % in {np.mean(spread > 0.25):.0%} of the rows."
    )


def _placements(rows: Sequence[FigureRow]) -> Iterator[str]:
    """Give in words how far placement moves each figure's envelopes."""
    widths: dict[str, list[float]] = {}
    for row in rows:
        if row.group == "place" and row.envelope is not None:
            widths.setdefault(row.figure, []).append(MM * row.envelope)
    for figure, found in widths.items():
        yield f"Placement moves Figure {figure} from {min(found):.1f} to {max(found):.1f} mm."


def figures(result: ReconstructResult) -> Iterator[tuple[str, Figure]]:
    """Give envelopes by variant, and the distances of runs a hair apart."""
    yield "envelopes", envelope_figure(result.rows)
    yield "chaos", chaos_figure(result.apart)


@drawn
def envelope_figure(rows: Sequence[FigureRow]) -> Figure:
    """Return median envelopes with intervals and quartiles, a panel per figure of the paper."""
    names = list(dict.fromkeys(row.variant for row in rows))
    paper = {row.figure: MM * row.paper_simulation for row in rows}
    height = 30 + 5.2 * len(names)
    figure, ((*panels,),) = canvas(1, len(paper), height=height, sharey=True)
    for axes, (number, simulation) in zip(panels, paper.items(), strict=True):
        axes.axvline(simulation, color="0.55", linewidth=1.0, label="paper, simulation")
        for plant, shift in zip(PLANTS, (-0.17, 0.17), strict=True):
            mine = [row for row in rows if (row.figure, row.plant) == (number, plant)]
            _draw_plant(axes, mine, plant, shift, names)
        log_axis(axes.xaxis, most=4)
        axes.margins(x=0.12)
        axes.set(title=f"Figure {number}", xlabel="envelope [mm]")
    panels[0].plot([], [], color="0.4", linewidth=2.6, alpha=0.4, label="quartiles")
    panels[0].plot([], [], "|-", color="0.4", linewidth=0.9, label="95 % interval of the median")
    filled: dict[str, Any] = {"color": "0.4", "markerfacecolor": "white", "linestyle": "none"}
    panels[0].plot([], [], "o", **filled, label="some runs diverge")
    panels[0].plot([], [], "x", color="0.4", linestyle="none", label="most runs diverge")
    name_lines(panels[0], names)
    caption = (
        "Medians of the envelope's half-width by what is assumed, over runs whose gains differ in "
        "their fourth digits, beside the paper's."
    )
    return finish(figure, panels, legend=4, caption=caption)


def _draw_plant(
    axes: Any, rows: Sequence[FigureRow], plant: str, shift: float, names: list[str]
) -> None:
    """Draw one plant's medians and ends; a cross at the panel's edge where none is bounded."""
    marker, how = mark(plant)
    colour = how["color"]
    axes.plot([], [], marker, **how)
    for row in rows:
        height = names.index(row.variant) + shift
        if row.envelope is None:
            axes.plot(0.97, height, "x", color=colour, transform=axes.get_yaxis_transform())
            continue
        ends = MM * np.array([row.envelope_quartile_1, row.envelope_quartile_3], float)
        axes.plot(ends, [height, height], color=colour, linewidth=2.6, alpha=0.4)
        filled = colour if row.bounded_share == 1.0 else "white"
        sure = tuple(
            None if end is None else MM * end for end in (row.envelope_low, row.envelope_high)
        )
        look: dict[str, Any] = {"color": colour, "markerfacecolor": filled}
        interval(axes, MM * row.envelope, height, (sure[0], sure[1]), marker, **look)


@drawn
def chaos_figure(apart: Mapping[tuple[str, str], Array]) -> Figure:
    """Return the distance of two runs' joints (K,) [rad] over time, a panel per figure."""
    numbers = list(dict.fromkeys(number for number, _ in apart))
    figure, ((*panels,),) = canvas(1, len(numbers), height=62, sharey=True)
    for axes, number in zip(panels, numbers, strict=True):
        for plant in PLANTS:
            distance = np.maximum(apart[number, plant], LEAST)
            time = PERIOD * np.arange(len(distance), dtype=float)
            how = style(plant) | {"linewidth": 1.4 if plant == PLANTS[0] else 0.7}
            axes.plot(*thinned(time, distance), label=spoken(plant), **how)
        log_axis(axes.yaxis)
        axes.set(title=f"Figure {number}", xlabel="time [s]")
        axes.margins(x=0)
    panels[0].set_ylabel("distance of the joints [rad]")
    caption = "How far the joints of two runs a hair apart are from each other, over time."
    return finish(figure, panels, legend=2, caption=caption)
