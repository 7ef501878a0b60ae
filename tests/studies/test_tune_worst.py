"""Tuning for the worst: plants, hardware, payloads, a long hold, effort; what grows is rejected."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from flexsim import ParameterError, reference, setting, trajectory
from flexsim.linear.exact_loop import exact_growth, exact_loops
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.runs import measure
from studies.main import main
from studies.tuning.distributions import TABLE_1
from studies.tuning.genetic import GeneticSettings, Scores, ranking
from studies.tuning.peers import PENALTY, run_cma
from studies.tuning.problem import problem_of
from studies.tuning.tuning import Tuning

HELD = np.array(  # TUNED_IDEAL["circle"] of the ideal loop, as a tuner draws it
    [
        *(12421.64370624384, 0.379892247168798, 0.5438874313335464, -0.010594864325105762),
        *(-0.19317005163516937, 129.83655059369727, 0.17440244040252262, 1.1797260671003114),
        *(-0.07772924172821044, -0.10291204159143687),
    ]
)
SEVERAL = ("--hardware", "ideal", "delayed", "--payloads", "0", "0.02", "--exact")
SMALL = ("--population", "8", "--survivors", "3", "--generations", "3", "--patience", "3")


def index(tuning, individual=HELD):
    return float(problem_of(tuning)(individual[None]).indices[0])


def test_the_worst_of_plants_hardware_and_payloads_counts():
    tuning = Tuning(
        trajectory="circle",
        setting="none",
        plant=("assumed-modes", "rigid"),
        hardware=("ideal", "bench"),
        hardware_delay=0,
        payloads=(0.0, 0.02),
    )
    problem = problem_of(tuning)
    named = [
        (plant.name, its.hardware.counts, plant.parameters.payload)
        for plant, its in problem.scenarios
    ]
    assert len(set(named)) == len(named) == 8
    alone = [
        index(replace(tuning, plant=plant, hardware=hardware, payloads=(payload,)))
        for plant in tuning.plants
        for hardware in tuning.hardwares
        for payload in tuning.payloads
    ]
    assert len(set(alone)) == 8 and np.isfinite(alone).all()
    assert index(tuning) == max(alone)


def test_what_grows_on_the_exact_loop_is_rejected_unseen():
    tuning = Tuning(trajectory="circle", exact=True, hardware=("ideal", "delayed"))
    problem = problem_of(tuning)
    scores = problem(HELD[None])
    (pair,) = problem.design.filters(HELD[None])
    loops = exact_loops(problem.scenarios[0][0].parameters, hardware=HARDWARE["delayed"])
    grown = exact_growth(loops, stack([pair], tuning.period))[0]
    assert scores.growth[0] >= np.round(grown, 6) > 40
    assert scores.growth[0] == pytest.approx(np.round(scores.growth[0], 6), abs=1e-12)
    assert np.isinf(scores.indices[0]) and scores.diverged[0] == 0.0
    ideal = problem_of(replace(tuning, hardware="ideal"))(HELD[None])
    assert ideal.growth[0] == 0.0 and ideal.indices[0] == index(Tuning(trajectory="circle"))


def test_every_payload_and_slope_of_friction_has_its_exact_loops():
    tuning = Tuning(exact=True, payloads=(0.0, 0.05), hardware=("ideal", "delayed"))
    loops = problem_of(tuning).exact
    assert len(loops) == 2 * 2 * 2 * 3  # payloads, hardware, torque gains, poses
    assert len({loop.options.torque_gain for loop in loops}) == 2
    assert len(problem_of(replace(tuning, setting="none")).exact) == 2 * 2 * 3
    more = problem_of(replace(tuning, setting="none", exact_spread=0.2, exact_payload=0.03)).exact
    assert len(more) == (2 + 2 + 1) * 2 * 3


def test_viscous_friction_opposing_the_joints_counts():
    """Under 'opposing' the torque passes and the joints are damped, which can make a loop grow."""
    loops = problem_of(Tuning(exact=True, setting="opposing")).exact
    mu = setting("opposing").friction.mu
    assert {loop.options.joint_damping for loop in loops} == {(0.0, 0.0), mu}
    assert {loop.options.torque_gain for loop in loops} == {(1.0, 1.0)} and len(loops) == 2 * 3


def test_a_stiffer_beam_can_be_what_grows():
    edge = HELD.copy()
    edge[5] *= 1.5  # of joint 2's gain: near its margin
    nominal, stiffer = (
        problem_of(Tuning(exact=True, setting="none", exact_spread=spread))(edge[None]).growth[0]
        for spread in (0.0, 0.3)
    )
    assert nominal == 0.0 and stiffer > 0.1


def test_a_long_hold_takes_the_v_that_is_left_and_what_is_lost_in_it():
    slow = Tuning(
        trajectory="circle", setting="none", plant="assumed-modes", long_hold=8.0, residual=0.1
    )
    plant, _ = problem_of(slow).scenarios[0]
    path = replace(trajectory("circle"), hold=slow.long_hold)
    ref = reference(path, plant.parameters)
    growing = HELD.copy()
    growing[5] *= 1.56  # just beyond joint 2's gain margin
    both = np.vstack([growing, HELD])
    found = measure(plant, setting("none"), ref, slow.design.filters(both), hold=4.0)
    assert found[0]["growth"] > 0.1 and found[0]["residual_v"] > 5 * found[1]["residual_v"]
    short = [index(replace(slow, long_hold=0.0), each) for each in both]
    wanted = [one + 0.1 * each["residual_v"] for one, each in zip(short, found, strict=True)]
    assert problem_of(slow)(both).indices.tolist() == pytest.approx(wanted, rel=1e-9)
    lost = HELD * np.where(np.arange(10) == 5, 1.6, 1.0)
    assert np.isfinite(index(replace(slow, long_hold=0.0), lost)) and np.isinf(index(slow, lost))


def test_effort_adds_the_torques_total_variation():
    tuning = Tuning(trajectory="circle")
    problem = problem_of(tuning)
    plant, its = problem.scenarios[0]
    (pair,) = problem.design.filters(HELD[None])
    (found,) = measure(plant, its, problem.reference, [pair])
    variation = found["variation_1"] + found["variation_2"]
    plain, weighed = index(tuning), index(replace(tuning, effort=1e-8))
    assert variation > 10 and weighed - plain == pytest.approx(1e-8 * variation, rel=1e-9)


def test_v_enters_the_loops_as_it_is_told():
    tuning = Tuning(trajectory="circle", exact=True, long_hold=2.0, v_gain=0.0)
    problem = problem_of(tuning)
    plant, its = problem.scenarios[0]
    (pair,) = problem.design.filters(HELD[None])
    (found,) = measure(plant, its, problem.reference, [pair], v_gain=0.0)
    assert index(tuning) == found["index"] != index(replace(tuning, v_gain=-1.0))
    assert {loop.options.v_gain for loop in problem.exact} == {0.0}
    true_tip = problem_of(replace(tuning, v_gain=1.0))(HELD[None])
    assert true_tip.growth[0] > 1 and np.isinf(true_tip.indices[0])
    unseen = problem_of(replace(tuning, exact=False, long_hold=0.0, v_gain=1.0))(HELD[None])
    assert np.isinf(unseen.indices[0])


def test_the_rejected_rank_last_by_their_growth():
    indices = np.array([np.inf, 2.0, np.inf, np.inf, 1.0])
    growth = np.array([3.0, 0.0, 0.5, 0.0, 0.0])
    assert ranking(indices, growth).tolist() == [4, 1, 3, 2, 0]


def test_cma_goes_down_the_growth_of_the_rejected():
    def evaluate(parameters):
        nu = np.abs(parameters[:, 1] - 5.0)  # Table 1 hardly draws it
        held = nu < 0.5
        none = np.zeros(len(nu))
        return Scores(np.where(held, nu, np.inf), none, np.where(held, 0.0, nu))

    found = run_cma(evaluate, TABLE_1, GeneticSettings(population=10, generations=40), 1)
    assert found.best_index < 0.5 < PENALTY


@pytest.mark.slow
def test_a_run_of_several_can_be_read_and_continued(tmp_path, capsys):
    run = tmp_path / "run"
    words = ["tune", "--trajectory", "circle", *SEVERAL, *SMALL, "--out", str(run)]
    assert main(words) == 0
    text = (run / "generations.csv").read_bytes()
    rows = list(csv.DictReader(text.decode().splitlines()))
    assert any(float(row["growth"]) > 0 for row in rows)
    kept = json.loads((run / "config.json").read_text())["configuration"]
    assert kept["hardware"] == ["ideal", "delayed"] and kept["payloads"] == [0.0, 0.02]
    (run / "generations.csv").write_bytes(b"".join(text.splitlines(True)[: 1 + 8 + 3]))
    assert main(["tune", "--resume", str(run)]) == 0
    assert (run / "generations.csv").read_bytes() == text
    capsys.readouterr()
    assert main(["tune", "--resume", str(run), "--payloads", "0.3"]) == 2
    assert "payloads" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"hardware": ("ideal", "ideal")}, "once"),
        ({"plant": ()}, "empty"),
        ({"payloads": (-0.1,)}, "0 or more"),
        ({"payloads": ()}, "one or more"),
        ({"long_hold": -1.0}, "long hold"),
        ({"long_hold": float("nan")}, "long hold"),
        ({"effort": -1.0}, "effort"),
        ({"v_gain": float("nan")}, "v gain"),
        ({"residual": -1.0}, "residual"),
        ({"hardware": "lab"}, "unknown"),
    ],
)
def test_what_no_tuning_can_have_is_refused(change, words):
    with pytest.raises(ParameterError, match=words):
        Tuning(**change)


def test_an_exact_loop_needs_the_beam_of_the_equations():
    with pytest.raises(ParameterError, match="--modal-damping"):
        problem_of(Tuning(exact=True, modal_damping=(0.01, 0.01, 0.01)))
    with pytest.raises(ParameterError, match="--mjcf"):
        problem_of(Tuning(exact=True, mjcf="models/chain6.xml"))
