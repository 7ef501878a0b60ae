"""What does the closed loop make of a save? As rows of a table, in words, as keys of JSON.

>>> print(loop_text(save.loop, before.loop))                       # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from studies.core.evidence.digits import with_interval
from studies.core.table import Column, Table
from studies.core.text import spelled
from studies.watch.closed_loop import EXACT, RUNS, LoopAnswer, PlantLoop

MM = 1e3  # per metre
SAME = 5e-4  # of a shown number, and less, is no change
TITLE = "Closed loop: {}"
NOTE = (
    f"Envelopes: medians of {RUNS} runs whose gains differ in their fourth digits, with 95 % "
    "intervals. Poles: of the linear loop at theta2 = {:.3g} rad, where it grows most."
)


def loop_json(answer: LoopAnswer | None) -> dict[str, Any]:
    """Return the keys of a save's JSON that are about the loop, None where there is none."""
    keys = (
        *("envelope", "envelope_low", "envelope_high", "diverged_share"),
        *("growth", "gain_margin", "poles", "loop_error"),
    )
    if answer is None:
        return dict.fromkeys(keys)
    simulated = {key: each.medians for key, each in answer.loops.items() if each.medians}
    return {
        "envelope": {key: each.envelope for key, each in simulated.items()},
        "envelope_low": {key: each.envelope_low for key, each in simulated.items()},
        "envelope_high": {key: each.envelope_high for key, each in simulated.items()},
        "diverged_share": {key: each.diverged_share for key, each in simulated.items()},
        "growth": {key: each.growth for key, each in answer.loops.items()},
        "gain_margin": {key: each.gain_margin for key, each in answer.loops.items()},
        "poles": {key: each.slowest for key, each in answer.loops.items()},
        "loop_error": answer.problem or None,
    }


@dataclass(frozen=True)
class LoopFigure:
    """One figure of the loop of every plant, now and before."""

    name: str
    now: Mapping[str, float | None]
    before: Mapping[str, float | None]
    words: Mapping[str, str]


def loop_table(answer: LoopAnswer, before: LoopAnswer | None) -> Table:
    """Return the table of envelopes, growth, margins and poles, and their changes."""
    columns = [Column("name", "")]
    for key in answer.loops:
        columns += [_figure(key)] + ([_change(key)] if key != EXACT else [])
    figures = _figures(answer, before)
    title = TITLE.format(spelled(answer.asked.words))
    return Table(figures, tuple(columns), title, note=NOTE.format(answer.theta2))


def loop_text(answer: LoopAnswer | None, before: LoopAnswer | None) -> str:
    """Return in markdown what the loop makes of a save."""
    if answer is None:
        return "No loop was closed."
    if answer.problem:
        return f"No loop could be closed: {spelled(answer.problem)}"
    return loop_table(answer, before).markdown()


def _figures(answer: LoopAnswer, before: LoopAnswer | None) -> list[LoopFigure]:
    """Return the rows; frequencies are of the pole that each plant's growth is of, and so on."""
    earlier = before.loops if before else {}
    rows = [
        _row("envelope [mm]", answer.loops, earlier, _envelope, _in_words),
        _row("growth [1/s]", answer.loops, earlier, lambda loop: loop.growth),
        _row("gain margin [-]", answer.loops, earlier, lambda loop: loop.gain_margin),
    ]
    count = min(len(each.slowest) for each in answer.loops.values())
    poles = [(f"pole {i + 1} [Hz]", partial(_hz, i)) for i in range(count)]
    return rows + [_row(name, answer.loops, earlier, hertz) for name, hertz in poles]


def _row(
    name: str,
    now: Mapping[str, PlantLoop],
    before: Mapping[str, PlantLoop],
    figure: Any,
    words: Any = lambda loop: "",
) -> LoopFigure:
    """Return a row of one figure."""
    return LoopFigure(
        name,
        {key: figure(loop) for key, loop in now.items()},
        {key: figure(loop) for key, loop in before.items()},
        {key: words(loop) for key, loop in now.items()},
    )


def _envelope(loop: PlantLoop) -> float | None:
    found = loop.medians.envelope if loop.medians else None
    return None if found is None else MM * found


def _in_words(loop: PlantLoop) -> str:
    """Return an envelope with its interval, and how many runs diverged."""
    m = loop.medians
    if m is None:
        return ""
    lost = f"{round(m.diverged_share * m.runs)} of {m.runs} diverge" if m.diverged else ""
    if m.envelope is None:
        return lost
    return f"{with_interval(m.envelope, m.envelope_low, m.envelope_high, MM)} {lost}".strip()


def _hz(i: int, loop: PlantLoop) -> float | None:
    return loop.slowest[i]["hz"] if i < len(loop.slowest) else None


def _figure(key: str) -> Column:
    """Return the column of a plant's figures."""
    return Column(key, form=lambda row: row.words[key] or shown(row.now[key]))


def _change(key: str) -> Column:
    """Return the column of what has changed since the save before."""
    return Column("change", form=lambda row: moved(row.now[key], row.before.get(key)))


def shown(value: float | None) -> str:
    """Return a figure with four digits, nothing where there is none."""
    return "" if value is None else f"{value:.4g}"


def moved(value: float | None, before: float | None) -> str:
    """Return by how much a figure has changed, in its own unit; nothing without one before."""
    if value is None or before is None:
        return ""
    change = value - before
    return "=" if abs(change) <= SAME * max(abs(value), abs(before)) else f"{change:+.3g}"
