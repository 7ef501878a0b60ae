"""Tables 2 and 3 and Figure 6 anew: what becomes of a controller away from where it was tuned?

    >>> result = run(TablesConfig(quick=True))
    >>> result.rows[0]["envelope"]     # [m]
    >>> result.ratios[0]["ratio"], result.ratios[0]["paper_ratio"]

Section 3.2's algorithm, once per trajectory on the assumed modes, the chain, and the worse of
both: nine controllers, each then run on both plants and all trajectories. The paper tuned in
simulation and went to the laboratory; here one plant is the simulation, the other the laboratory.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress, TaskID

from flexsim.errors import ParameterError
from flexsim.loop.metrics import measures
from flexsim.loop.runs import closed_loop
from flexsim.loop.settings import Setting
from flexsim.loop.trajectories import TRAJECTORIES, reference, trajectory
from flexsim.plants.base import Plant
from studies.compare.compare import CASES, summary
from studies.core.carry_out import carried_out
from studies.core.figures import paper_envelopes
from studies.core.folder import to_json, write_config, write_rows
from studies.core.options import RobotOptions
from studies.core.repeats import PERTURBATION
from studies.tables.report import envelope_figure, print_report, transfer_figure
from studies.tuning.distributions import NAMES
from studies.tuning.genetic import Generation, Search
from studies.tuning.individuals import Filters
from studies.tuning.problem import (
    BOTH,
    PLANTS,
    Tuning,
    distribution_for,
    problem_of,
    scenarios_of,
    tune,
)
from studies.tuning.tune import check_threads

FROM_TO = {  # tuned on: plants in the roles of simulation and laboratory
    "assumed-modes": ("assumed-modes", "chain"),
    "chain": ("chain", "assumed-modes"),
    "both": ("assumed-modes", "chain"),
}
FIGURES = ("envelope", "max_error", "rms_error", "max_v", "residual_v")
GAINS = [NAMES.index(name) for name in NAMES if name.startswith("k")]
QUICK_POPULATION, QUICK_GENERATIONS = 50, 3  # a smaller population of Table 1 has none that hold
QUICK_RUNS = 2
CHAIN_COST = 20  # generations on the assumed modes that take as long as one on the chain


@dataclass(frozen=True)
class TablesConfig(RobotOptions):
    """Tune for every trajectory on every plant; run each controller on all of them."""

    out: Path = Path("runs/tables")
    """Folder of the run, made anew."""
    force: bool = False
    """Replace the run that is there."""
    quick: bool = False
    """Three generations of 50 individuals at most, two runs each."""
    setting: str = "print"
    """Friction, limits and motors: none, print, joint or reconstructed."""
    generations: int = 100
    """Generations at most, the first included; ten without improvement end a search."""
    population: int = 50
    """Individuals per generation."""
    chain_generations: int = 100
    """Generations at most where the chain is simulated, which is twenty times slower."""
    seed: int = 1
    """Seed of all searches, which so start from the same population."""
    modes: int = 3
    """Assumed modes, n."""
    segments: int | None = None
    """Segments of the chain; 6 unless given."""
    perturbations: int = 20
    """Runs behind each median, the gains' fourth digits perturbed."""
    threads: int | None = None
    """Threads; all cores unless given. Results do not depend on it."""
    json: bool = False
    """Print one JSON object instead of the tables."""

    def asked(self) -> TablesConfig:
        """Return what is run: this, or short searches if `quick`."""
        if not self.quick:
            return self
        return dataclasses.replace(
            self,
            population=min(self.population, QUICK_POPULATION),
            generations=min(self.generations, QUICK_GENERATIONS),
            chain_generations=min(self.chain_generations, QUICK_GENERATIONS),
            perturbations=min(self.perturbations, QUICK_RUNS),
        )


@dataclass(frozen=True, eq=False)
class Tuned:
    """A tuning and its search, which may have found nothing that holds."""

    tuning: Tuning
    search: Search

    @property
    def names(self) -> dict[str, str]:
        """What the controller was tuned on and for."""
        return {"tuned_on": self.tuning.plant, "tuned_for": self.tuning.trajectory}

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
        factors[1:, GAINS] += PERTURBATION * rng.standard_normal((perturbations, len(GAINS)))
        built = self.tuning.structure.filters(factors * best)
        return [each for each in built if each is not None]

    @property
    def row(self) -> dict[str, Any]:
        """The search's outcome: index (5) [m2 s], cost, parameters in Table 1's units."""
        best, search = self.search.best_parameters, self.search
        found = [None] * len(NAMES) if best is None else best.tolist()
        return {
            **self.names,
            "index": None if best is None else search.best_index,
            "generations": len(search.generations),
            "evaluations": search.evaluations,
            "seed": self.tuning.seed,
            "ended": search.ended,
            **dict(zip(NAMES, found, strict=True)),
        }


@dataclass(frozen=True, eq=False)
class TablesResult:
    """Rows per run, controller, and case of the deterioration; the chain's MJCF."""

    rows: list[dict[str, Any]]
    controllers: list[dict[str, Any]]
    ratios: list[dict[str, Any]]
    mjcf: str


def tunings(config: TablesConfig) -> list[Tuning]:
    """Return what is tuned: all trajectories on the assumed modes, on the chain, on both.

    Raises:
        ParameterError: an unknown setting, or a number out of range.
    """
    if config.chain_generations < 1:
        raise ParameterError(f"chain generations is {config.chain_generations}; give 1 or more")
    if config.perturbations < 1:
        raise ParameterError(f"perturbations is {config.perturbations}; give 1 or more")
    return [
        Tuning(
            trajectory=path,
            plant=plant,
            setting=config.setting,
            population=config.population,
            generations=config.generations if plant == PLANTS[0] else config.chain_generations,
            seed=config.seed,
            modes=config.modes,
            segments=config.segments,
            **config.tuned,
        )
        for plant in (*PLANTS, BOTH)
        for path in TRAJECTORIES
    ]


def cost(tuning: Tuning) -> int:
    """Return how long one of a tuning's generations takes, to show progress by."""
    return 1 if tuning.plant == PLANTS[0] else CHAIN_COST


def tuned_all(
    chosen: Sequence[Tuning], threads: int | None, progress: Progress | None
) -> list[Tuned]:
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
        found.append(Tuned(tuning, search))
        before += cost(tuning) * tuning.generations
    if progress:
        progress.update(bar, completed=total, description="runs")
    return found


def run_row(
    each: Tuned, scenario: tuple[Plant, Setting], path: str, config: TablesConfig
) -> dict[str, Any]:
    """Return the row of one controller on one plant and trajectory, in SI units.

    Medians over runs with perturbed gains, but for the index, which is the unperturbed run's.
    Where there is no controller, figures are None, and so is the time of divergence.
    """
    plant, chosen = scenario
    chased = trajectory(path)
    ref = reference(chased, plant.parameters, each.tuning.period)
    names = {**each.names, "run_on": plant.name, "trajectory": path}
    filters = each.filters(config.perturbations)
    if not filters:
        nothing = dict.fromkeys(FIGURES) | {"index": None}
        return {**names, **nothing, "diverged": True, "diverged_at": None}
    motions = closed_loop(plant, chosen, ref, filters, energy=False, threads=config.threads)
    nominal, *perturbed = (measures(motion, ref, chased.hold) for motion in motions)
    found = summary(perturbed)
    figures = {name: None if found["diverged"] else found[name] for name in FIGURES}
    index = None if nominal["diverged"] else nominal["index"]
    held = {name: found[name] for name in ("diverged", "diverged_at")}
    return {**names, **figures, "index": index, **held}


def ratios(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return how much wider envelopes [m] are on the plant in the laboratory's role, by case.

    The cases are Figures 3 to 6; the ratio is None where an envelope is missing. Controllers tuned
    on both plants have no laboratory: theirs is the chain's envelope over the assumed modes'.
    """
    keys = ("tuned_on", "tuned_for", "run_on", "trajectory")
    envelopes = {tuple(row[key] for key in keys): row["envelope"] for row in rows}
    found = []
    for tuned_on, (simulation, laboratory) in FROM_TO.items():
        for path, devised in CASES:
            first = envelopes[tuned_on, devised, simulation, path]
            second = envelopes[tuned_on, devised, laboratory, path]
            paper = paper_envelopes(path, devised)
            found.append(
                {
                    "tuned_on": tuned_on,
                    "tuned_for": devised,
                    "trajectory": path,
                    "from_plant": simulation,
                    "to_plant": laboratory,
                    "from_envelope": first,
                    "to_envelope": second,
                    "ratio": None if first is None or second is None else second / first,
                    "paper_simulation": paper and paper[0],
                    "paper_laboratory": paper and paper[1],
                    "paper_ratio": paper and paper[1] / paper[0],
                }
            )
    return found


def run(config: TablesConfig, progress: Progress | None = None) -> TablesResult:
    """Return nine tuned controllers and what each does on both plants and all trajectories.

    Raises:
        ParameterError, ModelError: an unknown setting, or a number out of range.
    """
    config = config.asked()
    chosen = tunings(config)
    check_threads(config.threads)
    scenarios = scenarios_of(chosen[-1], config.robot_of())  # tuned on both
    found = tuned_all(chosen, config.threads, progress)
    rows = [
        run_row(each, scenario, path, config)
        for each in found
        for scenario in scenarios
        for path in TRAJECTORIES
    ]
    (mjcf,) = (plant.mjcf for plant, _ in scenarios if plant.mjcf is not None)
    return TablesResult(rows, [each.row for each in found], ratios(rows), mjcf)


def write(folder: Path, config: TablesConfig, result: TablesResult) -> None:
    """Write configuration, MJCF, tables and figures into a folder."""
    write_config(folder, config, ran=dataclasses.asdict(config.asked()))
    (folder / "chain.xml").write_text(result.mjcf)
    write_rows(folder / "results.csv", result.rows)
    write_rows(folder / "controllers.csv", result.controllers)
    write_rows(folder / "ratios.csv", result.ratios)
    (folder / "figures").mkdir()
    envelope_figure(result.rows, CASES, folder / "figures" / "envelopes.png")
    transfer_figure(result.rows, folder / "figures" / "transfer.png")


def command(config: TablesConfig) -> None:
    """Run the study and write its folder."""
    result = carried_out(config, run, write)
    if config.json:
        lists = {"rows": result.rows, "controllers": result.controllers, "ratios": result.ratios}
        print(to_json({**lists, "run": str(config.out)}))
        return
    print_report(result.rows, result.controllers, result.ratios)
    files = "results.csv, controllers.csv, ratios.csv, chain.xml, figures/"
    Console(highlight=False).print(f"{config.out}: {files}", soft_wrap=True)
