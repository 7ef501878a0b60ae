"""The equations as printed against the consistent ones: equal without misprints, worse with."""

import numpy as np
import pytest

from flexsim import Parameters
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.plants.assumed_modes import acceleration, assumed_modes, mass_matrix
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.printed import (
    AS_PRINTED,
    INDICES_43,
    MASS_37,
    MISPRINTS,
    SHORTENING_39,
    SQUARE_46,
    PrintedModes,
    printed_acceleration,
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


def test_as_printed_is_all_four_and_the_default() -> None:
    assert MASS_37 | SHORTENING_39 | INDICES_43 | SQUARE_46 == AS_PRINTED == 15
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
