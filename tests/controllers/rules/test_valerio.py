"""Valerio and Sa da Costa's rules: their example, what they were fitted to, joints, refusals."""

import cmath
import math

import numpy as np
import pytest

from controllers import ControllerError
from controllers.rules.joint import ideal, rigid_joint
from controllers.rules.valerio import (
    CROSSING,
    KNOBS,
    MARGIN,
    critical,
    critical_joint,
    critical_point,
    design,
    s_shaped,
    s_shaped_joint,
)

PERIOD = 1e-3
DIGITS = 1e-4  # printed with four decimals, one of them cut off
CROSSED = 0.2  # relative: how far the fitted rules miss the crossing that they are to give
PHASED = 0.25  # [rad]: and the margin; measured: up to 0.14 and 0.22
OMEGA = np.geomspace(1e-2, 50, 4000)


def first_order(delay, time):
    return lambda w: np.exp(-1j * w * delay) / (1 + 1j * w * time)


def crossing(gains, plant, omega=OMEGA):
    """Frequency at which a loop crosses last, and its phase margin [rad]."""
    loop = np.array([ideal(gains, w) for w in omega]) * plant(omega)
    last = int(np.flatnonzero(np.abs(loop) > 1)[-1])
    return omega[last], math.pi + cmath.phase(loop[last])


def test_the_authors_controller():
    """e^(-0.1 s)/(1 + s): 0.4448 + 0.5158 s^-1.4277 + 0.2045 s^1.0202."""
    found = s_shaped(delay=0.1, time=1.0)
    np.testing.assert_allclose(found, [0.4448, 0.5158, 1.4277, 0.2045, 1.0202], atol=DIGITS)


@pytest.mark.parametrize("time", [0.1, 0.5, 1.0, 3.0, 5.0, 10.0, 20.0])
@pytest.mark.parametrize("delay", [0.1, 0.5])
def test_loops_are_what_the_s_shaped_rules_were_fitted_to(delay, time):
    omega, margin = crossing(s_shaped(delay, time).gains(1.0), first_order(delay, time))
    assert omega == pytest.approx(CROSSING, rel=CROSSED)
    assert margin == pytest.approx(MARGIN, abs=PHASED)


@pytest.mark.parametrize("delay, time", [(0.1, 0.5), (0.1, 1.0), (0.5, 1.0), (1.0, 1.0)])
def test_loops_are_what_the_critical_rules_were_fitted_to(delay, time):
    omega = crossing_of_half_a_turn(delay, time)
    rule = critical(math.hypot(1.0, omega * time), 2 * math.pi / omega)
    found, margin = crossing(rule.gains(1.0), first_order(delay, time))
    assert found == pytest.approx(CROSSING, rel=CROSSED)
    assert margin == pytest.approx(MARGIN, abs=PHASED)


@pytest.mark.parametrize("delay, time", [(0.1, 20.0), (1.0, 20.0)])
def test_the_second_table_of_critical_rules_crosses_where_it_is_to(delay, time):
    omega = crossing_of_half_a_turn(delay, time)
    gain = math.hypot(1.0, omega * time)
    assert gain * 2 * math.pi / omega > 64
    found, _ = crossing(critical(gain, 2 * math.pi / omega).gains(1.0), first_order(delay, time))
    assert found == pytest.approx(CROSSING, rel=CROSSED)


def test_a_wrong_digit_would_be_seen():
    """Negative control: with half as much again of the integral part the loop is another."""
    rule = s_shaped(0.1, 1.0)._replace(I=1.5 * s_shaped(0.1, 1.0).I)
    omega, margin = crossing(rule.gains(1.0), first_order(0.1, 1.0))
    assert abs(omega / CROSSING - 1) > CROSSED or abs(margin - MARGIN) > PHASED


def crossing_of_half_a_turn(delay, time):
    w = np.geomspace(1e-3, math.pi / delay, 200_000)
    return float(w[np.argmax(w * delay + np.arctan(w * time) > math.pi)])


def test_time_counted_in_another_unit_is_the_same_controller():
    rule = s_shaped(0.1, 1.0)
    for omega in (0.2, 0.5, 3.0):
        assert ideal(rule.gains(0.01), omega / 0.01) == pytest.approx(
            ideal(rule.gains(1.0), omega), rel=1e-12
        )


def test_the_critical_point_is_one():
    gain, period = critical_point(20.0, 1.5e-3)
    omega = 2 * math.pi / period
    plant = cmath.exp(-1.5e-3j * omega) / (1 + 1j * omega / 20.0) ** 2
    assert gain * plant == pytest.approx(-1.0, abs=1e-9)


@pytest.mark.parametrize("joint", [s_shaped_joint, critical_joint])
def test_the_outer_loop_of_a_joint_crosses_where_it_is_to(joint):
    """The whole controller less the inner loop, around the joint with its inner loop closed."""
    omega_i, ratio, inertia = 40.0, 0.5, 0.3
    whole = joint((omega_i, ratio), inertia, PERIOD)
    omega = np.geomspace(2.0, 200.0, 2000)
    plant = rigid_joint(inertia, PERIOD, None).response(omega)
    s = 1j * omega
    inner = inertia * (omega_i**2 + 2 * omega_i * s / (1 + s / (10 * omega_i)))
    outer = whole.response(omega, PERIOD) - inner
    loop = outer * plant / (1 + inner * plant)
    last = int(np.flatnonzero(np.abs(loop) > 1)[-1])
    assert omega[last] == pytest.approx(ratio * omega_i, rel=0.35)
    assert 0.3 < math.pi + np.angle(loop[last]) < 1.3


def test_both_joints_are_designed_with_their_inertias():
    one, two = design([20.0, 0.5, 20.0, 0.5], (0.3, 0.6), PERIOD)
    omega = np.array([5.0, 20.0, 80.0])
    np.testing.assert_allclose(
        2 * one.response(omega, PERIOD), two.response(omega, PERIOD), rtol=1e-9
    )
    assert [each.name for each in KNOBS[:2]] == ["omega_i_1", "omega_c_over_omega_i_1"]


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: s_shaped(2.5, 1.0), "outside of the rules"),
        (lambda: s_shaped(0.1, 60.0), "outside of the rules"),
        (lambda: s_shaped(0.0, 1.0), "delay must be above zero"),
        (lambda: critical(100.0, 7.0), "up to 640"),
        (lambda: critical(2.0, 9.0), "from 0.15 to 8"),
        (lambda: critical_point(20.0, 0.0), "no critical gain"),
        (lambda: s_shaped_joint((20.0, 0.001), 0.3, PERIOD), "omega_c|outside"),
        (lambda: s_shaped_joint((20.0, 30.0), 0.3, PERIOD), "outside of the rules"),
        (lambda: design([20.0, 0.5], (0.3, 0.6), PERIOD), "give 4 knobs"),
        (lambda: s_shaped_joint((20.0, 0.5), 0.3, PERIOD, -1.0), "delay must be zero or more"),
    ],
)
def test_what_the_rules_are_not_for_is_refused_in_a_line(call, named):
    with pytest.raises(ControllerError, match=named) as caught:
        call()
    assert "\n" not in str(caught.value)
