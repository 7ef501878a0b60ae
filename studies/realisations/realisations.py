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
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.progress import Progress

from controllers import TUNED_IDEAL, Controller, ControllerError, Gains, operator
from flexsim.loop.runs import measure
from flexsim.loop.settings import DEFAULT_SETTING, setting
from flexsim.loop.trajectories import TRAJECTORIES, reference, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.plants.base import Plant
from studies.core.carry_out import Study, counted
from studies.core.evidence.intervals import quantile, share_of
from studies.core.evidence.repeats import perturbed, summary, values_of
from studies.core.study_options import LoopOptions, Out, Perturbations
from studies.realisations import report
from studies.realisations.response import ORDERS, ResponseRow, response_row, sample_cost
from studies.realisations.rows import LoopRow, RealisationsResult
from studies.tuning.problem import distribution_for, problem_of, tune
from studies.tuning.tuning import Tuning

LENGTHS = {  # terms tried: series need many, fractions round away when PIDs have over five
    "tustin": (5, 10, 20, 50),
    "gruenwald-letnikov": (5, 10, 20, 50),
    "impulse-response": (5, 10, 20, 50),
    "tustin-fraction": (2, 3, 5),
    "backward-fraction": (2, 3, 5),
    "oustaloup": (2, 3, 5),
}
QUICK_LENGTHS = (5, 10)
QUICK_SHAPES = ("circle",)
READING = DEFAULT_SETTING
RETUNED_TERMS = {  # one length of each is tuned anew
    "tustin": 10,
    "gruenwald-letnikov": 10,
    "impulse-response": 10,
    "tustin-fraction": 3,
    "backward-fraction": 3,
    "oustaloup": 3,
}
SEARCH, QUICK_SEARCH = (50, 15), (20, 3)  # population, generations
SEEDS = 6  # searches of each: the fewest whose median has an interval


@dataclass(frozen=True)
class RealisationsConfig(LoopOptions):
    """Compare the realisations of a fractional operator: response, cost, closed loop."""

    QUICK: ClassVar = {"perturbations": 2}

    out: Out = Path("runs/realisations")
    quick: bool = False
    """Two lengths, one trajectory and two runs each only."""
    perturbations: Perturbations = 10


def choices(quick: bool) -> Iterator[tuple[str, int]]:
    """Give every realisation with every number of terms."""
    for realisation, lengths in LENGTHS.items():
        for terms in lengths:
            if not quick or terms in QUICK_LENGTHS:
                yield realisation, terms


def loop_row(
    realisation: str,
    terms: int,
    plant: Plant,
    shape: str,
    controllers: list[Controller],
    config: RealisationsConfig,
) -> LoopRow:
    """Return the row of a trajectory under controllers' variations."""
    row = LoopRow("loop", realisation, terms, plant.name, shape)
    try:
        filters = [each.filters(PERIOD, realisation, terms) for each in controllers]
    except ControllerError as error:
        return replace(row, refused=str(error))
    ref = reference(trajectory(shape), plant.parameters, PERIOD)
    found = measure(plant, setting(READING, config.built), ref, filters, threads=config.threads)
    indices, widths = values_of(found, "index"), values_of(found, "envelope")
    spread = summary("index", indices) | summary("envelope", widths)
    shares: dict[str, Any] = share_of("bounded_share", [not each["diverged"] for each in found])
    return replace(
        row,
        **shares,
        index=quantile(indices),
        envelope=quantile(widths),
        spread={key: each for key, each in spread.items() if key not in ("index", "envelope")},
        indices=np.array(indices),
    )


def tuned_anew(
    realisation: str, terms: int, shape: str, seed: int, config: RealisationsConfig
) -> Controller | None:
    """Return the best controller of a short search by section 3.2, None if none was bounded.

    What grows on the exact linear loop is rejected, where the robot has one.
    """
    population, generations = QUICK_SEARCH if config.quick else SEARCH
    tuning = Tuning(
        trajectory=shape,
        realisation=realisation,
        terms=terms,
        setting=READING,
        population=population,
        generations=generations,
        seed=seed,
        exact=config.has_exact_loop,
        modes=config.modes,
        **config.for_tuning,
    )
    problem = problem_of(tuning, config.threads)
    best = tune(problem, distribution_for(tuning), tuning.genetic, seed).best_parameters
    if best is None:
        return None
    first, second = (Gains.from_milliseconds(*map(float, part)) for part in (best[:5], best[5:]))
    name = f"{realisation} {terms}, {shape}, seed {seed}"
    return Controller(name, first, second, "short search on the assumed modes")


def retuned_rows(
    realisation: str, terms: int, plants: list[Plant], shape: str, config: RealisationsConfig
) -> Iterator[LoopRow]:
    """Give the loops of all plants with gains tuned for this realisation, a row per seed.

    Equal seeds start equal populations, so realisations are compared in pairs.
    """
    for seed in range(config.seed, config.seed + (1 if config.quick else SEEDS)):
        best = tuned_anew(realisation, terms, shape, seed, config)
        for plant in plants:
            if best is None:
                none = LoopRow("", realisation, terms, plant.name, shape, 0.0)
                row = replace(none, index=np.inf, envelope=np.inf)
            else:
                rng = np.random.default_rng(config.seed)
                shaken = perturbed(best, config.perturbations, rng)
                row = loop_row(realisation, terms, plant, shape, shaken, config)
            yield replace(row, part="retuned", seed=seed)


def run(config: RealisationsConfig, progress: Progress | None = None) -> RealisationsResult:
    """Return responses, costs and closed loops of all realisations.

    Raises:
        ParameterError, ModelError: perturbations, seed, modes, segments or threads out of range.
    """
    config = config.asked()
    plants: list[Plant] = list(config.robot_of().both(None, config.modes, config.segments))
    shapes = QUICK_SHAPES if config.quick else tuple(TRAJECTORIES)
    rng = np.random.default_rng(config.seed)
    given = {shape: perturbed(TUNED_IDEAL[shape], config.perturbations, rng) for shape in shapes}
    rows: list[ResponseRow | LoopRow] = []
    for realisation, terms in counted(progress, "loops", choices(config.quick)):
        cost = sample_cost(*operator(realisation, 0.5, PERIOD, terms))
        rows.extend(response_row(realisation, terms, order, cost) for order in ORDERS)
        for shape in shapes:
            rows.extend(
                loop_row(realisation, terms, plant, shape, given[shape], config) for plant in plants
            )
    for realisation, terms in counted(progress, "search", RETUNED_TERMS.items()):
        for shape in shapes:
            rows.extend(retuned_rows(realisation, terms, plants, shape, config))
    return RealisationsResult(rows, config.seed)


command = Study(
    run,
    report.tables,
    report.verdict,
    report.figures,
    question="Which realisation of a fractional operator serves the loop best, and is it (2)?",
)
