"""What the closed loop, studies and recordings ask of a plant, whichever model of the arm it is."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from numpy.typing import ArrayLike

from flexsim.arm.parameters import Parameters
from flexsim.numerics.types import Array

MODES_SHOWN = 3  # modal coordinates that the chain's shape is projected on


@dataclass(frozen=True, eq=False)
class Observation:
    """What states (K, 2 m) look like: columns as in `flexsim.loop.motion.Motion`."""

    joint: Array
    v: Array
    tip: Array
    modal: Array
    energy: Array
    beam: Array


class Plant(Protocol):
    """What the closed loop, studies and recordings ask of a plant.

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

    def running(self, threads: int) -> AbstractContextManager[Any]:
        """Give the coefficients for compiled code, alive as long as the block runs."""

    def rest_state(self, theta: ArrayLike) -> Array:
        """Return the state (2 m,) at rest at joint angles (2,) [rad], beam straight."""

    def observe(self, states: Array, energy: bool = True) -> Observation:
        """Return what states (K, 2 m) look like; energy is nan where not wanted."""
