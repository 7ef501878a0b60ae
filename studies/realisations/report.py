"""The realisations' study in words, tables and figures.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from controllers import operator, response_error
from flexsim.numerics.clocks import PERIOD
from studies.core.figures import (
    COLOURS,
    DASHES,
    INDEX,
    INDEX_UNIT,
    canvas,
    drawn,
    finish,
    interval,
    log_axis,
    mark,
    name_lines,
)
from studies.core.paper import PLANTS
from studies.core.table import Column, Table
from studies.realisations.response import BAND_HZ, ORDERS, band
from studies.realisations.rows import (
    GAINS,
    Chosen,
    FactorRow,
    LoopRow,
    RealisationsResult,
    by_case,
    by_choice,
    factor_rows,
    loop_summaries,
    response_summaries,
)

DRAWN_ORDER = 0.5

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
        Column("factor", "to (2)", form=lambda row: row.factor, once=True),
    )


def tables(result: RealisationsResult) -> list[Table]:
    """Return the responses and both parts' loops."""
    loop, retuned = result.loops("loop"), result.loops("retuned")
    factors = factor_rows(result)
    orders = f"orders {min(ORDERS)} to {max(ORDERS)}, {BAND_HZ[0]:g} to {BAND_HZ[1]:g} Hz"
    return [
        Table(result.rows, key="rows"),
        Table(result.responses, file="responses.csv"),
        Table(loop, file="loops.csv"),
        Table(retuned, file="retuned.csv"),
        Table(factors, key="factors", file="factors.csv"),
        Table(
            response_summaries(result.responses),
            RESPONSES,
            f"Error against (j omega)^nu, {orders};\ncost of a sample in the compiled filter",
            prints="responses.csv",
        ),
        _loop_table(
            loop,
            [row for row in factors if row.part == "loop"],
            "Median index (5) with the same gains, 1e-4 m2 s, assumed modes | chain;\n"
            "to (2): geometric mean over that of (2) with ten terms, and its 95 % interval",
            "loops.csv",
        ),
        _loop_table(
            retuned,
            [row for row in factors if row.part == "retuned"],
            "The same, each tuned anew by a short search: medians of the searches; to (2): and\n"
            "its 95 % interval over the searches",
            "retuned.csv",
        ),
    ]


def _loop_table(
    rows: Sequence[LoopRow], factors: Sequence[FactorRow], title: str, prints: str
) -> Table:
    """Return the table of a part's loops."""
    return Table(
        loop_summaries(rows, factors),
        _loop_columns(rows),
        title,
        line=("realisation", "terms"),
        tight=True,
        prints=prints,
    )


def verdict(result: RealisationsResult) -> str:
    """Return in words whether (2) is the best, with the gains as they are and tuned anew."""
    lines = []
    for part, gains in GAINS.items():
        factors = [row for row in factor_rows(result) if row.part == part]
        held = sum(math.isfinite(row.factor) for row in factors)
        better = sorted((row for row in factors if row.factor < 1), key=lambda row: row.factor)
        text = f"With {gains} {held} of {len(factors)} hold everywhere, "
        if better:
            least = better[0]
            text += f"{len(better)} with a lower index than (2) with ten terms; lowest "
            text += f"{least.realisation}, {least.terms} terms, {least.shown} of it."
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
    for chosen in by_choice(rows):
        mine = [row for row in rows if (row.realisation, row.terms) == chosen]
        for case in by_case(mine).values():
            known = [index for index in case if index is not None and math.isfinite(index)]
            if len(known) == len(case):
                found.append(max(known) / min(known))
    return found


def figures(result: RealisationsResult) -> Iterator[tuple[str, Figure]]:
    """Give the errors over frequency, and the index of every realisation, by part."""
    yield "responses", response_figure(list(by_choice(result.responses)))
    for part in GAINS:
        yield part, loop_figure(result.loops(part))


@drawn
def response_figure(chosen: Sequence[Chosen]) -> Figure:
    """Return magnitude and phase errors over frequency at order 0.5."""
    names, omega = list(dict.fromkeys(name for name, _ in chosen)), band()
    figure, panels = canvas(2, len(names), height=98, sharex=True, sharey="row")
    terms_of = sorted({terms for _, terms in chosen})
    for column, name in zip(panels.T, names, strict=False):
        for terms in (terms for each, terms in chosen if each == name):
            b, a = operator(name, DRAWN_ORDER, PERIOD, terms)
            error = response_error(b, a, DRAWN_ORDER, 1.0, omega, PERIOD)
            place = terms_of.index(terms) % len(DASHES)
            how = {"color": COLOURS[place], "linestyle": DASHES[place], "label": f"{terms} terms"}
            for axes, values in zip(column, (error.magnitude_db, error.phase_deg), strict=True):
                axes.plot(omega / (2 * np.pi), values, **how)
        column[0].set_title(name.replace("-", "-\n", 1))
        for axes in column:
            log_axis(axes.xaxis, most=4)
        column[1].set_xlabel("frequency [Hz]")
    panels[0, 0].set_ylabel("magnitude error [dB]")
    panels[1, 0].set_ylabel("phase error [°]")
    caption = (
        f"Errors of the realisations of D^{DRAWN_ORDER:g} against (jω)^{DRAWN_ORDER:g}, over "
        "frequency, by number of terms."
    )
    return finish(figure, panels.flat, legend=len(terms_of), caption=caption)


def _shown(index: float | None) -> float | None:
    return None if index is None else INDEX * index


@drawn
def loop_figure(loops: Sequence[LoopRow]) -> Figure:
    """Return the median index (5) of every realisation with its interval, by trajectory."""
    chosen = list(by_choice(loops))
    shapes = list(dict.fromkeys(row.trajectory for row in loops))
    height = 26 + 6 * len(chosen)
    figure, ((*panels,),) = canvas(1, len(shapes), height=height, sharey=True)
    for axes, shape in zip(panels, shapes, strict=True):
        for plant, shift in zip(PLANTS, (-0.17, 0.17), strict=True):
            marker, how = mark(plant)
            axes.plot([], [], marker, **how)
            for row in loops:
                if (row.trajectory, row.plant) != (shape, plant):
                    continue
                line = chosen.index((row.realisation, row.terms)) + shift
                if row.index is None or not math.isfinite(row.index):
                    place = axes.get_yaxis_transform()
                    axes.plot(0.97, line, "x", color=how["color"], transform=place)
                else:
                    low, high = (_shown(row.spread.get(f"index_{end}")) for end in ("low", "high"))
                    place = INDEX * row.index
                    interval(axes, place, line, (low, high), marker, color=how["color"])
        log_axis(axes.xaxis, most=4)
        axes.margins(x=0.12)
        axes.set(title=shape, xlabel=f"index (5) [{INDEX_UNIT}]")
    if any(row.index is None or not math.isfinite(row.index) for row in loops):
        label = "diverged, or cannot be built"
        panels[0].plot([], [], "x", color="0.4", linestyle="none", label=label)
    name_lines(panels[0], [f"{name}, {terms}" for name, terms in chosen])
    caption = (
        "Index (5) by realisation and number of terms: medians with 95 % intervals where there are "
        "six runs or more."
    )
    return finish(figure, panels, legend=3, caption=caption)
