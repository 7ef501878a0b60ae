"""A plant of your own: the arm's equations near one pose, linear, run by the same loop.

    python examples/linear_plant.py

How much of a run is what the linear equations leave out? What a plant needs is a NamedTuple of its
coefficients, compiled functions for a step and the tip, and the methods of
`flexsim.plants.base.Plant`; `register` makes the two known to each other.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from controllers import TUNED
from flexsim import Motion, Parameters, Robot, closed_loop, measures, reference, setting, trajectory
from flexsim.arm.kinematics import in_world, tip_position
from flexsim.loop.hardware import HARDWARE
from flexsim.numerics.dense import product, solve
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array
from flexsim.plants.assumed_modes import rk4_step
from flexsim.plants.base import Observation, Plant
from flexsim.plants.dispatch import register
from flexsim.plants.linear_plant import LinearPlant
from flexsim.plants.modes_plant import AssumedModesPlant


class LinearCoefficients(NamedTuple):
    """M q'' + D q' + K q = S tau, as compiled code reads it; inverse: of M; tip: v = tip . q."""

    inverse: Array
    D: Array
    K: Array
    S: Array
    tip: Array
    reach: float
    step: float


@jit
def linear_acceleration(
    p: LinearCoefficients, q: Array, w: Array, tau_1: float, tau_2: float, a: Array, force: Array
) -> None:
    """Write the accelerations (m,) into a; force (m,) is work space."""
    for i in range(q.shape[0]):
        force[i] = p.S[i, 0] * tau_1 + p.S[i, 1] * tau_2
        for j in range(q.shape[0]):
            force[i] -= p.D[i, j] * w[j] + p.K[i, j] * q[j]
    for i in range(q.shape[0]):
        a[i] = 0.0
        for j in range(q.shape[0]):
            a[i] += p.inverse[i, j] * force[j]


@jit
def linear_step(
    p: LinearCoefficients, slot: int, state: Array, tau_1: float, tau_2: float, work: Array
) -> None:
    """Advance the state by one Runge-Kutta step."""
    rk4_step(linear_acceleration, p, p.step, state, tau_1, tau_2, work)


@jit
def linear_tip(p: LinearCoefficients, state: Array):  # type: ignore[no-untyped-def]
    """Return the tip along and across the hub's x-axis, from joint 2 [m]."""
    v = 0.0
    for j in range(p.tip.shape[0]):
        v += p.tip[j] * state[j]
    return p.reach, v


register(LinearCoefficients, linear_step, linear_tip)


@dataclass(frozen=True)
class LinearArm:
    """The assumed modes with all that depends on the pose as it is at one.

    Attributes:
        of: the plant whose equations these are near rest. pose: theta2 there [rad].
    """

    of: AssumedModesPlant
    pose: float
    name: str = "linear"

    integrator = "RK4"
    mjcf = None
    model = None

    @property
    def parameters(self) -> Parameters:
        """The robot."""
        return self.of.parameters

    @property
    def step(self) -> float:
        """Physics step [s]."""
        return self.of.step

    @property
    def bridge_sites(self) -> tuple[float, float] | None:
        """Places of strain bridges, from the clamp [m], or None."""
        return self.of.bridge_sites

    @contextmanager
    def running(self, threads: int) -> Iterator[LinearCoefficients]:
        """Give the coefficients for compiled code."""
        near = self.linearised(self.pose)
        inverse = solve(near.M, np.eye(len(near.M)))
        yield LinearCoefficients(
            inverse, near.D, near.K, near.S, near.tip, self.parameters.reach, self.step
        )

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 m,) at rest at joint angles (2,) [rad], beam straight."""
        return self.of.rest_state(theta)

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 m) look like; energy is nan where not wanted."""
        m = states.shape[1] // 2
        q, w = states[:, :m], states[:, m:]
        _, v = self.deflection(q)
        along, shapes = self.of.drawn
        across = product(q[:, 2:], shapes.T)
        near = self.linearised(self.pose)
        joules = np.einsum("ki,ij,kj->k", w, near.M, w) + np.einsum("ki,ij,kj->k", q, near.K, q)
        joint = q[:, :2].copy()
        return Observation(
            joint=joint,
            v=v,
            tip=tip_position(self.parameters, joint, v),
            modal=q[:, 2:].copy(),
            energy=joules / 2 if energy else np.full(len(q), np.nan),
            beam=in_world(self.parameters.L_R, joint, np.broadcast_to(along, across.shape), across),
        )

    def deflection(self, q: Array) -> tuple[Array, Array]:
        """Return the tip along and across the hub's axis (K,), (K,) at positions (K, m) [m]."""
        return np.full(len(q), self.parameters.reach), product(q, self.linearised(self.pose).tip)

    def curvature_rows(self, places: ArrayLike) -> Array:
        """Return the rows (P, m) of the beam's curvature at places."""
        return self.of.curvature_rows(places)

    def linearised(self, theta2: float) -> LinearPlant:
        """Return the plant about rest: the same at every theta2 [rad]."""
        return self.of.linearised(self.pose)

    def needed_force(self, q: Array, w: Array, a: Array) -> Array:
        """Return the generalised forces (K, m) that a motion needs."""
        near = self.linearised(self.pose)
        return product(a, near.M.T) + product(w, near.D.T) + product(q, near.K.T)

    def undamped(self) -> LinearArm:
        """Return the plant without friction at its joints or damping in its beam."""
        return replace(self, of=self.of.undamped())

    def locked(self, joints: Iterable[str]) -> LinearArm:
        """Return the plant with joints that do not move."""
        return replace(self, of=self.of.locked(joints))


def followed(plant: Plant, path: str) -> tuple[Motion, dict[str, Any]]:
    """Return how a plant follows a path on the bench with our controller of it, and how well."""
    bench = setting("none", HARDWARE["bench"])
    wanted = reference(trajectory(path), plant.parameters)
    (motion,) = closed_loop(plant, bench, wanted, [TUNED[path].filters(1e-3)])
    return motion, measures(motion, wanted)


def main() -> None:
    """Print how far from the nonlinear plant the linear one ends on every path."""
    modes = Robot().modes_plant()
    print("path      theta2 [rad]  envelope [mm], nonlinear  linear  tips apart [mm rms]")
    for path in ("line", "two-loop", "circle"):
        angles = reference(trajectory(path), modes.parameters).joint[:, 1]
        middle = float((angles.min() + angles.max()) / 2)
        own, measured = followed(modes, path)
        other, of_linear = followed(LinearArm(modes, middle), path)
        apart = np.sqrt(np.mean(np.sum((own.tip - other.tip) ** 2, axis=1)))
        print(
            f"{path:10}{angles.min():5.2f} to {angles.max():4.2f}{1e3 * measured['envelope']:26.1f}"
            f"{1e3 * of_linear['envelope']:8.1f}{1e3 * apart:21.2f}"
        )


if __name__ == "__main__":
    main()
