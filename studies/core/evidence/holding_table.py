"""Which loops hold? `Holding` per loop and plant, both plants on a line.

>>> table = holding_table([HoldingRow.of("line", "line", plant.name, found)])
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from studies.core.evidence.digits import supported
from studies.core.evidence.holding import HOLD, MOST, Holding
from studies.core.paper import case_name
from studies.core.table import Column, Table


@dataclass(frozen=True)
class HoldingRow:
    """Whether one loop holds on one plant; `holding` has the numbers."""

    trajectory: str
    controllers: str
    plant: str
    holds: bool
    holding: Holding

    @classmethod
    def of(cls, trajectory: str, controllers: str, plant: str, found: Holding) -> Self:
        """Return the row of what was found."""
        return cls(trajectory, controllers, plant, found.holds, found)

    @property
    def case(self) -> str:
        """The loop in short."""
        return case_name(self.trajectory, self.controllers)

    @property
    def verdict(self) -> str:
        """'yes', or why not, in a word."""
        found = self.holding
        if found.holds:
            return "yes"
        if found.diverged_at is not None:
            return f"to {found.diverged_at:.1f} s"
        return "grows" if found.grows else "v grows"


def _pooled(row: HoldingRow) -> str:
    """Return the ratio of v over all runs in the digits that its interval supports."""
    found = row.holding
    return supported(found.ratio_pooled, found.ratio_low, found.ratio_high)


COLUMNS = (
    Column("case", "loop", once=True),
    Column("verdict", "holds"),
    Column("v_ratio", "v late", form=".2f"),
    Column("ratio", "of all", form=_pooled),
    Column("growth", "growth", form="+.2g", once=True),
    Column("growth_friction", "slope", form="+.2g", once=True),
    Column("growth_undamped", "zeta 0", form="+.2g", once=True),
    Column("fastest_hz", "Hz", form=".3g", once=True),
    Column("delay_margin", "delay", form=".2f", scale=1e3, missing="20+", once=True),
    Column("gain_margin", "gain", form=".2f", once=True, missing="inf"),
)
NOTE = f"""\
Holds: bounded over {HOLD:g} s after the path; rms of v over the last 5 s, over all
repeats, at most {MOST:g} of that before (v late: of one run); no growth [1/s] of
the exact linear loop, neither without friction nor with its slope. Beside it
that without damping; the pole's frequency; extra delay [ms] and the factor of
the loop gains that are borne."""


def holding_table(rows: Sequence[HoldingRow]) -> Table:
    """Return the table of loops, the plants of each side by side."""
    return Table(
        rows,
        COLUMNS,
        "\nWhich loops hold",
        NOTE,
        "holding",
        "holding.csv",
        line=("trajectory", "controllers"),
        tight=True,
    )


def said(rows: Sequence[HoldingRow]) -> str:
    """Return in a sentence how many hold, and why others do not."""
    held = sum(row.holds for row in rows)
    told = f"{held} of {len(rows)} loops hold."
    first = next((row for row in rows if not row.holds), None)
    if first is None:
        return told
    return f"{told} {first.plant}, {first.case}: {first.holding.why_not}."
