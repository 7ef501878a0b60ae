"""The plants near rest: matrices of motion about a pose with the beam straight, joints free.

    >>> from flexsim.linear.linearise import linearise, zero_order_hold
    >>> linear = linearise(plant, theta2=1.2)
    >>> Ad, Bd = zero_order_hold(linear, 1e-3)

About rest the equations of either plant are M q'' + D q' + K q = S tau, and what is measured is
theta1, theta2 and v. Nothing depends on theta1, since the arm moves in a horizontal plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag, expm

from flexsim.errors import ParameterError
from flexsim.mjcf import chain_file as chain
from flexsim.mjcf.bodies import require_linear
from flexsim.mjcf.rod_file import moving_across, rod_stiffness
from flexsim.numerics.clocks import whole_substeps
from flexsim.numerics.types import Array
from flexsim.plants import assumed_modes
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.rod_plant import RodPlant

THETA1, THETA2, V = 0, 1, 2  # rows of C


@dataclass(frozen=True, eq=False)
class LinearPlant:
    """A plant about rest at theta2, beam straight; q are deviations from that pose.

    Attributes:
        M, D, K: (m, m) mass, damping and stiffness [SI, mixed]. S: (m, 2) torques at the motors.
        tip: (m,) v = tip . q. theta2: of the pose [rad].
        coordinates: (m,) which of the plant's these are; None for all, in order.
    """

    M: Array
    D: Array
    K: Array
    S: Array
    tip: Array
    theta2: float
    coordinates: NDArray[np.intp] | None = None

    def state(self, states: Array) -> Array:
        """Return states (K, 2m) of these coordinates, from the plant's (K, 2M)."""
        if self.coordinates is None:
            return states
        rates = self.coordinates + states.shape[1] // 2
        return states[:, np.concatenate([self.coordinates, rates])]

    @cached_property
    def A(self) -> Array:
        """System matrix (2m, 2m) of the state [q, q']."""
        m = len(self.M)
        accelerations = -np.linalg.solve(self.M, np.hstack([self.K, self.D]))  # (m, 2m)
        return np.vstack([np.hstack([np.zeros((m, m)), np.eye(m)]), accelerations])

    @cached_property
    def B(self) -> Array:
        """Input matrix (2m, 2), from the torques at the motors [N m]."""
        return np.vstack([np.zeros_like(self.S), np.linalg.solve(self.M, self.S)])

    @cached_property
    def C(self) -> Array:
        """Output matrix (3, 2m) to theta1, theta2 [rad] and v [m]."""
        m = len(self.M)
        C = np.zeros((3, 2 * m))
        C[THETA1, 0] = C[THETA2, 1] = 1.0
        C[V, :m] = self.tip
        return C


def linearise(
    plant: Plant, theta2: float = math.pi / 2, joint_damping: ArrayLike = (0.0, 0.0)
) -> LinearPlant:
    """Return the linearisation of any plant about rest.

    Args:
        plant: assumed modes of either form, a chain, or a rod.
        theta2: of the pose [rad].
        joint_damping: (2,) viscous friction that is taken from the torques at the motors, beside
            the plant's own at the joints [N m s/rad].

    Raises:
        ParameterError: theta2 or the damping is not a finite number, or the plant is another.
        ModelError: a file has dry friction, a limit or the like, named.
    """
    extra = np.asarray(joint_damping, dtype=float)
    if not math.isfinite(theta2):
        raise ParameterError(f"theta2 is {theta2}; give a finite angle [rad]")
    if extra.shape != (2,) or not np.isfinite(extra).all():
        raise ParameterError(f"joint damping is {extra}; give two finite numbers")
    moving = None
    if isinstance(plant, AssumedModesPlant):
        M, D, K, S, tip = _of_modes(plant, theta2)
    elif isinstance(plant, ChainPlant):
        M, D, K, S, tip = _of_chain(plant, theta2)
    elif isinstance(plant, RodPlant):
        moving = moving_across(plant.rod.model)
        M, D, K, S, tip = _of_rod(plant, theta2, moving)
    else:
        raise ParameterError(f"plant {plant.name!r} has no linearisation; choose another plant")
    D[[0, 1], [0, 1]] += extra * np.diag(S[:2])  # friction acts on the motors' torques, as there
    return LinearPlant(M, D, K, S, tip, float(theta2), moving)


def _of_modes(plant: AssumedModesPlant, theta2: float) -> tuple[Array, Array, Array, Array, Array]:
    """Return M, D, K, S and tip of the assumed modes."""
    p, m = plant.coefficients, plant.modes + 2
    pose = np.zeros(m)
    pose[1] = theta2
    D = block_diag(np.diag([p.F_1, p.F_2]), p.damping)
    if plant.form == "printed":  # (46) prints theta1' where its square belongs: it stays at rest
        D[2:, 0] = p.L_R * np.sin(theta2) * p.P
    K = np.diag(np.concatenate([[0.0, 0.0], p.stiffness]))
    S = np.zeros((m, 2))
    S[0, 0], S[1, 1] = p.r_1, p.r_2
    return assumed_modes.mass_matrix(p, pose), D, K, S, np.concatenate([[0.0, 0.0], p.tip])


def _of_chain(plant: ChainPlant, theta2: float) -> tuple[Array, Array, Array, Array, Array]:
    """Return M, D, K, S and tip of the chain, all read from the compiled MJCF."""
    require_linear(plant.chain, joint_springs=True)
    model, lengths = plant.chain.model, plant.chain.lengths
    pose = np.zeros(model.nq)
    pose[1] = theta2
    S = np.zeros((model.nv, 2))
    for i in range(2):
        S[i, i] = model.actuator_gear[i, 0] * model.actuator_gainprm[i, 0]
    lever = np.cumsum(lengths[::-1])[::-1]  # from each hinge to the tip
    return (
        chain.mass_matrix(model, pose),
        np.diag(model.dof_damping),
        chain.stiffness_matrix(model),
        S,
        np.concatenate([[0.0, 0.0], lever]),
    )


def _of_rod(
    plant: RodPlant, theta2: float, moving: NDArray[np.intp]
) -> tuple[Array, Array, Array, Array, Array]:
    """Return M, D, K, S and tip of the rod: joints and the vertices' motions across.

    Along the rod its edges, of constant length, leave a vertex nothing to first order.
    """
    require_linear(plant.rod, joint_springs=True)
    model = plant.rod.model
    pose = np.zeros(model.nq)
    pose[1] = theta2
    take = np.ix_(moving, moving)
    S = np.zeros((len(moving), 2))
    for i in range(2):
        S[i, i] = model.actuator_gear[i, 0] * model.actuator_gainprm[i, 0]
    tip = np.zeros(len(moving))
    tip[-1] = 1.0
    return (
        chain.mass_matrix(model, pose)[take],
        np.diag(model.dof_damping[moving]),
        rod_stiffness(model)[take],
        S,
        tip,
    )


def zero_order_hold(linear: LinearPlant, period: float) -> tuple[Array, Array]:
    """Return (Ad, Bd), the exact motion over one period with the torques held.

    Args:
        linear: with n = 2m states. period: [s].

    Returns:
        (n, n) and (n, 2).

    Raises:
        ParameterError: the period is not a finite number over 0.
    """
    if not 0 < period < math.inf:
        raise ParameterError(f"control period is {period} s; give more than 0")
    return _split(expm(_augmented(linear) * period), len(linear.A))


def stepped_hold(
    linear: LinearPlant,
    period: float,
    step: float,
    integrator: mujoco.mjtIntegrator = mujoco.mjtIntegrator.mjINT_RK4,
    held_friction: ArrayLike = (0.0, 0.0),
) -> tuple[Array, Array]:
    """Return (Ad, Bd) as the simulation steps the plant over one period, `period/step` times.

    RK4 is the exponential's series to fourth order; Euler, implicit and implicitfast are
    semi-implicit, with the dampers' forces at the end of the step; discrete has the springs' there,
    too. Their damping of the fastest modes is included.

    Args:
        integrator: of the plant, see `integrator_of`.
        held_friction: (2,) viscous friction that takes from the torques at the motors what the
            joints' rates at the start of a step give [N m s/rad], as `flexsim.loop.friction` does.

    Raises:
        ParameterError: the period is no whole multiple of the step.
    """
    substeps = whole_substeps(period, step)
    m, n = len(linear.M), len(linear.A)
    if integrator == mujoco.mjtIntegrator.mjINT_RK4:
        X = _augmented(linear) * step
        one = np.eye(len(X))
        X = one + X @ (one + X / 2 @ (one + X / 3 @ (one + X / 4)))
    else:
        h, M, D, K = step, linear.M, linear.D, linear.K
        ahead = M + h * D
        if integrator == mujoco.mjtIntegrator.mjINT_DISCRETE:
            ahead = ahead + h**2 * K
        rate = np.linalg.solve(ahead, np.hstack([-h * K, M, h * linear.S]))  # (m, n+2)
        X = np.vstack([np.eye(m, n + 2) + h * rate, rate, np.eye(2, n + 2, n)])
    X[:n, m : m + 2] -= X[:n, n:] * np.asarray(held_friction, dtype=float)
    return _split(np.linalg.matrix_power(X, substeps), n)


def integrator_of(plant: Plant) -> mujoco.mjtIntegrator:
    """Return what steps a plant."""
    if isinstance(plant, AssumedModesPlant):
        return mujoco.mjtIntegrator.mjINT_RK4
    model = plant.rod.model if isinstance(plant, RodPlant) else plant.chain.model  # type: ignore[attr-defined]
    return mujoco.mjtIntegrator(model.opt.integrator)


def _augmented(linear: LinearPlant) -> Array:
    """Return [[A, B], [0, 0]] (n+2, n+2), whose exponential holds Ad and Bd."""
    n = len(linear.A)
    X = np.zeros((n + 2, n + 2))
    X[:n, :n], X[:n, n:] = linear.A, linear.B
    return X


def _split(step: Array, n: int) -> tuple[Array, Array]:
    return step[:n, :n].copy(), step[:n, n:].copy()
