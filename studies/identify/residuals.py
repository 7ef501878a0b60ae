"""How far a model is from its logs, in units of their noise, and how that changes with its numbers.

>>> problem = Problem(model, records, sigmas, start="rest", threads=2)
>>> z = problem.beginning()
>>> problem.residuals(z).shape, problem.jacobian(z).shape
((15000,), (15000, 4))

Coordinates are the free numbers', then of each log where its joints were at the start, and with
`moving` how fast: an encoder says it to within a count only, so they are found with the rest.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from flexsim.errors import RunError
from flexsim.numerics.types import Array
from studies.identify.intervals import WHITE, whiteness
from studies.identify.names import bounds_of, values_at
from studies.identify.records import ANGLES, UNITS, Record, noise_of
from studies.identify.simulated import MOVING, Model, starts_of

DIFFERENCE = 1e-4  # of a coordinate; central differences, so relative errors of some 1e-8
START_DIFFERENCE = 1e-4  # [rad], [rad/s]
START_MOST = (0.05, 0.05, 20.0, 20.0)  # from what the first rows say
LOST = 1e3  # noises that a residual without a motion counts
UNEXPLAINED = 0.5  # of a signal that may be left, unless it is noise
NOISES = 3.0  # of a signal, up to which what is left may be that
LONGER = "search longer, with more --generations and --population, or by least-squares"
ALMOST = 0.2  # relative, of a factor that gives a unit away


@dataclass(frozen=True, eq=False)
class Problem:
    """What is made small.

    Attributes:
        model, records: as named. sigmas: (S,) noise of the signals of each record.
        start: 'rest' or 'moving'. threads: simulations at a time.
    """

    model: Model
    records: tuple[Record, ...]
    sigmas: tuple[Array, ...]
    start: str
    threads: int

    @property
    def own(self) -> int:
        """How many free numbers there are."""
        return len(self.model.free)

    @property
    def per_record(self) -> int:
        """How many coordinates of a start each record has."""
        return 4 if self.start == MOVING else 2

    @property
    def size(self) -> int:
        """How many coordinates there are."""
        return self.own + self.per_record * len(self.records)

    def first(self, share: float) -> Problem:
        """Return the problem of the first part of every record."""
        cut = tuple(each.first(share * each.duration) for each in self.records)
        return replace(self, records=cut)

    def beginning(self) -> Array:
        """Return the coordinates of the nominal numbers, each log as its first rows say."""
        return np.zeros(self.size)

    def bounds(self) -> tuple[Array, Array]:
        """Return the ends of the coordinates."""
        low, high = bounds_of(self.model.free)
        most = np.tile(START_MOST[: self.per_record], len(self.records))
        return np.concatenate([low, -most]), np.concatenate([high, most])

    def start_of(self, z: Array, r: int) -> Array:
        """Return where record r starts (4,) at coordinates z."""
        found = starts_of(self.records[r])
        at = self.own + r * self.per_record
        found[: self.per_record] += z[at : at + self.per_record]
        return found

    def modelled(self, z: Array, r: int, model: Model | None = None) -> Array | None:
        """Return record r's signals (N, S) as the model, or another, has them; None without."""
        values = values_at(self.model.free, z[: self.own])
        return (model or self.model).tried(values, self.records[r], self.start_of(z, r))

    def weighed(self, r: int, signals: Array | None) -> Array:
        """Return record r less its modelled signals, over the noise (N S,); 0 where none."""
        record = self.records[r]
        if signals is None:
            return np.full(record.values.size, LOST)
        apart = (record.values - signals) / self.sigmas[r]
        return np.where(np.isfinite(record.values), apart, 0.0).ravel()

    def residuals(self, z: Array) -> Array:
        """Return all records' residuals (R,)."""
        return self.many([z])[0]

    def many(self, points: Sequence[Array]) -> list[Array]:
        """Return the residuals (R,) at several points, simulated in threads."""
        tasks = [(z, r) for z in points for r in range(len(self.records))]
        found = list(self._mapped(tasks))
        count = len(self.records)
        return [np.concatenate(found[i : i + count]) for i in range(0, len(found), count)]

    def _mapped(self, tasks: Iterable[tuple[Array, int]]) -> Iterable[Array]:
        def task(each: tuple[Array, int]) -> Array:
            return self.weighed(each[1], self.modelled(*each))

        if self.threads == 1:
            return map(task, tasks)
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(task, tasks))

    def jacobian(self, z: Array) -> Array:
        """Return the derivatives (R, size) of the residuals, by central differences."""
        low, high = self.bounds()
        moved: list[Array] = []
        spans = []
        for j in range(self.own):
            below, above = z.copy(), z.copy()
            below[j] = max(z[j] - DIFFERENCE, low[j])
            above[j] = min(z[j] + DIFFERENCE, high[j])
            moved += [below, above]
            spans.append(above[j] - below[j])
        found = self.many(moved)
        columns = [
            (found[2 * j + 1] - found[2 * j]) / (span or 1.0) for j, span in enumerate(spans)
        ]
        return np.column_stack([*columns, self._of_starts(z)])

    def _of_starts(self, z: Array) -> Array:
        """Return the columns (R, starts): each moves only its own record.

        The arm turns as a whole with theta1, so that column is known.
        """
        sizes = [each.values.size for each in self.records]
        begin = np.concatenate([[0], np.cumsum(sizes)])
        columns = np.zeros((begin[-1], self.per_record * len(self.records)))
        places = [(r, c) for r in range(len(self.records)) for c in range(1, self.per_record)]
        moved = []
        for r, c in places:
            for sign in (-1, 1):
                other = z.copy()
                other[self.own + r * self.per_record + c] += sign * START_DIFFERENCE
                moved.append((other, r))
        found = list(self._mapped(moved))
        for i, (r, c) in enumerate(places):
            slope = (found[2 * i + 1] - found[2 * i]) / (2 * START_DIFFERENCE)
            columns[begin[r] : begin[r + 1], r * self.per_record + c] = slope
        for r, record in enumerate(self.records):
            turned = np.zeros(record.values.shape)
            turned[:, record.signals.index(ANGLES[0])] = -1.0
            turned = np.where(np.isfinite(record.values), turned / self.sigmas[r], 0.0)
            columns[begin[r] : begin[r + 1], r * self.per_record] = turned.ravel()
        return columns

    def split(self, residuals: Array) -> list[Array]:
        """Return residuals (R,) as one (N, S) of each record."""
        found, begin = [], 0
        for record in self.records:
            size = record.values.size
            found.append(residuals[begin : begin + size].reshape(record.values.shape))
            begin += size
        return found


@dataclass(frozen=True)
class Left:
    """What is left of a signal: rms [its unit], relative to the signal's own about its mean, the
    first autocorrelation, and Ljung and Box's probability that it is white."""

    log: str
    signal: str
    rms: float
    relative: float
    first: float
    p: float

    @property
    def white(self) -> str:
        """Whether it passes for white."""
        return "yes" if self.p >= WHITE else "no"

    @property
    def unit(self) -> str:
        """Of the signal."""
        return UNITS.get(self.signal, "-")


def left_over(problem: Problem, z: Array) -> list[Left]:
    """Return what is left of every signal of every log."""
    rows = []
    for r, left in enumerate(problem.split(problem.residuals(z))):
        record = problem.records[r]
        for s, name in enumerate(record.signals):
            known = np.isfinite(record.values[:, s])
            column = left[known, s] * problem.sigmas[r][s]
            rows.append(_left(record, name, record.values[known, s], column))
    return rows


def _left(record: Record, name: str, signal: Array, column: Array) -> Left:
    rms = float(np.sqrt(np.mean(column**2)))
    own = float(np.sqrt(np.mean((signal - signal.mean()) ** 2)))
    x = column - column.mean()
    first = float(x[1:] @ x[:-1] / (x @ x)) if (x @ x) > 0 else 0.0
    relative = rms / own if own > 0 else float("nan")
    return Left(record.source, name, rms, relative, first, whiteness(column))


def require_explained(problem: Problem, z: Array, left: Sequence[Left], ended: bool) -> None:
    """Refuse logs most of whose motion the model leaves, with what it would take.

    Args:
        ended: whether the search went on until nothing was better.

    Raises:
        RunError: a wrong unit, sign or column; torques that are not the log's; another arm.
    """
    rows = iter(left)
    for r, record in enumerate(problem.records):
        noise, ours = noise_of(record), problem.modelled(z, r)
        for s, name in enumerate(record.signals):
            row = next(rows)
            if not (row.relative > UNEXPLAINED and row.rms > NOISES * noise[s]):
                continue
            known = np.isfinite(record.values[:, s])
            measured = record.values[known, s]
            share = np.nan if ours is None else _share(measured, ours[known, s])
            raise RunError(
                f"{record.source}: the best numbers leave {100 * row.relative:.3g} % of {name}, "
                f"which is {share:.3g} times the model's: {_suspect(share) if ended else LONGER}"
            )


def _share(measured: Array, modelled: Array) -> float:
    """Return which factor of a modelled signal is nearest to a measured one, means aside."""
    x, y = modelled - modelled.mean(), measured - measured.mean()
    size = float(x @ x)
    return float(x @ y) / size if size > 0 else math.nan


def _suspect(share: float) -> str:
    """Return what is likely wrong with a signal that is a share of the model's, and what helps."""
    for factor, words in (
        (1000.0, "it seems to be in mm; give m"),
        (180 / math.pi, "it seems to be in degrees; give rad"),
        (-1.0, "its sign seems to be the other one; turn it"),
    ):
        if abs(share / factor - 1) < ALMOST:
            return words
    return "check its unit, sign and column, the torques, --setting and --start"
