"""What an arena costs, from a few individuals of every class timed on this machine.

>>> cost_of(ArenaConfig())
Cost(individuals=330000, runs=90450, seconds=3600.0)
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from flexsim.loop.control.stacking import stack
from flexsim.numerics.clocks import PERIOD
from studies.arena.contestants import CLASSES
from studies.arena.ground import Ground
from studies.arena.search import distribution_of

TIMED = 20  # individuals of a class, one generation


class Cost(NamedTuple):
    """Individuals that are tried, runs of the evaluation, time that both take here [s]."""

    individuals: int
    runs: int
    seconds: float


def seconds_each(ground: Ground, classes: Sequence[str], seed: int) -> dict[str, float]:
    """Return what an individual of each class takes on a ground [s].

    Random ones, all of them simulated: those that searches come to are hardly ever rejected.
    """
    found, whole = {}, replace(ground, exact=False)
    for name in classes:
        draws = distribution_of(CLASSES[name])
        knobs = draws.sample(np.random.default_rng(seed), TIMED)
        ground.tried(CLASSES[name], knobs[:2])  # whatever is compiled or loaded first
        began = time.perf_counter()
        whole.tried(CLASSES[name], knobs)
        built = (CLASSES[name].built(row, ground.designer) for row in knobs)
        ground.growth(CLASSES[name], stack([each for each in built if each is not None], PERIOD))
        found[name] = (time.perf_counter() - began) / TIMED
    return found


def cost_of(
    each: Mapping[str, float], individuals: Mapping[str, int], runs: int, paths: int
) -> Cost:
    """Return the whole, a run of the evaluation counted as a trajectory of a mean individual.

    Args:
        each: by class [s]. individuals: of each class. runs: of the evaluation.
        paths: trajectories of an individual.
    """
    tuning = sum(each[name] * count for name, count in individuals.items())
    mean = sum(each.values()) / len(each) / paths
    return Cost(sum(individuals.values()), runs, tuning + mean * runs)
