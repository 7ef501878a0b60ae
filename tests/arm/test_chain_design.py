"""The design of the chain: closed forms, tuning, convergence of the plain chain, errors."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from flexsim import ParameterError, Parameters
from flexsim.arm.beam import modal_integrals
from flexsim.arm.chain_design import ChainDesign, design_chain, plain_chain
from flexsim.arm.hinged_beam import chain_modes, frequency_sensitivity, mass_matrix, shape_errors

pytestmark = pytest.mark.kernels  # run once more under another BLAS kernel


ROUNDING = 1e-12  # a few operations on numbers of size 1
TUNED = 1e-10  # stiffnesses carry ten decimals, so that every machine has the same design
PARAMETERS = Parameters()


def test_one_hinge_is_a_pendulum_on_a_spring() -> None:
    a, k = np.array([0.25]), np.array([2.0])
    omega, q = chain_modes(a, k)
    u = 0.75  # inertia u^3/3 about the hinge
    assert omega[0] == pytest.approx(np.sqrt(2.0 / (u**3 / 3)), rel=ROUNDING)
    assert q[0, 0] == pytest.approx(1 / np.sqrt(u**3 / 3), rel=ROUNDING)


def test_mass_matrix_of_fractions() -> None:
    a = [Fraction(1, 8), Fraction(1, 2), Fraction(3, 4)]
    for i, first in enumerate(a):
        for j, second in enumerate(a):
            low, high = min(first, second), max(first, second)
            u = 1 - high
            exact = u**3 / 3 + (high - low) * u**2 / 2
            found = mass_matrix(np.array([float(x) for x in a]))[i, j]
            assert found == pytest.approx(float(exact), rel=ROUNDING)


def test_mass_matrix_is_the_beams_under_the_hinge_shapes() -> None:
    a = design_chain(PARAMETERS, 6).position / PARAMETERS.L
    ends = np.concatenate([[0.0], a, [1.0]])
    node, weight = leggauss(4)  # exact for the quadratics on each piece
    mass = np.zeros((6, 6))
    for start, end in pairwise(ends):
        s = start + (node + 1) / 2 * (end - start)
        shape = np.maximum(s[:, None] - a, 0)
        mass += np.einsum("m,mi,mj->ij", weight / 2 * (end - start), shape, shape)
    np.testing.assert_allclose(mass_matrix(a), mass, rtol=ROUNDING, atol=ROUNDING)


def test_modes_are_those_of_mass_and_stiffness() -> None:
    a, k = np.array([0.1, 0.4, 0.7]), np.array([9.0, 5.0, 4.0])
    omega, q = chain_modes(a, k)
    np.testing.assert_allclose(q.T @ mass_matrix(a) @ q, np.eye(3), atol=ROUNDING)
    np.testing.assert_allclose(
        q.T @ np.diag(k) @ q, np.diag(omega**2), atol=ROUNDING * omega[-1] ** 2
    )
    assert np.sign((1 - a) @ q).tolist() == [1, -1, 1]


def test_frequency_sensitivity_is_a_derivative() -> None:
    a, k = np.array([0.1, 0.4, 0.7, 0.9]), np.array([9.0, 5.0, 4.0, 6.0])
    omega, q = chain_modes(a, k)
    step = 1e-6 * np.eye(4)
    rise = [
        np.log(chain_modes(a, k * np.exp(s))[0] / chain_modes(a, k * np.exp(-s))[0]) for s in step
    ]
    difference = (np.array(rise) / 2e-6).T[:3]
    # central differences: rounding 1e-16 / 1e-6, truncation 1e-12
    np.testing.assert_allclose(frequency_sensitivity(k, omega, q), difference, atol=1e-9)


def test_shape_errors_vanish_for_a_fine_chain() -> None:
    design = plain_chain(PARAMETERS, 200)
    a, k = design.position / PARAMETERS.L, np.full(200, 200.0)
    _, q = chain_modes(a, k)
    assert np.abs(shape_errors(a, k, q)).max() < 1e-2  # order 2: 4.3 % at 8, mode 3


def test_plain_chain_converges_with_order_two() -> None:
    counts = np.array([8, 16, 32, 64])
    errors = np.array([plain_chain(PARAMETERS, n).frequency_error for n in counts])  # (4, 3)
    couplings = np.array([plain_chain(PARAMETERS, n).coupling_error for n in counts])
    for error in (*errors.T, couplings):
        order = -np.polyfit(np.log(counts), np.log(np.abs(error)), 1)[0]
        # asymptotic: 8 cells hold a wave of mode 3 only just
        assert order == pytest.approx(2.0, abs=0.1)


def test_plain_chain_of_eight() -> None:
    errors = 100 * plain_chain(PARAMETERS, 8).frequency_error
    np.testing.assert_allclose(errors, [0.36, 1.26, 2.03], atol=0.005)  # quoted to 2 digits


@pytest.mark.parametrize("segments", range(3, 17))
def test_first_three_frequencies_are_the_beams(segments: int) -> None:
    design = design_chain(PARAMETERS, segments)
    exact = modal_integrals(PARAMETERS, 3).frequency
    np.testing.assert_allclose(design.frequency[:3], exact, rtol=TUNED)
    assert np.abs(design.frequency_error).max() < TUNED


def test_an_unfitted_chain_fails_that_check() -> None:
    design = plain_chain(PARAMETERS, 6)
    assert np.abs(design.frequency_error).max() > 1e6 * TUNED
    assert not design.fitted


# Worst error of Phi_i and of the first moment [%], and highest clamped frequency [rad/s], which
# RK4 must resolve. Bounds a little above what the least squares find: 0.369, 0.096, 0.029, ...;
# three hinges have no freedom left for the couplings
BOUNDS = {
    3: (26, 370),
    4: (0.40, 600),
    5: (0.10, 920),
    6: (0.05, 1430),
    8: (0.008, 2650),
    10: (0.004, 4000),
}


@pytest.mark.parametrize("segments", BOUNDS)
def test_couplings_and_top_frequency(segments: int) -> None:
    worst, top = BOUNDS[segments]
    design = design_chain(PARAMETERS, segments)
    assert 100 * design.coupling_error < worst
    assert 100 * np.abs(design.tip_error).max() < worst
    assert 100 * abs(design.compliance_error) < worst
    assert design.frequency[-1] < top


def test_static_compliance_is_that_of_the_reported_hinges() -> None:
    design = design_chain(PARAMETERS, 6)
    lever = PARAMETERS.L - design.position
    compliance = np.sum(lever**2 / design.stiffness)
    error = compliance / PARAMETERS.static_compliance - 1
    assert error == pytest.approx(design.compliance_error, abs=ROUNDING)


def test_hinges_lie_inside_and_springs_push_back() -> None:
    design = design_chain(PARAMETERS, 10)
    ends = np.concatenate([[0.0], design.position, [PARAMETERS.L]])
    assert (np.diff(ends) > 0).all() and (design.stiffness > 0).all()


def test_mac_is_high_but_not_forced() -> None:
    mac = design_chain(PARAMETERS, 6).mac
    assert (mac > [0.9999, 0.998, 0.99]).all() and (mac <= 1).all()


def test_design_scales_with_the_beam() -> None:
    """The dimensionless design serves every robot: longer beams, other stiffness."""
    other = Parameters(L=0.8, EI=1.2, rho=0.3)
    first, second = design_chain(PARAMETERS), design_chain(other)
    ratio = first.stiffness * PARAMETERS.L / PARAMETERS.EI
    np.testing.assert_allclose(second.stiffness * 0.8 / 1.2, ratio, rtol=ROUNDING)
    exact = modal_integrals(other, 3).frequency
    np.testing.assert_allclose(second.frequency[:3], exact, rtol=TUNED)


def test_design_is_deterministic_and_cached() -> None:
    first, second = design_chain(PARAMETERS), design_chain(PARAMETERS)
    assert isinstance(first, ChainDesign)
    np.testing.assert_array_equal(first.stiffness, second.stiffness)


@pytest.mark.parametrize("segments", [2, 17, 0, -6, 6.0, 6.5, "6", True, None, float("nan")])
def test_segments_out_of_range(segments: object) -> None:
    with pytest.raises(ParameterError, match=r"3 to 16 \(three frequencies"):
        design_chain(PARAMETERS, segments)  # type: ignore[arg-type]


@pytest.mark.parametrize("segments", [2, 201, 8.0])
def test_plain_segments_out_of_range(segments: object) -> None:
    with pytest.raises(ParameterError, match="3 to 200"):
        plain_chain(PARAMETERS, segments)  # type: ignore[arg-type]
