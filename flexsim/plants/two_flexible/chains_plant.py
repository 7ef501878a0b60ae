"""Two tuned chains in series as a plant: by MuJoCo's `mj_step`, or their equations in closed form.

>>> plant = TwoChainsPlant.designed(named_arm("two-flexible"), segments=(6, 6))
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from flexsim.arm.arms import Arm
from flexsim.arm.beam import load_of, mode_shapes
from flexsim.arm.chain_design import SEGMENTS
from flexsim.arm.locked import LOCKED, which_locked
from flexsim.arm.parameters import Parameters
from flexsim.mjcf.arms.two_chains import TwoChains, designed_two_chains
from flexsim.mjcf.reading.linear_checks import require_linear
from flexsim.numerics.dense import product
from flexsim.numerics.elementary import cos, sin
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.quadrature import gauss_legendre
from flexsim.numerics.types import Array
from flexsim.plants.base import MODES_SHOWN, Observation
from flexsim.plants.closed_form_chain import ClosedChain, closed_form
from flexsim.plants.curvature import between, on_beam
from flexsim.plants.linear_plant import LinearPlant
from flexsim.plants.mujoco_steps import Chain, Workspaces
from flexsim.plants.two_flexible.geometry import Bent, in_world

GAUSS_POINTS = 24  # to a segment: modes 1 to 3 times a line, to rounding


@dataclass(frozen=True, eq=False)
class TwoChainsPlant:
    """Two chains, stepped by `mj_step`. A state has joints 1 and 2 first, then the hinges.

    Attributes:
        parameters: the robot with its links straight. chains: the checked MJCF.
    """

    parameters: Parameters
    chains: TwoChains
    name: str = "chain"

    @classmethod
    def designed(
        cls,
        arm: Arm,
        segments: tuple[int, int] = (SEGMENTS, SEGMENTS),
        step: float | None = None,
        name: str = "chain",
    ) -> Self:
        """Return the chains of an arm whose link 1 bends.

        Args:
            arm: as named; segments: of links 1 and 2.
            step: physics step [s]; None for 1 ms, halved until RK4 can take it.

        Raises:
            ParameterError, ModelError: segments or step out of range.
        """
        return cls(arm.parameters, designed_two_chains(arm, segments, step), name)

    @property
    def step(self) -> float:
        """Physics step, the file's timestep [s]."""
        return self.chains.step

    @property
    def integrator(self) -> str:
        """What takes the steps, the file's `integrator`."""
        return self.chains.integrator

    @property
    def mjcf(self) -> str:
        """Text of the MJCF file."""
        return self.chains.text

    @property
    def model(self) -> mujoco.MjModel:
        """The file as MuJoCo compiled it."""
        return self.chains.model

    @cached_property
    def workspaces(self) -> Workspaces:
        """What loops step, and where."""
        return Workspaces(self.chains.model, self.chains.text)

    @contextmanager
    def running(self, threads: int) -> Iterator[Chain | ClosedChain]:
        """Give addresses for compiled code, alive and quiet as long as the block runs."""
        c, its = self.chains, self.workspaces
        with its.lent(threads) as data:
            yield Chain(
                its.model._address, data, c.L_R, c.root, c.lengths, c.step, c.second, c.link1
            )

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 m,) at rest at joint angles (2,) [rad], links straight."""
        state = np.zeros(2 * self.model.nq)
        state[:2] = theta
        return state

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 m) look like; modal: link 2's shape on its modes (15)."""
        first, second = self._bent(states)
        link1, beam = in_world(states[:, :2], first, second)
        return Observation(
            joint=states[:, :2].copy(),
            v=second.across[:, -1].copy(),
            tip=beam[:, -1].copy(),
            modal=product(second.across, self.projection(MODES_SHOWN).T),
            energy=self._energies(states) if energy else np.full(len(states), np.nan),
            beam=beam,
            link1=link1,
        )

    def _bent(self, states: Array) -> tuple[Bent, Bent]:
        """Return both links' nodes in their hubs' frames: clamp or joint, hinges, end."""
        c = self.chains
        own = c.second + 1  # of link 2's first hinge
        first = _nodes(states[:, 2:own], 0.0, float(c.link1[0]), c.link1[1:])
        return first, _nodes(states[:, own : c.model.nq], c.clamp, c.root, c.lengths)

    def deflection(self, q: Array) -> tuple[Array, Array]:
        """Return the tip along and across hub 2's axis (K,), (K,) at positions (K, m) [m]."""
        _, second = self._bent(q)
        return second.along[:, -1], second.across[:, -1]

    bridge_sites = None

    def curvature_rows(self, places: ArrayLike) -> Array:
        """Return the rows (P, m) of link 2's curvature at places; see `Plant`."""
        c, p = self.chains, self.parameters
        s = on_beam(places, p.L)
        hinges = c.root + np.append(0.0, np.cumsum(c.lengths)[:-1]) - c.clamp
        turning = c.model.jnt_stiffness[-len(hinges) :] / p.EI
        bent = between(hinges, p.L, p, s) * turning
        return np.hstack([np.zeros((len(s), c.model.nq - len(hinges))), bent])

    def projection(self, n: int) -> Array:
        """Return the matrix (n, N+2) from link 2's nodes to its modal coordinates.

        eta_i = (1/L) int chi_i v dx of the polyline v through clamp, hinges and tip, with the
        payload's share of it.
        """
        c, load = self.chains, load_of(self.parameters)
        nodes = np.concatenate([[c.clamp, c.root], c.root + np.cumsum(c.lengths)]) - c.clamp
        node, weight = gauss_legendre(GAUSS_POINTS)
        matrix, length = np.zeros((n, len(nodes))), nodes[-1]
        for j, (start, end) in enumerate(pairwise(nodes)):
            u = (node + 1) / 2
            share = weight[:, None] / 2 * (end - start) / length
            chi = share * mode_shapes(n, (start + u * (end - start)) / length, 0, load)
            matrix[:, j] += product(1 - u, chi)
            matrix[:, j + 1] += product(u, chi)
        matrix[:, -1] += load.mass * mode_shapes(n, 1.0, 0, load)
        turned = load.inertia * mode_shapes(n, 1.0, 1, load) * length / (nodes[-1] - nodes[-2])
        matrix[:, -1] += turned
        matrix[:, -2] -= turned
        return matrix

    def _in_file(self, values: Array) -> Array:
        """Return values of the coordinates (..., m) in the file's order of joints."""
        placed = np.empty_like(values)
        placed[..., self.chains.order] = values
        return placed

    def _energies(self, states: Array) -> Array:
        """Return kinetic plus elastic energy (K,) [J]."""
        model, m = self.model, states.shape[1] // 2
        data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
        energies = np.empty(len(states))
        for k, (q, w) in enumerate(
            zip(self._in_file(states[:, :m]), self._in_file(states[:, m:]), strict=True)
        ):
            data.qpos[:] = q
            with quiet_warnings():
                mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fullM(model, data, full)
            energies[k] = product(w, product(full, w)) / 2
            energies[k] += product(model.jnt_stiffness, (q - model.qpos_spring) ** 2) / 2
        return energies

    def linearised(self, theta2: float) -> LinearPlant:
        """Return the plant about rest at theta2 [rad], all read from the compiled MJCF.

        Raises:
            ModelError: the file has dry friction, a limit or the like, named.
        """
        c = self.chains
        require_linear(c, joint_springs=True)
        M, D, K = c.motion(theta2)
        S = np.zeros((len(M), 2))
        S[[0, 1], [0, 1]] = c.model.actuator_gear[:2, 0] * c.model.actuator_gainprm[:2, 0]
        tip = np.zeros(len(M))
        tip[c.second + 1 :] = np.cumsum(c.lengths[::-1])[::-1]  # from each hinge to the tip
        return LinearPlant(M, D, K, S, tip, float(theta2))

    def needed_force(self, q: Array, w: Array, a: Array) -> Array:
        """Return the generalised forces (K, m) that a motion needs; see `Plant`."""
        data, force = mujoco.MjData(self.model), np.empty_like(q)
        placed = [self._in_file(each) for each in (q, w, a)]
        for k in range(len(q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = (each[k] for each in placed)
            with quiet_warnings():
                mujoco.mj_inverse(self.model, data)
            force[k] = data.qfrc_inverse[self.chains.order]
        return force

    def undamped(self) -> Self:
        """Return the plant without friction at its joints or damping in its hinges."""
        model = copy.copy(self.model)
        model.dof_damping[:] = 0.0
        return replace(self, chains=replace(self.chains, model=model))

    def locked(self, joints: Iterable[str]) -> Self:
        """Return the plant with joints that do not move; see `Plant`."""
        held = np.array([0, self.chains.second])[np.flatnonzero(which_locked(joints))]
        model = copy.copy(self.model)
        model.dof_armature[held] = LOCKED
        model.jnt_limited[held] = False
        model.dof_frictionloss[held] = 0.0
        mujoco.mj_setConst(model, mujoco.MjData(model))
        return replace(self, chains=replace(self.chains, model=model))


def _nodes(hinges: Array, start: float, root: float, lengths: Array) -> Bent:
    """Return a chain's nodes; hinges: (K, N) angles, the first piece of length `root` straight."""
    angle = np.cumsum(hinges, axis=1)
    ends = np.zeros((len(hinges), 2))
    along = np.hstack([ends + np.array([start, root]), root + np.cumsum(lengths * cos(angle), 1)])
    across = np.hstack([ends, np.cumsum(lengths * sin(angle), axis=1)])
    return Bent(along, across, angle[:, -1])


@dataclass(frozen=True, eq=False)
class ClosedTwoChainsPlant(TwoChainsPlant):
    """The same chains by their equations in closed form: equal to `mj_step` to rounding.

    Raises:
        ModelError: the file has what they do not: dry friction, limits, another integrator.
    """

    name: str = "closed-chain"

    def __post_init__(self) -> None:
        _ = self.coefficients  # refuses what they do not have

    @cached_property
    def coefficients(self) -> ClosedChain:
        """Coefficients of the equations."""
        return closed_form(self.chains)

    @contextmanager
    def running(self, threads: int) -> Iterator[ClosedChain]:
        """Give the coefficients for compiled code."""
        yield self.coefficients
