"""The study of screened draws in words, a table and a figure.

>>> screening_figure(rows, target, "circle", run / "screening.png")      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich import box
from rich.table import Table

from flexsim.numerics.types import Array
from studies.core.figures import DPI, FONT, finish, save

Rows = Sequence[Mapping[str, Any]]

SIZE = (16.0, 8.0)  # [in], 1600 px wide
COLOURS = {False: "#E69F00", True: "#0072B2"}  # Okabe and Ito's, by whether draws are screened
NAMES = {False: "plain", True: "screened"}
HEADINGS = (
    "first\nstable",
    "target\nruns",
    "\ns",
    "best\nindex",
    "candi-\ndates",
    "screen\ns",
    "in all\ns",
)


def _cell(value: float | None, form: str) -> str:
    return "-" if value is None or not math.isfinite(value) else format(value, form)


def screening_table(rows: Rows) -> Table:
    """Return the rows as a table for the terminal, seed by seed, plain above screened."""
    grid = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("seed", "draws"):
        grid.add_column(heading, no_wrap=True)
    for heading in HEADINGS:
        grid.add_column(heading, justify="right", no_wrap=True)
    for each in rows:
        grid.add_row(
            "" if each["screen"] else str(each["seed"]),
            NAMES[bool(each["screen"])],
            f"{100 * each['stable_first']:.0f} %",
            _cell(each["simulations_to_target"], "d"),
            _cell(each["seconds_to_target"], ".1f"),
            _cell(1e4 * each["best_index"], ".4g"),
            str(each["candidates"]) if each["screen"] else "",
            f"{each['seconds_screening']:.1f}" if each["screen"] else "",
            f"{each['seconds']:.1f}",
        )
    return grid


def median_to_target(rows: Rows, screen: bool, cost: str) -> float:
    """Return the median over seeds of a cost until the target, inf if most never reach it.

    Args:
        rows: of the study. screen: of the screened searches or the plain ones.
        cost: 'simulations' or 'seconds'.
    """
    costs = [row[f"{cost}_to_target"] for row in rows if bool(row["screen"]) == screen]
    return float(np.median([math.inf if each is None else each for each in costs]))


def verdict(rows: Rows) -> str:
    """Return what screening saves, or that it does not, in simulations and in seconds."""
    said = []
    for cost in ("simulations", "seconds"):
        plain, other = (median_to_target(rows, screen, cost) for screen in (False, True))
        if math.isfinite(plain) and math.isfinite(other):
            share = 1 - other / plain
            what = f"{100 * abs(share):.0f} % {'fewer' if share >= 0 else 'more'}"
            said.append(f"{what} {cost} ({plain:.4g} without, {other:.4g} with it)")
        else:
            fate = [f"{x:.4g}" if math.isfinite(x) else "unreached" for x in (plain, other)]
            said.append(f"{cost} {fate[0]} without, {fate[1]} with it")
    ends = {
        screen: [row["best_index"] for row in rows if bool(row["screen"]) == screen]
        for screen in (False, True)
    }
    better = sum(new < old for old, new in zip(ends[False], ends[True], strict=True))
    return (
        f"Screening, until the target, medians: {'; '.join(said)}. At the end, after equal "
        f"simulations, it is better for {better} of {len(ends[False])} seeds."
    )


def _bests(rows: Rows, screen: bool) -> tuple[Array, Array]:
    """Return simulations (G,) and best indices (seeds, G) of the plain or the screened searches."""
    mine = [row for row in rows if bool(row["screen"]) == screen]
    seeds = dict.fromkeys(row["seed"] for row in mine)
    first = [row["simulations"] for row in mine if row["seed"] == mine[0]["seed"]]
    best = [[row["best"] for row in mine if row["seed"] == seed] for seed in seeds]
    return np.array(first, dtype=float), np.array(best, dtype=float)


def screening_figure(rows: Rows, target: float, title: str, path: Path) -> None:
    """Write the best index so far against simulations: median and range over seeds.

    Args:
        rows: one per search and generation. target: index that counts as equal result [m2 s].
        title: of the figure.
        path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    axes = figure.subplots()
    held = [row["best"] for row in rows if math.isfinite(row["best"])]
    for screen, colour in COLOURS.items():
        simulations, best = _bests(rows, screen)
        shown = np.where(np.isfinite(best), best, np.nan)
        middle = np.median(best, axis=0)
        top = np.where(np.isfinite(best).all(axis=0), best.max(axis=0), max(held, default=1.0))
        some = np.isfinite(best).any(axis=0)
        low = np.array([np.nanmin(column) for column in shown.T[some]])
        axes.fill_between(simulations[some], low, top[some], color=colour, alpha=0.2, linewidth=0)
        axes.plot(simulations, np.where(np.isfinite(middle), middle, np.nan), color=colour,
                  linewidth=2.6, label=f"{NAMES[screen]}: median and range")  # fmt: skip
    if math.isfinite(target):
        axes.axhline(target, color="0.4", linestyle="--", label="target: median the plain end with")
    if held:
        axes.set_yscale("log")
    axes.set(xlabel="simulations", ylabel="best index (5) so far [m² s]", title=title)
    axes.legend(fontsize=FONT, frameon=False)
    finish(figure, [axes])
    save(figure, path)
