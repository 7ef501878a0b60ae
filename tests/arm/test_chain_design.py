"""The design of the chain: closed forms, tuning, convergence of the plain chain, errors."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from flexsim import ParameterError, Parameters
from flexsim.arm.beam import Load, beta_lengths, modal_integrals
from flexsim.arm.chain_design import ChainDesign, design_chain, front, plain_chain, thumb_chain
from flexsim.arm.free_arm import clamped_frequencies
from flexsim.arm.hinged_beam import (
    chain_modes,
    frequency_sensitivity,
    loaded_frequencies,
    mass_matrix,
    shape_errors,
)

pytestmark = pytest.mark.kernels  # run once more under another BLAS kernel


ROUNDING = 1e-12  # a few operations on numbers of size 1
TUNED_IDEAL = 1e-10  # stiffnesses carry ten decimals, so that every machine has the same design
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
    np.testing.assert_allclose(design.frequency[:3], exact, rtol=TUNED_IDEAL)
    assert np.abs(design.frequency_error).max() < TUNED_IDEAL


def test_an_unfitted_chain_fails_that_check() -> None:
    design = plain_chain(PARAMETERS, 6)
    assert np.abs(design.frequency_error).max() > 1e6 * TUNED_IDEAL
    assert not design.fitted


# Worst error of Phi_i and of the first moment [%], of the frequencies under payloads [%], of the
# tip's rotation [%], and highest clamped frequency [rad/s], which RK4 must resolve. Bounds a little
# above what the least squares find: 0.449, 0.177, 0.078, ...; three hinges have no freedom left
BOUNDS = {
    3: (26, 80, 13, 370),
    4: (0.46, 5.4, 0.4, 600),
    5: (0.18, 1.8, 0.8, 1230),
    6: (0.08, 0.40, 0.23, 2290),
    8: (0.02, 0.10, 0.06, 3890),
    10: (0.004, 0.026, 0.006, 5990),
}


@pytest.mark.parametrize("segments", BOUNDS)
def test_couplings_and_top_frequency(segments: int) -> None:
    worst, loaded, rotation, top = BOUNDS[segments]
    design = design_chain(PARAMETERS, segments)
    assert 100 * design.coupling_error < worst
    assert 100 * np.abs(design.tip_error).max() < 2 * worst
    assert 100 * abs(design.compliance_error) < worst
    assert 100 * design.payload_error < loaded
    assert 100 * abs(design.rotation_error) < rotation
    assert design.frequency[-1] < top


def test_six_segments_are_the_beam_under_any_payload_of_its_own_weight() -> None:
    """Within 0.6 %: masses up to the beam's, radii of gyration up to 0.2 L."""
    random = np.random.default_rng(1)
    design = design_chain(PARAMETERS, 6)
    a, k = design.position / PARAMETERS.L, design.stiffness * PARAMETERS.L / PARAMETERS.EI
    worst = 0.0
    for _ in range(300):
        mass, radius = random.uniform(0, 1), random.uniform(0, 0.2)
        load = Load(mass, mass * radius**2)
        exact = np.array(beta_lengths(3, load)) ** 2
        worst = max(worst, float(np.abs(loaded_frequencies(a, k, load) / exact - 1).max()))
    assert worst < 0.006
    assert worst <= 1.0001 * design.payload_error  # the corners are the worst
    plain = plain_chain(PARAMETERS, 6)
    assert plain.payload_error > 0.02  # control


def test_payload_and_hub_radius_do_not_move_the_hinges() -> None:
    robot = Parameters(payload=0.05, payload_inertia=1e-4, r=0.0, zeta=0.01)
    loaded, usual = design_chain(robot, 6), design_chain(PARAMETERS, 6)
    np.testing.assert_array_equal(loaded.position, usual.position)
    np.testing.assert_array_equal(loaded.stiffness, usual.stiffness)
    exact = clamped_frequencies(robot, 3)
    np.testing.assert_allclose(loaded.loaded, exact * (1 + loaded.loaded_error), rtol=TUNED_IDEAL)
    assert 1e-5 < np.abs(loaded.loaded_error).max() < 0.004
    np.testing.assert_allclose(usual.loaded_error, usual.frequency_error, atol=ROUNDING)


def test_the_front_trades_loaded_frequencies_against_the_step() -> None:
    rows = front(PARAMETERS, 6)
    top = [row.frequency[-1] for row in rows]
    errors = [row.payload_error for row in rows]
    assert top == sorted(top) and errors == sorted(errors, reverse=True)
    chosen = design_chain(PARAMETERS, 6)
    assert any(np.array_equal(row.stiffness, chosen.stiffness) for row in rows)
    with pytest.raises(ParameterError, match=r"3; give a whole number from 4 to 16"):
        front(PARAMETERS, 3)


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
    assert (mac > [0.9999, 0.998, 0.989]).all() and (mac <= 1).all()


def test_design_scales_with_the_beam() -> None:
    """The dimensionless design serves every robot: longer beams, other stiffness."""
    other = Parameters(L=0.8, EI=1.2, rho=0.3)
    first, second = design_chain(PARAMETERS), design_chain(other)
    ratio = first.stiffness * PARAMETERS.L / PARAMETERS.EI
    np.testing.assert_allclose(second.stiffness * 0.8 / 1.2, ratio, rtol=ROUNDING)
    exact = modal_integrals(other, 3).frequency
    np.testing.assert_allclose(second.frequency[:3], exact, rtol=TUNED_IDEAL)


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


def test_the_rule_of_thumb_is_too_stiff_with_first_order() -> None:
    """Nothing bends within half a cell of clamp and tip, which is what its hinges leave out."""
    sizes = np.array([16, 32, 64])
    found = [thumb_chain(Parameters(), int(n)) for n in sizes]
    np.testing.assert_allclose([d.rotation_error for d in found], -1 / (sizes + 1), rtol=1e-12)
    errors = np.array([design.frequency_error for design in found])
    assert (errors > 0).all()
    slopes = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert slopes == pytest.approx([-1.0] * 3, abs=0.1)
    assert (
        errors > 5 * np.abs([plain_chain(Parameters(), n).frequency_error for n in sizes])
    ).all()
    assert not found[0].fitted and found[0].kind == "rule-of-thumb"
