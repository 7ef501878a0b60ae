"""The checks in motion: both plants under the same torques, and what becomes of their energy.

>>> motion_checks(robot.modes_plant(), robot.chain_plant(), DEFAULT_LIMITS, seed=1)
"""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from flexsim.arm.locked import LOCKED
from flexsim.errors import DivergenceError
from flexsim.loop.beyond import beyond
from flexsim.loop.metrics import rms_distance
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.mjcf.chain_file import mass_matrix, stiffness_matrix
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.dense import product, solve
from flexsim.numerics.types import Array
from flexsim.plants import assumed_modes
from flexsim.plants.base import Plant
from flexsim.plants.chain_as_modes import vibration
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from studies.parity.beam_checks import Check, Limits, check, tried
from studies.parity.motions import (
    AMPLITUDES,
    BRISK,
    DURATION,
    GENTLE,
    POSE,
    felt_inertia,
    fitting_torque,
)

CHAIN_ENERGY_LIMIT = 1e-6  # relative drift over 2 s; RK4 at 1 ms damps the highest modes
STATES = 20  # random states of the acceleration check
TIP_SHARE = 1e-3  # of v: what the modes left out do


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
    modes: Plant, chain: Plant, limits: Limits, left_out: float = 0.0, name: str = "open loop 2 s"
) -> list[Check]:
    """Return the open-loop tip difference of two plants under the same torques, two amplitudes.

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
            checks.append(check(f"{name}, {label} torques: {error}", np.inf, 0.0, "m"))
            continue
        v = float(np.abs(motions[0].v).max())
        bent = f"{name}, {label} torques (|v| to {1e3 * v:.0f} mm): tip, rms"
        allowed = (
            v * (TIP_SHARE + left_out + (v / modes.parameters.L) ** 2) if limit is None else limit
        )
        apart = rms_distance(motions[0].tip, motions[1].tip)
        beyond_it = " ".join(beyond(modes.name, v, modes.parameters.L))
        checks.append(replace(check(bent, apart, allowed, "m"), beyond=beyond_it))
    return checks


def energy_drift(plant: Plant, rates: tuple[float, float]) -> float:
    """Return the largest relative change of energy in 2 s of free, unforced motion, inf of none.

    The plant's joints must be frictionless; it starts at POSE with joint rates [rad/s], beam
    straight.
    """
    state = plant.rest_state(POSE)
    turning = felt_inertia(plant) < LOCKED / 2  # a joint that stands still has no rate
    state[len(state) // 2 :][:2] = np.where(turning, rates, 0.0)
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
