"""What suspects do together: draws of all their sizes, and Sobol' indices of the envelope's factor.

>>> unit = saltelli_samples(columns(suspects), 64, rng)
>>> sizes_from(suspects, unit, decades=2.0)          # (n, d) [SI]

A suspect has a column of the unit cube, in which its size is log-uniform over decades up to the
largest, and below and above the middle of different sign where it has two. One column more is luck:
which of the repeats it is, whose gains differ in their fourth digits and whose noise is another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from flexsim.numerics.types import Array
from studies.core.evidence.intervals import share_of
from studies.laboratory.loops import Job, Loops, run_jobs
from studies.laboratory.place import Place
from studies.laboratory.suspects import Suspect
from studies.run.sensitivity import sobol_indices
from studies.spec.draws import saltelli_samples

LUCK = "luck"
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
        sizes[:, i] = sign * scale * each.most * 10.0 ** (-decades * (1 - u))
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
    """How much of a case's factor, or of whether it diverges, a suspect explains.

    Attributes:
        case, suspect: names; the suspect may be luck. of: 'factor' or 'divergence'.
        scale: of all the largest sizes in these ranges.
        first, total: Sobol' indices, with 95 % intervals by bootstrap of draws; None where nothing
            varies.
        diverged: share of the draws that do, and its 95 % interval.
    """

    case: str
    suspect: str
    of: str
    scale: float
    first: float | None
    first_low: float | None
    first_high: float | None
    total: float | None
    total_low: float | None
    total_high: float | None
    diverged: float
    diverged_low: float
    diverged_high: float


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


def indices(
    names: Sequence[str], cases: Sequence[str], logs: Array, scale: float, of: str, seed: int
) -> list[Index]:
    """Return the indices of every case.

    Args:
        names: d of suspects, luck the last. logs: (n (d + 2), C) of factors, inf where diverged.
        of: what of them, 'factor' or 'divergence'. seed: of the bootstrap.
    """
    n, found = len(logs) // (len(names) + 2), []
    for case, own in zip(cases, logs.T, strict=True):
        lost = np.isinf(own)
        y = lost.astype(float) if of == "divergence" else np.minimum(own, np.log(CAP))
        shares = share_of("diverged", lost)
        f_A, f_B, f_AB = y[:n], y[n : 2 * n], y[2 * n :].reshape(len(names), n)
        if np.ptp(y[: 2 * n]) == 0:
            found += [Index(case, name, of, scale, *(None,) * 6, **shares) for name in names]
            continue
        for name, (first, total) in zip(names, sobol_indices(f_A, f_B, f_AB, seed), strict=True):
            known = [_known(each) for each in (*first, *total)]
            found.append(Index(case, name, of, scale, *known, **shares))  # type: ignore[arg-type]
    return found


def _known(number: float) -> float | None:
    return number if np.isfinite(number) else None


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


def saltelli_draws(
    suspects: Sequence[Suspect], count: int, decades: float, repeats: int, scale: float, seed: int
) -> Draws:
    """Return the draws that Sobol' indices need, n of A a power of 2."""
    rng = np.random.default_rng((seed, 11))
    unit = saltelli_samples(len(suspects) + 1, count, rng)
    return draws_from(suspects, unit, decades, repeats, scale)
