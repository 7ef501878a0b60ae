"""The assumed-modes equations as a plant, stepped by RK4.

>>> plant = AssumedModesPlant(Parameters(), modes=3, step=1e-3)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from flexsim.arm.beam import MODES, load_of, mode_shapes
from flexsim.arm.kinematics import in_world, tip_position
from flexsim.arm.locked import motors_locking
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.mjcf.as_parameters import parameters_of
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.edits import with_locked, without_damping
from flexsim.numerics.dense import product
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.step_limits import (
    LONGEST_STEP,
    POSES,
    SHORTEST_STEP,
    fastest_decay,
    halved,
    longest_rk4_step,
    longest_step,
)
from flexsim.numerics.types import Array
from flexsim.plants import assumed_modes
from flexsim.plants.assumed_modes import AssumedModes
from flexsim.plants.base import Observation
from flexsim.plants.chain_as_modes import modes_of_chain, vibration
from flexsim.plants.curvature import curvature_of_chain, curvature_of_modes
from flexsim.plants.linear_plant import LinearPlant
from flexsim.plants.printed import (
    AS_PRINTED,
    SQUARE_46,
    PrintedModes,
    printed_forces,
    printed_modes,
    reached_by_46,
)

DRAWN_POINTS = 41  # along the assumed-modes beam


@dataclass(frozen=True)
class AssumedModesPlant:
    """The assumed-modes equations with RK4.

    Attributes:
        parameters: the robot; modes: n, 0 for a rigid second link; step: physics step [s].
        form: 'consistent' or 'printed'.
        misprints: of the printed form, the sum of the switches of `flexsim.plants.printed`.
        modal_damping: ratios of the clamped modes, one for each, instead of the parameters' zeta.
        chain: an MJCF file whose own modes and masses take the place of the parameters' beam.

    Raises:
        ParameterError: an unknown form, a step beyond the integrator's limit, or another number
            of damping ratios than of modes.
        ModelError: the file has something that the equations do not.
    """

    parameters: Parameters = field(default_factory=Parameters)
    modes: int = MODES
    step: float = LONGEST_STEP
    form: str = "consistent"
    name: str = "assumed-modes"
    chain: ChainModel | None = None
    misprints: int = AS_PRINTED
    modal_damping: tuple[float, ...] = ()

    integrator = "RK4"
    mjcf = None
    model = None

    def __post_init__(self) -> None:
        if self.form not in ("consistent", "printed"):
            raise ParameterError(f"form {self.form!r} is unknown; choose consistent or printed")
        if self.modal_damping and self.modes and len(self.modal_damping) != self.modes:
            raise ParameterError(
                f"modal damping has {len(self.modal_damping)} ratios for {self.modes} modes; give "
                "one for each"
            )
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
    def of_chain(cls, chain: ChainModel, modes: int = MODES, **more: Any) -> AssumedModesPlant:
        """Return the plant of an MJCF file: its rigid bodies, the modes of its own chain.

        Args:
            chain: the file; modes: n. more: `step`, `form`, `name`.

        Raises:
            ParameterError, ModelError: as the plant itself.
        """
        return cls(parameters_of(chain), modes, chain=chain, **more)

    @property
    def printed(self) -> bool:
        """Whether the equations are the paper's as printed, or with chosen misprints."""
        return self.form == "printed"

    @cached_property
    def coefficients(self) -> AssumedModes:
        """Coefficients of the consistent equations."""
        own = (self.parameters, self.modes, self.chain, self.modal_damping)
        return coefficients_of(*own)._replace(step=self.step)

    @property
    def highest_frequency(self) -> float:
        """Highest natural frequency with both joints free [rad/s], over poses of joint 2."""
        return self._rates[0]

    @property
    def fastest_decay(self) -> float:
        """Largest |lambda| of damped motions with both joints free [1/s], 0 without any."""
        return self._rates[1]

    @cached_property
    def _rates(self) -> tuple[float, float]:
        return free_rates(self.parameters, self.modes, self.chain, tuple(self.modal_damping))

    @property
    def longest_step(self) -> float:
        """Step below which RK4 is stable near rest [s]."""
        return longest_rk4_step(self.highest_frequency, self.fastest_decay)

    def longest_held_step(self, friction: tuple[float, float]) -> float:
        """Return the step below which RK4 is stable near rest, friction held over it [s].

        friction: of the motors' torques, the steepest [N m s/rad].
        """
        if not any(friction):
            return self.longest_step
        linear = [self.linearised(float(pose)) for pose in POSES]
        at_start = np.zeros_like(linear[0].D)
        at_start[[0, 1], [0, 1]] = friction * np.diag(linear[0].S[:2])
        return longest_step("RK4", [(each.M, each.D, each.K) for each in linear], at_start)

    @cached_property
    def drawn(self) -> tuple[Array, Array]:
        """Points along the hub's axis (P,) [m] and the modes' displacements there (P, n)."""
        if self.chain is not None:
            c = self.chain
            along = np.concatenate([[c.clamp], c.root + np.append(0.0, np.cumsum(c.lengths))])
            return along, vibration(c, self.parameters, self.modes).shapes
        x = np.linspace(0.0, 1.0, DRAWN_POINTS)
        load = load_of(self.parameters)
        shapes = mode_shapes(self.modes, x, 0, load) if self.modes else np.zeros((len(x), 0))
        return self.parameters.r + x * self.parameters.L, shapes

    @contextmanager
    def running(self, threads: int) -> Iterator[AssumedModes | PrintedModes]:
        """Give the coefficients for compiled code."""
        consistent = self.coefficients
        yield printed_modes(consistent, self.misprints) if self.printed else consistent

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 (n+2),) at rest at joint angles (2,) [rad], beam straight."""
        state = np.zeros(2 * (self.modes + 2))
        state[:2] = theta
        return state

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 (n+2)) look like; energy is nan where not wanted."""
        p, n = self.coefficients, self.modes
        eta = states[:, 2 : 2 + n]
        reached, v = self.deflection(states[:, : 2 + n])
        along, shapes = self.drawn
        across = product(eta, shapes.T)  # (K, P)
        return Observation(
            joint=states[:, :2].copy(),
            v=v,
            tip=tip_position(self.parameters, states[:, :2], v, reached - p.reach),
            modal=eta.copy(),
            energy=assumed_modes.energy(p, states) if energy else np.full(len(states), np.nan),
            beam=in_world(
                self.parameters.L_R, states[:, :2], np.broadcast_to(along, across.shape), across
            ),
        )

    def deflection(self, q: Array) -> tuple[Array, Array]:
        """Return the tip along and across the hub's axis (K,), (K,) at positions (K, n+2) [m]."""
        p, eta = self.coefficients, q[:, 2:]
        shortening = np.sum(product(eta, p.slope) * eta, axis=1) / 2
        return p.reach - shortening, product(eta, p.tip)

    def curvature_rows(self, places: ArrayLike) -> Array:
        """Return the rows (P, m) of the beam's curvature at places; see `Plant`."""
        n = self.modes
        if n == 0:
            raise ParameterError(
                f"the {self.name} plant has a second link that does not bend, on which strain "
                "bridges read nothing; give another plant, or estimator=exact"
            )
        if self.chain is None:
            bent = curvature_of_modes(self.parameters, n, places)
        else:
            hinges = vibration(self.chain, self.parameters, n).hinges
            bent = product(curvature_of_chain(self.chain, self.parameters, places), hinges)
        return np.hstack([np.zeros((len(bent), 2)), bent])

    @property
    def bridge_sites(self) -> tuple[float, float] | None:
        """Places of strain bridges in the file, from the clamp [m], or None."""
        return None if self.chain is None else self.chain.bridge_sites

    def linearised(self, theta2: float) -> LinearPlant:
        """Return the plant about rest at theta2 [rad]."""
        p, m = self.coefficients, self.modes + 2
        pose = np.zeros(m)
        pose[1] = theta2
        D = block_diag(np.diag([p.F_1, p.F_2]), p.damping)
        if self.printed and self.misprints & SQUARE_46:  # theta1' for its square stays at rest
            reached = reached_by_46(self.modes, self.misprints)
            D[2 : 2 + reached, 0] = p.L_R * math.sin(theta2) * p.P[:reached]
        K = np.diag(np.concatenate([[0.0, 0.0], p.stiffness]))
        S = np.zeros((m, 2))
        S[0, 0], S[1, 1] = p.r_1, p.r_2
        tip = np.concatenate([[0.0, 0.0], p.tip])
        return LinearPlant(assumed_modes.mass_matrix(p, pose), D, K, S, tip, float(theta2))

    def needed_force(self, q: Array, w: Array, a: Array) -> Array:
        """Return the generalised forces (K, n+2) that a motion needs; see `Plant`."""
        switches = self.misprints if self.printed else 0  # none: the consistent equations
        force = np.empty_like(q)
        printed_forces(printed_modes(self.coefficients, switches), q, w, a, force)
        return force

    def undamped(self) -> Self:
        """Return the plant without friction at its joints, nor damping in its beam."""
        free = replace(self.parameters, F_1=0.0, F_2=0.0, zeta=0.0)
        chain = None if self.chain is None else without_damping(self.chain)
        return replace(self, parameters=free, chain=chain, modal_damping=())

    def locked(self, joints: Iterable[str]) -> Self:
        """Return the plant with joints that do not move; see `Plant`."""
        held = tuple(joints)
        own = replace(self.parameters, **motors_locking(held))
        chain = None if self.chain is None else with_locked(self.chain, held)
        return replace(self, parameters=own, chain=chain)


def coefficients_of(
    parameters: Parameters,
    modes: int,
    chain: ChainModel | None = None,
    modal_damping: tuple[float, ...] = (),
) -> AssumedModes:
    """Return the coefficients of the consistent equations but for the step."""
    if chain is not None:
        return modes_of_chain(chain, modes, LONGEST_STEP)
    found = assumed_modes.assumed_modes(parameters, modes)
    if not modal_damping or modes == 0:
        return found
    rates = 2 * np.array(modal_damping) * np.sqrt(found.stiffness / found.mass)
    return found._replace(damping=np.diag(rates * found.mass))


@lru_cache(maxsize=64)
def free_rates(
    parameters: Parameters,
    modes: int,
    chain: ChainModel | None = None,
    modal_damping: tuple[float, ...] = (),
) -> tuple[float, float]:
    """Return the highest frequency [rad/s] and fastest decay [1/s] with both joints free.

    Over poses of joint 2; the decay is 0 where nothing is damped enough to matter.
    """
    p = coefficients_of(parameters, modes, chain, modal_damping)
    D = np.zeros((modes + 2, modes + 2))
    D[0, 0], D[1, 1], D[2:, 2:] = p.F_1, p.F_2, p.damping
    K = np.diag(np.concatenate([[0.0, 0.0], p.stiffness]))
    masses = assumed_modes.straight_masses(p, POSES)
    squared = [natural_modes(K, M)[0][2:].max(initial=0.0) for M in masses]
    return math.sqrt(max(squared)), fastest_decay((M, D, K) for M in masses)


def stable_modes_step(
    parameters: Parameters,
    modes: int,
    chain: ChainModel | None = None,
    modal_damping: tuple[float, ...] = (),
) -> float:
    """Return 1 ms, halved until RK4 can take the assumed modes with free joints [s]."""
    plant = AssumedModesPlant(
        parameters, modes, SHORTEST_STEP, chain=chain, modal_damping=modal_damping
    )
    return halved(plant.longest_step)
