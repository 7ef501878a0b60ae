"""What figures share: one style for print, one canvas, one finish, and how they are written.

    >>> figure, panels = canvas(1, 3, height=60)                        # [mm]
    >>> finish(figure, panels.flat, legend=4, caption="Medians with 95 % intervals.")
    >>> write_figures(folder, {"envelopes": figure}.items(), ("png", "pdf"))

Columns of journals are 84 and 174 mm wide, letters 8 points high. Drawn with matplotlib's objects,
without pyplot, in a context of settings: nothing global stays touched, no window opens. Equal data
give equal bytes in every format.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator

from flexsim.files.atomic import replacing, write_text
from flexsim.numerics.types import Array
from flexsim.recording.traces import kind, spoken
from studies.core.printed.ticks import Between, PlainLog, PlainNumbers
from studies.core.study_options import FORMATS
from studies.core.text import markdown_text, one_line, unmarked

P = ParamSpec("P")
Drawn = TypeVar("Drawn")
FIGURES, CAPTIONS = "figures", "captions.md"

SINGLE, DOUBLE = 84.0, 174.0  # widths of one and of two columns [mm]
INCH = 25.4  # [mm]
DPI = 300
RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
INDEX, INDEX_UNIT = 1e4, "10⁻⁴ m² s"  # the index (5) as figures have it
FONT, SMALL = 8, 7  # [pt] of letters, and of ticks and legends
RC: Any = {
    **dict.fromkeys(("font.size", "axes.titlesize", "axes.labelsize", "figure.titlesize"), FONT),
    **dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), SMALL),
    **{"legend.title_fontsize": SMALL, "legend.frameon": False, "legend.handlelength": 2.4},
    **{"lines.linewidth": 1.0, "lines.markersize": 4.0, "errorbar.capsize": 1.6},
    **{"axes.linewidth": 0.6, "axes.spines.top": False, "axes.spines.right": False},
    **{"axes.titlepad": 3.5, "axes.labelpad": 2.5, "axes.axisbelow": True},
    **{"axes.grid": True, "grid.color": "0.88", "grid.linewidth": 0.5},
    **dict.fromkeys(("xtick.major.width", "ytick.major.width"), 0.6),
    **dict.fromkeys(("xtick.minor.width", "ytick.minor.width"), 0.4),
    **dict.fromkeys(("xtick.major.size", "ytick.major.size"), 2.5),
    **{"figure.facecolor": "white", "path.simplify": True, "path.simplify_threshold": 0.2},
    **{"pdf.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "flexsim"},  # text as text
}

# Okabe and Ito's colours, which the colour-blind tell apart
BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, BLACK, GREY = "#CC79A7", "#56B4E9", "#000000", "#999999"
COLOURS = (BLUE, ORANGE, GREEN, VERMILION, PURPLE, BLACK)
MARKERS = ("o", "s", "D", "^", "v", "P")
DASHES: tuple[Any, ...] = ("-", (0, (4, 1.2)), (0, (4, 1, 1, 1)), (0, (1.2, 1)), (0, (7, 1.5)), "-")

# The plants often coincide, so what is drawn first is broad: it shows as a rim, and between the
# dashes of the next
STYLES: dict[str, dict[str, Any]] = {
    "assumed-modes": {"color": ORANGE, "linewidth": 2.2, "linestyle": "-"},
    "chain": {"color": BLUE, "linewidth": 0.9, "linestyle": DASHES[1]},
    "rigid": {"color": GREEN, "linewidth": 0.9, "linestyle": DASHES[2]},
    "printed": {"color": VERMILION, "linewidth": 0.9, "linestyle": DASHES[3]},
    "untuned": {"color": SKY, "linewidth": 1.2, "linestyle": DASHES[4]},
    "rod": {"color": PURPLE, "linewidth": 1.2, "linestyle": DASHES[2]},
    "rule-of-thumb": {"color": GREY, "linewidth": 1.2, "linestyle": DASHES[3]},
    "exudyn": {"color": BLACK, "linewidth": 0.8, "linestyle": DASHES[3]},
}
OTHER_STYLE: dict[str, Any] = {"color": GREEN, "linewidth": 1.0, "linestyle": DASHES[4]}
PLANT_MARKERS = {"assumed-modes": "o", "chain": "s", "rigid": "D", "rod": "^", "exudyn": "v"}
OTHER_MARKER = "D"
CURVE_BINS = 600  # of a curve's samples, two points drawn of each: more than paper shows


def drawn(function: Callable[P, Drawn]) -> Callable[P, Drawn]:
    """Return a function that draws in the one style, whatever is set outside."""

    @functools.wraps(function)
    def inside(*given: P.args, **named: P.kwargs) -> Drawn:
        with rc_context(RC):
            return function(*given, **named)

    return inside


def style(plant: str) -> dict[str, Any]:
    """Return how a plant's curve is drawn."""
    return STYLES.get(kind(plant), OTHER_STYLE)


def styles(plants: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return how the curves of several plants are drawn, two of one kind differently."""
    found: dict[str, dict[str, Any]] = {}
    every = list(plants)
    wanted = [style(plant) for plant in every]
    free = [each for each in (*STYLES.values(), OTHER_STYLE) if each not in wanted]
    for plant, own in zip(every, wanted, strict=True):
        found[plant] = free.pop(0) if own in found.values() and free else own
    return found


def mark(plant: str) -> tuple[str, dict[str, Any]]:
    """Return a plant's marker, and its colour and name as keywords."""
    marker = PLANT_MARKERS.get(kind(plant), OTHER_MARKER)
    return marker, {"color": style(plant)["color"], "label": spoken(plant)}


@drawn
def canvas(
    rows: int = 1, columns: int = 1, *, height: float, width: float = DOUBLE, **how: Any
) -> tuple[Figure, Any]:
    """Return a figure of a height and width [mm], its panels (rows, columns); `how`: `subplots`."""
    figure = sheet(height, width)
    return figure, figure.subplots(rows, columns, squeeze=False, **how)


def sheet(height: float, width: float = DOUBLE) -> Figure:
    """Return an empty figure of a height and width [mm]."""
    return Figure(figsize=(width / INCH, height / INCH), dpi=DPI, layout="constrained")


def finish(
    figure: Figure,
    panels: Iterable[Axes],
    legend: int = 0,
    title: str = "",
    caption: str = "",
) -> Figure:
    """Return a figure with a legend below its panels, and its caption kept with it.

    Args:
        figure, panels: as named. legend: columns of a legend of all that the panels name, each
            name once; fewer where names are long. title: of the figure, short. caption: what else
            a reader must know.
    """
    if legend:
        named: dict[str, Any] = {}
        for axes in panels:
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
                named.setdefault(label, handle)
        _legend(figure, named, legend)
    if title:
        figure.suptitle(title, fontsize=FONT)
    figure.set_label(caption)
    return figure


def _legend(figure: Figure, named: dict[str, Any], columns: int) -> None:
    """Put a legend below all panels, in as many columns as the figure is wide, of those wanted."""
    where: Any = "outside lower center"
    with rc_context(RC):
        for count in range(columns, 0, -1):
            made = figure.legend(list(named.values()), list(named), loc=where, ncols=count)
            if count == 1 or made.get_window_extent().width <= figure.bbox.width:
                return
            made.remove()


def log_axis(axis: Axis, most: int = 6) -> None:
    """Make an axis logarithmic, with ticks that can be read, at most about so many."""
    own: Any = axis
    getattr(axis.axes, f"set_{own.axis_name}scale")("log")
    axis.set_major_locator(PlainLog(most))
    axis.set_major_formatter(PlainNumbers())
    axis.set_minor_locator(Between(most))
    axis.set_minor_formatter(NullFormatter())
    axis.grid(False, which="minor")


def no_minor_ticks(axis: Axis) -> None:
    """Take the ticks without a number away."""
    axis.set_minor_locator(NullLocator())


def name_lines(axes: Axes, names: Sequence[str]) -> None:
    """Name the lines of a panel, the first on top."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)


def raised(unit: str) -> str:
    """Return a unit with its powers raised, as axes have it: N m2 as N m²."""
    return re.sub(r"(?<=[A-Za-z])\d+", lambda found: found[0].translate(RAISED), unit)


def unmathed(name: str) -> str:
    """Return a text from outside as a figure shows it: on one line, a dollar as a dollar."""
    return one_line(name).replace("$", r"\$")


def interval(
    axes: Axes,
    value: float,
    height: float,
    ends: tuple[float | None, float | None],
    marker: str,
    **how: Any,
) -> None:
    """Draw a value on a line with its interval; without an end where that is unknown."""
    low, high = ends
    look: dict[str, Any] = {"markersize": 3.4, "linestyle": "none", **how}
    bar: dict[str, Any] = {"color": "0.1", "linewidth": 0.8}
    if low is None or high is None:
        axes.plot([value], [height], marker, **look)
        known = [each for each in (low, value, high) if each is not None]
        if len(known) > 1:
            axes.plot(known, [height] * len(known), zorder=4, **bar)
        return
    look |= {"ecolor": bar["color"], "elinewidth": bar["linewidth"], "barsabove": True}
    sides = [[abs(value - low)], [abs(high - value)]]
    axes.errorbar([value], [height], xerr=sides, fmt=marker, **look)


def beside(axes: Axes, height: float, text: str, colour: str) -> None:
    """Write on a line, at the panel's right edge, why nothing is drawn there."""
    place = axes.get_yaxis_transform()
    axes.text(
        0.99, height, text, color=colour, size=SMALL, va="center", ha="right", transform=place
    )


def thinned(x: Array, y: Array, bins: int = CURVE_BINS) -> tuple[Array, Array]:
    """Return the points of a curve (K,) that paper shows: the least and largest of every bin.

    As it is if it has no more than two points a bin.
    """
    if len(x) <= 2 * bins:
        return x, y
    size = -(-len(x) // bins)
    starts = range(0, len(x), size)
    chosen: list[int] = []
    for first in starts:
        part = y[first : first + size]
        if np.isfinite(part).any():
            chosen += sorted({first + int(np.nanargmin(part)), first + int(np.nanargmax(part))})
    kept = np.array(sorted({0, *chosen, len(x) - 1}))
    return x[kept], y[kept]


def shade(axes: Axes, x: Array, low: Array, high: Array, **how: Any) -> None:
    """Fill what lies between two curves (K,), pale and without an edge, no less than that."""
    size = max(1, len(x) // CURVE_BINS)
    starts = np.arange(0, len(x), size)
    time = np.append(x[starts], x[-1])
    ends = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
    least, most = (np.append(each, each[-1]) for each in ends)
    axes.fill_between(time, least, most, **{"alpha": 0.3, "linewidth": 0, **how})


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format of the path's suffix, all of it or nothing.

    Raises:
        RunError: the file cannot be written.
    """
    form = path.suffix[1:]
    about = {"Creator": "flexsim"}
    caption = one_line(figure.get_label())
    more: dict[str, dict[str, Any]] = {
        "png": {"Software": "flexsim", "Description": caption},
        "pdf": {**about, "Producer": "matplotlib", "CreationDate": None, "Subject": caption},
        "svg": {**about, "Date": None, "Description": caption},
    }
    with rc_context(RC), replacing(path, "the figure") as temporary:
        figure.savefig(temporary, format=form, dpi=DPI, metadata=more[form])


def write_figures(
    folder: Path, figures: Iterable[tuple[str, Figure]], formats: Sequence[str] = FORMATS
) -> None:
    """Write figures into a run, in each format, with their captions beside; nothing without any.

    Raises:
        RunError: a file cannot be written.
    """
    captions = []
    for name, figure in figures:
        (folder / FIGURES).mkdir(exist_ok=True)
        with rc_context(RC):
            figure.draw_without_rendering()  # so that all formats have one layout
        figure.set_layout_engine("none")
        for each in formats:
            save(figure, folder / FIGURES / f"{name}.{each}")
        captions.append(f"**{markdown_text(name)}** {markdown_text(figure.get_label())}".strip())
    if captions:
        text = "\n\n".join(["# Captions", *captions]) + "\n"
        write_text(folder / FIGURES / CAPTIONS, text, "the captions")


def captions_in(text: str) -> dict[str, str]:
    """Return the captions that `write_figures` wrote, by the figures' names."""
    found = re.findall(r"^\*\*((?:\\.|[^\\*\n])+)\*\* ?(.*)$", text, re.MULTILINE)
    return {unmarked(name): unmarked(caption) for name, caption in found}
