"""What figures share: the plants' styles, one canvas, one finish, and how they are written.

    >>> figure, panels = canvas(1, 3, height=6.0)
    >>> finish(figure, panels, legend=4)

Drawn with matplotlib's objects, without pyplot: nothing global is touched, no window opens.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from flexsim.files.atomic import replacing
from flexsim.recording.traces import kind, spoken

# Okabe and Ito's colours, which the colour-blind tell apart
BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, BLACK, GREY = "#CC79A7", "#56B4E9", "#000000", "#999999"
COLOURS = (BLUE, ORANGE, GREEN, VERMILION, PURPLE, BLACK)

# The plants often coincide, so what is drawn first is broad: every curve shows as a rim around the
# next
STYLES: dict[str, dict[str, Any]] = {
    "assumed-modes": {"color": ORANGE, "linewidth": 4.2, "solid_capstyle": "round"},
    "chain": {"color": BLUE, "linewidth": 1.5, "solid_capstyle": "round"},
    "rigid": {"color": GREEN, "linewidth": 1.5},
    "printed": {"color": VERMILION, "linewidth": 1.5},
    "untuned": {"color": SKY, "linewidth": 1.5},
}
OTHER_STYLE: dict[str, Any] = {"color": PURPLE, "linewidth": 1.5}
PLANT_MARKERS = {"assumed-modes": "o", "chain": "s"}
OTHER_MARKER = "D"
WIDTH, DPI = 16.0, 100  # [in], 1600 px wide
FONT = 13  # [pt]


def style(plant: str) -> dict[str, Any]:
    """Return how a plant's curve is drawn."""
    return STYLES.get(kind(plant), OTHER_STYLE)


def mark(plant: str) -> tuple[str, dict[str, Any]]:
    """Return a plant's marker, and its colour and name as keywords."""
    marker = PLANT_MARKERS.get(kind(plant), OTHER_MARKER)
    return marker, {"color": style(plant)["color"], "label": spoken(plant)}


def canvas(rows: int = 1, columns: int = 1, *, height: float, **how: Any) -> tuple[Figure, Any]:
    """Return a figure of a height [in] and its panels (rows, columns); `how`: as `subplots`."""
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **how)


def finish(figure: Figure, panels: Iterable[Axes], legend: int = 0, title: str = "") -> Figure:
    """Return a figure whose panels have the same grid and letters.

    Args:
        figure, panels: as named. legend: columns of a legend below, of the first panel's entries.
        title: of the figure.
    """
    figure.set_facecolor("white")
    every = list(panels)
    for axes in every:
        axes.grid(color="0.88", linewidth=0.8)
        axes.set_axisbelow(True)
        axes.tick_params(labelsize=FONT - 1)
        axes.spines[["top", "right"]].set_visible(False)
        for text in (axes.xaxis.label, axes.yaxis.label, axes.title):
            text.set_fontsize(FONT)
    if legend:
        shown = every[0].get_legend_handles_labels()
        figure.legend(*shown, loc="outside lower center", ncols=legend, fontsize=FONT)
    if title:
        figure.suptitle(title, fontsize=FONT + 3)
    return figure


def log_ticks(axes: Axes) -> None:
    """Give a logarithmic x-axis ticks at 1, 2 and 5 of each decade, in plain figures."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())


def name_lines(axes: Axes, names: Sequence[str]) -> None:
    """Name the lines of a panel, the first on top."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)


def beside(axes: Axes, height: float, text: str, colour: str) -> None:
    """Write on a line, at the panel's right edge, why nothing is drawn there."""
    place = axes.get_yaxis_transform()
    axes.text(
        0.99, height, text, color=colour, size=FONT - 2, va="center", ha="right", transform=place
    )


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, all of it or nothing.

    Raises:
        RunError: the file cannot be written.
    """
    with replacing(path, "the figure") as temporary:
        figure.savefig(temporary, format="png", dpi=DPI, metadata={"Software": "flexsim"})
