"""What do the paper's misprints cost? The printed equations against the consistent ones.

    >>> result = run(MisprintsConfig(quick=True))
    >>> result.rows[0]["misprint"], result.rows[0]["drift_brisk"]

Every misprint alone, all of them and none: the energy that free, undamped motion makes or loses;
how far the tip strays from the chain's under the torques of `flexsim crosscheck`, over poses and
amplitudes; and what the closed loop makes of it. The ranges of (39)-(41) cannot be run as printed,
H is singular, nor can (31), whose F has four entries for five rates; that is all that their rows
say. They are read as 3 <= j <= n+2, and as zeros, in all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.progress import Progress

from controllers import TUNED_IDEAL, Controller
from flexsim.arm.beam import MODES
from flexsim.arm.parameters import Parameters, paper
from flexsim.loop.metrics import envelope_half_width, rms_distance
from flexsim.loop.motion import Motion
from flexsim.loop.runs import drive, evaluate
from flexsim.loop.settings import Setting, setting
from flexsim.loop.trajectories import TRAJECTORIES, Reference, reference, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.printed import AS_PRINTED, F_31, MISPRINTS, printed_mass, printed_modes
from flexsim.robot import Robot
from studies.core.carry_out import Study, counted
from studies.core.evidence.intervals import quantile, quantile_interval
from studies.core.evidence.repeats import perturbed
from studies.core.study_options import ModelOptions, Out, Perturbations, SeedOptions, StudyOptions
from studies.misprints import report
from studies.parity.motions import AMPLITUDES, BRISK, GENTLE, POSE, trial_torque

FREE_STEP = 0.25e-3  # [s] of free motion, so that RK4's own drift stays below 1e-7
FREE_TIME = 2.0  # [s]
STARTS = {  # joint rates [rad/s], first modal coordinate [m], of free motion from POSE
    "gentle": (GENTLE, 0.0),
    "brisk": (BRISK, 0.0),
    "bent": ((0.2, 0.1), 0.01),
}
POSES = (0.4, 0.8, 1.2, 1.6, 2.0, 2.4)  # theta2 [rad]
QUICK_POSES = (0.8, 1.6)
CONTROLLERS = "circle"  # of TUNED_IDEAL: those that hold every trajectory under both readings
QUICK_TRACKED = ("circle",)
READINGS = ("none", "simulink")  # settings of the closed loop
VARIANTS = {"none": 0, **MISPRINTS, "all": AS_PRINTED}


@dataclass(frozen=True)
class MisprintsConfig(ModelOptions, SeedOptions, StudyOptions):
    """Count what each misprint costs: energy drift, tip error, tracking."""

    QUICK: ClassVar = {"perturbations": 2}

    out: Out = Path("runs/misprints")
    robot: Parameters = field(default_factory=paper)
    """The robot, unless --mjcf gives a file; undamped, as the paper's, unless told otherwise."""
    quick: bool = False
    """Two poses, one trajectory and two runs each only."""
    perturbations: Perturbations = 20


def misprinted(
    robot: Robot, misprints: int, modes: int = MODES, step: float | None = None
) -> AssumedModesPlant:
    """Return a robot's plant with chosen misprints."""
    usual = robot.modes_plant(None, modes, step)
    return replace(usual, form="printed", misprints=misprints)


def free_motion(robot: Robot, misprints: int, start: str, modes: int = MODES) -> Array:
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
) -> list[report.TorqueDetail]:
    """Return the rms tip differences to the chain and to the consistent equations, open loop.

    Args:
        name: of the variant; chains: the chain's motions by amplitude and pose.
    """
    details = []
    right = replace(plant, misprints=0)
    for (amplitude, pose), chain in chains.items():
        torque = trial_torque(AMPLITUDES[amplitude])
        theta = (POSE[0], pose)
        tip = drive(plant, setting("none"), torque, PERIOD, theta).tip
        consistent = drive(right, setting("none"), torque, PERIOD, theta).tip
        apart = rms_distance(tip, chain.tip), rms_distance(tip, consistent)
        details.append(report.TorqueDetail(name, f"torques {amplitude}", pose, *apart))
    return details


def tracked(
    plant: AssumedModesPlant, chosen: Setting, ref: Reference, controllers: Sequence[Controller]
) -> list[Array | None]:
    """Return the tip (K, 2) [m] under every controller, None where it diverges.

    Args:
        plant: as named; chosen: setting; ref: sampled reference.
    """
    filters = [controller.filters(PERIOD) for controller in controllers]
    outcome = evaluate(plant, chosen, ref, filters, stride=1)
    return [
        plant.observe(states, energy=False).tip if np.isnan(gone) else None
        for states, gone in zip(outcome.states, outcome.diverged, strict=True)
    ]


def apart(first: Array | None, second: Array | None) -> float:
    """Return the rms distance of two tips [m], infinite where one diverged."""
    return np.inf if first is None or second is None else rms_distance(first, second)


def tracking_details(
    name: str, plant: AssumedModesPlant, config: MisprintsConfig
) -> list[report.LoopDetail]:
    """Return medians in closed loop: envelopes, rms distance to the consistent model's run.

    The gains differ in their fourth digits from run to run, alike for both models. The consistent
    model's own distance is that to its run with the unperturbed gains.
    """
    nominal, count = TUNED_IDEAL[CONTROLLERS], config.perturbations
    controllers = perturbed(nominal, count, np.random.default_rng(config.seed))
    consistent = AssumedModesPlant(plant.parameters, plant.modes, plant.step, chain=plant.chain)
    details = []
    for shape in QUICK_TRACKED if config.quick else TRAJECTORIES:
        ref = reference(trajectory(shape), plant.parameters, PERIOD)
        for reading in READINGS:
            chosen = setting(reading, config.built)
            tips = tracked(plant, chosen, ref, controllers)
            if plant.misprints:
                right = tracked(consistent, chosen, ref, controllers)
            else:
                right = tracked(consistent, chosen, ref, [nominal]) * count
            widths = [np.inf if tip is None else envelope_half_width(tip, ref.tip) for tip in tips]
            found = *middle(widths), *middle(list(map(apart, tips, right)))
            details.append(report.LoopDetail(name, f"loop {reading}", shape, count, *found))
    return details


def middle(values: Sequence[float]) -> tuple[float, float | None, float | None]:
    """Return the median of runs, inf where they diverged, and the ends of its 95 % interval."""
    low, high = quantile_interval(values) or (None, None)
    return quantile(values), low, high


def summary(
    name: str,
    drifts: dict[str, Array],
    torques: Sequence[report.TorqueDetail],
    loops: Sequence[report.LoopDetail],
    rank: int,
) -> report.MisprintRow:
    """Return one variant's row: the worst of its details, infinite where the loop diverged.

    rank: of H, n + 2 where the equations can be solved.
    """
    found: dict[str, Any] = {
        f"drift_{start}": float(np.abs(drift).max()) for start, drift in drifts.items()
    }
    for amplitude in AMPLITUDES:
        for column in ("tip_to_chain", "tip_to_consistent"):
            mine = (getattr(t, column) for t in torques if t.case == f"torques {amplitude}")
            found[f"{column}_{amplitude}"] = max(mine)
    for reading in READINGS:
        runs = [row for row in loops if row.case == f"loop {reading}"]
        for column, key in (
            ("envelope", "envelope"),
            ("loop_to_consistent", "tip_to_consistent"),
        ):
            worst = max(runs, key=attrgetter(key))
            for end in ("", "_low", "_high"):
                found[f"{column}_{reading}{end}"] = getattr(worst, f"{key}{end}")
    return report.MisprintRow(name, rank, **found)


def unrunnable(plant: AssumedModesPlant) -> list[report.MisprintRow]:
    """Return the rows of what cannot be run as printed: the ranges of (39)-(41), F of (31)."""
    rows = [report.MisprintRow(report.RANGES, rank_with_printed_ranges(plant))]
    missing = plant.modes + 2 - len(F_31)
    if missing:
        rows.append(report.MisprintRow(report.ENTRIES, plant.modes + 2, missing))
    return rows


def rank_with_printed_ranges(plant: AssumedModesPlant) -> int:
    """Return the rank of H where (39)-(41) fill rows 3 <= j <= n only, as printed, of n + 2."""
    H = printed_mass(printed_modes(plant.coefficients), np.array([*POSE, *np.zeros(plant.modes)]))
    n = plant.modes
    empty = slice(max(n, 2), None)  # rows n+1, n+2 counted from 1
    H[empty, :] = H[:, empty] = 0.0
    return int(np.linalg.matrix_rank(H))


def run(config: MisprintsConfig, progress: Progress | None = None) -> report.MisprintsResult:
    """Return what every misprint costs.

    Raises:
        ParameterError, ModelError: perturbations, seed, modes or segments out of range.
    """
    config = config.asked()
    robot = config.robot_of()
    chain = robot.chain_plant(None, config.segments)
    chains = {
        (amplitude, pose): drive(
            chain, setting("none"), trial_torque(scale), PERIOD, (POSE[0], pose)
        )
        for amplitude, scale in AMPLITUDES.items()
        for pose in (QUICK_POSES if config.quick else POSES)
    }
    result = report.MisprintsResult([], [], {})
    for name, switches in counted(progress, "misprints", VARIANTS.items()):
        drifts = {start: free_motion(robot, switches, start, config.modes) for start in STARTS}
        plant = misprinted(robot, switches, config.modes)
        torques = driven_details(name, plant, chains)
        loops = tracking_details(name, plant, config)
        result.rows.append(summary(name, drifts, torques, loops, config.modes + 2))
        result.details.extend([*torques, *loops])
        result.energy[name] = drifts[report.DRAWN]
    result.rows.extend(unrunnable(plant))
    return result


command = Study(
    run,
    report.tables,
    report.verdict,
    report.figures,
    question="What does each misprint of the paper cost, alone and with all the others?",
)
