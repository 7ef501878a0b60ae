"""What logs cannot tell: numbers that move nothing, and numbers that only act together.

>>> require_told(told_by(names, slopes), "log.csv", "flexsim experiment ...")

In coordinates that are relative changes, a standard error of 0.5 is an interval from a third to
three times the number: less than that a log must tell, of each number alone and of all together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import linalg

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array

TELLS = 0.5  # standard error of a coordinate up to which a log tells a number
ALIKE = 1e-4  # smallest singular value of unit columns that differences can resolve
PART = 0.3  # of the largest effect, from which a number has a part in a direction
LOOSE = 0.98  # correlation from which two numbers are said to act nearly together


class Told(NamedTuple):
    """What slopes in units of the noise tell.

    Attributes:
        names: (p,) of the numbers.
        alone, together: (p,) standard errors of coordinates, the others known, and not.
        silent: names of the numbers that move nothing beyond the noise.
        groups: names that only act together, and by how much each changes along it.
    """

    names: tuple[str, ...]
    alone: Array
    together: Array
    silent: tuple[str, ...]
    groups: tuple[tuple[tuple[str, float], ...], ...]


def told_by(names: Sequence[str], slopes: Array) -> Told:
    """Return what slopes (R, p + starts) tell of the first p coordinates, the starts unknown."""
    p = len(names)
    own = without(slopes[:, :p], slopes[:, p:])
    size = np.linalg.norm(own, axis=0)
    with np.errstate(divide="ignore"):
        alone = 1 / size
    silent = tuple(name for name, each in zip(names, alone, strict=True) if not each < TELLS)
    heard = np.flatnonzero(alone < TELLS)
    together = np.full(p, np.inf)
    groups: list[tuple[tuple[str, float], ...]] = []
    if len(heard):
        _, s, vt = linalg.svd(own[:, heard] / size[heard], full_matrices=False)
        inverse = (vt.T / np.maximum(s, 1e-12)) / size[heard][:, None]
        together[heard] = np.linalg.norm(inverse, axis=1)
        for value, row in zip(s, vt, strict=True):
            shift = row / size[heard]  # of the coordinates, along the direction
            part = np.abs(row) > PART * np.abs(row).max()
            weak = value < ALIKE or np.abs(shift).max() / value > TELLS
            if weak and part.sum() > 1:
                chosen = [(names[heard[i]], float(shift[i])) for i in np.flatnonzero(part)]
                groups.append(tuple(chosen))
    return Told(tuple(names), alone, together, silent, tuple(groups))


def without(columns: Array, others: Array) -> Array:
    """Return columns (R, p) less what columns (R, q) can imitate."""
    if others.shape[1] == 0:
        return columns
    size = np.linalg.norm(others, axis=0)
    basis = others[:, size > 0] / size[size > 0]
    q, _ = np.linalg.qr(basis)
    return columns - q @ (q.T @ columns)


def together_words(group: Sequence[tuple[str, float]]) -> str:
    """Return in words how numbers act together: what changes of them leave all as it is."""
    largest = max(abs(each) for _, each in group)
    sign = np.sign(group[0][1])
    changes = ", ".join(f"{name} {100 * sign * each / largest:+.3g} %" for name, each in group)
    return f"{' and '.join(name for name, _ in group)} only act together ({changes} cancel)"


def require_told(told: Told, where: str, excite: str) -> None:
    """Refuse numbers that logs do not tell.

    Args:
        told: as named. where: the logs. excite: the command that would.

    Raises:
        ParameterError: names them, and what would do.
    """
    if told.silent:
        names = ", ".join(told.silent)
        raise ParameterError(
            f"{where}: {names} cannot be told: a change by half moves the signals less than their "
            f"noise; leave it out of --free, or excite it, as {excite}"
        )
    if told.groups:
        words = "; ".join(map(together_words, told.groups))
        kept = told.groups[0][0][0]
        raise ParameterError(
            f"{where}: {words}; free one of them only, as --free without {kept}, its number known"
        )
    for name, error in zip(told.names, told.together, strict=True):
        if not error < TELLS:
            raise ParameterError(
                f"{where}: {name} cannot be told beside the others: its standard error is "
                f"{100 * error:.3g} %; free fewer numbers, or excite it, as {excite}"
            )
