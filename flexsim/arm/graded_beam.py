"""A clamped beam whose stiffness and density change along it, with a load at the tip.

    >>> beam = GradedBeam.uniform(0.5, EI=0.349, rho=0.157, thickness=0.5)
    >>> finite_graded(beam).frequency[:3]     # [rad/s], of one half as thick at its tip

Between stations stiffness and density are straight lines; a taper multiplies both by what the
thickness and the width of a full section do to them. s runs from the clamp. Elements are Hermite
cubics, their matrices by Gauss's rule: exact for every density and for what is no more than a line
or a cube in the stiffness.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from flexsim.arm.beam import LOAD_MOST, Load, beta_lengths
from flexsim.arm.finite_beam import ELEMENTS, SAME_PLACE, FiniteBeam
from flexsim.errors import ParameterError
from flexsim.numerics.quadrature import gauss_legendre
from flexsim.numerics.types import Array

POINTS = 6  # of Gauss's rule to an element: exact to degree 11
THINNEST = 0.01  # of the tip's thickness and width over the clamp's: a point has no stiffness
MOST_STATIONS = 200
CLOSEST = 2000  # stations to the length: shorter elements are singular to rounding


@dataclass(frozen=True, eq=False)
class GradedBeam:
    """A beam along its length, clamped at s = 0.

    Attributes:
        place: (S,) of the stations, from 0 to the length [m].
        EI, EI_out: (S,) bending stiffness there, in the plane and out of it [N m2].
        rho: (S,) linear density there [kg/m].
        thickness, width: at the tip over those at the clamp, straight in between [-]: a section's
            density goes with both, its stiffness with the cube of the one across which it bends.
        tip_mass, tip_inertia: of a body at the tip [kg, kg m2], alike about every axis.

    Raises:
        ParameterError: a number is not finite or out of range, or stations do not rise from 0.
    """

    place: Array
    EI: Array
    EI_out: Array
    rho: Array
    thickness: float = 1.0
    width: float = 1.0
    tip_mass: float = 0.0
    tip_inertia: float = 0.0

    def __post_init__(self) -> None:
        _require(self)

    @classmethod
    def uniform(
        cls,
        length: float,
        EI: float,
        rho: float,
        EI_out: float | None = None,
        thickness: float = 1.0,
        width: float = 1.0,
        tip_mass: float = 0.0,
        tip_inertia: float = 0.0,
    ) -> Self:
        """Return a beam that is one section but for its taper; numbers at the clamp."""
        if not 0 < length < math.inf:
            raise ParameterError(f"length is {length:g} m; give a finite number above 0")
        out = EI if EI_out is None else EI_out
        place, ends = np.array([0.0, length]), np.ones(2)
        load = (tip_mass, tip_inertia)
        return cls(place, EI * ends, out * ends, rho * ends, thickness, width, *load)

    @property
    def length(self) -> float:
        """L [m]."""
        return float(self.place[-1])

    @property
    def is_uniform(self) -> bool:
        """Whether the section is the same everywhere."""
        alike = all((each == each[0]).all() for each in (self.EI, self.EI_out, self.rho))
        return alike and self.thickness == 1 and self.width == 1

    @property
    def load(self) -> Load:
        """The load at the tip over mass and mass L^2 of a beam that is uniform [-]."""
        mass = float(self.rho[0]) * self.length
        return Load(self.tip_mass / mass, self.tip_inertia / (mass * self.length**2))

    def bending(self, s: ArrayLike, out: bool = False) -> Array:
        """Return the bending stiffness at places (...,) [N m2], out of the plane if asked for."""
        thick, wide = self._section(s)
        own = np.interp(np.asarray(s, dtype=float), self.place, self.EI_out if out else self.EI)
        return np.asarray(own * (thick * wide**3 if out else wide * thick**3))

    def density(self, s: ArrayLike) -> Array:
        """Return the linear density at places (...,) [kg/m]."""
        thick, wide = self._section(s)
        return np.asarray(
            np.interp(np.asarray(s, dtype=float), self.place, self.rho) * thick * wide
        )

    def _section(self, s: ArrayLike) -> tuple[Array, Array]:
        u = np.asarray(s, dtype=float) / self.length
        return 1 + (self.thickness - 1) * u, 1 + (self.width - 1) * u

    def nodes(self, elements: int = ELEMENTS, marks: ArrayLike = ()) -> Array:
        """Return places (E+1,) from clamp to tip, stations and marks among them."""
        every = np.unique(np.concatenate([self.place, np.asarray(marks, dtype=float)]))
        every = every[np.concatenate([[True], np.diff(every) > SAME_PLACE * self.length])]
        found = [0.0]
        for start, end in pairwise(every.tolist()):
            count = max(1, math.ceil(elements * (end - start) / self.length - SAME_PLACE))
            found += np.linspace(start, end, count + 1)[1:].tolist()
        return np.array(found)

    def frequencies(self, n: int, out: bool = False) -> Array:
        """Return the first n clamped frequencies, load included, in or out of the plane [rad/s].

        Exact of a uniform beam, else by finite elements.
        """
        if self.is_uniform and max(self.load) <= LOAD_MOST:
            EI = float((self.EI_out if out else self.EI)[0])
            unit = math.sqrt(EI / float(self.rho[0])) / self.length**2
            return np.array([b * b * unit for b in beta_lengths(n, self.load)])
        return finite_graded(self, out).frequency[:n]


def finite_graded(beam: GradedBeam, out: bool = False, elements: int = ELEMENTS) -> FiniteBeam:
    """Return a beam by finite elements, in or out of the plane; elements: at least."""
    nodes = beam.nodes(elements)
    size = 2 * len(nodes)
    M, K, P, Q = np.zeros((size, size)), np.zeros((size, size)), np.zeros(size), np.zeros(size)
    node, weight = gauss_legendre(POINTS)
    u = (node + 1) / 2  # (m,) of every element, 0 to 1
    square, cube = u * u, u * u * u
    mass = first = second = 0.0
    for e, (start, end) in enumerate(pairwise(nodes.tolist())):
        h = end - start
        s, w = start + h * u, weight / 2 * h
        shape = np.array(  # (4, m) cubics of deflection and slope at both ends
            [
                1 - 3 * square + 2 * cube,
                h * (u - 2 * square + cube),
                3 * square - 2 * cube,
                h * (cube - square),
            ]
        )
        curved = np.array([12 * u - 6, h * (6 * u - 4), 6 - 12 * u, h * (6 * u - 2)]) / h**2
        take = slice(2 * e, 2 * e + 4)
        heavy, stiff = w * beam.density(s), w * beam.bending(s, out)
        for m in range(POINTS):
            M[take, take] += heavy[m] * np.outer(shape[:, m], shape[:, m])
            K[take, take] += stiff[m] * np.outer(curved[:, m], curved[:, m])
            P[take] += heavy[m] * shape[:, m]
            Q[take] += heavy[m] * s[m] * shape[:, m]
            mass += float(heavy[m])
            first += float(heavy[m] * s[m])
            second += float(heavy[m] * s[m] * s[m])
    L, m_t, J = beam.length, beam.tip_mass, beam.tip_inertia
    M[-2, -2] += m_t
    M[-1, -1] += J
    P[-2] += m_t
    Q[-2:] += [L * m_t, J]
    free = slice(2, None)  # the clamp holds the first node
    return FiniteBeam(
        nodes, M[free, free], np.zeros((size - 2, size - 2)), K[free, free], P[free], Q[free],
        mass + m_t, first + L * m_t, second + L * L * m_t + J,
    )  # fmt: skip


def _require(beam: GradedBeam) -> None:
    """Raise a ParameterError unless a beam is one."""
    count = len(beam.place)
    if not 2 <= count <= MOST_STATIONS:
        raise ParameterError(f"the beam has {count} stations; give 2 to {MOST_STATIONS}")
    if beam.place[0] != 0 or not (np.diff(beam.place) > 0).all():
        raise ParameterError("the beam's stations do not rise from s = 0; sort them, clamp first")
    nearest = float(np.diff(beam.place).min())
    if not beam.length / CLOSEST <= nearest < math.inf:
        raise ParameterError(
            f"two of the beam's stations are {nearest:g} m apart; give at least the length over "
            f"{CLOSEST}, {beam.length / CLOSEST:g} m"
        )
    for name, unit, values in (
        ("EI", "N m2", beam.EI),
        ("EI out of the plane", "N m2", beam.EI_out),
        ("rho", "kg/m", beam.rho),
    ):
        for s, value in zip(beam.place, values, strict=True):
            if not 0 < value < math.inf:
                raise ParameterError(
                    f"{name} is {value:g} {unit} at s = {s:g} m; give a finite number above 0"
                )
    for name, ratio in (("thickness", beam.thickness), ("width", beam.width)):
        if not THINNEST <= ratio <= 1 / THINNEST:
            raise ParameterError(
                f"the tip's {name} is {ratio:g} of the clamp's; give {THINNEST:g} to "
                f"{1 / THINNEST:g}"
            )
    for name, value in (("tip mass", beam.tip_mass), ("tip inertia", beam.tip_inertia)):
        if not 0 <= value < math.inf:
            raise ParameterError(f"the {name} is {value:g}; give a finite number, 0 or more")
    if beam.tip_inertia and not beam.tip_mass:
        raise ParameterError("the tip has an inertia without a mass; give --tip-mass, too")
