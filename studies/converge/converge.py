"""How many modes, how many segments, which step? Figures of merit down to the exact beam's.

    >>> result = run(ConvergeConfig(quick=True))
    >>> result.ladders[0].cheapest, result.ladders[0].confirmed

Our controllers on three trajectories and Figure 6's transfer, repeated with their gains' fourth
digits changed, the same repeats on every rung of the ladders (`.rungs`): sizes at their own steps
and at a fine one, held against the exact beam's many modes; steps, held against the shortest of the
same size, of which the exact beam's show that its own does not count. Growth is held against that
of the exact linear loop. What is judged and how is in `.judging`.

The controllers are those tuned for the hardware: without a delay, those of the ideal loop. There
motion is regular, and changes of a hundredth of a millimetre show. On a bench, with its delay and
noise, it is chaotic, and a change that is as small as the interval of what is published shows in
thousands of runs only.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from rich.progress import Progress

from controllers import TUNED, TUNED_IDEAL, Controller
from flexsim.errors import ParameterError
from flexsim.linear.exact_loop import exact_growth, exact_sampled
from flexsim.linear.growth import extreme_poses, growth_rates, loop_options
from flexsim.linear.loop_poles import LoopOptions, spectral_radii
from flexsim.loop.beyond import beyond
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.control.stacking import stack
from flexsim.loop.runs import measure
from flexsim.loop.settings import DEFAULT_SETTING, Setting, setting
from flexsim.loop.trajectories import Reference, reference, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.plants.base import Plant
from flexsim.robot import Robot
from studies.converge.figures import figures
from studies.converge.judging import (
    change_of,
    growth_agrees,
    ladder_row,
    published_runs,
    rung_status,
    shares_status,
)
from studies.converge.report import facts, tables, verdict
from studies.converge.rows import FIGURES, STEPS, CaseRow, Convergence, RungRow
from studies.converge.rungs import REFERENCE, Key, Rung, ladders, plant_at, spoken
from studies.core.carry_out import Study, ticker
from studies.core.evidence.repeats import medians, perturbed, values_of
from studies.core.paper import CASES
from studies.core.study_options import Out, SeedOptions, SettingName, StudyOptions, ThreadOptions
from studies.core.timing import least_cost
from studies.ladder.ladder import loop_clock

Runs = Sequence[Mapping[str, Any]]  # figures of merit of each

TIMED = 1.0  # [s] of a loop that are timed


@dataclass(frozen=True)
class ConvergeConfig(ThreadOptions, SeedOptions, StudyOptions):
    """How many modes, how many segments, which step: what is as good as the exact beam."""

    QUICK: ClassVar = {"perturbations": 6, "rounds": 1}

    out: Out = Path("runs/converge")
    quick: bool = False
    """The line only, six runs, a few rungs, a coarser reference."""
    perturbations: int = 80
    """Runs behind each median, the gains' fourth digits perturbed, the same on every rung."""
    setting: SettingName = DEFAULT_SETTING
    part: Literal["all", "sizes", "defaults"] = "all"
    """All ladders; those of sizes at the models' own steps; or only the default models, and the
    exact beam's, for many runs."""
    rounds: int = 5
    """How often each rung is timed, in turn; the least time counts."""


def usual(config: ConvergeConfig) -> Robot:
    """Return the robot, of which there must be finer models.

    Raises:
        ParameterError: it is a file's, whose chain is as it is, or has a ratio for each mode.
    """
    robot = config.robot_of()
    if robot.given is not None:
        raise ParameterError(
            f"{robot.given.source} is one chain, of which there is no finer one; "
            "leave out --mjcf, and give the robot by --robot.*"
        )
    if robot.modal_damping:
        raise ParameterError(
            f"--modal-damping gives {len(robot.modal_damping)} ratios, and the rungs have 2 to "
            f"{REFERENCE} modes; give --robot.zeta, from which all modes' follow"
        )
    return robot


@dataclass(frozen=True)
class Task:
    """One case: a trajectory, and the controllers that it is driven by."""

    shape: str
    devised: str

    def reference(self, plant: Plant) -> Reference:
        """Return the path for a plant."""
        return reference(trajectory(self.shape), plant.parameters, PERIOD)


def tuned_for(chosen: Setting, devised: str) -> Controller:
    """Return our controllers for a trajectory that are tuned for the hardware."""
    return (TUNED if chosen.hardware.delay else TUNED_IDEAL)[devised]


def growths(plant: Plant, task: Task, chosen: Setting, controllers: Controllers) -> float:
    """Return how fast the linear loop grows as a plant steps it [1/s], the worst of all poses.

    Without friction, or with its slope, whichever is more.
    """
    poses = extreme_poses(task.reference(plant))
    return max(
        float(growth_rates(spectral_radii(plant, poses, controllers, options), PERIOD)[0])
        for options in options_of(chosen, "stepped")
    )


def exact_growths(robot: Robot, task: Task, chosen: Setting, controllers: Controllers) -> float:
    """Return how fast the exact linear loop grows [1/s], as `growths`."""
    own = chosen.applied(robot.parameters)
    poses = extreme_poses(reference(trajectory(task.shape), own, PERIOD))
    loops = [
        exact_sampled(own, pose, options)
        for options in options_of(chosen, "exact")
        for pose in poses
    ]
    return float(exact_growth(loops, controllers)[0])


def options_of(chosen: Setting, hold: str) -> tuple[LoopOptions, LoopOptions]:
    """Return the loop without friction, and with its slope."""
    free = LoopOptions(PERIOD, hold=hold, hardware=chosen.hardware)
    return free, loop_options(chosen.friction, PERIOD, hold, hardware=chosen.hardware)


def case_rows(
    task: Task,
    rungs: Sequence[Rung],
    plants: Mapping[Key, Plant],
    robot: Robot,
    chosen: Setting,
    config: ConvergeConfig,
) -> list[CaseRow]:
    """Return a row of every rung in one case, all with the same perturbed controllers."""
    tuned, hold = tuned_for(chosen, task.devised), trajectory(task.shape).hold
    rng = np.random.default_rng(config.seed)
    filters = [each.filters(PERIOD) for each in perturbed(tuned, config.perturbations, rng)]
    runs = {
        key: measure(plant, chosen, task.reference(plant), filters, hold, threads=config.threads)
        for key, plant in plants.items()
    }
    nominal = stack([tuned.filters(PERIOD)], PERIOD)
    growth = {key: growths(plant, task, chosen, nominal) for key, plant in plants.items()}
    exact = exact_growths(robot, task, chosen, nominal)
    return [
        CaseRow(
            each.ladder,
            each.plant,
            each.step,
            task.shape,
            task.devised,
            config.built.words(),
            robot.parameters.zeta,
            medians(runs[each.key]),
            changes_of(runs[each.key], runs[each.against], config.seed),
            growth[each.key],
            exact,
            growth_agrees(growth[each.key], exact),
            shares_status(_lost(runs[each.key]), _lost(runs[each.against]), config.perturbations),
        )
        for each in rungs
    ]


def changes_of(mine: Runs, against: Runs, seed: int) -> dict[str, float | str | None]:
    """Return the changes of all figures between paired runs, by their names in a file."""
    published = published_runs(values_of(against, "envelope"))
    found: dict[str, float | str | None] = {}
    for name in FIGURES:
        pair = values_of(mine, name), values_of(against, name)
        found |= change_of(*pair, published, seed, mine is against).named(name)
    return found


def _lost(runs: Runs) -> int:
    return sum(bool(each["diverged"]) for each in runs)


def rung_row(
    rung: Rung, rows: Sequence[CaseRow], costs: Mapping[Key, float], exact: Key
) -> RungRow:
    """Return a rung over all its cases."""
    status, why = rung_status(rows)
    moved = {name: np.array([_number(row.change(name).change) for row in rows]) for name in FIGURES}
    most = {name: float(each[np.argmax(np.abs(each))]) for name, each in moved.items()}
    return RungRow(
        rung.ladder,
        rung.plant,
        rung.size,
        rung.step,
        rung.default,
        spoken(rung.against),
        costs[rung.key],
        costs[rung.key] / costs[exact],
        moved["envelope"],
        most["rms_error"],
        most["max_v"],
        max(row.growth for row in rows),
        status,
        why,
    )


def _number(change: float | None) -> float:
    return np.nan if change is None else change


def costs_of(plants: Mapping[Key, Plant], config: ConvergeConfig) -> dict[Key, float]:
    """Return what a simulated millisecond costs on each plant, on one core, in turn [us].

    Time of the processor, not on the wall: short loops would slip through between other work on
    the machine, long ones would not. In the ideal loop: of one that diverges at once there is
    nothing to time.
    """
    seconds, ideal = TIMED / 5 if config.quick else TIMED, setting(config.setting)
    names = {f"{key[0]} {key[1]}": key for key in plants}
    clocks = {name: loop_clock(plants[key], ideal, seconds) for name, key in names.items()}
    costs = least_cost(clocks, config.rounds, time.process_time)
    return {names[name]: cost for name, cost in costs.items()}


def doubt_of(rows: Sequence[CaseRow], exact: Key) -> float | None:
    """Return by how much a doubled step moves the reference's figures at most [m]."""
    coarser = [row for row in rows if row.plant == exact[0] and row.step == 2 * exact[1]]
    steps = [row for row in coarser if row.ladder.startswith(STEPS)]
    moved = [row.change(name).change for row in steps for name in FIGURES]
    known = [abs(each) for each in moved if each is not None]
    return max(known) if known else None


def run(config: ConvergeConfig, progress: Progress | None = None) -> Convergence:
    """Return every rung in every case, held against the reference.

    Raises:
        ParameterError: a number out of range, an unknown setting or hardware, or a file's robot.
    """
    config = config.asked()
    robot, chosen = usual(config), setting(config.setting, config.built)
    tasks = [Task(*each) for each in (CASES[:1] if config.quick else CASES)]
    advance = ticker(progress, "converge", len(tasks) + 1)
    rungs, exact = ladders(robot, chosen, config.quick, config.part)
    plants = {key: plant_at(robot, chosen, key) for key in dict.fromkeys(r.key for r in rungs)}
    rows: list[CaseRow] = []
    for task in tasks:
        rows += case_rows(task, rungs, plants, robot, chosen, config)
        advance()
    costs = costs_of(plants, config)
    advance()
    judged = [
        rung_row(each, [row for row in rows if row.is_of(each)], costs, exact) for each in rungs
    ]
    names = dict.fromkeys(each.ladder for each in rungs)
    ends = [row.found.max_v or 0.0 for row in rows if (row.plant, row.step) == exact]
    return Convergence(
        rows,
        judged,
        [ladder_row([row for row in judged if row.ladder == name]) for name in names],
        tuple(dict.fromkeys(row.case for row in rows)),
        spoken(exact),
        config.perturbations,
        doubt_of(rows, exact),
        beyond(exact[0], max(ends), robot.parameters.L),
    )


command = Study(
    run,
    tables,
    verdict,
    figures,
    facts,
    question="How many modes and segments, and which step, are as good as the exact beam?",
)
