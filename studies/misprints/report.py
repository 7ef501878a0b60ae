"""The misprints' study in tables, words and figures.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from flexsim.plants.printed import MISPRINTS
from studies.core.evidence.digits import with_interval
from studies.core.figures import (
    BLACK,
    BLUE,
    DASHES,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILION,
    canvas,
    drawn,
    finish,
    log_axis,
    thinned,
)
from studies.core.table import Column, Table

COLOURS = (GREY, BLUE, ORANGE, GREEN, VERMILION, PURPLE, BLACK)  # of the variants
MARKERS = "osD^v*X"
SMALLEST = 1e-12  # relative; below this an energy change is rounding
MM, UM = 1e3, 1e6  # [mm/m], [um/m]
DRAWN = "bent"  # start of the free motion in the figure
RANGES = "(39)-(41) ranges"  # 3 <= j <= n where it is n+2: not a variant, as it cannot run
ENTRIES = "(31) entries"  # four, where q' has n + 2
OPEN_LEGEND = """\
energy  largest relative change in 2 s of free, undamped motion
tip     rms to the chain's tip, open loop, worst pose; small and large torques
-       cannot be run as printed: the ranges of (39)-(41) make H singular, and F
        of (31) has another number of entries than q'
"""
ENVELOPE_LEGEND = """\
Medians with 95 % intervals by order statistics, of the trajectory where they
are largest; friction none and simulink.
"""
APART_LEGEND = """\
The same of the rms to the consistent model's run with the same gains; for none:
to a run whose gains differ in the fourth digit, that is, what chance does.
"""


WIDTHS = "Closed loop: envelope half-width"


def _sure(name: str) -> Callable[[Any], str]:
    """Return how a median of a row is shown [mm], with its interval."""

    def shown(row: MisprintRow) -> str:
        ends = (getattr(row, f"{name}_low"), getattr(row, f"{name}_high"))
        return with_interval(getattr(row, name), *ends, scale=MM, most=3)

    return shown


def _loop_columns(name: str, heading: str) -> tuple[Column, ...]:
    """Return the columns of a median in closed loop, one for each friction."""
    return (
        Column("misprint"),
        Column(f"{name}_none", f"{heading} [mm]\nnone", form=_sure(f"{name}_none")),
        Column(f"{name}_simulink", "\nsimulink", form=_sure(f"{name}_simulink")),
    )


OPEN_COLUMNS = (
    Column("misprint"),
    Column("drift_brisk", "energy\nbrisk", form=".0e"),
    Column("drift_bent", "\nbent", form=".0e"),
    Column("tip_to_chain_small", "tip µm\nsmall", form=".1f", scale=UM),
    Column("tip_to_chain_large", "\nlarge", form=".1f", scale=UM),
)
ENVELOPE = _loop_columns("envelope", "envelope")
APART = _loop_columns("loop_to_consistent", "to the consistent")


@dataclass(frozen=True)
class MisprintRow:
    """One variant: the worst of its details; None where it cannot be run.

    Attributes:
        rank_of_H: n + 2 where the equations can be solved.
        missing_F: entries of F that (31) is short of, below 0 for those it has too many; 0 where F
            is read as n + 2 of them.
        drift: of energy, relative, by start. tip_to: rms in open loop [m], by amplitude.
        envelope, loop_to_consistent: medians [m], by friction, with 95 % intervals; of those the
            trajectory with the largest.
    """

    misprint: str
    rank_of_H: int
    missing_F: int = 0
    drift_gentle: float | None = None
    drift_brisk: float | None = None
    drift_bent: float | None = None
    tip_to_chain_small: float | None = None
    tip_to_consistent_small: float | None = None
    tip_to_chain_large: float | None = None
    tip_to_consistent_large: float | None = None
    envelope_none: float | None = None
    envelope_none_low: float | None = None
    envelope_none_high: float | None = None
    loop_to_consistent_none: float | None = None
    loop_to_consistent_none_low: float | None = None
    loop_to_consistent_none_high: float | None = None
    envelope_simulink: float | None = None
    envelope_simulink_low: float | None = None
    envelope_simulink_high: float | None = None
    loop_to_consistent_simulink: float | None = None
    loop_to_consistent_simulink_low: float | None = None
    loop_to_consistent_simulink_high: float | None = None


@dataclass(frozen=True)
class TorqueDetail:
    """One variant in open loop from a pose: rms tip distances [m]; case: 'torques small'."""

    misprint: str
    case: str
    theta2: float
    tip_to_chain: float
    tip_to_consistent: float


@dataclass(frozen=True)
class LoopDetail:
    """One variant in closed loop: medians [m], infinite where it diverges; case: 'loop none'.

    low, high: their 95 % intervals, None where there is none.
    """

    misprint: str
    case: str
    trajectory: str
    runs: int
    envelope: float
    envelope_low: float | None
    envelope_high: float | None
    tip_to_consistent: float
    tip_to_consistent_low: float | None
    tip_to_consistent_high: float | None


@dataclass(frozen=True, eq=False)
class MisprintsResult:
    """A row per variant, the details it is the worst of, and energy's relative changes (K,)."""

    rows: list[MisprintRow]
    details: list[TorqueDetail | LoopDetail]
    energy: dict[str, Array]


def tables(result: MisprintsResult) -> list[Table]:
    """Return the variants in open and in closed loop, and their details for the files."""
    runnable = [row for row in result.rows if row.misprint not in (RANGES, ENTRIES)]
    return [
        Table(
            result.rows,
            OPEN_COLUMNS,
            "Open loop",
            OPEN_LEGEND,
            key="rows",
            file="results.csv",
        ),
        Table(runnable, ENVELOPE, WIDTHS, ENVELOPE_LEGEND, prints="results.csv"),
        Table(runnable, APART, "Closed loop: how far apart", APART_LEGEND, prints="results.csv"),
        Table(result.details, key="details", file="details.csv"),
    ]


def costliest(rows: Sequence[MisprintRow], column: str) -> str:
    """Return the single misprint with the largest figure in a column."""
    single = [row for row in rows if row.misprint in MISPRINTS]
    return max(single, key=lambda row: getattr(row, column)).misprint


def verdict(result: MisprintsResult) -> str:
    """Return in words which misprint costs most, and whether that shows above chance."""
    rows = result.rows
    apart = {row.misprint: _sure("loop_to_consistent_simulink")(row) for row in rows}
    return (
        f"Costliest in energy: {costliest(rows, 'drift_brisk')}, from a bent beam "
        f"{costliest(rows, 'drift_bent')};\nat the driven tip: "
        f"{costliest(rows, 'tip_to_consistent_small')}, with large torques "
        f"{costliest(rows, 'tip_to_consistent_large')};\nin the frictionless loop: "
        f"{costliest(rows, 'loop_to_consistent_none')}. Under simulink chance\nsets runs "
        f"{apart['none']} mm apart, all misprints together {apart['all']} mm."
    )


def figures(result: MisprintsResult) -> Iterator[tuple[str, Figure]]:
    """Give energy over time, and tip differences over the pose."""
    yield "energy", energy_figure(result.energy)
    yield "tip", tip_figure([row for row in result.details if isinstance(row, TorqueDetail)])


@drawn
def energy_figure(energy: dict[str, Array]) -> Figure:
    """Return the relative change of energy (K,) over time, a curve per variant, on a log axis."""
    figure, panels = canvas(height=78)
    axes = panels[0, 0]
    widths = np.linspace(2.4, 0.8, len(energy))  # what is drawn first shows as a rim
    looks = zip(energy.items(), COLOURS, widths, cycle(DASHES))
    for (name, change), colour, width, dash in looks:
        time = PERIOD * np.arange(1, len(change), dtype=float)
        shown = np.maximum(np.abs(change[1:]), SMALLEST)
        axes.plot(*thinned(time, shown), color=colour, lw=width, ls=dash, label=name)
    log_axis(axes.yaxis)
    axes.set(xlabel="time [s]", ylabel="|relative change of energy|")
    axes.set_xlim(0, PERIOD * (len(change) - 1))
    caption = (
        f"Energy over that at the start, less one, in free, undamped motion from the start "
        f"{DRAWN}; an energy that is conserved stays at rounding."
    )
    return finish(figure, [axes], legend=4, caption=caption)


@drawn
def tip_figure(details: Sequence[TorqueDetail]) -> Figure:
    """Return the rms tip difference to the chain over theta2, a panel per amplitude."""
    cases = dict.fromkeys(row.case for row in details)
    names = dict.fromkeys(row.misprint for row in details)
    figure, ((*panels,),) = canvas(1, len(cases), height=85)
    for axes, case in zip(panels, cases, strict=True):
        looks = zip(names, COLOURS, MARKERS, cycle(DASHES))
        for name, colour, marker, dash in looks:
            mine = [row for row in details if (row.case, row.misprint) == (case, name)]
            pose, tip = [row.theta2 for row in mine], [UM * row.tip_to_chain for row in mine]
            how: dict[str, Any] = {"marker": marker, "color": colour, "linestyle": dash}
            axes.plot(pose, tip, **how, linewidth=0.8, label=name)
        log_axis(axes.yaxis)
        axes.set(xlabel="θ₂ at the start [rad]", ylabel="rms distance of the tips [µm]")
        axes.set_title(case)
    caption = "Distance of the tip from the chain's under the same torques, open loop, by pose."
    return finish(figure, panels, legend=4, caption=caption)
