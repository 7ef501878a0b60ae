"""Do the paper's controllers behave the same on both models of the robot? The main study.

    >>> result = run(CompareConfig())
    >>> result.rows[0]["envelope"]   # [m]

Three trajectories and Figure 6's transfer, on both plants, for two sets of controllers: those
tuned by us, under the friction of (47) as printed; and the paper's Table 2 under the setting
`reconstructed`, a fit. Where joints stick and slip, a change of a gain's fourth digit alters a
run, so all figures are medians over small seeded perturbations of the gains, and the plants are
compared by these only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from rich.progress import Progress

from controllers import TABLE_2, TUNED, Controller
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.metrics import measures
from flexsim.loop.motion import Motion
from flexsim.loop.runs import closed_loop
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import TRAJECTORIES, Trajectory, reference, trajectory
from flexsim.numerics.clocks import whole_substeps
from flexsim.plants.base import Plant
from flexsim.recording.case import Case
from flexsim.recording.traces import CHAIN
from flexsim.robot import Robot
from flexsim.shaping.feedforward import dead_zone_error
from flexsim.shaping.true_tip import shaped_reference
from studies.compare.report import Comparison, print_report, write_report
from studies.core.carry_out import carried_out
from studies.core.figures import paper_envelopes
from studies.core.folder import to_json
from studies.core.options import RobotOptions
from studies.core.repeats import perturbed

RECORDED_EVERY = 5  # samples; 200 Hz shows the third mode
FIGURE_OF = {"line": "figure-3", "two-loop": "figure-4", "circle": "figure-5"}
CASES = (  # trajectory, controllers devised for
    ("line", "line"),
    ("two-loop", "two-loop"),
    ("circle", "circle"),
    ("line", "two-loop"),  # Figure 6
)
MIRRORED, TRUE_TIP, DITHERED = "mirrored tip", "true tip", "true tip, dithered"  # references
FILE_OF = {MIRRORED: "plain", TRUE_TIP: "true_tip", DITHERED: "true_tip_dithered"}
MEDIANS = ("envelope", "max_error", "rms_error", "max_v", "residual_v", "index")


@dataclass(frozen=True)
class CompareConfig(RobotOptions):
    """Run the controllers on both plants: table, figures and a recording."""

    plants: tuple[str, str] = ("assumed-modes", "chain")
    """Two of rigid, assumed-modes[:n], printed[:n], chain[:N], untuned[:N], rod."""

    out: Path = Path("runs/compare")
    """Folder of the run, made anew."""
    force: bool = False
    """Replace the run that is there."""
    perturbations: int = 20
    """Runs behind each median, the gains' fourth digits perturbed."""
    seed: int = 1
    """Seed of the perturbations."""
    setting: str = "print"
    """Friction, limits and motors of our controllers: none, print, joint or reconstructed."""
    period: float = 1e-3
    """Control period [s], the paper's; a whole multiple of the physics steps."""
    segments: int | None = None
    """Segments of chains whose name has no number; 6 unless given."""
    modes: int = 3
    """Assumed modes, n, where the name has no number."""
    step: float | None = None
    """Physics step of assumed modes [s]; 1 ms, halved until RK4 can take it, unless given."""
    chain_step: float | None = None
    """Physics step of chains [s]; 1 ms, halved until RK4 can take it, unless given."""
    robot: Parameters = field(default_factory=Parameters)
    """The robot, on both plants, without --mjcf."""
    line: Trajectory = TRAJECTORIES["line"]
    """Our line; the reconstructed one is part of its fit."""
    two_loop: Trajectory = TRAJECTORIES["two-loop"]
    """Our two-loop."""
    circle: Trajectory = TRAJECTORIES["circle"]
    """Our circle."""
    true_tip: bool = False
    """Add runs on references shaped so that the true tip follows, not the mirrored one."""
    threads: int | None = None
    """Threads; all cores unless given. Results do not depend on it."""
    json: bool = False
    """Print one JSON object instead of the table."""


@dataclass(frozen=True)
class Task:
    """One case to run: which controllers on which trajectory under which setting."""

    trajectory: Trajectory
    label: str
    controller: Controller
    setting: str
    name: str
    group: str = "ours"
    reference: str = MIRRORED


def tasks(config: CompareConfig) -> list[Task]:
    """Return the cases: our controllers, Table 2 under `reconstructed`, those for the true tip."""
    ours, fitted = [], []
    paths = {"line": config.line, "two-loop": config.two_loop, "circle": config.circle}
    for path, devised in CASES:
        suffix = path if path == devised else f"{path}_by_{devised}"
        ours.append(
            Task(
                paths[path],
                f"tuned {devised}",
                TUNED[devised],
                config.setting,
                f"tuned_{suffix}",
            )
        )
        fitted.append(
            Task(
                trajectory(path, reconstructed=True),
                f"Table 2 {devised}",
                TABLE_2[FIGURE_OF[devised]],
                "reconstructed",
                f"table2_{suffix}",
                group="Table 2",
            )
        )
    return ours + fitted + (true_tip_tasks(paths, config.setting) if config.true_tip else [])


def true_tip_tasks(paths: dict[str, Trajectory], setting_name: str) -> list[Task]:
    """Return runs on every kind of reference: without friction, then under our setting.

    A dither is for friction only.
    """
    return [
        Task(
            paths[path],
            f"tuned {path}",
            TUNED[path],
            name,
            f"{FILE_OF[kind]}_{name}_{path}",
            group="true tip",
            reference=kind,
        )
        for name in dict.fromkeys(("none", setting_name))
        for path in paths
        for kind in FILE_OF
        if kind != DITHERED or setting(name).friction.law != "none"
    ]


def plants_of(config: CompareConfig, setting_name: str) -> tuple[Plant, Plant]:
    """Return both plants with a setting's motors."""
    robot, motors, c = config.robot_of(config.robot), setting(setting_name), config
    one, other = (
        robot.plant(name, motors, c.modes, c.segments, c.step, c.chain_step) for name in c.plants
    )
    return one, other


def run_task(task: Task, plant: Plant, config: CompareConfig) -> tuple[dict[str, Any], Motion]:
    """Return the row of one case on one plant, and the unperturbed motion, thinned."""
    ref = reference(task.trajectory, plant.parameters, config.period)
    chosen = setting(task.setting)
    nominal = task.controller.filters(config.period)
    if task.reference != MIRRORED:
        dither = task.reference == DITHERED
        ref = shaped_reference(ref, plant, filters=nominal, friction=chosen.friction, dither=dither)
    motion = closed_loop(plant, chosen, ref, [nominal], RECORDED_EVERY, threads=config.threads)[0]
    rng = np.random.default_rng(config.seed)
    controllers = perturbed(task.controller, config.perturbations, rng)
    filters = [controller.filters(config.period) for controller in controllers]
    motions = closed_loop(plant, chosen, ref, filters, energy=False, threads=config.threads)
    figures = [measures(each, ref, task.trajectory.hold) for each in motions]
    row = {
        "controllers": task.label,
        "trajectory": task.trajectory.name,
        "plant": plant.name,
        "setting": task.setting,
        "group": task.group,
        "reference": task.reference,
        **summary(figures),
    }
    simulation, laboratory = paper_envelopes(task.trajectory.name, task.label) or (None, None)
    row |= {"paper_simulation": simulation, "paper_laboratory": laboratory}
    hidden = dead_zone_error(nominal, chosen.friction)[1] * plant.parameters.reach
    row["dead_zone_error"] = float(hidden)  # [m] at the tip
    return row, motion


def summary(figures: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the medians of runs' figures of merit, the envelope's quartiles and divergences.

    A case counts as diverged when any of its runs did; its medians are of those that did not,
    None where there are none.
    """
    kept = [each for each in figures if not each["diverged"]]
    medians: dict[str, Any] = {}
    for name in MEDIANS:
        values = [each[name] for each in kept if each[name] is not None]
        medians[name] = float(np.median(values)) if values else None
    quartiles = np.percentile([each["envelope"] for each in kept], [25, 75]) if kept else [None] * 2
    times = [each["diverged_at"] for each in figures if each["diverged"]]
    return medians | {
        "envelope_quartile_1": None if quartiles[0] is None else float(quartiles[0]),
        "envelope_quartile_3": None if quartiles[1] is None else float(quartiles[1]),
        "runs": len(figures),
        "diverged": bool(times),
        "diverged_share": len(times) / len(figures),
        "diverged_at": float(min(times)) if times else None,
    }


def run(config: CompareConfig, progress: Progress | None = None) -> Comparison:
    """Return every case on both plants.

    Raises:
        ParameterError: fewer than one perturbation, a negative seed, or a control period that is
            no whole multiple of a physics step.
    """
    if config.perturbations < 1:
        raise ParameterError(f"perturbations is {config.perturbations}; give 1 or more")
    if config.seed < 0:
        raise ParameterError(f"seed is {config.seed}; give 0 or more")
    if config.plants[0] == config.plants[1]:
        raise ParameterError(f"plants are {' '.join(config.plants)}; give two different ones")
    robot = config.robot_of(config.robot)
    todo = tasks(config)
    bar = progress.add_task("compare", total=2 * len(todo)) if progress else None
    names = dict.fromkeys(task.setting for task in todo)
    plants = {name: plants_of(config, name) for name in names}
    for plant in plants[config.setting]:  # before references take memory
        whole_substeps(config.period, plant.step)
    rows: list[dict[str, Any]] = []
    cases = []
    for task in todo:
        motions = {}
        for plant in plants[task.setting]:
            row, motion = run_task(task, plant, config)
            rows.append(row)
            motions[plant.name] = motion
            if progress and bar is not None:
                progress.advance(bar)
        label = task.label
        if task.group == "true tip":
            label += f" (reference: {task.reference})"
        difference = tip_difference(*motions.values())
        rows[-1]["tip_difference"] = rows[-2]["tip_difference"] = difference
        cases.append(
            Case(
                task.name,
                task.trajectory.name,
                label,
                task.setting,
                motions,
                drawn_model(plants[task.setting]),
                reference(task.trajectory, robot.parameters, config.period),
            )
        )
    return Comparison(rows, cases, robot, mjcf_texts(plants, robot))


def drawn_model(plants: Sequence[Plant]) -> mujoco.MjModel | None:
    """Return the compiled model of the plant 'chain', if it is there."""
    return next((plant.model for plant in plants if plant.name == CHAIN), None)


def mjcf_texts(plants: Mapping[str, Sequence[Plant]], robot: Robot) -> dict[str, str]:
    """Return the MJCF of every plant that has one, by file name; a robot's file is kept apart."""
    kept = robot.given.text if robot.given is not None else None
    return {
        f"{plant.name.replace(':', '')}_{name}.xml": plant.mjcf
        for name, every in plants.items()
        for plant in every
        if plant.mjcf is not None and plant.mjcf != kept
    }


def tip_difference(first: Motion, second: Motion) -> float | None:
    """Return the rms distance of two plants' tips while both ran [m]; None if one never did."""
    rows = min(len(first.time), len(second.time))
    if rows == 0:
        return None
    distance = np.linalg.norm(first.tip[:rows] - second.tip[:rows], axis=1)
    return float(np.sqrt(np.mean(distance**2)))


def command(config: CompareConfig) -> None:
    """Run the study and write its folder."""
    result = carried_out(config, run, write_report)
    if config.json:
        print(to_json({"rows": result.rows, "run": str(config.out)}))
    else:
        print_report(result, config.out)
