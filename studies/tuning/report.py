"""What a tuning run leaves beside its generations: result, convergence as table, figure, recording.

>>> finish(run, search, tuning, scenarios=1)    # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from flexsim.errors import RunError
from flexsim.files.atomic import write_text
from flexsim.numerics.types import Array
from flexsim.recording.tuning.convergence import write_convergence
from studies.core.figures import (
    BLUE,
    DASHES,
    GREEN,
    INDEX,
    INDEX_UNIT,
    ORANGE,
    SINGLE,
    canvas,
    drawn,
    finish,
    log_axis,
    unmathed,
    write_figures,
)
from studies.core.folder import describe, to_json
from studies.core.study_options import FORMATS, Format
from studies.core.table import Column, Table, write_files
from studies.tuning.distributions import NAMES
from studies.tuning.genetic import Search
from studies.tuning.individuals import in_si
from studies.tuning.kept import RESULT, described
from studies.tuning.record import CONCLUDED, drawings
from studies.tuning.tuning import Tuning

COURSE = Table(
    (),
    (
        Column("generation", form="d"),
        Column("evaluations", form="d"),
        Column("best", "best index", "m2 s", form=".6g"),
        Column("median", "median index", "m2 s", form=".6g"),
        Column("stable_share", "stable", "%", form=".1f", scale=100),
    ),
    "Index (5), best so far and median, and the share that is stable, by generation",
    file="convergence.csv",
)


@dataclass(frozen=True)
class GenerationRow:
    """A search after one of its generations.

    Attributes:
        evaluations: so far. best: so far, median: of the population, of the index (5) [m2 s], inf
            where diverged. stable_share: of the population.
    """

    generation: int
    evaluations: int
    best: float
    median: float
    stable_share: float


def course(search: Search) -> list[GenerationRow]:
    """Return a row per generation."""
    rows: list[GenerationRow] = []
    best, evaluations = np.inf, 0
    for each in search.generations:
        best = min(best, float(each.indices.min()))
        evaluations += each.evaluated
        ordered = np.sort(each.indices)
        median = float(ordered[(len(ordered) - 1) // 2])  # the lower, never inf - inf
        rows.append(GenerationRow(each.number, evaluations, best, median, each.stable_share))
    return rows


def result_of(search: Search, scenarios: int, rated: Mapping[str, float] = {}) -> dict[str, Any]:
    """Return the result as JSON has it; without a stable individual its best is None.

    Args:
        search: as named. scenarios: simulations per evaluation.
        rated: the best's index by plant, where it was rated on others than were simulated.
    """
    best = search.best_parameters
    si = None if best is None else in_si(best[None])[0]
    return {
        "best_index": search.best_index,
        "rated_index": max(rated.values(), default=None),
        "rated": dict(rated),
        "best_parameters": _named(best),
        "best_parameters_si": _named(si),
        "generations": len(search.generations),
        "evaluations": search.evaluations,
        "simulations": search.evaluations * scenarios,
        "stable_share": search.stable_share,
        "ended": search.ended,
        "answer": summary(search, rated),
    }


def _named(parameters: Array | None) -> dict[str, float] | None:
    if parameters is None:
        return None
    return dict(zip(NAMES, parameters.tolist(), strict=True))


@drawn
def course_figure(search: Search, title: str) -> Figure:
    """Return individuals, median and best index, and the stable share, over generations."""
    rows = course(search)
    column = {name: np.array([getattr(row, name) for row in rows], float) for name in vars(rows[0])}
    shown = {name: np.where(np.isfinite(c), c, np.nan) for name, c in column.items()}
    generation = column["generation"]
    how: dict[str, Any] = {"width": SINGLE, "sharex": True, "height_ratios": [2.2, 1]}
    figure, panels = canvas(2, 1, height=95, **how)
    upper, lower = panels.ravel()
    if search.best_parameters is not None:
        numbers = np.concatenate([np.full(len(g.indices), g.number) for g in search.generations])
        indices = np.concatenate([each.indices for each in search.generations])
        held = np.isfinite(indices)
        dots: dict[str, Any] = {"color": "0.7", "markersize": 2, "linestyle": "none"}
        upper.plot(
            numbers[held],
            INDEX * indices[held],
            ".",
            **dots,
            label="a stable individual",
            rasterized=True,
        )
        dashed = {"color": ORANGE, "linestyle": DASHES[1], "linewidth": 1.2}
        upper.plot(generation, INDEX * shown["median"], label="median of all", **dashed)
        upper.plot(
            generation, INDEX * shown["best"], color=BLUE, linewidth=1.4, label="best so far"
        )
        log_axis(upper.yaxis)
    else:
        upper.text(0.5, 0.5, "every individual diverged", ha="center", transform=upper.transAxes)
    upper.set(ylabel=f"index (5) [{INDEX_UNIT}]")
    lower.plot(generation, 100 * column["stable_share"], color=GREEN)
    lower.set(xlabel="generation", ylabel="stable [%]", ylim=(0, 105))
    caption = f"{title}. Index (5) of all individuals and share that is stable, by generation."
    return finish(figure, [upper, lower], legend=2, caption=unmathed(caption))


def is_concluded(
    folder: Path,
    search: Search,
    scenarios: int,
    rated: Mapping[str, float] = {},
    formats: Sequence[Format] = FORMATS,
) -> bool:
    """Return whether a run's folder has all that `conclude` writes; the result comes last."""
    if any(not (folder / name).is_file() for name in (*CONCLUDED, *drawings(formats))):
        return False
    return (folder / RESULT).read_bytes() == _result_text(search, scenarios, rated).encode()


def _result_text(search: Search, scenarios: int, rated: Mapping[str, float]) -> str:
    return to_json(result_of(search, scenarios, rated)) + "\n"


def conclude(
    folder: Path,
    search: Search,
    tuning: Tuning,
    scenarios: int,
    rated: Mapping[str, float] = {},
    formats: Sequence[Format] = FORMATS,
) -> None:
    """Write result, convergence table, figure and recording into a run's folder.

    Raises:
        RunError: a file cannot be written.
    """
    rows = course(search)
    best, median, stable = (
        np.array([getattr(row, name) for row in rows], float)
        for name in ("best", "median", "stable_share")
    )
    about = {name: str(value) for name, value in vars(tuning).items()}
    try:
        write_files(folder, [replace(COURSE, rows=rows)])
        drawing = course_figure(search, described(tuning))
        write_figures(folder, [("convergence", drawing)], formats)
        write_convergence(
            folder / "convergence.rrd", "index (5) [m2 s]", best, median, stable, about
        )
        write_text(folder / RESULT, _result_text(search, scenarios, rated))
        describe(folder)
    except RunError:
        raise
    except OSError as error:
        raise RunError(f"{folder}: cannot write the results: {error.strerror}") from None


@dataclass(frozen=True)
class ParameterRow:
    """One parameter in Table 1's units and in SI."""

    name: str
    milliseconds: float
    si: float


PARAMETERS = (
    Column("name", ""),
    Column("milliseconds", "time in ms", form=".6g"),
    Column("si", "SI", form=".6g"),
)


def result_table(search: Search) -> Table:
    """Return the best parameters in Table 1's units and in SI, none if all diverged."""
    best = search.best_parameters
    pairs = [] if best is None else zip(NAMES, best, in_si(best[None])[0], strict=True)
    rows = [ParameterRow(name, float(drawn), float(si)) for name, drawn, si in pairs]
    return Table(rows, PARAMETERS, "Best parameters")


def as_json(
    search: Search,
    scenarios: int,
    run: Path,
    more: Mapping[str, Any],
    rated: Mapping[str, float] = {},
) -> str:
    """Return what --json prints: the result, and `more` that is of this session only."""
    return to_json({**result_of(search, scenarios, rated), "run": str(run), **more})


def summary(search: Search, rated: Mapping[str, float] = {}) -> str:
    """Return in one line how a search went."""
    on = ", ".join(f"{index:.6g} on {plant}" for plant, index in rated.items())
    found = (
        f"best index {search.best_index:.6g} m2 s" + (f" (rated: {on})" if on else "")
        if search.best_parameters is not None
        else "every individual diverged"
    )
    return (
        f"{found}; {len(search.generations)} generations, {search.evaluations} evaluations, "
        f"{100 * search.stable_share:.1f} % stable; {search.ended}"
    )
