"""Friction's numbers are found again: of every law, of its temperature, and the paper's way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flexsim import Robot, drive, setting
from flexsim.loop.hardware import HARDWARE, overridden
from flexsim.loop.settings import Setting
from studies.experiment.synthetic import logged, sigmas
from studies.experiment.torques import Band, shapes
from studies.identify.estimates import LEAST_SQUARES, Search, identified, left_one_out, predicted
from studies.identify.fit import fit
from studies.identify.names import free_numbers, robot_with, setting_with
from studies.identify.records import Record
from studies.identify.residuals import Problem
from studies.identify.simulated import Model
from studies.tuning.genetic import GeneticSettings

PERIOD = 1e-3
THETA = (0.0, 1.2)
EXACT = 1e-4  # relative, of exact logs of the same model, whose torques friction's edges cut
BY_GENES = {  # relative, where thirty generations end; mu_1 is told by the strong pulse alone
    **{"friction.tau_0_1": 0.05, "friction.mu_1": 0.3, "friction.dead_zone_2_high": 0.05},
}
BENCH = HARDWARE["bench"]


def torque(kind: str, duration: float, first: float, second: float) -> Any:
    time = PERIOD * np.arange(round(duration / PERIOD), dtype=float)
    return shapes(kind, time, Band(2.0, 12.0)) * np.array([first, second])


def record_of(
    chosen: Setting, values: dict[str, float], tau: Any, rates: Any = None, EI: float = 0.349
) -> Record:
    made = setting_with(chosen, values)
    plant = robot_with(Robot(), {"EI": EI}).plant("assumed-modes", made)
    state = plant.rest_state(THETA)
    if rates is not None:
        state[len(state) // 2 :][:2] = rates
    return logged(drive(plant, made, tau, PERIOD, state=state), tau, PERIOD)


def problem_of(chosen: Setting, names: Any, *records: Record, start: str = "rest") -> Problem:
    model = Model(Robot(), "assumed-modes", chosen, free_numbers(list(names), Robot(), chosen))
    return Problem(model, records, tuple(map(sigmas, records)), start, 2)


@pytest.mark.parametrize(
    ("law", "truth", "hardware"),
    [
        ("opposing", {"tau_0_1": 4.8, "mu_2": 0.9, "speed": 0.03}, ()),
        pytest.param(
            "opposing",
            {"cold_1": 0.2, "warming_1": 0.5},
            ("cold=0.1,0", "warming=1,1"),
            marks=pytest.mark.slow,  # a loop of its own to compile, and three times as long
        ),
        pytest.param(
            "stribeck",
            {"tau_0_1": 4.3, "stiction_1": 1.2, "stribeck": 0.15},
            (),
            marks=pytest.mark.slow,  # lugre has these numbers, too
        ),
        ("lugre", {"sigma_0_1": 1800.0, "sigma_1_1": 24.0, "tau_0_1": 4.3}, ()),
    ],
)
def test_numbers_of_a_law_are_found_again(
    law: str, truth: dict[str, float], hardware: tuple[str, ...]
) -> None:
    chosen = setting(law, overridden("ideal", hardware_with=hardware))
    values = {f"friction.{name}": value for name, value in truth.items()}
    record = record_of(chosen, values, torque("step", 0.5, 9.5, 2.0))
    found = fit(problem_of(chosen, values, record), starts=1, seed=1)
    for each, at in zip(found.problem.model.free, found.z, strict=False):
        assert each.value(at) == pytest.approx(values[each.name], rel=EXACT), each.name


def test_the_papers_way_finds_the_papers_law() -> None:
    """Its genetic algorithm, on the model's responses to steps and impulses, of (47)."""
    chosen = setting("simulink", BENCH)
    truth = {"friction.tau_0_1": 4.1, "friction.mu_1": 0.31, "friction.dead_zone_2_high": 0.75}
    pulses = [torque("impulse", 0.4, size, 0.9) for size in (4.0, 9.0)]
    records = [record_of(chosen, truth, each) for each in (torque("step", 0.4, 3.3, 0.8), *pulses)]
    problem = problem_of(chosen, truth, *records)
    found = identified(problem, Search("genetic", 1, 1, GeneticSettings(50, 30)), "")
    for row in found.rows:
        assert row.low <= truth[row.name] <= row.high and row.search > 0, row
        assert row.value == pytest.approx(truth[row.name], rel=BY_GENES[row.name]), row
    assert found.evaluations is not None and found.evaluations <= 50 * 31


def test_joints_that_move_at_first_are_found_moving() -> None:
    chosen = setting("none", BENCH)
    record = record_of(chosen, {}, torque("multisine", 1.0, 0.2, 0.04), rates=(0.3, -0.5))
    found = fit(problem_of(chosen, ["EI"], record, start="moving"), starts=1, seed=1)
    assert found.z[0] == pytest.approx(0.0, abs=1e-3)  # EI is the robot's own
    assert found.z[3:5] == pytest.approx([0.3, -0.5], abs=0.01)
    still = fit(problem_of(chosen, ["EI"], record), starts=1, seed=1)
    assert still.residuals.std() == pytest.approx(1.0, abs=0.1)  # in noises of what it leaves
    sizes = [fit.problem.sigmas[0][:2] for fit in (still, found)]
    assert np.all(sizes[0] > 20 * sizes[1])  # [rad], of the joints


def test_logs_of_another_arm_are_not_predicted() -> None:
    """Without noise, of which a joint that hardly moves has much."""
    chosen, search = setting("none"), Search(LEAST_SQUARES, 1, 1, GeneticSettings())
    taus = [torque("multisine", 0.6, size, 0.2 * size) for size in (0.2, 0.25)]
    records = [record_of(chosen, {}, each) for each in taus]
    problem = problem_of(chosen, ["EI", "I_R0"], *records)
    found = identified(problem, search, "")
    inside = left_one_out(found.found.problem, search, found.found.z[:2])
    stiffer = record_of(chosen, {}, torque("multisine", 0.6, 0.2, 0.04), EI=0.40)
    own = problem_of(chosen, ["EI", "I_R0"], stiffer)
    (outside,) = predicted(problem.model, found.values, own)
    assert len(inside) == 2 and all(outside.relative > 3 * row.relative for row in inside)
