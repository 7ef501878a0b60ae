"""Balanced truncation: closed form, its bound from above and below, what it refuses."""

import numpy as np
import pytest
from designs import circle, response

from controllers import ControllerError
from controllers.model_based.model import Space
from controllers.model_based.reduction import balanced

EXACT = 1e-10  # relative


def system(n: int, seed: int, radius: float = 0.97) -> Space:
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n, n))
    A *= radius / np.abs(np.linalg.eigvals(A)).max()
    return A, rng.standard_normal((n, 2)), rng.standard_normal((3, n)), rng.standard_normal((3, 2))


def distance(one: Space, other: Space) -> float:
    z = np.concatenate([circle(4000), [1.0 + 0j, -1.0]])
    apart = response(one, z) - response(other, z)
    return float(np.linalg.svd(apart, compute_uv=False).max())


def test_hankel_value_of_one_state() -> None:
    a, b, c = 0.8, 2.0, -3.0
    found = balanced(tuple(np.array([[x]]) for x in (a, b, c, 1.0)))  # type: ignore[arg-type]
    assert found.values[0] == pytest.approx(abs(b * c) / (1 - a**2), rel=EXACT)
    assert found.bounds == pytest.approx([2 * abs(b * c) / (1 - a**2), 0.0], rel=EXACT)


@pytest.mark.parametrize("seed", range(4))
def test_the_error_is_within_its_bounds(seed: int) -> None:
    """Twice the sum of the values left out above, the first of them below: no order can do less."""
    given = system(8, seed)
    found = balanced(given)
    for order in range(9):
        small = found.truncated(order)
        assert len(small[0]) == order
        error = distance(given, small)
        assert error <= found.bounds[order] * (1 + 1e-6) + 1e-9
        if order < 8:
            assert error >= found.values[order] * (1 - 1e-3)
        assert np.abs(np.linalg.eigvals(small[0])).max(initial=0.0) < 1.0


def test_states_that_do_nothing_go() -> None:
    A, B, C, D = system(4, 1)
    whole = np.zeros((6, 6))
    whole[:4, :4], whole[4:, 4:] = A, np.diag([0.5, -0.9])
    given = whole, np.vstack([B, np.ones((2, 2))]), np.hstack([C, np.zeros((3, 2))]), D
    small = balanced(given).truncated(6)
    assert len(small[0]) == 4
    assert distance(given, small) < 1e-9


def test_the_balanced_states_have_no_choice_of_sign() -> None:
    A, B, C, D = system(5, 2)
    turned = -np.eye(5)
    one = balanced((A, B, C, D)).truncated(3)
    other = balanced((turned @ A @ turned, turned @ B, C @ turned, D)).truncated(3)
    assert np.abs(one[0]) == pytest.approx(np.abs(other[0]), rel=1e-7)


def test_an_unstable_system_is_refused() -> None:
    with pytest.raises(ControllerError, match="only a stable system"):
        balanced(system(3, 0, radius=1.01))
