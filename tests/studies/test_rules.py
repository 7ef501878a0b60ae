"""The study of designs by rule: what it shows, against the rules and the linear loop; refusals."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from quick_run import QuickRun

from controllers.rules import RULES, RigidJoint
from flexsim.linear.linearise import linearise
from flexsim.linear.loop_poles import LinearLoop, LoopOptions, linear_loop, sampled_plant
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE
from flexsim.robot import Robot
from studies.main import main
from studies.rules.loops import curves_of, rigid_crossing
from studies.rules.rules import RulesConfig, dead_time, inertias_of, middle, run

PERIOD, POSE = 1e-3, 1.2
SAME = 1e-6  # relative: two ways to one response


@pytest.fixture(scope="module")
def loop() -> LinearLoop:
    """The flat-phase design's loop on five modes."""
    plant = Robot().plant("assumed-modes:5")
    pair = RULES["flat-phase"].design([30.0, 0.8, 40.0, 0.9], inertias_of(plant, POSE), PERIOD)
    options = LoopOptions(v_gain=0.0, hardware=HARDWARE["bench"])
    return linear_loop(plant, POSE, stack([pair], PERIOD), options)


def test_inertias_are_the_rigid_arms() -> None:
    plant = Robot().plant("assumed-modes:5")
    M = linearise(plant, POSE).M
    assert inertias_of(plant, POSE) == pytest.approx((M[0, 0], M[1, 1]), rel=1e-12)
    rigid = Robot().plant("rigid")
    assert inertias_of(rigid, POSE) == pytest.approx(inertias_of(plant, POSE), rel=1e-9)


def test_the_dead_time_is_the_holds_and_the_computers() -> None:
    assert dead_time(RulesConfig()) == 0.5e-3
    assert dead_time(RulesConfig(hardware="bench")) == 1.5e-3


def test_curves_are_the_loops_own_response(loop: LinearLoop) -> None:
    curves = curves_of("any", loop)
    for joint in (0, 1):
        A, B, C = loop.broken_at(joint)
        for k in (0, 500, 1100):
            z = np.exp(1j * curves.omega[k] * PERIOD)
            expected = C @ np.linalg.solve(z * np.eye(len(A)) - A, B)
            assert curves.loops[joint, k] == pytest.approx(expected, rel=SAME)


def test_a_step_is_the_simulated_loops_and_arrives(loop: LinearLoop) -> None:
    """It ends at one, and begins with the controller's own torque on the plant."""
    curves = curves_of("any", loop)
    assert curves.steps[0, -1] == pytest.approx(1.0, abs=0.02)
    first = loop.controllers.chosen(slice(0, 1))
    torque = sum(  # of the sections, at the first sample of a unit error
        np.prod(first.b[0, 0, k, :, 0]) for k in range(first.b.shape[2])
    )
    late = 1 + loop.sampled.options.hardware.delay
    plant = sampled_plant(Robot().plant("assumed-modes:5"), POSE, LoopOptions(v_gain=0.0))
    expected = -plant.C[0] @ plant.B[:, 0] * torque
    assert np.abs(curves.steps[0, :late]).max() == 0.0
    assert curves.steps[0, late] == pytest.approx(expected, rel=SAME)


def test_a_rigid_crossing_is_found() -> None:
    joint = RigidJoint(0.3, 1.5e-3)
    pair = RULES["five"].design([30.0, 0.8, 30.0, 0.8], (0.3, 0.3), PERIOD, joint.delay)
    omega, margin = rigid_crossing(pair[0], joint, PERIOD)
    assert omega == pytest.approx(30.0, rel=1e-4) and margin == pytest.approx(0.8, abs=0.03)
    weak = RULES["five"].design([30.0, 0.8, 30.0, 0.8], (1e-9, 1e-9), PERIOD, joint.delay)
    assert rigid_crossing(weak[0], joint, PERIOD) == (None, None)


def test_on_the_rigid_plant_loops_are_what_the_rules_say() -> None:
    """Joint 2 of the rigid arm is coupled to joint 1 only: its margin is the designed one."""
    result = run(RulesConfig(rule=("lead",), plant="rigid", theta2=math.pi / 2))
    for design, on_plant in zip(result.designs, result.loops, strict=True):
        assert on_plant.growth <= 0
        assert on_plant.phase == pytest.approx(design.phi_m, abs=0.1)
        assert on_plant.omega_phase == pytest.approx(design.omega_c, rel=0.1)


def test_the_study_writes_a_run_that_explains_itself(quick: Callable[[str], QuickRun]) -> None:
    run = quick("rules")
    assert [row["rule"] for row in run.content["rows"]] == ["flat-phase"] * 2
    assert run.figures == {"bode.png", "step.png"}
    assert run.faults() == []
    assert {"designs.csv", "results.csv"} <= run.files
    numbers = run.content["numbers"][0]
    knobs = middle(RULES["flat-phase"].knobs)[:2]
    assert list(numbers["knobs"].values()) == pytest.approx(knobs)
    inertia = run.content["designs"][0]["inertia"]
    expected = RULES["flat-phase"].numbers(knobs, inertia, PERIOD, 0.5e-3)
    assert numbers["design"] == pytest.approx(expected)
    assert "near rest: 1 of 1 (flat-phase)" in run.text
    assert "Designs for assumed-modes:5" in run.text
    said = json.loads((run.folder / "config.json").read_text())
    assert said["question"].endswith("?") and said["dead_time"] == 0.5e-3


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("--rule nonsense", "valerio-s"),
        ("--rule lead lead", "name each once"),
        ("--knobs 30 0.8 30 0.8", "name it with --rule"),
        ("--rule flat-phase --knobs 30 0.8", "give 4 knobs"),
        ("--rule flat-phase --knobs 30 3.1 30 0.8", "no order|of lead"),
        ("--rule valerio-s --knobs 20 0.002 20 0.5", "outside"),
        ("--rule lead --theta2 1 --trajectory line", "contradict"),
        ("--rule lead --trajectory square", "two-loop"),
        ("--rule lead --plant nonsense", "nonsense"),
        ("--rule lead --arm one-link --theta2 1.0", "stands still"),
    ],
)
def test_what_a_rule_is_not_for_is_one_line_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: str, named: str
) -> None:
    assert main(["rules", *words.split(), "--out", str(tmp_path / "run")]) == 2
    complaint = capsys.readouterr().err
    assert re.search(named, complaint) and complaint.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
