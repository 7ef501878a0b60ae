"""Figures of merit: geometry of the envelope, the index (5) by hand, diverged motions."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flexsim.loop.metrics import envelope_half_width, measures, performance_index, rms_distance
from flexsim.loop.motion import Motion
from flexsim.loop.trajectories import Reference

ROUNDING = 1e-12  # relative; sums of some thousand terms
TIME = np.linspace(0.0, 2.0, 2001)
STEP = 1e-3
SAMPLED = 0.01  # [1/s]; a half of the hold has one sample more than the other

points = arrays(float, st.tuples(st.integers(1, 20), st.just(2)), elements=st.floats(-1, 1))


def circle(radius: float, centre: tuple[float, float] = (0.5, 0.3), n: int = 720) -> np.ndarray:
    phi = 2 * np.pi * np.arange(n) / n
    return np.array(centre) + radius * np.stack([np.cos(phi), np.sin(phi)], axis=-1)


def motion(**columns: Any) -> Motion:
    """Return a motion on its reference, at rest at the origin unless told otherwise."""
    k = len(columns.get("time", TIME))
    pair, one = np.zeros((k, 2)), np.zeros(k)
    blank: dict[str, Any] = dict(
        plant="assumed-modes",
        time=TIME[:k],
        state=np.zeros((k, 10)),
        torque=pair,
        error=pair,
        applied=pair,
        measured=np.zeros((k, 3)),
        joint=pair,
        v=one,
        tip=pair,
        modal=np.zeros((k, 3)),
        energy=one,
        beam=np.zeros((k, 4, 2)),
        reference_tip=pair,
        reference_joint=pair,
    )
    return Motion(**(blank | columns))


@pytest.mark.parametrize("d", [1e-6, 0.01, -0.03])
def test_envelope_of_a_circle_offset_by_d_is_d(d: float) -> None:
    grown = envelope_half_width(circle(0.1 + d), circle(0.1))
    assert grown == pytest.approx(abs(d), rel=1e-9)  # d of numbers of size 1, in doubles
    shifted = envelope_half_width(circle(0.1, (0.5 + d, 0.3)), circle(0.1))
    assert shifted == pytest.approx(abs(d), rel=1e-9)


def test_envelope_is_directed_from_response_to_reference() -> None:
    reference = np.column_stack([np.linspace(0.0, 1.0, 101), np.zeros(101)])
    response = reference[:40] + np.array([0.0, 0.02])
    assert envelope_half_width(response, reference) == pytest.approx(0.02)
    assert envelope_half_width(reference, response) > 0.6  # control: the other way round


def test_envelope_does_not_know_the_time() -> None:
    reference = circle(0.1)
    assert envelope_half_width(reference[::-1], reference) == 0.0
    assert envelope_half_width(np.repeat(reference, 3, axis=0), reference) == 0.0


@given(response=points, reference=points)
def test_envelope_is_the_brute_force_maximum_of_minima(
    response: np.ndarray, reference: np.ndarray
) -> None:
    distance = np.linalg.norm(response[:, None] - reference, axis=2)
    expected = distance.min(axis=1).max()
    assert envelope_half_width(response, reference) == pytest.approx(expected, abs=1e-15)


def test_index_of_constant_errors_by_hand() -> None:
    """int d^2 dt = d^2 T; the trapezoids' int t^2 v^4 dt = v^4 (T^3/3 + T h^2/6), exactly."""
    T = 2.0
    off = motion(tip=np.tile([0.03, -0.04], (2001, 1)), v=np.full(2001, 0.1))
    vibration = 0.1**4 * (T**3 / 3 + T * STEP**2 / 6)
    expected = T * (0.03**2 + 0.04**2) + vibration
    assert performance_index(off) == pytest.approx(expected, rel=ROUNDING)
    weighted = T * (2 * 0.03**2 + 3 * 0.04**2) + 5 * vibration
    assert performance_index(off, (2.0, 3.0, 5.0)) == pytest.approx(weighted, rel=ROUNDING)


def test_index_of_a_sinusoidal_error_by_hand() -> None:
    tip = np.column_stack([0.2 * np.sin(np.pi * TIME), np.zeros(2001)])
    # trapezoids are exact for a whole number of periods
    assert performance_index(motion(tip=tip)) == pytest.approx(0.2**2, rel=ROUNDING)


def test_index_counts_the_error_from_the_reference_not_the_position() -> None:
    tip = circle(0.1, n=2001)
    assert performance_index(motion(tip=tip, reference_tip=tip)) == 0.0


def test_late_vibration_costs_more_than_early() -> None:
    early, late = np.where(TIME < 1, 0.1, 0.0), np.where(TIME > 1, 0.1, 0.0)
    ratio = performance_index(motion(v=late)) / performance_index(motion(v=early))
    assert ratio == pytest.approx(7.0, rel=0.01)  # (8 - 1)/1, one sample at the jump


@pytest.mark.parametrize(
    ("length", "time", "weight"), [(1.0, 1e3, 1e6), (1e3, 1.0, 1e6), (1e2, 1.0, 1e4)]
)
def test_units_decide_what_vibration_counts(length: float, time: float, weight: float) -> None:
    """(5) adds m2 s and m4 s3: in ms, in mm or in cm vibration weighs 1e6, 1e6, 1e4 times more."""
    tip = np.tile([0.03, -0.04], (2001, 1))
    metres = motion(tip=tip, v=np.full(2001, 0.01))
    other = replace(metres, time=time * TIME, tip=length * tip, v=length * metres.v)
    expected = length**2 * time * performance_index(metres, (1.0, 1.0, weight))
    assert performance_index(other) == pytest.approx(expected, rel=ROUNDING)


def test_diverged_motion_has_an_infinite_index() -> None:
    cut = replace(motion(time=TIME[:100]), diverged=0.1)
    assert performance_index(cut) == float("inf")
    assert performance_index(motion(time=TIME[:100])) == 0.0


def test_measures_by_hand() -> None:
    reference = Reference(TIME, np.tile([0.5, 0.0], (2001, 1)), np.zeros((2001, 2)))
    tip = reference.tip.copy()
    tip[500] += (0.3, 0.4)
    v = np.where(TIME < 1.5, -0.05, 0.01)
    torque = np.zeros((2001, 2))
    torque[7], torque[9] = (-3.0, 0.5), (2.0, 1.0)
    found = measures(
        motion(tip=tip, reference_tip=reference.tip, v=v, torque=torque), reference, hold=0.5
    )
    assert found["envelope"] == found["max_error"] == pytest.approx(0.5)
    assert found["rms_error"] == pytest.approx(0.5 / np.sqrt(2001))
    assert (found["max_v"], found["residual_v"]) == (0.05, 0.01)
    assert (found["peak_torque_1"], found["peak_torque_2"]) == (3.0, 1.0)
    assert found["rms_torque_1"] == pytest.approx(np.sqrt((9 + 4) / 2001))
    assert (found["variation_1"], found["variation_2"]) == (3 + 3 + 2 + 2, 0.5 + 0.5 + 1 + 1)
    assert found["effort"] == pytest.approx(STEP * (9 + 4 + 0.25 + 1))
    assert found["growth"] == pytest.approx(0.0, abs=ROUNDING)
    assert found["diverged"] is False and found["diverged_at"] is None


@pytest.mark.parametrize("rate", [1.5, -0.4])
def test_growth_is_that_of_an_exponential(rate: float) -> None:
    reference = Reference(TIME, np.zeros((2001, 2)), np.zeros((2001, 2)))
    v = np.exp(rate * TIME) * np.sin(2 * np.pi * 50 * TIME)
    found = measures(motion(v=v), reference, hold=1.0)
    assert found["growth"] == pytest.approx(rate, abs=SAMPLED)
    assert measures(motion(v=0 * v), reference, hold=1.0)["growth"] is None
    assert measures(motion(v=v), reference)["growth"] is None


def test_a_torque_of_the_last_sample_is_no_effort() -> None:
    reference = Reference(TIME, np.zeros((2001, 2)), np.zeros((2001, 2)))
    torque = np.zeros((2001, 2))
    torque[-1] = 5.0
    assert measures(motion(torque=torque), reference)["effort"] == 0.0


def test_measures_of_a_diverged_motion_say_so() -> None:
    reference = Reference(TIME, np.zeros((2001, 2)), np.zeros((2001, 2)))
    found = measures(replace(motion(time=TIME[:100]), diverged=0.1), reference, hold=0.5)
    assert found["diverged"] is True and found["diverged_at"] == 0.1
    assert found["index"] == float("inf") and found["residual_v"] is None


def test_a_path_without_a_hold_has_no_residual() -> None:
    reference = Reference(TIME, np.zeros((2001, 2)), np.zeros((2001, 2)))
    assert measures(motion(v=np.ones(2001)), reference)["residual_v"] is None


def test_rms_distance_of_known_points() -> None:
    first, second = [[0.0, 0.0], [1.0, 1.0]], [[3.0, 4.0], [1.0, 1.0]]
    assert rms_distance(first, second) == pytest.approx(np.sqrt(25 / 2), rel=1e-15)
    assert rms_distance(second, second) == 0.0
