"""A contestant by its knobs, as a study file names it: `studies.arena.entry:design`.

>>> design(1e-3, Parameters(), "pid", [40, 0.6, 0.1, 10, 40, 0.6, 0.1, 10])
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from controllers import ControllerError
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.linear.growth import extreme_poses
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.settings import DEFAULT_SETTING, setting
from flexsim.loop.trajectories import CIRCLE, reference
from flexsim.robot import Robot
from studies.arena.contestants import CLASSES, Designer


@lru_cache(maxsize=16)
def _designer(period: float, parameters: Parameters, hardware: str, friction: str) -> Designer:
    """Return what is known of a robot; its controllers have that in common."""
    robot = Robot.of(parameters=parameters)
    middle = extreme_poses(reference(CIRCLE, parameters, period))[1]
    return Designer.of(robot, setting(friction, HARDWARE[hardware]), middle, period)


def design(
    period: float,
    parameters: Parameters,
    contestant: str,
    knobs: Sequence[float],
    hardware: str = "bench",
    friction: str = DEFAULT_SETTING,
) -> Any:
    """Return a contestant's controller for a robot that is as it is told to be.

    Args:
        period: [s]. parameters: of the robot. contestant: a key of `CLASSES`. knobs: its own.
        hardware, friction: that the designer counts on, by their names.

    Raises:
        ParameterError: there is no such class, or it has other knobs.
        ControllerError: there is no controller of these knobs.
    """
    if contestant not in CLASSES:
        raise ParameterError(f"class {contestant!r} is unknown; choose from {', '.join(CLASSES)}")
    chosen = CLASSES[contestant]
    if len(knobs) != len(chosen.knobs):
        names = ", ".join(each.name for each in chosen.knobs)
        raise ParameterError(f"{contestant} has {len(chosen.knobs)} knobs, {names}; give as many")
    found = chosen.built(knobs, _designer(period, parameters, hardware, friction))
    if found is None:
        raise ControllerError(f"{contestant} has no controller of these knobs; give others")
    return found
