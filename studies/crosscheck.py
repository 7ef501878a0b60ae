"""Do the two plants agree? A ladder of checks from the static beam to driven motion.

>>> [rung.name for rung in run(CrosscheckConfig()).rungs if not rung.ok]
[]
"""

from __future__ import annotations

import copy
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from flexsim import assumed_modes
from flexsim.chain import ChainModel, load_chain, mass_matrix, stiffness_matrix
from flexsim.errors import ParameterError
from flexsim.motion import Motion
from flexsim.parameters import Parameters
from flexsim.robots import AssumedModesPlant, ChainPlant
from flexsim.settings import setting
from flexsim.simulate import drive
from studies.modes import ChainModes, ModesConfig, chain_modes
from studies.modes import run as run_modes
from studies.run_folder import to_json

Array = NDArray[np.float64]

STATIC_LIMIT = 5e-4  # relative: a coupling, held to what the design promises
CLAMPED_LIMIT = 1e-9  # relative: the design tunes these to rounding
JOINT_FREE_LIMIT = 3e-4  # relative
COUPLING_LIMIT = 5e-4  # relative
ACCELERATION_LIMIT = 5e-3  # relative to the largest: couplings, and terms of third order in v
SMALL_TIP_LIMIT, LARGE_TIP_LIMIT = 1e-5, 1.5e-4  # [m] rms over 2 s
MODES_ENERGY_LIMIT = 1e-11  # relative drift over 2 s
CHAIN_ENERGY_LIMIT = 1e-6  # relative drift over 2 s; RK4 at 1 ms damps the highest modes

STATES = 20  # random states of the acceleration rung
DURATION = 2.0  # [s] of driven and free motion
GENTLE = (0.1, 0.05)  # [rad/s] initial joint rates of the free motion, beam straight
BRISK = (0.5, 0.3)  # [rad/s]
POSE = (0.0, 1.2)  # [rad]


@dataclass(frozen=True)
class CrosscheckConfig:
    """Hold the assumed-modes plant and the chain against each other and against the exact beam."""

    mjcf: Path | None = None
    """MJCF file of the chain; the default chain of 6 segments unless given."""
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
    p = Parameters()
    chain = ChainPlant(p, load_chain(config.mjcf)) if config.mjcf else ChainPlant.designed(p)
    modes = AssumedModesPlant(p)
    rungs = [
        *linear_rungs(config.mjcf),
        _rung(
            f"acceleration at {STATES} equal random states",
            acceleration_difference(modes, chain, STATES, config.seed),
            ACCELERATION_LIMIT,
        ),
        *driven_rungs(modes, chain),
        *energy_rungs(p, chain),
    ]
    return CrosscheckResult(chain.chain.source if config.mjcf else "default chain", tuple(rungs))


def linear_rungs(mjcf: Path | None) -> list[Rung]:
    """Return static deflection, frequencies and couplings of the chain against the exact beam."""
    found = run_modes(ModesConfig(mjcf))

    def worst(table: dict[str, Array]) -> float:
        return float(np.abs(table["chain"] / table["exact"] - 1).max())

    static = found.static_compliance["chain"] / found.static_compliance["exact"] - 1
    return [
        _rung("static tip deflection, chain to exact", abs(static), STATIC_LIMIT),
        _rung("clamped frequencies 1-3, chain to exact", worst(found.clamped_hz), CLAMPED_LIMIT),
        _rung("joint-free frequencies 1-3", worst(found.joint_free_hz), JOINT_FREE_LIMIT),
        _rung("couplings and tip values 1-3", found.coupling_error_max, COUPLING_LIMIT),
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
        force[:2] += tau
        M = W.T @ mass_matrix(model, W @ q) @ W
        b = np.linalg.solve(M, W.T @ force)
        worst = max(worst, float(np.abs(a - b).max() / np.abs(a).max()))
    return worst


def _modal_basis(chain: ChainPlant, n: int) -> Array:
    """Return W (nv, n+2): joint and hinge coordinates of theta1, theta2 and n modal coordinates."""
    found: ChainModes = chain_modes(chain.chain, chain.parameters, n)
    slopes = np.diff(found.shapes[1:], axis=0) / chain.chain.lengths[:, None]
    W = np.zeros((chain.chain.model.nv, n + 2))
    W[:2, :2] = np.eye(2)
    W[2:, 2:] = np.diff(slopes, axis=0, prepend=0.0)
    return W


def trial_torque(scale: float, duration: float = DURATION, period: float = 1e-3) -> Array:
    """Return (K, 2) torques scale (0.5 sin(2 pi t/0.8), 0.05 sin(2 pi t/0.5)) [N m]."""
    t = period * np.arange(round(duration / period))
    return scale * np.column_stack(
        [0.5 * np.sin(2 * np.pi * t / 0.8), 0.05 * np.sin(2 * np.pi * t / 0.5)]
    )


def tip_difference(first: Motion, second: Motion) -> float:
    """Return the rms distance of two tips over their common samples [m]."""
    return float(np.sqrt(np.mean(np.sum((first.tip - second.tip) ** 2, axis=1))))


def driven_rungs(modes: AssumedModesPlant, chain: ChainPlant) -> list[Rung]:
    """Return the open-loop tip difference under the same torques at two amplitudes."""
    rungs = []
    for label, scale, limit in (("small", 1.0, SMALL_TIP_LIMIT), ("large", 4.0, LARGE_TIP_LIMIT)):
        torque = trial_torque(scale)
        motions = [drive(plant, setting("none"), torque, theta=POSE) for plant in (modes, chain)]
        v = 1e3 * float(np.abs(motions[0].v).max())
        name = f"open loop 2 s, {label} torques (|v| to {v:.0f} mm): tip, rms"
        rungs.append(_rung(name, tip_difference(*motions), limit, "m"))
    return rungs


def energy_drift(plant: AssumedModesPlant | ChainPlant, rates: tuple[float, float]) -> float:
    """Return the largest relative change of energy in 2 s of free, unforced motion.

    The plant's joints must be frictionless; it starts at POSE with joint rates [rad/s], beam
    straight.
    """
    state = plant.rest_state(POSE)
    state[len(state) // 2 :][:2] = rates
    still = np.zeros((round(DURATION / 1e-3), 2))
    motion = drive(plant, setting("none"), still, state=state)
    return float(np.abs(motion.energy / motion.energy[0] - 1).max())


def energy_rungs(p: Parameters, chain: ChainPlant) -> list[Rung]:
    """Return drifts of energy in free, undamped motion: consistent, printed, chain."""
    free = replace(p, F_1=0.0, F_2=0.0)
    consistent = AssumedModesPlant(free)
    printed = AssumedModesPlant(free, form="printed")
    undamped = ChainPlant(free, without_damping(chain.chain))
    step = f"step {1e3 * chain.step:g} ms"
    return [
        _rung(
            "energy, free motion 2 s: assumed modes, gentle",
            energy_drift(consistent, GENTLE),
            MODES_ENERGY_LIMIT,
        ),
        _rung("  printed equations, gentle (stated)", energy_drift(printed, GENTLE)),
        _rung(
            f"  chain, gentle, {step}",
            energy_drift(undamped, GENTLE),
            CHAIN_ENERGY_LIMIT,
        ),
        _rung("  assumed modes, brisk (stated)", energy_drift(consistent, BRISK)),
        _rung("  printed equations, brisk (stated)", energy_drift(printed, BRISK)),
        _rung(f"  chain, brisk, {step} (stated)", energy_drift(undamped, BRISK)),
    ]


def without_damping(chain: ChainModel) -> ChainModel:
    """Return a copy of the chain with all joint damping zero."""
    model = copy.copy(chain.model)
    model.dof_damping[:] = 0.0
    return replace(chain, model=model)


def command(config: CrosscheckConfig) -> None:
    """Print the ladder."""
    result = run(config)
    if config.json:
        rungs = [asdict(rung) for rung in result.rungs]
        print(to_json({"source": result.source, "ok": result.ok, "rungs": rungs}))
        return
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
    Console().print(table)
