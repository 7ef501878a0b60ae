"""The laboratory study's figures: factors over sizes, probabilities, Sobol' indices.

>>> dict(figures_of(result)).keys()      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.core.figures import (
    COLOURS,
    DASHES,
    MARKERS,
    canvas,
    drawn,
    finish,
    interval,
    log_axis,
    name_lines,
)
from studies.laboratory.alone import Curve
from studies.laboratory.rows import Ground, IndexRow, LaboratoryResult, paper_cases
from studies.laboratory.showing.answering import likely
from studies.laboratory.showing.more_tables import index_lines
from studies.laboratory.together import LUCK, TOGETHER

ACROSS, PANELS = 5, 30
LEAST, MOST = 0.4, 20.0  # factors drawn
TELLING = 1.6  # a factor that a suspect exceeds somewhere, to have a panel
HYPOTHESES = 14  # lines of the probabilities
LINES = 12  # of the indices


def figures_of(result: LaboratoryResult) -> Iterator[tuple[str, Figure]]:
    """Give the figures of a result, those of which there is something to draw."""
    for ground in result.grounds:
        if ground.plant == result.grounds[0].plant:
            both = [each for each in result.grounds if each.controllers == ground.controllers]
            yield f"factors_{ground.controllers}", factor_figure(both)
    yield "hypotheses", probability_figure(result)
    for controllers in dict.fromkeys(each.controllers for each in result.grounds):
        lines = [line for line in index_lines(result) if line.controllers == controllers]
        if any(line.suspect not in (LUCK, TOGETHER) for line in lines):
            names = list(dict.fromkeys(line.suspect for line in lines))
            rows = [row for row in result.indices if row.controllers == controllers]
            yield f"sobol_{controllers}", index_figure(rows, names)


@drawn
def factor_figure(grounds: Sequence[Ground]) -> Figure:
    """Return the factors over every suspect's size, a panel for each.

    Args:
        grounds: of the same controllers on several plants, the first drawn full.
    """
    names = _telling(grounds[0].curves)
    rows = -(-len(names) // ACROSS) or 1
    figure, panels = canvas(rows, ACROSS, height=24 + 30 * rows, sharey=True)
    for axes, name in zip(panels.flat, names, strict=False):
        for place, ground in enumerate(grounds):
            (curve,) = [each for each in ground.curves if each.name == name]
            _draw(axes, curve, place)
        axes.set_ylim(LEAST, MOST)
        unit = curve.suspect.unit
        axes.set_title(f"{name}{f' [{unit}]' * bool(unit)}")
        log_axis(axes.yaxis, most=4)
        log_axis(axes.xaxis, most=3)
    for axes in list(panels.flat)[len(names) :]:
        axes.set_axis_off()
    for axes in panels[:, 0]:
        axes.set_ylabel("envelope / bench")
    first = panels[0, 0]
    for case, paper in enumerate(paper_cases()):
        first.plot([], [], color=COLOURS[case], label=f"{paper.name}: paper {paper.factor:.1f}")
    first.plot([], [], "x", color="0.3", label="half or more diverge")
    for place, ground in enumerate(grounds):
        first.plot([], [], color="0.3", linestyle=DASHES[place], label=ground.plant)
    caption = (
        f"Envelopes over those of the bench, {grounds[0].controllers} controllers, by the size of "
        f"each suspect alone, of those that exceed {TELLING:g} somewhere: medians; intervals in "
        f"alone.csv. Bands: the paper's factors, with what rounding leaves. Cut off at {MOST:g}."
    )
    return finish(figure, panels.flat, legend=4, caption=caption)


def _telling(curves: Sequence[Curve]) -> list[str]:
    """Return the names of curves that somewhere exceed TELLING or diverge; all if none does."""
    sized = [curve for curve in curves if curve.suspect.sized]
    some = [curve.name for curve in sized if curve.ratio().max() > TELLING]
    return (some or [curve.name for curve in sized])[:PANELS]


def _draw(axes: Axes, curve: Curve, place: int) -> None:
    """Draw a suspect's curves on one plant, and with the first the paper's factors."""
    ratio, sizes = curve.ratio(), curve.suspect.scale * curve.sizes
    for case, paper in enumerate(paper_cases()):
        colour = COLOURS[case]
        if place == 0:
            axes.axhspan(*paper.ends, color=colour, alpha=0.15, linewidth=0)
        own = np.where(np.isfinite(ratio[:, case]), ratio[:, case], np.nan)
        axes.plot(sizes, own, color=colour, linestyle=DASHES[place], linewidth=1.0 - 0.2 * place)
        lost = sizes[np.isinf(ratio[:, case])]
        height = MOST * 0.86 ** (case + 1)
        axes.plot(lost, np.full(len(lost), height), "x", color=colour, markersize=2.6)


@drawn
def probability_figure(result: LaboratoryResult) -> Figure:
    """Return the probability of each hypothesis on every ground, with its interval."""
    best: dict[str, float] = {}
    for ground in result.grounds:
        for row in likely(result, ground):
            best[row.hypothesis] = max(best.get(row.hypothesis, 0.0), row.probability)
    names = sorted(best, key=lambda name: -best[name])[:HYPOTHESES]
    figure, ((axes,),) = canvas(1, 1, height=26 + 5 * len(names))
    count = len(result.grounds)
    for place, ground in enumerate(result.grounds):
        shift = 0.6 * ((place + 0.5) / count - 0.5)
        how = {"color": COLOURS[place]}
        label = f"{ground.controllers}, {ground.plant}"
        axes.plot([], [], MARKERS[place], linestyle="none", label=label, **how)
        for row in likely(result, ground):
            if row.hypothesis in names:
                ends = (100 * row.probability_low, 100 * row.probability_high)
                height = names.index(row.hypothesis) + shift
                interval(axes, 100 * row.probability, height, ends, MARKERS[place], **how)
    name_lines(axes, names)
    axes.set_xlabel("probability given the paper's four factors [%]")
    caption = (
        "Probabilities of hypotheses that are equally likely before, given Table 3's factors; "
        "intervals of 95 % by a bootstrap of the simulated runs."
    )
    return finish(figure, [axes], legend=2, caption=caption)


@drawn
def index_figure(indices: Sequence[IndexRow], told: Sequence[str]) -> Figure:
    """Return what suspects explain alone, by case and plant.

    Args:
        indices: under the same controllers. told: from nothing somewhere; luck and together, too.
    """
    rows = [row for row in indices if row.found.of == "factor" and row.found.suspect in told]
    plants = list(dict.fromkeys(row.plant for row in rows))
    most = dict.fromkeys(told, 0.0)
    for row in rows:
        most[row.found.suspect] = max(most[row.found.suspect], row.found.first or 0.0)
    last = (LUCK, TOGETHER)
    names = sorted((name for name in told if name not in last), key=lambda name: -most[name])
    names = [*names[: LINES - len(last)], *last]
    cases = [each.name for each in paper_cases()]
    figure, panels = canvas(1, len(cases), height=30 + 5 * len(names), sharey=True)
    for row in rows:
        if row.found.suspect not in names or row.found.first is None:
            continue
        place = plants.index(row.plant)
        height = names.index(row.found.suspect) + 0.36 * ((place + 0.5) / len(plants) - 0.5)
        ends = (row.found.first_low, row.found.first_high)
        axes = panels[0, cases.index(row.found.case)]
        how = {"color": COLOURS[place]}
        interval(axes, row.found.first, height, ends, MARKERS[place], **how)
    for axes, case in zip(panels.flat, cases, strict=True):
        axes.set(title=case, xlabel="share of variance", xlim=(-0.15, 1.15))
    for place, plant in enumerate(plants):
        how = {"color": COLOURS[place], "linestyle": "none", "label": plant}
        panels[0, 0].plot([], [], MARKERS[place], **how)
    name_lines(panels[0, 0], names)
    caption = (
        f"Sobol' indices of first order of the factor's logarithm, {rows[0].controllers} "
        "controllers: shares of a run's variance, with 95 % intervals by a jackknife. Luck: what "
        "runs of the same sizes differ by; together: what none explains alone."
    )
    return finish(figure, panels.flat, legend=2, caption=caption)
