"""Draws screened by their linear loop: what is kept, and the study of what it saves."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from controllers import TUNED_IDEAL
from flexsim import ParameterError, setting
from flexsim.linear.growth import SLACK, extreme_poses, loop_options
from flexsim.linear.loop_poles import linear_loop
from flexsim.loop.control.stacking import stack
from studies.core.evidence.intervals import share_interval
from studies.main import main
from studies.screening.report import ScreeningResult, facts, to_target, verdict
from studies.screening.screening import Course, ScreeningConfig, row
from studies.tuning.distributions import TABLE_1
from studies.tuning.genetic import Generation, Search
from studies.tuning.problem import distribution_for, problem_of, tune
from studies.tuning.screened_draws import NearRest, Screened, Tally, screened
from studies.tuning.tuning import Tuning

HELD_LEAST = 0.9  # share of screened draws that hold in the simulation; measured: all of 50
HELD_PLAIN = 0.2  # of the plain ones; measured: 0.01
SAME_POLES = 1e-9  # relative, of eigenvalues found singly and in a batch
SMALL = (
    *("--trajectory", "circle", "--population", "8", "--survivors", "3"),
    *("--generations", "4", "--patience", "4", "--screen", "20"),
)


class Above:
    """A growth that is SLACK or less where k1 is `least` or more, and remembers who asked."""

    def __init__(self, least):
        self.least = least
        self.blocks = []

    def __call__(self, parameters):
        self.blocks.append(len(parameters))
        return SLACK + self.least - parameters[:, 0]


def of(growth, most):
    return Screened(TABLE_1.draws, growth, most)


def plain(count, seed=1):
    return TABLE_1.sample(np.random.default_rng(seed), count)


@pytest.fixture(scope="module")
def circle():
    """A tuning on the circle, its problem and its draws."""
    tuning = Tuning(trajectory="circle", screen=100)
    problem = problem_of(tuning)
    return tuning, problem, screened(tuning, distribution_for(tuning), problem)


def test_where_all_pass_the_draws_are_the_plain_ones():
    growth = Above(-math.inf)
    drawn = of(growth, 100).sample(np.random.default_rng(1), 20)
    assert np.array_equal(drawn, plain(20))
    assert growth.blocks == [20]


def test_those_that_pass_are_kept_in_the_order_of_drawing():
    growth = Above(11_000.0)  # half a standard deviation above the mean: three of ten pass
    drawn = of(growth, 100).sample(np.random.default_rng(1), 20)
    rng = np.random.default_rng(1)
    blocks = np.vstack([TABLE_1.sample(rng, count) for count in growth.blocks])
    assert growth.blocks == [20 * 2**i for i in range(len(growth.blocks))]
    assert np.array_equal(drawn, blocks[blocks[:, 0] >= 11_000.0][:20])


def test_where_too_few_pass_the_least_growing_make_up_the_number():
    growth = Above(15_000.0)  # 2.5 standard deviations
    sampler = of(growth, 3)
    drawn = sampler.sample(np.random.default_rng(1), 20)
    assert growth.blocks == [20, 40]  # three candidates for each, and no more
    assert sampler.tally.candidates == 60
    rng = np.random.default_rng(1)
    blocks = np.vstack([TABLE_1.sample(rng, count) for count in growth.blocks])
    assert sorted(drawn[:, 0]) == sorted(blocks[:, 0])[-20:]


def test_a_screened_distribution_is_the_distribution_otherwise():
    sampler = of(Above(0.0), 5)
    assert sampler.table() == TABLE_1.table()
    assert np.array_equal(sampler.free, TABLE_1.free)


def test_no_screening_is_the_distribution_itself(circle):
    _, problem, _ = circle
    draws = distribution_for(Tuning())
    assert screened(Tuning(), draws, problem) is draws


def test_growth_is_the_linear_loops(circle):
    tuning, problem, sampler = circle
    controller = TUNED_IDEAL["circle"]
    halves = [
        (g.k1 * 1000**g.nu1, g.nu1, g.k2 * 1000**g.nu2, g.nu2, g.k3)
        for g in (controller.joint1, controller.joint2)
    ]
    plant, chosen = problem.scenarios[0]
    options = loop_options(chosen.friction, tuning.period)
    assert (options.torque_gain, options.hold) == ((0.2585, 1.0231), "stepped")  # slope of (47)
    stacked = stack([controller], 1e-3)
    loops = [linear_loop(plant, x, stacked, options) for x in extreme_poses(problem.reference)]
    expected = max(loop.spectral_radius for loop in loops)
    found = math.exp(sampler.growth(np.ravel(halves)[None])[0] * tuning.period)
    assert found == pytest.approx(expected, rel=SAME_POLES)


def test_what_cannot_be_built_or_overflows_grows_without_bound(circle):
    _, _, sampler = circle
    sample = plain(4)
    sample[0, 1] = 101.0  # an order that the filters refuse
    sample[1, 1], sample[1, 0] = 90.0, 1e290  # finite taps that no matrix would survive
    growth = sampler.growth(sample)
    assert np.isinf(growth[:2]).all() and np.isfinite(growth[2:]).all()
    assert np.isinf(sampler.growth(sample[:2])).all()


def test_screened_draws_hold_and_plain_ones_do_not(circle):
    _, problem, sampler = circle
    drawn = sampler.sample(np.random.default_rng(2), 12)
    passed = sampler.growth(drawn) <= SLACK
    assert passed.any()
    assert np.isfinite(problem(drawn[passed]).indices).mean() >= HELD_LEAST
    assert np.isfinite(problem(plain(50, seed=2)).indices).mean() <= HELD_PLAIN


def test_every_plant_of_the_nominal_robot_is_looked_at():
    tuning = Tuning(trajectory="circle", plant="both", perturb=1, screen=2)
    problem = problem_of(tuning)
    growth = screened(tuning, TABLE_1, problem).growth
    assert isinstance(growth, NearRest)
    assert [plant for plant, _ in growth.plants] == [plant for plant, _ in problem.scenarios[:2]]
    single = [NearRest(growth.design, (each,), growth.poses) for each in growth.plants]
    sample = screened(Tuning(trajectory="circle", screen=50), TABLE_1, problem_of(
        Tuning(trajectory="circle"))).sample(np.random.default_rng(3), 2)  # fmt: skip
    both = growth(sample)
    assert np.array_equal(both <= SLACK, np.all([each(sample) <= SLACK for each in single], axis=0))


def test_joint_friction_enters_as_damping():
    options = loop_options(setting("opposing").friction, 1e-3)
    assert (options.torque_gain, options.joint_damping) == ((1.0, 1.0), (0.2585, 1.0231))


def test_first_generation_and_fresh_ones_are_screened(circle):
    _, problem, sampler = circle
    found = tune(problem, sampler, Tuning(population=8, survivors=3, generations=2).genetic, 1)
    first, second = found.generations
    own = np.random.default_rng(np.random.SeedSequence(1, spawn_key=(0,)))
    assert np.array_equal(first.population, sampler.sample(own, 8))
    fresh = second.population[[origin == "fresh" for origin in second.origins]]
    usual = np.median(sampler.growth(plain(50)))
    assert len(fresh) and sampler.growth(fresh).max() < usual / 5  # the best of 200


@pytest.mark.slow  # unscreened ones are in test_tune
def test_a_screened_run_continues_to_the_same_bits(tmp_path, capsys):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert main(["tune", *SMALL, "--out", str(whole)]) == 0
    assert "screened" in capsys.readouterr().out
    assert main(["tune", *SMALL, "--out", str(cut), "--threads", "1"]) == 0
    lines = (cut / "generations.csv").read_bytes().splitlines(keepends=True)
    (cut / "generations.csv").write_bytes(b"".join(lines[: 1 + 8]) + b"1,0,mu")
    (cut / "result.json").unlink()
    capsys.readouterr()
    assert main(["tune", "--resume", str(cut), "--screen", "20", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["screened"]["candidates"] > 0
    for name in ("generations.csv", "result.json", "convergence.csv"):
        assert (whole / name).read_bytes() == (cut / name).read_bytes()
    config = json.loads((cut / "config.json").read_text())
    assert config["configuration"]["screen"] == 20
    assert config["distribution"] == TABLE_1.table()
    assert main(["tune", "--resume", str(cut), "--screen", "21"]) == 2
    assert "--screen" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words, named",
    [
        ("--tuner cma --screen 10", "--screen has no effect"),
        ("--tuner de --screen 10", "--screen has no effect"),
        ("--screen 1", "screen is 1"),
        ("--screen -5", "screen is -5"),
    ],
)
def test_screening_that_would_do_nothing_is_refused(tmp_path, capsys, words, named):
    assert main(["tune", *words.split(), "--out", str(tmp_path / "run")]) == 2
    complaint = capsys.readouterr().err
    assert named in complaint and complaint.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_peers_are_refused_by_the_library_too(circle):
    _, problem, _ = circle
    with pytest.raises(ParameterError, match="genetic"):
        screened(Tuning(tuner="cma", screen=10), TABLE_1, problem)


def made_course(bests, seed=1, screen=0):
    """A search of 4 individuals whose generations end with these best indices."""
    generations = tuple(
        Generation(
            i, np.zeros((4, 10)), ("initial",) * 4, np.array([x, 9, 9, np.inf]), *np.zeros((2, 4))
        )
        for i, x in enumerate(bests)
    )
    count = np.arange(1.0, len(bests) + 1)
    best = np.minimum.accumulate(bests)
    return Course(seed, screen, Search(generations, ""), 4 * count, best, count / 2, Tally(7, 0.1))


def test_a_row_says_when_the_target_was_reached():
    made = row(made_course([5.0, 3.0, 2.0]), target=3.0)
    assert (made.simulations_to_target, made.seconds_to_target) == (8, 1.0)
    assert (made.best_index, made.candidates, made.stable_first) == (2.0, 7, 0.75)
    assert (made.stable_first_low, made.stable_first_high) == share_interval(3, 4)
    never = row(made_course([5.0, 4.0, 4.0]), target=3.0)
    assert (never.simulations_to_target, never.seconds_to_target) == (None, None)


def said(*rows):
    return verdict(ScreeningResult(list(rows), [], "", 1.0))


def test_the_verdict_says_what_is_saved_and_what_is_not():
    slow, fast = made_course([5.0, 4.0, 3.0, 1.0]), made_course([1.0, 1.0, 1.0, 1.0], screen=9)
    words = said(row(slow, 1.0), replace(row(fast, 1.0), seconds_to_target=4.0))
    assert "0.2 times the simulations (16 without, 4 with it)" in words  # without an interval
    assert "2.0 times the seconds (2 without, 4 with it)" in words
    assert "better for 0 of 1 seeds, 0 % [0, 79]" in words
    assert to_target([row(slow, 0.5)], False, "seconds") == [math.inf]
    assert "unreached" in said(row(slow, 0.5), row(fast, 1.0))


def made_rows(count):
    """Pairs of searches whose plain ones take 1, 2, 4, .. simulations, the others half as many."""
    for seed in range(count):
        plain = replace(row(made_course([1.0], seed), 1.0), simulations_to_target=2**seed)
        yield plain
        yield replace(plain, screen=9, simulations_to_target=2**seed / 2, best_index=0.5)


def test_ratios_are_of_pairs_and_have_intervals():
    """Pairs taken apart would spread over a factor of hundreds."""
    content = facts(ScreeningResult(list(made_rows(8)), [], "", 1.0))
    ratio = content["ratios"]["simulations"]
    assert (ratio["ratio_low"], ratio["ratio"], ratio["ratio_high"]) == (0.5, 0.5, 0.5)
    assert (ratio["plain"], ratio["screened"]) == (12, 6)
    ends = content["better_share_low"], content["better_share_high"]
    assert content["better_share"] == 1.0 and ends == share_interval(8, 8)
    few = facts(ScreeningResult(list(made_rows(5)), [], "", 1.0))["ratios"]["simulations"]
    assert few["ratio"] == 0.5 and few["ratio_low"] is None


def test_searches_that_never_arrive_leave_an_end_open():
    rows = list(made_rows(8))
    lost = [replace(each, simulations_to_target=None) for each in rows[1:7:2]]
    result = ScreeningResult([*rows[0::2], *lost, *rows[7::2]], [], "", 1.0)
    ratio = facts(result)["ratios"]["simulations"]
    assert ratio["ratio"] is not None and ratio["ratio_low"] < ratio["ratio"]
    assert ratio["ratio_high"] is None
    assert "?]" in verdict(result)


def test_the_study_writes_a_run_that_explains_itself(quick):
    run = quick("screening")
    rows = run.content["rows"]
    assert [(each["seed"], each["screen"]) for each in rows] == [(1, 0), (1, 30), (2, 0), (2, 30)]
    keys = "stable_first simulations_to_target best_index candidates seconds"
    assert set(keys.split()) <= set(rows[0])
    assert [each["candidates"] > 0 for each in rows] == [False, True] * 2
    assert len({each["simulations"] for each in rows}) == 1  # at equal numbers
    assert len(run.table("convergence.csv")) == 4 * 4
    assert run.figures == {"screening.png"}
    assert run.faults() == []
    assert "Screening, until the target" in run.text
    assert json.loads((run.folder / "config.json").read_text())["target"] == run.content["target"]
    assert set(run.content["ratios"]) == {"simulations", "seconds"}


@pytest.mark.parametrize(
    "words, named",
    [
        ("--screen 1", "screen is 1"),
        ("--seeds 0", "seeds is 0"),
        ("--trajectory square", "two-loop"),
        ("--generations 0", "generations"),
        ("--quick --population -3", "population"),
        ("--quick --generations -1", "generations"),
    ],
)
def test_a_wrong_option_is_one_line_and_leaves_nothing(tmp_path, capsys, words, named):
    assert main(["screening", *words.split(), "--out", str(tmp_path / "run")]) == 2
    complaint = capsys.readouterr().err
    assert named in complaint and complaint.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_patience_never_ends_the_studys_searches():
    assert ScreeningConfig(generations=7).tuning(1, 5).patience == 7
