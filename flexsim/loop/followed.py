"""Do the assumed modes follow a file's own motion? Tried under small torques, or refused.

    >>> require_followed(plant, load_arm("models/chain6.xml"))

What the equations do not have is refused by name where it is known, see
`flexsim.mjcf.reading.linear_checks`.
This is the last of the checks: that nothing else is amiss, and that the modes are enough. A hub
lighter than the beam, or a heavy segment, moves otherwise than the first modes of a clamped beam;
`discrete` damps what the equations do not; soft edges let a rod stretch.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from flexsim.errors import FlexsimError, ModelError
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.mjcf.arm_file import ArmFile
from flexsim.mjcf.own_motion import POSE, TORQUE, own_motion
from flexsim.numerics.step_limits import one_step_map
from flexsim.numerics.types import Array
from flexsim.plants.modes_plant import AssumedModesPlant

DURATION = 0.2  # [s]
STEPS_MOST = 20_000  # of the file's own; a motion of shorter ones is shorter
FOLLOWED = 0.05  # relative, how far off the modes may be
STILL = 1e-20  # [rad] a joint that turns no further is locked
MODES_TRIED = 12  # at most, when more than those asked for are tried


def require_followed(plant: AssumedModesPlant, arm: ArmFile) -> None:
    """Raise a ModelError unless assumed modes follow their file's motion within FOLLOWED.

    Args:
        plant: of the consistent equations. arm: the file that it is made of.
    """
    off = deviation(arm, plant)
    if off <= FOLLOWED:
        return
    more = range(plant.modes + 1, min(len(arm.motion(0.0)[0]) - 2, MODES_TRIED) + 1)
    enough = next((n for n in more if _tried(arm, plant, n) <= FOLLOWED), None)
    remedy = "" if enough is None else f"{enough} modes follow it (--modes {enough}); "
    raise ModelError(
        f"{arm.source}: {plant.modes} assumed modes are {100 * off:.3g} % off the {arm.kind}'s own "
        f"motion under {TORQUE[0]:g} and {TORQUE[1]:g} N m, more than {100 * FOLLOWED:g} %"
        f"{_damped(arm)}; {remedy}edit the file, or run the {arm.kind} alone (flexsim drive or "
        f"tune with --plant {arm.kind})"
    )


def _tried(arm: ArmFile, plant: AssumedModesPlant, modes: int) -> float:
    """Return the deviation with more modes, inf where they cannot be stepped."""
    try:
        return deviation(arm, replace(plant, modes=modes, step=plant.step / 8))
    except FlexsimError:
        return math.inf


@lru_cache(maxsize=256)
def deviation(arm: ArmFile, plant: AssumedModesPlant) -> float:
    """Return how far assumed modes are off a file's own motion, relative.

    The largest of theta1, theta2 and the tip's place, the worst sample to the largest of its own,
    and of v by root mean squares: torques set in at once, and of the waves that then run along the
    beam a few modes have only the mean.
    """
    steps = min(round(DURATION / arm.step), STEPS_MOST)
    own = own_motion(arm, TORQUE, POSE, steps)
    parts = max(1, math.ceil(arm.step / plant.step))
    fine = replace(plant, step=arm.step / parts)
    torque = np.tile(TORQUE, (len(own) - 1, 1))
    try:
        motion = drive(fine, setting("none"), torque, arm.step, POSE)
    except FlexsimError:
        return math.inf
    found = np.column_stack([motion.joint, motion.tip, motion.v])
    off, moved = found - own, own - own[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.abs(moved[:, :2]).max(axis=0)
        angles = np.where(turned > STILL, np.abs(off[:, :2]).max(axis=0) / turned, 0.0)
        tip = _norms(off[:, 2:4]).max() / _norms(moved[:, 2:4]).max()
        bending = np.sqrt(np.mean(off[:, 4] ** 2) / np.mean(moved[:, 4] ** 2))
    worst = max(*angles, tip, bending)
    return math.inf if math.isnan(worst) else float(worst)


def _norms(points: Array) -> Array:
    return np.linalg.norm(points, axis=1)


def _damped(arm: ArmFile) -> str:
    """Return what an integrator that damps does to the first mode, in words."""
    if arm.integrator != "discrete":
        return ""
    M, D, K = arm.motion(POSE[1])
    multipliers = np.linalg.eigvals(one_step_map("discrete", (M, D, K), arm.step, 0 * D))
    rates = np.log(multipliers.astype(complex)) / arm.step
    swinging = rates[rates.imag > 1.0]
    ratios = -swinging.real / np.abs(swinging)
    first = np.argsort(swinging.imag)[:3]
    shown = ", ".join(f"{ratio:.2g}" for ratio in ratios[first])
    return (
        f"; its integrator discrete damps the first modes with ratios of {shown} at "
        f"{1e3 * arm.step:g} ms, which a shorter timestep or RK4 does not"
    )
