"""What the models of a robot are held against: its own beam, solved as well as can be.

    >>> beam = uniform_reference(Parameters())
    >>> beam.clamped(3), beam.joint_free(3)     # [rad/s], exact

A uniform beam is solved exactly, with its payload and with free joints; one that is not by fine
finite elements. Damping ratios are the finite elements' in either case.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexsim.arm.beam import load_of, modal_integrals, mode_shapes
from flexsim.arm.finite_beam import Base, FiniteBeam, joint_free, uniform_beam
from flexsim.arm.free_arm import clamped_frequencies, joint_free_frequencies
from flexsim.arm.parameters import Parameters
from flexsim.numerics.dense import product
from flexsim.numerics.types import Array


class Couplings(NamedTuple):
    """Of n modes, each (n,): int chi dx [m], int (x-r) chi dx [m2], chi at the tip [-].

    Over the payload's mass, too, as `ModalIntegrals`; modal masses are rho L.
    """

    Phi: Array
    moment: Array
    tip: Array


@dataclass(frozen=True, eq=False)
class ReferenceBeam:
    """A robot's beam and how it vibrates.

    Attributes:
        base: the robot, its beam as a uniform one: with the same length, mass without payload, and
            static deflection under a force at the tip. finite: the beam by finite elements.
        uniform: whether it is uniform, so that the base's parameters are all there is of it.
    """

    base: Base
    finite: FiniteBeam
    uniform: bool = True

    @property
    def parameters(self) -> Parameters:
        """The robot with the uniform beam."""
        return self.base.parameters

    @property
    def method(self) -> str:
        """How its frequencies are found, in words."""
        return "exact" if self.uniform else "finite elements"

    def clamped(self, n: int) -> Array:
        """Return the first n frequencies with the joints locked [rad/s]."""
        if self.uniform:
            return clamped_frequencies(self.parameters, n)
        return self.finite.frequency[:n]

    def joint_free(self, n: int, theta2: float = 0.0) -> Array:
        """Return the first n flexible frequencies with both joints free [rad/s]."""
        if self.uniform and self.base.first == 0:
            return joint_free_frequencies(self.parameters, n, theta2)
        return joint_free(self.finite, self.base, theta2)[0][:n]

    def truncation(self, n: int) -> float:
        """Return how far the joint-free frequencies of n clamped modes are off at most, relative.

        Much where the beam is heavy beside hub and link.
        """
        few = joint_free(self.finite, self.base, modes=n)[0]
        return float(np.abs(few / joint_free(self.finite, self.base)[0][:n] - 1).max())

    def clamped_damping(self, n: int) -> Array:
        """Return damping ratios (n,) with the joints locked, to first order [-]."""
        return self.finite.damping_ratio[:n]

    def joint_free_damping(self, n: int, theta2: float = 0.0) -> Array:
        """Return damping ratios (n,) with both joints free, their friction with it [-]."""
        return joint_free(self.finite, self.base, theta2)[1][:n]

    def couplings(self, n: int) -> Couplings:
        """Return what couples the first n modes to the joints, and their tip values."""
        p = self.parameters
        if self.uniform:
            exact = modal_integrals(p, n)
            return Couplings(exact.Phi, exact.x_chi - p.r * exact.Phi, exact.tip)
        V, scale = self.finite.modes[:, :n], float(np.sqrt(p.m_b))  # modal mass 1 to rho L
        P, Q = product(self.finite.P, V), product(self.finite.Q, V)
        return Couplings(P * scale / p.rho, Q * scale / p.rho, V[-2] * scale)

    def shapes(self, place: ArrayLike, n: int) -> Array:
        """Return the first n modes (..., n) at places from the clamp [m], modal masses rho L."""
        p = self.parameters
        if self.uniform:
            return mode_shapes(n, np.asarray(place) / p.L, 0, load_of(p))
        return self.finite.shapes(place, n) * float(np.sqrt(p.m_b))

    @property
    def compliance(self) -> float:
        """Static deflection of the tip per force on it [m/N]."""
        return self.parameters.static_compliance if self.uniform else self.finite.compliance


def uniform_reference(parameters: Parameters) -> ReferenceBeam:
    """Return the beam of a robot that has no file."""
    return ReferenceBeam(Base(parameters), uniform_beam(parameters))
