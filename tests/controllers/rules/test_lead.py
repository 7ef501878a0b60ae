"""The fractional lead: its margin over a range of inertias, its closed form; all rules build."""

import math

import numpy as np
import pytest

from controllers import ControllerError, Sections
from controllers.rules import RULES
from controllers.rules.joint import rigid_joint
from controllers.rules.lead import (
    corners,
    joint_lead,
    lowest_crossing,
    margin,
    order,
)

PERIOD, DELAY = 1e-3, 1.5e-3
INERTIAS = (0.3177, 0.0112)
REALISED = 0.04  # [rad] by which sections' phase is off: ripple, and Tustin's warping
WIDE = 1e7  # a band that is as good as none


@pytest.mark.parametrize("phi_m", [0.5, 0.9, 1.3])
def test_without_edges_and_delay_it_is_bodes_ideal_loop(phi_m):
    """The margin is alpha pi/2, whatever the inertia."""
    alpha = order(30.0, phi_m, 2.0, WIDE, WIDE * 30.0, 0.0)
    assert alpha == pytest.approx(2 * phi_m / math.pi, rel=1e-6)


@pytest.mark.parametrize("heavier", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("edge", [2.0, 5.0, 10.0])
@pytest.mark.parametrize("omega_c, phi_m", [(15.0, 0.5), (60.0, 0.8), (150.0, 1.1)])
def test_the_margin_is_kept_over_the_range_and_no_larger_order_is_taken(
    heavier, edge, omega_c, phi_m
):
    alpha, low, high = corners((omega_c, phi_m, heavier, edge), PERIOD, DELAY)
    lowest = lowest_crossing(omega_c, heavier, alpha)
    margins = [margin(alpha, low, high, w, DELAY) for w in np.linspace(lowest, omega_c, 50)]
    assert min(margins) == pytest.approx(phi_m, abs=1e-6)
    less = [margin(0.99 * alpha, low, high, w, DELAY) for w in (lowest, omega_c)]
    assert min(less) < phi_m - 1e-3


@pytest.mark.parametrize("factor", [1.0, 1.4, 2.0])
def test_the_digital_joint_keeps_its_margin_whatever_it_carries(factor):
    inertia, omega_c, phi_m = 0.3, 50.0, 0.8
    built = joint_lead((omega_c, phi_m, 2.0, 5.0), inertia, PERIOD)
    omega = np.geomspace(5.0, 300.0, 4000)
    plant = rigid_joint(factor * inertia, PERIOD, None).response(omega)
    loop = built.response(omega, PERIOD) * plant
    last = int(np.flatnonzero(np.abs(loop) > 1)[-1])
    assert np.angle(-loop[last]) > phi_m - REALISED
    alpha = corners((omega_c, phi_m, 2.0, 5.0), PERIOD, DELAY)[0]
    if factor == 1.0:
        assert omega[last] == pytest.approx(omega_c, rel=0.01)
    assert omega[last] >= lowest_crossing(omega_c, 2.0, alpha) * 0.97


def test_a_lead_for_one_inertia_loses_its_margin_with_another():
    """Negative control: an ordinary PD of the same margin, with twice the inertia."""
    omega_c, phi_m = 50.0, 0.8
    slope = math.tan(phi_m + omega_c * DELAY) / omega_c
    omega = np.geomspace(5.0, 100.0, 4000)
    plant = rigid_joint(2.0, PERIOD, None).response(omega)
    size = 1.0 / abs(complex(rigid_joint(1.0, PERIOD, None).response(omega_c)))
    loop = size / abs(1 + 1j * omega_c * slope) * (1 + 1j * omega * slope) * plant
    last = int(np.flatnonzero(np.abs(loop) > 1)[-1])
    assert np.angle(-loop[last]) < phi_m - 3 * REALISED


def test_below_the_band_it_is_a_spring():
    built = joint_lead((50.0, 0.8, 2.0, 5.0), 0.3, PERIOD)
    rest = [complex(built.response(w, PERIOD)[0]) for w in (1e-3, 0.1)]
    assert rest[0].real > 50.0 and abs(np.angle(rest[1])) < 0.05
    assert rest[1] == pytest.approx(rest[0], rel=0.05)


@pytest.mark.parametrize(
    ("knobs", "named"),
    [
        ((50.0, 0.8, 0.5, 5.0), "inertia_ratio is 0.5"),
        ((50.0, 3.0, 2.0, 5.0), "takes an order of 1.9 or more"),
        ((900.0, 0.8, 2.0, 5.0), "takes an order"),
        ((50.0, 0.8, 2.0), "give omega_c, phi_m, inertia_ratio, edge"),
        ((50.0, 0.8, 2.0, -1.0), "edge must be above zero"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(knobs, named):
    with pytest.raises(ControllerError, match=named) as caught:
        joint_lead(knobs, 0.3, PERIOD)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", RULES)
def test_every_rule_builds_all_over_its_ranges_with_poles_inside_or_at_one(name):
    rule = RULES[name]
    low, high = (np.array([getattr(each, end) for each in rule.knobs]) for end in ("low", "high"))
    drawn = np.random.default_rng(1).uniform(low, high, (20, len(low)))
    for knobs in [*drawn, low, high]:
        for built in rule.design(knobs.tolist(), INERTIAS, PERIOD):
            assert isinstance(built, Sections)
            poles = np.concatenate(
                [np.roots(a) for cascade in built.cascades for _, a in cascade if a.size > 1]
            )
            assert ((np.abs(poles) < 1) | (np.abs(poles - 1) < 1e-12)).all()
            assert all(np.isfinite(b).all() for cascade in built.cascades for b, _ in cascade)
