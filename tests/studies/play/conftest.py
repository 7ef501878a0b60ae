"""One stage for all: our circle on a bench."""

from __future__ import annotations

import pytest

from controllers import TUNED
from flexsim import Robot, reference, setting, trajectory
from flexsim.loop.hardware import HARDWARE
from studies.play.live import Stage


@pytest.fixture(scope="session")
def bench_stage() -> Stage:
    chosen, robot = setting("simulink", HARDWARE["bench"]), Robot()
    modes, chain = robot.both(chosen)
    ref = reference(trajectory("circle"), robot.parameters)
    return Stage(modes, chain, chosen, TUNED["circle"], ref)
