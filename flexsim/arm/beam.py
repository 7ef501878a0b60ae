"""Modes of the clamped beam (15) and their integrals (6)-(14), exact to rounding for any number.

    >>> from flexsim import Parameters
    >>> from flexsim.arm.beam import modal_integrals
    >>> modal_integrals(Parameters(), 3).frequency / 6.283185307179586   # [Hz]
    array([ 3.33728858, 20.91443054, 58.56101111])

x runs from r to r + L along the undeformed beam, as in the paper; s = x - r from the clamp. A
payload at the tip, which the paper has not, changes the modes: they solve the same equation with
the payload's inertia in place of a free end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

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
LOAD_MOST = 1e4  # of the beam's own; the first frequency is exact to 1e-13 up to here


class Load(NamedTuple):
    """A payload at the tip: mass over rho L and inertia over rho L^3 [-]."""

    mass: float
    inertia: float


UNLOADED = Load(0.0, 0.0)


def load_of(parameters: Parameters) -> Load:
    """Return a robot's payload in units of its beam.

    Raises:
        ParameterError: it is more than LOAD_MOST of the beam's.
    """
    p = parameters
    load = Load(p.payload / p.m_b, p.payload_inertia / (p.m_b * p.L**2))
    for name, unit, value, size in (
        ("payload", "kg", p.payload, p.m_b),
        ("payload_inertia", "kg m2", p.payload_inertia, p.m_b * p.L**2),
    ):
        if value > LOAD_MOST * size:
            raise ParameterError(
                f"parameter {name} is {value:g} {unit}, {value / size:.3g} times what the beam "
                f"has (rho L, rho L^3); give {LOAD_MOST * size:.3g} {unit} at most"
            )
    return load


def beta_lengths(n: int, load: Load = UNLOADED) -> tuple[float, ...]:
    """Return beta_i L of the first n clamped modes, the roots of `frequency_equation` [-].

    Without a payload those of cos(b) cosh(b) = -1, (15).

    Raises:
        ParameterError: n is not a whole number from 1 to MODES_MAX.
    """
    if not isinstance(n, int | np.integer) or isinstance(n, bool) or not 1 <= n <= MODES_MAX:
        raise ParameterError(f"number of modes is {n!r}; give a whole number from 1 to {MODES_MAX}")
    return _beta_lengths(int(n), load)


@lru_cache
def _beta_lengths(n: int, load: Load) -> tuple[float, ...]:
    if load != UNLOADED:
        # a mass, then an inertia, each lowers every frequency, but none below the one before
        free = _beta_lengths(n, UNLOADED)
        return _lowered(_lowered(free, Load(load.mass, 0.0)), load)
    # cos b + 1/cosh b: the same roots, without overflow; one within 0.31 of each (i - 1/2) pi.
    # brentq closes in on a change of sign, so what it returns is a root, or it raises
    roots = []
    for i in range(1, n + 1):
        middle = (i - 0.5) * math.pi
        roots.append(
            brentq(lambda b: math.cos(b) + 1 / math.cosh(b), middle - 0.4, middle + 0.4, xtol=1e-15)
        )
    return tuple(roots)


def _lowered(above: tuple[float, ...], load: Load) -> tuple[float, ...]:
    """Return the roots under a load that has one inertia more than that with the roots above.

    One lies in each gap. Its ends may be roots to rounding, so the sign there, which is known, is
    not asked for unless it is the half with the root.
    """
    roots, low = [], 0.0
    for i, high in enumerate(above):
        before = (-1.0) ** i  # sign of the equation below root i
        middle = 0.5 * (low + high)
        rising = before * frequency_equation(middle, load) > 0
        left, right = (middle, high) if rising else (low, middle)
        if before * frequency_equation(right, load) >= 0:
            root = right
        elif before * frequency_equation(left, load) <= 0:
            root = left
        else:
            root = float(brentq(frequency_equation, left, right, args=(load,), xtol=1e-15))
        roots.append(root)
        low = high
    return tuple(roots)


def frequency_equation(b: float, load: Load) -> float:
    """Return the determinant of the clamped beam with a payload at b = beta L, times 2 e^-b [-].

    (1 + Cc) + p (cS - Cs) - j (Cs + cS) + j p (1 - Cc) with p = b times the mass, j = b^3 times the
    inertia, C and S hyperbolic, c and s circular; zero at a natural frequency only. From (15) with
    the third derivative -p b^3 times chi, the second j b times the first at the tip (d/ds).
    """
    e, c, s = math.exp(-b), math.cos(b), math.sin(b)
    p, j = load.mass * b, load.inertia * b**3
    one, Cc, Cs, cS = 2 * e, c * (1 + e * e), s * (1 + e * e), c * (1 - e * e)
    return (one + Cc) + p * (cS - Cs) - j * (Cs + cS) + j * p * (one - Cc)


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
def loaded_constants(b: float, mass: float, inertia: float):  # type: ignore[no-untyped-def]
    """Return (1 - sigma)/2 e^b, sigma and a scale of a mode under a payload at b = beta L [-].

    The scale makes the integral of chi^2 over the beam, with the payload's mass chi(tip)^2 and
    inertia chi'(tip)^2, the beam's length, so that every mode's mass is rho L as without payload.
    Source: the shear at the tip; 4 int chi^2 ds = (3 y0 y3 - y1 y2)/b + y0^2 - 2 y1 y3 + y2^2 at
    the tip, with y_k the k-th derivative over b^k.
    """
    e, c, s, p = math.exp(-b), math.cos(b), math.sin(b), mass * b
    below = 1.0 + e * e + 2.0 * e * c + p * (1.0 - e * e - 2.0 * e * s)
    growing = (e + c + s + p * (c - s - e)) / below
    quotient = (1.0 - e * e - 2.0 * e * s + p * (1.0 + e * e - 2.0 * e * c)) / below
    falling = 0.5 * (1.0 + quotient) * e
    y0 = growing + falling - c + quotient * s
    y1 = growing - falling + s + quotient * c
    y2 = growing + falling + c - quotient * s
    y3 = growing - falling - s - quotient * c
    beam = 0.25 * ((3.0 * y0 * y3 - y1 * y2) / b + y0 * y0 - 2.0 * y1 * y3 + y2 * y2)
    norm = beam + mass * y0 * y0 + inertia * b * b * y1 * y1
    return growing, quotient, 1.0 / math.sqrt(norm)


@jit
def _fill_shapes(
    b: Array, mass: float, inertia: float, s: Array, derivative: int, out: Array
) -> None:
    """Fill out (K, n) with the modes of b (n,) under a load at s (K,)."""
    for i in range(b.shape[0]):
        scale = 1.0
        if mass > 0.0 or inertia > 0.0:
            growing, quotient, scale = loaded_constants(b[i], mass, inertia)
        else:
            growing, quotient = mode_constants(b[i])
        for k in range(s.shape[0]):
            out[k, i] = scale * mode_shape(b[i], growing, quotient, s[k], derivative)


def sigma(beta_length: ArrayLike) -> Array:
    """Return the quotient (cosh + cos)/(sinh + sin) of (15) at beta L [-]."""
    b = np.asarray(beta_length, dtype=float)
    return np.array([mode_constants(each)[1] for each in b.flat]).reshape(b.shape)


def mode_shapes(n: int, s_over_L: ArrayLike, derivative: int = 0, load: Load = UNLOADED) -> Array:
    """Return the first n modes (15), or a derivative with respect to s/L [-].

    Args:
        n: number of modes.
        s_over_L: distance from the clamp over L, any shape (...,) [-].
        derivative: 0 to 4. load: the payload.

    Returns:
        (..., n), normalised as in (15): the integral of chi_i^2 over the beam is L; with the
        payload's share under one (see `loaded_constants`).

    Source: (15).
    """
    s = np.asarray(s_over_L, dtype=float)
    out = np.empty((s.size, n))
    _fill_shapes(np.array(beta_lengths(n, load)), *load, s.ravel(), derivative, out)
    return out.reshape(*s.shape, n)


@dataclass(frozen=True, eq=False)
class ModalIntegrals:
    """The constants of the assumed-modes equations for n modes, (6)-(15).

    A payload counts as a part of the beam: Phi, x_chi, M, N and gram are integrals over its mass
    too, divided by rho where the beam's density is.

    Attributes:
        beta: (n,) wave numbers [1/m]; frequency: (n,) clamped, [rad/s].
        tip: (n,) chi_i at the tip [-]; tip_slope: (n,) its derivative [1/m].
        Phi: (n,) integral of chi_i [m], (14); x_chi: (n,) integral of x chi_i [m2].
        M: (n, n), (6) [kg/m]; N: (n, n), (7) [kg]; a payload's inertia turns with the tip, and
            stays the same: N takes away its share of gram.
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

    Raises:
        ParameterError: more modes than MODES_MAX, or a payload beyond LOAD_MOST.

    Source: (6)-(15).
    """
    p = parameters
    found = _integrals(p.r, p.L, p.rho, p.payload, p.payload_inertia, n)
    return replace(found, frequency=found.beta**2 * np.sqrt(p.EI / p.rho))


@lru_cache(maxsize=64)
def _integrals(
    r: float, L: float, rho: float, payload: float, payload_inertia: float, n: int
) -> ModalIntegrals:
    """Return the integrals of a beam whatever its stiffness, its frequencies of EI = 1 N m2."""
    masses = {"payload": payload, "payload_inertia": payload_inertia}
    p = Parameters(r=r, L=L, rho=rho, EI=1.0, **masses)
    load = load_of(p)
    node, weight = gauss_legendre(20 + 8 * n)
    s = (node + 1) / 2  # s/L on (0, 1)
    w = weight / 2 * p.L  # (m,) [m]
    x = p.r + p.L * s
    chi = mode_shapes(n, s, 0, load)  # (m, n)
    chi_x = mode_shapes(n, s, 1, load) / p.L
    chi_xx = mode_shapes(n, s, 2, load) / p.L**2
    end = p.r + p.L
    M_x = p.rho * (end - x) + p.payload  # (8)
    S_x = p.rho * (end**2 - x**2) / 2 + p.payload * end  # (9)
    tip, tip_slope = mode_shapes(n, 1.0, 0, load), mode_shapes(n, 1.0, 1, load) / p.L
    heavy, turning = p.payload / p.rho, p.payload_inertia / p.rho  # [m], [m3]
    turned = np.outer(tip_slope, tip_slope)

    def integral(f: Array, left: Array, right: Array) -> Array:
        return product((left * (w * f)[:, None]).T, right)

    beta = np.array(beta_lengths(n, load)) / p.L
    return ModalIntegrals(
        beta=beta,
        frequency=beta**2 * np.sqrt(p.EI / p.rho),
        tip=tip,
        tip_slope=tip_slope,
        Phi=product(w, chi) + heavy * tip,  # (14)
        x_chi=product(w * x, chi) + heavy * end * tip + turning * tip_slope,
        M=integral(M_x, chi_x, chi_x),  # (6)
        N=integral(S_x, chi_x, chi_x) + p.payload_inertia * turned,  # (7)
        alpha=integral(M_x, chi, chi_xx),  # (12)
        alpha_prime=integral(np.full_like(x, -p.rho), chi, chi_x),  # (13), dM/dx = -rho
        gamma=integral(S_x, chi, chi_xx),  # (10)
        gamma_prime=integral(-p.rho * x, chi, chi_x),  # (11), dS/dx = -rho x
        slope=integral(np.ones_like(x), chi_x, chi_x),
        gram=integral(np.ones_like(x), chi, chi) + heavy * np.outer(tip, tip) + turning * turned,
    )
