"""The misprints' study in words, table and figures.

>>> energy_figure({"all": change}, "bent", 1e-3, run / "energy.png")      # doctest: +SKIP
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
from flexsim.plants.printed import MISPRINTS
from studies.core.figures import DPI, FONT, finish, save

SIZE = (16.0, 8.0)  # [in], 1600 px wide
COLOURS = ("#999999", "#0072B2", "#E69F00", "#009E73", "#D55E00", "#000000")  # Okabe and Ito
MARKERS = "osD^vX"
SMALLEST = 1e-12  # relative; below this an energy change is rounding
UM = 1e6  # micrometres per metre
DRIFTS = ("brisk", "bent")  # free motions in the table
LEGEND = """\
energy  largest relative change in 2 s of free, undamped motion
tip     rms to the chain's tip, open loop, worst pose; small and large torques
env.    envelope in closed loop, worst trajectory; friction none and (47)
apart   rms to the consistent model's run; for none: to a run whose gains differ
        in the fourth digit, that is, what chance does
-       as printed, the ranges of (39)-(41) make H singular: nothing can be run
"""


def costliest(rows: Sequence[dict[str, Any]], column: str) -> str:
    """Return the single misprint with the largest figure in a column."""
    single = [row for row in rows if row["misprint"] in MISPRINTS]
    return str(max(single, key=lambda row: row[column])["misprint"])


def verdict(rows: Sequence[dict[str, Any]]) -> str:
    """Return in words which misprint costs most, and whether that shows above chance."""
    column = "loop_to_consistent_print"
    chance = next(row[column] for row in rows if row["misprint"] == "none")
    together = next(row[column] for row in rows if row["misprint"] == "all")
    return (
        f"Costliest in energy: {costliest(rows, 'drift_brisk')}, from a bent beam "
        f"{costliest(rows, 'drift_bent')};\nat the driven tip: "
        f"{costliest(rows, 'tip_to_consistent_small')}, with large torques "
        f"{costliest(rows, 'tip_to_consistent_large')};\nin the frictionless loop: "
        f"{costliest(rows, 'loop_to_consistent_none')}. Under (47) chance sets runs "
        f"{1e3 * chance:.1f} mm apart,\nall misprints together {1e3 * together:.1f} mm."
    )


def table(rows: Sequence[dict[str, Any]]) -> Table:
    """Return a row per misprint: drifts, tips [um], loops [mm]."""
    grid = Table(box=box.SIMPLE_HEAD, padding=0)
    grid.add_column("\nmisprint", no_wrap=True)
    for heading in (
        "energy\nbrisk", "\nbent", "tip µm\nsmall", "\nlarge",
        "env. mm\nnone", "\nprint", "apart mm\nnone", "\nprint",
    ):  # fmt: skip
        grid.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        if row["drift_brisk"] is None:
            grid.add_row(str(row["misprint"]), *["-"] * 8)
            continue
        cells = [f"{row[f'drift_{start}']:.0e}" for start in DRIFTS]
        cells += [f"{1e6 * row[f'tip_to_chain_{name}']:.1f}" for name in ("small", "large")]
        cells += [f"{1e3 * row[f'envelope_{name}']:.2f}" for name in ("none", "print")]
        cells += [f"{1e3 * row[f'loop_to_consistent_{name}']:.3f}" for name in ("none", "print")]
        grid.add_row(row["misprint"], *cells)
    return grid


def energy_figure(energy: Mapping[str, Array], start: str, period: float, path: Path) -> None:
    """Write the relative change of energy over time, a curve per variant, on a log axis.

    Args:
        energy: (K,) relative change by variant; start: of the motion, in words.
        period: of the samples [s].
        path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    widths = np.linspace(4.0, 1.2, len(energy))  # what is drawn first shows as a rim
    for (name, change), colour, width in zip(energy.items(), COLOURS, widths, strict=True):
        time = period * np.arange(1, len(change))
        shown = np.maximum(np.abs(change[1:]), SMALLEST)
        axes.semilogy(time, shown, color=colour, linewidth=width, label=name)
    axes.set(xlabel="time [s]", ylabel="|energy / initial energy - 1|")
    axes.set_title(f"free, undamped motion, {start}")
    axes.margins(x=0)
    figure.legend(loc="outside lower center", ncols=len(energy), fontsize=FONT)
    finish(figure, [axes])
    save(figure, path)


def tip_figure(details: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write the rms tip difference to the chain over theta2, a panel per amplitude.

    Args:
        details: rows with misprint, case ('torques ...'), theta2 [rad] and tip_to_chain [m].
        path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    cases = dict.fromkeys(row["case"] for row in details if row["case"].startswith("torques"))
    names = list(dict.fromkeys(row["misprint"] for row in details))
    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(cases)))
    for axes, case in zip(panels, cases, strict=True):
        for name, colour, marker in zip(names, COLOURS, MARKERS, strict=True):
            mine = [row for row in details if row["case"] == case and row["misprint"] == name]
            pose = [row["theta2"] for row in mine]
            tip = [UM * row["tip_to_chain"] for row in mine]
            axes.semilogy(pose, tip, marker=marker, color=colour, linewidth=1.6, label=name)
        axes.set(xlabel="theta2 at the start [rad]", ylabel="tip to the chain's, rms [µm]")
        axes.set_title(f"open loop, {case}")
        for axis in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
            axis(lambda value, _: f"{value:g}")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(names), fontsize=FONT)
    finish(figure, panels)
    save(figure, path)
