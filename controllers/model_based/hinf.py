"""H-infinity control by two Riccati equations, of continuous plants and by the bilinear map of
sampled ones.

    K, gamma = synthesised(plant)      # to within TOLERANCE of the least gamma there is

The plant is z = C1 x + D11 w + D12 u, y = C2 x + D21 w + D22 u, x' = A x + B1 w + B2 u; what comes
back is the central controller u = K y, for which the norm from w to z is below gamma.

Source: K. Glover and J. C. Doyle, State-space formulae for all stabilizing controllers that satisfy
an H-infinity norm bound and relations to risk sensitivity, Systems & Control Letters 11 (1988)
167-172; as in K. Zhou, J. C. Doyle and K. Glover, Robust and Optimal Control, Prentice Hall, 1996,
ch. 17. Formulas from memory, not checked against the print; the norm of what they give is, by
tests.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, schur

from controllers.errors import ControllerError
from controllers.model_based.model import Space, solved
from controllers.series import Array

TOLERANCE = 0.1
"""Relative, of the search for gamma."""
ON_AXIS = 1e-9
"""Of real parts of a Hamiltonian's eigenvalues, relative to the largest: those that count as 0."""
NEGATIVE = 1e-7
"""By how much a solution's least eigenvalue may lie below zero, relative to the largest."""


class Plant(NamedTuple):
    """A generalised plant from (w, u) to (z, y)."""

    A: Array
    """(n, n)"""
    B1: Array
    """(n, m1)"""
    B2: Array
    """(n, m2)"""
    C1: Array
    """(p1, n)"""
    C2: Array
    """(p2, n)"""
    D11: Array
    """(p1, m1)"""
    D12: Array
    """(p1, m2), of full column rank."""
    D21: Array
    """(p2, m1), of full row rank."""
    D22: Array
    """(p2, m2)"""


def synthesised(
    plant: Plant,
    tolerance: float = TOLERANCE,
    low: float = 0.5,
    high: float = 500.0,
    slack: float = 1.0,
) -> tuple[Space, float]:
    """Return the central controller (A, B, C, D) and its gamma, no more than tolerance above the
    least, times slack.

    Args:
        tolerance: relative. low, high: where gamma is looked for. slack: 1 or more.

    Raises:
        ControllerError: there is none with gamma up to `high`.
    """
    normal, u, y = _normal(_scaled(plant))
    gamma, best = high, None
    while gamma > low * (1.0 + tolerance):
        middle = float(np.sqrt(low * gamma))
        if (found := _tried(normal, middle)) is None:
            low = middle
        else:
            gamma, best = middle, found
    wider = slack * gamma
    if (best is None or slack > 1.0) and (found := _tried(normal, wider)) is not None:
        gamma, best = wider, found
    if best is None:
        raise ControllerError(
            f"no controller keeps the norm below {high:g}: something cannot be stabilised by the "
            "torques or seen in the measurements; choose other weights or another model"
        )
    return _unscaled(best, plant.D22, u, y), gamma


def _scaled(plant: Plant) -> Plant:
    """Return a plant whose states are as large as what drives them and what is seen of them.

    Of the arm's, whose states are radians and radians per second, Riccati equations keep two or
    three more digits so.
    """
    A, B1, B2, C1, C2 = plant[:5]
    driven = np.linalg.norm(np.hstack([B1, B2]), axis=1)
    seen = np.linalg.norm(np.vstack([C1, C2]), axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.sqrt(driven / seen)
    size = np.where(np.isfinite(size) & (size > 0.0), size, 1.0)  # (n,)
    return Plant(
        A * size / size[:, None],
        B1 / size[:, None],
        B2 / size[:, None],
        C1 * size,
        C2 * size,
        *plant[5:],
    )


def _normal(plant: Plant) -> tuple[Plant, Array, Array]:
    """Return a plant with D12 = [0; 1], D21 = [0, 1] and D22 = 0, and the scales of u and y."""
    p2, m2 = plant.D22.shape
    Q, R = np.linalg.qr(plant.D12, mode="complete")
    W, S = np.linalg.qr(plant.D21.T, mode="complete")
    Q, W = np.roll(Q, -m2, axis=1), np.roll(W, -p2, axis=1)
    u, y = np.linalg.inv(R[:m2]), np.linalg.inv(S[:p2].T)  # true u = u u~, scaled y~ = y y
    normal = Plant(
        plant.A,
        plant.B1 @ W,
        plant.B2 @ u,
        Q.T @ plant.C1,
        y @ plant.C2,
        Q.T @ plant.D11 @ W,
        np.eye(len(Q), m2, m2 - len(Q)),
        np.eye(p2, len(W), len(W) - p2),
        np.zeros((p2, m2)),
    )
    return normal, u, y


def _unscaled(K: Space, D22: Array, u: Array, y: Array) -> Space:
    """Return a controller of the normal plant as that of the true one."""
    A, B, C, D = K[0], K[1] @ y, u @ K[2], u @ K[3] @ y
    inner = np.linalg.inv(np.eye(len(D)) + D @ D22)  # u = K (y - D22 u)
    C, D = inner @ C, inner @ D
    return A - B @ D22 @ C, B - B @ D22 @ D, C, D


def _tried(plant: Plant, gamma: float) -> Space | None:
    """Return the central controller, None also where a matrix on the way is singular."""
    try:
        return central(plant, gamma)
    except LinAlgError:
        return None


def central(plant: Plant, gamma: float) -> Space | None:
    """Return the central controller (A, B, C, D) of a normal plant, None if there is none of gamma.

    Args:
        plant: with D12 = [0; 1], D21 = [0, 1], D22 = 0.
    """
    A, B1, B2, C1, C2, D11, D12, D21, _ = plant
    m1, m2, p1, p2 = B1.shape[1], B2.shape[1], len(C1), len(C2)
    a, b = m1 - p2, p1 - m2  # where D11 is split
    sizes = [np.linalg.norm(part, 2) for part in (D11[:b], D11[:, :a]) if part.size]
    if gamma <= max(sizes, default=0.0):
        return None
    B, C = np.hstack([B1, B2]), np.vstack([C1, C2])
    D1, Dw = np.hstack([D11, D12]), np.vstack([D11, D21])
    R, Rw = D1.T @ D1, Dw @ Dw.T
    R[:m1, :m1] -= gamma**2 * np.eye(m1)
    Rw[:p1, :p1] -= gamma**2 * np.eye(p1)
    X = _stabilising(A, B, C1, D1, R)
    if X is None:
        return None
    Y = _stabilising(A.T, C.T, B1.T, Dw.T, Rw)
    if Y is None or np.abs(np.linalg.eigvals(X @ Y)).max() >= gamma**2:
        return None
    F = -solved(R, D1.T @ C1 + B.T @ X)  # (m1 + m2, n)
    L = -solved(Rw, (B1 @ Dw.T + Y @ C.T).T).T  # (n, p1 + p2)
    F12, F2, L12, L2 = F[a:m1], F[m1:], L[:, b:p1], L[:, p1:]
    Z = np.linalg.inv(np.eye(len(A)) - Y @ X / gamma**2)  # (n, n)
    K11, K12, K21 = _direct(D11, a, b, gamma)
    Bk2, Ck2 = Z @ (B2 + L12) @ K12, -K21 @ (C2 + F12)
    Bk = -Z @ L2 + Bk2 @ solved(K12, K11)
    Ck = F2 + K11 @ solved(K21, Ck2)
    return A + B @ F + Bk @ solved(K21, Ck2), Bk, Ck, K11


def _direct(D11: Array, a: int, b: int, gamma: float) -> tuple[Array, Array, Array]:
    """Return the controllers' direct parts: K11 (m2, p2), K12 (m2, m2) and K21 (p2, p2)."""
    D1111, D1112, D1121, D1122 = D11[:b, :a], D11[:b, a:], D11[b:, :a], D11[b:, a:]
    rows = gamma**2 * np.eye(b) - D1111 @ D1111.T
    columns = gamma**2 * np.eye(a) - D1111.T @ D1111
    K11 = -D1121 @ D1111.T @ solved(rows, D1112) - D1122
    K12 = np.eye(len(D1121)) - D1121 @ solved(columns, D1121.T)
    K21 = np.eye(D1112.shape[1]) - D1112.T @ solved(rows, D1112)
    left, right = (np.asarray(np.linalg.cholesky(part), dtype=float) for part in (K12, K21))
    return K11, left, right.T


def _stabilising(A: Array, B: Array, C: Array, D: Array, R: Array) -> Array | None:
    """Return X >= 0 (n, n) of the Riccati equation of a game, None if there is none.

    Of [A, 0; -C'C, -A'] - [B; -C'D] R^-1 [D'C, B'], whose stable subspace it spans.
    """
    n = len(A)
    right = solved(R, np.hstack([D.T @ C, B.T]))
    left = np.vstack([B, -C.T @ D])
    H = np.block([[A, np.zeros((n, n))], [-C.T @ C, -A.T]]) - left @ right
    try:
        T, U, stable = schur(H, sort="lhp")
        X = solved(U[:n, :n].T, U[n:, :n].T)
    except (LinAlgError, ValueError):
        return None
    rates = np.abs(np.diag(T))  # real parts: those of a pair stand twice on the diagonal
    if stable != n or rates.min() <= ON_AXIS * rates.max():
        return None
    X = (X + X.T) / 2
    sizes = np.linalg.eigvalsh(X)
    return X if sizes[0] >= -NEGATIVE * max(sizes[-1], 1.0) else None


def to_continuous(sampled: Space, rate: float) -> Space:
    """Return (A, B, C, D) with z = (1 + s/rate)/(1 - s/rate), which keeps norms and stability.

    Args:
        sampled: without a pole at z = -1. rate: [unit of 1/s]; 2/T is Tustin's.
    """
    A, B, C, D = sampled
    n, root = len(A), np.sqrt(2.0 * rate)
    inner = np.linalg.inv(A + np.eye(n))
    return rate * (A - np.eye(n)) @ inner, root * inner @ B, root * C @ inner, D - C @ inner @ B


def to_sampled(continuous: Space, rate: float) -> Space:
    """Return the system whose `to_continuous` this is."""
    A, B, C, D = continuous
    A, n, root = A / rate, len(A), np.sqrt(2.0 / rate)
    inner = np.linalg.inv(np.eye(n) - A)
    return (np.eye(n) + A) @ inner, root * inner @ B, root * C @ inner, D + C @ inner @ B / rate
