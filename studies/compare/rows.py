"""What a comparison finds: a row per case and plant, all figures in SI units."""

from __future__ import annotations

from dataclasses import dataclass

from flexsim.recording.case import Case
from flexsim.robot import Robot
from studies.core.evidence.repeats import Medians
from studies.core.paper import case_name


@dataclass(frozen=True)
class CompareRow:
    """One case on one plant.

    Attributes:
        reference: mirrored tip, or shaped for the true tip. found: over runs with perturbed gains.
        paper_simulation, paper_laboratory: Table 3's envelopes [m]. dead_zone_error: what the dead
            zone of joint 2 hides, at the tip [m]. tip_difference: rms between the plants [m].
    """

    controllers: str
    trajectory: str
    plant: str
    setting: str
    group: str
    reference: str
    found: Medians
    paper_simulation: float | None
    paper_laboratory: float | None
    dead_zone_error: float
    tip_difference: float | None = None

    @property
    def case(self) -> str:
        """The trajectory, and whose controllers if it is another's."""
        return case_name(self.trajectory, self.controllers.rsplit(" ", 1)[1])


@dataclass(frozen=True)
class TrueTipRow:
    """One reference on one plant: envelope [m], and its share of the one on the mirrored tip."""

    trajectory: str
    setting: str
    reference: str
    plant: str
    envelope: float | None
    share: float | None
    dead_zone_error: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Rows for the table, a row per plant and case, cases for figures; MJCF texts by file name."""

    rows: list[CompareRow]
    cases: list[Case]
    robot: Robot
    mjcf: dict[str, str]
