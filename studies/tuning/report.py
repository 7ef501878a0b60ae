"""What a tuning run leaves beside its generations: result, convergence as table, figure, recording.

>>> finish(run, search, tuning, scenarios=1)    # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from flexsim.errors import RunError
from flexsim.numerics.atomic import write_text
from flexsim.numerics.types import Array
from flexsim.recording.tuning_rrd import write_convergence
from studies.core.figures import DPI, FONT, finish, save
from studies.core.folder import to_json, write_rows
from studies.tuning.distributions import NAMES
from studies.tuning.genetic import Search
from studies.tuning.individuals import in_si
from studies.tuning.problem import Tuning

RESULT = "result.json"
TABLE, RECORDING = "convergence.csv", "convergence.rrd"
FIGURE = "figures/convergence.png"
SIZE = (16.0, 9.0)  # [in], 1600 px wide
BEST, MEDIAN, STABLE = "#0072B2", "#E69F00", "#009E73"  # Okabe and Ito's


def convergence(search: Search) -> list[dict[str, Any]]:
    """Return a row per generation.

    Returns:
        generation; evaluations so far; best so far and median of the population's indices
        [m2 s], inf where diverged; stable_share of the population.
    """
    rows: list[dict[str, Any]] = []
    best, evaluations = np.inf, 0
    for each in search.generations:
        best = min(best, float(each.indices.min()))
        evaluations += each.evaluated
        ordered = np.sort(each.indices)
        rows.append(
            {
                "generation": each.number,
                "evaluations": evaluations,
                "best": best,
                "median": float(ordered[(len(ordered) - 1) // 2]),  # the lower, never inf - inf
                "stable_share": each.stable_share,
            }
        )
    return rows


def result_of(search: Search, scenarios: int) -> dict[str, Any]:
    """Return the result as JSON has it; without a stable individual its best is None.

    Args:
        search: as named. scenarios: simulations per evaluation.
    """
    best = search.best_parameters
    si = None if best is None else in_si(best[None])[0]
    return {
        "best_index": search.best_index,
        "best_parameters": _named(best),
        "best_parameters_si": _named(si),
        "generations": len(search.generations),
        "evaluations": search.evaluations,
        "simulations": search.evaluations * scenarios,
        "stable_share": search.stable_share,
        "ended": search.ended,
    }


def _named(parameters: Array | None) -> dict[str, float] | None:
    if parameters is None:
        return None
    return dict(zip(NAMES, parameters.tolist(), strict=True))


def convergence_figure(search: Search, title: str, path: Path) -> None:
    """Write individuals, median and best index, and the stable share, over generations.

    Args:
        search: as named. title: of the figure.
        path: the PNG to write; a file already there is replaced.

    Raises:
        RunError: the file cannot be written.
    """
    rows = convergence(search)
    column = {name: np.array([row[name] for row in rows], float) for name in rows[0]}
    shown = {name: np.where(np.isfinite(c), c, np.nan) for name, c in column.items()}
    generation = column["generation"]
    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    if search.best_parameters is not None:
        numbers = np.concatenate([np.full(len(g.indices), g.number) for g in search.generations])
        indices = np.concatenate([each.indices for each in search.generations])
        held = np.isfinite(indices)
        upper.plot(numbers[held], indices[held], ".", color="0.75", markersize=4, label="stable")
        upper.plot(generation, shown["median"], color=MEDIAN, linewidth=1.8, label="median of all")
        upper.plot(generation, shown["best"], color=BEST, linewidth=2.6, label="best so far")
        upper.set_yscale("log")
        upper.legend(fontsize=FONT, frameon=False)
    else:
        upper.text(0.5, 0.5, "every individual diverged", ha="center", transform=upper.transAxes)
    upper.set(ylabel="index (5) [m² s]", title=title)
    lower.plot(generation, 100 * column["stable_share"], color=STABLE, linewidth=2.0)
    lower.set(xlabel="generation", ylabel="stable [%]", ylim=(0, 105))
    finish(figure, [upper, lower])
    save(figure, path)


def described(tuning: Tuning) -> str:
    """Return in one line what was tuned."""
    how = f"{tuning.controller} ({tuning.realisation})"
    return (
        f"{tuning.trajectory}, {tuning.plant}, {how}, setting {tuning.setting}, "
        f"{tuning.tuner}, seed {tuning.seed}"
    )


def is_concluded(folder: Path, search: Search, scenarios: int) -> bool:
    """Return whether a run's folder has all that `conclude` writes; the result comes last."""
    if any(not (folder / name).is_file() for name in (TABLE, FIGURE, RECORDING, RESULT)):
        return False
    return (folder / RESULT).read_bytes() == _result_text(search, scenarios).encode()


def _result_text(search: Search, scenarios: int) -> str:
    return to_json(result_of(search, scenarios)) + "\n"


def conclude(folder: Path, search: Search, tuning: Tuning, scenarios: int) -> None:
    """Write result, convergence table, figure and recording into a run's folder.

    Raises:
        RunError: a file cannot be written.
    """
    rows = convergence(search)
    best, median, stable = (
        np.array([row[name] for row in rows], float) for name in ("best", "median", "stable_share")
    )
    about = {name: str(value) for name, value in vars(tuning).items()}
    try:
        write_rows(folder / TABLE, rows)
        (folder / FIGURE).parent.mkdir(exist_ok=True)
        convergence_figure(search, described(tuning), folder / FIGURE)
        write_convergence(folder / RECORDING, "index (5) [m2 s]", best, median, stable, about)
        write_text(folder / RESULT, _result_text(search, scenarios))
    except RunError:
        raise
    except OSError as error:
        raise RunError(f"{folder}: cannot write the results: {error.strerror}") from None


def result_table(search: Search) -> Table | None:
    """Return the best parameters in Table 1's units and in SI, or None if all diverged."""
    best = search.best_parameters
    if best is None:
        return None
    table = Table(title="Best parameters", title_justify="left")
    table.add_column("")
    table.add_column("time in ms", justify="right")
    table.add_column("SI", justify="right")
    for name, drawn, si in zip(NAMES, best, in_si(best[None])[0], strict=True):
        table.add_row(name, f"{drawn:.6g}", f"{si:.6g}")
    return table


def as_json(search: Search, scenarios: int, run: Path, more: Mapping[str, Any]) -> str:
    """Return what --json prints: the result, and `more` that is of this session only."""
    return to_json({**result_of(search, scenarios), "run": str(run), **more})


def summary(search: Search) -> str:
    """Return in one line how a search went."""
    found = (
        f"best index {search.best_index:.6g} m2 s"
        if search.best_parameters is not None
        else "every individual diverged"
    )
    return (
        f"{found}; {len(search.generations)} generations, {search.evaluations} evaluations, "
        f"{100 * search.stable_share:.1f} % stable; {search.ended}"
    )
