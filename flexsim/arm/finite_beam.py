"""A clamped beam that is not uniform, by finite elements: frequencies, damping, couplings.

    >>> beam = finite_beam([Piece(0.25, EI=0.349, rho=0.157), Piece(0.25, EI=0.2, rho=0.157)])
    >>> beam.frequency[:3] / 6.283185307179586        # [Hz], clamped
    >>> joint_free(beam, Base(Parameters()))[0][:3]   # [rad/s], both joints free, straight arm

Hermite cubics with their consistent masses: frequencies converge from above with fourth order. Of a
uniform beam `flexsim.arm.beam` and `flexsim.arm.free_arm` have the exact solution; this is the
reference where there is none. s runs from the clamp.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.dense import product, solve
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.elementary import cubed
from flexsim.numerics.types import Array

ELEMENTS = 48  # of the whole beam, unless told otherwise: 5e-7 in the third frequency, 1e-8 in ...
# the first, which the tests hold; a jump of a piece's EI is always between two elements
KEPT = 40  # clamped modes that the joints are freed on; 30 leave 2e-9 of the third frequency
SAME_PLACE = 1e-9  # of the beam's length: ends and lumps nearer than this are one

# mass of a Hermite element over rho h, in (v, h v', v, h v') of its ends, and the same of EI/h^3
MASS = (
    np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420.0
)
BENDING = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4.0]])
FORCE = np.array([1 / 2, 1 / 12, 1 / 2, -1 / 12])  # integral of the four shapes over h
TORQUE = np.array([3 / 20, 1 / 30, 7 / 20, -1 / 20])  # of s times them, from the first end


class Piece(NamedTuple):
    """A uniform piece of the beam: length [m], EI [N m2], rho [kg/m], Kelvin-Voigt time [s]."""

    length: float
    EI: float
    rho: float
    eta: float = 0.0


class Lump(NamedTuple):
    """A rigid body fixed to the beam at a place from the clamp [m].

    mass [kg]; first: mass times how far its centre lies ahead of the place [kg m]; second: moment
    of inertia about the place [kg m2].
    """

    place: float
    mass: float
    first: float = 0.0
    second: float = 0.0


@dataclass(frozen=True, eq=False)
class FiniteBeam:
    """A clamped beam of finite elements.

    Attributes:
        nodes: (E+1,) from the clamp [m]. M, D, K: (2E, 2E) of deflection and slope of the nodes
            behind the clamp [SI, mixed]. P, Q: (2E,) their couplings to a shift [kg] and to a
            turn about the clamp [kg m]. mass, first, second: moments about the clamp of the
            straight beam, lumps included [kg, kg m, kg m2].
    """

    nodes: Array
    M: Array
    D: Array
    K: Array
    P: Array
    Q: Array
    mass: float
    first: float
    second: float

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        """Frequencies (m,) and vectors (2E, m) with V'MV = 1, of compliance, so that the lowest
        are the most exact and massless pieces do no harm."""
        mu, vectors = natural_modes(self.M, self.K)
        kept = min(KEPT, len(mu))
        mu, vectors = mu[::-1][:kept], vectors[:, ::-1][:, :kept]
        kept = int(np.sum(mu > np.finfo(float).eps * mu[0]))
        omega = 1 / np.sqrt(mu[:kept])
        vectors = vectors[:, :kept] * omega
        return omega, vectors * np.sign(product(self.Q, vectors))

    @property
    def frequency(self) -> Array:
        """Clamped frequencies, rising, (m,) [rad/s]."""
        return self._modes[0]

    @property
    def modes(self) -> Array:
        """Modes (2E, m) of modal mass 1, positive beside the clamp, as is their moment about it."""
        return self._modes[1]

    @property
    def damping_ratio(self) -> Array:
        """Ratios (m,) of the clamped modes, to first order in the damping [-]."""
        omega, V = self._modes
        ratio: Array = np.sum(V * product(self.D, V), axis=0) / (2 * omega)
        return ratio

    @property
    def compliance(self) -> float:
        """Static deflection of the tip per force on it [m/N]."""
        force = np.zeros(len(self.K))
        force[-2] = 1.0
        return float(solve(self.K, force)[-2])

    def shapes(self, place: ArrayLike, n: int) -> Array:
        """Return deflections (..., n) of the first modes at places from the clamp [m]."""
        s = np.asarray(place, dtype=float)
        e = np.clip(np.searchsorted(self.nodes, s, side="right") - 1, 0, len(self.nodes) - 2)
        h = np.diff(self.nodes)[e]
        u = (s - self.nodes[e]) / h
        square, cube = u * u, cubed(u)
        cubic = (
            1 - 3 * square + 2 * cube,
            h * (u - 2 * square + cube),
            3 * square - 2 * cube,
            h * (cube - square),
        )
        V = np.vstack([np.zeros((2, n)), self.modes[:, :n]])  # with the clamp
        return np.asarray(sum(c[..., None] * V[2 * e + i] for i, c in enumerate(cubic)))


@dataclass(frozen=True)
class Base:
    """What carries the beam: link and hub of a robot, whose beam does not count here.

    Attributes:
        parameters: the robot.
        first: the hub's mass times how far its centre lies from joint 2 [kg m].
    """

    parameters: Parameters
    first: float = 0.0


def finite_beam(
    pieces: Sequence[Piece], lumps: Sequence[Lump] = (), elements: int = ELEMENTS
) -> FiniteBeam:
    """Return the beam of these pieces, one after the other from the clamp, with these lumps.

    Args:
        pieces: at least one. lumps: on the beam. elements: of the whole, at least; each piece has
            a whole number of its own.

    Raises:
        ParameterError: a piece without length or stiffness, a negative mass or damping, a lump
            that is beside the beam or no rigid body, or no mass at all.
    """
    ends = np.concatenate([[0.0], np.cumsum([piece.length for piece in pieces])])
    _require_beam(pieces, lumps, float(ends[-1]))
    nodes, own = _mesh(ends, [lump.place for lump in lumps], elements)
    size = 2 * len(nodes)
    M, D, K = (np.zeros((size, size)) for _ in range(3))
    P, Q, second = np.zeros(size), np.zeros(size), 0.0
    for e, (start, end) in enumerate(pairwise(nodes)):
        piece, h = pieces[own[e]], end - start
        scale = np.array([1.0, h, 1.0, h])
        take, both = slice(2 * e, 2 * e + 4), np.outer(scale, scale)
        bending = piece.EI / h**3 * BENDING * both
        M[take, take] += piece.rho * h * MASS * both
        K[take, take] += bending
        D[take, take] += piece.eta * bending
        P[take] += piece.rho * h * FORCE * scale
        Q[take] += piece.rho * h * (start * FORCE + h * TORQUE) * scale
        second += piece.rho * (end**3 - start**3) / 3
    for lump in lumps:
        i = 2 * int(np.argmin(np.abs(nodes - lump.place)))
        s, own_matrix = lump.place, np.array([[lump.mass, lump.first], [lump.first, lump.second]])
        M[i : i + 2, i : i + 2] += own_matrix
        P[i : i + 2] += own_matrix[0]
        Q[i : i + 2] += s * own_matrix[0] + own_matrix[1]
        second += s * s * lump.mass + 2 * s * lump.first + lump.second
    mass = sum(p.rho * p.length for p in pieces) + sum(lump.mass for lump in lumps)
    middles = (ends[:-1] + ends[1:]) / 2
    first = sum(p.rho * p.length * s for p, s in zip(pieces, middles, strict=True))
    first += sum(lump.mass * lump.place + lump.first for lump in lumps)
    free = slice(2, None)  # the clamp holds the first node
    return FiniteBeam(
        nodes, M[free, free], D[free, free], K[free, free], P[free], Q[free],
        float(mass), float(first), float(second),
    )  # fmt: skip


def uniform_beam(parameters: Parameters, elements: int = ELEMENTS) -> FiniteBeam:
    """Return the beam of a robot, with its payload, by finite elements."""
    p = parameters
    payload = Lump(p.L, p.payload, 0.0, p.payload_inertia)
    lumps = [payload] if p.payload or p.payload_inertia else []
    return finite_beam([Piece(p.L, p.EI, p.rho, p.eta)], lumps, elements)


def joint_free(
    beam: FiniteBeam, base: Base, theta2: float = 0.0, modes: int = KEPT
) -> tuple[Array, Array]:
    """Return flexible frequencies (m,) [rad/s] and damping ratios (m,) [-], both joints free.

    Args:
        beam: as clamped. base: what carries it, its joints' viscous friction with it.
        theta2: pose of joint 2, beam straight [rad]. modes: clamped ones at most, of which the
            motion is made up; few of them are a model of its own.

    Ratios are of first order in the damping: v'Dv over 2 omega v'Mv of the undamped modes.
    """
    p, omega, V = base.parameters, beam.frequency[:modes], beam.modes[:, :modes]
    about = p.I_H + beam.second + 2 * p.r * beam.first + p.r**2 * beam.mass  # joint 2
    across = p.L_R * math.cos(theta2)
    carried = base.first + beam.first + p.r * beam.mass
    turned, shifted = product(beam.Q + p.r * beam.P, V), across * product(beam.P, V)
    m = len(omega)
    M, D, K = np.eye(m + 2), np.zeros((m + 2, m + 2)), np.zeros((m + 2, m + 2))
    M[1, 1] = about
    M[0, 1] = M[1, 0] = about + across * carried
    M[0, 0] = p.I_m1 + p.I_R0 + p.L_R**2 * (p.m_H + beam.mass) + 2 * M[0, 1] - about
    M[1, 1] += p.I_m2
    M[0, 2:] = M[2:, 0] = turned + shifted
    M[1, 2:] = M[2:, 1] = turned
    K[2:, 2:] = np.diag(omega**2)
    D[2:, 2:] = product(V.T, product(beam.D, V))
    D[0, 0], D[1, 1] = p.F_1 * p.r_1**2, p.F_2 * p.r_2**2
    return flexible_modes(M, D, K)


def flexible_modes(M: Array, D: Array, K: Array) -> tuple[Array, Array]:
    """Return frequencies (m-2,) [rad/s] and damping ratios (m-2,) of an arm with free joints.

    Args:
        M, D, K: (m, m), the joints first, K nothing of theirs.
    """
    squared, vectors = natural_modes(K, M)
    omega, V = np.sqrt(squared[2:]), vectors[:, 2:]
    return omega, np.sum(V * product(D, V), axis=0) / (2 * omega)


def _mesh(ends: Array, places: Sequence[float], elements: int) -> tuple[Array, list[int]]:
    """Return nodes (E+1,), among them all ends and places, and the piece of each element."""
    L = float(ends[-1])
    marks = np.unique(np.concatenate([ends, places]))
    marks = marks[np.concatenate([[True], np.diff(marks) > SAME_PLACE * L])]
    marks[-1] = L
    nodes, own = [0.0], []
    for start, end in pairwise(marks.tolist()):
        count = math.ceil(elements * (end - start) / L - SAME_PLACE)
        nodes += np.linspace(start, end, max(count, 1) + 1)[1:].tolist()
        piece = int(np.searchsorted(ends, (start + end) / 2)) - 1
        own += [piece] * max(count, 1)
    return np.array(nodes), own


def _require_beam(pieces: Sequence[Piece], lumps: Sequence[Lump], L: float) -> None:
    for i, piece in enumerate(pieces, start=1):
        least = min(piece.rho, piece.eta)
        if not (0 < piece.length < math.inf and 0 < piece.EI < math.inf and 0 <= least < math.inf):
            raise ParameterError(
                f"piece {i} of the beam has length {piece.length:g} m, EI {piece.EI:g} N m2, rho "
                f"{piece.rho:g} kg/m, eta {piece.eta:g} s; give the first two above 0, none below"
            )
    for lump in lumps:
        if not -SAME_PLACE * L <= lump.place <= (1 + SAME_PLACE) * L:
            raise ParameterError(f"a mass is {lump.place:g} m from the clamp; give 0 to {L:g} m")
        rounding = SAME_PLACE * lump.mass * lump.second
        if lump.mass < 0 or lump.second < 0 or lump.first**2 > lump.mass * lump.second + rounding:
            raise ParameterError(
                f"a body {lump.place:g} m from the clamp has mass {lump.mass:g} kg, moments "
                f"{lump.first:g} kg m and {lump.second:g} kg m2; no rigid body has these"
            )
    if not any(piece.rho for piece in pieces) and not any(lump.mass for lump in lumps):
        raise ParameterError("the beam has no mass; give a piece or a lump some")
