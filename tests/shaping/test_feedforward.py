"""Torques through filters and friction: the inverse of each, and the dither's mean."""

import numpy as np
import pytest
from scipy.signal import lfilter
from trial_controllers import TRIAL

from flexsim.loop.friction import Friction, joint_torques
from flexsim.shaping.feedforward import PEAK, RAMP, TONE, dithered_torque, errors_for, motor_torque

PERIOD = 1e-3  # [s]
COUNT = 2000
START = 400  # sample at which the tone sets in
GROWN = START + round(RAMP / PERIOD)
WRAP = 50  # samples after which the filters have forgotten that the FFT is periodic
TABLE = 5e-3  # [N m], spacing of the table that is inverted


def smooth(count: int = COUNT) -> np.ndarray:
    """Torques (K, 2) [N m] within what the arm needs on its trajectories, at rest at both ends."""
    turns = 2 * np.pi * np.arange(count) / count
    hat = np.sin(turns / 2) ** 4
    return np.stack([2.0 * hat * np.sin(2 * turns), 0.3 * hat * np.cos(turns)], axis=1)


def passed(friction: Friction, command: np.ndarray, rates: np.ndarray) -> np.ndarray:
    numbers = friction.numbers()
    return np.array([joint_torques(numbers, *u, *w) for u, w in zip(command, rates, strict=True)])


def test_filters_give_the_torque_back() -> None:
    filters = TRIAL["circle"].filters(PERIOD)
    torque = smooth()
    errors = errors_for(filters, torque)
    for j, (b, a) in enumerate(filters):
        got = lfilter(b, a, errors[:, j])
        assert got[WRAP:] == pytest.approx(torque[WRAP:, j], abs=1e-12)


def test_motor_torque_inverts_joint_friction_outside_its_dead_zone() -> None:
    friction = Friction("opposing", dead_zone=((0.0, 0.0), (0.0, 0.0)))
    torque = smooth()
    rates = torque[::-1] / 5
    command = motor_torque(friction, torque, rates)
    assert passed(friction, command, rates) == pytest.approx(torque, abs=1e-12)


@pytest.mark.parametrize("law", ["simulink", "jump", "opposing"])
def test_the_mean_over_the_tone_is_the_torque(law: str) -> None:
    friction, still = Friction(law), np.zeros((COUNT, 2))
    for wanted in (0.0, 0.1, -0.15):  # more needs jumps of (47) at joint 1
        torque = np.full((COUNT, 2), wanted)
        command = dithered_torque(friction, torque, still, PERIOD, START)
        got = passed(friction, command, still)[GROWN:].reshape(-1, 4, 2).mean(axis=1)
        assert got == pytest.approx(wanted, abs=TABLE)


def test_without_the_tone_the_dead_zone_swallows_the_torque() -> None:
    friction, still = Friction("jump"), np.zeros((COUNT, 2))
    torque = np.full((COUNT, 2), 0.3)
    assert not passed(friction, motor_torque(friction, torque, still), still).any()


def test_every_level_of_the_tone_is_outside_the_dead_zone_and_its_mean_is_none() -> None:
    friction = Friction("jump")
    still = np.zeros((COUNT, 2))
    command = dithered_torque(friction, still, still, PERIOD, START)
    assert not command[: START + 1].any()
    tone = command[GROWN:]
    low, high = np.array(friction.dead_zone).T
    assert ((tone < low) | (tone > high)).all()
    assert np.abs(tone).max(axis=0) == pytest.approx(PEAK * np.array([3.2379, 0.6608]), abs=TABLE)
    assert TONE.sum() == 0


def test_without_friction_nothing_is_added() -> None:
    torque, still = smooth(), np.zeros((COUNT, 2))
    assert np.array_equal(dithered_torque(Friction(), torque, still, PERIOD, START), torque)
