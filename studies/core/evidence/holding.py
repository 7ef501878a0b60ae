"""Does a loop hold? One long hold on a plant, and the growth of the exact linear loop beside it.

    >>> found = holding(plant, setting("simulink"), trajectory("line"), controller, PERIOD, robot)
    >>> found.holds, found.v_ratio, found.growth, found.delay_margin

A run of a few seconds can be bounded while a mode grows that the steps damp or the model lacks. So
a loop holds if three things are so: the run stays bounded over HOLD seconds after the path; the rms
of v over the last WINDOW seconds is at most MOST of that before; and nothing grows on the exact
linear loop, at the poses of the path, with the hardware's delay and lag, neither without friction
nor with the slope of the setting's. Inside a dead zone no torque moves a joint, and nothing grows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from flexsim.arm.parameters import Parameters
from flexsim.linear.exact_loop import exact_growth, exact_sampled
from flexsim.linear.growth import extreme_poses, loop_options, quantised
from flexsim.linear.loop_poles import LoopOptions, SampledPlant
from flexsim.linear.reserves import reserves
from flexsim.loop.control.stacking import stack
from flexsim.loop.runs import measure
from flexsim.loop.settings import V_GAIN, Setting
from flexsim.loop.trajectories import Trajectory, reference
from flexsim.plants.base import Plant
from flexsim.robot import Robot

HOLD = 20.0  # [s] after the path
WINDOW = 5.0  # [s] of v at the end, and as much before
MOST = 1.1  # rms of v at the end over that before
STILL = 1e-9  # [m] of v: below, nothing moves, and rounding would make the ratio


@dataclass(frozen=True)
class Holding:
    """Whether a loop holds, and what it has to spare.

    Attributes:
        bounded: over the path and the hold. diverged_at: else when [s].
        v_ratio: rms of v over the last 5 s over that before [-]; None if nothing moved or the run
            was not bounded. Noise on v alone gives about 1.
        growth: of the exact linear loop without friction [1/s], the largest over the poses.
        growth_friction: with the slope of the setting's friction [1/s].
        growth_undamped: as `growth`, of a beam without damping.
        fastest_hz: of the pole that `growth` is of [Hz].
        delay_margin: extra delay of both torques that is borne [s], 0 if a motion grows anyway.
        gain_margin, gain_margin_low: factors of the loop gains that are borne, 1 if a motion grows.
    """

    bounded: bool
    diverged_at: float | None
    v_ratio: float | None
    growth: float
    growth_friction: float
    growth_undamped: float
    fastest_hz: float
    delay_margin: float
    gain_margin: float
    gain_margin_low: float

    @property
    def quiet(self) -> bool:
        """Whether v does not grow over the end of the hold."""
        return self.bounded and (self.v_ratio is None or self.v_ratio <= MOST)

    @property
    def grows(self) -> bool:
        """Whether the exact linear loop does."""
        return max(self.growth, self.growth_friction) > 0

    @property
    def holds(self) -> bool:
        """Whether the loop holds: bounded, quiet, and without growth."""
        return self.quiet and not self.grows

    @property
    def why_not(self) -> str:
        """In words what speaks against it; empty if it holds."""
        said = []
        if self.diverged_at is not None:
            said.append(f"diverged at {self.diverged_at:.1f} s")
        elif not self.quiet:
            said.append(f"v grew to {self.v_ratio:.2g} times")
        if self.grows:
            said.append(f"the exact loop grows at {max(self.growth, self.growth_friction):.2g} 1/s")
        return ", ".join(said)


def holding(
    plant: Plant,
    setting: Setting,
    trajectory: Trajectory,
    controller: Any,
    period: float,
    robot: Robot,
    hold: float = HOLD,
) -> Holding:
    """Return whether one loop holds, from one run of it and its exact linear loop.

    Args:
        plant: on which it runs. setting: friction, motors, hardware. controller: of any kind.
        period: control period [s]. robot: whose beam the exact loop has; of a file, the uniform
            beam most like its own. hold: after the path [s].

    Raises:
        ParameterError: the trajectory, the controller or a number cannot be used.
    """
    return holdings([plant], setting, trajectory, controller, period, robot, hold)[0]


def holdings(
    plants: Sequence[Plant],
    setting: Setting,
    trajectory: Trajectory,
    controller: Any,
    period: float,
    robot: Robot,
    hold: float = HOLD,
    v_gain: float = V_GAIN,
) -> list[Holding]:
    """Return the same of several plants, whose exact linear loop is one; see `holding`.

    Args:
        v_gain: factor of atan(v/(r+L)) in the loops, -1 in the paper.
    """
    longer = replace(trajectory, hold=hold)
    exact = exact_numbers(setting, longer, controller, period, robot, v_gain)
    found = []
    for plant in plants:
        path = reference(longer, plant.parameters, period)
        (run,) = measure(plant, setting, path, [controller], min(2 * WINDOW, hold), v_gain=v_gain)
        bounded = not run["diverged"]
        ratio = v_ratio(run, min(WINDOW, hold / 2)) if bounded else None
        found.append(Holding(bounded, run["diverged_at"], ratio, **exact))
    return found


def exact_numbers(
    setting: Setting,
    trajectory: Trajectory,
    controller: Any,
    period: float,
    robot: Robot,
    v_gain: float = V_GAIN,
) -> dict[str, float]:
    """Return what `Holding` has of the exact linear loop; arguments as of `holdings`."""
    own, stacked = setting.applied(robot.parameters), stack([controller], period)
    poses = extreme_poses(reference(trajectory, own, period))
    free = LoopOptions(period, v_gain, hardware=setting.hardware)
    rubbed = loop_options(setting.friction, period, "exact", hardware=setting.hardware)
    rubbed = replace(rubbed, v_gain=v_gain)
    spare = reserves(_loops(own, poses, free), stacked)
    friction, undamped = (
        float(quantised(exact_growth(loops, stacked))[0])
        for loops in (_loops(own, poses, rubbed), _loops(replace(own, zeta=0.0), poses, free))
    )
    return {
        "growth": spare.growth,
        "growth_friction": friction,
        "growth_undamped": undamped,
        "fastest_hz": spare.fastest_hz,
        "delay_margin": spare.delay_margin,
        "gain_margin": spare.gain_margin,
        "gain_margin_low": spare.gain_margin_low,
    }


def v_ratio(run: dict[str, Any], window: float) -> float | None:
    """Return rms of v over a run's last window over that before; None where nothing moves.

    Args:
        run: figures of `flexsim.loop.runs.measure` with a hold of two windows. window: [s].
    """
    if run["growth"] is None or run["residual_v"] < STILL:
        return None
    return math.exp(run["growth"] * window)


def _loops(
    parameters: Parameters, poses: Sequence[float], options: LoopOptions
) -> list[SampledPlant]:
    return [exact_sampled(parameters, pose, options) for pose in poses]
