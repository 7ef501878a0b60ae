"""Gauss-Legendre quadrature: polynomials are exact, and few points are known in closed form."""

import numpy as np
import pytest

from flexsim import ParameterError
from flexsim.numerics.quadrature import gauss_legendre

ROUNDING = 1e-14


def test_three_points_are_those_of_the_textbook() -> None:
    node, weight = gauss_legendre(3)
    np.testing.assert_allclose(node, [-np.sqrt(0.6), 0.0, np.sqrt(0.6)], atol=ROUNDING)
    np.testing.assert_allclose(weight, [5 / 9, 8 / 9, 5 / 9], rtol=ROUNDING)


@pytest.mark.parametrize("points", [1, 2, 12, 44, 340])
def test_polynomials_are_integrated_exactly(points: int) -> None:
    node, weight = gauss_legendre(points)
    for degree in (0, 1, points, 2 * points - 2, 2 * points - 1):
        exact = 2 / (degree + 1) if degree % 2 == 0 else 0.0
        found = float(np.sum(weight * node**degree))
        assert found == pytest.approx(exact, abs=ROUNDING * points)


def test_nothing_to_integrate_with_is_refused() -> None:
    with pytest.raises(ParameterError, match="give 1 or more"):
        gauss_legendre(0)
