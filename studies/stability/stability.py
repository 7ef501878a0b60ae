"""Which gains hold near rest, and by what margin? Poles, margins and maps from linear models.

    >>> result = run(StabilityConfig(quick=True))
    >>> result.rows[0]["spectral_radius"], result.rows[0]["gain_high_1"]

The analytical method that the paper leaves to future work: both plants linearised about poses with
the beam straight, the loop closed exactly as in the simulation, no simulation needed. Every row is
held against the nonlinear simulation of a tiny initial error all the same.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from controllers import TABLE_2, TUNED, Controller
from flexsim.errors import ParameterError
from flexsim.linear.growth import SLACK, extreme_poses, loop_options
from flexsim.linear.loop_poles import HOLDS, LinearLoop, LoopOptions, linear_loop
from flexsim.linear.margins import margins
from flexsim.loop.compiled_loop import stack_filters
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import reference, trajectory
from flexsim.plants.base import Plant
from flexsim.robot import plant_kind
from studies.core.carry_out import carried_out
from studies.core.folder import to_json, write_config, write_rows
from studies.core.options import RobotOptions
from studies.stability.maps import StabilityMap, map_figure, screen, stability_map
from studies.stability.simulated import simulated_growth

PERIOD = 1e-3  # [s] control period of the paper
PLANTS = ("assumed-modes", "chain")  # both
POLES_SHOWN = 4
QUICK_POINTS = 11


@dataclass(frozen=True)
class StabilityConfig(RobotOptions):
    """Poles, margins and regions of stability near rest, without simulating."""

    trajectory: str | None = None
    """Poses: smallest, middle, largest theta2 of line, two-loop or circle; circle unless given."""
    theta2: tuple[float, ...] = ()
    """Poses instead of the trajectory's [rad]."""
    plant: str = "both"
    """both, or one of rigid, assumed-modes[:n], printed[:n], chain[:N], untuned[:N]."""
    controllers: tuple[str, ...] = tuple(TUNED)
    """Of our own line, two-loop, circle; of Table 2 figure-3, figure-4, figure-5."""
    setting: str = "none"
    """Setting whose motors and small-signal friction apply: none, print, joint, reconstructed."""
    torque_gain: tuple[float, float] | None = None
    """Effective over commanded torque of both joints; the setting's own unless given."""
    hold: str = "stepped"
    """How a period is gone through: stepped (as in the simulation) or exact."""
    slack: float = SLACK
    """Growth that a loop called stable may have [1/s]; the undamped beam decays no faster."""
    map_points: int = 31
    """Points along each side of the maps over (k, nu); 0 leaves them out."""
    screen: int = 0
    """Random draws from Table 1 to screen, on the middle pose."""
    seed: int = 1
    """Seed of the draws."""
    modes: int = 3
    """Assumed modes, n."""
    segments: int | None = None
    """Segments of the chain; 6 unless given."""
    quick: bool = False
    """One pose and coarse maps."""
    out: Path = Path("runs/stability")
    """Folder of the run, made anew."""
    force: bool = False
    """Replace the run that is there."""
    json: bool = False
    """Print one JSON object instead of the table."""


@dataclass(frozen=True, eq=False)
class StabilityResult:
    """Rows of the table, maps, and one row per screening."""

    rows: list[dict[str, Any]]
    maps: list[StabilityMap]
    screens: list[dict[str, Any]]


def controller(name: str) -> Controller:
    """Return one of our controllers or of Table 2's.

    Raises:
        ParameterError: there is none of that name.
    """
    known = {**TUNED, **TABLE_2}
    if name not in known:
        raise ParameterError(f"controller {name!r} is unknown; choose of {', '.join(known)}")
    return known[name]


def _check(config: StabilityConfig) -> None:
    """Raise a ParameterError for an option that cannot be used."""
    if config.plant != "both":
        plant_kind(config.plant)  # refuses what is none
    if not config.controllers:
        raise ParameterError("no controllers given; name one or more with --controllers")
    if config.theta2 and config.trajectory:
        raise ParameterError("--theta2 and --trajectory contradict each other; give one of them")
    if not all(map(math.isfinite, config.theta2)):
        raise ParameterError(f"theta2 is {config.theta2}; give finite angles [rad]")
    if config.torque_gain and not all(0 < gain < math.inf for gain in config.torque_gain):
        raise ParameterError(f"torque gain is {config.torque_gain}; give finite ones above 0")
    if not 0 <= config.slack < math.inf:
        raise ParameterError(f"slack is {config.slack} 1/s; give 0 or more")
    if config.map_points < 0 or config.map_points == 1 or config.screen < 0:
        raise ParameterError("map points must be 0 or at least 2, and screen 0 or more")


def plants_of(config: StabilityConfig) -> list[Plant]:
    """Return the plants asked for, with the setting's motors."""
    names = PLANTS if config.plant == "both" else (config.plant,)
    robot, motors = config.robot_of(), setting(config.setting)
    return [robot.plant(name, motors, config.modes, config.segments) for name in names]


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
    return loop_options(setting(config.setting).friction, PERIOD, config.hold, config.torque_gain)


def run(config: StabilityConfig, progress: Progress | None = None) -> StabilityResult:
    """Return poles, margins, maps and screenings.

    Raises:
        ParameterError: an option cannot be used.
    """
    _check(config)
    devised = [controller(name) for name in config.controllers]
    plants, poses, options = plants_of(config), poses_of(config), options_of(config)
    points = min(config.map_points, QUICK_POINTS) if config.quick else config.map_points
    maps = 2 * len(devised) * len(plants) if points else 0
    total = len(plants) * len(poses) * len(devised) + maps
    bar = progress.add_task("stability", total=total) if progress else None
    result = StabilityResult([], [], [])

    def advance() -> None:
        if progress and bar is not None:
            progress.advance(bar)

    middle = poses[len(poses) // 2]
    for plant in plants:
        for each in devised:
            for pose in poses:
                result.rows.append(row(plant, each, pose, options, config.slack))
                advance()
            for joint in (0, 1) if points else ():
                found = stability_map(plant, each, joint, middle, options, points)
                result.maps.append(found)
                advance()
        if config.screen:
            rng = np.random.default_rng(config.seed)
            result.screens.append(screen(plant, middle, options, config.screen, config.slack, rng))
    return result


def row(
    plant: Plant, devised: Controller, theta2: float, options: LoopOptions, slack: float
) -> dict[str, Any]:
    """Return one line of the table: poles, margins, and the growth that a simulation shows.

    Angles in rad, rates in 1/s. Margins of a loop that is not stable are where it would next
    cross the unit circle.
    """
    b, a = stack_filters([devised.filters(options.period)])
    loops = {hold: linear_loop(plant, theta2, b, a, _with(options, hold)) for hold in HOLDS}
    loop = loops[options.hold]
    found: dict[str, Any] = {
        "plant": plant.name,
        "controllers": devised.name,
        "theta2": theta2,
        "hold": options.hold,
        "stable": loop.growth_rate <= slack,
        "spectral_radius": loop.spectral_radius,
        "growth_exact": loops["exact"].growth_rate,
        "growth_stepped": loops["stepped"].growth_rate,
        "growth_simulated": simulated_growth(plant, loops["stepped"], options),
    }
    for joint in (0, 1):
        at = margins(loop, joint)
        found |= {
            f"gain_low_{joint + 1}": at.gain_low,
            f"gain_high_{joint + 1}": at.gain_high,
            f"phase_{joint + 1}": at.phase,
            f"omega_phase_{joint + 1}": at.omega_phase,
        }
    return found | _poles(loop)


def _with(options: LoopOptions, hold: str) -> LoopOptions:
    o = options
    return LoopOptions(o.period, o.v_gain, o.torque_gain, o.joint_damping, hold)


def _poles(loop: LinearLoop) -> dict[str, float]:
    """Return moduli and frequencies [rad/s] of the largest poles, conjugates once."""
    upper = loop.poles[loop.poles.imag >= 0][:POLES_SHOWN]
    found = {}
    for i, pole in enumerate(upper, start=1):
        found[f"pole_{i}_modulus"] = float(np.abs(pole))
        found[f"pole_{i}_omega"] = float(np.angle(pole)) / loop.sampled.period
    return found


def write(folder: Path, config: StabilityConfig, result: StabilityResult) -> None:
    """Write configuration, table and maps into a folder."""
    write_config(folder, config, screens=result.screens)
    write_rows(folder / "results.csv", result.rows)
    if result.screens:
        write_rows(folder / "screens.csv", result.screens)
    if result.maps:
        (folder / "figures").mkdir()
        for plant in dict.fromkeys(each.plant for each in result.maps):
            mine = [each for each in result.maps if each.plant == plant]
            map_figure(mine, config.slack, folder / "figures" / f"stable_{plant}.png")


def table(rows: list[dict[str, Any]]) -> Table:
    """Return the rows as a table for the terminal."""
    grid = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    grid.add_column("plant: loop", no_wrap=True)
    for heading in ("theta2", "growth", "simulated", "exact", "gain 1", "gain 2"):
        grid.add_column(heading, justify="right", no_wrap=True)
    for each in rows:
        simulated, mark = each["growth_simulated"], "" if each["stable"] else "!"
        grid.add_row(
            f"{each['plant'].removeprefix('assumed-')}: {each['controllers']}",
            f"{each['theta2']:.2f}",
            f"{each['growth_stepped']:+.2g}" + mark * (each["hold"] == "stepped"),
            "-" if simulated is None else f"{simulated:+.2g}",
            f"{each['growth_exact']:+.2g}" + mark * (each["hold"] == "exact"),
            *(f"{each[f'gain_low_{j}']:.1g}-{each[f'gain_high_{j}']:.2g}" for j in (1, 2)),
        )
    return grid


def command(config: StabilityConfig) -> None:
    """Run the study and write its folder."""
    start = time.perf_counter()
    result = carried_out(config, run, write)
    if config.json:
        run_at = {"rows": result.rows, "screens": result.screens, "run": str(config.out)}
        print(to_json(run_at))
        return
    out = Console(highlight=False)
    out.print(table(result.rows))
    for each in result.screens:
        out.print(
            f"{each['plant']}: {100 * each['stable_share']:.1f} % of {each['draws']} draws stable, "
            f"{1e3 * each['seconds_per_draw']:.2f} ms each; simulation agrees on "
            f"{100 * each['agreement']:.1f} % of {each['compared']}"
        )
    out.print(
        "Growth of the slowest-decaying motion [1/s] as stepped, ! above the slack; as the\n"
        "nonlinear simulation shows it; without the steps' damping. Gains: factors of the loop\n"
        "gain of a joint at which a pole crosses the unit circle.\n"
        f"{config.out}: results.csv, figures/ ({time.perf_counter() - start:.0f} s)",
        soft_wrap=True,
    )
