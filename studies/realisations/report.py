"""The realisations' study in words, tables and figures.

>>> loop_figure(rows, "loop", run / "loop.png")      # doctest: +SKIP
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

from controllers import operator, response_error
from flexsim.numerics.types import Array
from flexsim.recording.traces import spoken
from studies.core.figures import DPI, FONT, PLANT_MARKERS, STYLES, finish, save

Rows = Sequence[Mapping[str, Any]]

RETAINED = ("tustin", 10)  # (2) with the p of section 3.2
DRAWN_ORDER = 0.5
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#000000")  # Okabe and Ito
DASHES = ("-", "--", "-.", ":")
WIDTH = 16.0  # [in], 1600 px


def _chosen(rows: Rows, part: str) -> list[tuple[str, int]]:
    """Return realisations with terms in the order of the rows of a part."""
    pairs = ((row["realisation"], row["terms"]) for row in rows if row["part"] == part)
    return list(dict.fromkeys(pairs))


def _of(rows: Rows, part: str, chosen: tuple[str, int]) -> list[Mapping[str, Any]]:
    return [
        row for row in rows if (row["part"], row["realisation"], row["terms"]) == (part, *chosen)
    ]


def response_table(rows: Rows) -> Table:
    """Return the errors' rms and largest of all orders and frequencies, and the cost."""
    grid = Table(box=box.SIMPLE_HEAD)
    grid.add_column("realisation", no_wrap=True)
    for heading in ("terms", "dB rms", "dB max", "deg rms", "deg max", "ns"):
        grid.add_column(heading, justify="right", no_wrap=True)
    last = None
    for chosen in _chosen(rows, "response"):
        mine = _of(rows, "response", chosen)
        if last not in (None, chosen[0]):
            grid.add_row()
        cells = []
        for name in ("magnitude", "phase"):
            unit = "db" if name == "magnitude" else "deg"
            mean_square = np.mean([row[f"{name}_rms_{unit}"] ** 2 for row in mine])
            largest = max(row[f"{name}_max_{unit}"] for row in mine)
            cells += [f"{math.sqrt(mean_square):.2f}", f"{largest:.1f}"]
        grid.add_row(
            chosen[0] if chosen[0] != last else "",
            str(chosen[1]),
            *cells,
            f"{mine[0]['cost_ns']:.0f}",
        )
        last = chosen[0]
    return grid


def _index(rows: Rows) -> float | None:
    """Return the median index (5) of rows [m2 s], None if a controller could not be built."""
    indices = [row["index"] for row in rows]
    return None if None in indices else float(np.median(indices))


def _cell(rows: Rows) -> str:
    """Return the median index of rows in 1e-4 m2 s, or what became of the loops."""
    index = _index(rows)
    if index is None:
        return "-"
    return f"{1e4 * index:.3g}" if math.isfinite(index) else "div"


def _by_case(rows: Rows) -> dict[tuple[str, str], list[Mapping[str, Any]]]:
    """Return rows by trajectory and plant; there is one per search."""
    cases: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        cases.setdefault((row["trajectory"], row["plant"]), []).append(row)
    return cases


def loop_table(rows: Rows, part: str) -> Table:
    """Return the median index (5) of every realisation, for the rows of a part."""
    paths = list(dict.fromkeys(row["trajectory"] for row in rows if row["part"] == part))
    grid = Table(box=box.SIMPLE_HEAD)
    grid.add_column("realisation", no_wrap=True)
    grid.add_column("terms", justify="right", no_wrap=True)
    for heading in (*paths, "to (2)"):
        grid.add_column(heading, justify="right", no_wrap=True)
    last = None
    for chosen in _chosen(rows, part):
        mine = _of(rows, part, chosen)
        if last not in (None, chosen[0]):
            grid.add_row()
        cases = _by_case(mine)
        cells = [
            "|".join(_cell(cases[case]) for case in cases if case[0] == path) for path in paths
        ]
        factor = relative_index(rows, part, chosen)
        shown = f"{factor:.2f}" if math.isfinite(factor) else "-"
        grid.add_row(chosen[0] if chosen[0] != last else "", str(chosen[1]), *cells, shown)
        last = chosen[0]
    return grid


def relative_index(rows: Rows, part: str, chosen: tuple[str, int]) -> float:
    """Return the geometric mean of the indices over that of (2) with ten terms, inf if any fails.

    Args:
        rows: of the study; part: of them; chosen: realisation and terms.
    """

    def logs(pair: tuple[str, int]) -> list[float]:
        values = [_index(case) for case in _by_case(_of(rows, part, pair)).values()]
        return [math.inf if value is None else math.log(value) for value in values]

    return float(np.exp(np.mean(logs(chosen)) - np.mean(logs(RETAINED))))


def verdict(rows: Rows) -> str:
    """Return in words whether (2) is the best, with the gains as they are and rescaled."""
    lines = []
    for part, gains in (("loop", "the same gains"), ("retuned", "gains tuned anew")):
        factors = {pair: relative_index(rows, part, pair) for pair in _chosen(rows, part)}
        held = sum(map(math.isfinite, factors.values()))
        better = sorted((factor, pair) for pair, factor in factors.items() if factor < 1)
        text = f"With {gains} {held} of {len(factors)} hold everywhere, "
        if better:
            factor, (name, terms) = better[0]
            text += f"{len(better)} with a lower index than (2) with ten terms; lowest {name}, "
            text += f"{terms} terms, {factor:.2f} of it."
        else:
            text += "none with a lower index than (2) with ten terms."
        lines.append(text)
    retuned = [row for row in rows if row["part"] == "retuned"]
    searches = [_of(retuned, "retuned", pair) for pair in _chosen(retuned, "retuned")]
    ratios = [ratio for mine in searches for ratio in _spreads(mine)]
    if ratios:
        spread = math.exp(np.mean(np.log(ratios)))
        lines.append(
            f"The worst of a realisation's searches is {spread:.2f} times its best (mean)."
        )
    return "\n".join(lines)


def _spreads(rows: Rows) -> list[float]:
    """Return the largest over the least index of each case's searches, where all held."""
    cases = [[row["index"] for row in case] for case in _by_case(rows).values()]
    return [max(case) / min(case) for case in cases if None not in case and max(case) < math.inf]


def response_figure(
    chosen: Sequence[tuple[str, int]], omega: Array, period: float, path: Path
) -> None:
    """Write magnitude and phase errors over frequency at order 0.5.

    Args:
        chosen: realisations and terms. omega: (n,) [rad/s]; period: [s].
        path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    names = list(dict.fromkeys(name for name, _ in chosen))
    figure = Figure(figsize=(WIDTH, 10.0), dpi=DPI, layout="constrained")
    panels = figure.subplots(2, len(names), sharex=True, sharey="row", squeeze=False)
    for column, name, colour in zip(panels.T, names, COLOURS, strict=False):
        lengths = [terms for each, terms in chosen if each == name]
        for terms, dash in zip(lengths, DASHES, strict=False):
            b, a = operator(name, DRAWN_ORDER, period, terms)
            error = response_error(b, a, DRAWN_ORDER, 1.0, omega, period)
            for axes, values in zip(column, (error.magnitude_db, error.phase_deg), strict=True):
                axes.semilogx(omega / (2 * np.pi), values, dash, color=colour, label=f"{terms}")
        column[0].set_title(name)
        column[0].legend(title="terms", fontsize=FONT - 2, frameon=False)
        column[1].set_xlabel("f [Hz]")
    panels[0, 0].set_ylabel("magnitude error [dB]")
    panels[1, 0].set_ylabel("phase error [deg]")
    finish(figure, panels.flat)
    figure.suptitle(f"D^{DRAWN_ORDER:g} against (j omega)^{DRAWN_ORDER:g}", fontsize=FONT + 3)
    save(figure, path)


def loop_figure(rows: Rows, part: str, path: Path) -> None:
    """Write the median index (5) of every realisation, a panel per trajectory.

    Args:
        rows: of the study; part: of them. path: the PNG to write; a file there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    loops = [row for row in rows if row["part"] == part]
    chosen = _chosen(rows, part)
    paths = list(dict.fromkeys(row["trajectory"] for row in loops))
    figure = Figure(figsize=(WIDTH, 2.0 + 0.36 * len(chosen)), dpi=DPI, layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(paths), sharey=True))
    for axes, name in zip(panels, paths, strict=True):
        for plant, shift in (("assumed-modes", -0.14), ("chain", 0.14)):
            colour, marker = STYLES[plant]["color"], PLANT_MARKERS[plant]
            axes.plot([], [], marker, color=colour, label=spoken(plant))
            for row in loops:
                if (row["trajectory"], row["plant"]) != (name, plant):
                    continue
                height = chosen.index((row["realisation"], row["terms"])) + shift
                if row["index"] is None or not math.isfinite(row["index"]):
                    mark = {"color": colour, "transform": axes.get_yaxis_transform()}
                    axes.plot(0.985, height, "x", **mark)
                else:
                    axes.plot(row["index"], height, marker, color=colour)
        axes.set_xscale("log")
        axes.set(title=name, xlabel="index (5) [m2 s]; x: none")
    panels[0].set_yticks(range(len(chosen)), [f"{name}, {terms}" for name, terms in chosen])
    panels[0].set_ylim(len(chosen) - 0.5, -0.5)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=FONT)
    finish(figure, panels)
    save(figure, path)
