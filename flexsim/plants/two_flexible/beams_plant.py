"""Two flexible links by assumed modes, as a plant stepped by RK4.

>>> plant = TwoBeamsPlant(named_arm("two-flexible"), modes=3)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from flexsim.arm.arms import Arm
from flexsim.arm.beam import MODES, load_of, mode_shapes
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.dense import product
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.step_limits import LONGEST_STEP, POSES, longest_step
from flexsim.numerics.types import Array
from flexsim.plants.base import Observation
from flexsim.plants.curvature import curvature_of_modes
from flexsim.plants.linear_plant import LinearPlant
from flexsim.plants.two_flexible.equations import TwoBeams, two_beams, two_beams_inertia
from flexsim.plants.two_flexible.geometry import Bent, in_world

DRAWN_POINTS = 41  # along each beam


@dataclass(frozen=True)
class TwoBeamsPlant:
    """Assumed modes of two flexible links with RK4.

    Attributes:
        arm: whose link 1 bends; modes: n of each link; step: physics step [s].

    Raises:
        ParameterError: link 1 is rigid, or the step is beyond what RK4 can take.
    """

    arm: Arm
    modes: int = MODES
    step: float = LONGEST_STEP
    name: str = "assumed-modes"

    integrator = "RK4"
    mjcf = None
    model = None

    def __post_init__(self) -> None:
        longest = self.longest_held_step((0.0, 0.0))
        if not 0 < self.step < longest:
            raise ParameterError(
                f"physics step {self.step:g} s is too long for RK4 with {self.modes} modes of each "
                f"link up to {self.highest_frequency:.0f} rad/s; use less than {longest:.3g} s"
            )

    @property
    def parameters(self) -> Parameters:
        """The robot with its links straight."""
        return self.arm.parameters

    @cached_property
    def coefficients(self) -> TwoBeams:
        """Coefficients of the equations."""
        return two_beams(self.arm, (self.modes, self.modes), self.step)

    @property
    def highest_frequency(self) -> float:
        """Highest natural frequency with both joints free [rad/s], over poses of joint 2."""
        every = [self.linearised(float(pose)) for pose in POSES]
        return math.sqrt(max(float(natural_modes(each.K, each.M)[0][-1]) for each in every))

    def longest_held_step(self, friction: tuple[float, float]) -> float:
        """Return the step below which RK4 is stable near rest, friction held over it [s].

        friction: of the motors' torques, the steepest [N m s/rad].
        """
        every = [self.linearised(float(pose)) for pose in POSES]
        held = np.zeros_like(every[0].D)
        held[[0, 1], [0, 1]] = friction * np.diag(every[0].S[:2])
        return longest_step("RK4", [(each.M, each.D, each.K) for each in every], held)

    @contextmanager
    def running(self, threads: int) -> Iterator[TwoBeams]:
        """Give the coefficients for compiled code."""
        yield self.coefficients

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 m,), m = 2 + 2 n, at rest at joint angles (2,) [rad]."""
        state = np.zeros(2 * (2 + 2 * self.modes))
        state[:2] = theta
        return state

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 m) look like; modal: eta of link 2 alone."""
        m = states.shape[1] // 2
        q, n = states[:, :m], self.modes
        first, second = self._bent(q)
        link1, beam = in_world(states[:, :2], first, second)
        along, v = self.deflection(q)
        tip = Bent(along[:, None], v[:, None], np.zeros(len(q)))
        return Observation(
            joint=states[:, :2].copy(),
            v=v,
            tip=in_world(states[:, :2], first, tip)[1][:, 0],
            modal=q[:, 2 + n :].copy(),
            energy=self._energies(states) if energy else np.full(len(states), np.nan),
            beam=beam,
            link1=link1,
        )

    def _bent(self, q: Array) -> tuple[Bent, Bent]:
        """Return points along both links at positions q (K, m), in their hubs' frames."""
        n, p = self.modes, self.coefficients
        s = np.linspace(0.0, 1.0, DRAWN_POINTS)
        found = []
        parts = (
            (self.arm.beam1, self.arm.load1, p.S_1, p.slope_1, q[:, 2 : 2 + n]),
            (self.parameters, load_of(self.parameters), p.S_2, p.slope_2, q[:, 2 + n :]),
        )
        for beam, load, S, slope, eta in parts:
            across = product(eta, mode_shapes(n, s, 0, load).T)
            along = np.broadcast_to(beam.r + beam.L * s, across.shape).copy()
            along[:, -1] -= np.sum(product(eta, S[-1]) * eta, axis=1) / 2
            found.append(Bent(along, across, product(eta, slope)))
        return found[0], found[1]

    def deflection(self, q: Array) -> tuple[Array, Array]:
        """Return the tip along and across hub 2's axis (K,), (K,) at positions (K, m) [m]."""
        p, eta = self.coefficients, q[:, 2 + self.modes :]
        shortening = np.sum(product(eta, p.S_2[-1]) * eta, axis=1) / 2
        return p.x_2[-1] - shortening, product(eta, p.chi_2[-1])

    bridge_sites = None

    def curvature_rows(self, places: ArrayLike) -> Array:
        """Return the rows (P, m) of link 2's curvature at places; see `Plant`."""
        bent = curvature_of_modes(self.parameters, self.modes, places)
        return np.hstack([np.zeros((len(bent), 2 + self.modes)), bent])

    def _inertia(self, q: Array, w: Array) -> tuple[Array, Array]:
        M, bias = np.empty((len(q), len(q))), np.empty(len(q))
        two_beams_inertia(self.coefficients, q, w, M, bias)
        return M, bias

    def _stiffness(self) -> Array:
        p = self.coefficients
        K: Array = block_diag(np.zeros((2, 2)), p.K_1, p.K_2)
        return K

    def _damping(self) -> Array:
        p = self.coefficients
        D: Array = block_diag(np.diag([p.F_1, p.F_2]), p.D_1, p.D_2)
        return D

    def _energies(self, states: Array) -> Array:
        """Return kinetic plus elastic energy (K,) [J]."""
        m, K = states.shape[1] // 2, self._stiffness()
        energies = np.empty(len(states))
        for k, state in enumerate(states):
            q, w = np.ascontiguousarray(state[:m]), np.ascontiguousarray(state[m:])
            M, _ = self._inertia(q, w)
            energies[k] = (product(w, product(M, w)) + product(q, product(K, q))) / 2
        return energies

    def linearised(self, theta2: float) -> LinearPlant:
        """Return the plant about rest at theta2 [rad]."""
        p, m = self.coefficients, 2 + 2 * self.modes
        pose = np.zeros(m)
        pose[1] = theta2
        M, _ = self._inertia(pose, np.zeros(m))
        S = np.zeros((m, 2))
        S[0, 0], S[1, 1] = p.r_1, p.r_2
        tip = np.concatenate([np.zeros(2 + self.modes), p.chi_2[-1]])
        return LinearPlant(M, self._damping(), self._stiffness(), S, tip, float(theta2))

    def needed_force(self, q: Array, w: Array, a: Array) -> Array:
        """Return the generalised forces (K, m) that a motion needs; see `Plant`."""
        K, D, force = self._stiffness(), self._damping(), np.empty_like(q)
        for k in range(len(q)):
            M, bias = self._inertia(np.ascontiguousarray(q[k]), np.ascontiguousarray(w[k]))
            force[k] = product(M, a[k]) + bias + product(K, q[k]) + product(D, w[k])
        return force

    def undamped(self) -> Self:
        """Return the plant without friction at its joints, nor damping in its beams."""
        return replace(self, arm=self.arm.undamped())

    def locked(self, joints: Iterable[str]) -> Self:
        """Return the plant with joints that do not move; see `Plant`."""
        return replace(self, arm=self.arm.locked(joints))
