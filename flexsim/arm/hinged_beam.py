"""How does a clamped chain of hinged segments vibrate? Its linear dynamics, in closed form.

    >>> from flexsim.arm.hinged_beam import chain_modes
    >>> omega, q = chain_modes(np.array([0.25, 0.75]), np.array([2.0, 2.0]))

Everything is dimensionless: lengths over L, stiffness over EI/L, frequencies over
sqrt(EI/rho)/L^2. a: (N,) positions of the hinges from the clamp; k: (N,) stiffnesses. A unit angle
of hinge j moves the point s by max(0, s - a_j), and since every piece is rigid, the mass matrix of
the uniform beam under these shapes is exact. All is compiled scalar code, for `chain_design`.
"""

from __future__ import annotations

import math

import numpy as np

from flexsim.arm.beam import MODES, Load, beta_lengths, mode_constants, mode_shape
from flexsim.errors import ModelError
from flexsim.numerics.eigen import rotated
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array

FITTED_MODES = MODES
ERRORS, COUPLINGS = 11, 6  # of `shape_errors`, the couplings first


def beam_modes() -> Array:
    """Return (3, 3) of the beam's modes: beta_i L, and the two constants of `mode_constants`."""
    return np.array([(b, *mode_constants(b)) for b in beta_lengths(FITTED_MODES)])


@jit
def mass_matrix(a: Array) -> Array:
    """Return the mass matrix (N, N) in hinge angles, int max(0, s-a_i) max(0, s-a_j) ds."""
    mass = np.empty((a.shape[0], a.shape[0]))
    for i in range(a.shape[0]):
        for j in range(a.shape[0]):
            u = 1.0 - max(a[i], a[j])
            mass[i, j] = u * u * u / 3.0 + abs(a[i] - a[j]) * u * u / 2.0
    return mass


@jit
def fill_modes(a: Array, k: Array, omega: Array, q: Array) -> bool:
    """Fill frequencies (N,) and hinge angles (N, N) as `chain_modes`; return whether it could."""
    n = a.shape[0]
    flexibility = mass_matrix(a)
    for i in range(n):
        for j in range(n):
            flexibility[i, j] /= math.sqrt(k[i]) * math.sqrt(k[j])
    inverse_square, vectors = np.empty(n), np.empty((n, n))
    if not rotated(flexibility, inverse_square, vectors) or not inverse_square[0] > 0.0:
        return False
    for i in range(n):
        omega[i] = 1.0 / math.sqrt(inverse_square[n - 1 - i])
        tip = 0.0
        for j in range(n):
            q[j, i] = vectors[j, n - 1 - i] * omega[i] / math.sqrt(k[j])  # q'Mq = 1
            tip += (1.0 - a[j]) * q[j, i]
        if (tip < 0.0) != (i % 2 == 1):
            for j in range(n):
                q[j, i] = -q[j, i]
    return True


def chain_modes(a: Array, k: Array) -> tuple[Array, Array]:
    """Return frequencies (N,), rising, and hinge angles (N, N), a column per mode.

    Modes have int chi^2 ds = 1 as (15), and its signs at the tip: plus, minus, plus, ...

    Raises:
        ModelError: two hinges are in one place, or a stiffness is not a number above 0.
    """
    omega, q = np.empty(len(a)), np.empty((len(a), len(a)))
    if not fill_modes(a, k, omega, q):
        raise ModelError("the chain has no modes: give its hinges places and springs of their own")
    return omega, q


@jit
def fill_loaded(
    a: Array, omega: Array, q: Array, mass: float, inertia: float, loaded: Array
) -> bool:
    """Fill the first frequencies (3,) under a payload; return whether there are such.

    From the chain's own modes, `fill_modes`: in them the payload adds mass times tip value by tip
    value, and inertia times tip slope by tip slope, to the identity.
    """
    n = a.shape[0]
    value, slope = np.zeros(n), np.zeros(n)  # over omega
    for i in range(n):
        for j in range(n):
            value[i] += (1.0 - a[j]) * q[j, i] / omega[i]
            slope[i] += q[j, i] / omega[i]
    flexibility, inverse_square, vectors = np.empty((n, n)), np.empty(n), np.empty((n, n))
    for i in range(n):
        for j in range(n):
            flexibility[i, j] = mass * value[i] * value[j] + inertia * slope[i] * slope[j]
        flexibility[i, i] += 1.0 / (omega[i] * omega[i])
    if not rotated(flexibility, inverse_square, vectors):
        return False
    for i in range(FITTED_MODES):
        if not inverse_square[n - 1 - i] > 0.0:
            return False
        loaded[i] = 1.0 / math.sqrt(inverse_square[n - 1 - i])
    return True


def loaded_frequencies(a: Array, k: Array, load: Load) -> Array:
    """Return the first frequencies (3,) of a chain with a payload at its tip.

    Raises:
        ModelError: as `chain_modes`.
    """
    omega, q = chain_modes(a, k)
    loaded = np.empty(FITTED_MODES)
    if not fill_loaded(a, omega, q, load.mass, load.inertia, loaded):
        raise ModelError("the chain has no modes under its payload")
    return loaded


@jit
def frequency_sensitivity(k: Array, omega: Array, q: Array) -> Array:
    """Return d ln omega_i / d ln k_j (3, N): the share of hinge j in the energy, halved."""
    share = np.empty((FITTED_MODES, k.shape[0]))
    for i in range(FITTED_MODES):
        for j in range(k.shape[0]):
            share[i, j] = k[j] * q[j, i] * q[j, i] / (2.0 * omega[i] * omega[i])
    return share


@jit
def fill_shape_errors(a: Array, k: Array, q: Array, beam: Array, errors: Array) -> None:
    """Fill errors (11,) as `shape_errors`; beam: of `beam_modes`."""
    errors[:] = 0.0
    for j in range(a.shape[0]):
        u = 1.0 - a[j]
        for i in range(FITTED_MODES):  # the integrals of max(0, s - a)
            errors[i] += u * u / 2.0 * q[j, i]
            errors[3 + i] += (u * u * u / 3.0 + a[j] * u * u / 2.0) * q[j, i]
            errors[6 + i] += u * q[j, i]
        errors[9] += 3.0 * u * u / k[j]
        errors[10] += 1.0 / k[j]
    for i in range(FITTED_MODES):
        b, growing, quotient = beam[i, 0], beam[i, 1], beam[i, 2]
        errors[i] /= 2.0 * quotient / b
        errors[3 + i] /= 2.0 / (b * b)
        errors[6 + i] /= mode_shape(b, growing, quotient, 1.0, 0)
    errors -= 1.0


def shape_errors(a: Array, k: Array, q: Array) -> Array:
    """Return eleven relative errors (11,) against the beam.

    Three each of int chi_i ds, int s chi_i ds and chi_i(tip); then of the tip's deflection under a
    force there, and of its rotation under a moment.
    The beam's: 2 sigma/b, 2/b^2, 2 (-1)^(i+1), with b = beta_i L; 1/3; and 1.
    """
    errors = np.empty(ERRORS)
    fill_shape_errors(a, k, q, beam_modes(), errors)
    return errors


@jit
def fill_shapes(a: Array, q: Array, beam: Array, chain: Array, exact: Array) -> None:
    """Fill chain and exact (N+1, 3) as `shapes_at_nodes`; beam: of `beam_modes`."""
    n = a.shape[0]
    for i in range(FITTED_MODES):
        b, growing, quotient = beam[i, 0], beam[i, 1], beam[i, 2]
        chain_length = exact_length = 0.0
        for node in range(n + 1):
            s = a[node] if node < n else 1.0
            moved = 0.0
            for j in range(min(node, n)):
                moved += (s - a[j]) * q[j, i]
            chain[node, i] = moved
            exact[node, i] = mode_shape(b, growing, quotient, s, 0)
            chain_length += moved * moved
            exact_length += exact[node, i] * exact[node, i]
        for node in range(n + 1):
            chain[node, i] /= math.sqrt(chain_length)
            exact[node, i] /= math.sqrt(exact_length)


def shapes_at_nodes(a: Array, q: Array) -> tuple[Array, Array]:
    """Return the first modes of chain and beam at hinges and tip (N+1, 3), unit columns."""
    chain, exact = np.empty((len(a) + 1, FITTED_MODES)), np.empty((len(a) + 1, FITTED_MODES))
    fill_shapes(a, q, beam_modes(), chain, exact)
    return chain, exact
