"""What a tuning run leaves beside its generations: result, convergence as table, figure, recording.

>>> finish(run, search, tuning, scenarios=1)    # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from flexsim.errors import RunError
from flexsim.files.atomic import write_text
from flexsim.numerics.types import Array
from flexsim.recording.tuning_rrd import write_convergence
from studies.core.figures import BLUE, FONT, GREEN, ORANGE, canvas, finish, save
from studies.core.folder import to_json
from studies.core.table import Column, Table
from studies.tuning.distributions import NAMES
from studies.tuning.genetic import Search
from studies.tuning.individuals import in_si
from studies.tuning.kept import RESULT, described
from studies.tuning.tuning import Tuning

TABLE, RECORDING = "convergence.csv", "convergence.rrd"
FIGURE = "figures/convergence.png"


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


def course_figure(search: Search, title: str) -> Figure:
    """Return individuals, median and best index, and the stable share, over generations."""
    rows = course(search)
    column = {name: np.array([getattr(row, name) for row in rows], float) for name in vars(rows[0])}
    shown = {name: np.where(np.isfinite(c), c, np.nan) for name, c in column.items()}
    generation = column["generation"]
    figure, panels = canvas(2, 1, height=9.0, sharex=True, height_ratios=[2, 1])
    upper, lower = panels.ravel()
    if search.best_parameters is not None:
        numbers = np.concatenate([np.full(len(g.indices), g.number) for g in search.generations])
        indices = np.concatenate([each.indices for each in search.generations])
        held = np.isfinite(indices)
        upper.plot(numbers[held], indices[held], ".", color="0.75", markersize=4, label="stable")
        upper.plot(generation, shown["median"], color=ORANGE, linewidth=1.8, label="median of all")
        upper.plot(generation, shown["best"], color=BLUE, linewidth=2.6, label="best so far")
        upper.set_yscale("log")
        upper.legend(fontsize=FONT, frameon=False)
    else:
        upper.text(0.5, 0.5, "every individual diverged", ha="center", transform=upper.transAxes)
    upper.set(ylabel="index (5) [m² s]", title=title)
    lower.plot(generation, 100 * column["stable_share"], color=GREEN, linewidth=2.0)
    lower.set(xlabel="generation", ylabel="stable [%]", ylim=(0, 105))
    return finish(figure, [upper, lower])


def is_concluded(
    folder: Path, search: Search, scenarios: int, rated: Mapping[str, float] = {}
) -> bool:
    """Return whether a run's folder has all that `conclude` writes; the result comes last."""
    if any(not (folder / name).is_file() for name in (TABLE, FIGURE, RECORDING, RESULT)):
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
        Table(rows).write_csv(folder / TABLE)
        (folder / FIGURE).parent.mkdir(exist_ok=True)
        save(course_figure(search, described(tuning)), folder / FIGURE)
        write_convergence(folder / RECORDING, "index (5) [m2 s]", best, median, stable, about)
        write_text(folder / RESULT, _result_text(search, scenarios, rated))
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
