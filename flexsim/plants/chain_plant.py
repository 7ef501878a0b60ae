"""The MuJoCo chain as a plant, stepped by `mj_step`.

>>> plant = ChainPlant.designed(Parameters(), segments=6)
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from flexsim.arm.beam import mode_shapes
from flexsim.arm.kinematics import in_world
from flexsim.arm.parameters import Parameters
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.designed import designed_chain
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array
from flexsim.plants.base import MODES_SHOWN, Observation
from flexsim.plants.mujoco_steps import Chain, Workspaces


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
        return cls(parameters, designed_chain(parameters, segments, step, tuned), name)

    @property
    def step(self) -> float:
        """Physics step, the file's timestep [s]."""
        return self.chain.step

    @contextmanager
    def running(self, threads: int) -> Iterator[Chain]:
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
            tip=in_world(c.L_R, theta, along[:, -1:], across[:, -1:])[:, 0],
            modal=across @ self.projection(MODES_SHOWN).T,
            energy=_energies(c.model, states[:, :nq], states[:, nq:])
            if energy
            else np.full(len(states), np.nan),
            beam=in_world(c.L_R, theta, along, across),
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
