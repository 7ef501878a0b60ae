"""A chain of hinged segments for a beam that is not uniform, or loaded: where, and how stiff.

    >>> chain = design_graded(GradedBeam.uniform(0.5, 0.349, 0.157, tip_mass=0.05), 6)
    >>> chain.frequency[:3]               # [rad/s], the beam's own

Each piece has mass, centre and inertia of the beam it replaces. A uniform beam without a load has
the hinges and springs of `flexsim.arm.chain_design`. Otherwise these are where the search begins,
each spring scaled to the compliance int ds/EI of its cell; it moves hinges and springs as
`flexsim.arm.chain_fit` does, for the couplings to what carries the beam, while the first three
frequencies are kept exact by Newton's iteration. Out of the plane the hinges are at the same
places, and springs of their own make three frequencies exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import leastsq

from flexsim.arm.chain_design import SEGMENTS, SEGMENTS_LEAST, SEGMENTS_MOST, whole_segments
from flexsim.arm.chain_fit import (
    MANY,
    MISSED_SCALE,
    NEWTON_DONE,
    NEWTON_LONGEST,
    NEWTON_STEPS,
    ROTATION_SCALE,
    TOP_SCALE,
    VARIABLE_WEIGHT,
    Weights,
    fitted_chain,
)
from flexsim.arm.graded_beam import POINTS, GradedBeam, finite_graded
from flexsim.arm.hinged_beam import FITTED_MODES
from flexsim.errors import ModelError, ParameterError
from flexsim.numerics.dense import product, solve
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.quadrature import gauss_legendre
from flexsim.numerics.types import Array

FREQUENCY_MOST = 1e-9  # relative error of a frequency that is left
TRIALS = 1500  # evaluations of the fit
PRECISION, PRECISION_OF_MANY = 1e-8, 1e-2  # relative change of the sum of squares at its end
CELL_POINTS = 12  # of Gauss's rule to a cell: where a fit starts
STEP = 1e-10  # squared relative difference of the variables for the slopes


class Moments(NamedTuple):
    """Of a piece of the beam: mass [kg], centre from its start [m], inertia about that [kg m2]."""

    mass: float
    centre: float
    inertia: float


@dataclass(frozen=True, eq=False)
class GradedChain:
    """A chain for a beam.

    Attributes:
        beam: what it stands for. position: (N,) of the hinges from the clamp [m].
        stiffness, stiffness_out: (N,) of the hinges, in the plane and out of it [N m/rad].
        pieces: (N+1,) of the beam between clamp, hinges and tip, without the load.
        frequency, frequency_out: (N,) of the clamped chain, load included [rad/s].
        coupling_error: largest relative error of the first modes' couplings to a shift and a turn
            of the clamp, in the plane.
    """

    beam: GradedBeam
    position: Array
    stiffness: Array
    stiffness_out: Array
    pieces: list[Moments]
    frequency: Array
    frequency_out: Array
    coupling_error: float


class Target(NamedTuple):
    """What the chain is to have of the beam: frequencies (3,) [rad/s], couplings (9,) of modes of
    modal mass 1 to a shift, to a turn and to the tip, deflection and turn of the tip per force and
    moment there."""

    frequency: Array
    couplings: Array
    deflection: float
    rotation: float


def design_graded(beam: GradedBeam, segments: int = SEGMENTS) -> GradedChain:
    """Return the chain of a beam with exact first three frequencies.

    Raises:
        ParameterError: segments is not a whole number from 3 to 16, or no chain was found that
            has the beam's frequencies.
    """
    n = whole_segments(segments, SEGMENTS_LEAST, SEGMENTS_MOST, "three frequencies need three")
    a, k = (np.array(each) for each in fitted_chain(n))
    position, aimed = beam.length * a, target(beam)
    if beam.is_uniform and beam.tip_mass == 0:
        stiffness = k * float(beam.EI[0]) / beam.length
    else:
        position, stiffness = _fitted(beam, aimed, a, k)
    share = _shares(a, k)
    out = share / _cells(beam, position, out=True)
    if beam.is_uniform and beam.tip_mass == 0:
        out = k * float(beam.EI_out[0]) / beam.length
    mass = mass_of_hinges(beam, position)
    wanted_out = beam.frequencies(FITTED_MODES, out=True)
    stiffness, missed = _exact(mass, stiffness, aimed.frequency)
    out, missed_out = _exact(mass, out, wanted_out)
    if not max(missed, missed_out) <= FREQUENCY_MOST:
        raise ParameterError(
            f"no chain of {n} segments was found for this beam: a frequency is off by "
            f"{max(missed, missed_out):.2g} of itself; take another number of segments"
        )
    omega, q = _modes(mass, stiffness)
    found = _couplings(beam, position, q)
    couplings = np.abs(found / aimed.couplings - 1)[: 2 * FITTED_MODES]
    return GradedChain(
        beam,
        position,
        stiffness,
        out,
        pieces_of(beam, position),
        omega,
        _modes(mass, out)[0],
        float(couplings.max()),
    )


def target(beam: GradedBeam) -> Target:
    """Return what a chain is to have of a beam, in the plane."""
    finite = finite_graded(beam)
    V = finite.modes[:, :FITTED_MODES]
    couplings = [product(finite.P, V), product(finite.Q, V), V[-2]]
    moment = np.zeros(len(finite.K))
    moment[-1] = 1.0
    turned = float(solve(finite.K, moment)[-1])
    frequency = beam.frequencies(FITTED_MODES)
    return Target(frequency, np.concatenate(couplings), finite.compliance, turned)


def pieces_of(beam: GradedBeam, position: Array) -> list[Moments]:
    """Return mass, centre and inertia of the pieces between clamp, hinges and tip."""
    return [
        Moments(m, first / m, second - first * first / m)
        for m, first, second in _integrals(beam, position).tolist()
    ]


def mass_of_hinges(beam: GradedBeam, position: Array) -> Array:
    """Return the mass matrix (N, N) of the straight chain in hinge angles [kg m2], load included.

    int rho max(0, s - a_i) max(0, s - a_j) ds, each piece rigid, summed from the tip.
    """
    n = len(position)
    mass = np.zeros((n, n))
    behind = _integrals(beam, position)[1:].tolist()  # hinges 0 to j turn the piece behind hinge j
    for j, (m, first, second) in enumerate(behind):
        lever = position[j] - position[: j + 1]
        own = m * np.outer(lever, lever) + first * (lever[:, None] + lever) + second
        mass[: j + 1, : j + 1] += own
    arm = beam.length - position
    return mass + beam.tip_mass * np.outer(arm, arm) + beam.tip_inertia


def _integrals(beam: GradedBeam, position: Array) -> Array:
    """Return int rho (s - start)^i ds (N+1, 3) of the pieces for i = 0, 1, 2."""
    starts = np.concatenate([[0.0], position])
    marks = np.union1d(beam.place, starts)
    node, weight = gauss_legendre(POINTS)
    h = np.diff(marks)
    s = marks[:-1, None] + h[:, None] * (node + 1) / 2
    heavy = h[:, None] / 2 * weight * beam.density(s)
    piece = np.searchsorted(starts, marks[:-1], side="right") - 1
    lever = s - starts[piece][:, None]
    parts = (heavy, heavy * lever, heavy * lever * lever)
    count = len(starts)
    return np.array([np.bincount(piece, part.sum(axis=1), count) for part in parts]).T


def _cells(beam: GradedBeam, position: Array, out: bool = False) -> Array:
    """Return int ds/EI (N,) of the cells, which reach half-way to the hinges beside [rad/(N m)]."""
    middles = (position[:-1] + position[1:]) / 2
    nodes = np.union1d(beam.place, middles)
    node, weight = gauss_legendre(CELL_POINTS)
    h = np.diff(nodes)
    s = nodes[:-1, None] + h[:, None] * (node + 1) / 2
    part = (weight / 2 / beam.bending(s, out)).sum(axis=1) * h
    cell = np.searchsorted(middles, nodes[:-1], side="right")
    return np.asarray(np.bincount(cell, part, len(position)), dtype=float)


def _shares(a: Array, k: Array) -> Array:
    """Return k (N,) of a uniform chain over EI/cell [-]."""
    bounds = np.concatenate([[0.0], (a[:-1] + a[1:]) / 2, [1.0]])
    return k * np.diff(bounds)


def _modes(mass: Array, stiffness: Array) -> tuple[Array, Array]:
    """Return frequencies (N,), rising, and hinge angles (N, N) of modal mass 1."""
    mu, vectors = natural_modes(mass, np.diag(stiffness))  # of compliance: the lowest most exact
    omega = 1 / np.sqrt(mu[::-1])
    return omega, vectors[:, ::-1] * omega


def _exact(mass: Array, stiffness: Array, wanted: Array) -> tuple[Array, float]:
    """Return springs (N,), changed as little as possible in ln k, with wanted frequencies (3,).

    Also the largest error of ln omega that is left, infinite if there are no modes.
    """
    k = stiffness.copy()
    for step in range(NEWTON_STEPS + 1):
        try:
            omega, q = _modes(mass, k)
        except ModelError:
            return k, math.inf
        error = np.log(omega[:FITTED_MODES] / wanted)
        worst = float(np.abs(error).max())
        if not worst > NEWTON_DONE or step == NEWTON_STEPS:
            return k, worst if math.isfinite(worst) else math.inf
        share = (k[:, None] * q[:, :FITTED_MODES] ** 2 / (2 * omega[:FITTED_MODES] ** 2)).T
        change = product(share.T, solve(product(share, share.T), error))
        longest = float(np.abs(change).max())
        k = k * np.exp(-change * min(1.0, NEWTON_LONGEST / longest))
    return k, math.inf


def _couplings(beam: GradedBeam, position: Array, q: Array) -> Array:
    """Return couplings (9,) of the first modes: to a shift and a turn of the clamp, to the tip.

    A turn of the clamp moves the chain as a hinge there would, a shift as one infinitely far.
    """
    own, L = q[:, :FITTED_MODES], beam.length
    turn, shift = np.zeros(len(position)), np.zeros(len(position))
    for j, (m, first, second) in enumerate(_integrals(beam, position)[1:].tolist()):
        lever = position[j] - position[: j + 1]
        shift[: j + 1] += m * lever + first
        turn[: j + 1] += m * lever * position[j] + first * (lever + position[j]) + second
    arm = L - position
    shift += beam.tip_mass * arm
    turn += beam.tip_mass * arm * L + beam.tip_inertia
    signs = np.where(product(turn, own) < 0, -1.0, 1.0)  # as the beam's: positive
    moved = [product(shift, own), product(turn, own), product(arm, own)]
    return np.concatenate([each * signs for each in moved])


def _fitted(beam: GradedBeam, aimed: Target, a: Array, k: Array) -> tuple[Array, Array]:
    """Return hinges (N,) [m] and springs (N,) [N m/rad] of the least residuals from a start.

    Args:
        a, k: (N,) of the uniform chain, a/L and k L/EI. The variables are logarithms, of the N+1
            gaps and of the springs over those of the start.
    """
    n, L, weights = len(a), beam.length, Weights()
    gaps, share = np.diff(a, prepend=0.0, append=1.0), _shares(a, k)
    top = weights.top * n * n * aimed.frequency[0] / 3.516  # the uniform beam's first is 3.516

    def unpacked(x: Array) -> tuple[Array, Array]:
        gap = gaps * np.exp(x[: n + 1])
        position = L * np.cumsum(gap)[:-1] / gap.sum()
        return position, share * np.exp(x[n + 1 :]) / _cells(beam, position)

    def residuals(x: Array) -> Array:
        out = np.zeros(1 + 9 + 3 + len(x))
        position, springs = unpacked(np.clip(x, -3.0, 3.0))
        mass = mass_of_hinges(beam, position)
        springs, missed = _exact(mass, springs, aimed.frequency)
        out[0] = min(missed, 1.0) / MISSED_SCALE
        if not missed < 1.0:
            return out
        omega, q = _modes(mass, springs)
        out[1:10] = (_couplings(beam, position, q) / aimed.couplings - 1) / weights.coupling
        arm = L - position
        bent = float(np.sum(arm * arm / springs))
        out[10] = (bent / aimed.deflection - 1) / weights.coupling
        out[11] = (float(np.sum(1 / springs)) / aimed.rotation - 1) / ROTATION_SCALE
        out[12] = math.log(omega[-1] / top) / TOP_SCALE
        out[13:] = VARIABLE_WEIGHT * x
        return out

    precision = PRECISION if n <= MANY else PRECISION_OF_MANY
    found, *_ = leastsq(
        residuals,
        np.zeros(2 * n + 1),
        ftol=precision,
        xtol=precision,
        maxfev=TRIALS,
        epsfcn=STEP,
        diag=np.ones(2 * n + 1),
        full_output=True,
    )
    return unpacked(np.clip(found, -3.0, 3.0))
