"""Plants as objects: what studies hold, start, run and look into.

    >>> from flexsim import AssumedModesPlant, ChainPlant, Parameters
    >>> plant = AssumedModesPlant(Parameters(), modes=3, step=1e-3)

All have the same attributes: `name`, `step` [s], `parameters`, `compiled(threads)`,
`rest_state(theta)` and `observe(states)`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any, Protocol

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from flexsim import assumed_modes, printed
from flexsim.assumed_modes import AssumedModes
from flexsim.beam import mode_shapes
from flexsim.chain import Chain, ChainModel, Workspaces, load_chain, longest_step
from flexsim.chain_design import design_chain, plain_chain
from flexsim.chain_modes import modes_of_chain, parameters_of, vibration
from flexsim.errors import ParameterError
from flexsim.kinematics import tip_position
from flexsim.mjcf import chain_mjcf
from flexsim.native import quiet_warnings
from flexsim.parameters import Parameters
from flexsim.printed import PrintedModes
from flexsim.step_limits import RK4_LIMIT, fastest_decay, longest_rk4_step

Array = NDArray[np.float64]

DRAWN_POINTS = 41  # along the assumed-modes beam
LONGEST_STEP = 1e-3  # [s] the control period of the paper
SHORTEST_STEP = 1e-6  # [s] at which frequencies are asked for
MARGIN = 1.05  # of a designed chain to the limit of its frequencies
POSES = np.linspace(0.0, np.pi, 5)  # [rad] of joint 2, from stretched to folded
MODES_SHOWN = 3  # modal coordinates that the chain's shape is projected on


@dataclass(frozen=True, eq=False)
class Observation:
    """What states (K, 2 m) look like: columns as in `flexsim.motion.Motion`."""

    joint: Array
    v: Array
    tip: Array
    modal: Array
    energy: Array
    beam: Array


class Plant(Protocol):
    """What the closed loop, studies and recordings ask of a plant.

    `compiled(threads)` gives coefficients that `flexsim.plants` knows by their type.
    """

    @property
    def name(self) -> str:
        """As tables and the command line name it."""

    @property
    def parameters(self) -> Parameters:
        """The robot: its lengths are those of the kinematics."""

    @property
    def step(self) -> float:
        """Physics step [s]."""

    def compiled(self, threads: int) -> AbstractContextManager[Any]:
        """Give the coefficients for compiled code, alive as long as the block runs."""

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 m,) at rest at joint angles (2,) [rad], beam straight."""

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 m) look like; energy is nan where not wanted."""


@dataclass(frozen=True)
class AssumedModesPlant:
    """The assumed-modes equations with RK4.

    Attributes:
        parameters: the robot; modes: n, 0 for a rigid second link; step: physics step [s].
        form: 'consistent' or 'printed'.
        chain: an MJCF file whose own modes and masses take the place of the parameters' beam.

    Raises:
        ParameterError: an unknown form, or a step beyond the integrator's limit.
        ModelError: the file has something that the equations do not.
    """

    parameters: Parameters = field(default_factory=Parameters)
    modes: int = 3
    step: float = 1e-3
    form: str = "consistent"
    name: str = "assumed-modes"
    chain: ChainModel | None = None

    def __post_init__(self) -> None:
        if self.form not in ("consistent", "printed"):
            raise ParameterError(f"form {self.form!r} is unknown; choose consistent or printed")
        if not 0 < self.step < np.inf:
            raise ParameterError(f"physics step is {self.step} s; give more than 0")
        if self.step >= self.longest_step:
            omega, decay = self.highest_frequency, self.fastest_decay
            damping = f" and damping at {decay:.0f} 1/s" if decay > omega else ""
            raise ParameterError(
                f"physics step {self.step:g} s is too long for RK4 with {self.modes} modes up to "
                f"{omega:.0f} rad/s{damping}; use less than {self.longest_step:.3g} s"
            )

    @classmethod
    def of_chain(cls, chain: ChainModel, modes: int = 3, **more: Any) -> AssumedModesPlant:
        """Return the plant of an MJCF file: its rigid bodies, the modes of its own chain.

        Args:
            chain: the file; modes: n. more: `step`, `form`, `name`.

        Raises:
            ParameterError, ModelError: as the plant itself.
        """
        return cls(parameters_of(chain), modes, chain=chain, **more)

    @cached_property
    def coefficients(self) -> AssumedModes:
        """Coefficients of the consistent equations."""
        if self.chain is not None:
            return modes_of_chain(self.chain, self.modes, self.step)
        return assumed_modes.assumed_modes(self.parameters, self.modes, self.step)

    @property
    def highest_frequency(self) -> float:
        """Highest natural frequency with both joints free [rad/s], over poses of joint 2."""
        p = self.coefficients
        found = [assumed_modes.free_frequencies(p, pose).max(initial=0.0) for pose in POSES]
        return float(max(found))

    @property
    def fastest_decay(self) -> float:
        """Largest |lambda| of damped motions with both joints free [1/s], 0 without any."""
        p = self.coefficients
        D = block_diag(np.diag([p.F_1, p.F_2]), p.damping)
        K = np.diag(np.concatenate([[0.0, 0.0], p.stiffness]))
        still = np.zeros(self.modes)
        return fastest_decay(
            (assumed_modes.mass_matrix(p, np.array([0.0, pose, *still])), D, K) for pose in POSES
        )

    @property
    def longest_step(self) -> float:
        """Step below which RK4 is stable near rest [s]."""
        return longest_rk4_step(self.highest_frequency, self.fastest_decay)

    @cached_property
    def drawn(self) -> tuple[Array, Array]:
        """Points along the hub's axis (P,) [m] and the modes' displacements there (P, n)."""
        if self.chain is not None:
            c = self.chain
            along = np.concatenate([[c.clamp], c.root + np.append(0.0, np.cumsum(c.lengths))])
            return along, vibration(c, self.parameters, self.modes).shapes
        x = np.linspace(0.0, 1.0, DRAWN_POINTS)
        shapes = mode_shapes(self.modes, x) if self.modes else np.zeros((DRAWN_POINTS, 0))
        return self.parameters.r + x * self.parameters.L, shapes

    @contextmanager
    def compiled(self, threads: int) -> Iterator[AssumedModes | PrintedModes]:
        """Give the coefficients for compiled code."""
        consistent = self.coefficients
        yield printed.printed_modes(consistent) if self.form == "printed" else consistent

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 (n+2),) at rest at joint angles (2,) [rad], beam straight."""
        state = np.zeros(2 * (self.modes + 2))
        state[:2] = theta
        return state

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 (n+2)) look like; energy is nan where not wanted."""
        p, n = self.coefficients, self.modes
        eta = states[:, 2 : 2 + n]
        v = eta @ p.tip
        shortening = -np.einsum("ki,ij,kj->k", eta, p.slope, eta) / 2
        along, shapes = self.drawn
        across = eta @ shapes.T  # (K, P)
        return Observation(
            joint=states[:, :2].copy(),
            v=v,
            tip=tip_position(self.parameters, states[:, :2], v, shortening),
            modal=eta.copy(),
            energy=assumed_modes.energy(p, states) if energy else np.full(len(states), np.nan),
            beam=_in_world(
                self.parameters.L_R, states[:, :2], np.broadcast_to(along, across.shape), across
            ),
        )


@dataclass(frozen=True, eq=False)
class ChainPlant:
    """The MuJoCo chain, stepped by `mj_step`.

    Attributes:
        parameters: the robot, for its beam's modes and reach; chain: the checked MJCF.
    """

    parameters: Parameters
    chain: ChainModel
    name: str = "chain"

    @classmethod
    def designed(
        cls,
        parameters: Parameters,
        segments: int = 6,
        step: float | None = None,
        tuned: bool = True,
        name: str = "chain",
    ) -> ChainPlant:
        """Return the chain of a robot, as `flexsim chain` writes it.

        Args:
            parameters: the robot; segments: N.
            step: physics step [s]; None for 1 ms, halved until RK4 can take it.
            tuned: whether positions and stiffnesses of the hinges are. name: of the plant.

        Raises:
            ParameterError, ModelError: segments or step out of range.
        """
        design = (design_chain if tuned else plain_chain)(parameters, segments)
        if step is None:
            model = mujoco.MjModel.from_xml_string(chain_mjcf(parameters, design))
            bound = RK4_LIMIT / (MARGIN * design.frequency[-1])
            step = halved(min(bound, longest_step(model) or math.inf))
        text = chain_mjcf(parameters, design, timestep=step)
        return cls(parameters, load_chain(text=text), name)

    @property
    def step(self) -> float:
        """Physics step, the file's timestep [s]."""
        return self.chain.step

    @contextmanager
    def compiled(self, threads: int) -> Iterator[Chain]:
        """Give addresses for compiled code, alive and quiet as long as the block runs."""
        c = self.chain
        workspaces = Workspaces(c.model, threads)
        with quiet_warnings():
            yield Chain(c.model._address, workspaces.addresses, c.L_R, c.root, c.lengths, c.step)

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 nq,) at rest at joint angles (2,) [rad], beam straight."""
        state = np.zeros(2 * self.chain.model.nq)
        state[:2] = theta
        return state

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 nq) look like; modal: the shape projected on the modes (15)."""
        c, nq = self.chain, self.chain.model.nq
        along, across = self.shape(states)  # (K, N+2) clamp, hinges, tip
        theta = states[:, :2]
        return Observation(
            joint=theta.copy(),
            v=across[:, -1].copy(),
            tip=_in_world(c.L_R, theta, along[:, -1:], across[:, -1:])[:, 0],
            modal=across @ self.projection(MODES_SHOWN).T,
            energy=_energies(c.model, states[:, :nq], states[:, nq:])
            if energy
            else np.full(len(states), np.nan),
            beam=_in_world(c.L_R, theta, along, across),
        )

    def shape(self, states: Array) -> tuple[Array, Array]:
        """Return positions along and across the hub's axis (K, N+2) of clamp, hinges, tip [m]."""
        c = self.chain
        angle = np.cumsum(states[:, 2 : c.model.nq], axis=1)
        ends = np.zeros((len(states), 2))
        along = np.hstack(
            [ends + np.array([c.clamp, c.root]), c.root + np.cumsum(c.lengths * np.cos(angle), 1)]
        )
        across = np.hstack([ends, np.cumsum(c.lengths * np.sin(angle), axis=1)])
        return along, across

    def projection(self, n: int) -> Array:
        """Return the matrix (n, N+2) from transverse positions to modal coordinates.

        eta_i = (1/L) int chi_i v dx of the polyline v through clamp, hinges and tip.
        """
        c = self.chain
        nodes = np.concatenate([[0.0], c.hinges, [c.reach - c.clamp]])
        node, weight = np.polynomial.legendre.leggauss(24)
        matrix = np.zeros((n, len(nodes)))
        length = nodes[-1]
        for j, (start, end) in enumerate(pairwise(nodes)):
            u = (node + 1) / 2
            weighted = weight[:, None] / 2 * (end - start) / length
            chi = weighted * mode_shapes(n, (start + u * (end - start)) / length)
            matrix[:, j] += (1 - u) @ chi
            matrix[:, j + 1] += u @ chi
        return matrix


def stable_modes_step(parameters: Parameters, modes: int, chain: ChainModel | None = None) -> float:
    """Return 1 ms, halved until RK4 can take the assumed modes with free joints [s]."""
    plant = AssumedModesPlant(parameters, modes, SHORTEST_STEP, chain=chain)
    return halved(plant.longest_step)


def halved(longest: float) -> float:
    """Return 1 ms, halved until it is below the longest step [s]."""
    step = LONGEST_STEP
    while step >= longest:
        step /= 2
    return step


def _in_world(L_R: float, theta: Array, along: Array, across: Array) -> Array:
    """Return world positions (K, P, 2) [m] of points given in the hub's frame (K, P)."""
    first, second = theta[:, :1], theta[:, :1] + theta[:, 1:2]
    return np.stack(
        [
            L_R * np.cos(first) + along * np.cos(second) - across * np.sin(second),
            L_R * np.sin(first) + along * np.sin(second) + across * np.cos(second),
        ],
        axis=-1,
    )


def _energies(model: mujoco.MjModel, qpos: Array, qvel: Array) -> Array:
    """Return kinetic plus elastic energy (K,) [J]."""
    data = mujoco.MjData(model)
    full = np.zeros((model.nv, model.nv))
    energies = np.empty(len(qpos))
    for k, (q, w) in enumerate(zip(qpos, qvel, strict=True)):
        data.qpos[:] = q
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, full)
        energies[k] = w @ full @ w / 2 + model.jnt_stiffness @ (q - model.qpos_spring) ** 2 / 2
    return energies
