"""Random controllers that are not hopeless: drawn, and kept where the linear loop does not grow.

    >>> draws = screened(tuning, distribution_for(tuning), problem)
    >>> draws.sample(np.random.default_rng(1), 50).shape
    (50, 10)

Whoever samples need not know: a screened distribution is a distribution. What a pole costs beside
a simulation that diverges at once is another matter; `flexsim screening` looks into it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

import numpy as np

from flexsim.errors import ParameterError
from flexsim.linear.growth import SLACK, extreme_poses, growth_rates, loop_options
from flexsim.linear.loop_poles import LoopOptions, sampled_plant, spectral_radii
from flexsim.loop.control.stacking import stack
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from studies.tuning.distributions import Distribution
from studies.tuning.individuals import ControllerDesign, moderate
from studies.tuning.problem import Problem
from studies.tuning.tuning import Tuning


@dataclass(frozen=True, eq=False)
class NearRest:
    """How fast the loops of individuals grow, called with parameters (K, 10).

    Attributes:
        design: from parameters to filters.
        plants: each with the way its loop is linearised.
        poses: theta2 [rad].
    """

    design: ControllerDesign
    plants: tuple[tuple[Plant, LoopOptions], ...]
    poses: tuple[float, ...]

    def __call__(self, parameters: Array) -> Array:
        """Return growth rates (K,) [1/s], the largest over plants and poses.

        Plants and poses are taken in turn, and what outgrows `SLACK` on one is not looked at on
        the next. inf where no filter can be built, or one beyond `GAIN_MOST`.
        """
        growth = np.full(len(parameters), np.inf)
        built = self.design.filters(parameters)
        left = np.array([i for i, pair in enumerate(built) if pair and moderate(pair)], dtype=int)
        growth[left] = -np.inf
        for plant, options in self.plants:
            for pose in self.poses:
                if not len(left):
                    return growth
                drawn = stack([built[i] for i in left], options.period)
                radii = spectral_radii(plant, pose, drawn, options)
                growth[left] = np.maximum(growth[left], growth_rates(radii, options.period))
                left = left[growth[left] <= SLACK]
        return growth


@dataclass
class Tally:
    """What screening took: candidates looked at, and time [s]."""

    candidates: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class Screened(Distribution):
    """A distribution that is drawn from more often than needed, and only the best drawn kept.

    Attributes:
        growth: of individuals (K, 10), (K,) [1/s]; kept are those up to `SLACK`.
        most: candidates at most for every individual wanted.
        tally: counts what is screened; nothing depends on it.
    """

    growth: NearRest
    most: int
    tally: Tally = field(default_factory=Tally, compare=False)

    def sample(self, rng: np.random.Generator, count: int) -> Array:
        """Return random individuals (count, 10), in the order in which they were drawn.

        Candidates are drawn until enough of them pass, first as many as are wanted, then twice as
        many each time. Where too few pass, those that grow least make up the number.
        """
        start = time.perf_counter()
        drawn = np.empty((0, len(self.draws)))
        growth = np.empty(0)
        block = count
        while len(drawn) < self.most * count and np.sum(growth <= SLACK) < count:
            new = super().sample(rng, min(block, self.most * count - len(drawn)))
            drawn, growth = np.vstack([drawn, new]), np.append(growth, self.growth(new))
            block *= 2
        self.tally.candidates += len(drawn)
        self.tally.seconds += time.perf_counter() - start
        chosen = np.argsort(np.maximum(growth, SLACK), kind="stable")[:count]
        return drawn[np.sort(chosen)]


def screened(tuning: Tuning, draws: Distribution, problem: Problem) -> Distribution:
    """Return what a tuning draws its individuals from: `draws`, screened if it says so.

    The nominal robot's plants are linearised, with the slopes of their friction.

    Raises:
        ParameterError: the tuner is not the genetic algorithm, which alone draws all along.
    """
    if tuning.screen == 0:
        return draws
    if tuning.tuner != "genetic":
        raise ParameterError(
            "screen has no effect: only the genetic algorithm's draws are screened"
        )
    of_robot = len(problem.scenarios) // (len(tuning.payloads) + tuning.perturb)
    nominal = problem.scenarios[: of_robot * len(tuning.payloads)]
    plants = tuple(
        (
            plant,
            replace(
                loop_options(chosen.friction, tuning.period, hardware=chosen.hardware),
                v_gain=tuning.v_gain,
            ),
        )
        for plant, chosen in nominal
    )
    poses = tuple(extreme_poses(problem.reference))
    for plant, options in plants:
        sampled_plant(plant, poses[0], options)  # refuses what cannot be linearised
    return Screened(draws.draws, NearRest(problem.design, plants, poses), tuning.screen)
