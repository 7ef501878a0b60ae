"""The exact linear arm against assumed modes, finite elements and textbook limits."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.linalg import eigh

from flexsim import ParameterError, Parameters
from flexsim.arm.free_arm import _root, clamped_frequencies, joint_free_frequencies
from flexsim.plants.assumed_modes import assumed_modes, free_frequencies

PARAMETERS = Parameters()
DIGITS = 5e-9  # [Hz] the straight arm's frequencies are quoted with eight decimals
CONVERGED = 5e-9  # relative; 30 assumed modes leave 1.8e-9 at the third frequency
POSES = (0.0, 0.7, np.pi / 2, 2.5)
VANISHING = 1e-9  # of a mass or length that a limit takes to zero
LIMIT = 1e-6  # relative; what VANISHING leaves, with margin for its powers 1/2


def finite_elements(p: Parameters, elements: int, theta2: float) -> np.ndarray:
    """Frequencies [rad/s] of theta1, theta2 and a clamped beam of Hermite elements."""
    h = p.L / elements
    node, weight = leggauss(4)  # exact for products of cubics
    u = (node + 1) / 2
    shape = np.array(  # (4, m): deflection and slope at either end
        [1 - 3 * u**2 + 2 * u**3, h * (u - 2 * u**2 + u**3), 3 * u**2 - 2 * u**3, h * (u**3 - u**2)]
    )
    bend = np.array([12 * u - 6, h * (6 * u - 4), 6 - 12 * u, h * (6 * u - 2)]) / h**2
    size = 2 + 2 * (elements + 1)
    M, K = np.zeros((size, size)), np.zeros((size, size))
    s, c = np.sin(theta2), np.cos(theta2)
    for e in range(elements):
        x = p.r + (e + u) * h
        across = np.zeros((size, len(u)))  # transverse velocity per generalised velocity
        across[0], across[1] = p.L_R * c + x, x
        dofs = slice(2 + 2 * e, 6 + 2 * e)
        across[dofs] = shape
        M += p.rho * h / 2 * (across * weight) @ across.T
        K[dofs, dofs] += p.EI * h / 2 * (bend * weight) @ bend.T
    M[0, 0] += p.I_m1 + p.I_R0 + p.m_H * p.L_R**2 + p.m_b * (p.L_R * s) ** 2
    M[:2, :2] += p.I_H
    M[1, 1] += p.I_m2
    free = np.r_[0, 1, 4:size]  # the clamp holds the first node
    return np.sqrt(eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True)[2:])


def test_straight_arm_has_its_known_frequencies() -> None:
    hertz = joint_free_frequencies(PARAMETERS, 3) / (2 * np.pi)
    assert hertz == pytest.approx([7.77934818, 24.30140498, 60.67535799], abs=DIGITS)


@pytest.mark.parametrize("theta2", POSES)
@pytest.mark.parametrize("motors", [(0.0, 0.0), (0.05, 0.02)])
def test_finite_elements_converge_to_it_with_fourth_order(
    theta2: float, motors: tuple[float, float]
) -> None:
    p = Parameters(I_m1=motors[0], I_m2=motors[1])
    exact = joint_free_frequencies(p, 3, theta2)
    counts = np.array([6, 12, 24])
    error = np.array([finite_elements(p, n, theta2)[:3] / exact - 1 for n in counts])
    order = -np.polyfit(np.log(counts), np.log(error), 1)[0]
    assert order == pytest.approx([4.0] * 3, abs=0.1)  # Hermite cubics; fit over coarse meshes
    assert error[-1].max() < 1e-5 and error.min() > 0  # Rayleigh-Ritz: from above


@pytest.mark.parametrize("theta2", POSES)
def test_thirty_assumed_modes_have_its_frequencies(theta2: float) -> None:
    exact = joint_free_frequencies(PARAMETERS, 3, theta2)
    modes = free_frequencies(assumed_modes(PARAMETERS, 30), theta2)[:3]
    assert modes == pytest.approx(exact, rel=CONVERGED)
    assert (modes > exact).all()  # Rayleigh-Ritz: from above


@pytest.mark.parametrize("theta2", [0.0, 1.1])
@pytest.mark.parametrize(
    "changes",
    [
        {"payload": 0.05},
        {"payload_inertia": 1e-3},
        {"payload": 5.0, "payload_inertia": 0.1},
        {"r": 0.0},
        {"r": 0.0, "payload": 0.0785, "payload_inertia": 8e-4},
    ],
)
def test_payload_and_a_beam_on_the_joints_axis(changes: dict[str, float], theta2: float) -> None:
    robot = Parameters(**changes)
    exact = joint_free_frequencies(robot, 3, theta2)
    modes = free_frequencies(assumed_modes(robot, 30), theta2)[:3]
    assert modes == pytest.approx(exact, rel=CONVERGED)
    other = joint_free_frequencies(PARAMETERS, 3, theta2)
    assert np.abs(exact / other - 1).max() > 1e3 * CONVERGED  # control


def test_a_different_beam_fails_the_comparison() -> None:
    softer = joint_free_frequencies(Parameters(EI=0.349 * (1 - 1e-7)), 3)
    modes = free_frequencies(assumed_modes(PARAMETERS, 30))[:3]
    assert modes != pytest.approx(softer, rel=CONVERGED)


@pytest.mark.parametrize("theta2", [0.0, np.pi / 2])
def test_huge_base_approaches_the_clamped_beam_with_first_order(theta2: float) -> None:
    inertia = np.array([1e1, 1e2, 1e3])
    clamped = clamped_frequencies(PARAMETERS, 3)
    error = np.array(
        [
            joint_free_frequencies(Parameters(I_H=i, I_R0=i), 3, theta2) / clamped - 1
            for i in inertia
        ]
    )
    order = -np.polyfit(np.log(inertia), np.log(error), 1)[0]
    assert order == pytest.approx([1.0] * 3, abs=0.02)  # first order in beam over base inertia


def test_locked_link_and_vanishing_hub_is_the_hinged_free_beam() -> None:
    p = Parameters(I_R0=1 / VANISHING, I_H=VANISHING**2, r=VANISHING)
    b = np.sqrt(joint_free_frequencies(p, 3) / np.sqrt(p.EI / p.rho)) * p.L
    assert b == pytest.approx([3.92660231, 7.06858275, 10.21017612], rel=LIMIT)  # tan b = tanh b


def test_vanishing_link_and_hub_is_the_free_free_beam() -> None:
    tiny = VANISHING**2
    p = Parameters(I_R0=tiny, I_H=tiny, m_H=tiny, r=VANISHING)
    b = np.sqrt(joint_free_frequencies(p, 3) / np.sqrt(p.EI / p.rho)) * p.L
    assert b == pytest.approx([4.73004074, 7.85320462, 10.99560784], rel=LIMIT)  # cos cosh = 1


def test_right_angle_without_a_motor_hides_link_1_from_the_transverse_motion() -> None:
    """At theta2 = pi/2 the beam's base cannot move across: a hub on a fixed pin."""
    light, heavy = (joint_free_frequencies(Parameters(I_R0=i), 3, np.pi / 2) for i in (0.25, 1e6))
    assert light == pytest.approx(heavy, rel=1e-12)  # only rounding may differ
    straight = [joint_free_frequencies(Parameters(I_R0=i), 3) for i in (0.25, 1e6)]
    assert abs(straight[0] / straight[1] - 1).max() > 1e-4


def test_many_frequencies_are_found_without_gap_and_approach_the_clamped_ones() -> None:
    exact, clamped = joint_free_frequencies(PARAMETERS, 20), clamped_frequencies(PARAMETERS, 20)
    modes = free_frequencies(assumed_modes(PARAMETERS, 40))[:20]
    assert exact == pytest.approx(modes, rel=2e-8)  # 40 modes leave 1.1e-8 at the 20th
    assert (exact > clamped).all()  # a free base only ever raises them
    assert exact[-1] / clamped[-1] - 1 < 1e-3


@pytest.mark.parametrize("n", [0, -3])
def test_no_frequencies_is_an_error(n: int) -> None:
    with pytest.raises(ParameterError, match=f"{n}; give a whole number, 1 or more"):
        joint_free_frequencies(PARAMETERS, n)


@pytest.mark.parametrize(
    "function",
    [lambda x: 1 / (x - 1), lambda x: 1.0 if x > 1 else -1.0 - x],
    ids=["pole", "jump"],
)
def test_a_change_of_sign_that_is_no_root_is_refused(function: Callable[[float], float]) -> None:
    with pytest.raises(ParameterError, match="no frequency is found between"):
        _root(function, 0.5, 1.7)


def test_a_root_is_found_to_rounding() -> None:
    assert _root(lambda x: x * x - 2, 1.0, 2.0) == pytest.approx(np.sqrt(2), rel=1e-15)
