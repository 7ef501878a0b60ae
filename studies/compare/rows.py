"""What a comparison finds: a row per case and plant, all figures in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from flexsim.plants.base import Plant
from flexsim.recording.case import Case
from flexsim.robot import Robot
from studies.core.evidence.check_sample import NO_CHECK, Check
from studies.core.evidence.holding_table import HoldingRow
from studies.core.evidence.repeats import Medians
from studies.core.paper import case_name


@dataclass(frozen=True)
class Against:
    """A plant's median envelope against that of the first plant named, with 95 % intervals.

    Attributes:
        ratio: to the first plant's. difference: from it [m]. None where either has no median, and
            ends where there is no interval.
    """

    ratio: float | None = None
    ratio_low: float | None = None
    ratio_high: float | None = None
    difference: float | None = None
    difference_low: float | None = None
    difference_high: float | None = None


@dataclass(frozen=True)
class TipDifference:
    """Rms distance of two plants' tips, pair by pair [m]: its median and 95 % interval."""

    tip_difference: float | None = None
    tip_difference_low: float | None = None
    tip_difference_high: float | None = None


NO_OTHER, NO_TIPS = Against(), TipDifference()


@dataclass(frozen=True)
class CompareRow:
    """One case on one plant.

    Attributes:
        reference: mirrored tip, or shaped for the true tip. found: over runs with perturbed gains.
        paper_simulation, paper_laboratory: Table 3's envelopes [m]. dead_zone_error: what the dead
            zone of joint 2 hides, at the tip [m].
        hardware: its name, or its numbers in words. zeta: damping ratio of mode 1.
        simulated: the plant that made the repeats, another than `plant` for MuJoCo's chain.
        shown: which run figures and recording show, counted from 1.
        check: MuJoCo's own runs among its closed form's.
        against: the first plant of the case; all None for itself.
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
    hardware: str = "ideal"
    zeta: float = 0.0
    simulated: str = ""
    shown: int = 1
    check: Check = NO_CHECK
    against: Against = NO_OTHER
    tips: TipDifference = NO_TIPS

    @property
    def case(self) -> str:
        """The trajectory, and whose controllers if it is another's."""
        return case_name(self.trajectory, self.devised)

    @property
    def devised(self) -> str:
        """The trajectory that the controllers are for, the last word of their label."""
        return self.controllers.rsplit(" ", 1)[1]


@dataclass(frozen=True)
class TrueTipRow:
    """One reference on one plant: envelope [m] with its 95 % interval, and its share of the one on
    the mirrored tip.
    """

    trajectory: str
    setting: str
    reference: str
    plant: str
    envelope: float | None
    envelope_low: float | None
    envelope_high: float | None
    share: float | None
    dead_zone_error: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Rows for the table, a row per plant and case, cases for figures; MJCF texts by file name;
    whether our loops and runs' hold, unless it was not asked; what runs of flexsim tune gave."""

    rows: list[CompareRow]
    cases: list[Case]
    robot: Robot
    mjcf: dict[str, str]
    holding: list[HoldingRow] = field(default_factory=list)
    given: list[dict[str, Any]] = field(default_factory=list)


def mjcf_texts(plants: Mapping[str, Sequence[Plant]], robot: Robot) -> dict[str, str]:
    """Return the MJCF of every plant that has one, by file name; a robot's file is kept apart."""
    kept = robot.given.text if robot.given is not None else None
    return {
        f"{plant.name.replace(':', '')}_{name}.xml": plant.mjcf
        for name, every in plants.items()
        for plant in every
        if plant.mjcf is not None and plant.mjcf != kept
    }
