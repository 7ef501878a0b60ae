"""Tables 2 and 3 and Figure 6 anew: tables in mm, a verdict, and two figures.

>>> transfer_figure(rows, run / "transfer.png")      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, NullLocator
from rich import box
from rich.console import Console
from rich.table import Table

from flexsim.recording.traces import MM, spoken
from studies.core.figures import DPI, FONT, PAPER_MARKERS, STYLES, finish, paper_envelopes, save
from studies.tuning.distributions import NAMES

Row = Mapping[str, Any]
Rows = Sequence[Row]
Cases = Sequence[tuple[str, str]]  # trajectory, controllers tuned for

SHOWN = ("envelope", "rms_error", "max_v", "residual_v")  # in the table
PLANTS = ("assumed-modes", "chain")
COLOURS = {plant: STYLES[plant]["color"] for plant in PLANTS} | {"both": "#009E73"}  # tuned on
MARKERS = {"assumed-modes": "o", "chain": "s", "both": "D"}
FRAME: dict[str, Any] = {"fill": False, "edgecolor": "#D55E00", "linewidth": 3}
WIDTH = 16.0  # [in], 1600 px
SPACING = 0.2  # of markers of one case, the paper's the lowest
PALE = 0.55  # of the colour map, where letters turn from white to black
SCALE = 1e4  # the table's indices are in 1e-4 m2 s


def distinct(rows: Rows, key: str) -> list[str]:
    """Return what rows have under a key, each once, in their order."""
    return list(dict.fromkeys(row[key] for row in rows))


def case_name(path: str, devised: str) -> str:
    """Return 'line', or 'line by two-loop' for a controller tuned for another trajectory."""
    return path if path == devised else f"{path} by {devised}"


def lookup(rows: Rows) -> Callable[[str, str, str, str], Row]:
    """Return a function from tuned on, tuned for, run on and trajectory to the row."""
    keys = ("tuned_on", "tuned_for", "run_on", "trajectory")
    table = {tuple(row[key] for key in keys): row for row in rows}
    return lambda *names: table[names]


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{MM * value:.1f}"


def _pair(rows: Rows, name: str) -> str:
    """Return one figure of both plants in mm."""
    return " | ".join("div" if row["diverged"] else _mm(row[name]) for row in rows)


def _grid(title: str, texts: Sequence[str], numbers: Sequence[str]) -> Table:
    """Return an empty table with columns of text, then columns of numbers."""
    grid = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in texts:
        grid.add_column(heading, no_wrap=True)
    for heading in numbers:
        grid.add_column(heading, justify="right", no_wrap=True)
    return grid


def table_3(rows: Rows, ratios: Rows) -> Table:
    """Return envelopes, errors and v of Figures 3 to 6's cases, in mm, the paper's above ours."""
    grid = _grid(
        "Table 3 and Figure 6 anew", ["tuned on"], [name.replace("_", " ") for name in SHOWN]
    )
    row_of, plants = lookup(rows), distinct(rows, "run_on")
    for case in (row for row in ratios if row["tuned_on"] == ratios[0]["tuned_on"]):
        path, devised = case["trajectory"], case["tuned_for"]
        paper = f"{_mm(case['paper_simulation'])} | {_mm(case['paper_laboratory'])}"
        grid.add_row(case_name(path, devised), f"[dim]paper[/dim] {paper}")
        for tuned_on in distinct(rows, "tuned_on"):
            mine = [row_of(tuned_on, devised, plant, path) for plant in plants]
            grid.add_row(f"  {spoken(tuned_on)}", *(_pair(mine, name) for name in SHOWN))
    return grid


def transfer_table(rows: Rows) -> Table:
    """Return the envelope of every controller on every trajectory, in mm."""
    paths = distinct(rows, "trajectory")
    grid = _grid("Every controller on every trajectory: envelope", ["tuned for", "on"], paths)
    row_of, plants = lookup(rows), distinct(rows, "run_on")
    for devised in distinct(rows, "tuned_for"):
        for i, tuned_on in enumerate(distinct(rows, "tuned_on")):
            mine = ([row_of(tuned_on, devised, plant, path) for plant in plants] for path in paths)
            cells = (_pair(both, "envelope") for both in mine)
            grid.add_row("" if i else devised, spoken(tuned_on), *cells)
    return grid


def direction(row: Row) -> str:
    """Return in words whose envelope a ratio has over whose."""
    pair = (row["to_plant"], row["from_plant"])
    return " / ".join(spoken(plant).removeprefix("assumed ") for plant in pair)


def ratio_table(ratios: Rows) -> Table:
    """Return the envelopes' ratios, a line per case and a column per plant tuned on."""
    columns = [
        [row for row in ratios if row["tuned_on"] == on] for on in distinct(ratios, "tuned_on")
    ]
    heads = [f"{spoken(mine[0]['tuned_on'])}\n{direction(mine[0])}" for mine in columns]
    title = "Deterioration: ratio of envelopes from plant to plant"
    grid = _grid(title, ["tuned on"], [*heads, "paper\nlab / sim"])
    for case in zip(*columns, strict=True):
        cells = ["-" if row["ratio"] is None else f"{row['ratio']:.2f}" for row in case]
        paper = case[0]["paper_ratio"]
        name = case_name(case[0]["trajectory"], case[0]["tuned_for"])
        grid.add_row(name, *cells, "-" if paper is None else f"{paper:.1f}")
    return grid


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.0f}" if abs(value) >= 1e3 else f"{value:.3g}"


def table_2(controllers: Rows) -> Table:
    """Return the tuned parameters in Table 1's units, joint 1 above joint 2, and index (5)."""
    title = "Table 2 anew: gains in N m ms^nu/rad, index in 1e-4 m2 s"
    half = len(NAMES) // 2
    heads = [f"{one}\n{two}" for one, two in zip(NAMES[:half], NAMES[half:], strict=True)]
    grid = _grid(title, ["controllers"], [*heads, "index"])
    for row in controllers:
        index = "none" if row["index"] is None else f"{SCALE * row['index']:.3g}"
        joints = [[_number(row[name]) for name in part] for part in (NAMES[:half], NAMES[half:])]
        grid.add_row(f"{row['tuned_for']}, {spoken(row['tuned_on'])}", *joints[0], index)
        grid.add_row(f"  {row['generations']} generations", *joints[1])
    return grid


def _range(values: Sequence[float | None]) -> str:
    known = [value for value in values if value is not None]
    lost = f", {len(values) - len(known)} of {len(values)} diverged"
    spread = f"{min(known):.2f} to {max(known):.2f}" if known else "none"
    return spread + (lost if len(known) < len(values) else "")


def verdict(rows: Rows, ratios: Rows) -> str:
    """Return in words how many runs hold, and what leaving the plant tuned on costs."""
    own = [row for row in rows if row["tuned_for"] == row["trajectory"]]
    held, held_own = (sum(not row["diverged"] for row in these) for these in (rows, own))
    held_all = f"{held} of {len(rows)} runs hold, {held_own} of {len(own)} on their own trajectory."
    lines = [held_all, "Ratios of envelopes:"]
    for tuned_on in distinct(ratios, "tuned_on"):
        mine = [row for row in ratios if row["tuned_on"] == tuned_on]
        name = f"tuned on {spoken(tuned_on)}, {direction(mine[0])}"
        lines.append(f"  {name:<40}{_range([row['ratio'] for row in mine])}")
    paper = _range([row["paper_ratio"] for row in mine])
    return "\n".join([*lines, f"  {'the paper, laboratory / simulation':<40}{paper}"])


def print_report(rows: Rows, controllers: Rows, ratios: Rows) -> None:
    """Print the four tables and the verdict."""
    console = Console(highlight=False)
    plants = " | ".join(spoken(plant) for plant in distinct(rows, "run_on"))
    console.print(
        f"In mm, run on {plants}; the paper's: simulation | laboratory.\n"
        "Medians over runs whose gains differ in their fourth digits; div: diverged.\n",
        soft_wrap=True,
    )
    shown = table_3(rows, ratios), transfer_table(rows), ratio_table(ratios), table_2(controllers)
    console.print(*shown, sep="\n")
    console.print(verdict(rows, ratios), soft_wrap=True)


def _draw_case(axes: Axes, row: Row, height: float) -> None:
    """Draw one envelope with its number [mm], or a note that it diverged."""
    colour, marker = COLOURS[row["tuned_on"]], MARKERS[row["tuned_on"]]
    if row["diverged"]:
        axes.text(0.99, height, "diverged", color=colour, size=FONT - 2, va="center", ha="right",
                  transform=axes.get_yaxis_transform())  # fmt: skip
        return
    value = MM * row["envelope"]
    axes.plot(value, height, marker, color=colour, markersize=10, zorder=3)
    axes.annotate(f"{value:.1f}", (value, height), (9, 0), textcoords="offset points",
                  color="0.25", size=FONT - 3, va="center")  # fmt: skip


def _label_envelopes(panels: Sequence[Axes], cases: Cases) -> None:
    """Name the cases, and give the common axis its ticks."""
    panels[0].set_yticks(range(len(cases)), [case_name(*case) for case in cases])
    panels[0].set_ylim(len(cases) - 0.5, -0.5)
    panels[0].set_xscale("log")
    panels[0].margins(x=0.12)
    for axes, (paper, _) in zip(panels, PAPER_MARKERS, strict=False):
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("half-width of the envelope around the reference [mm]")
        axes.set_title(f"{axes.get_title()}   (black: {paper})")


def envelope_figure(rows: Rows, cases: Cases, path: Path) -> None:
    """Write the envelopes of Figures 3 to 6's cases, a panel per plant, beside the paper's.

    Args:
        rows: of the study. cases: trajectory and what the controllers were tuned for.
        path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    figure = Figure(figsize=(WIDTH, 2.0 + 1.3 * len(cases)), dpi=DPI, layout="constrained")
    plants, tuned_ons = distinct(rows, "run_on"), distinct(rows, "tuned_on")
    panels = figure.subplots(1, len(plants), sharex=True, sharey=True)
    row_of = lookup(rows)
    for axes, plant, which, (_, marker) in zip(panels, plants, (0, 1), PAPER_MARKERS, strict=True):
        axes.set_title(f"run on the {spoken(plant)}")
        for k, (trajectory, devised) in enumerate(cases):
            for i, tuned_on in enumerate(tuned_ons):
                height = k + SPACING * (i - len(tuned_ons) / 2)
                _draw_case(axes, row_of(tuned_on, devised, plant, trajectory), height)
            paper = paper_envelopes(trajectory, devised)
            if paper:
                height = k + SPACING * len(tuned_ons) / 2
                axes.plot(MM * paper[which], height, marker, color="0.15", ms=13, mew=2.5)
    for tuned_on in tuned_ons:
        style = {"color": COLOURS[tuned_on], "markersize": 10}
        panels[0].plot([], [], MARKERS[tuned_on], label=f"tuned on {spoken(tuned_on)}", **style)
    for label, marker in PAPER_MARKERS:
        panels[0].plot([], [], marker, color="0.15", ms=13, mew=2.5, label=label)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=FONT)
    _label_envelopes(panels, cases)
    finish(figure, panels)
    save(figure, path)


def _heat(axes: Axes, rows: Rows, colours: LogNorm) -> AxesImage:
    """Draw the envelopes [mm] of one plant, controllers down and trajectories across."""
    paths = distinct(rows, "trajectory")
    tuned_ons = distinct(rows, "tuned_on")
    names = [(tuned_for, tuned_on) for tuned_for in paths for tuned_on in tuned_ons]
    values = np.full((len(names), len(paths)), np.nan)
    for row in rows:
        place = names.index((row["tuned_for"], row["tuned_on"])), paths.index(row["trajectory"])
        if not row["diverged"]:
            values[place] = MM * row["envelope"]
    image = axes.imshow(np.ma.masked_invalid(values), cmap="viridis_r", norm=colours, aspect="auto")
    axes.set_facecolor("0.85")
    for (i, j), value in np.ndenumerate(values):
        known = np.isfinite(value)
        colour = "white" if known and colours(value) > PALE else "black"
        text = f"{value:.1f}" if known else "diverged"
        axes.text(j, i, text, color=colour, size=FONT, ha="center", va="center")
        if names[i][0] == paths[j]:
            axes.add_patch(Rectangle((j - 0.48, i - 0.46), 0.96, 0.92, **FRAME))
    axes.set_xticks(range(len(paths)), [f"on the {name}" for name in paths])
    axes.set_yticks(range(len(names)), [f"for the {a}, on {spoken(b)}" for a, b in names])
    return image


def transfer_figure(rows: Rows, path: Path) -> None:
    """Write the transfer matrix: the envelope of every controller on every trajectory, in mm.

    Args:
        rows: of the study, a panel per plant run on.
        path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    held = [MM * row["envelope"] for row in rows if not row["diverged"]]
    colours = LogNorm(min(held, default=1.0), max(held, default=10.0))
    figure = Figure(figsize=(WIDTH, 7.5), dpi=DPI, layout="constrained")
    plants = distinct(rows, "run_on")
    panels = figure.subplots(1, len(plants), sharey=True)
    for axes, plant in zip(panels, plants, strict=True):
        image = _heat(axes, [row for row in rows if row["run_on"] == plant], colours)
        axes.set_title(f"run on the {spoken(plant)}")
    panels[0].set_ylabel("controllers tuned")
    finish(figure, panels)
    for axes in panels:
        axes.grid(False)
        axes.tick_params(length=0)
    ticks = LogLocator(subs=(1, 2, 5))
    bar = figure.colorbar(image, ax=panels, ticks=ticks, format="%g")
    bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.set_label("half-width of the envelope [mm]", size=FONT)
    figure.suptitle("every controller on every trajectory; framed: tuned for it", fontsize=FONT + 3)
    save(figure, path)
