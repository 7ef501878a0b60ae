"""What a figure for print must be: its faults in words, none if it can be printed.

>>> assert faults(figure) == []
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations
from typing import Any

from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.text import Text

from studies.core.figures import DOUBLE, FONT, INCH, SINGLE, SMALL

TALLEST = 230.0  # [mm] of a page
LETTER = 1.0  # [pixel] by which bounding boxes may touch: they include a letter's surroundings
LABELLED = 2  # ticks of a logarithmic axis
NONE = ("None", "none", "", " ", None)


def faults(figure: Figure) -> list[str]:
    """Return what is wrong with a figure."""
    figure.draw_without_rendering()
    return [*_sizes(figure), *_texts(figure), *_axes(figure), *_markers(figure), *_legends(figure)]


def _sizes(figure: Figure) -> Iterator[str]:
    width, height = INCH * figure.get_size_inches()
    if min(abs(width - each) for each in (SINGLE, DOUBLE)) > 1e-6:
        yield f"is {width:g} mm wide"
    if height > TALLEST:
        yield f"is {height:g} mm high"
    if not figure.get_label():
        yield "has no caption"


def _ticks(figure: Figure) -> Iterator[tuple[Any, list[tuple[bool, Text]]]]:
    """Give each axis with its ticks' labels, and whether each of these is in view."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            slack = 1e-9 * (high - low)
            labels = axis.get_majorticklabels()
            places = axis.get_majorticklocs()
            known = dict(zip(map(id, labels), places, strict=False))
            yield (
                axis,
                [
                    (axes.axison and low - slack <= known.get(id(t), math.inf) <= high + slack, t)
                    for tick in (*axis.majorTicks, *axis.minorTicks)
                    for t in (tick.label1, tick.label2)
                ],
            )


def _shown(figure: Figure) -> list[Text]:
    """Return the texts that are seen."""
    hidden = {id(text) for _, labels in _ticks(figure) for seen, text in labels if not seen}
    return [
        text
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and id(text) not in hidden
        if text.axes is None or text.axes.axison
    ]


def _texts(figure: Figure) -> Iterator[str]:
    boxes = []
    for text in _shown(figure):
        if not SMALL <= text.get_fontsize() <= FONT:
            yield f"{text.get_text()!r} has {text.get_fontsize():g} pt"
        box = text.get_window_extent()
        boxes.append((text.get_text(), box))
        whole = figure.bbox
        if box.x0 < -LETTER or box.y0 < -LETTER or box.x1 > whole.x1 + LETTER:
            yield f"{text.get_text()!r} is cut off"
        if box.y1 > whole.y1 + LETTER:
            yield f"{text.get_text()!r} is cut off above"
    for (one, first), (other, second) in combinations(boxes, 2):
        if first.padded(-LETTER).overlaps(second.padded(-LETTER)):
            yield f"{one!r} overlaps {other!r}"


def _axes(figure: Figure) -> Iterator[str]:
    for axis, labels in _ticks(figure):
        name = "x" if axis is axis.axes.xaxis else "y"
        log = getattr(axis.axes, f"get_{name}scale")() == "log"
        read = [text for seen, text in labels if seen and text.get_visible() and text.get_text()]
        shared = not any(text.get_visible() for _, text in labels)  # labelled beside or below
        if log and not shared and len(read) < LABELLED:
            yield f"a logarithmic axis has {len(read)} labels"


def _markers(figure: Figure) -> Iterator[str]:
    explained = {
        line.get_marker()
        for legend in (*figure.legends, *(a.get_legend() for a in figure.axes if a.get_legend()))
        for line in legend.findobj(lambda each: hasattr(each, "get_marker"))
    }
    for axes in figure.axes:
        caps = {
            id(cap)
            for each in axes.containers
            if isinstance(each, ErrorbarContainer)
            for cap in each.lines[1]
        }
        for line in axes.lines:
            marker = line.get_marker()
            if marker not in NONE and id(line) not in caps and marker not in explained:
                yield f"the marker {marker!r} is not explained"


def _legends(figure: Figure) -> Iterator[str]:
    for legend in figure.legends:
        box = legend.get_window_extent()
        if any(box.padded(-LETTER).overlaps(axes.get_window_extent()) for axes in figure.axes):
            yield "a legend lies on a panel"
    if any(axes.get_legend() for axes in figure.axes):
        yield "a legend lies within a panel"
