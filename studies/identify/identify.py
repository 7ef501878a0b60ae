"""Which numbers of the robot are those of these logs?

    >>> result = run(IdentifyConfig(logs=(Path("log.csv"),), free="EI,zeta"))
    >>> result.found.values["EI"]

From torques and what they moved, by least squares or by the paper's genetic algorithm; or, of a
free decay alone, frequencies and damping by the matrix pencil.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import tyro
from rich.progress import Progress

from flexsim.errors import ParameterError
from flexsim.files.atomic import write_text
from flexsim.loop.runs import thread_count
from flexsim.loop.settings import setting
from studies import headings
from studies.core.carry_out import contents, progress_bar, show_tables
from studies.core.console import console
from studies.core.figures import write_figures
from studies.core.folder import (
    require_free,
    run_folder,
    to_json,
    write_config,
    write_tables,
)
from studies.core.options import HardwareOptions, keep_file, show_differences
from studies.core.study_options import FORMATS, Format, SeedOptions, ThreadOptions, check
from studies.core.table import write_files
from studies.core.text import spelled
from studies.identify import report
from studies.identify.decay.command import DecayOptions, show
from studies.identify.estimates import (
    LEAST_SQUARES,
    Identified,
    Search,
    identified,
    left_one_out,
    predicted,
)
from studies.identify.names import free_numbers
from studies.identify.records import Record, noise_of, read_record
from studies.identify.residuals import Problem
from studies.identify.simulated import Model, require_built, searched_as
from studies.identify.written import MJCF, STUDY, mjcf_of, study_file
from studies.tuning.genetic import GeneticSettings

QUESTION = "Which numbers of the robot are those of these logs?"

Logs = Annotated[
    tuple[Path, ...],
    tyro.conf.Positional,
    tyro.conf.arg(
        metavar="LOG [LOG ...]", help="CSV files as flexsim drive writes them, or a laboratory's."
    ),
]


@dataclass(frozen=True)
class IdentifyConfig(DecayOptions, ThreadOptions, SeedOptions, HardwareOptions):
    """Identify numbers of the robot from logs of torques, angles and v."""

    PANEL: ClassVar = headings.MAIN

    logs: Logs
    free: str | None = None
    """Numbers to identify, with commas between: of the robot (EI, zeta, rho, I_R0, F_1, ...), of
    friction (friction.tau_0, friction.mu_2, friction.stiction, friction.cold, ...), gain.v,
    offset.strain1, ...; needed without --method decay."""
    torque: tuple[Path, ...] = ()
    """CSV files of the torques, one for all logs or one for each; the logs' own unless given."""
    plant: str = "assumed-modes"
    """Model that the logs are held against: a plant's name as in flexsim drive."""
    setting: str = "none"
    """Friction, limits and motors: none, simulink, jump, opposing, stribeck, lugre or
    reconstructed."""
    method: Literal["least-squares", "genetic", "decay"] = "least-squares"
    """least-squares; genetic, the paper's algorithm; decay, frequencies and damping alone."""
    held_back: tuple[Path, ...] = ()
    """Logs that are predicted, not identified from, with torques of their own or the one file of
    --torque; of several logs, each by the others unless given."""
    signals: tuple[str, ...] = ()
    """Columns to use: theta1, theta2, v, w1, w2, strain1, strain2; all there are unless given."""
    start: Literal["rest", "moving"] = "rest"
    """How the arm is at the first row: at rest, or its joints moving at rates to be found."""
    starts: int = 3
    """Searches of least squares, the first from the robot's own numbers."""
    population: int = 50
    """Individuals per generation of --method genetic."""
    generations: int = 40
    """Generations of --method genetic at most."""
    out: Path | None = None
    """Folder of the run, made anew; without one nothing is written."""
    force: bool = False
    """Replace the run that is there."""
    json: bool = False
    """Print one JSON object instead of the tables."""
    format: tuple[Format, ...] = FORMATS
    """Of the figures, each once."""

    def search(self) -> Search:
        """Return how numbers are searched."""
        settings = GeneticSettings(self.population, self.generations)
        return Search(self.method, self.starts, self.seed, settings)

    def excite(self, free: str) -> str:
        """Return the command that writes torques which tell these numbers."""
        own = f" --setting {self.setting}" if self.setting != "none" else ""
        return f"flexsim experiment --free {free}{own} --out torque.csv"


def read_records(
    config: IdentifyConfig, logs: Sequence[Path], torque: Sequence[Path]
) -> tuple[Record, ...]:
    """Return logs with their torques.

    Raises:
        ParameterError: another number of torques than of logs, a log twice, or one that cannot be
            used.
    """
    if len(torque) not in (0, 1, len(logs)):
        raise ParameterError(
            f"--torque has {len(torque)} files for {len(logs)} logs; give one for all, or one each"
        )
    for path in logs:
        if list(logs).count(path) > 1:
            raise ParameterError(f"{path} is given twice; a log counts once")
    files: list[Path | None] = list(torque) if torque else [None]
    files *= len(logs) if len(files) == 1 else 1
    found = [
        read_record(log, file, config, config.signals)
        for log, file in zip(logs, files, strict=True)
    ]
    return tuple(found)


def model_of(config: IdentifyConfig) -> Model:
    """Return the model whose numbers are searched.

    Raises:
        ParameterError: an unknown plant, setting or number.
    """
    if config.free is None:
        raise ParameterError(
            "--free is missing; name the numbers to identify, as --free EI,zeta,F_1,friction.tau_0"
        )
    robot, chosen = config.robot_of(), setting(config.setting, config.built)
    free = free_numbers(config.free, robot, chosen)
    return Model(robot, searched_as(config.plant), chosen, free)


def run(config: IdentifyConfig, progress: Progress | None = None) -> report.Result:
    """Return what the logs tell.

    Raises:
        ParameterError: options or logs that cannot be used, or that do not tell the numbers.
        RunError: a file cannot be read, or the search does not end.
    """
    check(config)
    if config.starts < 1:
        raise ParameterError(f"starts is {config.starts}; give 1 or more searches")
    used = {path.resolve() for path in config.logs}
    for path in config.held_back:
        if path.resolve() in used:
            raise ParameterError(f"{path} is held back, and a log to identify from; choose one")
    model = model_of(config)
    require_built(model, config.signals)
    records = read_records(config, config.logs, config.torque)
    require_built(model, {name for each in records for name in each.signals})
    count = thread_count() if config.threads is None else config.threads
    sigmas = tuple(map(noise_of, records))
    problem = Problem(model, records, sigmas, config.start, count)
    if progress is not None:
        progress.add_task("identifying", total=None)
    free = ",".join(each.name for each in model.free)
    found = identified(problem, config.search(), config.excite(free))
    return report.Result(
        found,
        _held_back(config, model, found),
        config.plant,
        config.method,
        config.setting,
        tuple(each.words for each in records),
        _mujoco_apart(config, found),
    )


def _held_back(config: IdentifyConfig, model: Model, found: Identified) -> list[Any]:
    """Return the errors of prediction of logs held back, or of each by the others."""
    problem = found.found.problem
    if config.held_back:
        shared = config.torque if len(config.torque) == 1 else ()
        records = read_records(config, config.held_back, shared)
        own = Problem(model, records, tuple(map(noise_of, records)), config.start, problem.threads)
        return list(predicted(model, found.values, own))
    if len(config.logs) > 1 and config.method == LEAST_SQUARES:
        return list(left_one_out(problem, config.search(), found.found.z[: problem.own]))
    return []


def _mujoco_apart(config: IdentifyConfig, found: Identified) -> float | None:
    """Return how far MuJoCo's own chain is from the closed form, in noises; None of others."""
    if searched_as(config.plant) == config.plant:
        return None
    problem, z = found.found.problem, found.found.z
    robot, chosen = problem.model.robot, problem.model.setting
    theirs = problem.modelled(z, 0, Model(robot, config.plant, chosen, problem.model.free))
    ours = problem.modelled(z, 0)
    if theirs is None or ours is None:
        return math.inf
    return float(np.max(np.abs(theirs - ours) / problem.sigmas[0]))


def write(folder: Path, config: IdentifyConfig, result: report.Result) -> None:
    """Write what a run keeps into its folder: tables, figure, the robot as study file and MJCF."""
    said = {"question": QUESTION, "answer": report.verdict(result)}
    write_config(folder, config, hardware=config.hardware_words, **said)
    shown = report.tables(result)
    write_files(folder, shown)
    write_tables(folder, shown)
    write_figures(folder, report.figures(result), config.format)
    model, values = result.found.found.problem.model, result.found.values
    write_text(folder / MJCF, mjcf_of(model, values))
    write_text(folder / STUDY, study_file(model, values, config.plant))


def command(config: IdentifyConfig) -> None:
    """Identify, print what was found, and write the run if there is a folder for it."""
    if config.method == "decay":
        given = {"--free": config.free, "--out": config.out, "--torque": config.torque or None}
        for name, value in given.items():
            if value is not None:
                raise ParameterError(
                    f"{name} has no effect with --method decay; leave it out, and say with --begin "
                    "when the last torque was over"
                )
        show(config, config.logs, config.json)
        return
    if config.out is not None:
        require_free(config.out, config.force)
    robot = config.robot_of()
    with progress_bar() as progress:
        result = run(config, progress)
    if config.out is not None:
        with run_folder(config.out, config.force) as folder:
            write(folder, config, result)
            keep_file(folder, robot)
    if config.json:
        rows = {table.key: table.as_json() for table in report.tables(result) if table.key}
        about = {"hardware": config.hardware_words, "run": config.out and str(config.out)}
        print(to_json({**report.content(result), **rows, **about}))
        return
    show_differences(robot)
    out = console()
    for line in result.words:
        out.print(spelled(line), soft_wrap=True)
    show_tables(report.tables(result), out)
    out.print(report.verdict(result), soft_wrap=True)
    if config.out is not None:
        out.print(f"{spelled(config.out)}: {', '.join(contents(config.out))}", soft_wrap=True)
