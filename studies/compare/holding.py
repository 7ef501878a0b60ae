"""Which of our loops hold, in the words of a comparison: a row per loop and plant.

>>> rows = holding_rows(found, setting, trajectory, "tuned line", controller, PERIOD, robot)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flexsim.loop.settings import Setting
from flexsim.loop.trajectories import Trajectory
from flexsim.robot import Robot
from studies.compare.repeats import Repeated
from studies.core.evidence.holding import holdings
from studies.core.evidence.holding_table import HoldingRow


def holding_rows(
    found: Sequence[Repeated],
    setting: Setting,
    trajectory: Trajectory,
    label: str,
    controller: Any,
    period: float,
    robot: Robot,
    repeats: Sequence[Any] = (),
) -> list[HoldingRow]:
    """Return whether a case's loop holds on each of its plants, in closed form where there is one.

    Args:
        found: the case on every plant. repeats: of the controller, run as well where plants are
            fast enough. label: of the controllers, its last word what they are for.
    """
    plants = [each.stage.simulated for each in found]
    mine = [repeats if each.stage.repeats else () for each in found]
    held = holdings(plants, setting, trajectory, controller, period, robot, repeats=mine)
    devised = label.rsplit(" ", 1)[1]
    return [
        HoldingRow.of(trajectory.name, devised, each.stage.plant.name, one)
        for each, one in zip(found, held, strict=True)
    ]
