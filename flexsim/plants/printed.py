"""The assumed-modes equations as the paper prints them, (31)-(46), misprints and all.

Each misprint is a switch, so that a study can count what each costs; with every switch off these
equations are those of `flexsim.plants.assumed_modes`, written out another way (a test holds the two
against each other, another both against the Lagrangian, differentiated numerically).

| switch | as printed | consistent |
|---|---|---|
| MASS_37 | (37) + (L_R cos theta2 / 2) eta'M eta | minus |
| SHORTENING_39 | (39) without - L_R sin theta2 (M eta)_j, the shortening's rate | with it |
| INDICES_43 | (43) gamma_ii, alpha_ii off the diagonal | gamma_ij, alpha_ij |
| SQUARE_46 | (46) theta1' | theta1'^2 |
| RANGE_46 | (46) for 3 <= i <= n, nothing for the last two modes | 3 <= i <= n+2 |

The first two have followers, which go with them; e is eta, d its rate, s and c are L_R sin theta2
and L_R cos theta2. From the sign of (37): in (44) + c/2 e'M at 2 theta2' d and - s/2 e'M e at
theta2'^2, in (45) + c/2 e'M at 2 theta1' d, each to have the other sign; and in (45) - s e'M e at
theta1' theta2', to go. K has the right sign, so this is a slip. From what (39) lacks: in (42), (43)
alpha/2 at 2 theta1' theta2', to go; missing from (44) - c/2 e'M at 2 theta2' d and - s d'M d, from
(45) + c/2 e'M at 2 theta1' d. Alone it is no slip: the equations are Lagrange's of a kinetic energy
without that rate, and conserve that energy.

Two more cannot be run. The ranges of (39)-(41), 3 <= j <= n, leave H singular, and (41) has
H(3, j) for H(j, j): they are read as H(j, j), 3 <= j <= n+2, throughout. F of (31), `F_31`, has
four entries where q' has n + 2 = 5, and (32) multiplies two vectors: F is read as a diagonal
matrix, with zeros to its end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flexsim.numerics.dense import bilinear, dot, eliminate
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array
from flexsim.plants.assumed_modes import AssumedModes

MASS_37 = 1
SHORTENING_39 = 2
INDICES_43 = 4
SQUARE_46 = 8
RANGE_46 = 16
AS_PRINTED = MASS_37 | SHORTENING_39 | INDICES_43 | SQUARE_46 | RANGE_46
MISPRINTS = {
    "(37) sign": MASS_37,
    "(39) shortening's rate": SHORTENING_39,
    "(43) indices": INDICES_43,
    "(46) square": SQUARE_46,
    "(46) range": RANGE_46,
}
F_31 = (2.0e-4, 2.3e-4, 0.0, 0.0)
"""Viscous friction as (31) prints it [N m s/rad], for q' of n + 2 entries."""


if TYPE_CHECKING:

    class PrintedModes(AssumedModes):
        """Coefficients of the printed equations.

        Those of `AssumedModes`; gamma + gamma' and alpha + alpha', (n, n), of (10)-(13); the
        switches.
        """

        gamma: Array
        alpha: Array
        misprints: int

else:  # flat: compiled threads cannot take apart a tuple within a tuple
    PrintedModes = NamedTuple(
        "PrintedModes",
        [
            *AssumedModes.__annotations__.items(),
            ("gamma", Array),
            ("alpha", Array),
            ("misprints", int),
        ],
    )


def printed_modes(base: AssumedModes, misprints: int = AS_PRINTED) -> PrintedModes:
    """Return the coefficients of the printed equations with the modes of `assumed_modes`.

    By parts gamma + gamma' = -N and alpha + alpha' = -M, (6)-(13), so nothing else is needed.
    """
    return PrintedModes._make((*base, -base.N, -base.M, misprints))


@jit
def printed_mass(p: PrintedModes, q: Array) -> Array:
    """Return the mass matrix H(q) (n+2, n+2), (36)-(41), with r_1 = r_2 = 1."""
    n = p.P.shape[0]
    eta = q[2:]
    s, c = np.sin(q[1]), np.cos(q[1])
    quadratic = bilinear(eta, p.M, eta)
    J2 = p.J - bilinear(eta, p.N, eta)
    for j in range(n):
        J2 += p.mass[j] * eta[j] * eta[j]
    coupling = p.L_R * (c * p.first_moment - s * dot(p.P, eta))
    sign = 1.0 if p.misprints & MASS_37 else -1.0
    H = np.zeros((n + 2, n + 2))
    H[0, 0] = p.A + J2 + 2.0 * coupling - p.L_R * c * quadratic  # (36)
    H[0, 1] = J2 + coupling + sign * p.L_R * c / 2.0 * quadratic  # (37)
    H[1, 1] = p.I_m2 + J2  # (38)
    for j in range(n):
        H[0, 2 + j] = p.X[j] + p.L_R * c * p.P[j]  # (39)
        if not p.misprints & SHORTENING_39:
            H[0, 2 + j] -= p.L_R * s * dot(p.M[j], eta)
        H[1, 2 + j] = p.X[j]  # (40)
        H[2 + j, 2 + j] = p.mass[j]  # (41)
    for i in range(n + 2):
        for j in range(i):
            H[i, j] = H[j, i]
    return H


@jit
def printed_stiffness(p: PrintedModes, q: Array, w: Array) -> Array:
    """Return the modal block (n, n) of K(q, q'), (42) and (43)."""
    n = p.P.shape[0]
    Lc = p.L_R * np.cos(q[1])
    w1, w2 = w[0], w[1]
    half = 0.5 if p.misprints & SHORTENING_39 else 0.0  # alpha at theta1' theta2'
    K = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            wrong = p.misprints & INDICES_43 and i != j
            gamma = p.gamma[i, i] if wrong else p.gamma[i, j]
            alpha = p.alpha[i, i] if wrong else p.alpha[i, j]
            if i == j:
                gamma += p.mass[i]
                K[i, i] += p.stiffness[i]
            K[i, j] -= w1 * w1 * (gamma + Lc * alpha)
            K[i, j] -= w2 * w2 * gamma
            K[i, j] -= 2.0 * w1 * w2 * (gamma + half * Lc * alpha)
    return K


@jit
def reached_by_46(n: int, misprints: int) -> int:
    """Return how many of n modes (46) has a force for, from the first one on."""
    return max(n - 2, 0) if misprints & RANGE_46 else n


@jit
def printed_coriolis(p: PrintedModes, q: Array, w: Array) -> Array:
    """Return C(q, q') (n+2,), (44)-(46), with r_1 = r_2 = 1."""
    n = p.P.shape[0]
    eta, d = q[2:], w[2:]
    w1, w2 = w[0], w[1]
    Ls, Lc = p.L_R * np.sin(q[1]), p.L_R * np.cos(q[1])
    e_M_e, e_M_d, d_M_d = bilinear(eta, p.M, eta), bilinear(d, p.M, eta), bilinear(d, p.M, d)
    spin = -bilinear(d, p.N, eta)
    for j in range(n):
        spin += p.mass[j] * eta[j] * d[j]
    P_e, P_d = dot(p.P, eta), dot(p.P, d)
    sign = 1.0 if p.misprints & MASS_37 else -1.0  # of the eta'M terms that follow from (37)
    rate = 0.0 if p.misprints & SHORTENING_39 else 1.0  # of those from the corrected (39)
    C = np.zeros(n + 2)
    C[0] = 2.0 * w1 * (spin - Ls * P_d - Lc * e_M_d)  # (44), a line each
    C[0] += 2.0 * w2 * (spin - Ls * P_d) + w2 * (sign - rate) * Lc * e_M_d
    C[0] += w2 * w2 * (-Ls * p.first_moment - sign * Ls / 2.0 * e_M_e - Lc * P_e)
    C[0] += 2.0 * w1 * w2 * (-Ls * p.first_moment + Ls / 2.0 * e_M_e - Lc * P_e)
    C[0] -= rate * Ls * d_M_d
    C[1] = 2.0 * w1 * spin + w1 * (sign + rate) * Lc * e_M_d  # (45), a line each
    C[1] += w1 * w1 * (Ls * p.first_moment + Lc * P_e - Ls / 2.0 * e_M_e)
    C[1] += 2.0 * w2 * spin
    if p.misprints & MASS_37:
        C[1] -= w1 * w2 * Ls * e_M_e
    power = w1 if p.misprints & SQUARE_46 else w1 * w1
    reached = reached_by_46(n, p.misprints)
    C[2 : 2 + reached] = power * Ls * p.P[:reached]  # (46)
    return C


@jit
def printed_acceleration(
    p: PrintedModes, q: Array, w: Array, tau_1: float, tau_2: float, a: Array, H1: Array
) -> None:
    """Write the accelerations of (32) into a; arguments as `assumed_modes.acceleration`.

    H and C are scaled by 1/r_1, 1/r_2 in the print, for motor angles; here, for joint angles,
    the same scaling multiplies the torques by r_1, r_2.
    """
    right = -printed_coriolis(p, q, w)
    right[0] += p.r_1 * tau_1 - p.F_1 * w[0]
    right[1] += p.r_2 * tau_2 - p.F_2 * w[1]
    K = printed_stiffness(p, q, w)
    for j in range(K.shape[0]):
        right[2 + j] -= dot(K[j], q[2:]) + dot(p.damping[j], w[2:])
    for i in range(right.shape[0]):
        a[i] = right[i]
    if not eliminate(printed_mass(p, q), a.reshape(a.shape[0], 1)):
        a[:] = np.nan  # a motion that has run away, which the loop sees


@jit
def printed_forces(p: PrintedModes, q: Array, w: Array, a: Array, force: Array) -> None:
    """Write the generalised forces (K, n+2) that a motion needs: inverse dynamics, joints free.

    Args:
        q, w, a: (K, n+2) positions, rates and accelerations.
    """
    free, work = np.empty(q.shape[1]), np.empty(q.shape[1] - 2)
    for k in range(q.shape[0]):
        printed_acceleration(p, q[k], w[k], 0.0, 0.0, free, work)
        H = printed_mass(p, q[k])
        free[:] = a[k] - free
        for j in range(H.shape[0]):
            force[k, j] = dot(H[j], free)


def scaled_mass(H: Array, r_1: float, r_2: float) -> Array:
    """Return H (n+2, n+2) with the transmission relations of (36)-(40) written in."""
    scale = np.ones(len(H))
    scale[:2] = 1 / r_1, 1 / r_2
    return H * np.outer(scale, scale)
