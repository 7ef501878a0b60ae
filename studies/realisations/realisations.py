"""Which realisation of a fractional operator serves the loop best? Is it (2), as the paper says?

    >>> result = run(RealisationsConfig(quick=True))
    >>> result.rows[0]["realisation"], result.rows[0]["magnitude_rms_db"]

All of section 3.1's alternatives and Oustaloup's filter, at several lengths: the error against
(j omega)^nu over a band, the cost of a sample in the compiled filter, and the closed loop with
the same gains on both plants. The gains were tuned for (2) with ten terms, which is an advantage
for it; so every realisation, (2) as well, is then tuned anew by a short search with the paper's
genetic algorithm on the assumed modes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from controllers import TUNED, Controller, ControllerError, Gains, operator
from flexsim.errors import ParameterError
from flexsim.loop.metrics import envelope_half_width
from flexsim.loop.runs import evaluate
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import reference, trajectory
from flexsim.plants.base import Plant
from studies.core.carry_out import carried_out
from studies.core.folder import to_json, write_config, write_rows
from studies.core.options import RobotOptions
from studies.core.repeats import perturbed
from studies.realisations.report import (
    loop_figure,
    loop_table,
    response_figure,
    response_table,
    verdict,
)
from studies.realisations.response import BAND_HZ, ORDERS, band, response_row, sample_cost
from studies.tuning.problem import Tuning, distribution_for, problem_of, tune

PERIOD = 1e-3  # [s] control period of the paper
LENGTHS = {  # terms tried: series need many, fractions round away when PIDs have over five
    "tustin": (5, 10, 20, 50),
    "gruenwald-letnikov": (5, 10, 20, 50),
    "impulse-response": (5, 10, 20, 50),
    "tustin-fraction": (2, 3, 5),
    "backward-fraction": (2, 3, 5),
    "oustaloup": (2, 3, 5),
}
QUICK_LENGTHS = (5, 10)
PATHS = ("line", "two-loop", "circle")
QUICK_PATHS = ("circle",)
QUICK_RUNS = 2
READING = "print"  # setting that the gains were tuned under
SEEN_EVERY = 2  # samples, for the envelope
PARTS = {"response": "responses.csv", "loop": "loops.csv", "retuned": "retuned.csv"}
RETUNED_TERMS = {  # one length of each is tuned anew
    "tustin": 10,
    "gruenwald-letnikov": 10,
    "impulse-response": 10,
    "tustin-fraction": 3,
    "backward-fraction": 3,
    "oustaloup": 3,
}
SEARCH, QUICK_SEARCH = (50, 15), (20, 3)  # population, generations
SEEDS = 3  # searches of each


@dataclass(frozen=True)
class RealisationsConfig(RobotOptions):
    """Compare the realisations of a fractional operator: response, cost, closed loop."""

    out: Path = Path("runs/realisations")
    """Folder of the run, made anew."""
    force: bool = False
    """Replace the run that is there."""
    quick: bool = False
    """Two lengths, one trajectory and two runs each only."""
    perturbations: int = 10
    """Runs in closed loop behind each median, the gains' fourth digits perturbed."""
    seed: int = 1
    """Seed of the perturbations, and the first of the searches."""
    segments: int | None = None
    """Segments of the chain; 6 unless given."""
    modes: int = 3
    """Assumed modes, n."""
    threads: int | None = None
    """Threads; all cores unless given. Results do not depend on it."""
    json: bool = False
    """Print one JSON object instead of the tables."""

    @property
    def runs(self) -> int:
        """Runs behind each median."""
        return QUICK_RUNS if self.quick else self.perturbations


@dataclass(frozen=True, eq=False)
class RealisationsResult:
    """Rows by 'part': 'response', 'loop' with the tuned gains, 'retuned'."""

    rows: list[dict[str, Any]]


def choices(quick: bool) -> Iterator[tuple[str, int]]:
    """Give every realisation with every number of terms."""
    for realisation, lengths in LENGTHS.items():
        for terms in lengths:
            if not quick or terms in QUICK_LENGTHS:
                yield realisation, terms


def empty_row(realisation: str, terms: int, plant: Plant, path: str) -> dict[str, Any]:
    """Return the row of a loop that has not run."""
    names = {"realisation": realisation, "terms": terms, "plant": plant.name, "trajectory": path}
    figures = dict.fromkeys(("bounded_share", "index", "envelope", "refused", "seed"))
    return {"part": "loop", **names, **figures}


def loop_row(
    realisation: str,
    terms: int,
    plant: Plant,
    path: str,
    controllers: list[Controller],
    threads: int | None = None,
) -> dict[str, Any]:
    """Return the median index (5) and envelope of a trajectory under controllers' variations.

    The medians are infinite where most runs diverge, and None with the reason in `refused` where
    the controllers cannot be built.
    """
    row = empty_row(realisation, terms, plant, path)
    try:
        filters = [each.filters(PERIOD, realisation, terms) for each in controllers]
    except ControllerError as error:
        return row | {"refused": str(error)}
    ref = reference(trajectory(path), plant.parameters, PERIOD)
    outcome = evaluate(plant, setting(READING), ref, filters, SEEN_EVERY, threads)
    bounded = np.isnan(outcome.diverged)
    widths = [
        envelope_half_width(plant.observe(states, energy=False).tip, ref.tip) if held else np.inf
        for states, held in zip(outcome.states, bounded, strict=True)
    ]
    return row | {
        "bounded_share": float(bounded.mean()),
        "index": float(np.median(outcome.indices)),
        "envelope": float(np.median(widths)),
    }


def tuned_anew(
    realisation: str, terms: int, path: str, seed: int, config: RealisationsConfig
) -> Controller | None:
    """Return the best controller of a short search by section 3.2, None if none was bounded."""
    population, generations = QUICK_SEARCH if config.quick else SEARCH
    tuning = Tuning(
        trajectory=path,
        realisation=realisation,
        terms=terms,
        setting=READING,
        population=population,
        generations=generations,
        seed=seed,
        modes=config.modes,
        **config.tuned,
    )
    problem = problem_of(tuning, config.threads)
    best = tune(problem, distribution_for(tuning), tuning.genetic, seed).best_parameters
    if best is None:
        return None
    first, second = (Gains.from_milliseconds(*map(float, part)) for part in (best[:5], best[5:]))
    name = f"{realisation} {terms}, {path}, seed {seed}"
    return Controller(name, first, second, "short search on the assumed modes")


def retuned_rows(
    realisation: str, terms: int, plants: list[Plant], path: str, config: RealisationsConfig
) -> list[dict[str, Any]]:
    """Return the loops of all plants with gains tuned for this realisation, a row per seed.

    Equal seeds start equal populations, so realisations are compared in pairs.
    """
    rows = []
    for seed in range(config.seed, config.seed + (1 if config.quick else SEEDS)):
        best = tuned_anew(realisation, terms, path, seed, config)
        for plant in plants:
            row = empty_row(realisation, terms, plant, path)
            if best is None:
                row |= {"bounded_share": 0.0, "index": np.inf, "envelope": np.inf}
            else:
                shaken = perturbed(best, config.runs, np.random.default_rng(config.seed))
                row = loop_row(realisation, terms, plant, path, shaken, config.threads)
            rows.append(row | {"part": "retuned", "seed": seed})
    return rows


def run(config: RealisationsConfig, progress: Progress | None = None) -> RealisationsResult:
    """Return responses, costs and closed loops of all realisations.

    Raises:
        ParameterError, ModelError: perturbations, seed, modes, segments or threads out of range.
    """
    if config.perturbations < 1:
        raise ParameterError(f"perturbations is {config.perturbations}; give 1 or more")
    if config.seed < 0:
        raise ParameterError(f"seed is {config.seed}; give 0 or more")
    plants: list[Plant] = list(config.robot_of().both(None, config.modes, config.segments))
    paths = QUICK_PATHS if config.quick else PATHS
    rng = np.random.default_rng(config.seed)
    given = {path: perturbed(TUNED[path], config.runs, rng) for path in paths}
    rows: list[dict[str, Any]] = []
    todo = list(choices(config.quick))
    for realisation, terms in progress.track(todo, description="loops") if progress else todo:
        cost = sample_cost(*operator(realisation, 0.5, PERIOD, terms))
        responses = [response_row(realisation, terms, order) for order in ORDERS]
        rows.extend(row | {"cost_ns": cost} for row in responses)
        for path in paths:
            rows.extend(
                loop_row(realisation, terms, plant, path, given[path], config.threads)
                for plant in plants
            )
    anew = list(RETUNED_TERMS.items())
    for realisation, terms in progress.track(anew, description="search") if progress else anew:
        for path in paths:
            rows.extend(retuned_rows(realisation, terms, plants, path, config))
    return RealisationsResult(rows)


def write(folder: Path, config: RealisationsConfig, result: RealisationsResult) -> None:
    """Write configuration, tables and figures into a folder."""
    write_config(folder, config)
    for part, name in PARTS.items():
        write_rows(folder / name, [row for row in result.rows if row["part"] == part])
    (folder / "figures").mkdir()
    response_figure(list(choices(config.quick)), band(), PERIOD, folder / "figures/responses.png")
    for part in ("loop", "retuned"):
        loop_figure(result.rows, part, folder / "figures" / f"{part}.png")


def command(config: RealisationsConfig) -> None:
    """Run the study and write its folder."""
    result = carried_out(config, run, write)
    if config.json:
        print(to_json({"rows": result.rows, "run": str(config.out)}))
        return
    out = Console(highlight=False)
    orders = f"orders {min(ORDERS)} to {max(ORDERS)}"
    out.print(f"Error against (j omega)^nu, {orders}, {BAND_HZ[0]:g} to {BAND_HZ[1]:g} Hz;")
    out.print("cost of a sample in the compiled filter")
    out.print(response_table(result.rows))
    out.print("Median index (5) with the same gains, 1e-4 m2 s, assumed modes|chain;")
    out.print("to (2): geometric mean over that of (2) with ten terms")
    out.print(loop_table(result.rows, "loop"))
    out.print("The same, each tuned anew by a short search (medians of the searches)")
    out.print(loop_table(result.rows, "retuned"))
    out.print(verdict(result.rows), soft_wrap=True)
    out.print(f"{config.out}: {', '.join(PARTS.values())}, figures/", soft_wrap=True)
