"""Which torques tell these numbers, how well will they, and do the intervals hold?

    >>> result = run(ExperimentConfig(free="EI,zeta,I_R0", out=Path("torque.csv")))
    >>> result.scale, result.rows[0].error

Torques of a kind, scaled until the nominal arm stays inside its bounds; the standard errors that
they will leave by Fisher's information, with the noise of the hardware; with `--check`, logs of the
other model with drawn numbers, identified on this one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from flexsim.errors import ParameterError
from flexsim.files.atomic import require_replaceable, write_text
from flexsim.loop.runs import thread_count
from flexsim.loop.settings import setting
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from studies import headings
from studies.core.carry_out import progress_bar, show_tables, ticker
from studies.core.console import console
from studies.core.folder import to_json
from studies.core.options import HardwareOptions, RobotOptions, show_differences
from studies.core.study_options import SeedOptions, ThreadOptions, check_threads
from studies.core.table import Column, Table
from studies.core.text import spelled
from studies.experiment.coverage import Covered, Draws, coverage
from studies.experiment.inside import Bounds, Tried, largest
from studies.experiment.synthetic import logged, sigmas
from studies.experiment.torques import Band, shapes
from studies.identify.names import free_numbers
from studies.identify.residuals import Problem
from studies.identify.simulated import Model, other_of, require_built, searched_as
from studies.identify.telling import Told, together_words, told_by

HEADER = "t,tau1,tau2"
WHAT = "the torques"
DURATION_MOST = 600.0  # [s]


@dataclass(frozen=True, kw_only=True)
class ExperimentConfig(ThreadOptions, SeedOptions, HardwareOptions, RobotOptions):
    """Write torques that tell numbers of the robot, and predict how well."""

    PANEL: ClassVar = headings.MAIN

    free: str
    """Numbers to be identified, with commas between, as in flexsim identify."""
    kind: Literal["step", "impulse", "chirp", "multisine", "friction-ramp"] = "multisine"
    """Shape of the torques; none leaves a net push."""
    torques: tuple[float, float] = (1.0, 0.2)
    """Largest torques asked for at the joints [N m]; scaled down until the arm stays inside."""
    duration: float = 5.0
    """Length [s]."""
    band: tuple[float, float] = (0.4, 15.0)
    """Frequencies of chirp and multisine [Hz]."""
    theta1: float = 0.0
    """Joint angle at rest at the start [rad]."""
    theta2: float = 1.2
    """Joint angle at rest at the start [rad]."""
    theta1_range: tuple[float, float] = (-1.0, 1.0)
    """Where joint 1 may go [rad]."""
    theta2_range: tuple[float, float] = (0.2, 2.6)
    """Where joint 2 may go [rad]."""
    v_most: float = 0.02
    """Largest tip deflection [m]."""
    period: float = PERIOD
    """Control period [s]."""
    plant: str = "assumed-modes"
    """Model that the torques are tried on: a plant's name as in flexsim drive."""
    setting: str = "none"
    """Friction, limits and motors: none, simulink, jump, opposing, stribeck, lugre or
    reconstructed."""
    hardware: str = "bench"
    """Whose noise the logs will have: bench, or ideal but for --hardware-counts and the like."""
    check: int = 0
    """Draws of the numbers whose logs, of the other model, are identified on this one."""
    check_plant: str | None = None
    """With --check, the plant of the logs; the other model's unless given."""
    spread: float = 0.2
    """With --check, how far the draws are from the nominal numbers, as a share [-]."""
    out: Path | None = None
    """CSV file of the torques to write, as flexsim drive takes it; without one none is."""
    force: bool = False
    """Overwrite the file that is there."""
    json: bool = False
    """Print one JSON object instead of the tables."""


@dataclass(frozen=True)
class Predicted:
    """A number: the standard errors that logs will leave, the others known, and not [-]."""

    name: str
    unit: str
    nominal: float
    alone: float
    error: float

    @property
    def told(self) -> str:
        """Whether the logs will tell it."""
        return "yes" if np.isfinite(self.error) and self.error < 0.5 else "no"


@dataclass(frozen=True, eq=False)
class Result:
    """What torques will tell."""

    tried: Tried
    told: Told
    rows: list[Predicted]
    covered: list[Covered]
    failed: list[str]
    made_on: str


ROWS = (
    Column("name", "number"),
    Column("nominal", form=".5g"),
    Column("unit", "unit"),
    Column("alone", "others known", "%", ".2g", scale=100),
    Column("error", "standard error", "%", ".2g", scale=100),
    Column("told"),
)
COVERED = (
    Column("name", "number"),
    Column("inside", "inside", form=lambda row: f"{row.inside} of {row.draws}"),
    Column("share_low", "95 %", form=lambda row: f"{row.share_low:.2f} to {row.share_high:.2f}"),
    Column("half", "half-width", "%", ".2g", scale=100),
    Column("error", "error, median", "%", ".2g", scale=100),
    Column("worst", "largest", "%", ".2g", scale=100),
)


def run(config: ExperimentConfig, progress: Any = None) -> Result:
    """Return torques that keep the arm inside, and what they will tell.

    Raises:
        ParameterError: options out of range, torques that no share of keeps the arm inside.
    """
    _require_usable(config)
    robot, chosen = config.robot_of(), setting(config.setting, config.built)
    free = free_numbers(config.free, robot, chosen)
    model = Model(robot, searched_as(config.plant), chosen, free)
    require_built(model)
    rows = round(config.duration / config.period)
    shape = shapes(config.kind, config.period * np.arange(rows, dtype=float), Band(*config.band))
    bounds = Bounds(config.theta1_range, config.theta2_range, config.v_most)
    theta = (config.theta1, config.theta2)
    tried = largest(model, shape * np.array(config.torques), bounds, theta, config.period)
    told = _told(config, model, tried)
    predicted = [
        Predicted(each.name, each.unit, each.nominal, float(alone), float(error))
        for each, alone, error in zip(free, told.alone, told.together, strict=True)
    ]
    made_on = config.check_plant or other_of(model.plant)
    covered, failed = _checked(config, model, tried, made_on, progress)
    return Result(tried, told, predicted, covered, failed, made_on)


def _require_usable(config: ExperimentConfig) -> None:
    check_threads(config.threads)
    if not (0 < config.period < np.inf and 0 < config.duration <= DURATION_MOST):
        raise ParameterError(
            f"duration is {config.duration:g} s in periods of {config.period:g} s; give more than "
            f"0, up to {DURATION_MOST:g} s"
        )
    if config.duration / config.period < 100:
        raise ParameterError(
            f"{config.duration:g} s are fewer than 100 periods of {config.period:g} s; give a "
            "longer --duration"
        )
    if not all(0 <= each < np.inf for each in config.torques) or not any(config.torques):
        raise ParameterError(
            f"torques are {config.torques} N m; give two finite numbers, 0 or more, not both 0"
        )
    for name in ("theta1_range", "theta2_range"):
        low, high = getattr(config, name)
        if not low < high:
            raise ParameterError(
                f"--{name.replace('_', '-')} is {low:g} to {high:g} rad; give low < high"
            )
    if not config.v_most > 0:
        raise ParameterError(f"--v-most is {config.v_most:g} m; give more than 0")
    if config.check < 0:
        raise ParameterError(f"check is {config.check}; give 0 or more draws")
    if not 0 <= config.spread < 1:
        raise ParameterError(f"spread is {config.spread:g}; give a share from 0, below 1")


def _told(config: ExperimentConfig, model: Model, tried: Tried) -> Told:
    """Return what a log of the nominal arm would tell."""
    record = logged(tried.motion, tried.torque, config.period)
    threads = thread_count() if config.threads is None else config.threads
    problem = Problem(model, (record,), (sigmas(record),), "rest", threads)
    z = problem.beginning()
    z[problem.own :] = np.array([config.theta1, config.theta2]) - record.resting()
    return told_by([each.name for each in model.free], problem.jacobian(z))


def _checked(
    config: ExperimentConfig, model: Model, tried: Tried, made_on: str, progress: Any
) -> tuple[list[Covered], list[str]]:
    if not config.check:
        return [], []
    threads = thread_count() if config.threads is None else config.threads
    return coverage(
        model,
        made_on,
        tried.torque,
        (config.theta1, config.theta2),
        config.period,
        Draws(config.check, config.spread, config.seed),
        threads,
        ticker(progress, "draws", config.check),
    )


def written(torque: Array, period: float) -> str:
    """Return torques (K, 2) as CSV; numbers read back to the same doubles."""
    lines = [
        f"{period * k:.9g},{first!r},{second!r}"
        for k, (first, second) in enumerate(torque.tolist())
    ]
    return "\n".join([HEADER, *lines, ""])


def tables(config: ExperimentConfig, result: Result) -> Sequence[Table]:
    """Return the tables."""
    title = f"What a log under this {config.kind} will tell, {config.built.words()}"
    shown = [Table(result.rows, ROWS, title)]
    if result.covered:
        title = f"Logs of {result.made_on}, identified on {config.plant}"
        shown.append(Table(result.covered, COVERED, title))
    return shown


def verdict(config: ExperimentConfig, result: Result) -> str:
    """Return the answer in words."""
    first, second = np.abs(result.tried.torque).max(axis=0)
    parts = [
        f"Torques up to {first:.3g} and {second:.3g} N m, {100 * result.tried.scale:.3g} % of what "
        f"was asked for: v reaches {1e3 * np.abs(result.tried.motion.v).max():.3g} mm."
    ]
    if result.told.silent:
        parts.append(f"They do not tell {', '.join(result.told.silent)}.")
    parts += [f"{together_words(group)}." for group in result.told.groups]
    if result.failed:
        parts.append(f"{len(result.failed)} draws were not identified, as {result.failed[0]}.")
    return " ".join(parts)


def content(config: ExperimentConfig, result: Result) -> dict[str, Any]:
    """Return the JSON object."""
    first, second = np.abs(result.tried.torque).max(axis=0)
    return {
        "kind": config.kind,
        "torques": [first, second],
        "scale": result.tried.scale,
        "max_v": np.abs(result.tried.motion.v).max(),
        "joint_low": result.tried.motion.joint.min(axis=0),
        "joint_high": result.tried.motion.joint.max(axis=0),
        "numbers": {
            row.name: {k: v for k, v in asdict(row).items() if k != "name"} for row in result.rows
        },
        "silent": list(result.told.silent),
        "only_together": [[name for name, _ in group] for group in result.told.groups],
        "covered": list(map(asdict, result.covered)),
        "not_identified": result.failed,
        "plant": config.plant,
        "check_plant": result.made_on if config.check else None,
        "hardware": config.built.words(),
        "out": config.out and str(config.out),
    }


def command(config: ExperimentConfig) -> None:
    """Print what the torques will tell, and write them."""
    if config.out is not None:
        require_replaceable(config.out, WHAT, config.force)
    with progress_bar() as progress:
        result = run(config, progress)
    if config.out is not None:
        write_text(config.out, written(result.tried.torque, config.period), WHAT, config.force)
    if config.json:
        print(to_json(content(config, result)))
        return
    show_differences(config.robot_of())
    out = console()
    show_tables(tables(config, result), out)
    out.print(verdict(config, result), soft_wrap=True)
    if config.out is not None:
        rows = len(result.tried.torque)
        out.print(f"{spelled(config.out)}: {rows} rows every {1e3 * config.period:g} ms")
