"""What is tuned: parameters in, index (5) out, on one plant or the worst of several.

    >>> tuning = Tuning(trajectory="line", plant="both")
    >>> problem = problem_of(tuning)
    >>> search = tune(problem, distribution_for(tuning), tuning.genetic, seed=1)
    >>> search.best_index    # [m2 s]

No folders, no terminal: any study can call this as often as it likes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexsim.errors import ParameterError
from flexsim.linear.exact_loop import exact_growth
from flexsim.linear.growth import quantised
from flexsim.linear.loop_poles import SampledPlant
from flexsim.loop.control.stacking import stack
from flexsim.loop.measuring import VARIATION, yardstick
from flexsim.loop.metrics import WEIGHTS
from flexsim.loop.runs import evaluate, loop_of, measure
from flexsim.loop.settings import V_GAIN, Setting
from flexsim.loop.trajectories import Reference, path_named, reference
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import in_closed_form
from flexsim.robot import Robot
from studies.tuning.distributions import NAMES, TABLE_1, Distribution, distribution
from studies.tuning.genetic import (
    Evaluate,
    Generation,
    GeneticSettings,
    OnGeneration,
    Scores,
    Search,
)
from studies.tuning.individuals import ControllerDesign, Filters, moderate
from studies.tuning.scenarios import exact_of, robot_of, scenarios_of
from studies.tuning.tuning import TUNERS, Tuning

UNBUILT = 0.0  # [s] divergence time of parameters that no filter can be built from


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
        held: the reference with a long hold at its end, and the hold's length [s], or None.
        exact: exact linear loops that may not grow; none unless asked for.
        effort: what a unit of total variation of the torques adds to the index [m2 s/(N m)].
        v_gain: factor of atan(v/(r+L)) in the loops that are simulated, -1 in the paper.
        residual: what a metre of the largest |v| over the long hold's second half adds [m s].
    """

    design: ControllerDesign
    scenarios: tuple[tuple[Plant, Setting], ...]
    reference: Reference
    weights: tuple[float, float, float] = WEIGHTS
    threads: int | None = None
    judges: tuple[tuple[Plant, Setting], ...] = ()
    remarks: tuple[str, ...] = ()
    held: tuple[Reference, float] | None = None
    exact: tuple[SampledPlant, ...] = ()
    effort: float = 0.0
    v_gain: float = V_GAIN
    residual: float = 0.0

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
        """Return the worst index of each individual, and the earliest time of divergence.

        Individuals whose exact linear loop grows are not simulated.
        """
        count = len(parameters)
        scores = Scores(np.full(count, np.inf), np.full(count, UNBUILT), np.zeros(count))
        built = self.design.filters(parameters)
        usable = [i for i, filters in enumerate(built) if filters is not None]
        if self.exact:  # what cannot be built comes last of all
            scores.growth[:] = self._growth(built)
            usable = [i for i in usable if scores.growth[i] == 0]
        if not usable:
            return scores
        filters = [pair for i in usable if (pair := built[i]) is not None]
        outcomes = [self._outcome(plant, chosen, filters) for plant, chosen in self.scenarios]
        worst = np.max([index for index, _ in outcomes], axis=0)
        scores.indices[usable] = np.where(np.isnan(worst), np.inf, worst)
        scores.diverged[usable] = np.fmin.reduce([when for _, when in outcomes])
        self._hold(scores, built)
        return scores

    def growth(self, parameters: Array) -> Array:
        """Return what of individuals' exact linear loops is above 0 (P,) [1/s].

        inf where no filter can be built. 0 of all others if there are no loops to look at.
        """
        return self._growth(self.design.filters(parameters))

    @property
    def _how(self) -> dict[str, Any]:
        """Options of every simulation."""
        return {"threads": self.threads, "same_noise": True, "v_gain": self.v_gain}

    def _growth(self, built: Sequence[Filters | None]) -> Array:
        """Return the same of filters, inf also of numbers beyond use."""
        growth = np.full(len(built), np.inf)
        left = [i for i, pair in enumerate(built) if pair is not None and moderate(pair)]
        if not self.exact:
            growth[left] = 0.0
        elif left:
            drawn = stack([built[i] for i in left], self.design.period)
            growth[left] = np.maximum(quantised(exact_growth(self.exact, drawn)), 0.0)
        return growth

    def _outcome(
        self, plant: Plant, chosen: Setting, filters: Sequence[Filters]
    ) -> tuple[Array, Array]:
        """Return indices (P,), with the effort's share, and times of divergence on one plant."""
        how: dict[str, Any] = {**self._how, "weights": self.weights}
        if self.effort:
            how["yard"] = yardstick(self.reference, 0.0)
        found = evaluate(plant, chosen, self.reference, filters, **how)
        if not self.effort:
            return found.indices, found.diverged
        variation = found.sums[:, VARIATION] + found.sums[:, VARIATION + 1]
        return found.indices + self.effort * variation, found.diverged

    def _hold(self, scores: Scores, built: Sequence[Filters | None]) -> None:
        """Take the long hold in, if there is one: what is lost in it, and the v that is left.

        Whether v grows over one run's hold is no matter of ranking: where joints drift through a
        dead zone and are pushed back at its edges, v wanders, and its ratio is chance.
        """
        if self.held is None:
            return
        ref, length = self.held
        left_over = np.zeros(len(built))
        for plant, chosen in self.scenarios:
            left = [i for i, index in enumerate(scores.indices) if np.isfinite(index)]
            if not left:
                return
            pairs = [built[i] for i in left]
            runs = measure(plant, chosen, ref, pairs, hold=length / 2, **self._how)
            for i, found in zip(left, runs, strict=True):
                if found["diverged"]:
                    scores.indices[i], scores.diverged[i] = np.inf, found["diverged_at"]
                else:
                    left_over[i] = max(left_over[i], found["residual_v"])
        scores.indices[:] += self.residual * left_over


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
    path = path_named(tuning.trajectory)
    ref = reference(path, robot.parameters, tuning.period)
    scenarios = scenarios_of(tuning, robot)
    for plant, _ in scenarios:
        loop_of(plant, ref, weights=tuning.weights)  # checks period, step and weights
    simulated, whys = zip(*(in_closed_form(plant) for plant, _ in scenarios), strict=True)
    pairs = tuple((plant, its) for plant, (_, its) in zip(simulated, scenarios, strict=True))
    remarks = [f"MuJoCo simulates the chain: {why}" for why in whys if why]
    instead = any(one is not other for one, (other, _) in zip(simulated, scenarios, strict=True))
    if instead:
        remarks.append("chains are simulated in closed form, the result is rated on MuJoCo's")
    held = None
    if tuning.long_hold:
        longer = replace(path, hold=tuning.long_hold)
        held = reference(longer, robot.parameters, tuning.period), tuning.long_hold
    return Problem(
        tuning.design,
        pairs,
        ref,
        tuning.weights,
        threads,
        scenarios if instead else (),
        tuple(dict.fromkeys(remarks)),
        held,
        exact_of(tuning, robot),
        tuning.effort,
        tuning.v_gain,
        tuning.residual,
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
