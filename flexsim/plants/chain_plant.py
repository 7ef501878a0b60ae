"""The MuJoCo chain as a plant, stepped by `mj_step`.

>>> plant = ChainPlant.designed(Parameters(), segments=6)

A state has joint 1 and joint 2 first, then the hinges, those of a link 1 that bends before those of
the beam.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from flexsim.arm.beam import load_of, mode_shapes
from flexsim.arm.chain_design import SEGMENTS, TUNED
from flexsim.arm.kinematics import in_world
from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError
from flexsim.mjcf.arms.one_link import designed_one_link, stands_still
from flexsim.mjcf.chain_file import (
    ChainModel,
    motor_matrix,
)
from flexsim.mjcf.designed import designed_chain
from flexsim.mjcf.edits import with_locked, without_damping
from flexsim.mjcf.reading.linear_checks import require_linear
from flexsim.numerics.dense import product
from flexsim.numerics.elementary import cos, sin
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.quadrature import gauss_legendre
from flexsim.numerics.types import Array
from flexsim.plants.base import MODES_SHOWN, Observation, Plant
from flexsim.plants.closed_form_chain import ClosedChain, closed_form
from flexsim.plants.curvature import curvature_of_chain
from flexsim.plants.linear_plant import LinearPlant
from flexsim.plants.mujoco_steps import Chain, Workspaces
from flexsim.plants.two_flexible.geometry import Bent
from flexsim.plants.two_flexible.geometry import in_world as both_in_world

GAUSS_POINTS = 24  # to a segment: modes 1 to 3 times a line, to rounding


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
        segments: int = SEGMENTS,
        step: float | None = None,
        kind: str = TUNED,
        name: str = "chain",
    ) -> ChainPlant:
        """Return the chain of a robot, as `flexsim chain` writes it.

        Args:
            parameters: the robot; segments: N.
            step: physics step [s]; None for 1 ms, halved until RK4 can take it.
            kind: how hinges and springs are chosen, of `DESIGNS`. name: of the plant.

        Raises:
            ParameterError, ModelError: segments or step out of range.
        """
        make = designed_one_link if stands_still(parameters) else designed_chain
        return cls(parameters, make(parameters, segments, step, kind), name)

    @property
    def step(self) -> float:
        """Physics step, the file's timestep [s]."""
        return self.chain.step

    @property
    def integrator(self) -> str:
        """What takes the steps, the file's `integrator`."""
        return self.chain.integrator

    @property
    def mjcf(self) -> str:
        """Text of the MJCF file."""
        return self.chain.text

    @property
    def model(self) -> mujoco.MjModel:
        """The file as MuJoCo compiled it."""
        return self.chain.model

    @cached_property
    def workspaces(self) -> Workspaces:
        """What loops step, and where."""
        return Workspaces(self.chain.model, self.chain.text)

    @contextmanager
    def running(self, threads: int) -> Iterator[Chain | ClosedChain]:
        """Give addresses for compiled code, alive and quiet as long as the block runs."""
        c, its = self.chain, self.workspaces
        with its.lent(threads) as data:
            yield Chain(
                its.model._address, data, c.L_R, c.root, c.lengths, c.step, c.second, c.link1
            )

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 nq,) at rest at joint angles (2,) [rad], beam straight."""
        state = np.zeros(2 * self.chain.model.nq)
        state[:2] = theta
        return state

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 nq) look like; modal: the shape projected on the modes (15)."""
        c, nq = self.chain, self.chain.model.nq
        along, across = self.shape(states)  # (K, N+2) clamp, hinges, tip
        link1, beam = self._in_world(states, along, across)
        return Observation(
            joint=states[:, :2].copy(),
            v=across[:, -1].copy(),
            tip=beam[:, -1].copy(),
            modal=product(across, self.projection(MODES_SHOWN).T),
            energy=_energies(c.model, *(self._in_file(each) for each in np.split(states, [nq], 1)))
            if energy
            else np.full(len(states), np.nan),
            beam=beam,
            link1=link1,
        )

    def _in_world(self, states: Array, along: Array, across: Array) -> tuple[Array | None, Array]:
        """Return link 1's nodes, if it bends, and the beam's (K, N+2, 2) in the world [m]."""
        c, theta = self.chain, states[:, :2]
        if not c.bends_twice:
            return None, in_world(c.L_R, theta, along, across)
        of_link1 = np.cumsum(states[:, 2 : c.second + 1], axis=1)  # (K, N1)
        first = Bent(*_nodes(of_link1, 0.0, float(c.link1[0]), c.link1[1:]), of_link1[:, -1])
        return both_in_world(theta, first, Bent(along, across, np.zeros(len(theta))))

    def _in_file(self, values: Array) -> Array:
        """Return values of the coordinates (..., m) in the file's order of joints."""
        if not self.chain.bends_twice:
            return values
        placed = np.empty_like(values)
        placed[..., self.chain.order] = values
        return placed

    def deflection(self, q: Array) -> tuple[Array, Array]:
        """Return the tip along and across the hub's axis (K,), (K,) at positions (K, nq) [m]."""
        along, across = self.shape(q)
        return along[:, -1], across[:, -1]

    def curvature_rows(self, places: ArrayLike) -> Array:
        """Return the rows (P, m) of the beam's curvature at places; see `Plant`."""
        bent = curvature_of_chain(self.chain, self.parameters, places)
        return np.hstack([np.zeros((len(bent), self.chain.second + 1)), bent])

    @property
    def bridge_sites(self) -> tuple[float, float] | None:
        """Places of strain bridges in the file, from the clamp [m], or None."""
        return self.chain.bridge_sites

    def linearised(self, theta2: float) -> LinearPlant:
        """Return the plant about rest at theta2 [rad], all read from the compiled MJCF.

        Raises:
            ModelError: the file has dry friction, a limit or the like, named.
        """
        c = self.chain
        require_linear(c, joint_springs=True)
        lever = np.cumsum(c.lengths[::-1])[::-1]  # from each hinge to the tip
        tip = np.concatenate([np.zeros(c.second + 1), lever])
        return LinearPlant(*c.motion(theta2), motor_matrix(c.model), tip, float(theta2))

    def needed_force(self, q: Array, w: Array, a: Array) -> Array:
        """Return the generalised forces (K, nv) that a motion needs; see `Plant`."""
        model, force = self.chain.model, np.empty_like(q)
        data, order = mujoco.MjData(model), self.chain.order
        placed = [self._in_file(each) for each in (q, w, a)]
        for k in range(len(q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = (each[k] for each in placed)
            with quiet_warnings():
                mujoco.mj_inverse(model, data)
            force[k] = data.qfrc_inverse[order]
        return force

    def undamped(self) -> Self:
        """Return the plant without friction at its joints or damping in its hinges."""
        return replace(self, chain=without_damping(self.chain))

    def locked(self, joints: Iterable[str]) -> Self:
        """Return the plant with joints that do not move; see `Plant`."""
        return replace(self, chain=with_locked(self.chain, joints))

    def shape(self, states: Array) -> tuple[Array, Array]:
        """Return positions along and across the hub's axis (K, N+2) of clamp, hinges, tip [m]."""
        c = self.chain
        angle = np.cumsum(states[:, c.second + 1 : c.model.nq], axis=1)
        return _nodes(angle, c.clamp, c.root, c.lengths)

    def projection(self, n: int) -> Array:
        """Return the matrix (n, N+2) from transverse positions to modal coordinates.

        eta_i = (1/L) int chi_i v dx of the polyline v through clamp, hinges and tip, with the
        payload's share of it.
        """
        c, load = self.chain, load_of(self.parameters)
        nodes = np.concatenate([[0.0], c.hinges, [c.reach - c.clamp]])
        node, weight = gauss_legendre(GAUSS_POINTS)
        matrix = np.zeros((n, len(nodes)))
        length = nodes[-1]
        for j, (start, end) in enumerate(pairwise(nodes)):
            u = (node + 1) / 2
            weighted = weight[:, None] / 2 * (end - start) / length
            chi = weighted * mode_shapes(n, (start + u * (end - start)) / length, 0, load)
            matrix[:, j] += product(1 - u, chi)
            matrix[:, j + 1] += product(u, chi)
        matrix[:, -1] += load.mass * mode_shapes(n, 1.0, 0, load)
        turned = load.inertia * mode_shapes(n, 1.0, 1, load) * length / (nodes[-1] - nodes[-2])
        matrix[:, -1] += turned
        matrix[:, -2] -= turned
        return matrix


def _nodes(angle: Array, start: float, root: float, lengths: Array) -> tuple[Array, Array]:
    """Return a chain's nodes along and across (K, N+2) [m]: start, end of the root piece, the rest.

    angle: (K, N) of its segments to the root piece [rad]. lengths: (N,) of them [m].
    """
    ends = np.zeros((len(angle), 2))
    along = np.hstack([ends + np.array([start, root]), root + np.cumsum(lengths * cos(angle), 1)])
    across = np.hstack([ends, np.cumsum(lengths * sin(angle), axis=1)])
    return along, across


def _energies(model: mujoco.MjModel, qpos: Array, qvel: Array) -> Array:
    """Return kinetic plus elastic energy (K,) [J]."""
    data = mujoco.MjData(model)
    full = np.zeros((model.nv, model.nv))
    energies = np.empty(len(qpos))
    for k, (q, w) in enumerate(zip(qpos, qvel, strict=True)):
        data.qpos[:] = q
        with quiet_warnings():
            mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, full)
        energies[k] = product(w, product(full, w)) / 2
        energies[k] += product(model.jnt_stiffness, (q - model.qpos_spring) ** 2) / 2
    return energies


@dataclass(frozen=True, eq=False)
class ClosedChainPlant(ChainPlant):
    """The same chain by its equations in closed form: equal to `mj_step` to rounding, and cheaper.

    Raises:
        ModelError: the file has what they do not: dry friction, limits, another integrator.
    """

    name: str = "closed-chain"

    def __post_init__(self) -> None:
        _ = self.coefficients  # refuses what they do not have

    @cached_property
    def coefficients(self) -> ClosedChain:
        """Coefficients of the equations."""
        return closed_form(self.chain)

    @contextmanager
    def running(self, threads: int) -> Iterator[ClosedChain]:
        """Give the coefficients for compiled code."""
        yield self.coefficients


def in_closed_form(plant: Plant) -> tuple[Plant, str]:
    """Return the closed form of MuJoCo's chain, other plants as they are; and why a chain has none.

    It moves as MuJoCo's to rounding, at a seventh of the cost.
    """
    if type(plant) is not ChainPlant:
        return plant, ""
    try:
        return ClosedChainPlant(plant.parameters, plant.chain, f"closed-{plant.name}"), ""
    except ModelError as error:
        return plant, str(error)
