"""How much model does an accuracy need, and what does it cost? Every plant, rung by rung.

    >>> result = run(LadderConfig(quick=True))
    >>> result.rows[0].plant, result.rows[0].tips.tip_small, result.rows[0].us_per_ms

Rigid link, assumed modes, the printed equations, chains tuned, untuned and by MuJoCo's rule of
thumb, MuJoCo's rod: each with its frequencies, what a moment and a payload at its tip do, its tip
under two torques against a converged reference, the envelope of one fixed controller in closed
loop, and the cost of a simulated millisecond. The reference is the limit of untuned chains: their
error falls with 1/N^2, so two of them extrapolate to it, and a coarser pair tells how far to trust
that. In the limit they are the inextensible beam in plane, bent as far as it may be. Of a file's
robot it is the file's chain at a tenth of its step. `.integrators` does the same for steps and
integrators.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.progress import Progress

from controllers import TUNED_IDEAL
from flexsim.arm.beam import MODES
from flexsim.arm.chain_design import DESIGNS
from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies
from flexsim.arm.parameters import Parameters, paper
from flexsim.errors import DivergenceError
from flexsim.loop.metrics import rms_distance
from flexsim.loop.runs import drive, evaluate, measure, thread_count
from flexsim.loop.settings import DEFAULT_SETTING, Setting, setting
from flexsim.loop.trajectories import Reference, reference, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.exudyn_beam.plant import ExudynPlant
from flexsim.robot import Robot
from studies.core.carry_out import Study, ticker
from studies.core.evidence.repeats import Medians, medians, perturbed, single
from studies.core.study_options import Out, StudyOptions, ThreadOptions
from studies.core.timing import least_cost
from studies.ladder.figures import figures
from studies.ladder.integrators import QUICK_STEPS, STEPS, fine_plant, frequencies, integrator_rows
from studies.ladder.loaded import loaded_error, rotation_error
from studies.ladder.report import facts, mark_fronts, tables, verdict
from studies.ladder.rows import Converged, LadderResult, PlantRow, Tips
from studies.parity.motions import AMPLITUDES, POSE, trial_torque

Motions = Callable[[Sequence[Plant]], list[dict[str, Any]]]  # tips by torque of plants

SIZES = range(3, 17)  # segments
RUNGS = (
    *("rigid", "assumed-modes:1", "assumed-modes:2", "assumed-modes:3", "assumed-modes:5"),
    *("printed:3", *(f"{chains}:{n}" for chains in DESIGNS for n in SIZES), "rod"),
)
QUICK_RUNGS = (
    *("rigid", "assumed-modes:1", "assumed-modes:3", "printed:3"),
    *("chain:4", "chain:6", "untuned:6", "untuned:8", "untuned:10", "rule-of-thumb:6", "rod"),
)
EXUDYN, QUICK_EXUDYN = tuple(f"exudyn:{n}" for n in (2, 4, 6, 8, 12)), ("exudyn:4",)
FILE_MODES = 5  # assumed modes of a file's robot, where it has so many hinges
FINE = (28, 40, 56)  # segments of the untuned chains; the last two extrapolate
QUICK_FINE = (12, 16, 24)
FINER = 10  # steps of a file's chain as reference for one of its own; half as many for the doubt
DURATION, QUICK_DURATION = 2.0, 0.5  # [s] of open loop
TASK, READING = "circle", DEFAULT_SETTING  # closed loop: trajectory, its controllers, friction
RUNS, QUICK_RUNS = 10, 2  # of one controller, its gains' fourth digits changed
SEED = 1  # of these changes
CHEAP = 20  # controllers in turn where there is no MuJoCo: one run is too short to time
TIMED, QUICK_TIMED = 1.0, 0.2  # [s] of the trajectory that are timed


@dataclass(frozen=True)
class LadderConfig(ThreadOptions, StudyOptions):
    """Fidelity against cost: every plant, every step and integrator, against one reference."""

    QUICK: ClassVar = {"rounds": 3}

    out: Out = Path("runs/ladder")
    robot: Parameters = field(default_factory=paper)
    """The robot, unless --mjcf gives a file; undamped unless told otherwise, so that chains of
    many segments, whose fastest motions damping makes stiff, can be stepped."""
    quick: bool = False
    """Fewer rungs and steps, half a second of open loop, a coarser reference."""
    exudyn: bool = False
    """Add rungs of EXUDYN's beam, an extra: pip install 'flexsim[exudyn]'. Its closed loop is the
    nominal one only."""
    rounds: int = 10
    """How often each loop is timed, in turn; the least time counts."""


def rungs(robot: Robot, quick: bool, exudyn: bool = False) -> tuple[str, ...]:
    """Return the names of the plants; a file has no other chain than its own."""
    more = (QUICK_EXUDYN if quick else EXUDYN) if exudyn else ()
    if robot.file is None:
        return (*(QUICK_RUNGS if quick else RUNGS), *more)
    most = min(FILE_MODES, len(robot.file.lengths))
    modes = (f"assumed-modes:{n}" for n in range(1, most + 1))
    return ("rigid", *modes, f"printed:{min(MODES, most)}", "chain", *more)  # refused, if any


def open_loop(plant: Plant, torque: str, duration: float) -> Array | None:
    """Return the tip (K, 2) [m] at every millisecond under a torque, None if it ran away."""
    try:
        return drive(
            plant, setting("none"), trial_torque(AMPLITUDES[torque], duration), theta=POSE
        ).tip
    except DivergenceError:
        return None


def extrapolated(coarse: Array, fine: Array, ratio: float) -> Array:
    """Return the limit of a quantity whose error falls with the square of the size (Richardson).

    Args:
        coarse, fine: of equal shape. ratio: of their sizes, over 1.
    """
    return fine + (fine - coarse) / (ratio**2 - 1)


def converged(robot: Robot, motions: Motions, quick: bool) -> Converged:
    """Return the reference of a robot; `motions` gives the tips of plants by torque."""
    if robot.file is not None:
        return _converged_file(robot, motions)
    sizes = QUICK_FINE if quick else FINE
    tips = motions([robot.plant(f"untuned:{n}") for n in sizes])
    pairs = list(zip(pairwise(sizes), pairwise(tips), strict=True))
    limits = [
        {name: extrapolated(less[name], more[name], N / n) for name in AMPLITUDES}
        for (n, N), (less, more) in pairs
    ]
    p = robot.parameters
    return Converged(
        f"untuned chains of {sizes[1]} and {sizes[2]}, extrapolated",
        limits[1],
        {name: rms_distance(limits[0][name], limits[1][name]) for name in AMPLITUDES},
        clamped_frequencies(p, MODES) / (2 * np.pi),
        joint_free_frequencies(p, MODES) / (2 * np.pi),
    )


def _converged_file(robot: Robot, motions: Motions) -> Converged:
    """Return a file's chain under RK4 at a tenth of its step, or less where it is stiff."""
    own = robot.chain_plant()
    coarse = fine_plant(own, 2 * own.step / FINER)
    fine = fine_plant(own, coarse.step / 2)
    less, more = motions([coarse, fine])
    return Converged(
        f"{own.chain.source}, RK4 at {1e3 * fine.step:g} ms",
        more,
        {name: rms_distance(less[name], more[name]) for name in AMPLITUDES},
        *frequencies(own),
    )


def tracking(plant: Plant, chosen: Setting, threads: int | None, runs: int) -> Medians:
    """Return how one controller tracks, with its gains' fourth digits changed in every run.

    EXUDYN's beam runs once, with the gains as they are.
    """
    ref, tuned = reference(trajectory(TASK), plant.parameters), TUNED_IDEAL[TASK]
    if isinstance(plant, ExudynPlant):
        return single(measure(plant, chosen, ref, [tuned], threads=threads)[0])
    every = perturbed(tuned, runs, np.random.default_rng(SEED))
    return medians(measure(plant, chosen, ref, every, threads=threads))


def loop_clock(plant: Plant, chosen: Setting, seconds: float) -> Callable[[], float]:
    """Return a function that runs the start on one core and gives simulated time [ms]."""
    whole = reference(trajectory(TASK), plant.parameters)
    kept = whole.time <= seconds
    ref = Reference(whole.time[kept], whole.tip[kept], whole.joint[kept])
    cheap = plant.mjcf is None and not isinstance(plant, ExudynPlant)
    filters = [TUNED_IDEAL[TASK].filters(PERIOD)] * (CHEAP if cheap else 1)

    def once() -> float:
        ends = evaluate(plant, chosen, ref, filters, threads=1).diverged
        return 1e3 * float(np.where(np.isnan(ends), ref.time[-1], ends).sum())

    return once


def apart(tips: dict[str, Any], ref: Converged) -> Tips:
    """Return how far a plant's tips are from the reference's, infinitely if they ran away."""
    figures = []
    for name in AMPLITUDES:
        gone, tip, wanted = tips[name] is None, tips[name], ref.tip[name]
        figures.append(np.inf if gone else rms_distance(tip, wanted))
        figures.append(np.inf if gone else float(np.linalg.norm(tip - wanted, axis=1).max()))
    return Tips(*figures)


def motions_of(plants: Sequence[Plant], duration: float, threads: int) -> list[dict[str, Any]]:
    """Return the tips by torque of plants, as `open_loop`, on several threads."""
    with quiet_warnings(), ThreadPoolExecutor(threads) as pool:
        jobs = [
            {name: pool.submit(open_loop, plant, name, duration) for name in AMPLITUDES}
            for plant in plants[::-1]  # the longest first
        ]
        return [{name: job.result() for name, job in each.items()} for each in jobs[::-1]]


def plant_rows(
    robot: Robot,
    plants: Sequence[Plant],
    ref: Converged,
    motions: Motions,
    config: LadderConfig,
) -> list[PlantRow]:
    """Return a row of every plant."""
    chosen = setting(READING, config.built)
    runs, seconds = (QUICK_RUNS, QUICK_TIMED) if config.quick else (RUNS, TIMED)
    rows = [
        PlantRow(
            plant.name,
            plant.step,
            *frequencies(plant),
            apart(tips, ref),
            tracking(plant, chosen, config.threads, runs),
            rotation_error(robot, plant),
            loaded_error(robot, plant.name),
        )
        for plant, tips in zip(plants, motions(plants), strict=True)
    ]
    costs = least_cost(
        {each.name: loop_clock(each, chosen, seconds) for each in plants}, config.rounds
    )
    priced = [replace(row, us_per_ms=costs[row.plant]) for row in rows]
    return mark_fronts(priced, ref.uncertainty)


def run(config: LadderConfig, progress: Progress | None = None) -> LadderResult:
    """Return the figures of all rungs and integrators.

    Raises:
        ParameterError, ModelError: rounds or threads out of range, or a file that cannot be used.
    """
    config = config.asked()
    robot, threads = config.robot_of(), config.threads or thread_count()
    duration, steps = (QUICK_DURATION, QUICK_STEPS) if config.quick else (DURATION, STEPS)
    motions = partial(motions_of, duration=duration, threads=threads)
    ticker(progress, "ladder", None)
    plants = [robot.plant(name) for name in rungs(robot, config.quick, config.exudyn)]
    ref = converged(robot, motions, config.quick)
    rows = plant_rows(robot, plants, ref, motions, config)
    integrators = integrator_rows(robot.chain_plant(), steps, duration, config.rounds)
    return LadderResult(rows, integrators, ref)


command = Study(
    run,
    tables,
    verdict,
    figures,
    facts,
    question="How much model does an accuracy need, and what does it cost?",
)
