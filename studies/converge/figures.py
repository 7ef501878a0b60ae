"""The ladders in a figure: change of every figure of merit from the exact beam's, by rung.

>>> dict(figures(result))      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from flexsim.recording.traces import MM
from studies.converge.judging import FLOOR
from studies.converge.report import SHORT
from studies.converge.rows import FIGURES, STEPS, Convergence, RungRow
from studies.core.figures import (
    BLUE,
    GREEN,
    ORANGE,
    VERMILION,
    canvas,
    drawn,
    finish,
    unmathed,
)
from studies.core.printed.ticks import PlainNumbers

HEIGHT = 165.0  # [mm]
STYLES = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "D"), (VERMILION, "^"))
ASIDE = 0.12  # of a rung, between cases
TICKS = [sign * each for each in (0.05, 0.1, 0.3, 1, 3, 10, 30, 100) for sign in (-1, 1)] + [
    0
]  # [mm]
TITLES = {"envelope": "envelope", "rms_error": "rms error", "max_v": "max |v|"}


def figures(result: Convergence) -> Iterator[tuple[str, Figure]]:
    """Give the ladders of sizes, and those of steps."""
    names = [each.ladder for each in result.ladders]
    steps = [name for name in names if name.startswith(STEPS)]
    yield "sizes", ladder_figure(result, [name for name in names if name not in steps])
    if steps:
        yield "steps", ladder_figure(result, steps)


@drawn
def ladder_figure(result: Convergence, ladders: Sequence[str]) -> Figure:
    """Return the changes with their 95 % intervals, a row per figure of merit."""
    steps = ladders[0].startswith(STEPS)
    held = "the same size at the shortest step" if steps else result.reference
    figure, panels = canvas(len(FIGURES), len(ladders), height=HEIGHT, sharex="col", sharey="row")
    for column, ladder in enumerate(ladders):
        rungs = [row for row in result.rungs if row.ladder == ladder]
        for row, name in enumerate(FIGURES):
            _panel(panels[row][column], result, rungs, name)
        panels[0][column].set_title(unmathed(ladder))
        axes = panels[-1][column]
        axes.set_xticks(range(len(rungs)), [_label(rung, ladder) for rung in rungs])
        what = "step [ms]" if ladder.startswith(STEPS) else "modes or segments"
        axes.set_xlabel(what)
    for row, name in enumerate(FIGURES):
        panels[row][0].set_ylabel(f"{TITLES[name]}: change [mm]")
    caption = (
        f"Change of medians of {result.runs} runs from those of {held}, with 95 % intervals. "
        "Star: the default. What a rung costs is in rungs.csv. "
        "Linear within the grey band's double, logarithmic beyond."
    )
    return finish(figure, panels.flat, legend=5, caption=caption)


def _label(rung: RungRow, ladder: str) -> str:
    size = f"{1e3 * rung.step:g}" if ladder.startswith(STEPS) else rung.size
    return f"{size}{'*' if rung.default else ''}"


def _panel(axes: Axes, result: Convergence, rungs: Sequence[RungRow], name: str) -> None:
    """Draw one figure of merit on one ladder, the cases side by side."""
    floor = MM * FLOOR
    axes.axhspan(-floor, floor, color="0.9", label=f"within {floor:g} mm")
    for i, case in enumerate(result.cases):
        points = []
        for x, rung in enumerate(rungs):
            (row,) = (each for each in result.of(rung) if each.case == case)
            found = row.change(name)
            if found.change is not None:
                place, middle = x + ASIDE * (i - (len(result.cases) - 1) / 2), found.change
                low = middle if found.low is None else min(found.low, middle)
                high = middle if found.high is None else max(found.high, middle)
                points.append((place, middle, middle - low, high - middle))
        colour, marker = STYLES[i % len(STYLES)]
        at, y, *ends = np.transpose(points) if points else np.zeros((4, 0))
        how: dict[str, Any] = {"color": colour, "marker": marker, "linestyle": "none", "ms": 3}
        axes.errorbar(at, MM * y, MM * np.array(ends), label=SHORT.get(case, case), **how)
    axes.set_yscale("symlog", linthresh=2 * floor)
    axes.yaxis.set_major_locator(FixedLocator(TICKS))
    axes.yaxis.set_major_formatter(PlainNumbers())
    axes.margins(x=0.09)
