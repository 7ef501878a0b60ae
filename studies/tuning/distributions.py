"""What a tuner draws the ten parameters from: Table 1, or anything else, as data.

    >>> TABLE_1.sample(np.random.default_rng(1), 50).shape
    (50, 10)

Gains are in N m ms^nu/rad, with time in milliseconds: only then do Table 1's numbers and Table
2's agree (see `controllers.tuned`). `.problem` converts them to SI for the filters. A file
in TOML replaces some of Table 1's rows:

    k1 = { log-uniform = [1e3, 1e5] }
    nu1 = { uniform = [0, 1] }
    k2 = { normal = [1, 0.1] }
    nu2 = { fixed = -1 }
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import ParameterError
from flexsim.files.reading import MIB, read_text
from flexsim.numerics.elementary import exp
from flexsim.numerics.types import Array

NAMES = ("k1", "nu1", "k2", "nu2", "k3", "k4", "nu4", "k5", "nu5", "k6")  # as in Table 1
KINDS = {"normal": 2, "uniform": 2, "log-uniform": 2, "fixed": 1}  # name: how many numbers
TOML_MOST = 1 * MIB
HALF_SPAN = math.sqrt(3.0)  # of a uniform distribution of standard deviation 1


@dataclass(frozen=True)
class Draw:
    """The distribution of one parameter.

    Attributes:
        kind: 'normal' (mean, standard deviation), 'uniform' or 'log-uniform' (low, high), or
            'fixed' (value).
        numbers: as `kind` says.

    Raises:
        ParameterError: an unknown kind, or numbers that it cannot take.
    """

    kind: str
    numbers: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ParameterError(
                f"distribution {self.kind!r} is unknown; choose one of {', '.join(KINDS)}"
            )
        numbers = self.numbers
        real = all(isinstance(x, int | float) and not isinstance(x, bool) for x in numbers)
        wanted = KINDS[self.kind]
        if len(numbers) != wanted or not (real and all(map(math.isfinite, numbers))):
            raise ParameterError(
                f"distribution {self.kind!r} has {numbers!r}; give {wanted} finite number(s)"
            )
        if self.kind == "normal" and not numbers[1] > 0:
            raise ParameterError(f"standard deviation is {numbers[1]:g}; give more than 0")
        if self.kind in ("uniform", "log-uniform") and not numbers[0] < numbers[1]:
            raise ParameterError(f"{self.kind} range is {numbers}; give low < high")
        if self.kind == "log-uniform" and not numbers[0] > 0:
            raise ParameterError(f"log-uniform range is {numbers}; give 0 < low < high")

    @property
    def span(self) -> float:
        """Largest coordinate of a bounded distribution, infinite for a normal one."""
        return math.inf if self.kind == "normal" else HALF_SPAN

    def value(self, coordinate: Array) -> Array:
        """Return the parameter at coordinates in which the distribution has mean 0, variance 1."""
        if self.kind == "fixed":
            return np.full_like(coordinate, self.numbers[0])
        low, high = self.numbers
        if self.kind == "normal":
            return low + high * coordinate  # mean and standard deviation
        if self.kind == "uniform":
            return (low + high) / 2 + (high - low) / 2 * coordinate / HALF_SPAN
        middle, half = math.log(low * high) / 2, math.log(high / low) / 2
        with np.errstate(over="ignore"):
            return exp(middle + half * coordinate / HALF_SPAN)


@dataclass(frozen=True)
class Distribution:
    """Distributions of the ten parameters, or of others that are named.

    Attributes:
        draws: of each. names: of the parameters, in the same order.

    Raises:
        ParameterError: not one for each name, or all of them fixed.
    """

    draws: tuple[Draw, ...]
    names: tuple[str, ...] = field(default=NAMES, kw_only=True)

    def __post_init__(self) -> None:
        if len(self.draws) != len(self.names):
            raise ParameterError(f"{len(self.draws)} distributions given; give {len(self.names)}")
        if not len(self.free):
            raise ParameterError("every parameter is fixed; leave one or more to be tuned")

    @property
    def free(self) -> NDArray[np.intp]:
        """Indices of the parameters that are not fixed."""
        return np.flatnonzero([draw.kind != "fixed" for draw in self.draws])

    def coordinates(self, rng: np.random.Generator, count: int) -> Array:
        """Return draws (count, F) of the F free parameters, in their coordinates."""
        columns = [
            rng.standard_normal(count)
            if math.isinf(self.draws[j].span)
            else rng.uniform(-HALF_SPAN, HALF_SPAN, count)
            for j in self.free
        ]
        return np.stack(columns, axis=1)

    def parameters(self, coordinates: Array) -> Array:
        """Return all parameters (count, N) at coordinates (count, F) of the free ones."""
        full = np.zeros((len(coordinates), len(self.names)))
        full[:, self.free] = coordinates
        return np.stack([d.value(full[:, j]) for j, d in enumerate(self.draws)], axis=1)

    def sample(self, rng: np.random.Generator, count: int) -> Array:
        """Return random individuals (count, N)."""
        return self.parameters(self.coordinates(rng, count))

    def with_draws(self, changes: Mapping[str, Draw]) -> Distribution:
        """Return the distribution with some parameters' draws replaced, by name.

        Raises:
            ParameterError: a name that is none of them.
        """
        unknown = [name for name in changes if name not in self.names]
        if unknown:
            raise ParameterError(
                f"parameter {unknown[0]!r} is unknown; choose from {', '.join(self.names)}"
            )
        draws = [changes.get(name, draw) for name, draw in zip(self.names, self.draws, strict=True)]
        return replace(self, draws=tuple(draws))

    def with_integer_orders(self) -> Distribution:
        """Return the distribution with the orders of integer PIDs.

        Source: section 3.2, last paragraph: nu_1 = nu_4 = 1, nu_2 = nu_5 = -1.
        """
        forced = {"nu1": 1.0, "nu2": -1.0, "nu4": 1.0, "nu5": -1.0}
        return self.with_draws({name: Draw("fixed", (nu,)) for name, nu in forced.items()})

    def table(self) -> dict[str, dict[str, list[float]]]:
        """Return the distribution as the TOML file has it."""
        pairs = zip(self.names, self.draws, strict=True)
        return {name: {draw.kind: list(draw.numbers)} for name, draw in pairs}


def _normal(mean: float, deviation: float) -> Draw:
    return Draw("normal", (mean, deviation))


_JOINTS = (
    (_normal(1e4, 2000.0), _normal(0.0, 2.0)),
    (_normal(1e2, 20.0), _normal(0.0, 2.0)),
)
_REST = (_normal(1.0, 0.1), _normal(0.0, 0.1), _normal(1e-2, 0.1))

TABLE_1 = Distribution((*_JOINTS[0], *_REST, *_JOINTS[1], *_REST))
"""Table 1, its gains for time in milliseconds."""

LOG_UNIFORM = TABLE_1.with_draws(
    {  # ours, *assumed*: two decades for each gain
        "k1": Draw("log-uniform", (1e3, 1e5)),
        "k2": Draw("log-uniform", (1e-3, 1e-1)),
        "k3": Draw("log-uniform", (1e1, 1e3)),
        "k4": Draw("log-uniform", (1e1, 1e3)),
        "k5": Draw("log-uniform", (1e-4, 1e-2)),
        "k6": Draw("log-uniform", (1e0, 1e2)),
    }
)
"""Table 1's orders with gains drawn evenly in their logarithms, wide enough for integer PIDs."""

WIDE = Distribution(
    tuple(
        draw
        for gain in (1e3, 1e2)  # of either joint
        for draw in (
            Draw("log-uniform", (gain / 10, gain * 10)),
            Draw("uniform", (-0.5, 1.0)),
            _normal(0.0, gain / 2),
            Draw("uniform", (-1.0, 1.5)),
            _normal(0.0, gain / 2),
        )
    )
)
"""Ours, *assumed*: all three terms of a joint of one size, orders from -1 to 1.5."""

DISTRIBUTIONS: Mapping[str, Distribution] = {
    "table-1": TABLE_1,
    "log-uniform": LOG_UNIFORM,
    "wide": WIDE,
}


def draw_of(name: str, given: Any) -> Draw:
    """Return one parameter's distribution from a row such as {"normal": [1, 0.1]}.

    Raises:
        ParameterError: the row does not have this form.
    """
    if not isinstance(given, dict) or len(given) != 1:
        raise ParameterError(f"{name} is {given!r}; give it as {{ normal = [mean, deviation] }}")
    ((kind, numbers),) = given.items()
    numbers = numbers if isinstance(numbers, list) else [numbers]
    try:
        return Draw(kind, tuple(numbers))
    except ParameterError as error:
        raise ParameterError(f"{name}: {error}") from None


def distribution(name: str) -> Distribution:
    """Return a distribution by its name, or Table 1 with the rows of a TOML file in place.

    Raises:
        ParameterError: there is none of that name, or the file says what cannot be used.
        RunError: the file cannot be read.
    """
    if name in DISTRIBUTIONS:
        return DISTRIBUTIONS[name]
    path = Path(name)
    if path.suffix != ".toml":
        raise ParameterError(
            f"distribution {name!r} is unknown; choose one of {', '.join(DISTRIBUTIONS)}, "
            "or give a .toml file"
        )
    text = read_text(path, TOML_MOST, "distribution")
    try:
        rows = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ParameterError(f"{name}: {error}") from None
    try:
        return TABLE_1.with_draws({key: draw_of(key, row) for key, row in rows.items()})
    except ParameterError as error:
        raise ParameterError(f"{name}: {error}") from None
