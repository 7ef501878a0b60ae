"""The model that designs read, its delay, its rounding, and the knobs."""

from dataclasses import replace

import numpy as np
import pytest
from designs import BENCH, INERTIA, PERIOD, arm, arm_model, loop_around, rigid_model, same_set

from controllers import ControllerError
from controllers.model_based import delayed, lqg, middle, mixed_sensitivity, pd_strain
from controllers.model_based.model import closed_loop, read_knobs, shortened
from flexsim import Parameters
from flexsim.linear.designed_on import rigid
from flexsim.loop.hardware import IDEAL
from flexsim.plants.chain_plant import ChainPlant

EXACT = 1e-12  # relative: sums of the same numbers
CLOSE = 1e-6  # poles of matrices that differ by rounded coefficients
DESIGNS = (pd_strain, lqg, mixed_sensitivity)


def test_a_delay_in_the_hardware_is_a_delayed_model() -> None:
    two = arm_model(replace(BENCH, delay=2))
    again = delayed(arm_model(replace(BENCH, delay=0)), 2)
    # the newest waiting torques come first in flexsim's states, last here
    n = len(two.A)
    order = [*range(n - 4), n - 2, n - 1, n - 4, n - 3]
    assert np.array_equal(two.A[np.ix_(order, order)], again.A)
    assert np.array_equal(two.B[order], again.B) and np.array_equal(two.C[:, order], again.C)
    assert np.array_equal(two.E[order], again.E)
    with pytest.raises(ControllerError, match="samples must be a whole number"):
        delayed(two, -1)


@pytest.mark.parametrize("theta2", [0.6, 1.5])
def test_inertia_is_that_of_the_rigid_arm(theta2: float) -> None:
    p = Parameters()
    J2 = p.I_H + p.I_b
    h = p.rho * p.L_R * np.cos(theta2) * ((p.r + p.L) ** 2 - p.r**2) / 2
    J1 = p.I_R0 + p.L_R**2 * (p.m_H + p.m_b) + J2 + 2 * h
    wanted = np.array([[J1, J2 + h], [J2 + h, J2]])
    for plant in (arm(), ChainPlant.designed(p)):
        turned, J = rigid(plant.linearised(theta2))
        assert J == pytest.approx(wanted, rel=1e-6)
        assert turned == pytest.approx(np.eye(len(turned), 2), abs=1e-9)


def test_a_period_of_acceleration_moves_angles_and_rates_alone() -> None:
    E, m = arm_model(replace(BENCH, delay=0)).E, 7
    moved = np.flatnonzero(E[:, 0])
    assert moved.tolist() == [0, m]
    assert E[[0, m], 0] == pytest.approx([PERIOD**2 / 2, PERIOD], rel=EXACT)
    assert E[[1, m + 1], 1] == pytest.approx([PERIOD**2 / 2, PERIOD], rel=EXACT)


def test_noise_is_an_encoders_and_the_benchs() -> None:
    quantum = 2 * np.pi / 8192
    assert arm_model(BENCH).noise == pytest.approx([quantum / 12**0.5] * 2 + [1e-4], rel=EXACT)
    assert (arm_model(IDEAL).noise > 0).all()


@pytest.mark.parametrize("design", DESIGNS, ids=lambda m: m.__name__.rpartition(".")[2])
def test_the_loop_is_flexsims_and_stable_in_the_middle_of_the_ranges(design) -> None:  # type: ignore[no-untyped-def]
    """Five modes and a sample of delay, also away from the pose that the design was made for."""
    model = arm_model()
    controller = design.design(middle(design.KNOBS), model)
    loop = loop_around(controller)
    mine = np.linalg.eigvals(closed_loop(controller, model))
    theirs = loop.poles
    assert same_set(mine[np.abs(mine) > 0.5], theirs[np.abs(theirs) > 0.5]) < CLOSE
    for theta2 in (0.9, 1.5, 2.1):
        assert loop_around(controller, theta2=theta2).growth_rate < 0.0
    late = replace(BENCH, delay=12)  # a check that cannot fail is none
    assert loop_around(controller, late).growth_rate > 1.0


@pytest.mark.parametrize("design", DESIGNS, ids=lambda m: m.__name__.rpartition(".")[2])
def test_a_design_is_the_same_again_and_refuses_wrong_knobs(design) -> None:  # type: ignore[no-untyped-def]
    model, knobs = arm_model(modes=3), middle(design.KNOBS)
    first, again = design.design(knobs, model), design.design(np.array(knobs), model)
    assert all(np.array_equal(one, other) for one, other in zip(first, again, strict=True))
    A, B, C, D = first
    assert B.shape == (len(A), 3) and C.shape == (2, len(A)) and D.shape == (2, 3)
    with pytest.raises(ControllerError, match="knobs are given; give"):
        design.design(knobs[1:], model)
    with pytest.raises(ControllerError, match="bandwidth_1 is 1 rad/s; give 15 to 250"):
        design.design([1.0, *knobs[1:]], model)
    with pytest.raises(ControllerError, match="bandwidth_1 must be a finite number"):
        design.design([np.nan, *knobs[1:]], model)
    assert 6 <= len(design.KNOBS) <= 8


def test_the_edges_of_a_range_are_in_it() -> None:
    knobs = lqg.KNOBS
    for edge in ([k.low for k in knobs], [k.high for k in knobs]):
        assert read_knobs(edge, knobs) == edge
    assert all(k.low < m < k.high for k, m in zip(knobs, middle(knobs), strict=True))


@pytest.mark.parametrize("design", DESIGNS, ids=lambda m: m.__name__.rpartition(".")[2])
def test_whatever_the_knobs_the_controller_is_stable_or_refused(design) -> None:  # type: ignore[no-untyped-def]
    rng, model = np.random.default_rng(7), arm_model(modes=3)
    built = 0
    for u in rng.integers(0, 2, (12, len(design.KNOBS))):
        knobs = [k.high if high else k.low for k, high in zip(design.KNOBS, u, strict=True)]
        try:
            A, _, _, _ = design.design(knobs, model)
        except ControllerError as error:
            assert "\n" not in str(error)
            continue
        built += 1
        poles = np.linalg.eigvals(A)
        outside = np.abs(poles) >= 1.0 - 1e-9
        assert np.abs(poles[outside] - 1.0).max(initial=0.0) < 1e-9  # integrators alone
        assert outside.sum() == (0 if design is pd_strain else 2)
    assert built >= 6


def test_numbers_are_shortened_each_by_itself() -> None:
    given = np.array([1.0, 1e-8 / 3, -2e5 / 3, 0.0, np.inf])
    found = shortened(given)
    assert found[:4] == pytest.approx([1.0, 3.333333333e-9, -66666.66667, 0.0], rel=1e-15)
    assert found[4] == np.inf and np.array_equal(shortened(found), found)
    nearly = given[:3] * (1 + 1e-14)
    assert np.array_equal(shortened(nearly), found[:3])


def test_the_rigid_model_is_what_it_says() -> None:
    model = rigid_model(PERIOD)
    torque = INERTIA @ np.array([1.0, 0.0])  # accelerates joint 1 alone
    x = model.B @ torque
    assert x == pytest.approx(model.E[:, 0], rel=EXACT, abs=1e-18)
