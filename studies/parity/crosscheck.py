"""Do the two plants agree? A ladder of checks from the static beam to driven motion.

>>> [rung.name for rung in run(CrosscheckConfig()).rungs if not rung.ok]
[]
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import NamedTuple

import mujoco
import numpy as np
from rich.console import Console
from rich.table import Table

from flexsim.errors import ParameterError
from flexsim.loop.motion import Motion
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.mjcf.chain_file import mass_matrix, stiffness_matrix
from flexsim.numerics.types import Array
from flexsim.plants import assumed_modes
from flexsim.plants.base import Plant
from flexsim.plants.chain_as_modes import vibration
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.robot import Robot
from studies.core.folder import to_json
from studies.core.options import RobotOptions, show_differences
from studies.parity.modes import compared, source_of
from studies.parity.motions import BRISK, DURATION, GENTLE, POSE, trial_torque

CLAMPED_LIMIT = 1e-9  # relative: the design tunes these to rounding
CHAIN_ENERGY_LIMIT = 1e-6  # relative drift over 2 s; RK4 at 1 ms damps the highest modes
FAILED = 1  # the shell's status
STATES = 20  # random states of the acceleration rung


class Limits(NamedTuple):
    """What the figures of a robot are held to, relative but for the tips [m rms over 2 s].

    A tip of None is held to TIP_SHARE and the square of v/L, times the largest v: the equations
    keep terms of second order in v/L.
    """

    static: float
    joint_free: float
    coupling: float
    acceleration: float
    small_tip: float | None
    large_tip: float | None
    energy: float


DEFAULT_LIMITS = Limits(5e-4, 3e-4, 5e-4, 5e-3, 1e-5, 1.5e-4, 1e-11)  # the chain's design's
EDITED_LIMITS = Limits(3e-3, 2e-3, 3e-3, 5e-2, None, None, 1e-10)  # what three modes leave of a
# chain; a soft or loaded beam accelerates less, a stiff one is damped more by RK4
TIP_SHARE = 1e-3  # of v: what the modes left out do


@dataclass(frozen=True)
class CrosscheckConfig(RobotOptions):
    """Hold the assumed-modes plant and the chain against each other and against the exact beam."""

    seed: int = 1
    """Seed of the random states."""
    json: bool = False
    """Print one JSON object instead of a table."""


@dataclass(frozen=True)
class Rung:
    """One check: its figure, the limit it is held to (None: stated only) and the verdict."""

    name: str
    value: float
    limit: float | None
    ok: bool
    unit: str = "relative"


def _rung(name: str, value: float, limit: float | None = None, unit: str = "relative") -> Rung:
    return Rung(name, float(value), limit, limit is None or bool(value <= limit), unit)


@dataclass(frozen=True)
class CrosscheckResult:
    """The rungs of the ladder, from the bottom."""

    source: str
    rungs: tuple[Rung, ...]

    @property
    def ok(self) -> bool:
        """Whether every rung holds."""
        return all(rung.ok for rung in self.rungs)


def run(config: CrosscheckConfig) -> CrosscheckResult:
    """Return the ladder's figures and verdicts."""
    if config.seed < 0:
        raise ParameterError(f"seed is {config.seed}; give 0 or more")
    return checked(config.robot_of(), config.seed)


def checked(robot: Robot, seed: int = 1) -> CrosscheckResult:
    """Return the figures and verdicts of a robot's two plants.

    Raises:
        ModelError: the robot's file has too few hinges, or what no mode has.
    """
    modes, chain = robot.both()
    limits = DEFAULT_LIMITS if robot.file is None else EDITED_LIMITS
    rungs = [
        *linear_rungs(robot, limits),
        _rung(
            f"acceleration at {STATES} equal random states",
            acceleration_difference(modes, chain, STATES, seed),
            limits.acceleration,
        ),
        *driven_rungs(modes, chain, limits),
        *energy_rungs(modes, chain, limits),
    ]
    return CrosscheckResult(source_of(robot), tuple(rungs))


def linear_rungs(robot: Robot, limits: Limits) -> list[Rung]:
    """Return static deflection, frequencies and couplings of the chain against the exact beam.

    An edited file's beam has no exact solution; there the assumed modes take its place.
    """
    found = compared(robot)
    other = "exact" if robot.file is None else "assumed_modes"
    spoken = other.replace("_", " ")

    def worst(table: dict[str, Array]) -> float:
        return float(np.abs(table["chain"] / table[other] - 1).max())

    static = found.static_compliance["chain"] / found.static_compliance[other] - 1
    clamped = f"clamped frequencies 1-3, chain to {spoken}"
    couplings = max(worst(each) for each in found.couplings.values())
    return [
        _rung(f"static tip deflection, chain to {spoken}", abs(static), limits.static),
        _rung(clamped, worst(found.clamped_hz), CLAMPED_LIMIT),
        _rung("joint-free frequencies 1-3", worst(found.joint_free_hz), limits.joint_free),
        _rung("couplings and tip values 1-3", max(couplings, abs(static)), limits.coupling),
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
        data.qpos[:], data.qvel[:] = W @ q, W @ w
        mujoco.mj_forward(model, data)
        force = -data.qfrc_bias - K @ (W @ q) - model.dof_damping * (W @ w)
        force[:2] += tau * (p.r_1, p.r_2)
        M = W.T @ mass_matrix(model, W @ q) @ W
        b = np.linalg.solve(M, W.T @ force)
        worst = max(worst, float(np.abs(a - b).max() / np.abs(a).max()))
    return worst


def _modal_basis(chain: ChainPlant, n: int) -> Array:
    """Return W (nv, n+2): joint and hinge coordinates of theta1, theta2 and n modal coordinates."""
    W = np.zeros((chain.chain.model.nv, n + 2))
    W[:2, :2] = np.eye(2)
    W[2:, 2:] = vibration(chain.chain, chain.parameters, n).hinges
    return W


def tip_difference(first: Motion, second: Motion) -> float:
    """Return the rms distance of two tips over their common samples [m]."""
    return float(np.sqrt(np.mean(np.sum((first.tip - second.tip) ** 2, axis=1))))


def driven_rungs(modes: AssumedModesPlant, chain: ChainPlant, limits: Limits) -> list[Rung]:
    """Return the open-loop tip difference under the same torques at two amplitudes."""
    rungs = []
    for label, scale, limit in (
        ("small", 1.0, limits.small_tip),
        ("large", 4.0, limits.large_tip),
    ):
        torque = trial_torque(scale)
        motions = [drive(plant, setting("none"), torque, theta=POSE) for plant in (modes, chain)]
        v = float(np.abs(motions[0].v).max())
        name = f"open loop 2 s, {label} torques (|v| to {1e3 * v:.0f} mm): tip, rms"
        allowed = v * (TIP_SHARE + (v / modes.parameters.L) ** 2) if limit is None else limit
        rungs.append(_rung(name, tip_difference(*motions), allowed, "m"))
    return rungs


def energy_drift(plant: Plant, rates: tuple[float, float]) -> float:
    """Return the largest relative change of energy in 2 s of free, unforced motion.

    The plant's joints must be frictionless; it starts at POSE with joint rates [rad/s], beam
    straight.
    """
    state = plant.rest_state(POSE)
    state[len(state) // 2 :][:2] = rates
    still = np.zeros((round(DURATION / 1e-3), 2))
    motion = drive(plant, setting("none"), still, state=state)
    return float(np.abs(motion.energy / motion.energy[0] - 1).max())


def energy_rungs(modes: AssumedModesPlant, chain: ChainPlant, limits: Limits) -> list[Rung]:
    """Return drifts of energy in free, undamped motion: consistent, printed, chain."""
    consistent = modes.undamped()
    printed = replace(consistent, form="printed")
    chain = chain.undamped()
    step = f"step {1e3 * chain.step:g} ms"
    return [
        _rung(
            "energy, free motion 2 s: assumed modes, gentle",
            energy_drift(consistent, GENTLE),
            limits.energy,
        ),
        _rung("  printed equations, gentle (stated)", energy_drift(printed, GENTLE)),
        _rung(
            f"  chain, gentle, {step}",
            energy_drift(chain, GENTLE),
            CHAIN_ENERGY_LIMIT,
        ),
        _rung("  assumed modes, brisk (stated)", energy_drift(consistent, BRISK)),
        _rung("  printed equations, brisk (stated)", energy_drift(printed, BRISK)),
        _rung(f"  chain, brisk, {step} (stated)", energy_drift(chain, BRISK)),
    ]


def command(config: CrosscheckConfig) -> None:
    """Print the ladder; a rung that fails makes it the shell's status 1."""
    result = run(config)
    if config.json:
        rungs = [asdict(rung) for rung in result.rungs]
        print(to_json({"source": result.source, "ok": result.ok, "rungs": rungs}))
    else:
        console = Console()
        show_differences(config.robot_of())
        console.print(rung_table(result))
        console.print(remarks(config.robot_of()), highlight=False, end="")
    if not result.ok:
        raise SystemExit(FAILED)


def remarks(robot: Robot) -> str:
    """Return what to know of a file before a rung that fails is blamed on the models."""
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


def rung_table(result: CrosscheckResult) -> Table:
    """Return a row per rung."""
    table = Table(title=f"Parity ladder: {result.source}", title_justify="left")
    table.add_column("rung")
    table.add_column("figure", justify="right")
    table.add_column("limit", justify="right")
    table.add_column("verdict")
    for rung in result.rungs:
        unit = " m" if rung.unit == "m" else ""
        limit = "" if rung.limit is None else f"{rung.limit:.1e}{unit}"
        verdict = "" if rung.limit is None else "holds" if rung.ok else "FAILS"
        table.add_row(rung.name, f"{rung.value:.2e}{unit}", limit, verdict)
    return table
