"""The equations as printed against the consistent ones: equal without misprints, worse with."""

import numpy as np
import pytest

from flexsim import Parameters
from flexsim.arm.beam import MODES
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.plants.assumed_modes import AssumedModes, acceleration, assumed_modes, mass_matrix
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.printed import (
    AS_PRINTED,
    F_31,
    INDICES_43,
    MASS_37,
    MISPRINTS,
    RANGE_46,
    SHORTENING_39,
    PrintedModes,
    printed_acceleration,
    printed_coriolis,
    printed_mass,
    printed_modes,
    printed_stiffness,
    scaled_mass,
)

PARAMETERS = Parameters(zeta=0.0)  # as the paper has it
CONSERVATIVE = Parameters(F_1=0.0, F_2=0.0, zeta=0.0)
ROUNDING = 1e-10  # relative to the largest acceleration; a dense solve against a 2x2 one
VISIBLE = 1e-4  # relative change that a misprint makes somewhere; 1e6 times ROUNDING
DRIFT = 1e-10  # relative energy drift of the consistent form over 2 s; RK4 leaves 2.6e-11
DRIFT_PRINTED = 5e-5  # of the printed form, same motion: 7.8e-5 measured
LAGRANGE = 1e-8  # [N m], [N]; complex steps, and a central difference of 1e-6: 5e-10 measured
DRIFT_BENT = 5e-3  # of the printed form from a bent beam: 1.1e-2 measured, RK4 leaves 2.6e-5


def random_state(seed: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    q = np.concatenate([random.uniform(-3, 3, 2), random.normal(0, 0.02, n) / np.arange(1, n + 1)])
    return q, np.concatenate([random.normal(0, 4, 2), random.normal(0, 0.5, n)])


def printed(p: PrintedModes, q: np.ndarray, w: np.ndarray) -> np.ndarray:
    a = np.empty_like(q)
    printed_acceleration(p, q, w, 0.7, -0.3, a, np.empty(len(q) - 2))
    return a


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_without_misprints_it_is_the_consistent_model(n: int) -> None:
    parameters = Parameters(I_m1=0.1, I_m2=0.03, r_1=2.0, r_2=0.5, F_1=0.3, F_2=0.7)
    p = assumed_modes(parameters, n)
    corrected = printed_modes(p, misprints=0)
    for seed in range(10):
        q, w = random_state(seed, n)
        consistent = np.empty(n + 2)
        acceleration(p, q, w, 0.7, -0.3, consistent, np.empty(n))
        found = printed(corrected, q, w)
        np.testing.assert_allclose(found, consistent, atol=ROUNDING * np.abs(consistent).max())
        np.testing.assert_allclose(printed_mass(corrected, q), mass_matrix(p, q), atol=1e-15)


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("misprint", MISPRINTS)
def test_each_misprint_alone_changes_the_acceleration(misprint: str, n: int) -> None:
    switch = MISPRINTS[misprint]
    corrected = printed_modes(assumed_modes(PARAMETERS, n), misprints=0)
    changed = printed_modes(assumed_modes(PARAMETERS, n), misprints=switch)
    largest = 0.0
    for seed in range(5):
        q, w = random_state(seed, n)
        right, wrong = printed(corrected, q, w), printed(changed, q, w)
        largest = max(largest, np.abs(wrong - right).max() / np.abs(right).max())
    if n == 1 and switch == INDICES_43:  # one mode has no off-diagonal
        assert largest == 0.0
    else:
        assert largest > VISIBLE


def test_as_printed_is_all_five_and_the_default() -> None:
    assert sum(MISPRINTS.values()) == AS_PRINTED == 31
    assert printed_modes(assumed_modes(PARAMETERS)).misprints == AS_PRINTED


def test_mass_of_37_has_the_wrong_sign_of_one_term() -> None:
    q, _ = random_state(0, 3)
    difference = printed_mass(printed_modes(assumed_modes(PARAMETERS, 3), misprints=MASS_37), q)
    difference -= printed_mass(printed_modes(assumed_modes(PARAMETERS, 3), misprints=0), q)
    eta, M = q[2:], assumed_modes(PARAMETERS, 3).M
    term = PARAMETERS.L_R * np.cos(q[1]) * (eta @ M @ eta)  # twice the half of (37)
    expected = np.zeros((5, 5))
    expected[0, 1] = expected[1, 0] = term
    np.testing.assert_allclose(difference, expected, atol=1e-15)


def test_mass_of_39_lacks_the_rate_of_the_shortening() -> None:
    q, _ = random_state(0, 3)
    difference = printed_mass(
        printed_modes(assumed_modes(PARAMETERS, 3), misprints=SHORTENING_39), q
    )
    difference -= printed_mass(printed_modes(assumed_modes(PARAMETERS, 3), misprints=0), q)
    term = PARAMETERS.L_R * np.sin(q[1]) * assumed_modes(PARAMETERS, 3).M @ q[2:]
    np.testing.assert_allclose(difference[0, 2:], term, rtol=ROUNDING)
    assert not difference[:2, :2].any() and not difference[2:, 2:].any()


def test_stiffness_of_43_is_not_symmetric_although_the_paper_calls_it_so() -> None:
    q, w = random_state(0, 3)
    corrected = printed_stiffness(printed_modes(assumed_modes(PARAMETERS, 3), misprints=0), q, w)
    as_printed = printed_stiffness(
        printed_modes(assumed_modes(PARAMETERS, 3), misprints=INDICES_43), q, w
    )
    scale = np.abs(corrected - np.diag(np.diag(corrected))).max()
    np.testing.assert_allclose(corrected, corrected.T, atol=ROUNDING * scale)
    assert np.abs(as_printed - as_printed.T).max() > 0.1 * scale


def lagrangian(p: AssumedModes, q: np.ndarray, w: np.ndarray, rate: float) -> complex:
    """Return T - V; rate: 1, or 0 for a kinetic energy without the shortening's rate."""
    eta, d, s, c = q[2:], w[2:], p.L_R * np.sin(q[1]), p.L_R * np.cos(q[1])
    J2 = p.J + p.mass @ eta**2 - eta @ p.N @ eta
    h = -s * (p.P @ eta) + c * (p.first_moment - eta @ p.M @ eta / 2)
    g = c * (p.P @ d) - rate * s * (eta @ p.M @ d)
    T = p.A * w[0] ** 2 + p.I_m2 * w[1] ** 2 + p.mass @ d**2
    T += J2 * (w[0] + w[1]) ** 2 + 2 * (w[0] + w[1]) * (h * w[0] + p.X @ d) + 2 * w[0] * g
    found: complex = T / 2 - p.stiffness @ eta**2 / 2
    return found


def lagranges_bias(p: AssumedModes, q: np.ndarray, w: np.ndarray, rate: float) -> np.ndarray:
    """Return what Lagrange's equations add to H a, (n+2,), without torques."""
    tiny, small, along = 1e-30, 1e-6, 1e-30j * np.eye(len(q))

    def momenta(q: np.ndarray) -> np.ndarray:
        return np.array([lagrangian(p, q, w + each, rate).imag for each in along]) / tiny

    slope = np.array([lagrangian(p, q + each, w, rate).imag for each in along]) / tiny
    bias: np.ndarray = (momenta(q + small * w) - momenta(q - small * w)) / (2 * small) - slope
    return bias


def printed_bias(p: AssumedModes, q: np.ndarray, w: np.ndarray, misprints: int) -> np.ndarray:
    """Return C + K q (n+2,) of (42)-(46)."""
    coefficients = printed_modes(p, misprints)
    bias: np.ndarray = printed_coriolis(coefficients, q, w)
    bias[2:] += printed_stiffness(coefficients, q, w) @ q[2:]
    return bias


@pytest.mark.parametrize("n", [1, 3, 5])
@pytest.mark.parametrize(("misprints", "rate"), [(0, 1.0), (SHORTENING_39, 0.0)])
def test_equations_are_lagranges_with_and_without_the_shortenings_rate(
    n: int, misprints: int, rate: float
) -> None:
    """So (39) alone is the model of another kinetic energy, with its own (42)-(45)."""
    p = assumed_modes(PARAMETERS, n)
    for seed in range(10):
        q, w = random_state(seed, n)
        right = lagranges_bias(p, q, w, rate)
        found = printed_bias(p, q, w, misprints)
        np.testing.assert_allclose(found, right, rtol=LAGRANGE, atol=LAGRANGE)
        other = lagranges_bias(p, q, w, 1.0 - rate)
        assert np.abs(found - other)[:2].max() > 1e3 * LAGRANGE


def test_followers_of_37_are_a_slip_that_the_stiffness_does_not_share() -> None:
    """In (44), (45) the four terms that follow from the sign; none in K, which has it right."""
    p = assumed_modes(PARAMETERS, 3)
    for seed in range(5):
        q, w = random_state(seed, 3)
        s, c = PARAMETERS.L_R * np.sin(q[1]), PARAMETERS.L_R * np.cos(q[1])
        M_eta = p.M @ q[2:]
        e_M_e, e_M_d = q[2:] @ M_eta, w[2:] @ M_eta
        expected = np.zeros(5)
        expected[0] = 2 * c * e_M_d * w[1] - s * e_M_e * w[1] ** 2  # (44), twice what is printed
        expected[1] = 2 * c * e_M_d * w[0] - s * e_M_e * w[0] * w[1]  # (45)
        with_it = printed_bias(p, q, w, MASS_37)
        np.testing.assert_allclose(with_it - printed_bias(p, q, w, 0), expected, atol=LAGRANGE)


def test_followers_of_39_are_in_44_and_45_too() -> None:
    p = assumed_modes(PARAMETERS, 3)
    for seed in range(5):
        q, w = random_state(seed, 3)
        s, c = PARAMETERS.L_R * np.sin(q[1]), PARAMETERS.L_R * np.cos(q[1])
        M_eta = p.M @ q[2:]
        expected = np.zeros(5)
        expected[0] = c * (w[2:] @ M_eta) * w[1] + s * (w[2:] @ p.M @ w[2:])  # (44)
        expected[1] = -c * (w[2:] @ M_eta) * w[0]  # (45)
        expected[2:] = c * M_eta * w[0] * w[1]  # (42), (43)
        with_it = printed_bias(p, q, w, SHORTENING_39)
        np.testing.assert_allclose(with_it - printed_bias(p, q, w, 0), expected, atol=LAGRANGE)


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_range_of_46_leaves_the_last_two_modes_without(n: int) -> None:
    p = assumed_modes(PARAMETERS, n)
    q, w = random_state(1, n)
    right = printed_coriolis(printed_modes(p, 0), q, w)
    found = printed_coriolis(printed_modes(p, RANGE_46), q, w)
    reached = max(n, 2)  # rows counted from 1: 3 <= i <= n
    np.testing.assert_array_equal(found[:reached], right[:reached])
    assert not found[reached:].any() and right[reached:].all()


def test_as_printed_term_by_term() -> None:
    """(44)-(46) as they stand in the paper, n = 3, one mode after the other in (46)."""
    p = assumed_modes(PARAMETERS, 3)
    for seed in range(5):
        q, w = random_state(seed, 3)
        eta, d, (w1, w2) = q[2:], w[2:], w[:2]
        s, c = PARAMETERS.L_R * np.sin(q[1]), PARAMETERS.L_R * np.cos(q[1])
        first, P, M, N, inertia = p.first_moment, p.P, p.M, p.N, p.mass * eta
        C = np.zeros(5)
        C[0] = (inertia - s * P - eta @ N - c * eta @ M) @ (2 * w1 * d)  # (44), line by line
        C[0] += (inertia - s * P - eta @ N + c / 2 * eta @ M) @ (2 * w2 * d)
        C[0] += (-s * first - s / 2 * eta @ M @ eta - c * P @ eta) * w2**2
        C[0] += (-s * first + s / 2 * eta @ M @ eta - c * P @ eta) * 2 * w1 * w2
        C[1] = (inertia + c / 2 * eta @ M - eta @ N) @ (2 * w1 * d)  # (45), line by line
        C[1] += (s * first + c * P @ eta - s / 2 * eta @ M @ eta) * w1**2
        C[1] += (inertia - eta @ N) @ (2 * d * w2) - w1 * w2 * s * eta @ M @ eta
        C[2] = w1 * s * P[0]  # (46), i = 3 only
        found = printed_coriolis(printed_modes(p), q, w)
        np.testing.assert_allclose(found, C, rtol=ROUNDING, atol=ROUNDING)


def test_friction_of_31_is_one_entry_short_and_agrees_where_it_is() -> None:
    assert len(F_31) == 4 < MODES + 2
    assert F_31[:2] == (Parameters().F_1, Parameters().F_2)
    assert not any(F_31[2:])


def energy_drift(form: str, eta_1: float) -> float:
    """Return the largest relative energy change over 2 s of free motion from (0.2, 0.1) rad/s."""
    plant = AssumedModesPlant(CONSERVATIVE, form=form)
    state = plant.rest_state((0.0, 1.2))
    state[2], state[5:7] = eta_1, (0.2, 0.1)
    energy = drive(plant, setting("none"), np.zeros((2000, 2)), state=state).energy
    return float(np.abs(energy / energy[0] - 1).max())


def test_printed_form_makes_energy_and_the_consistent_one_does_not() -> None:
    assert energy_drift("consistent", 0.0) < DRIFT
    assert energy_drift("printed", 0.0) > DRIFT_PRINTED
    assert energy_drift("printed", 0.01) > DRIFT_BENT > 100 * energy_drift("consistent", 0.01)


def test_transmissions_scale_the_mass_matrix_for_the_motors_angles() -> None:
    """Kinetic energy is the same in joint rates w and in motor rates r w."""
    q, w = random_state(5, 3)
    H = mass_matrix(assumed_modes(PARAMETERS, 3), q)
    scaled = scaled_mass(H, 4.0, 0.5)
    motor = w * np.array([4.0, 0.5, 1, 1, 1])
    assert motor @ scaled @ motor == pytest.approx(w @ H @ w, rel=ROUNDING)
    assert scaled[0, 0] == pytest.approx(H[0, 0] / 16)  # (36)
    assert scaled[0, 1] == pytest.approx(H[0, 1] / 2)  # (37)
    assert scaled[1, 3] == pytest.approx(H[1, 3] * 2)  # (40)
    np.testing.assert_array_equal(scaled[2:, 2:], H[2:, 2:])  # (41)
