"""Natural modes by Jacobi rotations: closed forms, LAPACK, small beside large, refusals."""

import numpy as np
import pytest
from scipy.linalg import eigh

from flexsim.errors import ModelError
from flexsim.numerics.eigen import natural_modes, symmetric_eigen
from flexsim.numerics.types import Array

ROUNDING = 1e-12  # relative to the largest eigenvalue, of a few dozen coordinates


def system(n: int) -> tuple[Array, Array]:
    """Return K with two coordinates without a spring, and M."""
    rng = np.random.default_rng(n)
    mixed = rng.normal(size=(n, n))
    K = np.diag(rng.uniform(1, 2, size=n))
    K[:2] = 0.0
    return K, mixed @ mixed.T + 0.1 * np.eye(n)


def test_a_chain_of_masses_and_springs() -> None:
    """N unit masses between unit springs: omega_i = 2 sin(i pi / (2 (N + 1)))."""
    n = 9
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    squared, vectors = natural_modes(K, np.eye(n))
    exact = 2 * np.sin(np.arange(1, n + 1) * np.pi / (2 * (n + 1)))
    np.testing.assert_allclose(np.sqrt(squared), exact, rtol=ROUNDING)
    first = np.sin(np.arange(1, n + 1) * np.pi / (n + 1)) * np.sqrt(2 / (n + 1))
    np.testing.assert_allclose(np.abs(vectors[:, 0]), first, rtol=ROUNDING)


@pytest.mark.parametrize("n", [3, 8, 16, 40])
def test_modes_diagonalise_mass_and_stiffness(n: int) -> None:
    K, M = system(n)
    squared, vectors = natural_modes(K, M)
    tolerance = ROUNDING * squared[-1]
    np.testing.assert_allclose(vectors.T @ M @ vectors, np.eye(n), atol=ROUNDING)
    np.testing.assert_allclose(vectors.T @ K @ vectors, np.diag(squared), atol=tolerance)
    np.testing.assert_allclose(squared, eigh(K, M, eigvals_only=True), atol=tolerance)
    assert (np.diff(squared) >= 0).all()


def test_small_eigenvalues_beside_large_ones_are_as_exact() -> None:
    """A graded matrix D A D: relative accuracy, which LAPACK's does not have."""
    A = np.array([[1.0, 0.5, 0.25], [0.5, 1.0, 0.5], [0.25, 0.5, 1.0]])
    D = np.diag([1.0, 1e-6, 1e-12])
    values, _ = symmetric_eigen(D @ A @ D)
    product = np.prod(values) / np.linalg.det(A) / 1e-36
    assert product == pytest.approx(1.0, rel=ROUNDING)


@pytest.mark.parametrize("matrix", [np.zeros((3, 3)), np.diag([3.0, 1.0, 2.0])])
def test_diagonal_matrices_stay(matrix: Array) -> None:
    values, vectors = symmetric_eigen(matrix)
    np.testing.assert_array_equal(values, np.sort(np.diag(matrix)))
    np.testing.assert_array_equal(np.abs(vectors).sum(axis=0), np.ones(3))


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_what_is_not_finite_is_refused(wrong: float) -> None:
    K = np.eye(3)
    K[0, 1] = K[1, 0] = wrong
    with pytest.raises(ModelError, match="not finite"):
        symmetric_eigen(K)
    with pytest.raises(ModelError, match="not finite"):
        natural_modes(K, np.eye(3))


@pytest.mark.parametrize("M", [np.diag([1.0, 0.0]), np.ones((2, 2)), np.full((2, 2), np.nan)])
def test_a_mass_matrix_that_is_not_positive_is_refused(M: Array) -> None:
    with pytest.raises(ModelError, match="mass matrix is singular"):
        natural_modes(np.eye(2), M)
