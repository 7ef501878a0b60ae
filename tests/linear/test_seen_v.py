"""Bridges and estimators in the linear loop: its growth is the simulation's, with their memory."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from controllers import TUNED_IDEAL
from flexsim import ParameterError, Parameters, Plant
from flexsim.linear.delay_margin import late
from flexsim.linear.exact_loop import exact_loops
from flexsim.linear.loop_poles import LoopOptions, linear_loop, sampled_plant
from flexsim.linear.zeros import sampled_zeros
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE, Hardware, Sensing
from flexsim.loop.hardware.estimators import static_estimator
from flexsim.plants.modes_plant import AssumedModesPlant
from studies.stability.simulated import simulated_growth

PERIOD, POSE = 1e-3, 1.5
SIMULATED = 1e-6  # relative to the rate, or to 1/s: what a tiny nonlinear motion shows of it
PLACES = (0.025, 0.25)


def built(delay: int = 0, lag: float = 0.0, **sensing: Any) -> Hardware:
    return Hardware(delay=delay, lag=lag, sensing=Sensing(**sensing))


BUILT = {
    "static": built(estimator="two-bridges", bridge_gain=(0.02, -0.01), bridge_shift=(0.001, 0)),
    "quasi-static": built(1, estimator="quasi-static"),
    "filter": built(1, 2e-4, estimator="two-bridges", bridge_filter=1e-3),
    "kalman": built(estimator="kalman:2", kalman_pose=POSE),
    "kalman late": built(2, 3e-4, estimator="kalman:3", bridge_filter=5e-4, kalman_pose=1.0),
}


def loop_of(plant: Plant, hardware: Hardware) -> Any:
    options = LoopOptions(PERIOD, hold="stepped", hardware=hardware)
    return linear_loop(plant, POSE, stack([TUNED_IDEAL["line"]], PERIOD), options), options


@pytest.mark.parametrize("name", BUILT)
@pytest.mark.parametrize(
    "plant",
    ["assumed-modes", pytest.param("chain", marks=pytest.mark.slow)],  # a loop more to compile
    indirect=True,
)
def test_growth_is_the_simulations(name: str, plant: Plant) -> None:
    loop, options = loop_of(plant, BUILT[name])
    found = simulated_growth(plant, loop, options)
    assert found == pytest.approx(loop.growth_rate, rel=SIMULATED, abs=SIMULATED)
    same = BUILT[name]
    exact, _ = loop_of(plant, Hardware(delay=same.delay, lag=same.lag))  # v itself: another rate
    assert abs(exact.growth_rate - loop.growth_rate) > 1e-3 * abs(exact.growth_rate)


def test_a_static_estimator_is_a_row(modes_plant: AssumedModesPlant) -> None:
    loop, _ = loop_of(modes_plant, built(estimator="two-bridges"))
    J = static_estimator("two-bridges", Parameters(), PLACES, 0.0005)
    row = J @ (0.0005 * modes_plant.curvature_rows(PLACES))
    C, reach = loop.sampled.C, Parameters().reach
    assert C[2, :5] == pytest.approx(row, rel=1e-9) and not C[2, 5:].any()
    assert C[1] == pytest.approx(-np.eye(10)[1] + C[2] / reach, abs=1e-12)
    assert loop.sampled.memory == 0


def test_noise_offset_and_drift_move_no_poles(modes_plant: AssumedModesPlant) -> None:
    bench = HARDWARE["bridges"]
    one, _ = loop_of(modes_plant, bench)
    other, _ = loop_of(modes_plant, replace(bench, counts=0, sensing=bench.sensing.quiet))
    assert np.array_equal(one.matrix, other.matrix)


def test_a_later_torque_is_a_whole_sample_of_delay_where_the_filter_does_not_know_it() -> None:
    """A filter of the bridges' alone: the delay is all the same who knows of it."""
    for own in (BUILT["filter"], built(estimator="two-bridges")):
        (now,) = exact_loops(Parameters(), (POSE,), hardware=own)
        (later,) = exact_loops(Parameters(), (POSE,), hardware=replace(own, delay=own.delay + 1))
        moved = late(now, PERIOD)
        ours, theirs = (np.sort(np.abs(np.linalg.eigvals(each.A))) for each in (moved, later))
        assert ours[-20:] == pytest.approx(theirs[-20:], rel=1e-7)
        z = 0.9 + 0.3j
        one, two = (
            each.C @ np.linalg.solve(z * np.eye(len(each.A)) - each.A, each.B)
            for each in (moved, later)
        )
        assert one == pytest.approx(two, rel=1e-6)


def test_zeros_of_a_loop_with_memory_are_refused(modes_plant: AssumedModesPlant) -> None:
    options = LoopOptions(PERIOD, hardware=built(estimator="kalman:2"))
    with pytest.raises(ParameterError, match="take an estimator without memory"):
        sampled_zeros(sampled_plant(modes_plant, POSE, options))
