"""The paper's robot: a rigid link and a beam in n assumed modes, in consistent form.

The equations of motion are Lagrange's equations of the energies

    T = 1/2 q' H(q) q',   V = 1/2 sum_i EI L beta_i^4 eta_i^2,   q = [theta1, theta2, eta],

with the beam's shortening kept to second order in eta. `flexsim.plants.printed` has the equations
as the paper prints them. The modal block of H is diagonal, so only a 2x2 system is solved.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from flexsim.arm.beam import MODES, modal_integrals
from flexsim.arm.parameters import Parameters
from flexsim.numerics.dense import product
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.elementary import cos, sin
from flexsim.numerics.jit import jit
from flexsim.numerics.step_limits import LONGEST_STEP
from flexsim.numerics.types import Array


class AssumedModes(NamedTuple):
    """Coefficients of the equations of motion, as the compiled functions read them.

    With n modes: A = I_m1 + I_R0 + L_R^2 (m_H + m_b); J = I_H + I_b; first_moment = rho int x dx;
    P = rho Phi; X = rho int x chi dx; mass = rho L and stiffness = EI L beta^4 of each mode;
    damping (n, n) of the modes, Kelvin-Voigt: eta times stiffness; M, N as (6), (7); F viscous
    friction at the joints; tip = chi(L); slope = int chi' chi'. A payload counts as a part of the
    beam in all of them.
    """

    L_R: float
    reach: float
    A: float
    J: float
    I_m2: float
    first_moment: float
    F_1: float
    F_2: float
    r_1: float
    r_2: float
    P: Array
    X: Array
    mass: Array
    inverse_mass: Array
    stiffness: Array
    damping: Array
    M: Array
    N: Array
    tip: Array
    slope: Array
    step: float


def assumed_modes(
    parameters: Parameters, n: int = MODES, step: float = LONGEST_STEP
) -> AssumedModes:
    """Return the coefficients of the assumed-modes model with n modes and an RK4 step [s].

    With n = 0 the second link is rigid.

    Source: (6)-(38).
    """
    return _whatever_step(parameters, n)._replace(step=step)


@lru_cache(maxsize=64)
def _whatever_step(parameters: Parameters, n: int) -> AssumedModes:
    """Return the coefficients but for the step."""
    p = parameters
    integrals = modal_integrals(p, n or 1)  # none of which a rigid link takes
    stiffness = p.EI * p.L * (integrals.beta[:n] ** 2) ** 2  # first term of (42)
    return AssumedModes(
        L_R=p.L_R,
        reach=p.reach,
        A=p.I_m1 + p.I_R0 + p.L_R**2 * (p.m_H + p.m_b + p.payload),  # first terms of (36)
        J=p.I_H + p.I_b + p.payload * p.reach**2 + p.payload_inertia,
        I_m2=p.I_m2,
        first_moment=p.rho * ((p.r + p.L) ** 2 - p.r**2) / 2 + p.payload * p.reach,
        F_1=p.F_1 * p.r_1**2,  # at the motor in (32), here at the joint
        F_2=p.F_2 * p.r_2**2,
        r_1=p.r_1,
        r_2=p.r_2,
        P=p.rho * integrals.Phi[:n],
        X=p.rho * integrals.x_chi[:n],
        mass=np.full(n, p.rho * p.L),  # (41)
        inverse_mass=np.full(n, 1 / (p.rho * p.L)),
        stiffness=stiffness,
        damping=np.diag(p.eta * stiffness),  # none in the paper, (31)
        M=integrals.M[:n, :n].copy(),
        N=integrals.N[:n, :n].copy(),
        tip=integrals.tip[:n],
        slope=integrals.slope[:n, :n].copy(),
        step=LONGEST_STEP,
    )


@jit
def acceleration(
    p: AssumedModes, q: Array, w: Array, tau_1: float, tau_2: float, a: Array, H1: Array
) -> None:
    """Write the generalised accelerations into a.

    Args:
        p: coefficients.
        q: (n+2,) theta1, theta2 [rad], eta [m]; w: (n+2,) their rates.
        tau_1, tau_2: torques at the motors [N m].
        a: (n+2,) result; H1: (n,) work space, left holding H(1, j+2).

    Source: Lagrange's equations of the consistent T and V; (36)-(46) corrected.
    """
    n = p.P.shape[0]
    s, c = np.sin(q[1]), np.cos(q[1])
    w1, w2 = w[0], w[1]
    wb = w1 + w2
    Ls, Lc = p.L_R * s, p.L_R * c
    P_e = P_d = X_d = m_ee = m_ed = e_M_e = e_M_d = d_M_d = e_N_e = e_N_d = 0.0
    s11 = s12 = s22 = r1 = r2 = 0.0  # H_jj-weighted products of the modal rows
    for j in range(n):
        e, d = q[2 + j], w[2 + j]
        M_e = M_d = N_e = D_d = 0.0
        for i in range(n):
            M_e += p.M[j, i] * q[2 + i]
            M_d += p.M[j, i] * w[2 + i]
            N_e += p.N[j, i] * q[2 + i]
            D_d += p.damping[j, i] * w[2 + i]
        P_e += p.P[j] * e
        P_d += p.P[j] * d
        X_d += p.X[j] * d
        m_ee += p.mass[j] * e * e
        m_ed += p.mass[j] * e * d
        e_M_e += e * M_e
        e_M_d += d * M_e
        d_M_d += d * M_d
        e_N_e += e * N_e
        e_N_d += d * N_e
        H1j = p.X[j] + Lc * p.P[j] - Ls * M_e  # (39) with the shortening's rate
        H2j = p.X[j]  # (40)
        generalised = (
            wb * wb * (p.mass[j] * e - N_e)  # centrifugal softening and stiffening
            - w1 * w1 * (Ls * p.P[j] + Lc * M_e)  # (46) with theta1'^2
            - p.stiffness[j] * e
            - D_d
        )
        inverse = p.inverse_mass[j]
        H1[j] = H1j
        a[2 + j] = generalised * inverse
        s11 += H1j * H1j * inverse
        s12 += H1j * H2j * inverse
        s22 += H2j * H2j * inverse
        r1 += H1j * a[2 + j]
        r2 += H2j * a[2 + j]

    straight = p.first_moment - 0.5 * e_M_e
    J2 = p.J + m_ee - e_N_e
    h = -Ls * P_e + Lc * straight
    J2_rate = 2.0 * (m_ed - e_N_d)
    h_theta2 = -Lc * P_e - Ls * straight
    h_rate = h_theta2 * w2 - Ls * P_d - Lc * e_M_d
    g_theta2 = -Ls * P_d - Lc * e_M_d  # g = L_R cos P.eta' - L_R sin eta'M eta', in theta1' g
    g_rate = g_theta2 * w2 - Ls * d_M_d

    bias_1 = J2_rate * wb + h_rate * (2.0 * w1 + w2) + g_rate
    bias_2 = J2_rate * wb + h_rate * w1 - w1 * (h_theta2 * wb + g_theta2)
    b1 = p.r_1 * tau_1 - p.F_1 * w1 - bias_1 - r1
    b2 = p.r_2 * tau_2 - p.F_2 * w2 - bias_2 - r2
    k11 = p.A + J2 + 2.0 * h - s11  # (36)
    k12 = J2 + h - s12  # (37)
    k22 = p.I_m2 + J2 - s22  # (38)
    determinant = k11 * k22 - k12 * k12
    scale = 1.0 / determinant
    a1 = (k22 * b1 - k12 * b2) * scale
    a2 = (k11 * b2 - k12 * b1) * scale
    a[0] = a1
    a[1] = a2
    for j in range(n):
        a[2 + j] -= (H1[j] * a1 + p.X[j] * a2) * p.inverse_mass[j]


@jit
def rk4_step(  # type: ignore[no-untyped-def]
    acceleration, p, h: float, state: Array, tau_1: float, tau_2: float, work: Array
) -> None:
    """Advance the state by one step h [s] of classical Runge-Kutta, torques held.

    Args:
        acceleration: function with the arguments of `acceleration`; p: its coefficients.
        state: (2 (n+2),) positions, then rates; overwritten.
        work: (6, n+2) work space.
    """
    m = state.shape[0] // 2
    q, w, a, dq, dw, H1 = work[0], work[1], work[2], work[3], work[4], work[5]
    for i in range(m):
        q[i] = state[i]
        w[i] = state[m + i]
        dq[i] = 0.0
        dw[i] = 0.0
    for stage in range(4):
        acceleration(p, q, w, tau_1, tau_2, a, H1)
        weight = h / 6.0 if stage == 0 or stage == 3 else h / 3.0
        ahead = h if stage == 2 else 0.5 * h
        for i in range(m):
            dq[i] += weight * w[i]
            dw[i] += weight * a[i]
            q[i] = state[i] + ahead * w[i]
            w[i] = state[m + i] + ahead * a[i]
    for i in range(m):
        state[i] += dq[i]
        state[m + i] += dw[i]


def mass_matrix(p: AssumedModes, q: Array) -> Array:
    """Return the consistent mass matrix H(q) (n+2, n+2) [kg m2 and mixed].

    Source: (36)-(41) with (37) and (39) corrected.
    """
    eta = np.asarray(q)[2:]
    s, c = sin(q[1]), cos(q[1])
    M_eta = product(p.M, eta)
    J2 = p.J + product(eta, p.mass * eta) - product(eta, product(p.N, eta))
    h = -p.L_R * s * product(p.P, eta) + p.L_R * c * (p.first_moment - product(eta, M_eta) / 2)
    H = np.diag(np.concatenate([[p.A + J2 + 2 * h, p.I_m2 + J2], p.mass]))
    H[0, 1] = H[1, 0] = J2 + h
    H[0, 2:] = H[2:, 0] = p.X + p.L_R * (c * p.P - s * M_eta)
    H[1, 2:] = H[2:, 1] = p.X
    return H


def straight_masses(p: AssumedModes, poses: Array) -> Array:
    """Return the mass matrices (K, n+2, n+2) of a straight beam at angles of joint 2 (K,) [rad]."""
    c = cos(poses)
    h = p.L_R * c * p.first_moment
    H = np.zeros((len(c), len(p.P) + 2, len(p.P) + 2))
    H[:, 0, 0], H[:, 1, 1] = p.A + p.J + 2 * h, p.I_m2 + p.J
    H[:, 0, 1] = H[:, 1, 0] = p.J + h
    H[:, 0, 2:] = H[:, 2:, 0] = p.X + p.L_R * c[:, None] * p.P
    H[:, 1, 2:] = H[:, 2:, 1] = p.X
    own = np.arange(2, H.shape[1])
    H[:, own, own] = p.mass
    return H


def energy(p: AssumedModes, states: Array) -> Array:
    """Return kinetic plus elastic energy (K,) [J] of states (K, 2 (n+2))."""
    m = states.shape[1] // 2
    eta, w1, w2, rate = states[:, 2:m], states[:, m], states[:, m + 1], states[:, m + 2 :]
    s, c = sin(states[:, 1]), cos(states[:, 1])
    M_eta = product(eta, p.M)
    J2 = p.J + np.sum((eta * p.mass - product(eta, p.N)) * eta, axis=1)
    shortened = p.first_moment - np.sum(eta * M_eta, axis=1) / 2
    h = -p.L_R * s * product(eta, p.P) + p.L_R * c * shortened
    g = p.L_R * (c * product(rate, p.P) - s * np.sum(M_eta * rate, axis=1))
    wb = w1 + w2
    kinetic = p.A * w1**2 / 2 + p.I_m2 * w2**2 / 2 + J2 * wb**2 / 2 + h * w1 * wb
    kinetic += wb * product(rate, p.X) + w1 * g + product(rate**2, p.mass) / 2
    return kinetic + product(eta**2, p.stiffness) / 2


def free_frequencies(p: AssumedModes, theta2: float = 0.0) -> Array:
    """Return the n natural frequencies [rad/s] with both joints free, at a straight beam."""
    q = np.zeros(len(p.P) + 2)
    q[1] = theta2
    K = np.diag(np.concatenate([[0.0, 0.0], p.stiffness]))
    squared, _ = natural_modes(K, mass_matrix(p, q))
    return np.sqrt(squared[2:])
