"""Ranges of knobs in which controllers hold, in the loop itself."""

import numpy as np
import pytest

from controllers.shaped import FORMS
from flexsim.linear.linearise import linearise
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.runs import evaluate
from flexsim.loop.settings import DEFAULT_SETTING, setting
from flexsim.loop.trajectories import CIRCLE, reference
from flexsim.numerics.clocks import PERIOD
from flexsim.robot import Robot

DRAWS = 100
LEAST = 3  # of them: 6 and more are expected, see `controllers.shaped`


@pytest.mark.parametrize("name", FORMS)
def test_random_draws_hold(name):
    bench = setting(DEFAULT_SETTING, HARDWARE["bench"])
    plant = Robot().plant("assumed-modes:5", bench)
    path = reference(CIRCLE, plant.parameters, PERIOD)
    middle = (path.joint[:, 1].min() + path.joint[:, 1].max()) / 2
    inertias = np.diag(linearise(plant, float(middle)).M)[:2]
    knobs = FORMS[name].KNOBS
    ends = [np.array([getattr(each, end) for each in knobs]) for end in ("low", "high")]
    drawn = np.random.default_rng(1).uniform(*ends, (DRAWS, len(knobs)))
    built = [FORMS[name].design(each.tolist(), inertias, PERIOD) for each in drawn]
    held = np.isnan(evaluate(plant, bench, path, built, v_gain=0.0).diverged)
    assert held.sum() >= LEAST
    assert not held.all()  # the ranges are wider than what holds
