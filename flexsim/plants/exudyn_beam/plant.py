"""EXUDYN's beam as a plant: elements, joints and integrator by another author, nothing tuned.

    >>> plant = ExudynPlant(Parameters(), elements=8, step=5e-4)

The third code that answers rest on, beside the assumed modes and MuJoCo's chain: controllers,
hardware and friction are ours, what happens between two physics steps is EXUDYN's alone. It costs
about a thousand times as much as three assumed modes: for nominal runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from flexsim.arm.kinematics import in_world
from flexsim.arm.locked import LOCKED, which_locked
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.dense import product, solve
from flexsim.numerics.eigenvalues import eigenvalues
from flexsim.numerics.step_limits import POSES
from flexsim.numerics.types import Array
from flexsim.plants.base import MODES_SHOWN, Observation
from flexsim.plants.curvature import on_beam
from flexsim.plants.exudyn_beam import shapes
from flexsim.plants.exudyn_beam.calls import serving
from flexsim.plants.exudyn_beam.frames import FIRST, OF_NODE, ExudynBeam, all_to_world
from flexsim.plants.exudyn_beam.system import ArmSystem, axial_stiffness, exudyn
from flexsim.plants.linear_plant import LinearPlant

ELEMENTS, ELEMENTS_MOST = 8, 64
STEP = 5e-4  # [s] physics step; with more elements or a quarter of the step tips stay where they
# are within 0.2 um under small torques, 0.9 um under large ones (`studies.ladder`)
DRAWN_POINTS = 33  # along the beam


class _Systems:
    """What a run steps: an arm for each of its threads, made when the thread first needs it."""

    def __init__(self, plant: ExudynPlant) -> None:
        self._plant = plant
        self._arms: dict[int, ArmSystem] = {}
        self.world = np.empty((0, 2, plant.size))

    def lend(self, threads: int) -> None:
        """Have room for so many threads."""
        if len(self.world) < threads:
            self.world = np.empty((threads, 2, self._plant.size))

    def advance(self, slot: int, begins: bool, tau_1: float, tau_2: float) -> bool:
        """Advance a thread's arm by a physics step; False if it could not."""
        if slot not in self._arms:
            self._arms[slot] = self._plant.system()
        arm = self._arms[slot]
        if begins:
            arm.begin(self.world[slot])
        return arm.advance(self.world[slot], tau_1, tau_2)


@dataclass(frozen=True, eq=False)
class ExudynPlant:
    """The arm with EXUDYN's beam, stepped by EXUDYN.

    Attributes:
        parameters: the robot; elements: N, of equal length. step: physics step [s].
        held: whether joint 1 and joint 2 are constrained not to move.

    Raises:
        ParameterError: elements or step out of range, or EXUDYN is not installed.
    """

    parameters: Parameters
    elements: int = ELEMENTS
    step: float = STEP
    name: str = "exudyn"
    held: tuple[bool, bool] = (False, False)

    integrator = "trapezoidal"
    mjcf = None
    model = None
    bridge_sites = None

    def __post_init__(self) -> None:
        if not 1 <= self.elements <= ELEMENTS_MOST:
            raise ParameterError(
                f"number of EXUDYN's elements is {self.elements}; give 1 to {ELEMENTS_MOST}"
            )
        if not 0 < self.step < np.inf:
            raise ParameterError(f"physics step is {self.step} s; give more than 0")
        exudyn()

    @property
    def m(self) -> int:
        """Number of generalised positions."""
        return FIRST + OF_NODE * self.elements

    @property
    def size(self) -> int:
        """Number n of EXUDYN's coordinates."""
        return len(self.beam.straight)

    @cached_property
    def beam(self) -> ExudynBeam:
        """What compiled code needs to know, but for what belongs to a run."""
        p = self.parameters
        places: Array = p.r + p.L / self.elements * np.arange(self.elements + 1.0)
        straight = [0.0, 0.0, 0.0, p.L_R, 0.0, 0.0]
        for place in places:
            straight += [p.L_R + float(place), 0.0, 1.0, 0.0]
        if p.payload or p.payload_inertia:
            straight += [p.L_R + p.reach, 0.0, 0.0]
        return ExudynBeam(
            0, p.L_R, p.reach, p.r_1, p.r_2, places, np.array(straight), np.empty((0, 2, 0))
        )

    @cached_property
    def _free(self) -> list[_Systems]:
        """Systems that no run uses: making one costs as much as some steps."""
        return []

    def system(self) -> ArmSystem:
        """Return a new arm."""
        return ArmSystem(self.parameters, self.elements, self.step, self.held)

    @contextmanager
    def running(self, threads: int) -> Iterator[ExudynBeam]:
        """Give the coefficients for compiled code, EXUDYN quiet as long as the block runs."""
        systems = self._free.pop() if self._free else _Systems(self)
        systems.lend(threads)
        config = exudyn().config
        before, config.printToConsole = config.printToConsole, False
        try:
            with serving(systems) as handle:
                yield self.beam._replace(handle=handle, world=systems.world)
        finally:
            config.printToConsole = before
        self._free.append(systems)

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 m,) at rest at joint angles (2,) [rad], beam straight."""
        state = np.zeros(2 * self.m)
        state[:2] = theta
        return state

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 m) look like; modal: the shape projected on the modes (15)."""
        p, theta, q = self.parameters, states[:, :2], states[:, : self.m]
        along, across = shapes.nodal(q, p)
        drawn = shapes.hermite(self.elements, p.L, np.linspace(0.0, p.L, DRAWN_POINTS), 0)
        beam = in_world(p.L_R, theta, p.r + product(along, drawn.T), product(across, drawn.T))
        modal = shapes.projection(p, self.elements, MODES_SHOWN)
        return Observation(
            joint=theta.copy(),
            v=self.deflection(q)[1],
            tip=beam[:, -1].copy(),
            modal=product(across, modal.T),
            energy=self._energies(states) if energy else np.full(len(states), np.nan),
            beam=beam,
        )

    def _energies(self, states: Array) -> Array:
        """Return kinetic plus elastic energy (K,) [J], with EXUDYN's own masses."""
        p = self.parameters
        rates = all_to_world(self.beam, np.ascontiguousarray(states))[:, 1]
        kinetic = np.sum(product(rates, self._straight[0]) * rates, axis=1) / 2
        along, across = shapes.nodal(states[:, : self.m], p)
        held = shapes.strain_energy(p, axial_stiffness(p), self.elements, along, across)
        energies: Array = kinetic + held
        return energies

    @cached_property
    def _straight(self) -> tuple[Array, Array, Array]:
        """M, D, K (n, n) of the straight arm in EXUDYN; its M is the same at every state."""
        return self.system().linearised()

    def deflection(self, q: Array) -> tuple[Array, Array]:
        """Return the tip along and across the hub's axis (K,), (K,) at positions (K, m) [m]."""
        return self.parameters.reach + q[:, -4], q[:, -3].copy()

    def curvature_rows(self, places: ArrayLike) -> Array:
        """Return the rows (P, m) of the beam's curvature at places; see `Plant`."""
        p = self.parameters
        nodal = shapes.hermite(self.elements, p.L, on_beam(places, p.L), 2)  # (P, 2 (N+1))
        rows = np.zeros((len(nodal), self.m))
        rows[:, FIRST + 1 :: OF_NODE], rows[:, FIRST + 3 :: OF_NODE] = (
            nodal[:, 2::2],
            nodal[:, 3::2],
        )
        return rows

    def linearised(self, theta2: float) -> LinearPlant:
        """Return the plant about rest at theta2 [rad]: joints, and the nodes' motions across.

        M, D and K are EXUDYN's. Stretching, which nothing excites but centrifugal forces, is left
        out: a straight beam has it apart from bending.
        """
        moving = np.array(
            [0, 1, *(FIRST + OF_NODE * k + j for k in range(self.elements) for j in (1, 3))]
        )
        turned = self._moved(theta2, moving)  # (n, m')
        straight = self._moved(0.0, moving)
        M, D, K = self._straight
        S, tip = np.zeros((len(moving), 2)), np.zeros(len(moving))
        S[0, 0], S[1, 1] = self.parameters.r_1, self.parameters.r_2
        tip[-2] = 1.0
        mass: Array = product(turned.T, product(M, turned))
        mass[[0, 1], [0, 1]] += LOCKED * np.array(self.held)
        return LinearPlant(
            mass,
            product(straight.T, product(D, straight)),
            product(straight.T, product(K, straight)),
            S,
            tip,
            float(theta2),
            moving,
        )

    def _moved(self, theta2: float, moving: Array) -> Array:
        """Return EXUDYN's rates (n, m') of unit rates of some coordinates, at rest at theta2."""
        states = np.tile(self.rest_state((0.0, theta2)), (len(moving), 1))
        states[np.arange(len(moving)), self.m + moving] = 1.0
        rates: Array = all_to_world(self.beam, states)[:, 1].T
        return rates

    def longest_held_step(self, friction: tuple[float, float]) -> float:
        """Return the step below which friction held over it stays stable [s], inf without any.

        The trapezoidal rule takes M q'' + D q' + K q = -D0 q'(start) as M - h/2 D0 in place of M
        and D + D0 in place of D: stable while M - h/2 D0 is positive.

        friction: of the motors' torques, the steepest [N m s/rad].
        """
        fastest = 0.0
        for pose in POSES:
            linear = self.linearised(float(pose))
            held = np.zeros_like(linear.M)
            held[[0, 1], [0, 1]] = friction * np.diag(linear.S[:2])
            fastest = max(fastest, float(eigenvalues(solve(linear.M, held)).real.max()))
        return 2 / fastest if fastest > 0 else np.inf

    def needed_force(self, q: Array, w: Array, a: Array) -> Array:
        """Refuse: EXUDYN gives accelerations of forces, not forces of accelerations.

        Raises:
            ParameterError: always.
        """
        raise ParameterError(
            f"plant {self.name!r} has no inversion of its tip; take that of the assumed modes or "
            "of the chain"
        )

    def undamped(self) -> Self:
        """Return the plant without friction at its joints or damping in its beam."""
        return replace(self, parameters=replace(self.parameters, F_1=0.0, F_2=0.0, zeta=0.0))

    def locked(self, joints: Iterable[str]) -> Self:
        """Return the plant with joints that do not move; see `Plant`.

        By constraints of EXUDYN's on their rates: its matrices are not scaled for heavy motors.
        """
        first, second = which_locked(joints)
        return replace(self, held=(first or self.held[0], second or self.held[1]))
