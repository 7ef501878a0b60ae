"""What do the paper's misprints cost? The printed equations against the consistent ones.

    >>> result = run(MisprintsConfig(quick=True))
    >>> result.rows[0]["misprint"], result.rows[0]["drift_brisk"]

Every misprint alone, all of them and none: the energy that free, undamped motion makes or loses;
how far the tip strays from the chain's under the torques of `flexsim crosscheck`, over poses and
amplitudes; and what the closed loop makes of it. The ranges of (39)-(41) cannot be run as printed,
H is singular, which is all that their row says; they are read as 3 <= j <= n+2 in all others.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from controllers import TUNED, Controller
from flexsim.errors import ParameterError
from flexsim.loop.metrics import envelope_half_width
from flexsim.loop.motion import Motion
from flexsim.loop.runs import drive, evaluate
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import Reference, reference, trajectory
from flexsim.numerics.types import Array
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.printed import AS_PRINTED, MISPRINTS, printed_mass, printed_modes
from flexsim.robot import Robot
from studies.core.carry_out import carried_out
from studies.core.folder import to_json, write_config, write_rows
from studies.core.options import RobotOptions
from studies.core.repeats import perturbed
from studies.misprints.report import LEGEND, energy_figure, table, tip_figure, verdict
from studies.parity.crosscheck import tip_difference
from studies.parity.motions import BRISK, GENTLE, POSE, trial_torque

PERIOD = 1e-3  # [s] control period of the paper
FREE_STEP = 0.25e-3  # [s] of free motion, so that RK4's own drift stays below 1e-7
FREE_TIME = 2.0  # [s]
STARTS = {  # joint rates [rad/s], first modal coordinate [m], of free motion from POSE
    "gentle": (GENTLE, 0.0),
    "brisk": (BRISK, 0.0),
    "bent": ((0.2, 0.1), 0.01),
}
DRAWN = "bent"  # of STARTS, in the figure
AMPLITUDES = {"small": 1.0, "large": 4.0}  # of `trial_torque`
POSES = (0.4, 0.8, 1.2, 1.6, 2.0, 2.4)  # theta2 [rad]
QUICK_POSES = (0.8, 1.6)
CONTROLLERS = "circle"  # of TUNED: those that hold every trajectory under both readings
TRACKED = ("line", "two-loop", "circle")
QUICK_TRACKED = ("circle",)
QUICK_RUNS = 2
READINGS = ("none", "print")  # settings of the closed loop
VARIANTS = {"none": 0, **MISPRINTS, "all": AS_PRINTED}
RANGES = "(39)-(41) ranges"  # 3 <= j <= n where it is n+2: not a variant, as it cannot run


@dataclass(frozen=True)
class MisprintsConfig(RobotOptions):
    """Count what each misprint costs: energy drift, tip error, tracking."""

    out: Path = Path("runs/misprints")
    """Folder of the run, made anew."""
    force: bool = False
    """Replace the run that is there."""
    quick: bool = False
    """Two poses, one trajectory and two runs each only."""
    perturbations: int = 10
    """Runs in closed loop behind each median, the gains' fourth digits perturbed."""
    seed: int = 1
    """Seed of the perturbations."""
    modes: int = 3
    """Assumed modes, n."""
    segments: int | None = None
    """Segments of the chain; 6 unless given."""
    json: bool = False
    """Print one JSON object instead of the table."""

    @property
    def runs(self) -> int:
        """Runs behind each median."""
        return QUICK_RUNS if self.quick else self.perturbations


@dataclass(frozen=True, eq=False)
class MisprintsResult:
    """A row per variant, the details it is the worst of, and energy's relative changes (K,)."""

    rows: list[dict[str, Any]]
    details: list[dict[str, Any]]
    energy: dict[str, Array]


def misprinted(
    robot: Robot, misprints: int, modes: int = 3, step: float | None = None
) -> AssumedModesPlant:
    """Return a robot's plant with chosen misprints."""
    usual = robot.modes_plant(None, modes, step)
    return replace(usual, form="printed", misprints=misprints)


def free_motion(robot: Robot, misprints: int, start: str, modes: int = 3) -> Array:
    """Return the relative change of energy (K,) in free, undamped motion.

    Args:
        robot: as named. misprints: switches; start: a key of STARTS; modes: n.
    """
    plant = misprinted(robot, misprints, modes, FREE_STEP).undamped()
    rates, eta_1 = STARTS[start]
    state = plant.rest_state(POSE)
    state[2] = eta_1
    state[modes + 2 : modes + 4] = rates
    still = np.zeros((round(FREE_TIME / PERIOD), 2))
    energy = drive(plant, setting("none"), still, PERIOD, state=state).energy
    change: Array = energy / energy[0] - 1
    return change


def driven_details(
    name: str, plant: AssumedModesPlant, chains: dict[tuple[str, float], Motion]
) -> list[dict[str, Any]]:
    """Return the rms tip difference [m] to the chain and to the consistent equations, open loop.

    Args:
        name: of the variant; chains: the chain's motions by amplitude and pose.
    """
    details = []
    right = replace(plant, misprints=0)
    for (amplitude, pose), chain in chains.items():
        torque = trial_torque(AMPLITUDES[amplitude])
        theta = (POSE[0], pose)
        motion = drive(plant, setting("none"), torque, PERIOD, theta)
        consistent = drive(right, setting("none"), torque, PERIOD, theta)
        details.append(
            {
                "misprint": name,
                "case": f"torques {amplitude}",
                "theta2": pose,
                "tip_to_chain": tip_difference(motion, chain),
                "tip_to_consistent": tip_difference(motion, consistent),
            }
        )
    return details


def tracked(
    plant: AssumedModesPlant, reading: str, ref: Reference, controllers: Sequence[Controller]
) -> list[Array | None]:
    """Return the tip (K, 2) [m] under every controller, None where it diverges.

    Args:
        plant: as named; reading: setting of friction; ref: sampled reference.
    """
    filters = [controller.filters(PERIOD) for controller in controllers]
    outcome = evaluate(plant, setting(reading), ref, filters, stride=1)
    return [
        plant.observe(states, energy=False).tip if np.isnan(gone) else None
        for states, gone in zip(outcome.states, outcome.diverged, strict=True)
    ]


def apart(first: Array | None, second: Array | None) -> float:
    """Return the rms distance of two tips [m], infinite where one diverged."""
    if first is None or second is None:
        return math.inf
    return float(np.sqrt(np.mean(np.sum((first - second) ** 2, axis=1))))


def tracking_details(
    name: str, plant: AssumedModesPlant, config: MisprintsConfig
) -> list[dict[str, Any]]:
    """Return medians in closed loop: envelopes, rms distance to the consistent model's run [m].

    The gains differ in their fourth digits from run to run, alike for both models. The consistent
    model's own distance is that to its run with the unperturbed gains.
    """
    nominal = TUNED[CONTROLLERS]
    controllers = perturbed(nominal, config.runs, np.random.default_rng(config.seed))
    consistent = AssumedModesPlant(plant.parameters, plant.modes, plant.step, chain=plant.chain)
    details = []
    for path in QUICK_TRACKED if config.quick else TRACKED:
        ref = reference(trajectory(path), plant.parameters, PERIOD)
        for reading in READINGS:
            tips = tracked(plant, reading, ref, controllers)
            if plant.misprints:
                right = tracked(consistent, reading, ref, controllers)
            else:
                right = tracked(consistent, reading, ref, [nominal]) * config.runs
            widths = [
                math.inf if tip is None else envelope_half_width(tip, ref.tip) for tip in tips
            ]
            details.append(
                {
                    "misprint": name,
                    "case": f"loop {reading}",
                    "trajectory": path,
                    "envelope": float(np.median(widths)),
                    "tip_to_consistent": float(np.median(list(map(apart, tips, right)))),
                }
            )
    return details


def summary(
    name: str, drifts: dict[str, Array], details: list[dict[str, Any]], rank: int
) -> dict[str, Any]:
    """Return one variant's row: the worst of its details, infinite where the loop diverged.

    rank: of H, n + 2 where the equations can be solved.
    """

    def worst(case: str, column: str) -> float:
        return max(row[column] for row in details if row["case"] == case)

    row: dict[str, Any] = {"misprint": name, "rank_of_H": rank}
    row |= {f"drift_{start}": float(np.abs(drift).max()) for start, drift in drifts.items()}
    for amplitude in AMPLITUDES:
        for column in ("tip_to_chain", "tip_to_consistent"):
            row[f"{column}_{amplitude}"] = worst(f"torques {amplitude}", column)
    for reading in READINGS:
        row[f"envelope_{reading}"] = worst(f"loop {reading}", "envelope")
        row[f"loop_to_consistent_{reading}"] = worst(f"loop {reading}", "tip_to_consistent")
    return row


def rank_with_printed_ranges(plant: AssumedModesPlant) -> int:
    """Return the rank of H where (39)-(41) fill rows 3 <= j <= n only, as printed, of n + 2."""
    H = printed_mass(printed_modes(plant.coefficients), np.array([*POSE, *np.zeros(plant.modes)]))
    n = plant.modes
    empty = slice(max(n, 2), None)  # rows n+1, n+2 counted from 1
    H[empty, :] = H[:, empty] = 0.0
    return int(np.linalg.matrix_rank(H))


def run(config: MisprintsConfig, progress: Progress | None = None) -> MisprintsResult:
    """Return what every misprint costs.

    Raises:
        ParameterError, ModelError: perturbations, seed, modes or segments out of range.
    """
    if config.perturbations < 1:
        raise ParameterError(f"perturbations is {config.perturbations}; give 1 or more")
    if config.seed < 0:
        raise ParameterError(f"seed is {config.seed}; give 0 or more")
    robot = config.robot_of()
    chain = robot.chain_plant(None, config.segments)
    poses = QUICK_POSES if config.quick else POSES
    chains = {
        (amplitude, pose): drive(
            chain, setting("none"), trial_torque(scale), PERIOD, (POSE[0], pose)
        )
        for amplitude, scale in AMPLITUDES.items()
        for pose in poses
    }
    result = MisprintsResult([], [], {})
    steps = VARIANTS.items()
    for name, switches in progress.track(steps, description="misprints") if progress else steps:
        drifts = {start: free_motion(robot, switches, start, config.modes) for start in STARTS}
        plant = misprinted(robot, switches, config.modes)
        details = driven_details(name, plant, chains) + tracking_details(name, plant, config)
        result.rows.append(summary(name, drifts, details, config.modes + 2))
        result.details.extend(details)
        result.energy[name] = drifts[DRAWN]
    rank = rank_with_printed_ranges(plant)
    blank: dict[str, Any] = dict.fromkeys(result.rows[0])
    result.rows.append(blank | {"misprint": RANGES, "rank_of_H": rank})
    return result


def write(folder: Path, config: MisprintsConfig, result: MisprintsResult) -> None:
    """Write configuration, tables and figures into a folder."""
    write_config(folder, config)
    write_rows(folder / "results.csv", result.rows)
    columns = list(dict.fromkeys(key for row in result.details for key in row))
    details = [{key: row.get(key) for key in columns} for row in result.details]
    write_rows(folder / "details.csv", details)
    (folder / "figures").mkdir()
    energy_figure(result.energy, f"start {DRAWN!r}", PERIOD, folder / "figures" / "energy.png")
    tip_figure(result.details, folder / "figures" / "tip.png")


def command(config: MisprintsConfig) -> None:
    """Run the study and write its folder."""
    result = carried_out(config, run, write)
    if config.json:
        print(to_json({"rows": result.rows, "details": result.details, "run": str(config.out)}))
        return
    out = Console(highlight=False)
    out.print(LEGEND)
    out.print(table(result.rows))
    out.print(
        f"{verdict(result.rows)}\n{config.out}: results.csv, details.csv, figures/", soft_wrap=True
    )
