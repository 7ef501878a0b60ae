"""Assumed modes of two flexible links in series: Lagrange's equations of moving points.

>>> p = two_beams(named_arm("two-flexible"), modes=(3, 3))
>>> two_beams_acceleration(p, q, w, tau_1, tau_2, a, work)

Coordinates are theta1, theta2, then eta of link 1 and of link 2. In the frame of its link, which
its hub carries, a point of a beam is at x + u along and v across, as in the paper's link 2: v = chi
. eta, and the shortening u = -eta' S(x) eta/2 of second order. Kinetic energy is that of the masses
at Gauss's points of both beams, of hub 2 and of the payload: its integrals to rounding. As every
point's velocity is J(q) q', Lagrange's equations are sum J' m (J q'' + J' q') = Q of these points:
energy is kept whatever the motion. To second order they are those of the paper's arm where link 1
is stiff. The end of link 1 turns hub 2 by v'(L).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexsim.arm.arms import Arm
from flexsim.arm.beam import Load, load_of, mode_shapes
from flexsim.arm.parameters import Parameters
from flexsim.numerics.dense import product
from flexsim.numerics.jit import jit
from flexsim.numerics.quadrature import gauss_legendre
from flexsim.numerics.step_limits import LONGEST_STEP
from flexsim.numerics.types import Array

POINTS = 12  # of a beam, and 4 more for every mode: products of modes to rounding
WITHIN = 30  # quadrature points from the clamp to a point, of the shortening


class TwoBeams(NamedTuple):
    """Coefficients of the equations, as compiled functions read them; link 1's first.

    Of each link, with n modes at G points: mass (G,) [kg], x (G,) along it from its joint [m], chi
    (G, n), S (G, n, n) [1/m]; its last point is hub 2 on link 1, the payload on link 2, both at
    the beam's end. K, D (n, n) stiffness [N/m] and damping [N s/m]; end_slope (n,) chi' at its end
    [1/m]; turning: inertia that turns with the end [kg m2], none on link 1. hub_1, hub_2: inertia
    of the hubs [kg m2]; others as in `AssumedModes`.
    """

    mass_1: Array
    x_1: Array
    chi_1: Array
    S_1: Array
    K_1: Array
    D_1: Array
    slope_1: Array
    mass_2: Array
    x_2: Array
    chi_2: Array
    S_2: Array
    K_2: Array
    D_2: Array
    slope_2: Array
    turning_2: float
    hub_1: float
    hub_2: float
    I_m1: float
    I_m2: float
    F_1: float
    F_2: float
    r_1: float
    r_2: float
    step: float


class Shapes(NamedTuple):
    """A beam's points as `TwoBeams` has them: mass, x, chi, S, K, D, slope."""

    mass: Array
    x: Array
    chi: Array
    S: Array
    K: Array
    D: Array
    slope: Array


def two_beams(arm: Arm, modes: tuple[int, int], step: float = LONGEST_STEP) -> TwoBeams:
    """Return the coefficients of an arm whose links both bend, with n modes each, and an RK4 step.

    Link 1's modes are those under what it carries, as one body; link 2's those under its payload.

    Raises:
        ParameterError: link 1 is rigid, or a number of modes or load is out of range.
    """
    p = arm.parameters
    one = _shapes(arm.beam1, modes[0], arm.load1, arm.eta1(), p.m_H)
    two = _shapes(p, modes[1], load_of(p), p.eta, p.payload)
    return TwoBeams(
        *one,
        *two,
        turning_2=p.payload_inertia,
        hub_1=arm.hub_inertia,
        hub_2=p.I_H,
        I_m1=p.I_m1,
        I_m2=p.I_m2,
        F_1=p.F_1 * p.r_1**2,
        F_2=p.F_2 * p.r_2**2,
        r_1=p.r_1,
        r_2=p.r_2,
        step=step,
    )


def _shapes(beam: Parameters, n: int, load: Load, eta: float, at_end: float) -> Shapes:
    """Return a beam's points; eta: its Kelvin-Voigt time [s]; at_end: mass on its end [kg]."""
    node, weight = gauss_legendre(POINTS + 4 * n)
    s = np.append((node + 1) / 2, 1.0)
    mass = np.append(weight / 2 * beam.m_b, at_end)
    within, share = gauss_legendre(WITHIN)
    S = np.empty((len(s), n, n))
    for g, end in enumerate(s):
        slope = mode_shapes(n, (within + 1) / 2 * end, 1, load) / beam.L  # (W, n)
        S[g] = product((slope * (share / 2 * end * beam.L)[:, None]).T, slope)
    bent = mode_shapes(n, s[:-1], 2, load) / beam.L**2
    K = product((bent * (weight / 2 * beam.L * beam.EI)[:, None]).T, bent)
    K = (K + K.T) / 2
    return Shapes(
        mass=mass,
        x=beam.r + beam.L * s,
        chi=mode_shapes(n, s, 0, load),
        S=S,
        K=K,
        D=eta * K,
        slope=mode_shapes(n, 1.0, 1, load) / beam.L,
    )


@jit
def _sums(
    mass: Array,
    x: Array,
    chi: Array,
    S: Array,
    eta: Array,
    rate: Array,
    turn: float,
    A: Array,
    b: Array,
    Se: Array,
) -> None:
    """Write a link's inertia A (n+3, n+3) and its force b (n+3,) at rates but no accelerations.

    Of its base's acceleration along and across the link, of the link's turning and of eta.

    Args:
        eta, rate: (n,). turn: the link's rate [rad/s]. Se: (n,) work space.
    """
    n = eta.shape[0]
    A[:, :] = 0.0
    b[:] = 0.0
    for g in range(mass.shape[0]):
        u = u_rate = v = v_rate = squared = 0.0
        for i in range(n):
            Se_i = Sd_i = 0.0
            for j in range(n):
                Se_i += S[g, i, j] * eta[j]
                Sd_i += S[g, i, j] * rate[j]
            Se[i] = Se_i
            u -= 0.5 * eta[i] * Se_i
            u_rate -= rate[i] * Se_i
            squared += rate[i] * Sd_i
            v += chi[g, i] * eta[i]
            v_rate += chi[g, i] * rate[i]
        m, along = mass[g], x[g] + u
        # what is left of the point's acceleration without those of the coordinates
        b_along = -squared - turn * turn * along - 2.0 * turn * v_rate
        b_across = -turn * turn * v + 2.0 * turn * u_rate
        A[0, 0] += m
        A[1, 1] += m
        A[0, 2] -= m * v
        A[1, 2] += m * along
        A[2, 2] += m * (v * v + along * along)
        b[0] += m * b_along
        b[1] += m * b_across
        b[2] += m * (along * b_across - v * b_along)
        for i in range(n):
            A[0, 3 + i] -= m * Se[i]
            A[1, 3 + i] += m * chi[g, i]
            A[2, 3 + i] += m * (v * Se[i] + along * chi[g, i])
            b[3 + i] += m * (chi[g, i] * b_across - Se[i] * b_along)
            for j in range(i + 1):
                A[3 + i, 3 + j] += m * (Se[i] * Se[j] + chi[g, i] * chi[g, j])
    for i in range(n + 3):
        for j in range(i):
            if i >= 3 and j >= 3:
                A[j, i] = A[i, j]
            else:
                A[i, j] = A[j, i]


@jit
def _map(p: TwoBeams, q: Array, w: Array, T: Array, t: Array) -> None:
    """Write how link 2's base and turning follow the coordinates: T (n2+3, m) q'' + t (n2+3,).

    In link 2's frame: its base is joint 2 at the end of link 1.
    """
    n1, n2, last = p.K_1.shape[0], p.K_2.shape[0], p.x_1.shape[0] - 1
    T[:, :] = 0.0
    t[:] = 0.0
    u = u_rate = v = v_rate = squared = turned = 0.0
    for i in range(n1):
        Se = Sd = 0.0
        for j in range(n1):
            Se += p.S_1[last, i, j] * q[2 + j]
            Sd += p.S_1[last, i, j] * w[2 + j]
        u -= 0.5 * q[2 + i] * Se
        u_rate -= w[2 + i] * Se
        squared += w[2 + i] * Sd
        v += p.chi_1[last, i] * q[2 + i]
        v_rate += p.chi_1[last, i] * w[2 + i]
        turned += p.slope_1[i] * q[2 + i]
        T[0, 2 + i], T[1, 2 + i] = -Se, p.chi_1[last, i]
        T[2, 2 + i] = p.slope_1[i]
    along, w1 = p.x_1[last] + u, w[0]
    T[0, 0], T[1, 0], T[2, 0], T[2, 1] = -v, along, 1.0, 1.0
    t[0] = -squared - w1 * w1 * along - 2.0 * w1 * v_rate
    t[1] = -w1 * w1 * v + 2.0 * w1 * u_rate
    angle = turned + q[1]
    c, s = np.cos(angle), np.sin(angle)
    for k in range(2 + n1):
        ahead, beside = T[0, k], T[1, k]
        T[0, k], T[1, k] = c * ahead + s * beside, c * beside - s * ahead
    ahead, beside = t[0], t[1]
    t[0], t[1] = c * ahead + s * beside, c * beside - s * ahead
    for i in range(n2):
        T[3 + i, 2 + n1 + i] = 1.0


@jit
def two_beams_inertia(p: TwoBeams, q: Array, w: Array, M: Array, bias: Array) -> None:
    """Write the mass matrix M (m, m) and the forces (m,) that rates alone need, dampers apart."""
    n1, n2 = p.K_1.shape[0], p.K_2.shape[0]
    m = 2 + n1 + n2
    A1, b1 = np.empty((n1 + 3, n1 + 3)), np.empty(n1 + 3)
    A2, b2 = np.empty((n2 + 3, n2 + 3)), np.empty(n2 + 3)
    T, t, Se = np.empty((n2 + 3, m)), np.empty(n2 + 3), np.empty(max(n1, n2))
    eta_1, rate_1 = q[2 : 2 + n1], w[2 : 2 + n1]
    _sums(p.mass_1, p.x_1, p.chi_1, p.S_1, eta_1, rate_1, w[0], A1, b1, Se)
    _map(p, q, w, T, t)
    turn = 0.0
    for k in range(2 + n1):
        turn += T[2, k] * w[k]
    _sums(p.mass_2, p.x_2, p.chi_2, p.S_2, q[2 + n1 :], w[2 + n1 :], turn, A2, b2, Se)
    A2[2, 2] += p.hub_2 + p.turning_2
    for i in range(n2):  # the payload turns with the tip
        A2[2, 3 + i] += p.turning_2 * p.slope_2[i]
        A2[3 + i, 2] += p.turning_2 * p.slope_2[i]
        for j in range(n2):
            A2[3 + i, 3 + j] += p.turning_2 * p.slope_2[i] * p.slope_2[j]
    M[:, :] = 0.0
    bias[:] = 0.0
    M[0, 0] += A1[2, 2] + p.hub_1 + p.I_m1
    M[1, 1] += p.I_m2
    bias[0] += b1[2]
    for i in range(n1):
        M[0, 2 + i] += A1[2, 3 + i]
        M[2 + i, 0] += A1[2, 3 + i]
        bias[2 + i] += b1[3 + i]
        for j in range(n1):
            M[2 + i, 2 + j] += A1[3 + i, 3 + j]
    for r in range(n2 + 3):
        own = b2[r]
        for s in range(n2 + 3):
            own += A2[r, s] * t[s]
        for k in range(m):
            if T[r, k] == 0.0:
                continue
            bias[k] += T[r, k] * own
            for s in range(n2 + 3):
                share = T[r, k] * A2[r, s]
                for j in range(m):
                    M[k, j] += share * T[s, j]


@jit
def two_beams_acceleration(
    p: TwoBeams, q: Array, w: Array, tau_1: float, tau_2: float, a: Array, unused: Array
) -> None:
    """Write the generalised accelerations into a (m,).

    Args:
        p: coefficients. q, w: (m,) theta1, theta2 [rad], eta of links 1, 2 [m]; their rates.
        tau_1, tau_2: torques at the motors [N m].
    """
    n1, m = p.K_1.shape[0], q.shape[0]
    M = np.empty((m, m))
    two_beams_inertia(p, q, w, M, a)
    for i in range(m):
        a[i] = -a[i]
    a[0] += p.r_1 * tau_1 - p.F_1 * w[0]
    a[1] += p.r_2 * tau_2 - p.F_2 * w[1]
    for i in range(n1):
        for j in range(n1):
            a[2 + i] -= p.K_1[i, j] * q[2 + j] + p.D_1[i, j] * w[2 + j]
    for i in range(m - 2 - n1):
        for j in range(m - 2 - n1):
            k = 2 + n1 + j
            a[2 + n1 + i] -= p.K_2[i, j] * q[k] + p.D_2[i, j] * w[k]
    _solve(M, a)


@jit
def _solve(M: Array, x: Array) -> None:
    """Solve M x = x (m,) in place of both, M positive definite, its largest pivots last.

    From the last row up, so that a locked joint's motor, as heavy as may be, ends alone.
    """
    m = x.shape[0]
    for p in range(m - 1, 0, -1):
        inverse = 1.0 / M[p, p]
        for i in range(p):
            factor = M[i, p] * inverse
            if factor != 0.0:
                for j in range(p):
                    M[i, j] -= factor * M[p, j]
                x[i] -= factor * x[p]
    for p in range(m):
        for j in range(p):
            x[p] -= M[p, j] * x[j]
        x[p] /= M[p, p]


@jit
def two_beams_tip(p: TwoBeams, state: Array):  # type: ignore[no-untyped-def]
    """Return the tip along and across hub 2's axis, from joint 2 [m]; the second is v."""
    n1, n2, last = p.K_1.shape[0], p.K_2.shape[0], p.x_2.shape[0] - 1
    v = u = 0.0
    for i in range(n2):
        e = state[2 + n1 + i]
        v += p.chi_2[last, i] * e
        for j in range(n2):
            u -= 0.5 * p.S_2[last, i, j] * e * state[2 + n1 + j]
    return p.x_2[last] + u, v


@jit
def two_beams_elbow(p: TwoBeams, L_R: float, state: Array):  # type: ignore[no-untyped-def]
    """Return joint 2 along and across link 1 [m], and by how much link 1's end has turned [rad]."""
    n1, last = p.K_1.shape[0], p.x_1.shape[0] - 1
    v = u = turned = 0.0
    for i in range(n1):
        e = state[2 + i]
        v += p.chi_1[last, i] * e
        turned += p.slope_1[i] * e
        for j in range(n1):
            u -= 0.5 * p.S_1[last, i, j] * e * state[2 + j]
    return p.x_1[last] + u, v, turned
