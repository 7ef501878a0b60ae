"""What a sweep varies: a grid, and samples of distributions, the same for every plant.

>>> draws = Draws.of(study.sweep, seed=1)
>>> draws.count, draws.values(3)
(64, (0.331,))

Draw number = sample + samples x grid point. Sobol' sequences are scrambled, Latin hypercubes
random, both by the study's seed. `saltelli` has the rows that Sobol' indices need: n of A, n of B,
then for each number n of A with that number from B.

Source: A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259, for the last.
"""

from __future__ import annotations

import itertools
import math
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.stats import qmc

from flexsim.errors import ParameterError
from flexsim.numerics.elementary import exp, log
from flexsim.numerics.types import Array
from studies.spec.parts import DRAWS_MOST, NumbersPart, SweepPart

STREAM = (2,)  # of the seed, beside those of tunings
SALTELLI = "saltelli"
POINTS_MOST = 100_000  # of one number's grid
DIGITS = 12  # of a point of a grid that is spaced


@dataclass(frozen=True, eq=False)
class Draws:
    """What every draw sets.

    Attributes:
        gridded, sampled: paths of the numbers.
        grid: (G, gridded) points, in the order of the file, the last number fastest.
        unit: (S, sampled) samples in (0, 1); parts: the distributions, of which they are quantiles.
        sampler: as the file names it; base: S of it, or n of saltelli's n (d + 2).
    """

    gridded: tuple[str, ...]
    sampled: tuple[str, ...]
    grid: list[tuple[float, ...]]
    unit: Array
    parts: tuple[NumbersPart, ...]
    sampler: str
    base: int

    @classmethod
    def of(cls, sweep: SweepPart, seed: int) -> Draws:
        """Return the draws of a sweep.

        Raises:
            ParameterError: a number of the file has several ranges or none, or one out of order.
        """
        lists: dict[str, list[float]] = {}
        sampled: dict[str, NumbersPart] = {}
        for path, part in sweep.numbers.items():
            given = part.model_dump(exclude_none=True)
            if len(given) != 1:
                said = f"has {' and '.join(given)}" if given else "says nothing"
                raise ParameterError(f"sweep.{path} {said}; give one of {', '.join(KINDS)}")
            points = _grid(path, part)
            if points is None:
                _require_distribution(path, part)
                sampled[path] = part
            else:
                lists[path] = points
        count = math.prod(map(len, lists.values())) * (sweep.samples if sampled else 1)
        if count > DRAWS_MOST:
            raise ParameterError(f"sweep has {count:,} draws; give {DRAWS_MOST:,} at most")
        unit = _unit(sweep, len(sampled), seed)
        base = sweep.samples if sampled else 1
        grid = list(itertools.product(*lists.values()))
        parts = tuple(sampled.values())
        return cls(tuple(lists), tuple(sampled), grid, unit, parts, sweep.sampler, base)

    @property
    def paths(self) -> tuple[str, ...]:
        """All numbers that are varied, those on the grid first."""
        return self.gridded + self.sampled

    @property
    def samples(self) -> int:
        """Samples at each point of the grid."""
        return len(self.unit)

    @property
    def count(self) -> int:
        """Draws in all."""
        return len(self.grid) * self.samples

    def columns(self, draws: NDArray[np.int64]) -> list[Array]:
        """Return what draws (K,) set, a column for each of `paths`."""
        point, sample = np.divmod(draws, self.samples)
        grid = np.array(self.grid).reshape(len(self.grid), len(self.gridded))
        found = [grid[point, i] for i in range(len(self.gridded))]
        unit = self.unit[sample]
        return found + [quantiles(part, unit[:, i]) for i, part in enumerate(self.parts)]

    def values(self, draw: int) -> tuple[float, ...]:
        """Return what one draw sets, in the order of `paths`."""
        return tuple(float(each[0]) for each in self.columns(np.array([draw])))


KINDS = tuple(item.alias or name for name, item in NumbersPart.model_fields.items())


def _grid(path: str, part: NumbersPart) -> list[float] | None:
    """Return the points of a number on a grid, None if it has a distribution."""
    if part.values is not None:
        if not part.values or len(set(part.values)) != len(part.values):
            raise ParameterError(f"sweep.{path}.values is {part.values}; give one or more, once")
        return part.values
    given = part.linear or part.log
    if given is None:
        return None
    low, high, count = given
    kind = "linear" if part.linear else "log"
    if not (1 <= count <= POINTS_MOST and count == int(count)):
        raise ParameterError(
            f"sweep.{path}.{kind} has {count:g} points; give a whole number, 1 to {POINTS_MOST}"
        )
    if kind == "log" and not (low > 0 and high > 0):
        raise ParameterError(f"sweep.{path}.log is from {low:g} to {high:g}; give both above 0")
    share = np.linspace(0.0, 1.0, int(count))
    if kind == "log":
        points = exp(math.log(low) + (math.log(high) - math.log(low)) * share)
    else:
        points = low + (high - low) * share
    return [float(f"{each:.{DIGITS}g}") for each in points]  # 0.15, not 0.15000000000000002


def _require_distribution(path: str, part: NumbersPart) -> None:
    """Refuse a distribution without width."""
    for kind, given in (("uniform", part.uniform), ("log-uniform", part.log_uniform)):
        if given and not -math.inf < given[0] < given[1] < math.inf:
            raise ParameterError(f"sweep.{path}.{kind} is {list(given)}; give [low, high]")
    if part.log_uniform and part.log_uniform[0] <= 0:
        raise ParameterError(f"sweep.{path}.log-uniform begins at or below 0; give more than 0")
    if part.normal and not 0 < part.normal[1] < math.inf:
        raise ParameterError(f"sweep.{path}.normal is {list(part.normal)}; give [mean, deviation]")


def quantiles(part: NumbersPart, unit: Array) -> Array:
    """Return the quantiles of a distribution at shares (K,) in (0, 1)."""
    if part.normal is not None:
        mean, deviation = part.normal
        return np.asarray(mean + deviation * special.ndtri(unit))
    if part.log_uniform is not None:
        low, high = (float(each) for each in log(np.array(part.log_uniform)))
        return exp(low + (high - low) * unit)
    low, high = part.uniform or (0.0, 1.0)
    return low + (high - low) * unit


def _unit(sweep: SweepPart, size: int, seed: int) -> Array:
    """Return samples (S, size) in (0, 1)."""
    if size == 0:
        return np.zeros((1, 0))
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=STREAM))
    if sweep.sampler == "latin-hypercube":
        return np.asarray(qmc.LatinHypercube(size, rng=rng).random(sweep.samples))
    if sweep.sampler != SALTELLI:
        return sobol_samples(size, sweep.samples, rng)
    if sweep.samples & (sweep.samples - 1):
        raise ParameterError(
            f"sweep.samples is {sweep.samples}, which Sobol' indices cannot be made of; give a "
            "power of 2"
        )
    return saltelli_samples(size, sweep.samples, rng)


def saltelli_samples(size: int, count: int, rng: np.random.Generator) -> Array:
    """Return the rows (count (size + 2), size) in (0, 1) that Sobol' indices need: A, B, mixed.

    Args:
        count: of A, a power of 2.
    """
    both = sobol_samples(2 * size, count, rng)
    A, B = both[:, :size], both[:, size:]
    mixed = [np.where(np.arange(size) == i, B, A) for i in range(size)]
    return np.concatenate([A, B, *mixed])


def sobol_samples(size: int, count: int, rng: np.random.Generator) -> Array:
    """Return the first points (count, size) of a scrambled Sobol' sequence."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # counts that are no power of 2 are allowed
        return np.asarray(qmc.Sobol(size, scramble=True, rng=rng).random(count))


def sensitivity_rows_of(draws: Draws, values: Array) -> tuple[Array, Array, Array]:
    """Return f(A) (n,), f(B) (n,) and f(AB) (d, n) of values (n (d + 2),) by draw."""
    n, d = draws.base, len(draws.sampled)
    return values[:n], values[n : 2 * n], values[2 * n :].reshape(d, n)
