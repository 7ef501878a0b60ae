"""What is tuned: parameters in, index (5) out, on one plant or the worst of several.

    >>> tuning = Tuning(trajectory="line", plant="both")
    >>> problem = problem_of(tuning)
    >>> search = tune(problem, distribution_for(tuning), tuning.genetic, seed=1)
    >>> search.best_index    # [m2 s]

No folders, no terminal: any study can call this as often as it likes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.friction import Friction
from flexsim.loop.metrics import WEIGHTS
from flexsim.loop.runs import evaluate, loop_of
from flexsim.loop.settings import Setting, setting
from flexsim.loop.trajectories import Reference, reference, trajectory
from flexsim.mjcf.reading.names import Names
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import in_closed_form
from flexsim.robot import Robot
from studies.core.paper import PLANTS
from studies.tuning.distributions import NAMES, TABLE_1, Distribution, distribution
from studies.tuning.genetic import (
    Evaluate,
    Generation,
    GeneticSettings,
    OnGeneration,
    Scores,
    Search,
)
from studies.tuning.individuals import ControllerDesign
from studies.tuning.tuning import BOTH, TUNERS, Tuning

UNBUILT = 0.0  # [s] divergence time of parameters that no filter can be built from
PERTURBATION_STREAM = (0, 1)  # of the seed; generations use (0,), (1,), ...


@dataclass(frozen=True, eq=False)
class Problem:
    """The index of individuals, called with parameters (K, 10): one compiled call per scenario.

    Attributes:
        design: from parameters to filters.
        scenarios: plants, each with its setting, as they are simulated; the worst of them counts.
        reference: sampled at the design's period.
        weights: of x, y and v in the index (5). threads: None for all; results are the same.
        judges: the plants as they were asked for, where others are simulated in their place.
        remarks: lines on what is simulated.
    """

    design: ControllerDesign
    scenarios: tuple[tuple[Plant, Setting], ...]
    reference: Reference
    weights: tuple[float, float, float] = WEIGHTS
    threads: int | None = None
    judges: tuple[tuple[Plant, Setting], ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def simulated(self) -> list[str]:
        """Names of the plants that are simulated."""
        return list(dict.fromkeys(plant.name for plant, _ in self.scenarios))

    def rated(self, best: Array | None) -> dict[str, float]:
        """Return an individual's index (5) on each plant as it was asked for [m2 s].

        Args:
            best: (10,), or None, which has no index.

        Returns:
            By the plant's name, the worst of its robots; nothing where what was simulated is that.
        """
        if best is None or not self.judges:
            return {}
        found: dict[str, float] = {}
        for each in self.judges:
            alone = replace(self, scenarios=(each,), judges=())
            index, name = float(alone(best[None]).indices[0]), each[0].name
            found[name] = max(index, found.get(name, index))
        return found

    def __call__(self, parameters: Array) -> Scores:
        """Return the worst index of each individual, and the earliest time of divergence."""
        indices = np.full(len(parameters), np.inf)
        diverged = np.full(len(parameters), UNBUILT)
        built = self.design.filters(parameters)
        usable = [i for i, filters in enumerate(built) if filters is not None]
        if not usable:
            return Scores(indices, diverged)
        filters = [built[i] for i in usable]
        outcomes = [
            evaluate(
                plant,
                chosen,
                self.reference,
                filters,
                threads=self.threads,
                same_noise=True,
                weights=self.weights,
            )
            for plant, chosen in self.scenarios
        ]
        worst = np.max([each.indices for each in outcomes], axis=0)
        indices[usable] = np.where(np.isnan(worst), np.inf, worst)
        diverged[usable] = np.fmin.reduce([each.diverged for each in outcomes])
        return Scores(indices, diverged)


class Perturbation(NamedTuple):
    """Factors of EI, rho and friction, and the payload at the tip [kg]."""

    stiffness: float
    density: float
    friction: float
    payload: float


def perturbations(tuning: Tuning) -> list[Perturbation]:
    """Return what perturbed robots differ by, even between the bounds that a tuning gives.

    One factor for all of Table 4's friction: dead zones, Coulomb friction and slopes.
    """
    rng = np.random.default_rng(np.random.SeedSequence(tuning.seed, spawn_key=PERTURBATION_STREAM))
    spread, most = tuning.perturb_spread, tuning.perturb_payload
    found = []
    for _ in range(tuning.perturb):
        stiffness, density, friction = (float(x) for x in 1 + rng.uniform(-spread, spread, 3))
        found.append(Perturbation(stiffness, density, friction, float(rng.uniform(0, most))))
    return found


def _scaled(friction: Friction, factor: float) -> Friction:
    """Return friction with its dead zones, Coulomb friction and slopes times a factor."""
    (low_1, high_1), (low_2, high_2) = friction.dead_zone
    return replace(
        friction,
        dead_zone=((factor * low_1, factor * high_1), (factor * low_2, factor * high_2)),
        tau_0=(factor * friction.tau_0[0], factor * friction.tau_0[1]),
        mu=(factor * friction.mu[0], factor * friction.mu[1]),
    )


def scenarios_of(tuning: Tuning, robot: Robot) -> tuple[tuple[Plant, Setting], ...]:
    """Return the plants that a tuning asks for, the nominal robot's first, with their settings.

    Raises:
        ParameterError, ModelError: modes or segments out of range, or a robot without such a plant.
    """
    nominal = setting(tuning.setting, tuning.built)
    robots = [(robot, nominal)]
    for each in perturbations(tuning):
        other = robot.changed(each.stiffness, each.density, each.payload)
        robots.append((other, replace(nominal, friction=_scaled(nominal.friction, each.friction))))
    names = PLANTS if tuning.plant == BOTH else (tuning.plant,)
    return tuple(
        (each.plant(name, its, tuning.modes, tuning.segments), its)
        for each, its in robots
        for name in names
    )


def robot_of(tuning: Tuning) -> Robot:
    """Return the robot that a tuning names.

    Raises:
        ParameterError, ModelError: its file cannot be used.
    """
    names = Names(**{item.name: getattr(tuning, item.name) for item in fields(Names)})
    own = tuning.robot if tuning.mjcf is None or tuning.robot != Parameters() else None
    return Robot.of(tuning.mjcf, tuning.beam, own, names=names, modal_damping=tuning.modal_damping)


def problem_of(tuning: Tuning, threads: int | None = None, robot: Robot | None = None) -> Problem:
    """Return the problem that a tuning describes.

    Args:
        tuning: as named. threads: None for all.
        robot: instead of reading the tuning's file again.

    Raises:
        ParameterError, ModelError: a number out of range, or a period that is no whole multiple of
            a plant's physics step.
    """
    robot = robot_of(tuning) if robot is None else robot
    ref = reference(trajectory(tuning.trajectory), robot.parameters, tuning.period)
    scenarios = scenarios_of(tuning, robot)
    for plant, _ in scenarios:
        loop_of(plant, ref, weights=tuning.weights)  # checks period, step and weights
    simulated, whys = zip(*(in_closed_form(plant) for plant, _ in scenarios), strict=True)
    pairs = tuple((plant, its) for plant, (_, its) in zip(simulated, scenarios, strict=True))
    remarks = [f"MuJoCo simulates the chain: {why}" for why in whys if why]
    instead = any(one is not other for one, (other, _) in zip(simulated, scenarios, strict=True))
    if instead:
        remarks.append("chains are simulated in closed form, the result is rated on MuJoCo's")
    return Problem(
        tuning.design,
        pairs,
        ref,
        tuning.weights,
        threads,
        scenarios if instead else (),
        tuple(dict.fromkeys(remarks)),
    )


def distribution_for(tuning: Tuning) -> Distribution:
    """Return the distribution that a tuning names, with integer orders for PIDs.

    Raises:
        ParameterError, RunError: as `distribution`; or orders are given for PIDs.
    """
    given = distribution(tuning.distribution)
    if tuning.controller != "pid":
        return given
    forced = given.with_integer_orders()
    for name, draw, integer, usual in zip(
        NAMES, given.draws, forced.draws, TABLE_1.draws, strict=True
    ):
        if draw not in (integer, usual):
            raise ParameterError(
                f"{tuning.distribution} gives {name}, which a pid forces to "
                f"{integer.numbers[0]:g}; leave it out"
            )
    return forced


def tune(
    evaluate_all: Evaluate,
    draws: Distribution,
    settings: GeneticSettings,
    seed: int,
    tuner: str = "genetic",
    on_generation: OnGeneration | None = None,
    resume_from: Sequence[Generation] = (),
) -> Search:
    """Return the search of one tuner, deterministic in all but speed.

    Args:
        evaluate_all: a `Problem`, or any function from individuals (K, 10) to their scores.
        draws: what individuals are drawn from. settings, seed: as named.
        tuner: a key of `TUNERS`.
        on_generation: called with every new generation.
        resume_from: the first generations of the same search, not simulated again.

    Raises:
        ParameterError: there is no such tuner.
    """
    if tuner not in TUNERS:
        raise ParameterError(f"tuner {tuner!r} is unknown; choose one of {', '.join(TUNERS)}")
    return TUNERS[tuner](evaluate_all, draws, settings, seed, on_generation, resume_from)
