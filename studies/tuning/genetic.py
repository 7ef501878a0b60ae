"""The genetic algorithm of section 3.2, each step a function; it knows nothing of robots.

    >>> search = run_genetic(evaluate, TABLE_1, GeneticSettings(), seed=1)
    >>> search.best_index, search.best_parameters

An individual is a row of parameters, a generation a `Generation`. What the paper leaves open is
*assumed* and said where it is decided: diverged individuals rank after all others, in order; the
two parents of a crossover differ; the chance of one more mutation halves each time.

The random numbers of a generation depend on the seed and its number only, so a search continues
from its recorded generations alone.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import ParameterError, RunError
from flexsim.numerics.types import Array
from studies.tuning.distributions import Distribution

VARIANCE_SHARE = 0.1  # of a parameter's magnitude, the variance of its mutation; section 3.2
CHANCE_RATIO = 0.5  # chance of m + 1 mutated parameters over that of m; *assumed*
SURVIVOR, INITIAL, MUTANT, CROSSOVER, FRESH = "survivor", "initial", "mutant", "crossover", "fresh"


class Scores(NamedTuple):
    """What evaluating K individuals gives.

    Attributes:
        indices: (K,) to be made small, inf where diverged or rejected.
        diverged: (K,) time [s], nan where none.
        growth: (K,) what those rejected unseen have too much of, 0 where not [1/s].
    """

    indices: Array
    diverged: Array
    growth: Array


Evaluate = Callable[[Array], Scores]


@dataclass(frozen=True)
class GeneticSettings:
    """Numbers of the algorithm; the defaults are section 3.2's.

    Attributes:
        population: individuals. generations: at most this many, the first one included.
        patience: generations without improvement after which to stop.
        survivors: the best that stay and reproduce.

    Raises:
        ParameterError: a number out of range.
    """

    population: int = 50
    generations: int = 100
    patience: int = 10
    survivors: int = 6

    def __post_init__(self) -> None:
        for name, least in (("generations", 1), ("patience", 1), ("survivors", 2)):
            if getattr(self, name) < least:
                raise ParameterError(f"{name} is {getattr(self, name)}; give {least} or more")
        if self.population <= self.survivors:
            raise ParameterError(
                f"population is {self.population}; give more than the {self.survivors} survivors"
            )

    @property
    def budget(self) -> int:
        """Evaluations of a search that is not stopped early: survivors are not run again."""
        return self.population + (self.generations - 1) * (self.population - self.survivors)


@dataclass(frozen=True, eq=False)
class Generation:
    """One generation, evaluated.

    Attributes:
        number: from 0. population: (P, N). origins: (P,) how each individual came about.
        indices, diverged, growth: (P,) as in `Scores`.
    """

    number: int
    population: Array
    origins: tuple[str, ...]
    indices: Array
    diverged: Array
    growth: Array

    @property
    def evaluated(self) -> int:
        """Individuals that were evaluated; survivors keep what they had."""
        return sum(origin != SURVIVOR for origin in self.origins)

    @property
    def evaluated_stable(self) -> int:
        """Those of them that held."""
        pairs = zip(self.origins, self.indices, strict=True)
        return sum(origin != SURVIVOR and bool(np.isfinite(index)) for origin, index in pairs)

    @property
    def stable_share(self) -> float:
        """Share of the whole population that holds."""
        return float(np.isfinite(self.indices).mean())


OnGeneration = Callable[[Generation], None]


@dataclass(frozen=True, eq=False)
class Search:
    """All generations of a search that has ended, and why it did."""

    generations: tuple[Generation, ...]
    ended: str

    @property
    def best_index(self) -> float:
        """Least index found; inf if every individual diverged."""
        return min(float(each.indices.min()) for each in self.generations)

    @property
    def best_parameters(self) -> Array | None:
        """Parameters (N,) of the least index, the first found; None if all diverged."""
        if not np.isfinite(self.best_index):
            return None
        first = next(each for each in self.generations if each.indices.min() == self.best_index)
        return first.population[np.argmin(first.indices)]

    @property
    def evaluations(self) -> int:
        """Individuals evaluated in all."""
        return sum(each.evaluated for each in self.generations)

    @property
    def stable_share(self) -> float:
        """Share of all evaluated individuals that held."""
        return sum(each.evaluated_stable for each in self.generations) / self.evaluations

    def best_after(self, evaluations: int) -> float:
        """Return the least index of the generations complete after so many evaluations."""
        best, spent = np.inf, 0
        for each in self.generations:
            spent += each.evaluated
            if spent > evaluations:
                break
            best = min(best, float(each.indices.min()))
        return best


def generation_rng(seed: int, number: int) -> np.random.Generator:
    """Return the random numbers of one generation."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))


def ranking(indices: Array, growth: Array | None = None) -> NDArray[np.intp]:
    """Return the order from best to worst; what diverged comes last, ties in order (*assumed*).

    Those rejected come after these, what grows least first.
    """
    rejected = np.zeros(len(indices)) if growth is None else growth
    return np.lexsort((np.where(np.isnan(indices), np.inf, indices), rejected))


def offspring_counts(eliminated: int) -> tuple[int, int, int]:
    """Return how many mutants, descendants and fresh individuals replace the eliminated.

    One half, one fourth, and the rest, which is one fourth of the paper's 44.
    """
    mutants, descendants = eliminated // 2, eliminated // 4
    return mutants, descendants, eliminated - mutants - descendants


def mutation_chances(parameters: int) -> Array:
    """Return the chances (parameters,) that 1, 2, ... parameters mutate."""
    chances = CHANCE_RATIO ** np.arange(1, parameters + 1)
    return chances / chances.sum()


def mutation_deviation(individual: Array) -> Array:
    """Return the standard deviations of the parameters' mutations.

    The *variance* is one tenth of the magnitude, in the parameter's own unit. So a parameter that
    is exactly zero never mutates.
    """
    return np.sqrt(VARIANCE_SHARE * np.abs(individual))


def mutate(individual: Array, free: NDArray[np.intp], rng: np.random.Generator) -> Array:
    """Return a copy, some of its free parameters changed; step six."""
    count = 1 + rng.choice(len(free), p=mutation_chances(len(free)))
    chosen = rng.choice(free, count, replace=False)
    mutant = individual.copy()
    mutant[chosen] += mutation_deviation(individual)[chosen] * rng.standard_normal(count)
    return mutant


def crossover(survivors: Array, rng: np.random.Generator) -> Array:
    """Return a descendant of two different survivors, each parameter one of theirs; step seven."""
    first, second = survivors[rng.choice(len(survivors), 2, replace=False)]
    return np.where(rng.random(len(first)) < 0.5, first, second)


def breed(
    survivors: Array, eliminated: int, distribution: Distribution, rng: np.random.Generator
) -> tuple[Array, tuple[str, ...]]:
    """Return the individuals that replace the eliminated ones, and their origins; six to eight."""
    mutants, descendants, fresh = offspring_counts(eliminated)
    free = distribution.free
    children = [
        mutate(survivors[rng.integers(len(survivors))], free, rng) for _ in range(mutants)
    ] + [crossover(survivors, rng) for _ in range(descendants)]
    born = distribution.sample(rng, fresh)
    origins = (MUTANT,) * mutants + (CROSSOVER,) * descendants + (FRESH,) * fresh
    return np.vstack([*children, born]), origins


def has_stalled(best: Sequence[Any], patience: int) -> bool:
    """Return whether the last `patience` generations improved nothing; step two."""
    return len(best) > patience and min(best[-patience:]) >= min(best[:-patience])


def best_of(generation: Generation) -> tuple[float, float]:
    """Return the least index [m2 s], inf if none holds; then the least growth of all [1/s].

    So that a search goes on that has found nothing that may be simulated, but comes nearer.
    """
    index = float(generation.indices.min())
    return index, 0.0 if np.isfinite(index) else float(generation.growth.min())


def first_generation(
    evaluate: Evaluate, distribution: Distribution, size: int, seed: int
) -> Generation:
    """Return a random population, evaluated; steps one, three and four."""
    population = distribution.sample(generation_rng(seed, 0), size)
    return Generation(0, population, (INITIAL,) * size, *evaluate(population))


def next_generation(
    evaluate: Evaluate,
    distribution: Distribution,
    survivors: int,
    seed: int,
    last: Generation,
) -> Generation:
    """Return the generation after `last`, evaluated but for the survivors; five to eight."""
    number = last.number + 1
    kept = ranking(last.indices, last.growth)[:survivors]
    children, origins = breed(
        last.population[kept],
        len(last.population) - survivors,
        distribution,
        generation_rng(seed, number),
    )
    scores = evaluate(children)
    return Generation(
        number,
        np.vstack([last.population[kept], children]),
        (SURVIVOR,) * survivors + origins,
        np.concatenate([last.indices[kept], scores.indices]),
        np.concatenate([last.diverged[kept], scores.diverged]),
        np.concatenate([last.growth[kept], scores.growth]),
    )


def check_recorded(recorded: Sequence[Generation], survivors: int) -> None:
    """Refuse generations that are not of one search: each begins with the best of the one before.

    Raises:
        RunError: one does not.
    """
    for last, new in itertools.pairwise(recorded):
        kept = ranking(last.indices, last.growth)[:survivors]
        for before, after in (
            (last.population, new.population),
            (last.indices, new.indices),
            (last.diverged, new.diverged),
            (last.growth, new.growth),
        ):
            if not np.array_equal(before[kept], after[:survivors], equal_nan=True):
                raise RunError(
                    f"generation {new.number} as recorded does not begin with the best of the one "
                    "before"
                )


def run_genetic(
    evaluate: Evaluate,
    distribution: Distribution,
    settings: GeneticSettings,
    seed: int,
    on_generation: OnGeneration | None = None,
    resume_from: Sequence[Generation] = (),
) -> Search:
    """Return the search of section 3.2.

    Args:
        evaluate: from individuals (K, N) to their scores.
        distribution: of the first population and of fresh individuals.
        settings, seed: as named.
        on_generation: called with every new generation.
        resume_from: the first generations of the same search, which are not evaluated again.

    Raises:
        RunError: they are not of one search.
    """
    check_recorded(resume_from, settings.survivors)
    done = list(resume_from)
    while True:
        stalled = has_stalled([best_of(each) for each in done], settings.patience)
        if stalled or len(done) >= settings.generations:
            reason = f"no improvement over {settings.patience} generations"
            return Search(tuple(done), reason if stalled else "all generations done")
        if done:
            new = next_generation(evaluate, distribution, settings.survivors, seed, done[-1])
        else:
            new = first_generation(evaluate, distribution, settings.population, seed)
        done.append(new)
        if on_generation:
            on_generation(new)
