"""Figures over time to zoom in: a search's convergence, the time series that a run has kept.

>>> [chart.title for chart in courses(run)]
['Convergence']
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pyarrow as pa

from flexsim.errors import RunError
from flexsim.recording.traces import spoken
from studies.core.figures import BLUE, GREEN, ORANGE
from studies.report.charts import (
    LINES_MOST,
    Chart,
    axis,
    figure_of,
    label,
    layout,
    look_of,
    numbered,
)
from studies.report.entries import is_there, named, size_of
from studies.report.frames import PARQUET_MOST, Frame, finite, parquet
from studies.report.kept import GENERATIONS, RESULTS, Kept
from studies.run.columns import FACTORS

CONVERGENCE, TRACES = "convergence.csv", "traces"
CASES_MOST, SAMPLES_MOST, DOTS_MOST = 12, 1500, 5000  # of a figure, of a curve
FILES_MOST = 24  # of time series that are looked into
RUNS = re.compile(r"(\d{1,12})-(\d{1,12})\.parquet")  # the first and the last of a file
MM = 1e3
DIGITS = 6
INDEX = "performance index (5) [m² s]"
PANELS = ("tip error [mm]", "v [mm]", "torque 1 [N m]", "torque 2 [N m]")
SERIES = ("run", "t", "x", "y", "x_ref", "y_ref", "v", "tau1", "tau2")


def courses(run: Kept, prefix: str) -> Iterator[Chart]:
    """Give a run's figures over generations or time, of those that it has."""
    course = run.frame(CONVERGENCE)
    individuals = run.frame(GENERATIONS)
    if course is None and individuals is not None:
        course = _course_of(individuals)
    if course is not None and {"generation", "best"} <= set(course.columns) and course.rows:
        yield _convergence(f"{prefix}-convergence", course, individuals)
    chart = _time_series(f"{prefix}-traces", run.folder)
    if chart is not None:
        yield chart


def _course_of(individuals: Frame) -> Frame | None:
    """Return the best and the median index so far, of a search that has not ended."""
    if not {"generation", "index"} <= set(individuals.columns):
        return None
    generation, index = (individuals.column(name) for name in ("generation", "index"))
    numbers = [n for n in dict.fromkeys(generation) if n is not None]
    rows: list[list[Any]] = []
    best = np.inf
    for number in numbers:
        own = [finite(x) for n, x in zip(generation, index, strict=True) if n == number]
        held = sorted(np.inf if x is None else x for x in own)
        best = min(best, held[0])
        rows.append([number, best, held[(len(held) - 1) // 2]])
    return Frame(CONVERGENCE, ["generation", "best", "median"], rows, len(rows))


def _convergence(key: str, course: Frame, individuals: Frame | None) -> Chart:
    """Return the index over generations, a curve for each search, individuals as dots."""
    data: list[Any] = []
    if individuals is not None and {"generation", "index"} <= set(individuals.columns):
        pairs = zip(*(individuals.column(n) for n in ("generation", "index")), strict=True)
        dots = [(n, x) for n, x in pairs if finite(x) is not None][:DOTS_MOST]
        dot: dict[str, Any] = {"color": "#bbbbbb", "size": 5}
        x, y = ([each[i] for each in dots] for i in (0, 1))
        data.append(go.Scatter(x=x, y=y, mode="markers", marker=dot, name="individuals"))
    names = [name for name in ("screen", "seed") if name in course.columns]
    searches = list(dict.fromkeys(tuple(_at(course, row, names)) for row in course.rows))
    for i, search in enumerate(searches[:LINES_MOST]):
        rows = [row for row in course.rows if tuple(_at(course, row, names)) == search]
        told = ", ".join(f"{n} {v}" for n, v in zip(names, search, strict=True))
        colour, marker, dash = numbered(i) if names else (BLUE, "circle", "solid")
        data.append(_curve(course, rows, "best", told or "best so far", (colour, marker, dash)))
    if "median" in course.columns:
        data.append(_curve(course, course.rows, "median", "median", (ORANGE, "square", "dash")))
    if "stable_share" in course.columns:
        share = _curve(
            course, course.rows, "stable_share", "stable share", (GREEN, "diamond", "dot")
        )
        data.append(share.update(yaxis="y2"))
    how = layout(
        480,
        xaxis=axis("generation"),
        yaxis=axis(INDEX, type="log", exponentformat="power"),
    )
    if "stable_share" in course.columns:
        right = axis(
            "stable share", overlaying="y", side="right", range=[0, 1.05], dtick=0.2, showgrid=False
        )
        how |= {"yaxis2": right}
        how["margin"] = {**how["margin"], "r": 70}
    return Chart(key, "Convergence", "", figure_of(data, how))


def _at(frame: Frame, row: Sequence[Any], names: Sequence[str]) -> list[Any]:
    return [row[frame.places[name]] for name in names]


def _curve(
    frame: Frame, rows: Sequence[Sequence[Any]], name: str, told: str, look: tuple[str, str, str]
) -> Any:
    colour, marker, dash = look
    x = [finite(row[frame.places["generation"]]) for row in rows]
    y = [finite(row[frame.places[name]]) for row in rows]
    return go.Scatter(
        x=x,
        y=y,
        mode="lines+markers",
        line={"color": colour, "dash": dash},
        marker={"symbol": marker, "size": 7},
        name=label(told),
    )


def _time_series(key: str, folder: Path) -> Chart | None:
    """Return the time series of a study's runs, case by case; None if it has kept none.

    Raises:
        RunError: a file is damaged.
    """
    paths = named(folder / TRACES, ".parquet")
    results = folder / RESULTS
    if not paths or not is_there(results) or size_of(results) > PARQUET_MOST:
        return None
    cases = _cases(results)
    wanted = {run for runs in cases.values() for run in runs.values()}
    found: dict[int, Any] = {}
    files = [each for each in paths if _may_have(each, wanted)]
    for path in files[:FILES_MOST]:
        found |= _kept(path, wanted - set(found))
    whole = {
        case: {plant: found[run] for plant, run in runs.items() if run in found}
        for case, runs in cases.items()
    }
    shown = {case: series for case, series in whole.items() if series}
    return _series_chart(key, shown, len(cases)) if shown else None


def _may_have(path: Path, wanted: set[int]) -> bool:
    """Return whether a file of time series can be read, and has wanted runs by its name."""
    runs = RUNS.fullmatch(path.name)
    if runs is None or size_of(path) > PARQUET_MOST:
        return False
    return any(int(runs[1]) <= run <= int(runs[2]) for run in wanted)


def _cases(path: Path) -> dict[str, dict[str, int]]:
    """Return the number of the first run of every case, plant by plant."""
    try:
        content = parquet(path).read(columns=["run", *FACTORS]).to_pydict()
    except (pa.ArrowException, OSError, ValueError, KeyError) as error:
        raise RunError(f"{path}: damaged: {error}") from None
    others = [name for name in FACTORS if name != "plant" and len(set(content[name])) > 1]
    cases: dict[str, dict[str, int]] = {}
    for i, run in enumerate(content["run"]):
        case = ", ".join(str(content[name][i]) for name in others) or "the case"
        if case in cases or len(cases) < CASES_MOST:
            cases.setdefault(case, {}).setdefault(str(content["plant"][i]), run)
    return cases


def _kept(path: Path, wanted: set[int]) -> dict[int, Any]:
    """Return the series of those runs that a file has, by their numbers."""
    found = {}
    file = parquet(path)
    try:
        for i in range(file.num_row_groups):
            statistics = file.metadata.row_group(i).column(0).statistics
            if statistics is not None and statistics.min in wanted:
                table = file.read_row_group(i, columns=list(SERIES))
                found[int(statistics.min)] = {
                    name: table.column(name).to_numpy() for name in SERIES
                }
    except (pa.ArrowException, OSError, ValueError, KeyError) as error:
        raise RunError(f"{path}: damaged: {error}") from None
    return found


def _panels(series: dict[str, Any]) -> list[Any]:
    """Return what the panels show."""
    error = np.hypot(series["x"] - series["x_ref"], series["y"] - series["y_ref"])
    return [MM * error, MM * series["v"], series["tau1"], series["tau2"]]


def _thinned(values: Any, stride: int) -> list[float | None]:
    return [float(f"{x:.{DIGITS}g}") if np.isfinite(x) else None for x in values[::stride].tolist()]


def _series_chart(key: str, shown: dict[str, dict[str, Any]], total: int) -> Chart:
    """Return error, deflection and torques over time, a menu for the cases."""
    plants = list(dict.fromkeys(plant for series in shown.values() for plant in series))
    longest = max(len(s["t"]) for series in shown.values() for s in series.values())
    stride = -(-longest // SAMPLES_MOST)
    look, data, owners = look_of(plants), [], []
    for case, series in shown.items():
        for plant, own in series.items():
            colour, _, dash = look(plant)
            t = _thinned(own["t"], stride)
            for row, values in enumerate(_panels(own), 1):
                curve = go.Scatter(
                    x=t,
                    y=_thinned(values, stride),
                    mode="lines",
                    line={"color": colour, "dash": dash, "width": 1.6},
                    name=label(spoken(plant)),
                    legendgroup=label(plant),
                    showlegend=row == 1,
                    visible=case == next(iter(shown)),
                    yaxis="y" if row == 1 else f"y{row}",
                    hoverinfo="x+y+name",
                )
                data.append(curve)
                owners.append(case)
    thin = f" One sample in {stride} is drawn." if stride > 1 else ""
    more = f" The first {len(shown)} cases." if total >= CASES_MOST else ""
    note = f"The first run of each case, as it was kept.{thin}{more}"
    return Chart(key, "Time series", note, figure_of(data, _stacked(list(shown), owners)))


def _stacked(cases: Sequence[str], owners: Sequence[str]) -> dict[str, Any]:
    """Return the layout: panels above each other over one time, a menu for the cases."""
    how = layout(660, xaxis=axis("time [s]", anchor=f"y{len(PANELS)}"))
    height = 1 / len(PANELS)
    for row, title in enumerate(PANELS, 1):
        top = 1 - (row - 1) * height
        panel = axis(title, domain=[top - 0.86 * height, top], anchor="x")
        how["yaxis" if row == 1 else f"yaxis{row}"] = panel
    if len(cases) > 1:
        buttons = [
            {
                "label": label(case),
                "method": "restyle",
                "args": ["visible", [owner == case for owner in owners]],
            }
            for case in cases
        ]
        menu = {"buttons": buttons, "x": 0, "xanchor": "left", "y": 1.01, "yanchor": "bottom"}
        how["updatemenus"] = [menu]
    return how
