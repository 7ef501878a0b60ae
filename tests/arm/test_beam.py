"""The clamped-free modes: closed forms, boundary conditions, identities by parts, up to n = 40."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from flexsim import ParameterError, Parameters
from flexsim.arm.beam import (
    MODES_MAX,
    Load,
    beta_lengths,
    frequency_equation,
    load_of,
    modal_integrals,
    mode_shapes,
    sigma,
)

PARAMETERS = Parameters()
ROUNDING = 1e-11  # sums of some hundred terms of size 1, phases up to 124 rad
DIGITS = 5e-7  # tables give six decimals
FREQUENCY_DIGITS = 5e-6  # five decimals
TAKEN_LITERALLY = 1e-9  # (15) as written cancels: e^(beta L) rounding is 6e-12 at n = 5
COUNTS = (1, 3, 10, MODES_MAX)


def integrate(n: int, derivative: int, start: float, end: float) -> np.ndarray:
    node, weight = leggauss(120)  # a point per radian of the highest mode
    s = start + (node + 1) / 2 * (end - start)
    integral: np.ndarray = weight / 2 * (end - start) @ mode_shapes(n, s, derivative)
    return integral


def test_roots_and_frequencies_are_the_tabled_ones() -> None:
    assert beta_lengths(3) == pytest.approx((1.875104, 4.694091, 7.854757), abs=DIGITS)
    frequency = modal_integrals(PARAMETERS, 3).frequency  # [rad/s]
    assert frequency == pytest.approx([20.96880, 131.40924, 367.94968], abs=FREQUENCY_DIGITS)


def test_roots_solve_the_frequency_equation_and_none_is_left_out() -> None:
    b = np.array(beta_lengths(MODES_MAX))
    assert np.abs(np.cos(b) + 1 / np.cosh(b)).max() < ROUNDING
    grid = np.linspace(0.0, MODES_MAX * np.pi, 100_000)
    value = np.cos(grid) + 1 / np.cosh(grid)
    assert np.count_nonzero(value[1:] * value[:-1] < 0) == MODES_MAX
    assert (np.diff(b) > 0).all()


def test_high_roots_approach_odd_quarter_turns_exponentially() -> None:
    i = np.arange(3, 9)
    distance = np.abs(np.array(beta_lengths(8))[2:] - (i - 0.5) * np.pi)
    asymptote = 2 * np.exp(-(i - 0.5) * np.pi)
    assert distance == pytest.approx(asymptote, rel=0.01, abs=1e-13)  # next order e^-2b, rounding


def test_modes_are_15_as_printed() -> None:
    x = np.linspace(0.0, 1.0, 23)
    for i, b in enumerate(beta_lengths(5)):
        quotient = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
        printed = (
            np.cosh(b * x) - np.cos(b * x) - quotient * (np.sinh(b * x) - np.sin(b * x))
        )  # (15)
        np.testing.assert_allclose(mode_shapes(5, x)[:, i], printed, atol=TAKEN_LITERALLY)
        assert sigma(b) == pytest.approx(quotient, rel=ROUNDING)


@pytest.mark.parametrize("n", COUNTS)
def test_boundary_conditions(n: int) -> None:
    b = np.array(beta_lengths(n))
    zero = {0: 0.0, 1: 0.0, 2: 1.0, 3: 1.0}  # derivative: the end where it vanishes
    for derivative, end in zero.items():
        scaled = mode_shapes(n, end, derivative) / b**derivative
        assert np.abs(scaled).max() < ROUNDING
    for derivative, end in ((0, 1.0), (1, 1.0), (2, 0.0), (3, 0.0)):  # and nowhere else
        assert np.abs(mode_shapes(n, end, derivative) / b**derivative).min() > 1.0


@pytest.mark.parametrize("n", COUNTS)
def test_tip_values_alternate_between_2_and_minus_2(n: int) -> None:
    expected = 2.0 * (-1.0) ** np.arange(n)
    np.testing.assert_allclose(modal_integrals(PARAMETERS, n).tip, expected, rtol=ROUNDING)


@pytest.mark.parametrize("n", COUNTS)
def test_integrals_have_their_closed_forms(n: int) -> None:
    m = modal_integrals(PARAMETERS, n)
    quotient = sigma(m.beta * PARAMETERS.L)
    np.testing.assert_allclose(m.Phi, 2 * quotient / m.beta, rtol=ROUNDING)
    np.testing.assert_allclose(
        m.x_chi - PARAMETERS.r * m.Phi, 2 / m.beta**2, rtol=ROUNDING, atol=ROUNDING
    )
    sign = (-1.0) ** np.arange(n)
    np.testing.assert_allclose(m.tip_slope, 2 * quotient * m.beta * sign, rtol=ROUNDING)
    a = quotient * m.beta
    np.testing.assert_allclose(np.diag(m.slope), a * (2 + a * PARAMETERS.L), rtol=ROUNDING)


@pytest.mark.parametrize("n", COUNTS)
def test_modes_are_orthogonal_with_norm_L(n: int) -> None:
    gram = modal_integrals(PARAMETERS, n).gram
    np.testing.assert_allclose(gram, PARAMETERS.L * np.eye(n), atol=ROUNDING)


@pytest.mark.parametrize("derivative", range(4))
def test_each_derivative_integrates_to_the_one_before(derivative: int) -> None:
    n = MODES_MAX
    b = np.array(beta_lengths(n))
    for start, end in ((0.0, 0.3), (0.3, 1.0)):
        rise = mode_shapes(n, end, derivative) - mode_shapes(n, start, derivative)
        integral = integrate(n, derivative + 1, start, end)
        np.testing.assert_allclose(integral / b**derivative, rise / b**derivative, atol=ROUNDING)


def test_fourth_derivative_is_beta_to_the_fourth_times_the_mode() -> None:
    s = np.linspace(0.0, 1.0, 101)
    b = np.array(beta_lengths(MODES_MAX))
    scaled = mode_shapes(MODES_MAX, s, 4) / b**4
    np.testing.assert_allclose(scaled, mode_shapes(MODES_MAX, s), atol=ROUNDING)
    second = mode_shapes(MODES_MAX, s, 2) / b**2  # control: the second derivative is another shape
    assert np.abs(second - mode_shapes(MODES_MAX, s)).max() > 1.0


@pytest.mark.parametrize("n", COUNTS)
def test_gamma_and_alpha_are_minus_N_and_M_by_parts(n: int) -> None:
    m = modal_integrals(PARAMETERS, n)
    for total, matrix in (
        (m.gamma + m.gamma_prime, m.N),
        (m.alpha + m.alpha_prime, m.M),
    ):
        np.testing.assert_allclose(total, -matrix, atol=ROUNDING * np.abs(matrix).max())
        assert np.linalg.eigvalsh(matrix).min() > 0  # tension only ever stiffens


def test_alpha_alone_is_not_minus_M() -> None:
    m = modal_integrals(PARAMETERS, 3)
    assert np.abs(m.alpha + m.M).max() > 0.1 * np.abs(m.M).max()


def test_static_compliance_is_the_sum_over_modes_with_order_three() -> None:
    """Tip force 1: sum chi_i(L)^2/(EI L beta_i^4) tends to L^3/(3 EI), its tail like n^-3."""
    p, counts = PARAMETERS, np.array([5, 10, 20, 40])
    errors = []
    for n in counts:
        m = modal_integrals(p, int(n))
        partial = np.sum(m.tip**2 / (p.EI * p.L * m.beta**4))
        errors.append(1 - partial / p.static_compliance)
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert order == pytest.approx(3.0, abs=0.05)  # the tail's next term is n^-5


def test_many_modes_stay_finite_far_from_overflow() -> None:
    s = np.linspace(0.0, 1.0, 1001)
    with np.errstate(all="raise", under="ignore"):
        for derivative in range(5):
            shapes = mode_shapes(MODES_MAX, s, derivative)
            scaled = shapes / np.array(beta_lengths(MODES_MAX)) ** derivative
            assert np.abs(scaled).max() < 2.5  # sigma (1 + sqrt 2): one exponential, one wave


def test_shapes_follow_the_shape_of_their_argument() -> None:
    assert mode_shapes(2, 0.5).shape == (2,)
    assert mode_shapes(2, np.zeros((3, 4))).shape == (3, 4, 2)


@pytest.mark.parametrize("n", [0, -1, 2.5, MODES_MAX + 1])
def test_impossible_number_of_modes_is_an_error_naming_the_range(n: float) -> None:
    with pytest.raises(ParameterError, match=f"{n!r}.*1 to {MODES_MAX}"):
        beta_lengths(n)  # type: ignore[arg-type]


LOADS = (Load(0.1, 0.0), Load(1.0, 0.04), Load(0.0, 0.3), Load(500.0, 20.0), Load(1e-12, 1e-14))


@pytest.mark.parametrize("load", LOADS)
def test_loaded_modes_bend_as_the_payload_asks(load: Load) -> None:
    """Clamped at one end; at the other the payload's inertia is the shear and the moment."""
    n = 12
    b = np.array(beta_lengths(n, load))
    y = [mode_shapes(n, 1.0, k, load) / b**k for k in range(4)]
    size = max(float(np.abs(each).max()) for each in y) * (1 + load.mass * b + load.inertia * b**3)
    assert np.abs(mode_shapes(n, 0.0, 0, load)).max() < ROUNDING
    assert np.abs(mode_shapes(n, 0.0, 1, load) / b).max() < ROUNDING
    assert (np.abs(y[3] + load.mass * b * y[0]) / size).max() < ROUNDING
    assert (np.abs(y[2] - load.inertia * b**3 * y[1]) / size).max() < ROUNDING


@pytest.mark.parametrize("load", LOADS)
def test_loaded_modes_are_orthogonal_with_norm_L(load: Load) -> None:
    p = PARAMETERS
    robot = Parameters(payload=load.mass * p.m_b, payload_inertia=load.inertia * p.m_b * p.L**2)
    gram = modal_integrals(robot, 12).gram
    np.testing.assert_allclose(gram, p.L * np.eye(12), atol=ROUNDING)


def test_no_loaded_root_is_left_out() -> None:
    """Rayleigh: an added inertia lowers every frequency, none below the one before."""
    for load in LOADS:
        free, loaded = np.array(beta_lengths(MODES_MAX)), np.array(beta_lengths(MODES_MAX, load))
        assert (loaded <= free).all() and (loaded[2:] >= free[:-2]).all()
        assert (np.diff(loaded) > 0).all()
        grid = np.linspace(1e-3, loaded[-1] + 1e-6, 100_000)
        sign = np.sign([frequency_equation(b, load) for b in grid])
        assert np.count_nonzero(sign[1:] != sign[:-1]) == MODES_MAX


def test_a_heavy_payload_swings_on_the_beams_static_stiffness() -> None:
    """omega^2 = 3 EI/(m L^3), the beam without mass; the next mode is clamped and pinned."""
    b = beta_lengths(2, Load(1e3, 0.0))
    assert b[0] ** 4 == pytest.approx(3 / 1e3, rel=3e-4)  # its own mass, 33/140 of it, shows
    assert b[1] == pytest.approx(3.926602, rel=1e-3)


def test_loaded_frequencies_are_tabled_ones() -> None:
    """beta L with a tip mass as heavy as the beam, as textbooks print them."""
    assert beta_lengths(3, Load(1.0, 0.0)) == pytest.approx((1.2479, 4.0311, 7.1341), abs=1e-4)


def test_a_payload_out_of_all_proportion_is_one_line() -> None:
    with pytest.raises(ParameterError, match=r"payload is 1e\+06 kg.*give 785 kg at most"):
        load_of(Parameters(payload=1e6))
    with pytest.raises(ParameterError, match=r"payload_inertia is 1e\+06 kg m2.*at most"):
        modal_integrals(Parameters(payload_inertia=1e6), 3)
