"""What `flexsim converge` finds: a row per rung and case, a row per rung, a row per ladder; in SI
units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from flexsim.numerics.types import Array
from studies.core.evidence.repeats import Medians
from studies.core.paper import case_name

FIGURES = ("envelope", "rms_error", "max_v")  # of merit, that a rung must not change [m]
MODES_OWN, MODES_FINE, SEGMENTS_OWN, STEPS = "Modes", "Modes, fine", "Segments", "Steps"  # ladders
PARTS = ("change", "change_low", "change_high", "margin", "status")  # of each, after its name


@dataclass(frozen=True)
class Change:
    """How much a rung moves the median of one figure from the reference's.

    Attributes:
        change: rung's median less the reference's [m], None where a median diverged.
        low, high: 95 % interval of that by a bootstrap of the pairs, None for an end that is none.
        margin: [m] within which it must lie, None where the reference has no interval.
        status: 'within', 'beyond' or 'not resolved'; see `studies.converge.judging`.
    """

    change: float | None
    low: float | None
    high: float | None
    margin: float | None
    status: str

    def named(self, figure: str) -> dict[str, float | str | None]:
        """Return the items by their names in a file."""
        content = (self.change, self.low, self.high, self.margin, self.status)
        return {f"{figure}_{part}": each for part, each in zip(PARTS, content, strict=True)}


@dataclass(frozen=True)
class CaseRow:
    """One case on one rung.

    Attributes:
        found: medians over the repeats. changes: of every figure, the items of `Change` by its
            name. growth: of the linear loop as this plant steps it [1/s], without friction or
            with its slope, whichever is more, over the poses of the path.
        growth_exact: of the exact linear loop. agreed: whether both grow or neither does.
        shares: whether as many runs diverged as on the reference, a status.
    """

    ladder: str
    plant: str
    step: float
    trajectory: str
    controllers: str
    hardware: str
    zeta: float
    found: Medians
    changes: Mapping[str, float | str | None] = field(hash=False)
    growth: float
    growth_exact: float
    agreed: bool
    shares: str

    @property
    def case(self) -> str:
        """The trajectory, and whose controllers if it is another's."""
        return case_name(self.trajectory, self.controllers)

    def is_of(self, rung: Any) -> bool:
        """Return whether it is a case of a rung."""
        mine, its = ((each.ladder, each.plant, each.step) for each in (self, rung))
        return mine == its

    def change(self, figure: str) -> Change:
        """Return how a figure differs from the reference's."""
        return Change(*(self.changes[f"{figure}_{part}"] for part in PARTS))  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class RungRow:
    """One rung over all cases.

    Attributes:
        against: what it is held against, in words. us_per_ms: cost on one core. cost: that over
            the exact beam's.
        envelope_change: (C,) of every case [m]. rms_error_change, max_v_change: the largest of all
            cases, with its sign; nan where a median diverged.
        growth: the largest of all cases [1/s]. status: of all figures in all cases.
        why: what speaks most against it, in words.
    """

    ladder: str
    plant: str
    size: str
    step: float
    default: bool
    against: str
    us_per_ms: float
    cost: float
    envelope_change: Array
    rms_error_change: float
    max_v_change: float
    growth: float
    status: str
    why: str

    @property
    def words(self) -> str:
        """As in 'assumed-modes:3 at 1 ms'."""
        return f"{self.plant} at {1e3 * self.step:g} ms"

    @property
    def is_reference(self) -> bool:
        """Whether it is what it is held against."""
        return self.words == self.against

    @property
    def label(self) -> str:
        """Its size, with a star if it is the default."""
        return self.size + "*" * self.default


@dataclass(frozen=True)
class LadderRow:
    """What a ladder says.

    Attributes:
        default, default_status: the rung that the project takes, in words; None where it is not
            one of them. cheapest: the coarsest rung that is within, None if none is.
        unresolved: coarser ones of which the runs do not tell.
        confirmed: whether the default is the cheapest, and all coarser ones are beyond.
    """

    ladder: str
    default: str | None
    default_status: str | None
    cheapest: str | None
    cheapest_cost: float | None
    unresolved: str
    confirmed: bool
    why: str = ""


@dataclass(frozen=True, eq=False)
class Convergence:
    """Rows by case, by rung and by ladder.

    Attributes:
        cases: names of the cases, in the order of arrays. reference: what stands for the exact
            beam, in words. runs: of each.
        doubt: the largest change of any figure when the reference's step is doubled [m], None
            where that was not run. notes: on models used beyond themselves.
    """

    rows: Sequence[CaseRow]
    rungs: Sequence[RungRow]
    ladders: Sequence[LadderRow]
    cases: tuple[str, ...]
    reference: str
    runs: int
    doubt: float | None = None
    notes: tuple[str, ...] = ()

    def of(self, rung: RungRow) -> list[CaseRow]:
        """Return the rows by case of a rung."""
        return [row for row in self.rows if row.is_of(rung)]
