"""The question of the integer PIDs in a table, words and a figure.

>>> question_figure(rows, "circle", run / "pid_question.png")      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich import box
from rich.table import Table

from flexsim.recording.traces import spoken
from studies.core.figures import DPI, FONT, finish, save

Rows = Sequence[Mapping[str, Any]]
Kind = tuple[str, str, str]  # order, realisation, range

PAPERS: Kind = ("integer", "truncated", "table-1")  # those that the paper found no stable ones of
CHANGES: dict[str, Kind] = {  # what is different from the paper's
    "as in the paper": PAPERS,
    "other order": ("fractional", "truncated", "table-1"),
    "other realisation": ("integer", "textbook", "table-1"),
    "other range": ("integer", "truncated", "log-uniform"),
    "other realisation and range": ("integer", "textbook", "log-uniform"),
}
COLOURS = {"table-1": "#0072B2", "log-uniform": "#E69F00"}  # Okabe and Ito
WIDTH = 16.0  # [in], 1600 px
BAR = 0.36
SCALE = 1e4  # the table's best indices are in 1e-4 m2 s


def kind(row: Mapping[str, Any]) -> Kind:
    """Return what distinguishes a row among those of its plant and setting."""
    return row["order"], row["realisation"], row["range"]


def places(rows: Rows) -> list[tuple[str, str]]:
    """Return the plants and settings of rows, each pair once."""
    return list(dict.fromkeys((row["plant"], row["setting"]) for row in rows))


def _percent(share: float) -> str:
    """Return a share in per cent; a small one is not rounded to none."""
    return f"{100 * share:.1f}" if 0 < share < 0.1 else f"{100 * share:.0f}"


def _index(index: float | None) -> str:
    return "-" if index is None else f"{SCALE * index:.3g}"


def table(rows: Rows) -> Table:
    """Return a row per case: shares in per cent, best index (5) in 1e-4 m2 s, budget."""
    grid = Table(box=box.SIMPLE_HEAD, padding=0)
    for heading in ("\norder", "\nrealisation", "\nrange"):
        grid.add_column(heading, no_wrap=True)
    for heading in (
        "stable\n% draws", "\n% runs", "best\nmedian", "\nleast", "\nmost", "evalu-\nations"
    ):  # fmt: skip
        grid.add_column(heading, justify="right", no_wrap=True)
    for plant, setting in places(rows):
        mine = [row for row in rows if (row["plant"], row["setting"]) == (plant, setting)]
        if grid.row_count:
            grid.add_row()
        grid.add_row(plant, setting, f"{mine[0]['seeds']} seeds")
        for row in mine:
            grid.add_row(
                *kind(row),
                _percent(row["stable_draws"]),
                _percent(row["stable_runs"]),
                *(_index(row[f"best_index{which}"]) for which in ("", "_least", "_most")),
                str(row["evaluations"]),
            )
    return grid


def changed(rows: Rows, what: Kind) -> tuple[float, float] | None:
    """Return the shares of stable draws and runs of one kind over all plants and settings."""
    mine = [row for row in rows if kind(row) == what]
    if not mine:
        return None
    shares = [[row["stable_draws"], row["stable_runs"]] for row in mine]
    draws, runs = np.mean(shares, axis=0).tolist()
    return draws, runs


def verdict(rows: Rows) -> str:
    """Return in words what becomes of the paper's integer PIDs when one thing is changed."""
    lines = ["Integer PIDs of the paper, one thing changed at a time, % stable, all plants:"]
    for name, what in CHANGES.items():
        shares = changed(rows, what)
        if shares is not None:
            draws, runs = map(_percent, shares)
            lines.append(f"  {name:<28}{draws:>5} of draws {runs:>5} of runs")
    return "\n".join(lines)


def question_figure(rows: Rows, trajectory: str, path: Path) -> None:
    """Write shares of stable draws (bars) and of runs (dots), and best indices with their range.

    Args:
        rows: of the study, one line of panels per plant and setting.
        trajectory: for the title.
        path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    where = places(rows)
    figure = Figure(figsize=(WIDTH, 1.5 + 2.7 * len(where)), dpi=DPI, layout="constrained")
    panels = figure.subplots(len(where), 2, squeeze=False, sharex="col")
    names = list(dict.fromkeys(kind(row)[:2] for row in rows))
    for (plant, setting), (shares, best) in zip(where, panels, strict=True):
        for row in rows:
            if (row["plant"], row["setting"]) != (plant, setting):
                continue
            side = -0.5 if row["range"] == "table-1" else 0.5
            height = names.index(kind(row)[:2]) + side * BAR
            colour = COLOURS[row["range"]]
            shares.barh(height, 100 * row["stable_draws"], BAR, color=colour, alpha=0.55)
            shares.plot(100 * row["stable_runs"], height, "o", color=colour, ms=11, clip_on=False)
            if row["best_index"] is None:
                best.text(0.01, height, "none stable", color=colour, size=FONT - 2, va="center",
                          transform=best.get_yaxis_transform())  # fmt: skip
                continue
            ends = [row["best_index_least"], row["best_index_most"]]
            best.plot(ends, [height] * 2, color=colour, linewidth=4, solid_capstyle="round")
            best.plot(row["best_index"], height, "o", color=colour, markersize=11)
        for axes in (shares, best):
            axes.set_ylim(len(names) - 0.5, -0.5)
            axes.set_yticks(range(len(names)), ["\n".join(name) for name in names])
        best.tick_params(labelleft=False)
        best.set_xscale("log")
        shares.set_xlim(0, 100)
        shares.set_title(f"{spoken(plant)}, {setting}", loc="left")
    panels[-1][0].set_xlabel("stable: bar of draws, dot of searches [%]")
    panels[-1][1].set_xlabel("best index, median and range over seeds [m² s]")
    for drawn, colour in COLOURS.items():
        panels[0][0].plot([], [], "s", color=colour, markersize=11, label=drawn)
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=FONT)
    figure.suptitle(f"which controllers hold the {trajectory}?", fontsize=FONT + 3)
    finish(figure, panels.ravel())
    save(figure, path)
