"""Clamped-free beam modes (15) and their integrals (6)-(14), exact to rounding for any number.

    >>> from flexsim import Parameters
    >>> from flexsim.arm.beam import modal_integrals
    >>> modal_integrals(Parameters(), 3).frequency / 6.283185307179586   # [Hz]
    array([ 3.33728858, 20.91443054, 58.56101111])

x runs from r to r + L along the undeformed beam, as in the paper; s = x - r from the clamp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.dense import product
from flexsim.numerics.jit import jit
from flexsim.numerics.quadrature import gauss_legendre
from flexsim.numerics.types import Array

MODES = 3  # of the paper's model
MODES_MAX = 40  # quadrature of products of modes is checked to rounding up to here


def beta_lengths(n: int) -> tuple[float, ...]:
    """Return beta_i L, the first n roots of cos(b) cosh(b) = -1 [-].

    Raises:
        ParameterError: n is not a whole number from 1 to MODES_MAX.
    """
    if not isinstance(n, int | np.integer) or isinstance(n, bool) or not 1 <= n <= MODES_MAX:
        raise ParameterError(f"number of modes is {n!r}; give a whole number from 1 to {MODES_MAX}")
    return _beta_lengths(int(n))


@lru_cache
def _beta_lengths(n: int) -> tuple[float, ...]:
    # cos b + 1/cosh b: the same roots, without overflow; one within 0.31 of each (i - 1/2) pi.
    # brentq closes in on a change of sign, so what it returns is a root, or it raises
    roots = []
    for i in range(1, n + 1):
        middle = (i - 0.5) * math.pi
        roots.append(
            brentq(lambda b: math.cos(b) + 1 / math.cosh(b), middle - 0.4, middle + 0.4, xtol=1e-15)
        )
    return tuple(roots)


@jit
def mode_constants(b: float):  # type: ignore[no-untyped-def]
    """Return (1 - sigma)/2 e^b and sigma of (15) at b = beta L [-].

    sigma is the quotient (cosh + cos)/(sinh + sin), multiplied through by e^-b, so that large b
    cannot overflow.
    """
    e = math.exp(-b)
    below = 1.0 - e * e + 2.0 * e * math.sin(b)
    growing = (math.sin(b) - math.cos(b) - e) / below
    return growing, (1.0 + e * e + 2.0 * e * math.cos(b)) / below


@jit
def mode_shape(b: float, growing: float, quotient: float, s: float, derivative: int) -> float:
    """Return one mode (15), or a derivative, at s = s/L [-]; the constants of `mode_constants`.

    Source: (15), with cosh - sigma sinh written through decaying exponentials, the factor e^-b
    inside 1 - sigma taken into the exponent.
    """
    rising, falling = growing * math.exp(b * (s - 1.0)), 0.5 * (1.0 + quotient) * math.exp(-b * s)
    cosine, sine = math.cos(b * s), math.sin(b * s)
    if derivative % 2:
        falling, cosine, sine = -falling, -sine, cosine  # each differentiated once
    around = quotient * sine - cosine
    if derivative % 4 > 1:
        around = -around
    value = rising + falling + around
    for _ in range(derivative):
        value *= b
    return value


@jit
def _fill_shapes(b: Array, s: Array, derivative: int, out: Array) -> None:
    """Fill out (K, n) with the modes of b (n,) at s (K,)."""
    for i in range(b.shape[0]):
        growing, quotient = mode_constants(b[i])
        for k in range(s.shape[0]):
            out[k, i] = mode_shape(b[i], growing, quotient, s[k], derivative)


def sigma(beta_length: ArrayLike) -> Array:
    """Return the quotient (cosh + cos)/(sinh + sin) of (15) at beta L [-]."""
    b = np.asarray(beta_length, dtype=float)
    return np.array([mode_constants(each)[1] for each in b.flat]).reshape(b.shape)


def mode_shapes(n: int, s_over_L: ArrayLike, derivative: int = 0) -> Array:
    """Return the first n modes (15), or a derivative with respect to s/L [-].

    Args:
        n: number of modes.
        s_over_L: distance from the clamp over L, any shape (...,) [-].
        derivative: 0 to 4.

    Returns:
        (..., n), normalised as in (15): the integral of chi_i^2 over the beam is L.

    Source: (15).
    """
    s = np.asarray(s_over_L, dtype=float)
    out = np.empty((s.size, n))
    _fill_shapes(np.array(beta_lengths(n)), s.ravel(), derivative, out)
    return out.reshape(*s.shape, n)


@dataclass(frozen=True, eq=False)
class ModalIntegrals:
    """The constants of the assumed-modes equations for n modes, (6)-(15).

    Attributes:
        beta: (n,) wave numbers [1/m]; frequency: (n,) clamped-free, [rad/s].
        tip: (n,) chi_i at the tip [-]; tip_slope: (n,) its derivative [1/m].
        Phi: (n,) integral of chi_i [m], (14); x_chi: (n,) integral of x chi_i [m2].
        M: (n, n), (6) [kg/m]; N: (n, n), (7) [kg].
        alpha, alpha_prime, gamma, gamma_prime: (n, n), (10)-(13).
        slope: (n, n) integral of chi_i' chi_j' [1/m], which gives the shortening at the tip.
        gram: (n, n) integral of chi_i chi_j [m], L times the identity.
    """

    beta: Array
    frequency: Array
    tip: Array
    tip_slope: Array
    Phi: Array
    x_chi: Array
    M: Array
    N: Array
    alpha: Array
    alpha_prime: Array
    gamma: Array
    gamma_prime: Array
    slope: Array
    gram: Array


def modal_integrals(parameters: Parameters, n: int) -> ModalIntegrals:
    """Return the modal integrals (6)-(14) of the beam by Gauss-Legendre quadrature.

    The integrands are entire functions, so the rule of 20 + 8 n points is exact to rounding.

    Source: (6)-(15).
    """
    p = parameters
    node, weight = gauss_legendre(20 + 8 * n)
    s = (node + 1) / 2  # s/L on (0, 1)
    w = weight / 2 * p.L  # (m,) [m]
    x = p.r + p.L * s
    chi = mode_shapes(n, s)  # (m, n)
    chi_x = mode_shapes(n, s, 1) / p.L
    chi_xx = mode_shapes(n, s, 2) / p.L**2
    end = p.r + p.L
    M_x = p.rho * (end - x)  # (8)
    S_x = p.rho * (end**2 - x**2) / 2  # (9)

    def integral(f: Array, left: Array, right: Array) -> Array:
        return product((left * (w * f)[:, None]).T, right)

    beta = np.array(beta_lengths(n)) / p.L
    return ModalIntegrals(
        beta=beta,
        frequency=beta**2 * np.sqrt(p.EI / p.rho),
        tip=mode_shapes(n, 1.0),
        tip_slope=mode_shapes(n, 1.0, 1) / p.L,
        Phi=product(w, chi),  # (14)
        x_chi=product(w * x, chi),
        M=integral(M_x, chi_x, chi_x),  # (6)
        N=integral(S_x, chi_x, chi_x),  # (7)
        alpha=integral(M_x, chi, chi_xx),  # (12)
        alpha_prime=integral(np.full_like(x, -p.rho), chi, chi_x),  # (13), dM/dx = -rho
        gamma=integral(S_x, chi, chi_xx),  # (10)
        gamma_prime=integral(-p.rho * x, chi, chi_x),  # (11), dS/dx = -rho x
        slope=integral(np.ones_like(x), chi_x, chi_x),
        gram=integral(np.ones_like(x), chi, chi),
    )
