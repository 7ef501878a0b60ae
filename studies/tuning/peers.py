"""The genetic algorithm's peers, at its budget of simulations: CMA-ES and differential evolution.

    >>> search = run_cma(evaluate, TABLE_1, GeneticSettings(), seed=1)

Both see the free parameters in coordinates in which the distribution has mean 0 and variance 1
(so log-uniform gains in their logarithms), evaluate a population per generation, and use up the
budget of an algorithm that is not stopped early. They are deterministic, so a search is continued
by running it again with the recorded generations' scores in place of simulations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import differential_evolution

from flexsim.errors import ParameterError, RunError
from flexsim.numerics.types import Array
from studies.tuning.distributions import Distribution
from studies.tuning.genetic import (
    Evaluate,
    Generation,
    GeneticSettings,
    OnGeneration,
    Search,
    generation_rng,
)

NORMAL_SPAN = 3.0  # standard deviations that bound differential evolution; CMA-ES has no bounds
PENALTY = 1e6  # index of the diverged: both want finite numbers, and compare them only
GROWTH_MOST = 1e6  # [1/s] in the index of the rejected
NEVER = -1.0  # spread of indices at which differential evolution stops before its budget is used
START_SPREAD = 0.3  # of CMA-ES around the individual it starts at, in standard deviations
GRID = 1e-6  # of what CMA-ES asks for [standard deviations]
LEAST_POPULATION = 5  # of differential evolution in scipy
ENDED = "budget used up"


class Ledger:
    """The evaluation as an optimiser calls it, once per generation, and all generations so far.

    Raises:
        RunError: the recorded generations are not of this search.
    """

    def __init__(
        self,
        evaluate: Evaluate,
        distribution: Distribution,
        origin: str,
        on_generation: OnGeneration | None,
        recorded: Sequence[Generation],
    ) -> None:
        self._evaluate = evaluate
        self._distribution = distribution
        self._origin = origin
        self._on_generation = on_generation
        self._recorded = recorded
        self.generations: list[Generation] = []

    def __call__(self, coordinates: Array) -> Array:
        """Return the indices (K,) of individuals at coordinates (K, F).

        PENALTY where diverged, more where rejected, the more the faster their loops grow.
        """
        number = len(self.generations)
        population = self._distribution.parameters(coordinates)
        if number < len(self._recorded):
            generation = self._recorded[number]
            if not np.array_equal(generation.population, population):
                raise RunError(f"generation {number} as recorded is not what this search comes to")
        else:
            origins = (self._origin,) * len(population)
            generation = Generation(number, population, origins, *self._evaluate(population))
        self.generations.append(generation)
        if number >= len(self._recorded) and self._on_generation:
            self._on_generation(generation)
        rejected = PENALTY * (1 + np.minimum(generation.growth, GROWTH_MOST))
        return np.where(np.isfinite(generation.indices), generation.indices, rejected)


def peer_generations(settings: GeneticSettings) -> int:
    """Return how many whole populations the genetic algorithm's budget pays for."""
    return settings.budget // settings.population


def run_cma(
    evaluate: Evaluate,
    distribution: Distribution,
    settings: GeneticSettings,
    seed: int,
    on_generation: OnGeneration | None = None,
    resume_from: Sequence[Generation] = (),
) -> Search:
    """Return a search by CMA-ES from the best of a random population, again when converged.

    Random populations are drawn until one individual holds, or growth tells the rejected apart:
    among nothing but diverged ones there is no direction to follow. What is asked for lies on
    GRID, so that the last digits of eigenvectors, which are LAPACK's, decide nothing.

    Args: as `studies.tuning.genetic.run_genetic`.
    """
    import cma  # half a second, for those who use it

    ledger = Ledger(evaluate, distribution, "cma", on_generation, resume_from)
    rng = generation_rng(seed, 0)
    options = {
        "popsize": settings.population,
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": np.nan,  # leaves numpy's global generator alone
        "verbose": -9,
    }
    strategy = None
    for _ in range(peer_generations(settings)):
        if strategy is None or strategy.stop():
            drawn = distribution.coordinates(rng, settings.population)
            indices = ledger(drawn)
            if indices.min() < PENALTY or indices.max() > PENALTY:
                best = drawn[np.argmin(indices)]
                strategy = cma.CMAEvolutionStrategy(best, START_SPREAD, options)
            continue
        asked = np.round(np.array(strategy.ask()) / GRID) * GRID
        strategy.tell(list(asked), ledger(asked).tolist())
    return Search(tuple(ledger.generations), ENDED)


def check_de(settings: GeneticSettings) -> None:
    """Refuse a population that is too small for differential evolution.

    Raises:
        ParameterError: it is.
    """
    if settings.population < LEAST_POPULATION:
        raise ParameterError(
            f"population is {settings.population}; differential evolution needs "
            f"{LEAST_POPULATION} or more"
        )


def run_de(
    evaluate: Evaluate,
    distribution: Distribution,
    settings: GeneticSettings,
    seed: int,
    on_generation: OnGeneration | None = None,
    resume_from: Sequence[Generation] = (),
) -> Search:
    """Return a search by SciPy's differential evolution, with its own defaults.

    Args: as `studies.tuning.genetic.run_genetic`.

    Raises:
        ParameterError: a population too small for it.
    """
    check_de(settings)
    ledger = Ledger(evaluate, distribution, "de", on_generation, resume_from)
    rng = generation_rng(seed, 0)
    draws = [distribution.draws[j] for j in distribution.free]
    spans = np.array([min(draw.span, NORMAL_SPAN) for draw in draws])
    first = np.clip(distribution.coordinates(rng, settings.population), -spans, spans)
    differential_evolution(
        lambda x: ledger(x.T),
        list(zip(-spans, spans, strict=True)),
        init=first,
        maxiter=peer_generations(settings) - 1,
        seed=rng,
        vectorized=True,
        updating="deferred",
        polish=False,
        atol=NEVER,
        tol=0.0,
    )
    return Search(tuple(ledger.generations), ENDED)
