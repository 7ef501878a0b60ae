"""The exact linear loop: converged in its modes, alike at any rounding, what simulations show."""

from dataclasses import replace

import numpy as np
import pytest
from trial_controllers import TRIAL

from controllers import TUNED_IDEAL, textbook_pid
from flexsim import ParameterError, Parameters
from flexsim.arm.parameters import paper
from flexsim.linear.exact_loop import (
    CONVERGED,
    EXACT_MODES,
    EXACT_POSES,
    exact_growth,
    exact_loops,
    exact_plant,
    exact_sampled,
)
from flexsim.linear.growth import QUANTUM, quantised
from flexsim.linear.loop_poles import LoopOptions, linear_loop, sampled_plant
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import Hardware
from flexsim.plants.modes_plant import AssumedModesPlant

PERIOD = 1e-3
MANY = 20  # modes
CONTROLLERS = stack([*TUNED_IDEAL.values(), *TRIAL.values()], PERIOD)
SIMULATED = 1e-3  # relative: 5 modes at 0.125 ms against 12 under exact hold


@pytest.mark.parametrize("robot", [Parameters(), paper(), Parameters(payload=0.05)])
def test_twelve_modes_are_enough(robot: Parameters) -> None:
    few, many = (
        exact_growth(exact_loops(robot, EXACT_POSES, (0, 1), modes=n), CONTROLLERS)
        for n in (EXACT_MODES, MANY)
    )
    assert np.all(np.abs(few - many) < CONVERGED * (1 + np.abs(many)))


def test_growth_is_the_worst_over_poses_delays_and_gains() -> None:
    gains = ((1.0, 1.0), (0.3, 1.5))
    slopes = [(gain, (0.0, 0.0)) for gain in gains]
    loops = exact_loops(Parameters(), (0.8, 2.2), (0, 2), slopes, hardware=Hardware(lag=1e-4))
    assert len(loops) == 8
    one = stack([TUNED_IDEAL["line"]], PERIOD)
    each = [
        linear_loop(
            exact_plant(Parameters()),
            pose,
            one,
            LoopOptions(torque_gain=gain, hardware=Hardware(delay=delay, lag=1e-4)),
        ).growth_rate
        for pose in (0.8, 2.2)
        for delay in (0, 2)
        for gain in gains
    ]
    assert exact_growth(loops, one)[0] == pytest.approx(max(each), abs=1e-9)


def test_two_joint_loops_that_ignore_v_are_passive() -> None:
    """PDs on the joints' own angles cannot make any mode grow; on the true tip they do."""
    pds = [(textbook_pid(k, 0.0, 0.02 * k, PERIOD),) * 2 for k in (0.5, 2.0, 5.0)]
    controllers = stack(pds, PERIOD)
    ignored, true, mirrored = (
        exact_growth(exact_loops(Parameters(), v_gain=v_gain), controllers)
        for v_gain in (0.0, 1.0, -1.0)
    )
    assert np.all(ignored < 0)
    assert np.all(true > 0.5)
    assert mirrored == pytest.approx(exact_growth(exact_loops(Parameters()), controllers), abs=0)


def test_undamped_a_mode_grows_that_three_modes_do_not_have() -> None:
    """Joint-free mode 5 at 191.6 Hz, 1.46 to 1.54 1/s, as an independent beam showed."""
    controllers = stack(list(TUNED_IDEAL.values()), PERIOD)
    growth = exact_growth(exact_loops(paper()), controllers)
    assert np.all((growth > 1.4) & (growth < 1.6))
    fastest = linear_loop(exact_plant(paper()), 1.5, controllers.chosen(slice(1))).poles[0]
    assert abs(np.angle(fastest)) / PERIOD / (2 * np.pi) == pytest.approx(191.6, abs=0.3)
    assert np.all(exact_growth(exact_loops(paper(), modes=3), controllers) < 0)


def test_it_is_what_fine_steps_converge_on() -> None:
    fine = AssumedModesPlant(paper(), 5, PERIOD / 8)
    one = stack([TUNED_IDEAL["circle"]], PERIOD)
    stepped = linear_loop(fine, 1.5, one, LoopOptions(hold="stepped")).growth_rate
    coarse = linear_loop(AssumedModesPlant(paper(), 5), 1.5, one, LoopOptions(hold="stepped"))
    five = exact_growth(exact_loops(paper(), (1.5,), modes=5), one)[0]
    assert stepped == pytest.approx(five, rel=SIMULATED)
    assert coarse.growth_rate < 0.1 < five  # steps of 1 ms hide it


def test_rounding_decides_nothing() -> None:
    """States in other units and another order: other roundings, the same multiples."""
    rng = np.random.default_rng(1)
    loops = exact_loops(Parameters(), (1.5,))
    growth = exact_growth(loops, CONTROLLERS)
    for _ in range(5):
        changed = []
        for each in loops:
            n = len(each.A)
            T = np.diag(10.0 ** rng.uniform(-2, 2, n))[rng.permutation(n)]
            back = np.linalg.inv(T)
            changed.append(replace(each, A=T @ each.A @ back, B=T @ each.B, C=each.C @ back))
        other = exact_growth(changed, CONTROLLERS)
        assert np.abs(other - growth).max() < QUANTUM / 4
    assert quantised(growth) / QUANTUM == pytest.approx(np.round(growth / QUANTUM))


def test_quantised_growth() -> None:
    found = quantised([-np.inf, np.inf, 1.2345678, -0.0120865966, 4e-7])
    assert found == pytest.approx([-np.inf, np.inf, 1.234568, -0.012087, 0.0], abs=1e-12)
    assert quantised(3e-7 + 0.5) == quantised(0.5)
    assert quantised(2e-6) > quantised(1e-6)


def test_plants_are_computed_once() -> None:
    options = LoopOptions(hold="stepped")
    first = exact_sampled(Parameters(), 1.1, options)
    assert exact_sampled(Parameters(), 1.1, options) is first
    exact = sampled_plant(exact_plant(Parameters()), 1.1, LoopOptions())
    assert first.A == pytest.approx(exact.A, abs=1e-12)


def test_what_cannot_be_used_is_refused() -> None:
    with pytest.raises(ParameterError, match="theta2"):
        exact_loops(Parameters(), (np.nan,))
    with pytest.raises(ParameterError, match="number of modes"):
        exact_loops(Parameters(), (1.0,), modes=1000)
    with pytest.raises(ParameterError, match="delay"):
        exact_loops(Parameters(), (1.0,), (-1,))
