"""MuJoCo's own elastic rod as a plant, beside the assumed modes and the tuned chain.

    >>> from flexsim import Parameters
    >>> from flexsim.plants.rod_plant import RodPlant
    >>> plant = RodPlant.designed(Parameters(), elements=14)

It is the third opinion: bending written by others, nothing in it tuned to the exact beam. What it
reaches, with N elements, on the default robot (`tests/test_rod.py` holds it to these):

- clamped frequencies 1, 2, 3 off by +0.04, -0.50, -1.77 % with N = 14, +0.02, -0.25, -0.89 % with
  N = 20: second order in 1/N, which nothing short of more elements improves;
- static deflection of the tip to 2e-5;
- tip under the torques of `studies.parity.crosscheck`, 9 mm of deflection: 3e-5 m rms with N = 14;
- energy constant to 1e-10 over 2 s of free motion, so RK4 damps nothing that matters;
- what it cannot: its step falls with 1/N^2, N = 14 needs 0.5 ms and constraints that hold its
  edges, so a simulated millisecond costs some twelve times one of the chain of six; and MuJoCo's
  implicit integrator `discrete`, which takes long steps, damps mode 3 with a ratio of 0.17 at 1 ms.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from flexsim.arm.beam import load_of, mode_shapes
from flexsim.arm.kinematics import in_world
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.mjcf.chain_file import mass_matrix, motor_matrix
from flexsim.mjcf.designed import designed_rod
from flexsim.mjcf.edits import with_locked, without_damping
from flexsim.mjcf.reading.linear_checks import require_linear
from flexsim.mjcf.rod_file import RodModel, moving_across, rod_damping, rod_stiffness
from flexsim.mjcf.rod_xml import ELEMENTS
from flexsim.numerics.dense import product
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.quadrature import gauss_legendre
from flexsim.numerics.types import Array
from flexsim.plants.base import MODES_SHOWN, Observation
from flexsim.plants.curvature import curvature_of_rod
from flexsim.plants.linear_plant import LinearPlant
from flexsim.plants.mujoco_steps import Rod, Workspaces

GAUSS_POINTS = 12  # to an element: modes 1 to 3 times a line, to rounding


@dataclass(frozen=True, eq=False)
class RodPlant:
    """The MuJoCo rod, stepped by `mj_step`.

    Attributes:
        parameters: the robot, for its beam's modes and reach; rod: the checked MJCF.
    """

    parameters: Parameters
    rod: RodModel
    name: str = "rod"

    @classmethod
    def designed(
        cls,
        parameters: Parameters,
        elements: int = ELEMENTS,
        step: float | None = None,
    ) -> RodPlant:
        """Return the rod of a robot, as `flexsim.mjcf.rod_xml` writes it.

        Args:
            parameters: the robot; elements: N.
            step: physics step [s]; None for 1 ms, halved until RK4 can take it.

        Raises:
            ParameterError, ModelError: elements or step out of range.
        """
        return cls(parameters, designed_rod(parameters, elements, step))

    @property
    def step(self) -> float:
        """Physics step, the file's timestep [s]."""
        return self.rod.step

    @property
    def integrator(self) -> str:
        """What takes the steps, the file's `integrator`."""
        return self.rod.integrator

    @property
    def mjcf(self) -> str:
        """Text of the MJCF file."""
        return self.rod.text

    @property
    def model(self) -> mujoco.MjModel:
        """The file as MuJoCo compiled it."""
        return self.rod.model

    @cached_property
    def workspaces(self) -> Workspaces:
        """What loops step, and where."""
        return Workspaces(self.rod.model, self.rod.text)

    @contextmanager
    def running(self, threads: int) -> Iterator[Rod]:
        """Give addresses for compiled code, alive and quiet as long as the block runs."""
        r, its = self.rod, self.workspaces
        with its.lent(threads) as data:
            yield Rod(its.model._address, data, r.L_R, r.reach, r.step)

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 nq,) at rest at joint angles (2,) [rad], beam straight."""
        state = np.zeros(2 * self.rod.model.nq)
        state[:2] = theta
        return state

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 nq) look like; modal: the shape projected on the modes (15)."""
        L_R, theta = self.rod.L_R, states[:, :2]
        points = self.shape(states)  # (K, N+2, 2)
        across = points[:, :, 1]
        beam = in_world(L_R, theta, points[:, :, 0], across)
        return Observation(
            joint=theta.copy(),
            v=across[:, -1].copy(),
            tip=beam[:, -1].copy(),
            modal=product(across, self.projection(MODES_SHOWN).T),
            energy=self.energies(states) if energy else np.full(len(states), np.nan),
            beam=beam,
        )

    def deflection(self, q: Array) -> tuple[Array, Array]:
        """Return the tip along and across the hub's axis (K,), (K,) at positions (K, nq) [m]."""
        return self.rod.reach + q[:, -2], q[:, -1].copy()

    def curvature_rows(self, places: ArrayLike) -> Array:
        """Return the rows (P, m) of the beam's curvature at places; see `Plant`."""
        return curvature_of_rod(self.rod, self.parameters, places)

    @property
    def bridge_sites(self) -> tuple[float, float] | None:
        """Places of strain bridges in the file, from the clamp [m], or None."""
        return self.rod.bridge_sites

    def linearised(self, theta2: float) -> LinearPlant:
        """Return the plant about rest at theta2 [rad]: joints, and the vertices' motions across.

        Along the rod its edges, of constant length, leave a vertex nothing to first order.

        Raises:
            ModelError: the file has dry friction, a limit or the like, named.
        """
        require_linear(self.rod, joint_springs=True)
        model = self.rod.model
        moving = moving_across(model)
        take = np.ix_(moving, moving)
        pose = self.rest_state((0.0, theta2))[: model.nq]
        tip = np.zeros(len(moving))
        tip[-1] = 1.0
        return LinearPlant(
            mass_matrix(model, pose)[take],
            np.diag(model.dof_damping[moving]) + rod_damping(model)[take],
            rod_stiffness(model)[take],
            motor_matrix(model)[moving],
            tip,
            float(theta2),
            moving,
        )

    def needed_force(self, q: Array, w: Array, a: Array) -> Array:
        """Refuse: the constraints that hold the rod's edges have no unique inverse.

        Raises:
            ParameterError: always.
        """
        raise ParameterError(
            f"plant {self.name!r} has no inversion of its tip; take that of the assumed modes or "
            "of the chain"
        )

    def undamped(self) -> Self:
        """Return the plant without friction at its joints or damping in its vertices."""
        return replace(self, rod=without_damping(self.rod))

    def locked(self, joints: Iterable[str]) -> Self:
        """Return the plant with joints that do not move; see `Plant`."""
        return replace(self, rod=with_locked(self.rod, joints))

    def shape(self, states: Array) -> Array:
        """Return clamp and vertices (K, N+2, 2) along and across the hub's axis, from joint 2 [m].

        The first of the vertices is fixed to the hub.
        """
        r = self.rod
        points = np.zeros((len(states), len(r.vertices), 2))
        points[:, :, 0] = np.concatenate([[r.clamp], r.vertices[1:]])
        points[:, 2:] += states[:, 2 : r.model.nq].reshape(len(states), -1, 2)
        return points

    def projection(self, n: int) -> Array:
        """Return the matrix (n, N+2) from transverse positions to modal coordinates.

        eta_i = (1/L) int chi_i v dx of the polyline v through clamp and vertices, with the
        payload's share of it.
        """
        r, load = self.rod, load_of(self.parameters)
        nodes = np.concatenate([[0.0], r.vertices[1:] - r.clamp]) / (r.reach - r.clamp)
        point, weight = gauss_legendre(GAUSS_POINTS)
        spans = np.diff(nodes)[:, None]
        x = (nodes[:-1, None] + spans * (point + 1) / 2).ravel()
        weighted = mode_shapes(n, x, 0, load) * (spans * weight / 2).reshape(-1, 1)  # (X, n)
        hats = np.array([np.interp(x, nodes, row) for row in np.eye(len(nodes))])  # (N+2, X)
        matrix: Array = product(hats, weighted).T
        matrix[:, -1] += load.mass * mode_shapes(n, 1.0, 0, load)
        return matrix

    def energies(self, states: Array) -> Array:
        """Return kinetic plus bending energy (K,) [J]; MuJoCo's own energy[0] leaves bending out.

        The edges, held by constraints, store none.
        """
        model = self.rod.model
        data = mujoco.MjData(model)
        full = np.zeros((model.nv, model.nv))
        energies = self.bending_energies(states)
        for k, state in enumerate(states):
            data.qpos[:] = state[: model.nq]
            with quiet_warnings():
                mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fullM(model, data, full)
            w = state[model.nq :]
            energies[k] += product(w, product(full, w)) / 2
        return energies

    def bending_energies(self, states: Array) -> Array:
        """Return the energy (K,) of the bent rod [J].

        sum k |kb|^2 with kb = 2 a x b/(|a||b| + a.b), twice the tangent of half the angle between
        the edges a, b at a vertex. Source: MuJoCo's documentation of `flex/elasticity`.
        """
        points = self.shape(states)
        points[:, 0, 0] = self.rod.vertices[0]
        edge = np.diff(points, axis=1)  # (K, N+1, 2)
        length = np.linalg.norm(edge, axis=2)
        a, b = edge[:, :-1], edge[:, 1:]
        cross = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
        curved = 2 * cross / (length[:, :-1] * length[:, 1:] + (a * b).sum(axis=2))  # (K, N)
        energies: Array = product(curved**2, self.rod.bending)
        return energies
