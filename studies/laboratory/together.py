"""What suspects do together: draws of all their sizes, and Sobol' indices of the envelope's factor.

>>> unit = sobol_samples(len(suspects), 256, rng)
>>> sizes_from(suspects, unit, decades=2.0)          # (n, d) [SI]

A suspect has a column of the unit cube, in which its size is log-uniform over decades up to the
largest, and below and above the middle of different sign where it has two.

These loops are chaotic: two runs that differ in the last digit of anything differ as if by luck. A
total index, of what changes when a number does, has all of luck in it, whatever the number. So each
draw is run LUCKS times, with other fourth digits of the gains and other noise, and what is given is
the share of a run's variance that each number explains alone, that luck does, and the rest, which
numbers do together. First-order indices are of the means over LUCKS in bins of a number, IN_BIN
draws in each: what bins scatter more than the draws within them, without bias where a number
does nothing.

Source: Kelley, PNAS 21 (1935) 554 (epsilon squared); Plischke, RESS 95 (2010) 354 (Sobol' indices
of given draws).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from scipy import stats

from flexsim.numerics.elementary import power_of_ten
from flexsim.numerics.types import Array
from studies.core.evidence.intervals import LEVEL, share_of
from studies.laboratory.loops import Job, Loops, run_jobs
from studies.laboratory.place import Place
from studies.laboratory.suspects import Suspect

LUCK, TOGETHER = "luck", "together"
LUCKS = 2  # runs of each draw
LEAST_BINS, MOST_BINS = 2, 32  # of a number, of one sign each where it has two
IN_BIN = 16  # draws of a bin
GROUPS = 16  # of draws, each left out once for intervals
CAP = 10.0  # a factor at which logarithms are cut off; a run that diverged counts as that
DIVERGED_MOST = 0.05  # share of draws that may, in the ranges of the factor's indices
HALVINGS = 6  # of the ranges, at most


def sizes_from(
    suspects: Sequence[Suspect], unit: Array, decades: float, scale: float = 1.0
) -> Array:
    """Return sizes (n, d) with their signs at points of the unit cube (n, d) [SI].

    Args:
        scale: of all largest sizes.
    """
    sizes = np.empty_like(unit)
    for i, each in enumerate(suspects):
        u, sign = unit[:, i], np.full(len(unit), float(each.signs[0]))
        if len(each.signs) > 1:
            sign = np.where(u < 0.5, -1.0, 1.0)
            u = np.abs(2 * u - 1)
        sizes[:, i] = sign * scale * each.most * power_of_ten(-decades * (1 - u))
    return sizes


def places_from(place: Place, suspects: Sequence[Suspect], sizes: Array) -> list[Place]:
    """Return a place with suspects of sizes (n, d), for each row."""
    return [
        reduce(
            lambda at, pair: pair[0].at(at, float(pair[1])),
            zip(suspects, row, strict=True),
            place,
        )
        for row in sizes
    ]


def factors_at(
    loops: Loops,
    places: Sequence[Place],
    luck: Sequence[int],
    middle: Array,
    ran: Callable[[int], None],
) -> Array:
    """Return logarithms (n, C) of envelopes over the median without suspects, inf where diverged.

    Args:
        luck: which repeat each place's runs are. middle: (C,) those medians [m].
    """
    cases = len(middle)
    jobs = [
        Job(each, case, int(repeat))
        for each, repeat in zip(places, luck, strict=True)
        for case in range(cases)
    ]
    return np.asarray(np.log(run_jobs(loops, jobs, ran).envelope.reshape(-1, cases) / middle))


@dataclass(frozen=True)
class Index:
    """How much of a case's factor, or of whether it diverges, a suspect explains alone.

    Attributes:
        case, suspect: names; the suspect may be LUCK, or TOGETHER for what none explains alone.
        of: 'factor' or 'divergence'. scale: of all the largest sizes in these ranges.
        first: share of a run's variance, with a 95 % interval by a jackknife of groups of draws;
            None where nothing varies.
        diverged: share of the runs that do, and its 95 % interval.
    """

    case: str
    suspect: str
    of: str
    scale: float
    first: float | None
    first_low: float | None
    first_high: float | None
    diverged: float
    diverged_low: float
    diverged_high: float

    @property
    def told(self) -> bool:
        """Whether its interval tells it from nothing."""
        return self.first_low is not None and self.first_low > 0


def shrunk(diverged: Callable[[float], float]) -> float:
    """Return by what all ranges are to be scaled so that few draws diverge: a power of one half.

    Args:
        diverged: the share of draws that do, of a scale.
    """
    scale = 1.0
    for _ in range(HALVINGS):
        if diverged(scale) <= DIVERGED_MOST:
            break
        scale /= 2
    return scale


def shares(unit: Array, y: Array) -> Array:
    """Return the shares (d + 2,) of variance that numbers explain alone, luck does, and the rest.

    Args:
        unit: (n, d) draws in (0, 1). y: (n, L) of each draw, L >= 2; not all the same.
    """
    n, lucks = y.shape
    mean = y.mean(axis=1)
    luck = y.var(axis=1, ddof=1).mean()
    whole = mean.var(ddof=1) + (1 - 1 / lucks) * luck
    bins = max(LEAST_BINS, min(MOST_BINS, n // IN_BIN // 2 * 2))
    square = ((mean - mean.mean()) ** 2).sum()
    own = []
    for column in unit.T:
        at = np.minimum((column * bins).astype(int), bins - 1)
        count = np.bincount(at, minlength=bins)
        used = count > 0
        middle = np.bincount(at, mean, bins)[used] / count[used]
        between = (count[used] * (middle - mean.mean()) ** 2).sum()
        within = (square - between) / max(1, n - used.sum())
        own.append((between - (used.sum() - 1) * within) / (n - 1))
    explained = np.array([*own, luck]) / whole
    return np.append(explained, 1 - explained.sum())


def shares_with_ends(unit: Array, y: Array) -> Array:
    """Return `shares` (d + 2, 3) with the ends of their 95 % intervals.

    Args: as `shares`; n at least 2 GROUPS, else ends are nan.
    """
    value = shares(unit, y)
    if len(y) < 2 * GROUPS:
        return np.stack([value, *np.full((2, len(value)), np.nan)], axis=1)
    group = np.arange(len(y)) % GROUPS
    left = np.array([shares(unit[group != g], y[group != g]) for g in range(GROUPS)])
    scatter = np.sqrt((GROUPS - 1) * left.var(axis=0))
    half = stats.t.ppf((1 + LEVEL) / 2, GROUPS - 1) * scatter
    return np.stack([value, value - half, value + half], axis=1)


def indices(
    names: Sequence[str], cases: Sequence[str], unit: Array, logs: Array, scale: float, of: str
) -> list[Index]:
    """Return the indices of every case: of suspects, of luck, and of what they do together.

    Args:
        names: d of suspects. unit: (n, d) draws. logs: (n, C, L) of factors, inf where diverged.
        of: what of them, 'factor' or 'divergence'.
    """
    found, names = [], [*names, LUCK, TOGETHER]
    for i, case in enumerate(cases):
        lost = np.isinf(logs[:, i])
        y = lost.astype(float) if of == "divergence" else np.minimum(logs[:, i], np.log(CAP))
        lines = np.full((len(names), 3), np.nan)
        if np.ptp(y) > 0:
            lines = shares_with_ends(unit, y)
        share = share_of("diverged", lost.ravel())
        for name, line in zip(names, lines, strict=True):
            first, low, high = (float(x) if np.isfinite(x) else None for x in line)
            found.append(Index(case, name, of, scale, first, low, high, **share))
    return found


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws of several suspects' sizes: sizes (n, d) [SI], luck (n,) the repeat of each."""

    sizes: Array
    luck: Array


def draws_from(
    suspects: Sequence[Suspect], unit: Array, decades: float, repeats: int, scale: float = 1.0
) -> Draws:
    """Return the draws of points (n, d + 1) of the unit cube, luck the last column."""
    sizes = sizes_from(suspects, unit[:, :-1], decades, scale)
    luck = np.minimum((unit[:, -1] * repeats).astype(int), repeats - 1)
    return Draws(sizes, luck)
