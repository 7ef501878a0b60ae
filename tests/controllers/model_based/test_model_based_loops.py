"""The model-based controllers in the simulated loop: bench, friction, five modes and the chain."""

import numpy as np
import pytest
from designs import BENCH, PERIOD, arm_model

from controllers.model_based import lqg, middle, mixed_sensitivity, pd_strain
from flexsim import Robot, evaluate, reference, setting, trajectory

pytestmark = pytest.mark.slow  # compiles the loops of two plants


@pytest.mark.parametrize("plant", ["assumed-modes:5", "closed-chain"])
def test_each_holds_on_a_path_in_the_middle_of_its_ranges(plant: str) -> None:
    model, chosen, robot = arm_model(), setting("simulink", BENCH), Robot()
    designs = (pd_strain, lqg, mixed_sensitivity)
    built = [each.design(middle(each.KNOBS), model) for each in designs]
    wrong = built[1][0], built[1][1], -built[1][2], -built[1][3]  # pushes away: a check that fails
    path = reference(trajectory("line"), robot.parameters, PERIOD)
    found = evaluate(robot.plant(plant, chosen), chosen, path, [*built, wrong], v_gain=0.0)
    assert np.isnan(found.diverged[:3]).all() and np.isfinite(found.diverged[3])
