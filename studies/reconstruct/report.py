"""The reconstruction's study in words, tables and figures.

>>> envelope_figure(rows, run / "envelopes.png")      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich import box
from rich.table import Table

from flexsim.numerics.types import Array
from flexsim.recording.traces import spoken
from studies.core.figures import DPI, FONT, PLANT_MARKERS, STYLES, finish, save

Rows = Sequence[Mapping[str, Any]]

PLANTS = ("assumed-modes", "chain")
WIDTH = 16.0  # [in], 1600 px
LEAST = 1e-15  # [rad]; distances below are rounding


def _cell(row: Mapping[str, Any]) -> str:
    """Return a median in mm, or when all runs diverged, or the share that did not."""
    if row["bounded_share"] == 1.0:
        return f"{1e3 * row['envelope']:5.1f}"
    if row["bounded_share"] == 0.0:
        return f"†{row['diverged_at']:4.2f}"
    return f"{100 * row['bounded_share']:4.0f}%"


def misfit(rows: Rows) -> float | None:
    """Return the mean factor between envelopes and Table 3's, None where any run diverges."""
    if any(row["bounded_share"] < 1.0 for row in rows):
        return None
    logs = np.log([row["envelope"] / row["paper_simulation"] for row in rows])
    return float(np.exp(np.sqrt(np.mean(logs**2))))


def table(rows: Rows) -> Table:
    """Return a line per variant: both plants' median envelopes for Figures 3 to 6."""
    figures = list(dict.fromkeys(row["figure"] for row in rows))
    paper = {row["figure"]: 1e3 * row["paper_simulation"] for row in rows}
    grid = Table(box=box.SIMPLE_HEAD, padding=0)
    grid.add_column("variant\nTable 3", no_wrap=True)
    for figure in figures:
        grid.add_column(f"Figure {figure}\n{paper[figure]:.0f}", justify="right", no_wrap=True)
    grid.add_column(" off", justify="right", no_wrap=True)
    group = rows[0]["group"]
    for name in dict.fromkeys(row["variant"] for row in rows):
        mine = [row for row in rows if row["variant"] == name]
        if mine[0]["group"] != group:
            grid.add_row()
            group = mine[0]["group"]
        cells = [_cell(row) for row in mine]
        pairs = map("|".join, zip(cells[::2], cells[1::2], strict=True))
        factor = misfit(mine)
        grid.add_row(name, *pairs, "-" if factor is None else f"{factor:.2f}")
    return grid


def chaos_table(chaos: Rows) -> Table:
    """Return a line per variant and figure: growth, shares and kinds, assumed modes | chain."""
    grid = Table(box=box.SIMPLE_HEAD, padding=0)
    columns = [name for name in chaos[0] if name.startswith("apart_")]
    grid.add_column("variant, figure", no_wrap=True)
    grid.add_column("growth", justify="right", no_wrap=True)
    for column in columns:
        grid.add_column(column.removeprefix("apart_"), justify="right", no_wrap=True)
    grid.add_column("kind", justify="right", no_wrap=True)
    for modes, chain in zip(chaos[::2], chaos[1::2], strict=True):
        pair = (modes, chain)
        grid.add_row(
            f"{modes['variant']}, {modes['figure']}",
            "|".join(f"{row['amplification']:5.0e}" for row in pair),
            *("|".join(f"{100 * row[column]:3.0f}" for row in pair) for column in columns),
            "|".join(f"{row['kind']:>7}" for row in pair),
        )
    return grid


def units_table(units: Rows) -> Table:
    """Return Table 2's gains in seconds and in milliseconds, in deviations of Table 1."""
    grid = Table(box=box.SIMPLE_HEAD)
    for heading in ("figure", "gain", "order", "with s", "deviations", "with ms", "deviations"):
        grid.add_column(heading, justify="right")
    for row in units:
        if row["seconds"] == 0.0:
            continue
        grid.add_row(
            row["figure"],
            row["gain"],
            f"{row['order']:g}",
            f"{row['seconds']:.4g}",
            f"{row['deviations_seconds']:+.3g}",
            f"{row['milliseconds']:.4g}",
            f"{row['deviations_milliseconds']:+.3g}",
        )
    return grid


def verdict(rows: Rows, chaos: Rows) -> str:
    """Return in words which variants stay bounded, and how wide the placement's effect is."""
    names = list(dict.fromkeys(row["variant"] for row in rows))
    shares = {n: [row["bounded_share"] for row in rows if row["variant"] == n] for n in names}
    held = sum(min(share) == 1.0 for share in shares.values())
    lost = [name for name, share in shares.items() if max(share) == 0.0]
    lines = [
        f"{held} of {len(names)} variants keep every run bounded, in all figures on both plants.",
        f"Nothing stays bounded with: {', '.join(lost) or 'none of them'}.",
    ]
    factors = {n: misfit([row for row in rows if row["variant"] == n]) for n in names}
    nearest = sorted((factor, name) for name, factor in factors.items() if factor is not None)
    if nearest:
        lines.append(f"Nearest to Table 3: {nearest[0][1]}, off by a factor {nearest[0][0]:.2f}.")
    kept = [row for row in rows if row["envelope"]]
    spread = [
        (row["envelope_quartile_3"] - row["envelope_quartile_1"]) / row["envelope"] for row in kept
    ]
    lines.append(
        "The gains' fourth digits move an envelope by "
        f"{100 * np.median(spread):.0f} % (median of the quartiles' distances), "
        f"by over 25 % in {np.mean(np.array(spread) > 0.25):.0%} of the rows."
    )
    placed = [row for row in rows if row["group"] == "place" and row["envelope"] is not None]
    for figure in dict.fromkeys(row["figure"] for row in placed):
        widths = [1e3 * row["envelope"] for row in placed if row["figure"] == figure]
        lines.append(
            f"Placement moves Figure {figure} from {min(widths):.1f} to {max(widths):.1f} mm."
        )
    kinds = [row["kind"] for row in chaos]
    counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
    lines.append(f"Of {len(kinds)} motions looked at closely: {counts}.")
    return "\n".join(lines)


def envelope_figure(rows: Rows, path: Path) -> None:
    """Write median envelopes with quartiles, a panel per figure of the paper, a line per variant.

    Args:
        rows: of the study. path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    names = list(dict.fromkeys(row["variant"] for row in rows))
    figures = list(dict.fromkeys(row["figure"] for row in rows))
    figure = Figure(figsize=(WIDTH, 2.0 + 0.32 * len(names)), dpi=DPI, layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(figures), sharey=True))
    for axes, number in zip(panels, figures, strict=True):
        mine = [row for row in rows if row["figure"] == number]
        axes.axvline(1e3 * mine[0]["paper_simulation"], color="0.55", label="paper, simulation")
        for plant, shift in zip(PLANTS, (-0.15, 0.15), strict=True):
            _draw_plant(axes, [row for row in mine if row["plant"] == plant], plant, shift, names)
        axes.set_xscale("log")
        axes.set(title=f"Figure {number}", xlabel="envelope [mm]")
        for formatter in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
            formatter(lambda value, _: f"{value:g}" if f"{value:g}"[0] in "125" else "")
    panels[0].set_yticks(range(len(names)), names)
    panels[0].set_ylim(len(names) - 0.5, -0.5)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=FONT)
    finish(figure, panels)
    save(figure, path)


def _draw_plant(axes: Any, rows: Rows, plant: str, shift: float, names: list[str]) -> None:
    """Draw one plant's medians and quartiles; a cross at the panel's edge where none is bounded."""
    colour, marker = STYLES[plant]["color"], PLANT_MARKERS[plant]
    axes.plot([], [], marker, color=colour, label=spoken(plant))
    for row in rows:
        height = names.index(row["variant"]) + shift
        if row["envelope"] is None:
            axes.plot(0.985, height, "x", color=colour, transform=axes.get_yaxis_transform())
            continue
        ends = [1e3 * row["envelope_quartile_1"], 1e3 * row["envelope_quartile_3"]]
        axes.plot(ends, [height, height], color=colour, linewidth=3, alpha=0.6)
        filled = colour if row["bounded_share"] == 1.0 else "white"
        axes.plot(1e3 * row["envelope"], height, marker, color=colour, markerfacecolor=filled)


def chaos_figure(apart: Mapping[tuple[str, str], Array], period: float, path: Path) -> None:
    """Write the distance of two runs' joints over time, a panel per figure of the paper.

    Args:
        apart: (K,) [rad] by figure and plant; period: of the samples [s].
        path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    figures = list(dict.fromkeys(number for number, _ in apart))
    figure = Figure(figsize=(WIDTH, 6.0), dpi=DPI, layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(figures), sharey=True))
    for axes, number in zip(panels, figures, strict=True):
        for plant in PLANTS:
            distance = np.maximum(apart[number, plant], LEAST)
            time = period * np.arange(len(distance))
            style = STYLES[plant] | {"linewidth": 1.2}
            axes.semilogy(time, distance, label=spoken(plant), **style)
        axes.set(title=f"Figure {number}", xlabel="time [s]")
    panels[0].set_ylabel("distance of the joints [rad]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=FONT)
    finish(figure, panels)
    save(figure, path)
