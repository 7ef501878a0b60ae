"""Limit, dead zone and friction: Table 4 by hand, signs, edges; the named settings."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexsim import ParameterError, Parameters
from flexsim.loop.friction import LAWS, Friction, joint_torques
from flexsim.loop.settings import SETTINGS, setting

ROUNDING = 1e-14  # relative; three operations
torque = st.floats(-50.0, 50.0)
rate = st.floats(-20.0, 20.0)


def reached(friction: Friction, tau: float, w: float = 0.0) -> tuple[float, float]:
    """Return what the same torque and velocity become at either joint."""
    first, second = joint_torques(friction.numbers(), tau, tau, w, w)
    return first, second


@pytest.mark.parametrize(
    ("tau", "first", "second"),
    [
        (10.0, 0.2585 * 10 + 4.56, 1.0231 * 10),
        (-10.0, -(0.2585 * 10 + 4.56), -10.231),
        (3.0, 5.3355, 3.0693),
        (-4.0, -5.594, -4.0924),
        (2.9, 0.0, 2.96699),
        (0.0, 0.0, 0.0),
    ],
)
def test_47_by_hand(tau: float, first: float, second: float) -> None:
    for w in (0.0, 3.0, -3.0):  # as printed it does not know the velocity
        assert reached(Friction("jump"), tau, w) == pytest.approx((first, second), rel=ROUNDING)


@pytest.mark.parametrize("law", ["jump", "opposing"])
@pytest.mark.parametrize(("joint", "edge"), [(0, -3.2379), (0, 2.9129), (1, -0.5543), (1, 0.6608)])
def test_dead_zone_of_table_4_ends_at_its_edges(law: str, joint: int, edge: float) -> None:
    inside, outside = edge * (1 - 1e-12), edge * (1 + 1e-12)
    assert reached(Friction(law), inside)[joint] == 0.0
    assert np.sign(reached(Friction(law), outside)[joint]) == np.sign(edge)
    assert abs(reached(Friction(law), outside)[joint]) > 0.5  # a jump, not a shifted ramp


@given(tau=torque, w=rate)
def test_none_passes_the_torque(tau: float, w: float) -> None:
    assert reached(Friction("none"), tau, w) == (tau, tau)


@pytest.mark.parametrize(
    ("tau", "first", "second"),
    [
        (10.0, 0.2585 * (10 - 2.9129) + 4.56, 1.0231 * (10 - 0.6608)),
        (-10.0, -(0.2585 * (10 - 3.2379) + 4.56), -1.0231 * (10 - 0.5543)),
        (2.9, 0.0, 1.0231 * (2.9 - 0.6608)),
        (-0.6, 0.0, -1.0231 * (0.6 - 0.5543)),
        (0.0, 0.0, 0.0),
    ],
)
def test_simulinks_blocks_by_hand(tau: float, first: float, second: float) -> None:
    """Dead Zone gives the input minus the edge, 0 at the edge; then (47)."""
    for w in (0.0, 3.0, -3.0):
        found = reached(Friction("simulink"), tau, w)
        assert found == pytest.approx((first, second), rel=ROUNDING)


@given(tau=torque)
def test_simulink_is_47_after_a_continuous_dead_zone(tau: float) -> None:
    """So without Coulomb friction the torque has no jump: its slope is mu at most."""
    f = Friction("simulink", tau_0=(0.0, 0.0))
    here, there = reached(f, tau), reached(f, tau + 1e-3)
    for joint in range(2):
        assert -1e-12 <= there[joint] - here[joint] <= 1e-3 * f.mu[joint] + 1e-12
        shifted = tau - min(max(tau, f.dead_zone[joint][0]), f.dead_zone[joint][1])
        unzoned = Friction("jump", dead_zone=((0.0, 0.0), (0.0, 0.0)))
        assert reached(Friction("simulink"), tau)[joint] == reached(unzoned, shifted)[joint]


@given(tau=torque, w=rate)
def test_jump_is_the_formula_outside_the_dead_zone(tau: float, w: float) -> None:
    f = Friction("jump")
    for joint, found in enumerate(reached(f, tau, w)):
        low, high = f.dead_zone[joint]
        expected = math.copysign(f.mu[joint] * abs(tau) + f.tau_0[joint], tau)
        assert found == pytest.approx(0.0 if low < tau < high or tau == 0 else expected)


@given(tau=torque, w=rate)
def test_joint_friction_opposes_the_velocity_and_never_feeds_it(tau: float, w: float) -> None:
    f = Friction("opposing", dead_zone=((0.0, 0.0), (0.0, 0.0)))
    moving, resting = reached(f, tau, w), reached(f, tau, 0.0)
    assert resting == (tau, tau)  # smoothed: none at rest
    for found in moving:
        assert (found - tau) * w <= 0.0


@pytest.mark.parametrize("w", [0.3, -2.0])
def test_joint_friction_by_hand_beyond_the_smoothing(w: float) -> None:
    first, second = reached(Friction("opposing"), 10.0, w)
    assert first == pytest.approx(
        10 - 4.56 * np.sign(w) - 0.2585 * w, rel=1e-11
    )  # tanh(15) is 1 - 2e-13
    assert second == pytest.approx(10 - 1.0231 * w, rel=ROUNDING)


def test_smoothed_sign_has_its_stated_speed() -> None:
    first, _ = reached(Friction("opposing"), 0.0, 0.02)
    assert first == pytest.approx(-4.56 * math.tanh(1.0) - 0.2585 * 0.02, rel=ROUNDING)


@pytest.mark.parametrize("law", LAWS)
@given(tau=torque, w=rate)
def test_friction_is_odd_when_its_dead_zone_is(law: str, tau: float, w: float) -> None:
    f = Friction(law, dead_zone=((-3.0, 3.0), (-0.5, 0.5)), torque_limit=(9.0, 4.0))
    forth, back = reached(f, tau, w), reached(f, -tau, -w)
    assert forth == (-back[0], -back[1])


@pytest.mark.parametrize("law", ["jump", "opposing"])
def test_table_4s_own_dead_zone_is_not_odd(law: str) -> None:
    assert reached(Friction(law), 3.0)[0] != 0.0 == reached(Friction(law), -3.0)[0]


@pytest.mark.parametrize("law", LAWS)
@given(tau=st.floats(-1e6, 1e6), w=rate)
def test_limit_acts_ahead_of_dead_zone_and_friction(law: str, tau: float, w: float) -> None:
    limited = Friction(law, torque_limit=(9.83, 4.29))
    free = Friction(law)
    first = reached(free, min(max(tau, -9.83), 9.83), w)[0]
    second = reached(free, min(max(tau, -4.29), 4.29), w)[1]
    assert reached(limited, tau, w) == (first, second)


def test_limit_inside_the_dead_zone_leaves_nothing() -> None:
    f = Friction("jump", torque_limit=(2.0, 0.5))
    assert reached(f, 1e9) == (0.0, 0.0) == reached(f, -1e9)


def test_settings_are_what_they_are_named() -> None:
    assert list(SETTINGS) == [*LAWS, "reconstructed"]
    for name in LAWS:
        assert setting(name).friction.law == name
        assert setting(name).friction.torque_limit == (math.inf, math.inf)
        assert setting(name).applied(Parameters()) == Parameters()
    fit = setting("reconstructed")
    assert fit.friction == Friction("opposing", torque_limit=(9.83, 4.29))
    assert fit.applied(Parameters()) == Parameters(I_m2=0.0557)
    assert fit.applied(Parameters(I_m1=0.1)) == Parameters(I_m1=0.1, I_m2=0.0557)


def test_defaults_are_table_4() -> None:
    f = Friction()
    assert f.dead_zone == ((-3.2379, 2.9129), (-0.5543, 0.6608))
    assert (f.tau_0, f.mu) == ((4.56, 0.0), (0.2585, 1.0231))


def test_unknown_names_are_errors_naming_the_choices() -> None:
    with pytest.raises(ParameterError, match=r"'dry'.*none, simulink, jump, opposing"):
        Friction("dry")
    with pytest.raises(
        ParameterError, match=r"'lab' is unknown.*opposing, stribeck, lugre, reconstructed"
    ):
        setting("lab")
    with pytest.raises(ParameterError, match="'print' is called 'jump' now"):
        setting("print")
    with pytest.raises(ParameterError, match="'joint' is called 'opposing' now"):
        setting("joint")


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"dead_zone": ((0.1, 0.2), (-1.0, 1.0))}, "dead zone is .*0.1"),
        ({"dead_zone": ((-1.0, 1.0), (-1.0, math.nan))}, "dead zone is .*nan"),
        ({"dead_zone": ((-math.inf, 1.0), (-1.0, 1.0))}, "dead zone is .*inf"),
        ({"tau_0": (-1.0, 0.0)}, "tau_0 is .*-1.0"),
        ({"mu": (0.1, math.nan)}, "mu is .*nan"),
        ({"mu": (math.inf, 0.1)}, "mu is .*inf"),
        ({"speed": 0.0}, "speed is 0.0"),
        ({"speed": math.nan}, "speed is nan"),
        ({"torque_limit": (0.0, 1.0)}, "torque limit is .*0.0"),
        ({"torque_limit": (1.0, math.nan)}, "torque limit is .*nan"),
    ],
)
def test_numbers_that_cannot_be_used_are_errors_naming_them(
    change: dict[str, tuple[float, float]], what: str
) -> None:
    with pytest.raises(ParameterError, match=what):
        Friction("opposing", **change)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "wrong",
    [
        {"tau_0": (1.0,)},
        {"mu": (1.0, 2.0, 3.0)},
        {"torque_limit": (1.0,)},
        {"dead_zone": ((-1.0, 1.0),)},
    ],
)
def test_numbers_of_one_joint_or_three_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ParameterError, match=next(iter(wrong))):
        Friction(**wrong)
