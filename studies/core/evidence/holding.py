"""Does a loop hold? One long hold on a plant, and the growth of the exact linear loop beside it.

    >>> found = holding(plant, setting("simulink"), trajectory("line"), controller, PERIOD, robot)
    >>> found.holds, found.v_ratio, found.growth, found.delay_margin

A run of a few seconds can be bounded while a mode grows that the steps damp or the model lacks. So
a loop holds if three things are so: it stays bounded over HOLD seconds after the path; the rms of v
over the last WINDOW seconds is at most MOST of that before, over all repeats; and nothing
grows on the exact linear loop, at the poses of the path, with the hardware's delay and lag, neither
without friction nor with the slope of the setting's. Inside a dead zone no torque moves a joint,
and nothing grows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexsim.arm.parameters import Parameters
from flexsim.linear.exact_loop import exact_growth, exact_sampled
from flexsim.linear.growth import extreme_poses, loop_options, quantised
from flexsim.linear.loop_poles import LoopOptions, SampledPlant
from flexsim.linear.reserves import reserves
from flexsim.loop.compiled_loop import Outcome
from flexsim.loop.control.stacking import stack
from flexsim.loop.measuring import EARLY_V, LATE_V, RESIDUAL_V, yardstick
from flexsim.loop.runs import evaluate
from flexsim.loop.settings import V_GAIN, Setting
from flexsim.loop.trajectories import Trajectory, reference
from flexsim.plants.base import Plant
from flexsim.robot import Robot
from studies.core.evidence.intervals import rms_ratio_interval

HOLD = 20.0  # [s] after the path
WINDOW = 5.0  # [s] of v at the end, and as much before
MOST = 1.1  # rms of v at the end over that before
FIRST = 40  # runs after which to look, if there are repeats, whether the ratio is decided
SEED = 1  # of the resampling
STILL = 1e-9  # [m] of v: below, nothing moves, and rounding would make the ratio


@dataclass(frozen=True)
class Holding:
    """Whether a loop holds, and what it has to spare.

    Attributes:
        bounded: over the path and the hold. diverged_at: else when [s].
        v_ratio: rms of v over the last 5 s over that before [-]; None if nothing moved or the run
            was not bounded. Noise on v alone gives about 1.
        ratio_runs: runs behind what follows. ratio_pooled: the same of the rms over all of them,
            with its 95 % interval `ratio_low`, `ratio_high`, by bootstrap of the runs; None as
            `v_ratio`, and ends also of too few runs. ratio_share: of the runs within MOST.
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
    ratio_runs: int
    ratio_pooled: float | None
    ratio_low: float | None
    ratio_high: float | None
    ratio_share: float
    growth: float
    growth_friction: float
    growth_undamped: float
    fastest_hz: float
    delay_margin: float
    gain_margin: float
    gain_margin_low: float

    @property
    def quiet(self) -> bool:
        """Whether v does not grow over the end of the hold: by the rms over all runs."""
        return self.bounded and (self.ratio_pooled is None or self.ratio_pooled <= MOST)

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
            said.append(f"v grew to {self.ratio_pooled:.2g} times")
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
    repeats: Sequence[Any] = (),
) -> Holding:
    """Return whether one loop holds, from a run of it and its exact linear loop.

    Where joints drift through a dead zone and are pushed back at its edges, v wanders, and a run's
    ratio is above MOST by chance, once in three times or so. So repeats are run as well, if given:
    bounded are then all runs, and v is the rms over all of them; 40, and twice as many while the
    95 % interval of the ratio holds MOST, up to all there are.

    Args:
        plant: on which it runs. setting: friction, motors, hardware. controller: of any kind.
        period: control period [s]. robot: whose beam the exact loop has; of a file, the uniform
            beam most like its own. hold: after the path [s].
        repeats: the controller with its gains' fourth digits changed, see `perturbed`.

    Raises:
        ParameterError: the trajectory, the controller or a number cannot be used.
    """
    return holdings(
        [plant], setting, trajectory, controller, period, robot, hold, repeats=[repeats]
    )[0]


def holdings(
    plants: Sequence[Plant],
    setting: Setting,
    trajectory: Trajectory,
    controller: Any,
    period: float,
    robot: Robot,
    hold: float = HOLD,
    v_gain: float = V_GAIN,
    repeats: Sequence[Sequence[Any]] = (),
) -> list[Holding]:
    """Return the same of several plants, whose exact linear loop is one; see `holding`.

    Args:
        v_gain: factor of atan(v/(r+L)) in the loops, -1 in the paper.
        repeats: of each plant; none at all unless given.
    """
    longer = replace(trajectory, hold=hold)
    exact = exact_numbers(setting, longer, controller, period, robot, v_gain)
    found = []
    for plant, more in zip(plants, repeats or [()] * len(plants), strict=True):
        path = reference(longer, plant.parameters, period)
        every = [controller, *more]
        yard = yardstick(path, min(2 * WINDOW, hold))
        for count in _counts(len(every)):
            runs = evaluate(plant, setting, path, every[:count], yard=yard, v_gain=v_gain)
            seen = _seen(runs)
            if not seen["bounded"] or _decided(seen):
                break
        found.append(Holding(**seen, **exact))
    return found


def _counts(most: int) -> list[int]:
    """Return after how many runs to look: FIRST, doubled until there are no more."""
    found = [min(FIRST, most)]
    while found[-1] < most:
        found.append(min(2 * found[-1], most))
    return found


def _decided(seen: dict[str, Any]) -> bool:
    """Return whether the interval of v's ratio lies on one side of MOST."""
    low, high = seen["ratio_low"], seen["ratio_high"]
    return low is not None and high is not None and (high <= MOST or low > MOST)


def _seen(runs: Outcome) -> dict[str, Any]:
    """Return what `Holding` has of measured runs, the controller's own first."""
    lost = runs.diverged[np.isfinite(runs.diverged)]
    early, late, most = (runs.sums[:, each] for each in (EARLY_V, LATE_V, RESIDUAL_V))
    moved = bool(most.max() >= STILL) and not lost.size
    with np.errstate(divide="ignore", invalid="ignore"):
        each = np.where(most < STILL, 0.0, np.sqrt(late / early))
    each[np.isfinite(runs.diverged)] = math.inf
    low, high = (rms_ratio_interval(late, early, SEED) if moved else None) or (None, None)
    return {
        "bounded": not lost.size,
        "diverged_at": float(lost.min()) if lost.size else None,
        "v_ratio": float(each[0]) if 0 < each[0] < math.inf else None,
        "ratio_runs": len(each),
        "ratio_pooled": float(np.sqrt(late.mean() / early.mean())) if moved else None,
        "ratio_low": low,
        "ratio_high": high,
        "ratio_share": float(np.mean(each <= MOST)),
    }


def exact_numbers(
    setting: Setting,
    trajectory: Trajectory,
    controller: Any,
    period: float,
    robot: Robot,
    v_gain: float = V_GAIN,
) -> dict[str, Any]:
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


def _loops(
    parameters: Parameters, poses: Sequence[float], options: LoopOptions
) -> list[SampledPlant]:
    return [exact_sampled(parameters, pose, options) for pose in poses]
