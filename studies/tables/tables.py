"""Tables 2 and 3 and Figure 6 anew: what becomes of a controller away from where it was tuned?

    >>> result = run(TablesConfig(quick=True))
    >>> result.rows[0].envelope     # [m]
    >>> result.ratios[0].ratio, result.ratios[0].paper_ratio

Section 3.2's algorithm, once per trajectory on the assumed modes, the chain, and the worse of
both, what grows on the exact linear loop rejected unless told otherwise: nine controllers, each
then run on both plants and all trajectories. The paper tuned in simulation and went to the
laboratory; here one plant is the simulation, the other the laboratory. Controllers that are given
(`--controller`) are run so instead, and nothing is tuned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
import tyro
from rich.progress import Progress, TaskID

from flexsim.loop.runs import measure
from flexsim.loop.settings import DEFAULT_SETTING, Setting
from flexsim.loop.trajectories import TRAJECTORIES, reference, trajectory
from flexsim.plants.base import Plant
from studies.core.carry_out import Study, ticker
from studies.core.evidence.intervals import known_ends, ratio_interval
from studies.core.evidence.repeats import PERTURBATION, medians, values_of
from studies.core.paper import CASES, PLANTS, paper_envelopes
from studies.core.study_options import (
    LoopOptions,
    Out,
    Perturbations,
    Population,
    SettingName,
)
from studies.tables.figures import figures
from studies.tables.given import Repeats, check, check_untuned, evaluated
from studies.tables.report import facts, files, tables, verdict
from studies.tables.rows import ControllerRow, RatioRow, RunRow, TablesResult, figures_of
from studies.tuning.distributions import NAMES
from studies.tuning.found import GAINS, FoundController, controllers_of
from studies.tuning.genetic import Generation, Search
from studies.tuning.individuals import Filters
from studies.tuning.problem import distribution_for, problem_of, tune
from studies.tuning.scenarios import scenarios_of
from studies.tuning.tuning import BOTH, Tuning

FROM_TO = {  # tuned on: plants in the roles of simulation and laboratory
    "assumed-modes": ("assumed-modes", "chain"),
    "chain": ("chain", "assumed-modes"),
    "both": ("assumed-modes", "chain"),
}
CHAIN_COST = (
    5  # generations on the assumed modes that take as long as one on the chain, in closed form
)


@dataclass(frozen=True)
class TablesConfig(LoopOptions):
    """Tune for every trajectory on every plant; run each controller on all of them."""

    QUICK: ClassVar = {  # a smaller population of Table 1 has none that hold
        **{"population": 50, "generations": 3, "chain_generations": 3, "perturbations": 2}
    }

    out: Out = Path("runs/tables")
    quick: bool = False
    """Three generations of 50 individuals at most, two runs each."""
    setting: SettingName = DEFAULT_SETTING
    exact: bool = True
    """Reject what grows on the exact linear loop, before it is simulated; --no-exact for section
    3.2's algorithm alone, as it is where there is no such loop, with --mjcf or --modal-damping."""
    generations: int = 100
    """Generations at most, the first included; ten without improvement end a search."""
    population: Population = 50
    chain_generations: int = 100
    """Generations at most where the chain is simulated, which takes five times as long."""
    perturbations: Perturbations = 20
    controller: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["--controllers"])] = ()
    """Tune nothing; run these on both plants and all trajectories: names as in flexsim stability,
    or folders of runs of flexsim tune."""


@dataclass(frozen=True, eq=False)
class Found:
    """A tuning and its search, which may have found nothing that holds."""

    tuning: Tuning
    search: Search

    @property
    def tuned_on(self) -> str:
        """The plant's name, or 'both'."""
        return str(self.tuning.plant)

    def filters(self, perturbations: int) -> list[Filters]:
        """Return the best individual's filters, then some with perturbed gains; none if none held.

        Perturbed as in `flexsim compare`, by the tuning's seed; the first are those that its index
        was computed with.
        """
        best = self.search.best_parameters
        if best is None:
            return []
        factors = np.ones((1 + perturbations, len(NAMES)))
        rng = np.random.default_rng(self.tuning.seed)
        factors[1:, list(GAINS)] += PERTURBATION * rng.standard_normal((perturbations, len(GAINS)))
        built = self.tuning.design.filters(factors * best)
        return [each for each in built if each is not None]

    @property
    def row(self) -> ControllerRow:
        """The search's outcome."""
        best, search = self.search.best_parameters, self.search
        parameters = [None] * len(NAMES) if best is None else best.tolist()
        return ControllerRow(
            tuned_on=self.tuned_on,
            tuned_for=self.tuning.trajectory,
            index=None if best is None else search.best_index,
            generations=len(search.generations),
            evaluations=search.evaluations,
            seed=self.tuning.seed,
            ended=search.ended,
            parameters=dict(zip(NAMES, parameters, strict=True)),
        )


def tunings(config: TablesConfig) -> list[Tuning]:
    """Return what is tuned: all trajectories on the assumed modes, on the chain, on both.

    Raises:
        ParameterError: an unknown setting, or a number out of range.
    """
    return [
        Tuning(
            trajectory=shape,
            plant=plant,
            setting=config.setting,
            population=config.population,
            generations=config.generations if plant == PLANTS[0] else config.chain_generations,
            seed=config.seed,
            exact=config.exact and config.has_exact_loop,
            modes=config.modes,
            segments=config.segments,
            **config.for_tuning,
        )
        for plant in (*PLANTS, BOTH)
        for shape in TRAJECTORIES
    ]


def cost(tuning: Tuning) -> int:
    """Return how long one of a tuning's generations takes, to show progress by."""
    return 1 if tuning.plant == PLANTS[0] else CHAIN_COST


def tuned_all(
    chosen: Sequence[Tuning], threads: int | None, progress: Progress | None
) -> list[Found]:
    """Return every tuning's search."""
    total = sum(cost(each) * each.generations for each in chosen)
    bar = progress.add_task("tuning", total=total) if progress else TaskID(0)
    found, before = [], 0
    for tuning in chosen:
        if progress:
            progress.update(bar, description=f"{tuning.trajectory} on {tuning.plant}")

        def show(new: Generation, before: int = before, step: int = cost(tuning)) -> None:
            if progress:
                progress.update(bar, completed=before + step * (new.number + 1))

        problem, draws = problem_of(tuning, threads), distribution_for(tuning)
        search = tune(problem, draws, tuning.genetic, tuning.seed, on_generation=show)
        found.append(Found(tuning, search))
        before += cost(tuning) * tuning.generations
    if progress:
        progress.update(bar, completed=total, description="runs")
    return found


def run_row(
    each: Found, scenario: tuple[Plant, Setting], shape: str, config: TablesConfig
) -> tuple[RunRow, list[float]]:
    """Return the row of one controller on one plant and trajectory, and all runs' envelopes [m]."""
    plant, chosen = scenario
    names = (each.tuned_on, each.tuning.trajectory, plant.name, shape)
    filters = each.filters(config.perturbations)
    if not filters:
        none = RunRow(*names, None, None, None, None, None, None, diverged=True, diverged_at=None)
        return none, []
    chased = trajectory(shape)
    ref = reference(chased, plant.parameters, each.tuning.period)
    nominal, *perturbed = measure(plant, chosen, ref, filters, chased.hold, threads=config.threads)
    found = medians(perturbed)
    row = RunRow(
        *names,
        **figures_of(nominal, found),
    )
    return row, values_of(perturbed, "envelope")


def ratios(rows: Sequence[RunRow], samples: Sequence[Sequence[float]], seed: int) -> list[RatioRow]:
    """Return how much wider envelopes [m] are on the plant in the laboratory's role, by case.

    The cases are Figures 3 to 6; the ratio is None where an envelope is missing. Controllers tuned
    on both plants have no laboratory: theirs is the chain's envelope over the assumed modes'.

    Args:
        samples: all runs' envelopes of each row [m], runs i with the same perturbation: pairs.
        seed: of the ratios' intervals.
    """
    names = [(r.tuned_on, r.tuned_for, r.run_on, r.trajectory) for r in rows]
    envelopes = dict(zip(names, (row.envelope for row in rows), strict=True))
    runs = dict(zip(names, samples, strict=True))
    found = []
    for tuned_on, (simulation, laboratory) in FROM_TO.items():
        for shape, devised in CASES:
            first = envelopes[tuned_on, devised, simulation, shape]
            second = envelopes[tuned_on, devised, laboratory, shape]
            paper = paper_envelopes(shape, devised)
            known = first is not None and second is not None
            over, under = (runs[tuned_on, devised, on, shape] for on in (laboratory, simulation))
            low, high = known_ends(ratio_interval(over, under, seed) if known else None)
            found.append(
                RatioRow(
                    tuned_on=tuned_on,
                    tuned_for=devised,
                    trajectory=shape,
                    from_plant=simulation,
                    to_plant=laboratory,
                    from_envelope=first,
                    to_envelope=second,
                    ratio=None if first is None or second is None else second / first,
                    paper_simulation=paper and paper[0],
                    paper_laboratory=paper and paper[1],
                    paper_ratio=paper and paper[1] / paper[0],
                    ratio_low=low,
                    ratio_high=high,
                )
            )
    return found


def run_given(config: TablesConfig, progress: Progress | None = None) -> TablesResult:
    """Return what given controllers do on both plants and all trajectories.

    Raises:
        ParameterError, RunError: a controller, or another option, cannot be used.
    """
    check_untuned(config)
    config = config.asked()
    given = list(controllers_of(config.controller).values())
    scenarios = scenarios_of(tunings(config)[-1], config.robot_of())
    check(given, scenarios)
    how = Repeats(config.perturbations, config.seed, config.threads)
    rows, ratios = evaluated(given, scenarios, how, ticker(progress, "runs", len(given)))
    (mjcf,) = (plant.mjcf for plant, _ in scenarios if plant.mjcf is not None)
    facts = [each.facts for each in given if isinstance(each, FoundController)]
    return TablesResult([*rows], [], [*ratios], mjcf, facts)


def run(config: TablesConfig, progress: Progress | None = None) -> TablesResult:
    """Return nine tuned controllers and what each does on both plants and all trajectories.

    Raises:
        ParameterError, ModelError: an unknown setting, or a number out of range.
    """
    if config.controller:
        return run_given(config, progress)
    config = config.asked()
    chosen = tunings(config)
    scenarios = scenarios_of(chosen[-1], config.robot_of())  # tuned on both
    found = tuned_all(chosen, config.threads, progress)
    rows, samples = zip(
        *(
            run_row(each, scenario, shape, config)
            for each in found
            for scenario in scenarios
            for shape in TRAJECTORIES
        ),
        strict=True,
    )
    (mjcf,) = (plant.mjcf for plant, _ in scenarios if plant.mjcf is not None)
    deterioration = ratios(rows, samples, config.seed)
    return TablesResult(list(rows), [each.row for each in found], deterioration, mjcf)


command = Study(
    run,
    tables,
    verdict,
    figures,
    facts,
    files,
    question="What becomes of a controller away from the path and plant it was tuned on?",
)
