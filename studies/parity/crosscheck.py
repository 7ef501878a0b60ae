"""Do the two plants agree? Checks from the static beam to driven motion, each on the last.

>>> [check.name for check in run(CrosscheckConfig()).checks if not check.ok]
[]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexsim.arm.beam import MODES
from flexsim.arm.parameters import Parameters
from flexsim.errors import FlexsimError, ParameterError
from flexsim.mjcf.beams.beam_of import StandsFor
from flexsim.plants.chain_plant import ChainPlant
from flexsim.robot import Robot
from studies.core.carry_out import Question
from studies.core.options import RobotOptions
from studies.core.table import Column, Table, items
from studies.core.text import spelled
from studies.parity.beam_checks import (
    DEFAULT_LIMITS,
    EDITED_LIMITS,
    LEFT_OUT,
    Check,
    beam_checks,
    check,
    limits_beside,
    model_checks,
    tried,
)
from studies.parity.closed_form import parted
from studies.parity.exudyn_checks import exudyn_checks
from studies.parity.motion_checks import motion_checks
from studies.parity.side_by_side import source_of, stands_for

FAILED = 1  # the shell's status


@dataclass(frozen=True)
class CrosscheckConfig(RobotOptions):
    """Hold the assumed-modes plant and the chain against each other and against their beam."""

    seed: int = 1
    """Seed of the random states."""
    exudyn: bool = False
    """Hold a third code's beam, EXUDYN's, against the exact one and both plants, too; some ten
    seconds. It is an extra: pip install 'flexsim[exudyn]'."""
    json: bool = False
    """Print one JSON object instead of a table."""


@dataclass(frozen=True)
class CrosscheckResult:
    """The checks, the simplest first, what they are of, and what to know of it."""

    source: str
    checks: tuple[Check, ...]
    remarks: str = ""

    @property
    def beyond(self) -> tuple[str, ...]:
        """Which model was used beyond itself, a note each."""
        return tuple(dict.fromkeys(each.beyond for each in self.checks if each.beyond))

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(each.ok for each in self.checks)


def run(config: CrosscheckConfig) -> CrosscheckResult:
    """Return figures and verdicts."""
    if config.seed < 0:
        raise ParameterError(f"seed is {config.seed}; give 0 or more")
    return checked(config.robot_of(), config.seed, config.exudyn)


def checked(robot: Robot, seed: int = 1, exudyn: bool = False) -> CrosscheckResult:
    """Return the figures and verdicts of a robot's two plants; a check that cannot be made fails.

    exudyn: whether EXUDYN's beam is held against both, too.

    Raises:
        ModelError: the robot's file has too few hinges, or what no mode has.
        ParameterError: EXUDYN's beam is asked for, and there is none.
    """
    if exudyn:
        robot.plant("exudyn")  # refuses, before anything runs
    chain, stands = robot.chain_plant(), stands_for(robot)
    default = robot.given is None and robot.parameters == Parameters()
    beside = limits_beside(stands, len(chain.chain.lengths), default)
    checks = tried("chain to its beam", lambda: beam_checks(stands, chain, beside))
    try:
        modes = robot.modes_plant()
    except FlexsimError as refusal:
        checks.append(check(f"assumed modes: {refusal}", np.inf, 0.0))
    else:
        limits = DEFAULT_LIMITS if default else EDITED_LIMITS
        if robot.given is not None:
            checks += tried("models", lambda: model_checks(stands, modes, chain, limits))
        left_out = LEFT_OUT * stands.reference.truncation(MODES)
        checks += motion_checks(modes, chain, limits, seed, left_out)
        if exudyn:
            checks += exudyn_checks(robot, modes, chain, limits, default)
    checks += tried("closed chain to MuJoCo's", lambda: closed_checks(chain, seed))
    return CrosscheckResult(source_of(robot), tuple(checks), remarks(robot, stands))


def closed_checks(chain: ChainPlant, seed: int) -> list[Check]:
    """Return how far the chain's closed form and `mj_step` part."""
    parting = parted(chain, seed)
    return [check(parting.name, parting.apart, parting.limit, "rad")]


def remarks(robot: Robot, stands: StandsFor) -> str:
    """Return what to know of a file before a check that fails is blamed on the models."""
    return _stepped(robot) + "".join(f"Note: {spelled(each)}\n" for each in stands.remarks)


def _stepped(robot: Robot) -> str:
    """Return what a chain's integrator does to the figures, if it is not RK4."""
    if robot.file is None or robot.file.integrator == "RK4":
        return ""
    return (
        f"The chain is stepped by {robot.file.integrator} at {1e3 * robot.file.step:g} ms: its "
        "error in time is in the driven motions and the energy, too; RK4 has hardly any.\n"
    )


COLUMNS = (
    Column("name", "check"),
    Column("value", "figure", form=".2e"),
    Column("limit", form=".1e", missing=""),
    Column("verdict"),
)


def tables(result: CrosscheckResult) -> list[Table]:
    """Return a row per check."""
    return [
        Table(
            result.checks,
            COLUMNS,
            f"Cross-check: {spelled(result.source)}; relative, tips in m",
            tight=True,
        )
    ]


def content(result: CrosscheckResult) -> dict[str, Any]:
    """Return what `--json` prints."""
    checks = [items(each) for each in result.checks]
    return {
        "source": result.source,
        "ok": result.ok,
        "rungs": checks,
        "beyond": result.beyond,
        "remarks": result.remarks,
    }


def notes(result: CrosscheckResult) -> str:
    """Return what to know of the file, and which model was used beyond itself."""
    return result.remarks + "".join(f"Note: {each}\n" for each in result.beyond)


answer = Question(run, tables, notes, content)


def command(config: CrosscheckConfig) -> None:
    """Print the checks; one that fails makes it the shell's status 1."""
    if not answer(config).ok:
        raise SystemExit(FAILED)
