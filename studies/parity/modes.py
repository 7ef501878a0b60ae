"""Do the plants vibrate like their beam? Frequencies, couplings and mode shapes, side by side.

>>> run(ModesConfig()).clamped_hz["chain"]
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import tyro

from flexsim.errors import ParameterError
from flexsim.robot import Robot
from studies.core.carry_out import Question
from studies.core.options import RobotOptions
from studies.core.table import Table
from studies.parity.report import tables, verdict
from studies.parity.side_by_side import ModesResult, compared
from studies.parity.two_flexible import (
    TwoFlexibleModes,
    two_flexible_tables,
    two_flexible_verdict,
    vibrating,
)


@dataclass(frozen=True)
class ModesConfig(RobotOptions):
    """Compare frequencies and mode shapes: the robot's own beam, assumed modes, chain."""

    file: tyro.conf.Positional[Path | None] = None
    """The MJCF file, as --mjcf; the paper's robot unless given."""
    json: bool = False
    """Print one JSON object instead of tables."""

    def robot_of(self) -> Robot:
        """Return the robot, however its file was given.

        Raises:
            ParameterError: it was given twice.
        """
        if self.file is not None and self.mjcf is not None:
            raise ParameterError(f"two MJCF files are given, {self.file} and {self.mjcf}; give one")
        return super(ModesConfig, replace(self, mjcf=self.mjcf or self.file)).robot_of()


def run(config: ModesConfig) -> ModesResult | TwoFlexibleModes:
    """Return frequencies, couplings and shapes of the robot's own beam and of both plants.

    Of an arm whose links both bend, the frequencies.
    """
    robot = config.robot_of()
    return vibrating(robot) if robot.both_bend else compared(robot)


def _tables(result: ModesResult | TwoFlexibleModes) -> list[Table]:
    return two_flexible_tables(result) if isinstance(result, TwoFlexibleModes) else tables(result)


def _verdict(result: ModesResult | TwoFlexibleModes) -> str:
    if isinstance(result, TwoFlexibleModes):
        return two_flexible_verdict(result)
    return verdict(result)


command = Question(run, _tables, _verdict, vars)
