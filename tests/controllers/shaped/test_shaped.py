"""Controllers by bandwidth and angles: crossings, round trips, reductions, and what is refused."""

import math
import time

import numpy as np
import pytest

from controllers import (
    COLLOCATED,
    TUNED,
    ControllerError,
    Sections,
    fractional_pid,
    frequency_response,
    integer_pid,
    oustaloup_pid,
    textbook_pid,
    tustin,
)
from controllers.shaped import FORMS, fractional, integer, long, pd, textbook
from controllers.shaped.normalised import Parts, bandwidth

PERIOD = 1e-3
INERTIAS = (0.3177, 0.0112)  # of the paper's arm in the middle of the circle [kg m2]
CROSSED = 1e-10  # relative: gains have 12 digits
ROUNDED = 1e-9  # relative: of a crossing found again
QUICK = 5e-3  # [s] of processor time for a design; measured: 0.4 to 1.5 ms


def drawn(form, count, seed=3):
    """Knobs within their ranges (count, n)."""
    low, high = (np.array([getattr(each, end) for each in form.KNOBS]) for end in ("low", "high"))
    return np.random.default_rng(seed).uniform(low, high, (count, len(low))).tolist()


def response(given, omega):
    if isinstance(given, Sections):
        return given.response(omega, PERIOD)[0]
    return frequency_response(*given, omega, PERIOD)[0]


@pytest.mark.parametrize("name", FORMS)
def test_the_rigid_joint_crosses_at_the_bandwidth(name):
    """|L(j omega_c)| = 1 with the digital controller's own response."""
    form = FORMS[name]
    n = len(form.KNOBS) // 2
    for knobs in drawn(form, 20):
        for j, built in enumerate(form.design(knobs, INERTIAS, PERIOD)):
            omega_c = knobs[j * n]
            loop = response(built, omega_c) / (INERTIAS[j] * omega_c**2)
            assert abs(loop) == pytest.approx(1.0, rel=CROSSED)


@pytest.mark.parametrize("name", FORMS)
def test_knobs_are_of_both_joints_and_say_what_they_are(name):
    knobs = FORMS[name].KNOBS
    names = [each.name for each in knobs]
    assert len(set(names)) == len(names)
    assert [each.removesuffix("_1") for each in names[: len(names) // 2]] == [
        each.removesuffix("_2") for each in names[len(names) // 2 :]
    ]
    assert all(each.low < each.high and (each.low > 0 or not each.log) for each in knobs)


@pytest.mark.parametrize(
    ("phi_1", "phi_2"), [(0.3, 0.1), (1.2, 0.0), (1.9, 0.4), (-0.4, -0.3), (2.5, 1.2)]
)
def test_angles_are_those_of_the_parts(phi_1, phi_2):
    knobs = (60.0, phi_1, phi_2, 5.0)
    kd, ki, kp = textbook.gains_of(knobs, INERTIAS[0], PERIOD)
    lag = 1.0 / (5.0 * 60.0)
    derivative = abs(response(textbook_pid(0, 0, kd, PERIOD, lag), 60.0)) * math.copysign(1, kd)
    integral = abs(response(textbook_pid(0, ki, 0, PERIOD), 60.0)) * math.copysign(1, ki)
    assert derivative / kp == pytest.approx(math.tan(phi_1), rel=CROSSED)
    assert integral / abs(kp) == pytest.approx(math.tan(phi_2), rel=CROSSED, abs=CROSSED)
    assert (kp < 0) == (phi_1 > math.pi / 2)


@pytest.mark.parametrize("name", TUNED)
def test_tuned_controllers_come_back_from_their_knobs_and_are_in_the_ranges(name):
    knobs = fractional.knobs_of_both(TUNED[name], INERTIAS, PERIOD)
    for built, given in zip(
        fractional.design(knobs, INERTIAS, PERIOD), TUNED[name].filters(PERIOD), strict=True
    ):
        np.testing.assert_allclose(built[0], given[0], rtol=ROUNDED, atol=1e-9 * given[0][0])
    for each, value in zip(fractional.KNOBS, knobs, strict=True):
        assert each.low <= value <= each.high, each.name


def test_the_collocated_pids_come_back_from_their_knobs_and_are_in_the_ranges():
    knobs = textbook.knobs_of_both(COLLOCATED, INERTIAS, PERIOD)
    for built, given in zip(
        textbook.design(knobs, INERTIAS, PERIOD), COLLOCATED.filters(PERIOD), strict=True
    ):
        for mine, theirs in zip(built, given, strict=True):
            np.testing.assert_allclose(mine, theirs, rtol=1e-7)
    for each, value in zip(textbook.KNOBS, knobs, strict=True):
        assert each.low <= value <= each.high, each.name


def test_orders_one_and_minus_one_are_the_integer_pid():
    for knobs in drawn(integer, 10):
        whole = integer.design(knobs, INERTIAS, PERIOD)
        with_orders = [*knobs[:3], 1.0, -1.0, *knobs[3:], 1.0, -1.0]
        for mine, theirs in zip(
            whole, fractional.design(with_orders, INERTIAS, PERIOD), strict=True
        ):
            np.testing.assert_allclose(mine[0], theirs[0], rtol=CROSSED, atol=1e-12)
        found = integer.gains_of(knobs[:3], INERTIAS[0], PERIOD)
        built = integer_pid(found.k1, found.k2, found.k3, PERIOD)
        np.testing.assert_array_equal(whole[0][0], built[0])


def test_gains_are_those_of_the_filters():
    knobs = drawn(fractional, 1)[0]
    mine = fractional.design(knobs, INERTIAS, PERIOD)[0]
    theirs = fractional_pid(fractional.gains_of(knobs[:5], INERTIAS[0], PERIOD), PERIOD)
    np.testing.assert_allclose(mine[0], theirs[0], rtol=CROSSED)
    assert fractional.gains_of(knobs[:5], INERTIAS[0], PERIOD).nu1 == knobs[3]
    gains = long.gains_of(knobs[:5], INERTIAS[0], PERIOD)
    built = oustaloup_pid(gains, PERIOD, long.TERMS, long.LOW, long.HIGH / PERIOD)
    omega = np.array([3.0, 300.0])
    np.testing.assert_array_equal(
        long.design(knobs, INERTIAS, PERIOD)[0].response(omega, PERIOD),
        built.response(omega, PERIOD),
    )


def test_a_pd_is_a_pid_without_integral_and_has_no_pole_at_one():
    knobs = drawn(pd, 1)[0]
    built = pd.design(knobs, INERTIAS, PERIOD)[0]
    theirs = textbook.joint((*knobs[:2], 0.0, knobs[2]), INERTIAS[0], PERIOD)
    np.testing.assert_array_equal(built[0], theirs[0])
    assert built[1].size == 2 and abs(built[1][1]) < 1.0


def test_the_long_form_remembers_what_the_series_forgets():
    """Half an integration at 1 rad/s: -45 degrees by sections, none by eleven taps."""
    knobs = [30.0, 0.2, 1.4, 0.5, -0.5] * 2
    lags = [
        np.degrees(np.angle(response(form.design(knobs, INERTIAS, PERIOD)[0], 1.0)))
        for form in (long, fractional)
    ]
    assert lags[0] < -30.0 and abs(lags[1]) < 2.0


@pytest.mark.parametrize("omega", [30.0, 60.0, 120.0])
def test_cut_after_ten_terms_a_derivative_lags_and_a_negative_one_leads(omega):
    """(2)'s D is j tan(omega T/2) + its remainder, e^(-11 j omega T)/(1 + z^-1), times 2/T."""
    b, a = tustin(1.0, PERIOD, 10)
    found = frequency_response(b, a, omega, PERIOD)[0]
    z = np.exp(1j * omega * PERIOD)
    expected = 2 / PERIOD * (1j * math.tan(omega * PERIOD / 2) + 2 * z**-11 / (1 + 1 / z))
    assert found == pytest.approx(expected, rel=1e-9)
    assert np.degrees(np.angle(found)) < -10.0
    leads = [
        np.angle(response(integer.joint((omega, phi_1, 0.0), 1.0, PERIOD), omega))
        for phi_1 in (0.3, -0.3)
    ]
    assert leads[0] < 0.0 < leads[1]


def test_twice_the_inertia_is_twice_the_gain():
    knobs = drawn(textbook, 1)[0]
    once, twice = (
        textbook.gains_of(knobs[:4], factor * INERTIAS[0], PERIOD) for factor in (1.0, 2.0)
    )
    np.testing.assert_allclose(twice, 2 * np.array(once), rtol=1e-11)


@pytest.mark.parametrize("name", FORMS)
def test_a_design_is_quick(name):
    form = FORMS[name]
    knobs = drawn(form, 40)
    start = time.process_time()
    for each in knobs:
        form.design(each, INERTIAS, PERIOD)
    assert (time.process_time() - start) / len(knobs) < QUICK


@pytest.mark.parametrize(
    ("knobs", "inertias", "named"),
    [
        ([60.0, 0.3] * 2, INERTIAS, "give 6 knobs"),
        ([60.0, 0.3, math.nan] * 2, INERTIAS, "phi_2 of joint 1"),
        ([4000.0, 0.3, 0.1] * 2, INERTIAS, "pi/period"),
        ([-1.0, 0.3, 0.1] * 2, INERTIAS, "omega_c is -1"),
        ([60.0, 0.3, 0.1] * 2, (0.3, 0.0), "inertia of joint 2"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(knobs, inertias, named):
    with pytest.raises(ControllerError, match=named) as caught:
        integer.design(knobs, inertias, PERIOD)
    assert "\n" not in str(caught.value)


def test_parts_that_cancel_are_refused():
    with pytest.raises(ControllerError, match="cancel"):
        fractional.joint((60.0, -math.pi / 4, 0.0, 0.0, 0.5), INERTIAS[0], PERIOD)


def test_what_does_not_cross_or_has_no_proportional_part_has_no_knobs():
    with pytest.raises(ControllerError, match="does not cross"):
        bandwidth((np.array([1e9]), np.ones(1)), INERTIAS[0], PERIOD)
    with pytest.raises(ControllerError, match="proportional"):
        textbook.knobs_of(Parts(5.0, 10.0, 0.0), 1e-3, INERTIAS[0], PERIOD)
    with pytest.raises(ControllerError, match="filter_time"):
        textbook.knobs_of(Parts(5.0, 10.0, 100.0), 0.0, INERTIAS[0], PERIOD)
