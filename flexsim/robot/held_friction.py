"""Friction that is held over a physics step bounds the step: how far, and what to do about it.

>>> shortened(robot.chain_plant().chain, setting("opposing"), step=None)     # [s], None: it will do
"""

from __future__ import annotations

from flexsim.errors import ModelError
from flexsim.loop.settings import Setting
from flexsim.mjcf.arm_file import ArmFile
from flexsim.mjcf.chain_file import motor_matrix
from flexsim.numerics.step_limits import halved


def steepest(setting: Setting | None) -> tuple[float, float]:
    """Return the slopes of a setting's friction and shafts, held over a step [N m s/rad]."""
    return (0.0, 0.0) if setting is None else setting.steepest


def shortened(arm: ArmFile, setting: Setting | None, step: float | None) -> float | None:
    """Return a step that a setting's friction, held over it, leaves stable; None: as it is.

    Friction that opposes a joint's motion adds its slope over the joint's inertia to the rates that
    bound the step, at the worst pose: a light hub runs away by itself, whatever controls it.

    Args:
        arm: a chain or rod. step: that was asked for, None if it may be shorter [s].

    Raises:
        ModelError: the step that was asked for is too long.
    """
    first, second = steepest(setting)
    if first == second == 0.0:  # a file's step bears what is left
        return None
    gears = motor_matrix(arm.model)
    longest = arm.longest_step((first * gears[0, 0], second * gears[1, 1]))
    if arm.step < longest:
        return None
    if step is not None:
        raise ModelError(too_long(f"timestep {arm.step:g} s", arm.source, longest))
    return halved(longest)


def too_long(step: str, what: str, longest: float) -> str:
    """Return in words that a step is too long; longest: that would do [s]."""
    return (
        f"{what}: {step} is too long for friction that opposes the joints' motion, held over a "
        f"step, with so light a joint; use less than {longest:.3g} s, or another setting"
    )
