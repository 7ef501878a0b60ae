"""What a run of `flexsim tune` has on disk, read and checked: its configuration, its generations.

    >>> content = configuration(run)
    >>> tuning = tuning_from(run, content.values)
    >>> done, size = generations(run, tuning)     # those that are complete, and where they end

Whether other versions made it is for the caller to ask: a run is continued by its own only, its
result may be used by any that knows its options.
"""

from __future__ import annotations

import csv
import dataclasses
import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexsim.arm.parameters import Parameters
from flexsim.errors import FlexsimError, RunError
from flexsim.files.reading import MIB, read_regular, read_text
from studies.core.folder import CONFIG
from studies.tuning.distributions import NAMES, Distribution, draw_of
from studies.tuning.genetic import CROSSOVER, FRESH, INITIAL, MUTANT, SURVIVOR, Generation
from studies.tuning.individuals import DERIVATIVE_PAIRS, SI_NAMES, in_si
from studies.tuning.peers import peer_generations
from studies.tuning.tuning import TUNERS, Tuning

GENERATIONS, RESULT = "generations.csv", "result.json"
CONFIG_MOST, RESULT_MOST, GENERATIONS_MOST = 4 * MIB, 1 * MIB, 1024 * MIB
COLUMNS = (
    "generation",
    "individual",
    "origin",
    *NAMES,
    *SI_NAMES,
    "index",
    "diverged_at",
    "growth",
)
ORIGINS = {SURVIVOR, INITIAL, MUTANT, CROSSOVER, FRESH, *TUNERS}
HEADER = (",".join(COLUMNS) + "\n").encode()
NO_JSON = (ValueError, KeyError, TypeError, RecursionError)  # what damaged text may raise
NO_NUMBERS = (ValueError, TypeError, AttributeError, ArithmeticError)  # what wrong values may


@dataclass(frozen=True)
class Configuration:
    """A run's config.json as it stands there: nothing of it is checked yet.

    Attributes:
        versions: it was made with. values: of its `Tuning`. draws: of its `Distribution`.
    """

    versions: dict[str, Any]
    values: dict[str, Any]
    draws: dict[str, Any]


def _damaged(folder: Path) -> RunError:
    return RunError(f"{folder / CONFIG} is damaged or not of flexsim tune")


def configuration(folder: Path) -> Configuration:
    """Return what a run's config.json says.

    Raises:
        RunError: the folder is no run of flexsim tune.
    """
    try:
        text = read_text(folder / CONFIG, CONFIG_MOST, "configuration")
    except RunError as error:
        raise RunError(f"{folder} is not a run of flexsim tune: {error}") from None
    try:
        content = json.loads(text)
        keys = ("versions", "configuration", "distribution")
        return Configuration(*(dict(content[key]) for key in keys))
    except NO_JSON:
        raise _damaged(folder) from None


def _names(names: Any) -> str | tuple[str, ...]:
    """Return one name or several as JSON has them."""
    return names if isinstance(names, str) else tuple(names)


FROM_JSON: Mapping[str, Callable[[Any], Any]] = {  # of values that JSON has in another type
    "weights": tuple,
    "hardware_with": tuple,
    "hardware_torque_limit": lambda limit: limit if limit is None else tuple(limit),
    "robot": lambda numbers: Parameters(**numbers),
    "modal_damping": tuple,
    "payloads": tuple,
    "plant": _names,
    "hardware": _names,
}


def tuning_from(folder: Path, values: Mapping[str, Any], required: Collection[str]) -> Tuning:
    """Return the tuning that a run's values describe, defaults where it has none.

    Args:
        folder: for messages. values: of config.json. required: names that may not be missing.

    Raises:
        RunError: one is missing, or unknown, or cannot be used.
    """
    if not set(required) <= set(values):
        raise _damaged(folder)
    known = {item.name for item in dataclasses.fields(Tuning)}
    if unknown := sorted(set(values) - known):
        raise RunError(
            f"{folder / CONFIG} cannot be used: this version knows no {unknown[0]!r}; "
            "use the one that made it"
        )
    try:
        typed = {name: read(values[name]) for name, read in FROM_JSON.items() if name in values}
        return Tuning(**{**values, **typed})
    except FlexsimError as error:
        raise RunError(f"{folder / CONFIG} cannot be used: {error}") from None
    except NO_NUMBERS:
        raise _damaged(folder) from None


def described(tuning: Tuning) -> str:
    """Return in one line what was tuned."""
    how = f"{tuning.controller} ({tuning.realisation})"
    return (
        f"{tuning.trajectory}, {' and '.join(tuning.plants)}, {how}, setting {tuning.setting}, "
        f"{tuning.tuner}, seed {tuning.seed}"
    )


def draws_from(folder: Path, table: Mapping[str, Any]) -> Distribution:
    """Return the distribution that a run's table describes; arguments and errors as above."""
    if set(table) != set(NAMES):
        raise _damaged(folder)
    try:
        return Distribution(tuple(draw_of(name, table[name]) for name in NAMES))
    except FlexsimError as error:
        raise RunError(f"{folder / CONFIG} cannot be used: {error}") from None
    except NO_NUMBERS:
        raise _damaged(folder) from None


def rows(generation: Generation) -> list[list[str]]:
    """Return a generation as fields of text, which read back to the same bits."""
    si = in_si(generation.population)[:, [k for k, _ in DERIVATIVE_PAIRS]]
    lines = []
    for i, origin in enumerate(generation.origins):
        when = float(generation.diverged[i])
        numbers = [*generation.population[i], *si[i], generation.indices[i]]
        texts = [repr(float(x)) for x in numbers]
        ended = "" if np.isnan(when) else repr(when)
        grown = repr(float(generation.growth[i]))
        lines.append([str(generation.number), str(i), origin, *texts, ended, grown])
    return lines


def _generation(lines: list[str], number: int) -> Generation:
    """Return one generation from its lines.

    Raises:
        ValueError: a line is not what `rows` writes.
    """
    table = list(csv.DictReader(lines, fieldnames=COLUMNS, strict=True))
    for i, row in enumerate(table):
        whole = None not in row and None not in row.values()  # as many fields as columns
        if not whole or (row["generation"], row["individual"]) != (str(number), str(i)):
            raise ValueError
        if row["origin"] not in ORIGINS or np.isnan(float(row["index"])):
            raise ValueError
        if not float(row["growth"]) >= 0:
            raise ValueError
    return Generation(
        number,
        np.array([[float(row[name]) for name in NAMES] for row in table]),
        tuple(row["origin"] for row in table),
        np.array([float(row["index"]) for row in table]),
        np.array([float(row["diverged_at"] or "nan") for row in table]),
        np.array([float(row["growth"]) for row in table]),
    )


def most_generations(tuning: Tuning) -> int:
    """Return how many generations a run has at most."""
    if tuning.tuner == "genetic":
        return tuning.generations
    return peer_generations(tuning.genetic)


def generations(folder: Path, tuning: Tuning) -> tuple[list[Generation], int]:
    """Return a run's complete generations, and the length of their file up to their end [bytes].

    Raises:
        RunError: the file cannot be read, or is damaged other than at its end.
    """
    path = folder / GENERATIONS
    content = read_regular(path, GENERATIONS_MOST, "generations")
    if not content.startswith(HEADER):
        raise RunError(f"{path} is damaged: its first line is not the header")
    lines = content[len(HEADER) :].split(b"\n")[:-1]  # what follows the last newline is torn
    size, done, most = len(HEADER), [], most_generations(tuning)
    if len(lines) > most * tuning.population:
        raise RunError(f"{path} is damaged: it has more than the run's {most} generations")
    for number in range(len(lines) // tuning.population):
        block = lines[number * tuning.population : (number + 1) * tuning.population]
        try:
            done.append(_generation([line.decode() for line in block], number))
        except (ValueError, TypeError, csv.Error):
            first = 2 + number * tuning.population
            raise RunError(
                f"{path} is damaged: generation {number}, from line {first} on, cannot be read"
            ) from None
        size += sum(len(line) + 1 for line in block)
    return done, size
