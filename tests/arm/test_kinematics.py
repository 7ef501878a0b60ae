"""Rigid kinematics: forward after inverse is the identity; branch, limits and deflection."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexsim import ParameterError, Parameters
from flexsim.arm.kinematics import joint_angles, tip_position

PARAMETERS = Parameters()
L1, L2 = PARAMETERS.L_R, PARAMETERS.reach
ROUNDING = 1e-14  # [m], [rad] a few operations on numbers of size 1
NEAR_STRAIGHT = 1e-12  # [rad] arctan2 of sqrt(1 - cos^2), cos within 1e-5 of 1 at 0.01 rad

angle = st.floats(-np.pi, np.pi)
elbow = st.floats(0.01, np.pi - 0.01)


def wrapped(difference: np.ndarray) -> np.ndarray:
    return np.asarray((difference + np.pi) % (2 * np.pi) - np.pi)


@given(theta1=angle, theta2=elbow, positive_elbow=st.booleans())
def test_inverse_undoes_forward(theta1: float, theta2: float, positive_elbow: bool) -> None:
    theta = np.array([[theta1, theta2 if positive_elbow else -theta2]])
    found = joint_angles(PARAMETERS, tip_position(PARAMETERS, theta), positive_elbow)
    assert np.abs(wrapped(found - theta)).max() < NEAR_STRAIGHT


@given(
    radius=st.floats(L2 - L1 + 1e-4, L1 + L2 - 1e-4),
    direction=angle,
    positive_elbow=st.booleans(),
)
def test_forward_undoes_inverse_on_the_branch_asked_for(
    radius: float, direction: float, positive_elbow: bool
) -> None:
    tip = radius * np.array([[np.cos(direction), np.sin(direction)]])
    theta = joint_angles(PARAMETERS, tip, positive_elbow)
    np.testing.assert_allclose(tip_position(PARAMETERS, theta), tip, atol=ROUNDING)
    assert (theta[0, 1] > 0) == positive_elbow


def test_known_poses() -> None:
    quarter = np.pi / 2
    for theta, tip in (
        ((0.0, 0.0), (L1 + L2, 0.0)),
        ((quarter, 0.0), (0.0, L1 + L2)),
        ((0.0, quarter), (L1, L2)),
        ((quarter, quarter), (-L2, L1)),
    ):
        np.testing.assert_allclose(tip_position(PARAMETERS, theta), tip, atol=ROUNDING)


@given(theta1=angle, theta2=angle, v=st.floats(-0.2, 0.2), u=st.floats(-0.05, 0.0))
def test_deflection_and_shortening_lie_across_and_along_link_2(
    theta1: float, theta2: float, v: float, u: float
) -> None:
    tip = tip_position(PARAMETERS, (theta1, theta2), v, u)
    elbow = L1 * np.exp(1j * theta1)
    complex_tip = elbow + (L2 + u + 1j * v) * np.exp(1j * (theta1 + theta2))
    np.testing.assert_allclose(tip, [complex_tip.real, complex_tip.imag], atol=ROUNDING)


def test_angles_are_continuous_where_theta_1_passes_half_a_turn() -> None:
    phi = np.linspace(0.0, 4 * np.pi, 2001)  # twice around the base
    theta = joint_angles(PARAMETERS, 0.6 * np.stack([np.cos(phi), np.sin(phi)], axis=-1))
    step = np.diff(theta[:, 0])
    np.testing.assert_allclose(
        step, 4 * np.pi / 2000, atol=1e-12
    )  # unwrapping adds multiples of 2 pi
    assert np.ptp(theta[:, 1]) < NEAR_STRAIGHT


@pytest.mark.parametrize(
    ("radius", "what"),
    [
        (L1 + L2 + 1e-3, "out of reach"),
        (L2 - L1 - 1e-3, "out of reach"),
        (0.0, "out of reach"),
        (L1 + L2, "singular"),
        (L2 - L1, "singular"),
        (np.nan, "out of reach"),
        (np.inf, "out of reach"),
    ],
)
def test_point_out_of_reach_or_singular_is_an_error_naming_it(radius: float, what: str) -> None:
    path = np.array([[0.5, 0.3], [0.5, 0.31], [0.0, radius]])
    with pytest.raises(ParameterError, match=what) as error:
        joint_angles(PARAMETERS, path)
    message = str(error.value)
    assert f"reference point 2 at (0, {radius:.4g})" in message
    assert "0.255" in message and "0.895" in message  # the range that would do
