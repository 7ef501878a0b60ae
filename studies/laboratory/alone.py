"""What each suspect alone does to the envelopes: curves over its size, and what factors they reach.

>>> curves = scan(loops, place, suspects, sizes=9, decades=2.0)
>>> curves[0].ratio()               # (sizes, cases) to the bench without it, inf where diverged
>>> reached(curves[0], case=0, factor=3.3, seed=1).size

Ratios are to the median of all runs without the suspect, of which there are more. Repeats i with
and without it have the same gains and noise, but these loops are chaotic: after a second a run
knows nothing of its pair, and pairing would make no interval narrower.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from flexsim.numerics.elementary import power_of_ten
from flexsim.numerics.types import Array
from studies.core.evidence.intervals import LEAST_RUNS, LEVEL
from studies.laboratory.loops import Job, Loops, run_jobs
from studies.laboratory.place import Place
from studies.laboratory.suspects import Suspect

RESAMPLES = 499  # a curve has a dozen medians


@dataclass(frozen=True, eq=False)
class Curve:
    """Envelopes over a suspect's size, of one sign.

    Attributes:
        suspect, sign: as named. sizes: (K,) rising, above 0 [SI].
        envelopes: (K, C, R) [m], inf where diverged. base: (C, R') of repeats without it, R' >= R.
    """

    suspect: Suspect
    sign: int
    sizes: Array
    envelopes: Array
    base: Array

    @property
    def name(self) -> str:
        """The suspect's name, with the sign where it has two."""
        sign = "" if len(self.suspect.signs) == 1 else " +" if self.sign > 0 else " -"
        return self.suspect.name + sign

    def ratio(self) -> Array:
        """Return ratios (K, C) of medians to that without the suspect, inf where diverged."""
        return np.asarray(np.median(self.envelopes, axis=2) / np.median(self.base, axis=1))

    def diverged(self) -> Array:
        """Return the share of runs (K, C) that diverged."""
        return np.asarray(np.isinf(self.envelopes).mean(axis=2))


def sizes_of(suspect: Suspect, count: int, decades: float) -> Array:
    """Return sizes (count,) that reach down from the largest by decades [SI]."""
    return suspect.most * power_of_ten(np.linspace(0.0, -decades, count)[::-1])


def scan(
    loops: Loops,
    place: Place,
    suspects: Sequence[Suspect],
    base: Array,
    repeats: int,
    sizes: int,
    decades: float,
    ran: Callable[[int], None],
) -> list[Curve]:
    """Return every suspect's curves.

    Args:
        base: (C, R') envelopes of the place without suspects [m]. repeats: R of each size.
    """
    cases = len(base)
    pairs = [
        (each, sign, sizes_of(each, sizes if each.sized else 1, decades))
        for each in suspects
        for sign in each.signs
    ]
    jobs = [
        Job(each.at(place, sign * size), case, repeat)
        for each, sign, its in pairs
        for size in its
        for case in range(cases)
        for repeat in range(repeats)
    ]
    found = run_jobs(loops, jobs, ran).envelope.reshape(-1, cases, repeats)
    ends = np.cumsum([len(its) for _, _, its in pairs])[:-1]
    return [Curve(*pair, own, base) for pair, own in zip(pairs, np.split(found, ends), strict=True)]


@dataclass(frozen=True)
class Reached:
    """From which size on a suspect makes an envelope a factor larger.

    Attributes:
        size: from which to the largest, or to where half of the runs diverge, the ratio of medians
            is at least the factor [SI]; None where it is not. low, high: 95 % interval, a bootstrap
            of the runs, None for an end that is not known. share: of resamples that reach it.
        most: the largest ratio, where less than half diverges, and its 95 % interval; None where
            it diverges from the least size on.
        diverges: the least size from which on half of the runs or more diverge; None for none.
    """

    size: float | None
    low: float | None
    high: float | None
    share: float
    most: float | None
    most_low: float | None
    most_high: float | None
    diverges: float | None


def first_of(ratio: Array, sizes: Array, factor: float) -> Array:
    """Return the sizes (B,) from which on curves (K, B) are at least a factor, inf for none.

    A curve counts as far as it is bounded; between two sizes it is straight in logarithms.
    """
    bounded = np.cumsum(np.isinf(ratio), axis=0) == 0
    ends = bounded.sum(axis=0)
    enough = np.where(bounded, ratio >= factor, True)
    from_on = np.logical_and.accumulate(enough[::-1], axis=0)[::-1]  # also where it diverged
    start = from_on.argmax(axis=0)
    found = np.full(ratio.shape[1], np.inf)
    there = from_on.any(axis=0) & (start < ends)
    at = np.flatnonzero(there)
    j = start[at]
    found[at] = sizes[j]
    inner = j > 0
    at, j = at[inner], j[inner]
    below, above = np.log(ratio[j - 1, at]), np.log(ratio[j, at])
    share = (np.log(factor) - below) / (above - below)
    found[at] = np.exp(np.log(sizes[j - 1]) + share * np.log(sizes[j] / sizes[j - 1]))
    return found


def reached(curve: Curve, case: int, factor: float, seed: int) -> Reached:
    """Return from which size on a curve reaches a factor in a case."""
    envelopes, base = curve.envelopes[:, case], curve.base[case]
    ratio = curve.ratio()[:, case]
    size = float(first_of(ratio[:, None], curve.sizes, factor)[0])
    rng, runs = np.random.default_rng(seed), envelopes.shape[1]
    drawn, own = (rng.integers(0, count, (RESAMPLES, count)) for count in (runs, len(base)))
    ratios = np.median(envelopes[:, drawn], axis=2) / np.median(base[own], axis=1)
    sizes = first_of(ratios, curve.sizes, factor)
    bounded = np.cumsum(np.isinf(ratio)) == 0
    some = bool(bounded.any())
    top = ratios[bounded].max(axis=0) if some else np.zeros(0)
    diverged = np.flatnonzero(np.isinf(ratio))
    known = runs >= LEAST_RUNS
    low, high = _ends(sizes) if known and np.isfinite(size) else (None, None)
    most_low, most_high = _ends(top) if known and some else (None, None)
    return Reached(
        size if np.isfinite(size) else None,
        low,
        high,
        float(np.isfinite(sizes).mean()),
        float(ratio[bounded].max()) if some else None,
        most_low,
        most_high,
        float(curve.sizes[diverged[0]]) if diverged.size else None,
    )


def _ends(drawn: Array) -> tuple[float | None, float | None]:
    """Return the ends of the interval that resamples give, None for one that is not finite."""
    ordered = np.sort(drawn)
    beyond = max(1, round((1 - LEVEL) / 2 * (len(ordered) + 1)))
    ends = (float(ordered[beyond - 1]), float(ordered[-beyond]))
    low, high = (each if np.isfinite(each) else None for each in ends)
    return low, high
