"""What do MuJoCo's integrators and step sizes do to the chain? Part of `flexsim ladder`.

    >>> row = integrator_row(chain_plant, "RK4", 1e-3, reference)
    >>> row.modal.frequency_shift      # of modes 1 to 3

What a step does to a mode is read from the one-step map: finite differences of `mj_step` about
rest with the hub locked, whose eigenvalues exp(s h) are compared with those of the equations of
motion. Theory of an undamped oscillator at z = omega h: RK4 shifts its frequency by -z^4/120 and
damps it by z^5/144; semi-implicit Euler shifts by +z^2/24 and damps nothing; `discrete`, implicit
in the spring too, damps by z/2. `implicitfast` is implicit in the dampers' and motors' forces only,
so on a chain without dampers it is Euler. All combine with hinges, springs and dampers; what
`discrete` refuses (PGS with flexes, sleep without islands) a chain does not have.
"""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from flexsim.arm.beam import MODES
from flexsim.errors import DivergenceError
from flexsim.loop.metrics import rms_distance
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.mjcf.chain_file import ChainModel, longest_step, mass_matrix
from flexsim.mjcf.edits import INTEGRATORS, stepped
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.eigenvalues import eigenvalues
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.state_matrix import state_matrix
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from studies.ladder.rows import IntegratorRow, ModalFigures
from studies.parity.motions import AMPLITUDES, BRISK, POSE, trial_torque

STEPS = (1e-4, 2.5e-4, 5e-4, 1e-3, 2e-3)  # [s]
QUICK_STEPS = (2.5e-4, 1e-3, 2e-3)
FINER = 5  # steps of RK4 in the shortest: what all are held against
HOLD = 2e-3  # [s] that the torque is held: as long as the longest step, so that all have the same
LOCKED = 1e9  # [kg m2] armature that locks a joint: frequencies move by 1e-11
AMPLITUDE = 2e-4  # [rad] of the differences: rounding is 1e-12 of it, truncation of order 4 1e-15
GROWTH = 1e-8  # of |exp(s h)| over 1 that is no rounding


def frequencies(plant: Plant) -> tuple[Array, Array]:
    """Return the first three frequencies (3,), (3,) with the hub locked, with joints free [Hz].

    About the straight arm; nan where the plant has no such mode.
    """
    linear = plant.linearised(0.0)
    M, K = linear.M, linear.K
    if len(M) == 2:
        return np.full(MODES, np.nan), np.full(MODES, np.nan)
    squared = natural_modes(K[2:, 2:], M[2:, 2:])[0], natural_modes(K, M)[0][2:]
    found = np.sqrt(squared[0]), np.sqrt(squared[1])
    first, second = (
        np.pad(omega[:MODES], (0, max(0, MODES - len(omega))), constant_values=np.nan)
        for omega in found
    )
    return first / (2 * np.pi), second / (2 * np.pi)


def step_map(chain: ChainModel) -> Array:
    """Return the matrix (2N, 2N) by which `mj_step` moves hinges and rates times step, hub locked.

    Differences of fourth order about rest.
    """
    model, h = copy.copy(chain.model), chain.step
    model.dof_armature[:2] = LOCKED
    N = model.nv - 2
    rest = np.concatenate([model.qpos_spring[2:], np.zeros(N)])
    data = mujoco.MjData(model)

    def after(deviation: Array) -> Array:
        mujoco.mj_resetData(model, data)
        state = rest + deviation
        data.qpos[2:], data.qvel[2:] = state[:N], state[N:] / h
        mujoco.mj_step(model, data)
        return np.concatenate([data.qpos[2:], h * data.qvel[2:]])

    A = np.empty((2 * N, 2 * N))
    with quiet_warnings():
        for column, unit in enumerate(np.eye(2 * N)):
            one, two = AMPLITUDE * unit, 2 * AMPLITUDE * unit
            difference = 8 * (after(one) - after(-one)) - (after(two) - after(-two))
            A[:, column] = difference / (12 * AMPLITUDE)
    return A


def exact_rates(chain: ChainModel) -> Array:
    """Return the eigenvalues s (3,) of the slowest vibrations of the chain, hub locked [1/s].

    Of small motions in continuous time, dampers included; nan beyond those that swing.
    """
    model = chain.model
    qpos = np.array(model.qpos_spring)
    M = mass_matrix(model, qpos)[2:, 2:]
    D, K = np.diag(model.dof_damping[2:]), np.diag(model.jnt_stiffness[2:])
    rates: Any = eigenvalues(state_matrix(M, D, K))
    return _slowest(rates)


def _slowest(rates: Array) -> Array:
    """Return the three rates (3,) of lowest frequency among those that swing."""
    swinging = rates[rates.imag > 1e-6 * np.abs(rates)]
    lowest = swinging[np.argsort(swinging.imag)][:MODES]
    return np.pad(lowest, (0, MODES - len(lowest)), constant_values=np.nan)


def modal_figures(chain: ChainModel) -> ModalFigures:
    """Return what the chain's integrator does to its first three modes."""
    multipliers = eigenvalues(step_map(chain))
    found, exact = _slowest(np.log(multipliers + 0j) / chain.step), exact_rates(chain)
    ratios = -found.real / np.abs(found) + exact.real / np.abs(exact)
    shift = found.imag / exact.imag - 1
    return ModalFigures(shift, ratios, float(np.abs(multipliers).max()))


def open_loop_tips(plant: ChainPlant, duration: float) -> dict[str, Array]:
    """Return the tip (K, 2) [m] every HOLD under the two torques, from POSE.

    Raises:
        DivergenceError: a motion runs away.
    """
    still = setting("none")
    return {
        name: drive(plant, still, trial_torque(scale, duration, HOLD), HOLD, POSE).tip
        for name, scale in AMPLITUDES.items()
    }


def fine_plant(plant: ChainPlant, step: float) -> ChainPlant:
    """Return the chain under RK4 at a step [s], halved until RK4 can take it."""
    chain = stepped(plant.chain, "RK4", step)
    longest = longest_step(chain.model)
    if longest is not None and step >= longest:
        return fine_plant(plant, step / 2)
    return replace(plant, chain=chain)


def free_drift(plant: ChainPlant, duration: float) -> float:
    """Return the largest relative change of energy in brisk free motion, dampers taken away.

    Raises:
        DivergenceError: the motion runs away.
    """
    free = plant.undamped()
    state = free.rest_state(POSE)
    state[len(state) // 2 :][:2] = BRISK
    still = np.zeros((round(duration / HOLD), 2))
    energy = drive(free, setting("none"), still, HOLD, state=state).energy
    return float(np.abs(energy / energy[0] - 1).max())


def step_clock(chain: ChainModel, simulated: float) -> Callable[[], float]:
    """Return a function that does nothing but `mj_step` and gives the simulated time [ms]."""
    data = mujoco.MjData(chain.model)
    steps = max(1, round(simulated / chain.step))

    def once() -> float:
        mujoco.mj_resetData(chain.model, data)
        data.qvel[:2] = BRISK
        with quiet_warnings():
            mujoco.mj_step(chain.model, data, nstep=steps)
        return 1e3 * steps * chain.step

    return once


def integrator_row(
    plant: ChainPlant,
    integrator: str,
    step: float,
    fine: Mapping[str, Array],
    duration: float = 2.0,
) -> IntegratorRow:
    """Return what one integrator at one step does to the chain, without its cost.

    Args:
        plant: the chain; its own integrator and step do not matter. integrator: of INTEGRATORS.
        step: [s], HOLD a multiple of it. fine: the tips of `fine_plant`, by torque.
        duration: of motions [s].
    """
    chain = stepped(plant.chain, integrator, step)
    longest, figures = longest_step(chain.model), modal_figures(chain)
    stable = figures.radius < 1 + GROWTH and (longest is None or step < longest)
    row = IntegratorRow(integrator, step, stable, longest, figures)
    if not stable:
        return row
    moving = replace(plant, chain=chain)
    try:
        found = open_loop_tips(moving, duration)
        drift = free_drift(moving, duration)
    except DivergenceError:
        return replace(row, stable=False)
    small, large = (rms_distance(found[name], fine[name]) for name in ("small", "large"))
    return replace(row, energy_drift=drift, tip_small=small, tip_large=large)


def integrator_rows(
    plant: ChainPlant, steps: tuple[float, ...], duration: float, rounds: int
) -> list[IntegratorRow]:
    """Return a row of every integrator at every step, with the cost of bare `mj_step`s.

    Args:
        plant: the chain. steps: [s]. duration: of motions, and of what is timed [s].
        rounds: how often each is timed, in turn; the least time counts.
    """
    fine = open_loop_tips(fine_plant(plant, min(steps) / FINER), duration)
    cases = [(name, step) for name in INTEGRATORS for step in steps]
    rows = [integrator_row(plant, name, step, fine, duration) for name, step in cases]
    clocks = [step_clock(stepped(plant.chain, *case), duration / 2) for case in cases]
    best = [np.inf] * len(cases)
    for _ in range(rounds):
        for i, (row, clock) in enumerate(zip(rows, clocks, strict=True)):
            if row.stable:
                start = time.perf_counter()
                simulated = clock()
                best[i] = min(best[i], 1e6 * (time.perf_counter() - start) / simulated)
    costs = [cost if np.isfinite(cost) else None for cost in best]
    return [replace(row, us_per_ms=cost) for row, cost in zip(rows, costs, strict=True)]
