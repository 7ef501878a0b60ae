"""What was identified, in tables, words and figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from flexsim.numerics.types import Array
from studies.core.figures import BLUE, GREY, canvas, drawn, finish
from studies.core.table import Column, Table
from studies.identify.estimates import Estimate, HeldBack, Identified
from studies.identify.records import UNITS
from studies.identify.telling import LOOSE

POINTS_DRAWN = 3000  # of a signal


@dataclass(frozen=True, eq=False)
class Result:
    """What a command found: estimates, and the logs that were held back."""

    found: Identified
    held_back: list[HeldBack]
    plant: str
    method: str
    setting: str
    words: tuple[str, ...]
    mujoco: float | None
    """How far MuJoCo's own chain is from its closed form, in noises; None of other plants."""


def _interval(row: Estimate) -> str:
    digits = _digits(row)
    return f"{row.low:.{digits}g} to {row.high:.{digits}g}"


def _digits(row: Estimate) -> int:
    """Return significant digits: two of the interval's half-width, at most nine."""
    half = (row.high - row.low) / 2
    if not (half > 0 and row.value != 0):
        return 6
    return int(np.clip(np.ceil(np.log10(abs(row.value) / half)) + 2, 3, 9))


ESTIMATES = (
    Column("name", "number"),
    Column("value", "estimate", form=lambda row: f"{row.value:.{_digits(row)}g}"),
    Column("low", "95 % interval", form=_interval),
    Column("unit", "unit"),
    Column("noise", unit="%", form=".2g", scale=100),
    Column("model", unit="%", form=".2g", scale=100),
    Column("nominal", form=".5g"),
)
LEFT = (
    Column("log"),
    Column("signal"),
    Column("rms", "left", form=lambda row: f"{row.rms:.3g} {row.unit}"),
    Column("relative", "of the signal", "%", ".3g", scale=100),
    Column("first", "autocorrelation", form=".3f"),
    Column("white"),
)
HELD = (
    Column("log", "held back"),
    Column("signal", "worst signal"),
    Column("relative", "error", "%", ".3g", scale=100),
)


@dataclass(frozen=True, eq=False)
class CorrelationRow:
    """A number's correlations with all."""

    name: str
    correlation: Array


def tables(result: Result) -> Sequence[Table]:
    """Return the tables."""
    found = result.found
    note = (
        f"noise: half-width that the logs' noise leaves; model: how far {found.other} would move it"
    )
    names = [row.name for row in found.rows]
    rows = [CorrelationRow(n, found.correlation[i]) for i, n in enumerate(names)]
    title = f"Identified on {result.plant} by {result.method}"
    return (
        Table(found.rows, ESTIMATES, title, note, key="rows", file="estimates.csv"),
        Table(found.left, LEFT, "What is left", key="left", file="left.csv"),
        Table(result.held_back, HELD, "Predicted", key="held_back", file="held_back.csv"),
        Table(rows, (), key="correlations", file="correlation.csv"),
    )


def verdict(result: Result) -> str:
    """Return the answer in words."""
    found = result.found
    told = ", ".join(
        f"{row.name} {row.value:.{_digits(row)}g} [{row.low:.{_digits(row)}g}, "
        f"{row.high:.{_digits(row)}g}]" + f" {row.unit}" * (row.unit != "-")
        for row in found.rows
    )
    parts = [f"Estimates with 95 % intervals: {told}."]
    for one, other, value in found.near:
        parts.append(f"{one} and {other} act nearly together (correlation {value:+.3f}).")
    parts.append(_whiteness(found))
    if result.method == "least-squares":
        fit = found.found
        parts.append(f"{fit.agreeing} of {fit.starts} searches end there.")
    else:
        most = max(row.search for row in found.rows)
        parts.append(
            f"After {found.evaluations} simulations the algorithm is up to {100 * most:.2g} % from "
            "the least squares; the intervals have that in them."
        )
    if result.mujoco is not None:
        parts.append(
            f"Searched in closed form; MuJoCo's own chain is within {result.mujoco:.1g} of the "
            "noise of it."
        )
    for row in result.held_back:
        parts.append(f"{row.log} is predicted within {100 * row.relative:.2g} % ({row.signal}).")
    return " ".join(parts)


def _whiteness(found: Identified) -> str:
    coloured = sorted({row.signal for row in found.left if row.white == "no"})
    if not coloured:
        return "What is left passes for white."
    return (
        f"What is left of {', '.join(coloured)} is not white; the intervals have its "
        f"autocorrelation in them, over {found.spread.lags:.0f} rows."
    )


def content(result: Result) -> dict[str, Any]:
    """Return the JSON object, but for the tables' rows."""
    found = result.found
    return {
        "estimates": {
            row.name: {key: value for key, value in asdict(row).items() if key != "name"}
            for row in found.rows
        },
        "correlation": {
            row.name: dict(
                zip((each.name for each in found.rows), found.correlation[i], strict=True)
            )
            for i, row in enumerate(found.rows)
        },
        "nearly_together": [
            {"numbers": [one, other], "correlation": value} for one, other, value in found.near
        ],
        "nearly_together_from": LOOSE,
        "plant": result.plant,
        "other_model": found.other,
        "method": result.method,
        "setting": result.setting,
        "searches": found.found.starts,
        "searches_agreeing": found.found.agreeing,
        "evaluations": found.evaluations,
        "bandwidth_rows": found.spread.lags,
        "mujoco_apart": result.mujoco,
        "logs": list(result.words),
    }


@drawn
def figures(result: Result) -> Iterator[tuple[str, Figure]]:
    """Give the figure of what is left of every signal, over time."""
    problem, z = result.found.found.problem, result.found.found.z
    record = problem.records[0]
    left = problem.split(problem.residuals(z))[0] * problem.sigmas[0]
    stride = max(1, len(record.time) // POINTS_DRAWN)
    count = len(record.signals)
    figure, panels = canvas(count, 2, height=28 * count + 12)
    for s, name in enumerate(record.signals):
        unit = UNITS.get(name, "-")
        own, rest = panels[s]
        measured = record.values[::stride, s]
        own.plot(record.time[::stride], measured, color=GREY, linewidth=2.2, label="log")
        modelled = measured - left[::stride, s]
        own.plot(record.time[::stride], modelled, color=BLUE, linewidth=0.8, label="model")
        own.set_ylabel(f"{name} [{unit}]")
        rest.plot(record.time[::stride], left[::stride, s], color=BLUE, linewidth=0.5, label="left")
        rest.set_ylabel(f"left of {name} [{unit}]")
    for panel in panels[-1]:
        panel.set_xlabel("time [s]")
    caption = f"Signals of {record.source} and of the identified {result.plant}, and what is left."
    yield "left", finish(figure, panels.flat, legend=3, caption=caption)
