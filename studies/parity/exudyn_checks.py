"""The beam of another code against the exact one and against our plants, open and closed loop.

>>> exudyn_checks(robot, robot.modes_plant(), robot.chain_plant(), DEFAULT_LIMITS)
"""

from __future__ import annotations

import numpy as np

from controllers import TUNED_IDEAL
from flexsim.arm.beam import MODES
from flexsim.arm.finite_beam import flexible_modes
from flexsim.arm.free_arm import joint_free_frequencies
from flexsim.loop.metrics import rms_distance
from flexsim.loop.runs import closed_loop
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import reference, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.exudyn_beam.plant import ExudynPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.robot import Robot
from flexsim.robot.exudyn_arm import exudyn_plant
from studies.parity.beam_checks import Check, Limits, check, tried
from studies.parity.motion_checks import driven_checks, energy_drift
from studies.parity.motions import BRISK, POSE
from studies.parity.side_by_side import error

STATIC_LIMIT = 1e-6  # a cubic is exact; EXUDYN's stiffness is differentiated
FREE_LIMIT = 7e-4  # relative, of eight elements: 6.1e-4 in mode 3, fourth order in their number
OTHERS_LIMIT = 3e-3  # of other robots: mode 3 of a beam with free ends has 1.3 times its waves
ENERGY_LIMIT = 1e-6  # relative; the trapezoidal rule conserves quadratic energies only
LOOP_LIMIT = 1e-6  # [m rms] of a tip over 5 s in closed loop: 8e-8
LOOP, LOOP_MODES, LOOP_STEP = "circle", 5, 1.25e-4  # task, and the modes that have converged to it


def exudyn_checks(
    robot: Robot, modes: AssumedModesPlant, chain: ChainPlant, limits: Limits, default: bool
) -> list[Check]:
    """Return how EXUDYN's beam stands beside the exact beam and beside both plants.

    Args:
        robot: without a file. default: whether it is the one that limits of loops are known for.

    Raises:
        ParameterError: EXUDYN is not installed, or the robot is a file.
    """
    plant = exudyn_plant(robot.parameters)
    return [
        *still_checks(plant, FREE_LIMIT if default else OTHERS_LIMIT),
        *driven_checks(modes, plant, limits, name="EXUDYN to modes"),
        *driven_checks(chain, plant, limits, name="EXUDYN to chain"),
        check("EXUDYN, energy, brisk", energy_drift(plant.undamped(), BRISK), ENERGY_LIMIT),
        *tried("EXUDYN in closed loop", lambda: [loop_check(robot, plant, default)]),
    ]


def still_checks(plant: ExudynPlant, free_limit: float = FREE_LIMIT) -> list[Check]:
    """Return static deflection and joint-free frequencies against the exact beam's."""
    p, linear = plant.parameters, plant.linearised(POSE[1])
    compliance = np.linalg.inv(linear.K[2:, 2:])[-2, -2]
    found = flexible_modes(linear.M, linear.D, linear.K)[0][:MODES]
    exact = joint_free_frequencies(p, MODES, POSE[1])
    return [
        check("EXUDYN to exact: static", abs(compliance / p.static_compliance - 1), STATIC_LIMIT),
        check("EXUDYN to exact: joint-free 1-3", error(found, exact), free_limit),
    ]


def loop_check(robot: Robot, plant: ExudynPlant, default: bool) -> Check:
    """Return how far tips part in closed loop, without friction; infinitely if one is lost."""
    name = f"EXUDYN to {LOOP_MODES} modes, {LOOP} in closed loop: tip, rms"
    ref = reference(trajectory(LOOP), plant.parameters)
    ours = robot.modes_plant(modes=LOOP_MODES, step=LOOP_STEP)
    filters = [TUNED_IDEAL[LOOP].filters(PERIOD)]
    one, other = (
        closed_loop(each, setting("none"), ref, filters, energy=False)[0] for each in (plant, ours)
    )
    held = one.diverged is None and other.diverged is None
    apart = rms_distance(one.tip, other.tip) if held else np.inf
    return check(name, apart, LOOP_LIMIT if default else None, "m")
