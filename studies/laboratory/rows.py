"""What the laboratory study finds, row by row.

>>> result.scores[0].probability      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from flexsim.numerics.types import Array
from studies.core.evidence.check_sample import Check
from studies.core.paper import CASES, case_envelopes, case_name
from studies.laboratory.alone import Curve, Reached
from studies.laboratory.hypotheses import Fit
from studies.laboratory.linear import GrowthRow
from studies.laboratory.loops import Loops
from studies.laboratory.place import Place
from studies.laboratory.suspects import MEASURED, Suspect
from studies.laboratory.together import Index

HALF = 5e-4  # [m] the paper's envelopes are whole millimetres


@dataclass(frozen=True)
class PaperCase:
    """A line of Table 3: name, half-widths [m], their ratio and what rounding leaves of it."""

    name: str
    simulated: float
    measured: float

    @property
    def factor(self) -> float:
        """How much worse the laboratory was."""
        return self.measured / self.simulated

    @property
    def ends(self) -> tuple[float, float]:
        """The factor's least and largest value before rounding."""
        low = (self.measured - HALF) / (self.simulated + HALF)
        return low, (self.measured + HALF) / (self.simulated - HALF)

    @property
    def rounding(self) -> float:
        """Standard deviation of the factor's logarithm by rounding, even over a millimetre."""
        return float(HALF / np.sqrt(3) * np.hypot(1 / self.measured, 1 / self.simulated))


def paper_cases() -> list[PaperCase]:
    """Return Table 3, in its order."""
    found = []
    for shape, devised in CASES:
        known = case_envelopes(shape, devised)
        assert known is not None  # they are the paper's
        found.append(PaperCase(case_name(shape, devised), *known))
    return found


@dataclass(frozen=True)
class BaseRow:
    """A case without suspects.

    Attributes:
        envelope: median of `runs` [m]; envelope_low, envelope_high: 95 % interval. scatter:
            standard deviation of its logarithm from run to run. rms_1, ...: of the commanded
            torques, median [N m]. simulated, measured: the paper's [m]; factor, with the ends that
            rounding leaves.
    """

    plant: str
    controllers: str
    case: str
    runs: int
    envelope: float
    envelope_low: float | None
    envelope_high: float | None
    scatter: float
    rms_1: float
    rms_2: float
    variation_1: float
    variation_2: float
    simulated: float
    measured: float
    factor: float
    factor_low: float
    factor_high: float


@dataclass(frozen=True)
class AloneRow:
    """A suspect of one size in a case: envelope [m] and its ratio to the bench without, medians.

    Attributes:
        size: with its sign [SI]. ratio_low, ratio_high: 95 % interval, a bootstrap of the runs.
            None where half of the runs diverged, and for ends that are not known.
    """

    plant: str
    controllers: str
    suspect: str
    case: str
    size: float
    runs: int
    envelope: float | None
    ratio: float | None
    ratio_low: float | None
    ratio_high: float | None
    diverged_share: float
    diverged_share_low: float
    diverged_share_high: float


@dataclass(frozen=True)
class ReachRow:
    """From which size on a suspect gives the paper's factor in a case."""

    plant: str
    controllers: str
    suspect: str
    cause: str
    case: str
    factor: float
    least: float
    largest: float
    found: Reached


@dataclass(frozen=True)
class ScoreRow:
    """How likely the paper's four factors are under a hypothesis.

    Attributes:
        decades: width of the prior of every size. log_marginal: log p(y | hypothesis).
        probability: after, of hypotheses equally likely before; low, high: 95 % interval, a
            bootstrap of the simulated runs. bayes: p(y | hypothesis)/p(y | none).
        recovered: share of what it makes itself that is thought to be its own, 95 % interval
            Wilson's; given: the mean probability that it then has; like: what its own is most
            often thought to be. None where it always diverges, or nothing was made.
        diverged: share of its draws of which some case surely diverges.
        sizes: of the likeliest draw, as text. predicted: its factors. fit: how near it comes.
    """

    plant: str
    controllers: str
    hypothesis: str
    decades: float
    log_marginal: float
    probability: float
    probability_low: float
    probability_high: float
    bayes: float
    recovered: float | None
    recovered_low: float | None
    recovered_high: float | None
    given: float | None
    like: str
    diverged: float
    sizes: str
    fit: Fit | None


@dataclass(frozen=True)
class ConfusionRow:
    """How often what one hypothesis makes is thought to be another's."""

    plant: str
    controllers: str
    true: str
    thought: str
    share: float
    probability: float


@dataclass(frozen=True)
class CauseRow:
    """How likely a cause is given the paper's four factors, under one way of scoring.

    Attributes:
        decades: width of the priors. discrepancy: of the models' logarithms, None for all of them.
        cause: one of `studies.laboratory.causes.FAMILIES`. hypotheses: of that cause.
        probability: after. bayes: the mean likelihood of its hypotheses over that of none.
        best: the likeliest hypothesis of all, with best_probability.
    """

    plant: str
    controllers: str
    decades: float
    discrepancy: float | None
    cause: str
    hypotheses: int
    probability: float
    bayes: float
    best: str
    best_probability: float


@dataclass(frozen=True)
class IndexRow:
    """A Sobol' index on a plant under controllers."""

    plant: str
    controllers: str
    found: Index


@dataclass(frozen=True)
class CheckRow:
    """MuJoCo's own runs among those in closed form."""

    controllers: str
    where: str
    case: str
    check: Check


@dataclass(frozen=True)
class SuspectRow:
    """A suspect as it is stated."""

    suspect: str
    cause: str
    meaning: str
    most: float
    unit: str
    source: str

    @classmethod
    def of(cls, suspect: Suspect) -> SuspectRow:
        """Return a suspect's row, its largest size in the unit that it is shown in."""
        most = suspect.scale * suspect.most
        return cls(suspect.name, suspect.cause, suspect.meaning, most, suspect.unit, suspect.source)


@dataclass(frozen=True, eq=False)
class Ground:
    """Where suspects are tried: a plant under controllers, and what was found alone.

    Attributes:
        place, loops: as named. base: (C, R) envelopes without suspects [m]. curves: of each.
    """

    place: Place
    loops: Loops
    base: Array
    curves: Sequence[Curve]

    @property
    def plant(self) -> str:
        """Name of the plant."""
        return self.place.plant

    @property
    def controllers(self) -> str:
        """Name of the controllers."""
        return self.loops.name

    def feels(self, suspect: Suspect) -> bool:
        """Return whether a suspect can change anything: what is measured of v, only if v counts."""
        return self.loops.v_gain != 0.0 or suspect.cause != MEASURED

    @property
    def middle(self) -> Array:
        """(C,) median envelopes without suspects [m]."""
        return np.asarray(np.median(self.base, axis=1))

    @property
    def scatter(self) -> Array:
        """(C,) standard deviations of the logarithm from run to run."""
        return np.asarray(np.log(self.base).std(axis=1, ddof=1))


@dataclass(frozen=True, eq=False)
class LaboratoryResult:
    """What came of it all."""

    suspects: list[SuspectRow]
    base: list[BaseRow] = field(default_factory=list)
    alone: list[AloneRow] = field(default_factory=list)
    reach: list[ReachRow] = field(default_factory=list)
    scores: list[ScoreRow] = field(default_factory=list)
    confusion: list[ConfusionRow] = field(default_factory=list)
    indices: list[IndexRow] = field(default_factory=list)
    checks: list[CheckRow] = field(default_factory=list)
    growth: list[GrowthRow] = field(default_factory=list)
    causes: list[CauseRow] = field(default_factory=list)
    grounds: list[Ground] = field(default_factory=list)


AnyRow = TypeVar("AnyRow", BaseRow, AloneRow, ReachRow, ScoreRow, CauseRow, ConfusionRow, IndexRow)


def of_ground(rows: Sequence[AnyRow], ground: Ground) -> list[AnyRow]:
    """Return the rows of a ground."""
    where = (ground.plant, ground.controllers)
    return [row for row in rows if (row.plant, row.controllers) == where]
