"""Figures of merit in the compiled loop: those of a recorded motion, without one."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers import TUNED_IDEAL
from flexsim import AssumedModesPlant, ParameterError, Parameters
from flexsim.loop.measuring import (
    ENVELOPE,
    SUMS,
    WAITING,
    WAITING_MOST,
    add_to_envelope,
    settle,
    yardstick,
)
from flexsim.loop.metrics import envelope_half_width, measures
from flexsim.loop.runs import closed_loop, evaluate, measure
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import Reference, Trajectory, reference

ROUNDING = 1e-12  # relative; sums of some thousand terms in another order: 1e-13
PLANT = AssumedModesPlant(Parameters())
HOLD = 0.2  # [s]
SHORT = Trajectory("circle", duration=0.6, hold=HOLD, half_width=0.03)
LINE = Trajectory("line", duration=0.5, hold=HOLD, start=(0.6, 0.3), end=(0.5, 0.4))
LOOPS = Trajectory("two-loop", duration=0.7, hold=HOLD, half_width=0.05, half_height=0.03)
RUNAWAY = (np.array([-1e3]), np.ones(1)), (np.array([-1e3]), np.ones(1))
AT_ONCE = (np.array([1e300]), np.ones(1)), (np.array([1e300]), np.ones(1))


def same(found: dict[str, Any], expected: dict[str, Any]) -> None:
    assert set(found) == set(expected)
    for name, value in expected.items():
        if value is None or isinstance(value, bool):
            assert found[name] is value, name
        else:
            assert found[name] == pytest.approx(value, rel=ROUNDING), name


@pytest.mark.parametrize("path", [SHORT, LINE, LOOPS], ids=lambda path: path.shape)
@pytest.mark.parametrize("law", ["none", "jump", "simulink"])
def test_figures_are_those_of_the_recorded_motion(path: Trajectory, law: str) -> None:
    ref, chosen = reference(path, PLANT.parameters), setting(law)
    controllers = [TUNED_IDEAL[name] for name in ("line", "circle")]
    motions = closed_loop(PLANT, chosen, ref, controllers, energy=False)
    for hold in (0.0, HOLD):
        for found, motion in zip(
            measure(PLANT, chosen, ref, controllers, hold), motions, strict=True
        ):
            same(found, measures(motion, ref, hold))
            assert motion.diverged is None


def test_diverged_runs_are_measured_up_to_their_end() -> None:
    ref, chosen = reference(SHORT, PLANT.parameters), setting("none")
    ref = replace(ref, joint=ref.joint + np.linspace(0.0, 0.1, len(ref.joint))[:, None])
    controllers = [RUNAWAY, TUNED_IDEAL["circle"], AT_ONCE]
    motions = closed_loop(PLANT, chosen, ref, controllers, energy=False)
    found = measure(PLANT, chosen, ref, controllers, HOLD)
    assert [each["diverged"] for each in found] == [True, False, True]
    for one, motion in zip(found, motions, strict=True):
        same(one, measures(motion, ref, HOLD))
    assert found[0]["index"] == np.inf and found[0]["growth"] is None
    assert found[2]["peak_torque_1"] > 1e280  # the torque that ended it counts


def test_measuring_changes_no_bit_of_a_run() -> None:
    ref, chosen = reference(SHORT, PLANT.parameters), setting("jump")
    plain = evaluate(PLANT, chosen, ref, [TUNED_IDEAL["circle"]], stride=1)
    measured = evaluate(
        PLANT, chosen, ref, [TUNED_IDEAL["circle"]], stride=1, yard=yardstick(ref, HOLD)
    )
    np.testing.assert_array_equal(measured.states, plain.states)
    np.testing.assert_array_equal(measured.indices, plain.indices)
    assert plain.sums.shape == (1, 0) and measured.sums.shape == (1, SUMS)


def envelope(tip: np.ndarray, points: np.ndarray) -> float:
    """Return the envelope half-width as a run adds it up."""
    yard = yardstick(Reference(1e-3 * np.arange(len(points)), points, points))
    sums, waiting = np.zeros(SUMS), np.empty((WAITING_MOST, 4))
    for k, (x, y) in enumerate(tip):
        error = float(np.sum((tip[k] - points[k]) ** 2))
        add_to_envelope(yard, sums, waiting, k, x, y, error)
        if sums[WAITING] == WAITING_MOST:
            settle(yard, sums, waiting)
    settle(yard, sums, waiting)
    return float(np.sqrt(sums[ENVELOPE]))


@given(
    seed=st.integers(0, 2**16),
    count=st.integers(2, 400),
    kind=st.sampled_from(["walk", "curve", "still", "scattered", "back"]),
    size=st.sampled_from([1e-6, 1e-3, 0.05, 1.0]),
)
def test_the_envelope_is_exact_for_any_path(seed: int, count: int, kind: str, size: float) -> None:
    """Paths that cross themselves, stand still, go back or jump; responses near them or not."""
    rng, s = np.random.default_rng(seed), np.linspace(0, 1, count)
    points = {
        "walk": np.cumsum(rng.normal(0, 1e-2, (count, 2)), axis=0),
        "curve": np.stack([np.sin(7 * s**3), np.sin(11 * s**3)], axis=-1),
        "still": np.tile([0.3, 0.4], (count, 1)),
        "scattered": rng.random((count, 2)),
        "back": np.stack([np.abs(s - 0.5), 0 * s], axis=-1),
    }[kind]
    tip = points + size * np.cumsum(rng.normal(0, 0.1, (count, 2)), axis=0)
    late = points[np.maximum(np.arange(count) - 17, 0)] + size * rng.normal(0, 1, (count, 2))
    for response in (tip, late):
        assert envelope(response, points) == pytest.approx(
            envelope_half_width(response, points), rel=ROUNDING
        )


@pytest.mark.parametrize("hold", [-1.0, np.nan, np.inf])
def test_a_hold_that_is_none_is_refused(hold: float) -> None:
    with pytest.raises(ParameterError, match="hold is"):
        measure(PLANT, setting("none"), reference(SHORT, PLANT.parameters), [RUNAWAY], hold)
