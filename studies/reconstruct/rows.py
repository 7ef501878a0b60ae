"""What the reconstruction's study finds: rows per variant, figure and plant, in SI units.

>>> misfit_row(rows, envelopes, seed=1).factor      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexsim.numerics.types import Array
from studies.core.evidence.digits import supported
from studies.core.evidence.intervals import medians_interval, quantile

MM = 1e3  # [mm/m]


@dataclass(frozen=True)
class FigureRow:
    """One variant, figure and plant over perturbed gains.

    Envelopes [m] are of the runs that stayed bounded, None where none did; the time of divergence
    [s] is the median of those that did not. Low and high are the ends of 95 % intervals: of the
    share Wilson's, of the medians order statistics, None for fewer than six.
    """

    group: str
    variant: str
    figure: str
    plant: str
    runs: int
    bounded_share: float
    bounded_share_low: float
    bounded_share_high: float
    envelope: float | None
    envelope_low: float | None
    envelope_high: float | None
    envelope_quartile_1: float | None
    envelope_quartile_3: float | None
    diverged_at: float | None
    diverged_at_low: float | None
    diverged_at_high: float | None
    paper_simulation: float

    @property
    def outcome(self) -> str:
        """The median in mm, or when all runs diverged, or the share that did not."""
        if self.bounded_share == 1.0:
            ends = self.envelope_low, self.envelope_high
            return f"{supported(self.envelope, *ends, scale=MM, most=1):>5}"
        if self.bounded_share == 0.0:
            ends = self.diverged_at_low, self.diverged_at_high
            return f"†{supported(self.diverged_at, *ends):>4}"
        return f"{100 * self.bounded_share:4.0f}%"


@dataclass(frozen=True)
class ChaosRow:
    """How pairs of runs a hair apart part.

    Attributes:
        amplification, lasting: medians of the joints' largest and last distances over the hair,
            None where most diverge; low, high: ends of their 95 % intervals.
        apart: shares of pairs whose tips come to be far apart, by hair, with Wilson's intervals.
        kind: 'chaotic', 'regular' or 'mixed'.
    """

    variant: str
    figure: str
    plant: str
    amplification: float | None
    amplification_low: float | None
    amplification_high: float | None
    lasting: float | None
    lasting_low: float | None
    lasting_high: float | None
    apart: Mapping[str, float]
    kind: str


@dataclass(frozen=True)
class UnitRow:
    """A gain of Table 2 in seconds and in milliseconds, in deviations of Table 1."""

    figure: str
    gain: str
    order: float
    seconds: float
    milliseconds: float
    deviations_seconds: float
    deviations_milliseconds: float


@dataclass(frozen=True)
class MisfitRow:
    """A variant's mean factor between median envelopes and Table 3's, None where a run diverges.

    Low and high: of its 95 % interval, a bootstrap of the runs, None for fewer than six.
    """

    variant: str
    factor: float | None
    factor_low: float | None
    factor_high: float | None


@dataclass(frozen=True, eq=False)
class ReconstructResult:
    """Rows per variant, figure and plant; chaos per figure and plant; units per gain.

    Attributes:
        apart: (K,) distance of the joints of two runs [rad], by figure and plant.
        misfits: a row per variant.
    """

    rows: list[FigureRow]
    chaos: list[ChaosRow]
    units: list[UnitRow]
    apart: dict[tuple[str, str], Array]
    misfits: list[MisfitRow]


def misfit_row(
    rows: Sequence[FigureRow], envelopes: Sequence[Sequence[float]], seed: int
) -> MisfitRow:
    """Return how far a variant's envelopes are from Table 3's.

    Args:
        rows: of the variant. envelopes: of the runs of each row [m], controllers alike in all.
        seed: of the bootstrap.
    """
    paper = np.array([row.paper_simulation for row in rows])
    if any(row.bounded_share < 1.0 for row in rows):
        return MisfitRow(rows[0].variant, None, None, None)

    def factor(*medians: Array) -> Array:
        logs = np.log(np.stack(medians, axis=-1) / paper)
        return np.exp(np.sqrt(np.mean(logs**2, axis=-1)))

    found = float(factor(*(np.array(quantile(each)) for each in envelopes)))
    ends = medians_interval(factor, envelopes, seed) or (None, None)
    return MisfitRow(rows[0].variant, found, *ends)
