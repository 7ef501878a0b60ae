"""Which of our loops hold, in the words of a comparison: a row per loop and plant.

>>> rows = holding_rows(found, setting, trajectory, "line", controller, PERIOD, robot)
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
    holder: str,
    controller: Any,
    period: float,
    robot: Robot,
    repeats: Sequence[Any] = (),
) -> list[HoldingRow]:
    """Return whether a case's loop holds on each of its plants, in closed form where there is one.

    Args:
        found: the case on every plant. repeats: of the controller, run as well where plants are
            fast enough. holder: whose controllers, or what they are for.
    """
    plants = [each.stage.simulated for each in found]
    mine = [repeats if each.stage.repeats else () for each in found]
    how: dict[str, Any] = {"v_gain": found[0].stage.v_gain, "repeats": mine}
    held = holdings(plants, setting, trajectory, controller, period, robot, **how)
    return [
        HoldingRow.of(trajectory.name, holder, each.stage.plant.name, one)
        for each, one in zip(found, held, strict=True)
    ]
