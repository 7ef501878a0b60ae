"""What Tables 2 and 3 anew are made of: rows per run, per controller, per case; SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from flexsim.recording.traces import spoken
from studies.core.evidence.repeats import Medians
from studies.core.paper import case_name, paper_envelopes


@dataclass(frozen=True)
class RunRow:
    """One controller on one plant and trajectory.

    Medians over runs with perturbed gains, None where half of them diverged, but for the index,
    which is the unperturbed run's; all are None, the time too, where there is no controller.
    `diverged`: whether any did. Low and high: 95 % intervals, of a median by order statistics, of
    a share Wilson's.
    """

    tuned_on: str
    tuned_for: str
    run_on: str
    trajectory: str
    envelope: float | None
    max_error: float | None
    rms_error: float | None
    max_v: float | None
    residual_v: float | None
    index: float | None
    diverged: bool
    diverged_at: float | None
    envelope_low: float | None = None
    envelope_high: float | None = None
    runs: int = 0
    diverged_share: float | None = None
    diverged_share_low: float | None = None
    diverged_share_high: float | None = None

    @property
    def case(self) -> str:
        """The trajectory, and what the controller was tuned for if it is another."""
        return case_name(self.trajectory, self.tuned_for)

    @property
    def plant_tuned_on(self) -> str:
        """In words."""
        return spoken(self.tuned_on)

    @property
    def origin(self) -> tuple[str, ...]:
        """What tells its controller from the others."""
        return self.tuned_for, self.tuned_on

    @property
    def origin_words(self) -> str:
        """The same in words."""
        return f"for the {self.tuned_for}, on {self.plant_tuned_on}"

    @property
    def paper(self) -> tuple[float, float] | None:
        """Table 3's envelopes [m]."""
        return paper_envelopes(self.trajectory, self.tuned_for)


@dataclass(frozen=True)
class GivenRow(RunRow):
    """The same of a controller that was given: `controllers` is what it is called."""

    controllers: str = ""

    @property
    def origin(self) -> tuple[str, ...]:
        """What tells its controller from the others."""
        return (self.controllers,)

    @property
    def origin_words(self) -> str:
        """The same in words."""
        return self.controllers


@dataclass(frozen=True)
class ControllerRow:
    """One search's outcome: index (5) [m2 s], cost, parameters in Table 1's units."""

    tuned_on: str
    tuned_for: str
    index: float | None
    generations: int
    evaluations: int
    seed: int
    ended: str
    parameters: Mapping[str, float | None]


@dataclass(frozen=True)
class RatioRow:
    """How much wider a case's envelope [m] is on the plant in the laboratory's role."""

    tuned_on: str
    tuned_for: str
    trajectory: str
    from_plant: str
    to_plant: str
    from_envelope: float | None
    to_envelope: float | None
    ratio: float | None
    paper_simulation: float | None
    paper_laboratory: float | None
    paper_ratio: float | None
    ratio_low: float | None = None
    ratio_high: float | None = None

    @property
    def case(self) -> str:
        """As `RunRow.case`."""
        return case_name(self.trajectory, self.tuned_for)

    @property
    def direction(self) -> str:
        """In words whose envelope the ratio has over whose."""
        pair = (self.to_plant, self.from_plant)
        return " / ".join(spoken(plant).removeprefix("assumed ") for plant in pair)


@dataclass(frozen=True)
class GivenRatio(RatioRow):
    """The same of a controller that was given: `controllers` is what it is called."""

    controllers: str = ""


@dataclass(frozen=True, eq=False)
class TablesResult:
    """Rows per run, controller, and case of the deterioration; the chain's MJCF; what runs of
    flexsim tune gave. Of controllers that were given, not tuned, rows are `GivenRow`s."""

    rows: list[RunRow]
    controllers: list[ControllerRow]
    ratios: list[RatioRow]
    mjcf: str
    given: list[dict[str, Any]] = field(default_factory=list)

    @property
    def tuned(self) -> bool:
        """Whether the controllers were tuned here."""
        return not any(isinstance(row, GivenRow) for row in self.rows)


def figures_of(nominal: Mapping[str, Any], found: Medians) -> dict[str, Any]:
    """Return the figures of a row: the index of the gains as they are, medians of the others.

    Args:
        nominal: figures of merit of the run with the gains as they are. found: of the repeats.
    """
    low, high = found.interval("envelope")
    return {
        "envelope": found.envelope,
        "max_error": found.max_error,
        "rms_error": found.rms_error,
        "max_v": found.max_v,
        "residual_v": found.residual_v,
        "index": None if nominal["diverged"] else nominal["index"],
        "diverged": found.diverged,
        "diverged_at": found.diverged_at,
        "envelope_low": low,
        "envelope_high": high,
        "runs": found.runs,
        "diverged_share": found.diverged_share,
        "diverged_share_low": found.diverged_share_low,
        "diverged_share_high": found.diverged_share_high,
    }
