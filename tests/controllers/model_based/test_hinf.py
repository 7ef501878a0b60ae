"""H-infinity synthesis: closed forms, a published example, and that norms are what is promised."""

import numpy as np
import pytest
from designs import circle, closed, response
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are

from controllers import ControllerError
from controllers.model_based.hinf import Plant, central, synthesised, to_continuous, to_sampled
from controllers.model_based.model import Space

FINE = 1e-6  # relative, of the search
ROUNDED = 1e-9  # relative: how much a computed norm may exceed gamma
OMEGA = 1j * np.geomspace(1e-4, 1e5, 4000)


def coprime(A: NDArray[np.float64], B: NDArray[np.float64], C: NDArray[np.float64]) -> Plant:
    """(G (u + d), u + d) from (d, n): 1/gamma is the margin of the normalised coprime factors."""
    n, m, p = len(A), B.shape[1], len(C)
    return Plant(
        A,
        np.hstack([B, np.zeros((n, p))]),
        B,
        np.vstack([C, np.zeros((m, n))]),
        C,
        np.block([[np.zeros((p, m + p))], [np.eye(m), np.zeros((m, p))]]),
        np.vstack([np.zeros((p, m)), np.eye(m)]),
        np.hstack([np.zeros((p, m)), np.eye(p)]),
        np.zeros((p, m)),
    )


INTEGRATORS = {
    "one": (coprime(np.zeros((1, 1)), np.eye(1), np.eye(1)), np.sqrt(2.0)),
    "two": (
        coprime(np.eye(2, k=1), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])),
        1 / np.sin(np.pi / 8),
    ),
}


def norm(system: Space, at: NDArray[np.complex128] = OMEGA) -> float:
    return float(np.linalg.svd(response(system, at), compute_uv=False).max())


@pytest.mark.parametrize("which", INTEGRATORS)
def test_gamma_of_integrators(which: str) -> None:
    """sqrt(1 + largest eigenvalue of X Y), X and Y of the LQ regulator and filter: sqrt 2 for 1/s,
    sqrt(4 + 2 sqrt 2) = 1/sin(pi/8) for 1/s^2.
    """
    plant, wanted = INTEGRATORS[which]
    _, gamma = synthesised(plant, FINE)
    assert gamma == pytest.approx(wanted, rel=3 * FINE)
    K, gamma = synthesised(plant, 0.01, slack=1.1)
    loop = closed(plant, K)
    assert np.linalg.eigvals(loop[0]).real.max() < 0.0
    assert 0.9 * wanted < wanted * (1 - ROUNDED) < norm(loop) <= gamma * (1 + ROUNDED)


def test_a_published_example() -> None:
    """python-control's test of `hinfsyn`, there from Octave and SLICOT's SB10AD.

    Source: control/tests/robust_test.py of github.com/python-control/python-control.
    """
    one, none = np.eye(1), np.zeros((1, 1))
    plant = Plant(-one, one, one, one, one, none, one, one, none)
    K, _ = synthesised(plant)
    assert [float(part[0, 0]) for part in K] == pytest.approx([-3.0, 1.0, -1.0, 0.0], abs=1e-6)


def process() -> Plant:
    """G = 200/((10 s + 1)(0.05 s + 1)^2) with weights (s/1.5 + 10)/(s + 1e-3) on S and 1 on K S."""
    A = np.array(
        [[-0.1, 1.0, 0.0, 0.0], [0.0, -20.0, 1.0, 0.0], [0.0, 0.0, -20.0, 0.0], [-1.0, 0, 0, 0]]
    )
    G = np.array([[20.0 * 400.0, 0.0, 0.0, 0.0]])  # 200/10/0.05^2
    A[3, :], A[3, 3] = -G[0], -1e-3  # the weight's state is driven by r - y
    B1, B2 = np.array([[0.0], [0.0], [0.0], [1.0]]), np.array([[0.0], [0.0], [1.0], [0.0]])
    weight = 10.0 - 1e-3 / 1.5
    C1 = np.vstack([-G / 1.5, np.zeros((1, 4))])
    C1[0, 3] = weight
    D11, D12 = np.array([[1 / 1.5], [0.0]]), np.array([[0.0], [1.0]])
    return Plant(A, B1, B2, C1, -G, D11, D12, np.eye(1), np.zeros((1, 1)))


def test_mixed_sensitivity_of_a_textbooks_process() -> None:
    """Its norm is 1.37: S. Skogestad, I. Postlethwaite, Multivariable Feedback Control, 1996,
    example 2.11, the number from memory, not checked against the print.
    """
    K, gamma = synthesised(process(), 1e-3)
    assert gamma == pytest.approx(1.37, abs=0.005)
    loop = closed(process(), K)
    assert np.linalg.eigvals(loop[0]).real.max() < 0.0
    assert norm(loop) == pytest.approx(gamma, rel=2e-3)


def test_below_the_least_gamma_there_is_none() -> None:
    for plant, least in INTEGRATORS.values():
        turned = plant._replace(  # D12 = [0; 1], D21 = [0, 1] as they are
            D22=np.zeros((1, 1))
        )
        assert central(turned, least * (1 - 1e-4)) is None
        assert central(turned, least * (1 + 1e-4)) is not None


def random_plant(seed: int) -> Plant:
    rng = np.random.default_rng(seed)
    n, m1, m2, p1, p2 = 5, 4, 2, 3, 2
    parts = [(n, n), (n, m1), (n, m2), (p1, n), (p2, n), (p1, m1), (p1, m2), (p2, m1), (p2, m2)]
    return Plant(*(rng.standard_normal(shape) for shape in parts))


@pytest.mark.parametrize("seed", range(5))
def test_the_norm_is_below_gamma_whatever_the_plant(seed: int) -> None:
    """All D's there, scales not normal, some plants unstable."""
    plant = random_plant(seed)
    K, gamma = synthesised(plant, 0.01, slack=1.05)
    loop = closed(plant, K)
    assert np.linalg.eigvals(loop[0]).real.max() < 0.0
    assert 0.5 * gamma < norm(loop) <= gamma * (1 + 1e-6)


def test_what_cannot_be_stabilised_is_refused() -> None:
    plant = random_plant(0)
    A, B2 = plant.A.copy(), plant.B2.copy()
    A[0, :], A[0, 0], B2[0] = 0.0, 0.5, 0.0
    with pytest.raises(ControllerError, match="no controller keeps the norm below"):
        synthesised(plant._replace(A=A, B2=B2))


def test_the_bilinear_map_keeps_norms_and_comes_back() -> None:
    rng = np.random.default_rng(3)
    A = rng.standard_normal((4, 4))
    A *= 0.95 / np.abs(np.linalg.eigvals(A)).max()
    given = A, rng.standard_normal((4, 2)), rng.standard_normal((3, 4)), rng.standard_normal((3, 2))
    rate = 7.0
    moved = to_continuous(given, rate)
    z = circle(3000)
    s = rate * (z - 1) / (z + 1)
    assert response(moved, s[:-1]) == pytest.approx(response(given, z[:-1]), rel=1e-9, abs=1e-9)
    for part, again in zip(given, to_sampled(moved, rate), strict=True):
        assert again == pytest.approx(part, rel=1e-10, abs=1e-12)


def test_of_a_huge_gamma_it_is_the_regulator_and_filter_of_lqg() -> None:
    """H2's: u = F of an estimate, and no direct path but what cancels that from w to z."""
    rng = np.random.default_rng(4)
    n, m1, m2, p1, p2 = 3, 3, 1, 3, 1
    A, B1, B2 = (rng.standard_normal(shape) for shape in ((n, n), (n, m1), (n, m2)))
    C1, C2 = rng.standard_normal((p1, n)), rng.standard_normal((p2, n))
    D11 = np.zeros((p1, m1))
    D11[-1, -1] = 0.7  # from the measurement's noise to the torque's output
    D12, D21 = np.eye(p1, m2, m2 - p1), np.eye(p2, m1, m1 - p2)
    found = central(Plant(A, B1, B2, C1, C2, D11, D12, D21, np.zeros((p2, m2))), 1e7)
    assert found is not None
    assert found[3] == pytest.approx(-D11[-1:, -1:], abs=1e-9)
    quiet = central(Plant(A, B1, B2, C1, C2, 0 * D11, D12, D21, np.zeros((p2, m2))), 1e7)
    assert quiet is not None
    S = D12.T @ C1, B1 @ D21.T
    X = solve_continuous_are(A, B2, C1.T @ C1, np.eye(m2), s=C1.T @ D12)
    Y = solve_continuous_are(A.T, C2.T, B1 @ B1.T, np.eye(p2), s=B1 @ D21.T)
    F, L = -(S[0] + B2.T @ X), -(S[1] + Y @ C2.T)
    wanted = A + B2 @ F + L @ C2, -L, F, np.zeros((1, 1))
    for part, other in zip(quiet, wanted, strict=True):
        assert part == pytest.approx(other, rel=1e-6, abs=1e-8)
