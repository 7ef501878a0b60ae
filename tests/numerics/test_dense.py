"""Small dense linear algebra against numpy's, and the state matrix against motions known."""

import numpy as np
import pytest

from flexsim.errors import ModelError
from flexsim.numerics.dense import product, solve
from flexsim.numerics.state_matrix import state_matrix

ROUNDING = 1e-12  # relative, of matrices of condition below 1e3


@pytest.mark.parametrize("n", [1, 2, 7, 20])
def test_solve_and_product_agree_with_numpys(n: int) -> None:
    rng = np.random.default_rng(n)
    A, B = rng.normal(size=(n, n)) + 3 * np.eye(n), rng.normal(size=(n, 3))
    np.testing.assert_allclose(solve(A, B), np.linalg.solve(A, B), rtol=ROUNDING, atol=ROUNDING)
    np.testing.assert_allclose(solve(A, B[:, 0]), np.linalg.solve(A, B[:, 0]), atol=ROUNDING)
    np.testing.assert_allclose(product(A, B), A @ B, atol=ROUNDING)
    np.testing.assert_allclose(product(A, B[:, 0]), A @ B[:, 0], atol=ROUNDING)
    stack = rng.normal(size=(4, 2, n))
    np.testing.assert_allclose(product(stack, B), stack @ B, atol=ROUNDING)


def test_solve_pivots() -> None:
    np.testing.assert_array_equal(solve([[0.0, 2.0], [1.0, 0.0]], [4.0, 3.0]), [3.0, 2.0])


@pytest.mark.parametrize("matrix", [[[1.0, 2.0], [2.0, 4.0]], [[np.nan]], [[0.0]], [[np.inf]]])
def test_a_singular_matrix_is_refused(matrix: list[list[float]]) -> None:
    with pytest.raises(ModelError, match="singular"):
        solve(matrix, np.ones(len(matrix)))


def test_a_damped_oscillator_has_its_rates() -> None:
    m, d, k = 2.0, 0.4, 50.0
    rates = np.linalg.eigvals(state_matrix([[m]], [[d]], [[k]]))
    expected = -d / (2 * m) + 1j * np.sqrt(k / m - (d / (2 * m)) ** 2)
    np.testing.assert_allclose(np.sort_complex(rates), [expected.conjugate(), expected])


def test_a_mass_matrix_need_not_be_symmetric() -> None:
    rng = np.random.default_rng(1)
    M, D, K = rng.normal(size=(3, 4, 4))
    q, rate = rng.normal(size=(2, 4))
    change = state_matrix(M, D, K) @ np.concatenate([q, rate])
    np.testing.assert_array_equal(change[:4], rate)
    np.testing.assert_allclose(M @ change[4:], -K @ q - D @ rate, atol=ROUNDING * 10)
