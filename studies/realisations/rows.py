"""What the realisations' study finds: closed loops, factors to (2), summaries of filters.

>>> relative_index(rows, ("oustaloup", 5))      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from flexsim.numerics.types import Array
from studies.core.evidence.digits import supported, with_interval
from studies.core.evidence.intervals import known_ends, median_interval, medians_interval
from studies.realisations.response import ResponseRow

RETAINED = ("tustin", 10)  # (2) with the p of section 3.2
INDEX = 1e4  # the tables' indices are in 1e-4 m2 s
GAINS = {"loop": "the same gains", "retuned": "gains tuned anew"}  # by part

Chosen = tuple[str, int]  # realisation and terms
AnyRow = TypeVar("AnyRow", "ResponseRow", "LoopRow")


@dataclass(frozen=True)
class LoopRow:
    """A trajectory under a controller's variations.

    The median index (5) [m2 s] and envelope [m] are infinite where most runs diverge, and None with
    the reason in `refused` where the controllers cannot be built.

    Attributes:
        bounded_share_low, bounded_share_high: 95 % interval, Wilson's.
        seed: of the search, if any.
        spread: 95 % intervals and quartiles of both medians, by name and `_low`, `_high`,
            `_quartile_1`, `_quartile_3`; an end is None where that run diverged.
        indices: (n,) of every run, inf where it diverged.
    """

    part: str
    realisation: str
    terms: int
    plant: str
    trajectory: str
    bounded_share: float | None = None
    index: float | None = None
    envelope: float | None = None
    refused: str | None = None
    seed: int | None = None
    bounded_share_low: float | None = None
    bounded_share_high: float | None = None
    spread: Mapping[str, float | None] = field(default_factory=dict, hash=False)
    indices: Array = field(default_factory=lambda: np.zeros(0), compare=False)


@dataclass(frozen=True)
class ResponseSummary:
    """A realisation's errors over all orders and frequencies, and the cost of a sample."""

    realisation: str
    terms: int
    magnitude_rms_db: float
    magnitude_max_db: float
    phase_rms_deg: float
    phase_max_deg: float
    cost_ns: float


@dataclass(frozen=True)
class FactorRow:
    """A realisation's mean factor to (2): of its indices, geometric, inf if a loop fails.

    Attributes:
        part: as of the rows it is of.
        factor_low, factor_high: 95 % interval, a bootstrap of the pairs of runs or of searches;
            None of fewer than six.
        factor_least, factor_most: of single seeds' searches; None where there are none.
    """

    part: str
    realisation: str
    terms: int
    factor: float
    factor_low: float | None
    factor_high: float | None
    factor_least: float | None
    factor_most: float | None

    @property
    def shown(self) -> str:
        """The factor with its interval, or with the range of searches too few for one."""
        known = self.factor_low is not None or self.factor_high is not None
        if known or self.factor_least is None or self.factor_most is None:
            return with_interval(self.factor, self.factor_low, self.factor_high)
        ends = (self.factor_least, self.factor_most)
        least, most = (f"{x:.1f}" if math.isfinite(x) else "div" for x in ends)
        return f"{supported(self.factor, None, None)} ({least} to {most})"


@dataclass(frozen=True)
class LoopSummary:
    """The median index of a case [m2 s], over the searches if any, and the factor to (2)."""

    realisation: str
    terms: int
    trajectory: str
    plant: str
    index: float | None
    index_low: float | None
    index_high: float | None
    factor: str

    @property
    def outcome(self) -> str:
        """The index in 1e-4 m2 s, or what became of the loops."""
        if self.index is None:
            return "-"
        if not math.isfinite(self.index):
            return "div"
        if self.index_low is None and self.index_high is None:
            return f"{INDEX * self.index:.2g}"
        return supported(self.index, self.index_low, self.index_high, INDEX, most=3)


@dataclass(frozen=True, eq=False)
class RealisationsResult:
    """Rows by 'part': 'response', 'loop' with the tuned gains, 'retuned'.

    Attributes:
        seed: of the bootstrap.
    """

    rows: list[ResponseRow | LoopRow]
    seed: int = 1

    @property
    def responses(self) -> list[ResponseRow]:
        """Errors and costs of the filters."""
        return [row for row in self.rows if isinstance(row, ResponseRow)]

    def loops(self, part: str) -> list[LoopRow]:
        """Return the closed loops of a part."""
        return [row for row in self.rows if isinstance(row, LoopRow) and row.part == part]


def by_choice(rows: Sequence[AnyRow]) -> dict[Chosen, list[AnyRow]]:
    """Return rows by realisation and terms, in their order."""
    found: dict[Chosen, list[AnyRow]] = {}
    for row in rows:
        found.setdefault((row.realisation, row.terms), []).append(row)
    return found


def response_summaries(rows: Sequence[ResponseRow]) -> list[ResponseSummary]:
    """Return each filter's rms and largest errors of all orders."""
    found = []
    for (realisation, terms), every in by_choice(rows).items():
        found.append(
            ResponseSummary(
                realisation,
                terms,
                float(np.sqrt(np.mean([row.magnitude_rms_db**2 for row in every]))),
                max(row.magnitude_max_db for row in every),
                float(np.sqrt(np.mean([row.phase_rms_deg**2 for row in every]))),
                max(row.phase_max_deg for row in every),
                every[0].cost_ns,
            )
        )
    return found


def by_case(rows: Sequence[LoopRow]) -> dict[tuple[str, str], list[float | None]]:
    """Return indices by trajectory and plant; there is one per search."""
    cases: dict[tuple[str, str], list[float | None]] = {}
    for row in rows:
        cases.setdefault((row.trajectory, row.plant), []).append(row.index)
    return cases


def _median(indices: Sequence[float | None]) -> float | None:
    """Return the median index [m2 s], None if a controller could not be built."""
    known = [index for index in indices if index is not None]
    return float(np.median(known)) if len(known) == len(indices) else None


def relative_index(rows: Sequence[LoopRow], chosen: Chosen) -> float:
    """Return the geometric mean of the indices over that of (2), ten terms; inf if one fails.

    Args:
        rows: of a part; chosen: realisation and terms.
    """

    def logs(pair: Chosen) -> list[float]:
        mine = [row for row in rows if (row.realisation, row.terms) == pair]
        medians = map(_median, by_case(mine).values())
        return [math.inf if each is None else math.log(each) for each in medians]

    own, retained = np.mean(logs(chosen)), np.mean(logs(RETAINED))
    return float(np.exp(own - retained)) if np.isfinite(retained) else math.inf


def _finite_or_inf(index: float | None) -> float:
    return math.inf if index is None else index


def relative_interval(
    rows: Sequence[LoopRow], chosen: Chosen, seed: int
) -> tuple[float | None, float | None]:
    """Return the 95 % interval of `relative_index`, over runs; over rows where these are searches.

    Pairs stay pairs: every realisation has the same controllers, and equal seeds begin with equal
    populations. An end that is not known, None.
    """
    cases = by_case([row for row in rows if (row.realisation, row.terms) == chosen])
    of: dict[tuple[str, int, str, str], list[float]] = {}
    for row in rows:
        mine = of.setdefault((row.realisation, row.terms, row.trajectory, row.plant), [])
        mine.extend(row.indices.tolist() if row.seed is None else [_finite_or_inf(row.index)])
    samples = [
        np.array(of.get((*pair, *case), [])) for pair in (chosen, RETAINED) for case in cases
    ]
    if not all(each.size for each in samples):
        return None, None

    def factor(*medians: Array) -> Array:
        own, retained = np.split(np.log(medians), 2)
        return np.exp(own.mean(axis=0) - retained.mean(axis=0))

    return known_ends(medians_interval(factor, samples, seed))


def factor_rows(result: RealisationsResult) -> list[FactorRow]:
    """Return the factor to (2) of every realisation, with the gains as they are and tuned anew."""
    found = []
    for part in GAINS:
        rows = result.loops(part)
        for chosen in by_choice(rows):
            single: tuple[float | None, float | None] = None, None
            if part != "loop" and len(seeds := dict.fromkeys(row.seed for row in rows)) > 1:
                every = [
                    relative_index([row for row in rows if row.seed == seed], chosen)
                    for seed in seeds
                ]
                single = min(every), max(every)
            ends = (*relative_interval(rows, chosen, result.seed), *single)
            found.append(FactorRow(part, *chosen, relative_index(rows, chosen), *ends))
    return found


def loop_summaries(rows: Sequence[LoopRow], factors: Sequence[FactorRow]) -> list[LoopSummary]:
    """Return each realisation's median index, by case; factors: of the part."""
    shown = {(each.realisation, each.terms): each.shown for each in factors}
    found = []
    for chosen, mine in by_choice(rows).items():
        for case, indices in by_case(mine).items():
            alone = [row for row in mine if (row.trajectory, row.plant) == case]
            spread = alone[0].spread if len(alone) == 1 else {}
            ends = spread.get("index_low"), spread.get("index_high")
            if len(alone) > 1:
                ends = median_interval([_finite_or_inf(each) for each in indices]) or ends
            found.append(LoopSummary(*chosen, *case, _median(indices), *ends, shown[chosen]))
    return found
