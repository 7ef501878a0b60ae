"""Oustaloup's filters as sections: exact where one polynomial is rounded away."""

import numpy as np
import pytest

from controllers import (
    ControllerError,
    Gains,
    Sections,
    fractional_pid,
    frequency_response,
    oustaloup,
    oustaloup_cascade,
    oustaloup_pid,
)
from flexsim import AssumedModesPlant, Parameters, evaluate, measure, reference, setting
from flexsim.linear.controller_space import controller_space
from flexsim.linear.loop_poles import linear_loop
from flexsim.loop.control.stacking import stack
from flexsim.loop.trajectories import Trajectory

T = 1e-3  # [s]
LOW, HIGH, PAIRS = 2.5e-3, 2500.0, 17  # six decades [rad/s]
OMEGA = np.geomspace(LOW, HIGH, 90)
EXACT = 1e-9  # relative; a pole 2.5e-6 from 1 is good to 1e-10
RIPPLE = 0.03  # relative, of 17 pairs over six decades, two decades from the edges


def analog(order: float, omega: np.ndarray) -> np.ndarray:
    """The continuous filter at Tustin's warped frequency, from its definition."""
    s, k = 2j / T * np.tan(omega * T / 2), np.arange(1, PAIRS + 1)
    zeros, poles = (
        LOW * (HIGH / LOW) ** ((2 * k - 1 + side * order) / (2 * PAIRS)) for side in (-1, 1)
    )
    return HIGH**order * np.prod((s[:, None] + zeros) / (s[:, None] + poles), axis=1)


@pytest.mark.parametrize("order", [0.5, 0.95, -0.3])
def test_seventeen_pairs_over_six_decades_are_exact(order: float) -> None:
    cascade = oustaloup_cascade(order, T, PAIRS, LOW, HIGH)
    assert len(cascade) == PAIRS
    found = Sections((cascade,)).response(OMEGA, T)
    assert np.abs(found / analog(order, OMEGA) - 1).max() < EXACT
    inside = OMEGA[(OMEGA > 100 * LOW) & (OMEGA < HIGH / 100)]
    ideal = (1j * inside) ** order
    assert np.abs(Sections((cascade,)).response(inside, T) / ideal - 1).max() < RIPPLE
    with pytest.raises(ControllerError, match="oustaloup_cascade"):
        oustaloup(order, T, PAIRS, LOW, HIGH)  # control: one polynomial cannot


@pytest.mark.parametrize("order", [0.4, 1.3, 2.0, -1.6, -1.0, 0.0])
def test_a_short_cascade_is_the_polynomial(order: float) -> None:
    omega = np.geomspace(0.1, 3000.0, 30)
    found = Sections((oustaloup_cascade(order, T, 3),)).response(omega, T)
    assert found == pytest.approx(frequency_response(*oustaloup(order, T, 3), omega, T), rel=1e-6)


def test_a_pid_of_sections_is_the_one_of_polynomials() -> None:
    gains, omega = Gains(100.0, 0.5, 2.0, -0.3, 1.0), np.geomspace(0.1, 3000.0, 30)
    found = oustaloup_pid(gains, T, 3).response(omega, T)
    b, a = fractional_pid(gains, T, "oustaloup", 3)
    assert found == pytest.approx(frequency_response(b, a, omega, T), rel=1e-3)


def test_a_wide_pid_runs_and_is_linearised() -> None:
    """Its loop differs from a narrower band's of as many pairs a decade by a slow drift only."""
    plant = AssumedModesPlant(Parameters())
    path = Trajectory("line", duration=0.4, hold=0.1, start=(0.6, 0.3), end=(0.57, 0.33))
    ref = reference(path, plant.parameters, T)
    gains = Gains(80.0, 0.6, 5.0, -0.4, 1.0), Gains(3.0, 0.5, 0.5, -0.4, 0.1)
    wide, narrow = (
        tuple(oustaloup_pid(each, T, pairs, low, HIGH) for each in gains)
        for pairs, low in ((PAIRS, LOW), (11, LOW * 10 ** (6 * 6 / 17)))
    )
    outcome = evaluate(plant, setting("none"), ref, [wide, narrow], stride=1)
    assert np.isnan(outcome.diverged).all()
    first, second = outcome.states[0], outcome.states[1]
    assert np.abs(first - second).max() < 0.02 * np.abs(second - second[0]).max()
    loop = linear_loop(plant, 1.2, stack([wide], T))
    own = np.linalg.eigvals(controller_space(loop.controllers)[0][0])
    assert len(own) >= 2 * 2 * PAIRS and np.abs(own).max() < 1
    assert loop.spectral_radius < 1 + 1e-5
    (found,) = measure(plant, setting("none"), ref, [wide])
    assert not found["diverged"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((0.5, T, 0), "terms"),
        ((0.5, 0.0, 3), "period"),
        ((np.nan, T, 3), "order"),
        ((0.5, T, 3, 1.0, 4000.0), "Nyquist|pi/period"),
        ((0.5, T, 3, 10.0, 1.0), "low < high"),
    ],
)
def test_what_cannot_be_built_is_refused(arguments: tuple, said: str) -> None:
    with pytest.raises(ControllerError, match=said) as refused:
        oustaloup_cascade(*arguments)
    assert "\n" not in str(refused.value)
    with pytest.raises(ControllerError, match="nu2"):
        oustaloup_pid(Gains(1.0, 0.5, 1.0, None, 0.0), T, 3)
