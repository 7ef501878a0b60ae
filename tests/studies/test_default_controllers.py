"""The default controllers are what they are said to be: they hold on a bench, and a bit beyond."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controllers import TUNED, TUNED_IDEAL, Controller
from flexsim import Parameters, Robot, setting, trajectory
from flexsim.linear.exact_loop import NO_FRICTION, exact_growth, exact_loops
from flexsim.linear.growth import quantised
from flexsim.linear.loop_poles import small_signal
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE
from studies.core.evidence.holding import holding
from studies.core.evidence.repeats import perturbed

PERIOD = 1e-3
ROBOT = Parameters()
SLOPE = small_signal(setting("simulink").friction)
SETS = pytest.mark.parametrize("controller", TUNED.values(), ids=lambda each: each.name)


def growth(controller: Controller, robot: Parameters = ROBOT, delays: tuple[int, ...] = (0, 1)):
    loops = exact_loops(robot, delays=delays, slopes=(NO_FRICTION, SLOPE))
    return float(quantised(exact_growth(loops, stack([controller], PERIOD)))[0])


@SETS
def test_they_do_not_grow_with_a_sample_of_delay_or_without(controller):
    assert growth(controller) <= 0


@SETS
@pytest.mark.parametrize(
    "change", [{"EI": 0.8 * ROBOT.EI}, {"EI": 1.2 * ROBOT.EI}, {"payload": 0.05}], ids=str
)
def test_nor_on_other_beams(controller, change):
    assert growth(controller, replace(ROBOT, **change)) <= 0


@SETS
def test_a_second_sample_or_no_damping_is_too_much(controller):
    """What limits them: said in the documents, and so not to be forgotten."""
    assert growth(controller, delays=(2,)) > 10
    assert 0.5 < growth(controller, replace(ROBOT, zeta=0.0), delays=(0,)) < 1.5


@pytest.mark.parametrize("controller", TUNED_IDEAL.values(), ids=lambda each: each.name)
def test_those_of_the_ideal_loop_bear_no_delay(controller):
    assert growth(controller, delays=(0,)) <= 0 and growth(controller, delays=(1,)) > 40


def test_the_lines_loop_holds_on_a_bench():
    chosen = setting("simulink", HARDWARE["bench"])
    plant, own = Robot().modes_plant(chosen), TUNED["line"]
    again = perturbed(own, 39, np.random.default_rng(1))
    found = holding(plant, chosen, trajectory("line"), own, PERIOD, Robot(), repeats=again)
    assert found.holds and found.ratio_runs == 40 and found.delay_margin > 1e-4
