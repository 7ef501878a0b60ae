"""How does a clamped chain of hinged segments vibrate? Its linear dynamics, in closed form.

    >>> from flexsim.arm.hinged_beam import chain_modes
    >>> omega, q = chain_modes(np.array([0.25, 0.75]), np.array([2.0, 2.0]))

Everything is dimensionless: lengths over L, stiffness over EI/L, frequencies over
sqrt(EI/rho)/L^2. a: (..., N) positions of the hinges from the clamp; k: (..., N) stiffnesses;
leading axes are a batch. A unit angle of hinge j moves the point s by max(0, s - a_j), and since
every piece is rigid, the mass matrix of the uniform beam under these shapes is exact.
"""

from __future__ import annotations

import numpy as np

from flexsim.arm.beam import beta_lengths, mode_shapes, sigma
from flexsim.numerics.types import Array

TUNED_MODES = 3


def mass_matrix(a: Array) -> Array:
    """Return the mass matrix (..., N, N) in hinge angles, int max(0, s-a_i) max(0, s-a_j) ds."""
    nearer = np.minimum(a[..., :, None], a[..., None, :])
    farther = np.maximum(a[..., :, None], a[..., None, :])
    u = 1 - farther
    mass: Array = u**3 / 3 + (farther - nearer) * u**2 / 2  # (..., N, N)
    return mass


def chain_modes(a: Array, k: Array) -> tuple[Array, Array]:
    """Return frequencies (..., N), rising, and hinge angles (..., N, N), a column per mode.

    Modes have int chi^2 ds = 1 as (15), and its signs at the tip: plus, minus, plus, ...
    """
    root = 1 / np.sqrt(k)
    flexibility = root[..., :, None] * mass_matrix(a) * root[..., None, :]
    inverse_square, vectors = np.linalg.eigh(flexibility)
    omega = 1 / np.sqrt(inverse_square[..., ::-1])
    q = root[..., :, None] * vectors[..., ::-1] * omega[..., None, :]  # q' M q = 1
    tip = np.einsum("...j,...ji->...i", 1 - a, q)
    alternating = np.where(np.arange(tip.shape[-1]) % 2, -1.0, 1.0)
    return omega, q * (alternating * np.sign(tip))[..., None, :]


def frequency_sensitivity(k: Array, omega: Array, q: Array) -> Array:
    """Return d ln omega_i / d ln k_j (..., 3, N): the share of hinge j in the energy, halved."""
    share = k[..., :, None] * q**2 / (2 * omega[..., None, :] ** 2)
    return np.swapaxes(share[..., :TUNED_MODES], -1, -2)


def shape_errors(a: Array, k: Array, q: Array) -> Array:
    """Return ten relative errors (..., 10) against the beam, in the order of the columns.

    Three each of int chi_i ds, int s chi_i ds and chi_i(tip); then of the static tip compliance.
    The beam's: 2 sigma/b, 2/b^2, 2 (-1)^(i+1), with b = beta_i L; and 1/3.
    """
    b = np.array(beta_lengths(TUNED_MODES))
    u = 1 - a
    per_hinge = (u**2 / 2, u**3 / 3 + a * u**2 / 2, u)  # the same integrals of max(0, s - a)
    beam = (2 * sigma(b) / b, 2 / b**2, mode_shapes(TUNED_MODES, 1.0))
    modes = [
        np.einsum("...j,...ji->...i", hinge, q[..., :TUNED_MODES]) / exact - 1
        for hinge, exact in zip(per_hinge, beam, strict=True)
    ]
    compliance = 3 * np.sum(u**2 / k, axis=-1, keepdims=True) - 1
    return np.concatenate([*modes, compliance], axis=-1)


def shapes_at_nodes(a: Array, q: Array) -> tuple[Array, Array]:
    """Return the first modes of chain and beam at hinges and tip (..., N+1, 3), unit columns."""
    nodes = np.concatenate([a, np.ones_like(a[..., :1])], axis=-1)
    moved = np.maximum(nodes[..., :, None] - a[..., None, :], 0)  # (..., N+1, N)
    chain = moved @ q[..., :TUNED_MODES]
    beam = mode_shapes(TUNED_MODES, nodes)
    unit = [s / np.linalg.norm(s, axis=-2, keepdims=True) for s in (chain, beam)]
    return unit[0], unit[1]
