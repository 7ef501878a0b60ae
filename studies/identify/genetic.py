"""The paper's way: its genetic algorithm on the quadratic error of the model's responses.

>>> z, evaluations = genetic(problem, GeneticSettings(population=50, generations=40), seed=1)

Section 3.2's algorithm as the tuner has it, its individuals the free numbers over their nominal
ones. The paper says no more of how it identified than that, on steps and impulses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import RunError
from flexsim.numerics.types import Array
from studies.identify.residuals import Problem
from studies.tuning.distributions import Distribution
from studies.tuning.genetic import GeneticSettings, Scores, run_genetic

DRAWN = 0.7  # coordinates to either side within which fresh individuals lie: a factor of 2
LINEAR_DRAWN = 3.0  # of those that begin at zero


@dataclass(frozen=True)
class Around:
    """Individuals around the nominal numbers: 1 is a number's nominal one, or its unit at zero."""

    problem: Problem

    @property
    def free(self) -> NDArray[np.intp]:
        """Indices of what mutates: all."""
        return np.arange(self.problem.own)

    def sample(self, rng: np.random.Generator, count: int) -> Array:
        """Return individuals (count, p)."""
        z = rng.uniform(-DRAWN, DRAWN, (count, self.problem.own))
        linear = np.array([each.scale is not None for each in self.problem.model.free])
        return np.where(linear, 1 + LINEAR_DRAWN * (z + DRAWN), np.exp(z))


def coordinates(problem: Problem, individual: Array) -> Array:
    """Return the coordinates of an individual (p,), its starts as the first rows say."""
    z = problem.beginning()
    low, high = problem.bounds()
    for j, (each, factor) in enumerate(zip(problem.model.free, individual, strict=True)):
        own = np.log(max(factor, 1e-300)) if each.scale is None else factor - 1
        z[j] = np.clip(own, low[j], high[j])
    return z


def genetic(problem: Problem, settings: GeneticSettings, seed: int) -> tuple[Array, int]:
    """Return the coordinates that the algorithm ends with, and how many it evaluated.

    Raises:
        RunError: every individual is lost.
    """

    def evaluate(individuals: Array) -> Scores:
        points = [coordinates(problem, each) for each in individuals]
        squares = np.array([float(each @ each) for each in problem.many(points)])
        nothing = np.zeros(len(points))
        return Scores(squares / 2, np.full(len(points), np.nan), nothing)

    drawn = cast(Distribution, Around(problem))
    search = run_genetic(evaluate, drawn, settings, seed)
    if search.best_parameters is None:
        raise RunError("the genetic algorithm found no numbers with a motion; begin nearer")
    return coordinates(problem, search.best_parameters), search.evaluations
