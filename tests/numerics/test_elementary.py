"""Elementary functions of arrays against numpy's, which differ in the last bits at most."""

import numpy as np
import pytest

from flexsim.numerics import elementary

ULP = 5e-16  # relative: two units in the last place


@pytest.mark.parametrize("name", ["sin", "cos", "tanh", "exp", "log", "log10", "cbrt"])
def test_functions_of_one_argument(name: str) -> None:
    x = np.linspace(0.1, 3.0, 24).reshape(2, 3, 4)
    found = getattr(elementary, name)(x)
    np.testing.assert_allclose(found, getattr(np, name)(x), rtol=ULP, atol=ULP)
    assert found.shape == x.shape
    assert float(getattr(elementary, name)(x[1, 2, 3])) == found[1, 2, 3]


def test_arctan2_knows_the_quadrant_and_broadcasts() -> None:
    y = np.array([[1.0], [-1.0], [0.0]])
    x = np.array([1.0, -1.0])
    found = elementary.arctan2(y, x)
    np.testing.assert_allclose(found, np.arctan2(*np.broadcast_arrays(y, x)), rtol=ULP)
    assert found.shape == (3, 2)


def test_a_cube_is_a_product() -> None:
    x = np.linspace(-1.0, 3.0, 1001)
    assert elementary.cubed(x).tolist() == [float(each) * float(each) * float(each) for each in x]


def test_powers_of_ten() -> None:
    x = np.linspace(-3.0, 2.0, 51)
    np.testing.assert_allclose(elementary.power_of_ten(x), 10.0**x, rtol=10 * ULP)
    np.testing.assert_allclose(elementary.log10(elementary.power_of_ten(x)), x, atol=4 * ULP)
