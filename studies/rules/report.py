"""Designs by rule in tables, words and figures.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from studies.core.figures import COLOURS, DASHES, canvas, drawn, finish, log_axis
from studies.core.table import Column, Table
from studies.rules.rows import LoopRow, RulesResult

DEGREES = 180.0 / math.pi
LEAST_DB = -80.0  # of a loop that is drawn


def _gains(row: LoopRow) -> str:
    """Return both gain margins."""
    return f"{row.gain_low:.2g}-{row.gain_high:.3g}"


def _growth(row: LoopRow) -> str:
    return f"{row.growth:+.2g}" + "!" * (row.growth > 0)


DESIGNS = (
    Column("rule"),
    Column("joint", form="d"),
    Column("knobs"),
    Column("design"),
)
RIGID = (
    Column("rule"),
    Column("joint", form="d"),
    Column("inertia", "I", "kg m2", ".4g"),
    Column("omega_c", "crosses", "rad/s", ".4g"),
    Column("phi_m", "phase\nmargin", "deg", ".1f", DEGREES),
)
LOOPS = (
    Column("rule"),
    Column("joint", form="d"),
    Column("growth", form=_growth, unit="1/s"),
    Column("margins", "gain\nmargins", form=_gains),
    Column("phase", "phase\nmargin", "deg", ".1f", DEGREES),
    Column("omega_phase", "at", "rad/s", ".4g"),
    Column("delay_margin", "delay", "ms", ".2f", 1e3, missing="20+"),
    Column("overshoot", "over-\nshoot", "%", ".0f", 100),
    Column("settling", "settles", "s", ".2f"),
)
DESIGNS_NOTE = "SI units; P, I, lambda, D, mu of Valerio's rules in their unit of time, 'unit' [s]."
RIGID_NOTE = "Digital controller, rigid joint, dead time: as the rule has it."
LOOPS_NOTE = """\
On the plant, the other joint closed: growth of the slowest-decaying motion, !
if it grows; factors of the joint's gain at which the loop is about to grow; the
least phase margin, at any of the beam's crossings; extra delay that is borne;
step of the joint's reference, within 2 % after."""


def spelled_out(numbers: Mapping[str, float]) -> str:
    """Return numbers by name in one line."""
    return ", ".join(f"{name} {value:.4g}" for name, value in numbers.items())


def tables(result: RulesResult) -> list[Table]:
    """Return designs, their rigid loops, and those on the plant."""
    where = f"{result.plant}, theta2 = {result.theta2:.3f} rad, dead time {1e3 * result.delay:g} ms"
    return [
        Table(result.designs, DESIGNS, f"Designs for {where}", DESIGNS_NOTE, prints="designs.csv"),
        Table(
            result.designs, RIGID, "\nWith the rigid joint", RIGID_NOTE, "designs", "designs.csv"
        ),
        Table(result.loops, LOOPS, "\nOn the plant", LOOPS_NOTE, "rows", "results.csv", tight=True),
    ]


def verdict(result: RulesResult) -> str:
    """Return in words how many loops do not grow, and who bears most delay."""
    rules = list(dict.fromkeys(row.rule for row in result.loops))
    growth = {row.rule: row.growth for row in result.loops}
    stable = [name for name in rules if growth[name] <= 0]
    said = [
        f"Designs whose loops do not grow on {result.plant} near rest: {len(stable)} of "
        f"{len(rules)}" + (f" ({', '.join(stable)})." if stable else ".")
    ]
    borne = {
        row.rule: math.inf if row.delay_margin is None else row.delay_margin
        for row in result.loops
        if row.rule in stable
    }
    if borne:
        best = max(borne, key=lambda name: borne[name])
        most = f"{1e3 * borne[best]:.2f} ms" if math.isfinite(borne[best]) else "20 ms and more"
        said.append(f"{best} bears most extra delay, {most}.")
    return " ".join(said)


def facts(result: RulesResult) -> dict[str, Any]:
    """Return knobs and numbers of the designs by name, and where they are."""
    return {
        "numbers": result.numbers,
        "plant": result.plant,
        "theta2": result.theta2,
        "dead_time": result.delay,
    }


def figures(result: RulesResult) -> Iterator[tuple[str, Figure]]:
    """Give the loops over frequency and the steps."""
    yield "bode", bode_figure(result)
    if any(np.isfinite(each.steps).all() for each in result.curves):
        yield "step", step_figure(result)


def _look(k: int) -> dict[str, Any]:
    return {"color": COLOURS[k % len(COLOURS)], "linestyle": DASHES[k % len(DASHES)]}


@drawn
def bode_figure(result: RulesResult) -> Figure:
    """Return magnitude and phase of every rule's loops, a column per joint."""
    figure, panels = canvas(2, 2, height=120, sharex=True, sharey="row")
    for k, each in enumerate(result.curves):
        for j, loop in enumerate(each.loops):
            hertz = each.omega / (2 * math.pi)
            decibels = 20 * np.log10(np.maximum(np.abs(loop), 1e-300))
            panels[0, j].plot(hertz, np.maximum(decibels, LEAST_DB), **_look(k), label=each.rule)
            phase = DEGREES * np.angle(-loop) - 180.0  # from -360 to 0
            jumps = np.abs(np.diff(phase, prepend=phase[0])) > 180.0
            panels[1, j].plot(hertz, np.where(jumps, np.nan, phase), **_look(k))
    for j in (0, 1):
        panels[0, j].axhline(0.0, color="0.4", linewidth=0.6)
        panels[1, j].axhline(-180.0, color="0.4", linewidth=0.6)
        panels[0, j].set(title=f"joint {j + 1}")
        panels[1, j].set(xlabel="frequency [Hz]", ylim=(-360.0, 0.0))
        panels[1, j].set_yticks(range(-360, 1, 90))
        log_axis(panels[1, j].xaxis)
        panels[1, j].margins(x=0)
    panels[0, 0].set(ylabel="loop gain [dB]")
    panels[1, 0].set(ylabel="phase [deg]")
    caption = (
        f"Loops by rule on {result.plant} at theta2 = {result.theta2:.3f} rad, broken at one "
        "joint's torque, the other joint closed."
    )
    return finish(figure, panels.ravel(), legend=5, caption=caption)


@drawn
def step_figure(result: RulesResult) -> Figure:
    """Return every rule's steps, a panel per joint; none of loops that grow."""
    figure, panels = canvas(1, 2, height=65, sharey=True)
    for k, each in enumerate(result.curves):
        for j, step in enumerate(each.steps):
            if np.isfinite(step).all():
                panels[0, j].plot(each.time, step, **_look(k), label=each.rule)
    for j in (0, 1):
        panels[0, j].set(title=f"joint {j + 1}", xlabel="time [s]")
        panels[0, j].margins(x=0)
    panels[0, 0].set(ylabel="measured angle over step")
    caption = (
        f"Each joint's measured angle after a step of its reference, linear loop on "
        f"{result.plant} at theta2 = {result.theta2:.3f} rad; loops that grow are left out."
    )
    return finish(figure, panels.ravel(), legend=5, caption=caption)
