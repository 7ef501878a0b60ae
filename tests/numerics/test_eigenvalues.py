"""Eigenvalues of any real matrix: known ones, LAPACK's, pairs, badly scaled motions."""

import numpy as np
import pytest

from flexsim.errors import ModelError
from flexsim.numerics.eigenvalues import eigenvalues
from flexsim.numerics.state_matrix import state_matrix
from flexsim.numerics.types import Array

ROUNDING = 1e-11  # relative to the largest, of random matrices of a few dozen rows


def paired(found: Array, known: Array) -> float:
    """Return the largest distance of eigenvalues to their counterparts, over the largest."""
    left = list(found)
    worst = 0.0
    for value in known:
        nearest = int(np.argmin(np.abs(np.array(left) - value)))
        worst = max(worst, abs(left.pop(nearest) - value))
    return worst / max(1.0, float(np.abs(known).max()))


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7, 16, 40])
@pytest.mark.parametrize("seed", range(5))
def test_random_matrices_have_lapacks_eigenvalues(n: int, seed: int) -> None:
    A = np.random.default_rng(100 * n + seed).normal(size=(n, n))
    assert paired(eigenvalues(A), np.linalg.eigvals(A)) < ROUNDING


def test_pairs_are_beside_one_another() -> None:
    found = eigenvalues([[0.0, 1.0, 0.0], [-4.0, 0.0, 0.0], [0.0, 0.0, 3.0]])
    np.testing.assert_allclose(found, [2j, -2j, 3.0], atol=1e-15)


@pytest.mark.parametrize(
    ("matrix", "known"),
    [
        (np.zeros((3, 3)), np.zeros(3)),
        (np.eye(4), np.ones(4)),
        (np.triu(np.ones((3, 3))), np.ones(3)),
        (np.eye(4, k=-1), np.zeros(4)),  # nilpotent, though exactly so
        (np.roll(np.eye(4), 1, axis=0), np.array([1, -1, 1j, -1j])),  # the usual shift stands still
        (np.diag([1e-200, 1e200]), np.array([1e-200, 1e200])),
    ],
)
def test_special_matrices(matrix: Array, known: Array) -> None:
    assert paired(eigenvalues(matrix), known) < ROUNDING


def test_damped_motions_keep_their_damping() -> None:
    """Rates of 1e4 beside 20 rad/s, damping ratios of 1e-6: balancing is what it takes."""
    omega, zeta = np.array([20.0, 130.0, 1e4]), np.array([1e-6, 1e-3, 0.2])
    found = eigenvalues(state_matrix(np.eye(3), np.diag(2 * zeta * omega), np.diag(omega**2)))
    swinging = found[found.imag > 0]
    swinging = swinging[np.argsort(np.abs(swinging))]
    np.testing.assert_allclose(np.abs(swinging), omega, rtol=1e-12)
    np.testing.assert_allclose(-swinging.real / np.abs(swinging), zeta, atol=1e-12)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_what_is_not_finite_is_refused(wrong: float) -> None:
    with pytest.raises(ModelError, match="not finite"):
        eigenvalues([[1.0, wrong], [0.0, 1.0]])
