"""Which gains hold near rest, and by what margin? Poles, margins and maps from linear models.

    >>> result = run(StabilityConfig(quick=True))
    >>> result.rows[0].growth, result.rows[0].delay_margin, result.rows[0].gain_margin

The analytical method that the paper leaves to future work: the exact beam (EXACT_MODES modes under
exact hold) and both plants as they are stepped, linearised about poses with the beam straight, the
loop closed exactly as in the simulation, no simulation needed. Every row of what is stepped is
held against the nonlinear simulation of a tiny initial error all the same. Beside them the zero
that no controller of the two errors can move, and the poles that high gain drives there.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
from rich.progress import Progress

from controllers import TUNED
from flexsim.errors import ParameterError
from flexsim.linear.exact_loop import exact_plant
from flexsim.linear.growth import SLACK, extreme_poses, growth_rates, loop_options
from flexsim.linear.loop_poles import LoopOptions, spectral_radii
from flexsim.loop.control.stacking import stack
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import reference, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.plants.base import Plant
from flexsim.robot import Robot, plant_kind
from studies.core.carry_out import Study, ticker
from studies.core.evidence.intervals import share_of
from studies.core.paper import PLANTS
from studies.core.study_options import Controllers, ModelOptions, Out, SeedOptions, StudyOptions
from studies.stability import report
from studies.stability.loops import EXACT, held, loop_row
from studies.stability.maps import draw, has_map, stability_map
from studies.stability.rows import DrawsRow, StabilityResult
from studies.stability.simulated import simulated_rates
from studies.stability.zeros import zero_rows
from studies.tuning.found import (
    AnyController,
    FoundController,
    controllers_of,
    period_of,
    v_gain_of,
)

COMPARED = 200  # draws that are also simulated
SIMULATED = 1500  # samples
SEVERAL = {"all": (EXACT, *PLANTS), "both": PLANTS}


@dataclass(frozen=True)
class StabilityConfig(ModelOptions, SeedOptions, StudyOptions):
    """Poles, margins and regions of stability near rest, without simulating."""

    QUICK: ClassVar = {"map_points": 11, "zero_draws": 0}

    out: Out = Path("runs/stability")
    quick: bool = False
    """One pose and coarse maps."""
    trajectory: str | None = None
    """Poses: smallest, middle, largest theta2 of line, two-loop or circle; circle unless given."""
    theta2: tuple[float, ...] = ()
    """Poses instead of the trajectory's [rad]."""
    plant: str = "all"
    """all: exact (12 modes, exact hold), assumed-modes and chain; both: the latter two; or one of
    exact, rigid, assumed-modes[:n], printed[:n], chain[:N], closed-chain[:N], untuned[:N],
    rule-of-thumb[:N], exudyn[:N]."""
    controllers: Controllers = tuple(TUNED)
    """Of our own line, two-loop, circle; tuned in the ideal loop ideal-line, ideal-two-loop,
    ideal-circle; of Table 2 figure-3, figure-4, figure-5; or folders of runs of flexsim tune."""
    setting: str = "none"
    """Setting whose motors and small-signal friction apply: none, simulink, jump, opposing or
    reconstructed."""
    torque_gain: tuple[float, float] | None = None
    """Effective over commanded torque of both joints; the setting's own unless given."""
    hold: str = "stepped"
    """How plants but the exact go through a period: stepped (as in the simulation) or exact."""
    slack: float = SLACK
    """Growth that a loop called stable may have [1/s]; a beam without damping decays no faster."""
    map_points: int = 31
    """Points along each side of the maps over (k, nu); 0 leaves them out."""
    screen: int = 0
    """Random draws from Table 1 to screen, on the middle pose."""
    zero_draws: int = 2000
    """Random draws from Table 1 of which the first stable ones are shown beside the zero."""


def _check(config: StabilityConfig) -> None:
    """Raise a ParameterError for an option that cannot be used."""
    if config.plant not in SEVERAL and config.plant != EXACT:
        _known(config.plant)
    if config.theta2 and config.trajectory:
        raise ParameterError("--theta2 and --trajectory contradict each other; give one of them")
    if not all(map(math.isfinite, config.theta2)):
        raise ParameterError(f"theta2 is {config.theta2}; give finite angles [rad]")
    if config.torque_gain and not all(0 < gain < math.inf for gain in config.torque_gain):
        raise ParameterError(f"torque gain is {config.torque_gain}; give finite ones above 0")
    if not 0 <= config.slack < math.inf:
        raise ParameterError(f"slack is {config.slack} 1/s; give 0 or more")
    if config.map_points < 0 or config.map_points == 1:
        raise ParameterError(f"map points are {config.map_points}; give 0 or at least 2")
    for name in ("screen", "zero_draws"):
        if (count := getattr(config, name)) < 0:
            raise ParameterError(f"--{name.replace('_', '-')} is {count}; give 0 or more")


def _known(name: str) -> None:
    """Refuse a plant's name that is none."""
    try:
        plant_kind(name)
    except ParameterError as error:
        raise ParameterError(f"{error}; or all, both or {EXACT}") from None


def plants_of(config: StabilityConfig, robot: Robot) -> list[Plant]:
    """Return the plants asked for, with the setting's motors."""
    names = SEVERAL.get(config.plant, (config.plant,))
    motors = setting(config.setting)
    return [
        exact_plant(motors.applied(robot.parameters))
        if name == EXACT
        else robot.plant(name, motors, config.modes, config.segments)
        for name in names
    ]


def undamped_plants(config: StabilityConfig) -> list[Plant]:
    """Return the same plants without damping in the beam; of a file, without any."""
    robot = config.robot_of()
    if robot.given is None:
        return plants_of(config, Robot(replace(robot.parameters, zeta=0.0)))
    motors = setting(config.setting).applied(replace(robot.parameters, zeta=0.0))
    return [
        exact_plant(motors) if plant.name == EXACT else plant.undamped()
        for plant in plants_of(config, robot)
    ]


def poses_of(config: StabilityConfig) -> list[float]:
    """Return the poses [rad]: those given, else smallest, middle and largest of the trajectory."""
    if config.theta2:
        found = list(config.theta2)
    else:
        path = trajectory(
            config.trajectory or "circle", reconstructed=config.setting == "reconstructed"
        )
        found = extreme_poses(reference(path, config.robot_of().parameters, PERIOD))
    return [found[len(found) // 2]] if config.quick else found


def options_of(config: StabilityConfig) -> LoopOptions:
    """Return how the loop is linearised: the setting's small-signal friction, or the gain given."""
    friction = setting(config.setting).friction
    return loop_options(friction, PERIOD, config.hold, config.torque_gain, config.built)


def own_options(options: LoopOptions, devised: AnyController) -> LoopOptions:
    """Return the options with a controller's own period, and what its loop makes of v."""
    return replace(options, period=period_of(devised), v_gain=v_gain_of(devised))


def run(config: StabilityConfig, progress: Progress | None = None) -> StabilityResult:
    """Return poles, margins, maps and screenings.

    Raises:
        ParameterError: an option cannot be used.
    """
    config = config.asked()
    _check(config)
    devised = list(controllers_of(config.controllers).values())
    robot = config.robot_of()
    plants, poses, options = plants_of(config, robot), poses_of(config), options_of(config)
    joints = (0, 1) if config.map_points else ()
    mapped = [each for each in devised if has_map(each)]
    steps = len(plants) * (len(devised) * len(poses) + len(mapped) * len(joints))
    advance = ticker(progress, "stability", steps)
    given = [each.facts for each in devised if isinstance(each, FoundController)]
    result = StabilityResult([], [], [], [], config.slack, robot.parameters.zeta, given)
    middle = poses[len(poses) // 2]
    for plant, undamped in zip(plants, undamped_plants(config), strict=True):
        for each in devised:
            mine = own_options(options, each)
            for pose in poses:
                result.rows.append(loop_row(plant, undamped, each, pose, mine, config.slack))
                advance()
            for joint in joints if each in mapped else ():
                where = (middle, held(plant, mine), config.map_points)
                result.maps.append(stability_map(plant, each, joint, *where))
                advance()
        if config.screen and plant.name != EXACT:
            result.draws.append(draws_row(plant, middle, options, config))
    parameters = setting(config.setting).applied(robot.parameters)
    mirrored = [each for each in devised if v_gain_of(each) == options.v_gain]
    shown = (parameters, middle, mirrored, options, config.zero_draws, config.seed)
    result.zeros.extend(zero_rows(*shown))
    return result


def draws_row(
    plant: Plant, theta2: float, options: LoopOptions, config: StabilityConfig
) -> DrawsRow:
    """Return the share of random draws that is stable, what a draw costs, and a simulation's view.

    The simulation knows nothing of the linear model: stable is where its errors do not grow.
    """
    drawn = stack(draw(config.screen, np.random.default_rng(config.seed)), options.period)
    start = time.perf_counter()
    growth = growth_rates(spectral_radii(plant, theta2, drawn, options), options.period)
    seconds = time.perf_counter() - start
    part = slice(0, min(config.screen, COMPARED))
    rates = simulated_rates(plant, theta2, drawn.chosen(part), options, SIMULATED)
    agree = (growth[part] <= config.slack) == (rates <= config.slack)
    return DrawsRow(
        plant=plant.name,
        theta2=theta2,
        draws=config.screen,
        **share_of("stable_share", growth <= config.slack),
        seconds_per_draw=seconds / config.screen,
        compared=len(agree),
        **share_of("agreement", agree),
    )


command = Study(
    run,
    report.tables,
    report.verdict,
    report.figures,
    report.facts,
    question="Which gains hold near rest, and by what margin?",
)
