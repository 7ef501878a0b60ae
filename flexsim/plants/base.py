"""What the closed loop, studies and recordings ask of a plant, whichever model of the arm it is.

>>> plant = Robot().plant("chain", setting("none"))
>>> plant.step, plant.integrator, plant.linearised(1.2).M.shape

Nobody asks for a plant's class: what differs between models is behind these names.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, Self

from numpy.typing import ArrayLike

from flexsim.arm.parameters import Parameters
from flexsim.numerics.types import Array
from flexsim.plants.linear_plant import LinearPlant

if TYPE_CHECKING:
    import mujoco

MODES_SHOWN = 3  # modal coordinates that a chain's or rod's shape is projected on


@dataclass(frozen=True, eq=False)
class Observation:
    """What states (K, 2 m) look like: columns as in `flexsim.loop.motion.Motion`."""

    joint: Array
    v: Array
    tip: Array
    modal: Array
    energy: Array
    beam: Array
    link1: Array | None = None


class Plant(Protocol):
    """A model of the arm: to be run, looked at, linearised, inverted.

    A state is one array (2 m,): generalised positions, then their rates; theta1 and theta2 first.
    `running(threads)` gives coefficients that `flexsim.plants.dispatch` knows by their type.
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

    @property
    def integrator(self) -> str:
        """What takes the steps: trapezoidal, or of `flexsim.numerics.step_limits.INTEGRATORS`."""

    @property
    def mjcf(self) -> str | None:
        """Text of the plant's own MJCF file, None for equations."""

    @property
    def model(self) -> mujoco.MjModel | None:
        """That file as MuJoCo compiled it, None for equations."""

    def running(self, threads: int) -> AbstractContextManager[Any]:
        """Give the coefficients for compiled code, alive as long as the block runs."""

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 m,) at rest at joint angles (2,) [rad], beam straight."""

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 m) look like; energy is nan where not wanted."""

    def deflection(self, q: Array) -> tuple[Array, Array]:
        """Return the tip along and across the hub's axis (K,), (K,) at positions (K, m) [m]."""

    def curvature_rows(self, places: ArrayLike) -> Array:
        """Return the matrix (P, m) from positions to v'' at places (P,) from the clamp [1/m, m].

        To first order, positive where the beam bends towards +v; see `flexsim.plants.curvature`.

        Raises:
            ParameterError: a place off the beam, or no beam that bends.
        """

    @property
    def bridge_sites(self) -> tuple[float, float] | None:
        """Places of strain bridges that the plant's file has, from the clamp [m], or None."""

    def linearised(self, theta2: float) -> LinearPlant:
        """Return the plant about rest at theta2 [rad].

        Raises:
            ModelError: a file has dry friction, a limit or the like, named.
        """

    def needed_force(self, q: Array, w: Array, a: Array) -> Array:
        """Return the generalised forces (K, m) that a motion needs: inverse dynamics.

        Args:
            q, w, a: (K, m) positions, rates, accelerations.

        Raises:
            ParameterError: the model has none.
        """

    def undamped(self) -> Self:
        """Return the plant without friction at its joints or damping in its beam."""

    def locked(self, joints: Iterable[str]) -> Self:
        """Return the plant whose joints of these names, joint1 or joint2, do not move.

        Raises:
            ParameterError: there is no joint of that name.
        """
