"""Do the two plants agree? Checks from the static beam to driven motion, each on the last.

>>> [check.name for check in run(CrosscheckConfig()).checks if not check.ok]
[]
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np

from flexsim.arm.beam import MODES
from flexsim.arm.parameters import Parameters
from flexsim.errors import DivergenceError, FlexsimError, ParameterError
from flexsim.loop.beyond import beyond
from flexsim.loop.metrics import rms_distance
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.mjcf.beams.beam_of import StandsFor
from flexsim.mjcf.chain_file import mass_matrix, stiffness_matrix
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.dense import product, solve
from flexsim.numerics.types import Array
from flexsim.plants import assumed_modes
from flexsim.plants.base import Plant
from flexsim.plants.chain_as_modes import vibration
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
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
    Limits,
    beam_checks,
    check,
    limits_beside,
    model_checks,
    tried,
)
from studies.parity.closed_form import parted
from studies.parity.motions import AMPLITUDES, BRISK, DURATION, GENTLE, POSE, fitting_torque
from studies.parity.side_by_side import source_of, stands_for

CHAIN_ENERGY_LIMIT = 1e-6  # relative drift over 2 s; RK4 at 1 ms damps the highest modes
FAILED = 1  # the shell's status
STATES = 20  # random states of the acceleration check
TIP_SHARE = 1e-3  # of v: what the modes left out do


@dataclass(frozen=True)
class CrosscheckConfig(RobotOptions):
    """Hold the assumed-modes plant and the chain against each other and against the exact beam."""

    seed: int = 1
    """Seed of the random states."""
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
        return tuple(each.beyond for each in self.checks if each.beyond)

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(each.ok for each in self.checks)


def run(config: CrosscheckConfig) -> CrosscheckResult:
    """Return figures and verdicts."""
    if config.seed < 0:
        raise ParameterError(f"seed is {config.seed}; give 0 or more")
    return checked(config.robot_of(), config.seed)


def checked(robot: Robot, seed: int = 1) -> CrosscheckResult:
    """Return the figures and verdicts of a robot's two plants; a check that cannot be made fails.

    Raises:
        ModelError: the robot's file has too few hinges, or what no mode has.
    """
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
    checks += tried("closed chain to MuJoCo's", lambda: closed_checks(chain, seed))
    return CrosscheckResult(source_of(robot), tuple(checks), remarks(robot, stands))


def closed_checks(chain: ChainPlant, seed: int) -> list[Check]:
    """Return how far the chain's closed form and `mj_step` part."""
    parting = parted(chain, seed)
    return [check(parting.name, parting.apart, parting.limit, "rad")]


def motion_checks(
    modes: AssumedModesPlant, chain: ChainPlant, limits: Limits, seed: int, left_out: float = 0.0
) -> list[Check]:
    """Return what both plants do under the same torques, and what becomes of their energy."""
    name = f"acceleration at {STATES} equal random states"

    def at_random_states() -> list[Check]:
        apart = acceleration_difference(modes, chain, STATES, seed)
        return [check(name, apart, limits.acceleration)]

    return [
        *tried(name, at_random_states),
        *tried("open loop", lambda: driven_checks(modes, chain, limits, left_out)),
        *tried("energy", lambda: energy_checks(modes, chain, limits)),
    ]


def acceleration_difference(
    modes: AssumedModesPlant, chain: ChainPlant, states: int, seed: int
) -> float:
    """Return the largest difference of accelerations at equal states, relative to the largest.

    A state of the assumed modes is given to the chain through the chain's own modes, and the
    chain's equations are taken in the same coordinates (Galerkin), so that both solve for
    theta1, theta2 and the modal accelerations under the same torques.
    """
    rng = np.random.default_rng(seed)
    n = modes.modes
    W = _modal_basis(chain, n)  # (nv, n+2)
    model = chain.chain.model
    data = mujoco.MjData(model)
    K = stiffness_matrix(model)
    p = modes.coefficients
    worst = 0.0
    for _ in range(states):
        q = np.concatenate([rng.uniform(-2, 2, 2), rng.normal(size=n) * [5e-3, 5e-4, 5e-5][:n]])
        w = np.concatenate([rng.uniform(-1, 1, 2), rng.normal(size=n) * [5e-2, 2e-2, 5e-3][:n]])
        tau = rng.uniform(-1, 1, 2) * (0.5, 0.05)
        a, work = np.empty(n + 2), np.empty(n)
        assumed_modes.acceleration(p, q, w, *tau, a, work)
        data.qpos[:], data.qvel[:] = product(W, q), product(W, w)
        mujoco.mj_forward(model, data)
        force = -data.qfrc_bias - product(K, data.qpos) - model.dof_damping * data.qvel
        force[:2] += tau * (p.r_1, p.r_2)
        M = product(W.T, product(mass_matrix(model, data.qpos), W))
        b = solve(M, product(W.T, force))
        worst = max(worst, float(np.abs(a - b).max() / np.abs(a).max()))
    return worst


def _modal_basis(chain: ChainPlant, n: int) -> Array:
    """Return W (nv, n+2): joint and hinge coordinates of theta1, theta2 and n modal coordinates."""
    W = np.zeros((chain.chain.model.nv, n + 2))
    W[:2, :2] = np.eye(2)
    W[2:, 2:] = vibration(chain.chain, chain.parameters, n).hinges
    return W


def driven_checks(
    modes: AssumedModesPlant, chain: ChainPlant, limits: Limits, left_out: float = 0.0
) -> list[Check]:
    """Return the open-loop tip difference under the same torques at two amplitudes.

    left_out: how far the modes' joint-free frequencies are off those of the beam, relative.
    """
    checks = []
    for (label, scale), limit in zip(
        AMPLITUDES.items(), (limits.small_tip, limits.large_tip), strict=True
    ):
        try:
            torque = fitting_torque(modes, scale)
            motions = [
                drive(plant, setting("none"), torque, theta=POSE) for plant in (modes, chain)
            ]
        except DivergenceError as error:
            checks.append(check(f"open loop 2 s, {label} torques: {error}", np.inf, 0.0, "m"))
            continue
        v = float(np.abs(motions[0].v).max())
        name = f"open loop 2 s, {label} torques (|v| to {1e3 * v:.0f} mm): tip, rms"
        allowed = (
            v * (TIP_SHARE + left_out + (v / modes.parameters.L) ** 2) if limit is None else limit
        )
        apart = rms_distance(motions[0].tip, motions[1].tip)
        beyond_it = " ".join(beyond(modes.name, v, modes.parameters.L))
        checks.append(replace(check(name, apart, allowed, "m"), beyond=beyond_it))
    return checks


def energy_drift(plant: Plant, rates: tuple[float, float]) -> float:
    """Return the largest relative change of energy in 2 s of free, unforced motion, inf of none.

    The plant's joints must be frictionless; it starts at POSE with joint rates [rad/s], beam
    straight.
    """
    state = plant.rest_state(POSE)
    state[len(state) // 2 :][:2] = rates
    still = np.zeros((round(DURATION / PERIOD), 2))
    try:
        motion = drive(plant, setting("none"), still, state=state)
    except DivergenceError:
        return np.inf
    return float(np.abs(motion.energy / motion.energy[0] - 1).max())


def energy_checks(modes: AssumedModesPlant, chain: ChainPlant, limits: Limits) -> list[Check]:
    """Return drifts of energy in free, undamped motion: consistent, printed, chain."""
    consistent = modes.undamped()
    printed = replace(consistent, form="printed")
    chain = chain.undamped()
    step = f"step {1e3 * chain.step:g} ms"
    own, chains = energy_drift(consistent, GENTLE), energy_drift(chain, GENTLE)
    held: float | None = CHAIN_ENERGY_LIMIT
    if chain.step >= chain.chain.longest_step():  # which only its dampers allow
        held, step = None, f"{step}, too long without dampers"
    return [
        check("energy, free motion 2 s: assumed modes, gentle", own, limits.energy),
        check("  printed equations, gentle (stated)", energy_drift(printed, GENTLE)),
        check(f"  chain, gentle, {step}", chains, held),
        check("  assumed modes, brisk (stated)", energy_drift(consistent, BRISK)),
        check("  printed equations, brisk (stated)", energy_drift(printed, BRISK)),
        check(f"  chain, brisk, {step} (stated)", energy_drift(chain, BRISK)),
    ]


def remarks(robot: Robot, stands: StandsFor) -> str:
    """Return what to know of a file before a check that fails is blamed on the models."""
    return _stepped(robot) + "".join(f"Note: {spelled(each)}\n" for each in stands.remarks)


def _stepped(robot: Robot) -> str:
    """Return what a chain's integrator does to the figures, if it is not RK4."""
    if robot.file is None:
        return ""
    integrator = mujoco.mjtIntegrator(robot.file.model.opt.integrator)
    if integrator == mujoco.mjtIntegrator.mjINT_RK4:
        return ""
    name = integrator.name.removeprefix("mjINT_")
    return (
        f"The chain is stepped by {name} at {1e3 * robot.file.step:g} ms: its error in time is in "
        "the driven motions and the energy, too; RK4 has hardly any.\n"
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
