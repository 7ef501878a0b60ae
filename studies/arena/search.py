"""One search: a class, a seed, so many simulations; all that it tried is kept.

>>> found = searched(ground, CLASSES["pid"], seed=1, budget=2000)       # (N, p + 5)
>>> best_of(found)[:-5]                                                 # its knobs

CMA-ES as `flexsim tune` runs it, or the paper's genetic algorithm, on the knobs in coordinates in
which their ranges are alike; knobs beyond their ranges count as at the ends.
"""

from __future__ import annotations

import math

import numpy as np

from flexsim.numerics.types import Array
from studies.arena.contestants import Contestant
from studies.arena.ground import Ground, within
from studies.tuning.distributions import Distribution, Draw
from studies.tuning.genetic import GeneticSettings, Scores
from studies.tuning.peers import run_cma
from studies.tuning.problem import tune

POPULATION, SURVIVORS = 20, 6
CMA = "cma"
NEVER = 10**6  # generations of patience: the budget is used up
OBJECTIVE, INDEX, EFFORT, DIVERGED, GROWTH = -5, -4, -3, -2, -1  # columns behind the knobs


def distribution_of(contestant: Contestant) -> Distribution:
    """Return what a search draws a class's knobs from: evenly, or by their logarithms."""
    draws = [
        Draw("log-uniform" if each.log else "uniform", (each.low, each.high))
        for each in contestant.knobs
    ]
    return Distribution(tuple(draws), names=tuple(each.name for each in contestant.knobs))


def settings_of(budget: int) -> GeneticSettings:
    """Return a tuner's settings for so many simulations of all three trajectories."""
    more = math.ceil(max(budget - POPULATION, 0) / (POPULATION - SURVIVORS))
    return GeneticSettings(POPULATION, 1 + more, NEVER, SURVIVORS)


def searched(
    ground: Ground, contestant: Contestant, seed: int, budget: int, tuner: str = CMA
) -> Array:
    """Return all individuals that a search tried, in order (N, p + 5).

    Columns are the knobs, then objective, index (5) summed over the trajectories [m2 s], effort
    over what is usual [-], time of divergence [s], nan where none, growth of the exact loops [1/s].

    Args:
        seed: of the search. budget: individuals. tuner: a key of `studies.tuning.tuning.TUNERS`.
    """
    rows: list[Array] = []

    def evaluate(knobs: Array) -> Scores:
        scores, found = ground.scores(contestant, knobs)
        rows.append(np.column_stack([within(contestant, knobs), *found]))
        return scores

    draws, settings = distribution_of(contestant), settings_of(budget)
    if tuner == CMA:
        run_cma(evaluate, draws, settings, seed)
    else:
        tune(evaluate, draws, settings, seed, tuner)
    return np.vstack(rows)


def best_of(found: Array) -> Array:
    """Return the row (p + 5,) of the least objective, the first found.

    If all diverged, of the one that did so last; if all grow, of the one that does least.
    """
    best = int(np.argmin(found[:, OBJECTIVE]))
    if np.isfinite(found[best, OBJECTIVE]):
        return found[best]
    return found[np.lexsort((-found[:, DIVERGED], found[:, GROWTH]))[0]]


def front(points: Array) -> Array:
    """Return which of points (N, 2), both to be small, none dominates, by the first (M,)."""
    order = np.lexsort((points[:, 1], points[:, 0]))
    order = order[np.isfinite(points[order]).all(axis=1)]
    second = points[order, 1]
    least = np.minimum.accumulate(np.concatenate([[np.inf], second]))[:-1]
    return order[second < least]
