"""The exact linear loop: a beam of many modes under exact hold. Does it grow, whatever the steps?

>>> loops = exact_loops(Parameters(), poses=(0.8, 1.5, 2.2), delays=(0, 1))
>>> exact_growth(loops, stack([controller], period=1e-3))       # (1,) [1/s], at most 0: it holds

A simulation's steps damp the highest modes, and a model of three modes has none that could grow.
Here nothing is stepped: EXACT_MODES of the beam with the robot's damping, moved over a period by
the matrix exponential, with the hardware's delay and lag as states. With 20 modes instead of 12
growth differs by less than CONVERGED times 1 1/s and its own size.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from flexsim.arm.arms import Arm, FirstLink
from flexsim.arm.parameters import Parameters
from flexsim.linear.growth import growth_rates
from flexsim.linear.loop_poles import LoopOptions, SampledPlant, radii_of, sampled_plant
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.hardware import IDEAL, Hardware
from flexsim.loop.settings import V_GAIN
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.step_limits import SHORTEST_STEP
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.two_flexible.beams_plant import TwoBeamsPlant

EXACT_MODES = 12
EXACT_POSES = (0.8, 1.5, 2.2)  # [rad] theta2, over what our trajectories go through
CONVERGED = 2e-4  # change of growth with 20 modes, of 1 1/s and of itself
Pair = tuple[float, float]
Slope = tuple[Pair, Pair]  # of friction: torque gains [-], joint damping [N m s/rad]
NO_FRICTION: Slope = ((1.0, 1.0), (0.0, 0.0))


@lru_cache(maxsize=16)
def exact_plant(
    parameters: Parameters, modes: int = EXACT_MODES, link1: FirstLink | None = None
) -> Plant:
    """Return the beam of many modes, or two where link 1 bends; it is not for stepping.

    Raises:
        ParameterError: the number of modes is out of range.
    """
    if link1 is not None:
        return TwoBeamsPlant(Arm(parameters, link1), modes, SHORTEST_STEP, "exact")
    return AssumedModesPlant(parameters, modes, SHORTEST_STEP, name="exact")


@lru_cache(maxsize=256)
def exact_sampled(
    parameters: Parameters,
    theta2: float,
    options: LoopOptions,
    modes: int = EXACT_MODES,
    link1: FirstLink | None = None,
) -> SampledPlant:
    """Return the exact plant at a pose over one period, whatever hold the options name.

    Args:
        theta2: [rad]. options: torque gain, joint damping, hardware, period.

    Raises:
        ParameterError: the pose or an option cannot be used.
    """
    exact = exact_plant(parameters, modes, link1)
    return sampled_plant(exact, theta2, replace(options, hold="exact"))


def exact_loops(
    parameters: Parameters,
    poses: Iterable[float] = EXACT_POSES,
    delays: Iterable[int] = (0,),
    slopes: Sequence[Slope] = (NO_FRICTION,),
    period: float = PERIOD,
    hardware: Hardware = IDEAL,
    modes: int = EXACT_MODES,
    v_gain: float = V_GAIN,
    link1: FirstLink | None = None,
) -> tuple[SampledPlant, ...]:
    """Return the exact plants of every pose, delay and slope of friction, computed once.

    Args:
        parameters: the robot, with damping and payload. poses: theta2 [rad].
        delays: whole samples beside the hardware's own. slopes: of friction, see `small_signal`.
        hardware: of which delay and lag count. v_gain: factor of atan(v/(r+L)), -1 in the paper.
        link1: its beam, where link 1 bends as well; as many modes then of each link.

    Raises:
        ParameterError: a number out of range.
    """
    options = [
        LoopOptions(
            period,
            v_gain,
            torque_gain=gain,
            joint_damping=damping,
            hardware=replace(hardware, delay=hardware.delay + delay),
        )
        for delay in delays
        for gain, damping in slopes
    ]
    at = [float(pose) for pose in poses]
    return tuple(
        exact_sampled(parameters, pose, each, modes, link1) for each in options for pose in at
    )


def exact_growth(loops: Iterable[SampledPlant], controllers: Controllers) -> Array:
    """Return growth rates (P,) [1/s] of controllers, the largest over the plants given.

    Not rounded: `flexsim.linear.growth.quantised` before anything is ranked by it.

    Args:
        loops: of `exact_loops`. controllers: P of them, of `stack`.
    """
    worst = np.full(len(controllers.b), -np.inf)
    for sampled in loops:
        rates = growth_rates(radii_of(sampled, controllers), sampled.period)
        worst = np.maximum(worst, rates)
    return worst
