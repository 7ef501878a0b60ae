"""The realisations' study in words, tables and figures.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from matplotlib.figure import Figure

from controllers import operator, response_error
from flexsim.numerics.clocks import PERIOD
from studies.core.figures import COLOURS, FONT, canvas, finish, mark, name_lines
from studies.core.paper import PLANTS
from studies.core.table import Column, Table
from studies.realisations.response import BAND_HZ, ORDERS, ResponseRow, band

RETAINED = ("tustin", 10)  # (2) with the p of section 3.2
DRAWN_ORDER = 0.5
DASHES = ("-", "--", "-.", ":")
INDEX = 1e4  # the tables' indices are in 1e-4 m2 s
GAINS = {"loop": "the same gains", "retuned": "gains tuned anew"}  # by part

Chosen = tuple[str, int]  # realisation and terms
AnyRow = TypeVar("AnyRow", "ResponseRow", "LoopRow")


@dataclass(frozen=True)
class LoopRow:
    """A trajectory under a controller's variations.

    The median index (5) [m2 s] and envelope [m] are infinite where most runs diverge, and None with
    the reason in `refused` where the controllers cannot be built; seed: of the search, if any.
    """

    part: str
    realisation: str
    terms: int
    plant: str
    trajectory: str
    bounded_share: float | None = None
    index: float | None = None
    envelope: float | None = None
    refused: str | None = None
    seed: int | None = None


@dataclass(frozen=True)
class ResponseSummary:
    """A realisation's errors over all orders and frequencies, and the cost of a sample."""

    realisation: str
    terms: int
    magnitude_rms_db: float
    magnitude_max_db: float
    phase_rms_deg: float
    phase_max_deg: float
    cost_ns: float


@dataclass(frozen=True)
class LoopSummary:
    """The median index over the searches of a case, and the realisation's mean factor to (2)."""

    realisation: str
    terms: int
    trajectory: str
    plant: str
    index: float | None
    factor: float

    @property
    def outcome(self) -> str:
        """The index in 1e-4 m2 s, or what became of the loops."""
        if self.index is None:
            return "-"
        return f"{INDEX * self.index:.3g}" if math.isfinite(self.index) else "div"


@dataclass(frozen=True, eq=False)
class RealisationsResult:
    """Rows by 'part': 'response', 'loop' with the tuned gains, 'retuned'."""

    rows: list[ResponseRow | LoopRow]

    @property
    def responses(self) -> list[ResponseRow]:
        """Errors and costs of the filters."""
        return [row for row in self.rows if isinstance(row, ResponseRow)]

    def loops(self, part: str) -> list[LoopRow]:
        """Return the closed loops of a part."""
        return [row for row in self.rows if isinstance(row, LoopRow) and row.part == part]


def _chosen(rows: Sequence[AnyRow]) -> dict[Chosen, list[AnyRow]]:
    """Return rows by realisation and terms, in their order."""
    found: dict[Chosen, list[AnyRow]] = {}
    for row in rows:
        found.setdefault((row.realisation, row.terms), []).append(row)
    return found


def response_summaries(rows: Sequence[ResponseRow]) -> list[ResponseSummary]:
    """Return each filter's rms and largest errors of all orders."""
    found = []
    for (realisation, terms), every in _chosen(rows).items():
        found.append(
            ResponseSummary(
                realisation,
                terms,
                float(np.sqrt(np.mean([row.magnitude_rms_db**2 for row in every]))),
                max(row.magnitude_max_db for row in every),
                float(np.sqrt(np.mean([row.phase_rms_deg**2 for row in every]))),
                max(row.phase_max_deg for row in every),
                every[0].cost_ns,
            )
        )
    return found


def _by_case(rows: Sequence[LoopRow]) -> dict[tuple[str, str], list[float | None]]:
    """Return indices by trajectory and plant; there is one per search."""
    cases: dict[tuple[str, str], list[float | None]] = {}
    for row in rows:
        cases.setdefault((row.trajectory, row.plant), []).append(row.index)
    return cases


def _median(indices: Sequence[float | None]) -> float | None:
    """Return the median index [m2 s], None if a controller could not be built."""
    known = [index for index in indices if index is not None]
    return float(np.median(known)) if len(known) == len(indices) else None


def relative_index(rows: Sequence[LoopRow], chosen: Chosen) -> float:
    """Return the geometric mean of the indices over that of (2), ten terms; inf if one fails.

    Args:
        rows: of a part; chosen: realisation and terms.
    """

    def logs(pair: Chosen) -> list[float]:
        mine = [row for row in rows if (row.realisation, row.terms) == pair]
        medians = map(_median, _by_case(mine).values())
        return [math.inf if each is None else math.log(each) for each in medians]

    own, retained = np.mean(logs(chosen)), np.mean(logs(RETAINED))
    return float(np.exp(own - retained)) if np.isfinite(retained) else math.inf


def loop_summaries(rows: Sequence[LoopRow]) -> list[LoopSummary]:
    """Return each realisation's median index, by case."""
    return [
        LoopSummary(*chosen, *case, _median(indices), relative_index(rows, chosen))
        for chosen in _chosen(rows)
        for case, indices in _by_case(
            [row for row in rows if (row.realisation, row.terms) == chosen]
        ).items()
    ]


RESPONSES = (
    Column("realisation"),
    Column("terms", form="d"),
    Column("magnitude_rms_db", "rms", "dB", ".2f"),
    Column("magnitude_max_db", "max", "dB", ".1f"),
    Column("phase_rms_deg", "rms", "deg", ".2f"),
    Column("phase_max_deg", "max", "deg", ".1f"),
    Column("cost_ns", "cost", "ns", ".0f"),
)


def _loop_columns(rows: Sequence[LoopRow]) -> tuple[Column, ...]:
    return (
        Column("realisation"),
        Column("terms", form="d"),
        *(
            Column("outcome", shape, form=lambda row: row.outcome, where={"trajectory": shape})
            for shape in dict.fromkeys(row.trajectory for row in rows)
        ),
        Column("factor", "to (2)", form=".2f", once=True),
    )


def tables(result: RealisationsResult) -> list[Table]:
    """Return the responses and both parts' loops."""
    loop, retuned = result.loops("loop"), result.loops("retuned")
    orders = f"orders {min(ORDERS)} to {max(ORDERS)}, {BAND_HZ[0]:g} to {BAND_HZ[1]:g} Hz"
    line = ("realisation", "terms")
    return [
        Table(result.rows, key="rows"),
        Table(result.responses, file="responses.csv"),
        Table(loop, file="loops.csv"),
        Table(retuned, file="retuned.csv"),
        Table(
            response_summaries(result.responses),
            RESPONSES,
            f"Error against (j omega)^nu, {orders};\ncost of a sample in the compiled filter",
        ),
        Table(
            loop_summaries(loop),
            _loop_columns(loop),
            "Median index (5) with the same gains, 1e-4 m2 s, assumed modes | chain;\n"
            "to (2): geometric mean over that of (2) with ten terms",
            line=line,
        ),
        Table(
            loop_summaries(retuned),
            _loop_columns(retuned),
            "The same, each tuned anew by a short search (medians of the searches)",
            line=line,
        ),
    ]


def verdict(result: RealisationsResult) -> str:
    """Return in words whether (2) is the best, with the gains as they are and tuned anew."""
    lines = []
    for part, gains in GAINS.items():
        rows = result.loops(part)
        factors = {pair: relative_index(rows, pair) for pair in _chosen(rows)}
        held = sum(map(math.isfinite, factors.values()))
        better = sorted((factor, pair) for pair, factor in factors.items() if factor < 1)
        text = f"With {gains} {held} of {len(factors)} hold everywhere, "
        if better:
            factor, (name, terms) = better[0]
            text += f"{len(better)} with a lower index than (2) with ten terms; lowest {name}, "
            text += f"{terms} terms, {factor:.2f} of it."
        else:
            text += "none with a lower index than (2) with ten terms."
        lines.append(text)
    if ratios := _spreads(result.loops("retuned")):
        spread = math.exp(np.mean(np.log(ratios)))
        lines.append(
            f"The worst of a realisation's searches is {spread:.2f} times its best (mean)."
        )
    return "\n".join(lines)


def _spreads(rows: Sequence[LoopRow]) -> list[float]:
    """Return the largest over the least index of each case's searches, where all held."""
    found = []
    for chosen in _chosen(rows):
        mine = [row for row in rows if (row.realisation, row.terms) == chosen]
        for case in _by_case(mine).values():
            known = [index for index in case if index is not None and math.isfinite(index)]
            if len(known) == len(case):
                found.append(max(known) / min(known))
    return found


def figures(result: RealisationsResult) -> Iterator[tuple[str, Figure]]:
    """Give the errors over frequency, and the index of every realisation, by part."""
    yield "responses", response_figure(list(_chosen(result.responses)))
    for part in GAINS:
        yield part, loop_figure(result.loops(part))


def response_figure(chosen: Sequence[Chosen]) -> Figure:
    """Return magnitude and phase errors over frequency at order 0.5."""
    names, omega = list(dict.fromkeys(name for name, _ in chosen)), band()
    figure, panels = canvas(2, len(names), height=10.0, sharex=True, sharey="row")
    for column, name, colour in zip(panels.T, names, COLOURS, strict=False):
        lengths = [terms for each, terms in chosen if each == name]
        for terms, dash in zip(lengths, DASHES, strict=False):
            b, a = operator(name, DRAWN_ORDER, PERIOD, terms)
            error = response_error(b, a, DRAWN_ORDER, 1.0, omega, PERIOD)
            for axes, values in zip(column, (error.magnitude_db, error.phase_deg), strict=True):
                axes.semilogx(omega / (2 * np.pi), values, dash, color=colour, label=f"{terms}")
        column[0].set_title(name)
        column[0].legend(title="terms", fontsize=FONT - 2, frameon=False)
        column[1].set_xlabel("f [Hz]")
    panels[0, 0].set_ylabel("magnitude error [dB]")
    panels[1, 0].set_ylabel("phase error [deg]")
    title = f"D^{DRAWN_ORDER:g} against (j omega)^{DRAWN_ORDER:g}"
    return finish(figure, panels.flat, title=title)


def loop_figure(loops: Sequence[LoopRow]) -> Figure:
    """Return the median index (5) of every realisation, a panel per trajectory."""
    chosen = list(_chosen(loops))
    shapes = list(dict.fromkeys(row.trajectory for row in loops))
    figure, ((*panels,),) = canvas(1, len(shapes), height=2.0 + 0.36 * len(chosen), sharey=True)
    for axes, shape in zip(panels, shapes, strict=True):
        for plant, shift in zip(PLANTS, (-0.14, 0.14), strict=True):
            marker, how = mark(plant)
            axes.plot([], [], marker, **how)
            for row in loops:
                if (row.trajectory, row.plant) != (shape, plant):
                    continue
                height = chosen.index((row.realisation, row.terms)) + shift
                if row.index is None or not math.isfinite(row.index):
                    place = axes.get_yaxis_transform()
                    axes.plot(0.985, height, "x", color=how["color"], transform=place)
                else:
                    axes.plot(row.index, height, marker, color=how["color"])
        axes.set_xscale("log")
        axes.set(title=shape, xlabel="index (5) [m2 s]; x: none")
    name_lines(panels[0], [f"{name}, {terms}" for name, terms in chosen])
    return finish(figure, panels, legend=2)
