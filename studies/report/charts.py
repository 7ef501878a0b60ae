"""Figures to zoom in: medians with their intervals, line by line, a menu for what is shown.

>>> chart = interval_chart("run-1-results", points)
>>> chart.figure["data"][0]["x"]
[6.846..., 12.3, ...]

Colours, markers and names of the plants are those of all our figures. What plotly would take for
markup in a name is escaped.
"""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import plotly.graph_objects as go

from flexsim.recording.traces import kind, spoken
from studies.core.figures import BLUE, COLOURS, GREEN, ORANGE, PURPLE, SKY, VERMILION, raised
from studies.core.text import spelled
from studies.report.names import scaled
from studies.report.points import Point

LINES_MOST, METRICS_MOST = 60, 30  # of a chart
LONGEST = 70  # characters of a name
STYLES = {  # colour, marker, dash: apart without colour, too
    "assumed-modes": (ORANGE, "circle", "solid"),
    "chain": (BLUE, "square", "dash"),
    "closed-chain": (BLUE, "square", "dash"),
    "rigid": (GREEN, "diamond", "dot"),
    "printed": (VERMILION, "triangle-up", "dashdot"),
    "untuned": (SKY, "triangle-down", "longdash"),
}
OTHER = (PURPLE, "cross", "longdashdot")
MARKERS = ("circle", "square", "diamond", "triangle-up", "triangle-down", "cross")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
INK, FAINT = "#222222", "#dddddd"
Look = tuple[str, str, str]
WITH_ENDS = "Bars: the interval that the run gives, of 95 % unless its tables say otherwise."


@dataclass(frozen=True)
class Chart:
    """A figure of plotly.

    Attributes:
        key: its id in the page. title, note: above and below.
        figure: data and layout as JSON has them.
    """

    key: str
    title: str
    note: str
    figure: dict[str, Any]


def label(name: object) -> str:
    """Return a name as plotly shows it, with nothing in it that would be markup."""
    text = spelled(name)
    return html.escape(text if len(text) <= LONGEST else f"{text[:LONGEST]}...", quote=False)


def look_of(plants: Sequence[str]) -> Callable[[str], Look]:
    """Return a function from a plant's name to its look; those of one kind look different."""
    kinds = [kind(each) for each in plants]
    alone = len(set(kinds)) == len(kinds) and sum(k not in STYLES for k in kinds) < 2

    def look(plant: str) -> Look:
        if not plant:
            return numbered(0)
        if alone:
            return STYLES.get(kind(plant), OTHER)
        return numbered(plants.index(plant))

    return look


def numbered(i: int) -> Look:
    """Return the look of the i-th of curves that are no plants."""
    return COLOURS[i % len(COLOURS)], MARKERS[i % len(MARKERS)], DASHES[i % len(DASHES)]


def layout(height: int, **more: Any) -> dict[str, Any]:
    """Return what all figures have in common: letters, margins, legend below."""
    return {
        "height": height,
        "font": {"family": "system-ui, sans-serif", "size": 13, "color": INK},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "margin": {"l": 70, "r": 20, "t": 50, "b": 60},
        "legend": {"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom"},
        "hovermode": "closest",
        **more,
    }


def axis(title: str, **more: Any) -> dict[str, Any]:
    """Return what all axes have in common."""
    lines = {"gridcolor": FAINT, "zerolinecolor": FAINT, "linecolor": INK, "ticks": "outside"}
    return {**lines, "title": {"text": title}, "automargin": True, **more}


def figure_of(data: Sequence[Any], layout: dict[str, Any]) -> dict[str, Any]:
    """Return a figure as JSON has it, checked by plotly."""
    made: dict[str, Any] = go.Figure(data=list(data), layout=layout).to_plotly_json()
    made["layout"].pop("template", None)  # plotly's own colours
    return made


def interval_chart(key: str, title: str, points: Sequence[Point], by: str = "plant") -> Chart:
    """Return medians with their intervals: a line for each case, a menu for the metrics.

    Args:
        key, title: of the chart. points: as named. by: what differs on a line; plants, or runs.
    """
    known = [each for each in points if each.value is not None]
    metrics = list(dict.fromkeys((p.metric, p.unit) for p in known))[:METRICS_MOST]
    groups = list(dict.fromkeys(p.plant for p in known))
    lines = list(dict.fromkeys(p.of for p in known))
    kept = {name: i for i, name in enumerate(lines[:LINES_MOST])}
    of_plants = by == "plant"
    look = look_of(groups) if of_plants else lambda name: numbered(groups.index(name))
    data = []
    for number, metric in enumerate(metrics):
        for place, group in enumerate(groups):
            own = [p for p in known if (p.metric, p.unit) == metric and p.plant == group]
            own = [p for p in own if p.of in kept]
            shift = 0.5 * ((place + 0.5) / len(groups) - 0.5)
            name = spoken(group) if of_plants else group
            data.append(_bars(own, kept, shift, (name, *look(group)), number == 0))
    note = WITH_ENDS
    if len(lines) > len(kept):
        note += f" The first {len(kept)} of {len(lines)} lines; the rest is in the tables."
    how = layout(
        max(260, 150 + 16 * len(kept) * max(1, min(len(groups), 3))),
        xaxis=axis(_axis_title(*metrics[0])),
        yaxis=axis(
            "",
            tickvals=list(kept.values()),
            ticktext=[label(name) for name in kept],
            range=[len(kept) - 0.5, -0.5],
        ),
        updatemenus=_menus(metrics, len(groups)),
    )
    return Chart(key, title, note, figure_of(data, how))


def _bars(
    points: Sequence[Point],
    lines: dict[str, int],
    shift: float,
    look: tuple[str, str, str, str],
    visible: bool,
) -> Any:
    """Return one group's points, in the unit that they are drawn in; `look` begins with a name."""
    name, colour, marker, _ = look
    scale = scaled(points[0].unit)[1] if points else 1.0
    x = [scale * (p.value or 0.0) for p in points]
    ends = [(p.low, p.high) for p in points]
    above = [0.0 if h is None else scale * h - a for a, (_, h) in zip(x, ends, strict=True)]
    below = [0.0 if o is None else a - scale * o for a, (o, _) in zip(x, ends, strict=True)]
    return go.Scatter(
        x=x,
        y=[lines[p.of] + shift for p in points],
        error_x={"type": "data", "array": above, "arrayminus": below, "color": colour},
        mode="markers",
        marker={"color": colour, "symbol": marker, "size": 9},
        name=label(name),
        showlegend=bool(name),
        visible=visible,
        hovertext=[label(f"{p.of}; {name}".strip("; ")) for p in points],
        hoverinfo="x+text",
    )


def _axis_title(metric: str, unit: str) -> str:
    drawn = raised(scaled(unit)[0])
    return label(metric) + (f" [{label(drawn)}]" if drawn else "")


def _menus(metrics: Sequence[tuple[str, str]], groups: int) -> list[dict[str, Any]]:
    """Return the menu that chooses a metric, none for a single one."""
    if len(metrics) < 2:
        return []
    buttons = [
        {
            "label": label(metric),
            "method": "update",
            "args": [
                {"visible": [i // groups == number for i in range(groups * len(metrics))]},
                {"xaxis.title.text": _axis_title(metric, unit)},
            ],
        }
        for number, (metric, unit) in enumerate(metrics)
    ]
    return [{"buttons": buttons, "x": 0, "xanchor": "left", "y": 1.01, "yanchor": "bottom"}]
