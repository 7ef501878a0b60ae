"""The arena: scores in closed form, fair searches, nobody told, the contract of its results."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from quick_run import QuickRun

from controllers import ControllerError
from flexsim import ParameterError, Parameters, Robot, setting
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE
from studies.arena.arena import SHORT, ArenaConfig, run
from studies.arena.conditions import CONDITIONS, CORE, NOMINAL, Tuned, document
from studies.arena.contestants import BANDWIDTH_NAMES, BANDWIDTHS, CLASSES
from studies.arena.cost import cost_of
from studies.arena.entry import design
from studies.arena.evaluating import workshop_of
from studies.arena.ground import EFFORT, STEEP, Ground, paths, still
from studies.arena.rows import ScoreRow, TunedRow
from studies.arena.search import DIVERGED, GROWTH, INDEX, OBJECTIVE, best_of, front, searched
from studies.arena.search import EFFORT as EFFORT_COLUMN
from studies.arena.verdicts.judging import Judge, said, spilling
from studies.arena.verdicts.measures import budget_rows, spill_rows
from studies.arena.verdicts.scoring import (
    Estimate,
    decades,
    difference,
    estimated,
    improvement,
    interquartile_mean,
    profile,
)
from studies.arena.verdicts.shares import shares, variance_shares
from studies.main import main
from studies.tuning.genetic import Scores

EVERY = tuple(CLASSES)


@pytest.fixture(scope="module")
def ground() -> Ground:
    """Short paths on the modes that the arena tunes on."""
    its = setting("simulink", HARDWARE["bench"])
    return Ground.of(Robot(), ("assumed-modes:5",), its, paths(**SHORT))


@pytest.fixture(scope="module")
def quick_arena(quick: Callable[[str], QuickRun]) -> QuickRun:
    return quick("arena")


# --- scores --------------------------------------------------------------------------------------


def test_a_score_counts_decades_and_the_diverged_have_none() -> None:
    found = decades([1e-3, 1e-4, math.inf, 2.0, math.nan], 1e-2)
    np.testing.assert_allclose(found, [1.0, 2.0, 0.0, 0.0, 0.0], atol=1e-15)


def test_the_interquartile_mean_leaves_a_quarter_out_at_either_end() -> None:
    scores = np.array([[[0.0, 1.0], [2.0, 3.0]], [[4.0, 5.0], [6.0, 100.0]]])
    assert interquartile_mean(scores) == pytest.approx(np.mean([2.0, 3.0, 4.0, 5.0]))
    assert interquartile_mean(scores) != pytest.approx(scores.mean())  # negative control


def test_improvement_is_mann_whitneys_by_task() -> None:
    first = np.array([[[1.0, 3.0]], [[9.0, 9.0]]])
    second = np.array([[[2.0], [2.0]], [[9.0], [10.0]]])
    assert improvement(first, second) == pytest.approx(
        ((0 + 0 + 1 + 1) / 4 + (0.5 + 0 + 0.5 + 0) / 4) / 2
    )
    assert improvement(first, first) == 0.5
    assert improvement(first, second) + improvement(second, first) == pytest.approx(1.0)


def test_a_profile_falls_from_one_to_none() -> None:
    np.testing.assert_allclose(
        profile([0.0, 1.0, 2.0, 3.0], [-1.0, 0.5, 1.0, 3.0]), [1, 0.75, 0.5, 0]
    )


def test_intervals_hold_what_they_should() -> None:
    """Of 200 samples of 10 runs of one distribution, about 95 % have its mean in the interval."""
    rng, inside = np.random.default_rng(1), 0
    for seed in range(200):
        sample = rng.normal(1.0, 1.0, size=(3, 10, 1))
        _, low, high = estimated(interquartile_mean, [sample], seed, resamples=199)
        inside += low <= 1.0 <= high
    assert 170 <= inside <= 199  # percentile intervals of so few are a little short


def test_repeats_of_a_search_are_no_searches() -> None:
    """Ten searches run thrice with all but the same outcome: as wide as ten, not as thirty."""
    rng = np.random.default_rng(1)
    once = rng.normal(size=(1, 10, 1)) * np.ones((3, 1, 1))  # good ones are on every trajectory
    thrice = once + 1e-6 * rng.normal(size=(3, 10, 3))
    wide, same = (estimated(interquartile_mean, [each], 1) for each in (once, thrice))
    assert same.high - same.low == pytest.approx(wide.high - wide.low, rel=0.15)
    apart = estimated(interquartile_mean, [thrice.reshape(3, 30, 1)], 1)  # negative control
    assert apart.high - apart.low < 0.75 * (same.high - same.low)


def test_pairs_that_are_the_same_differ_by_nothing() -> None:
    sample = np.random.default_rng(1).normal(size=(3, 8, 2))
    assert estimated(difference, [sample, sample], 1, paired=True) == Estimate(0.0, 0.0, 0.0)
    chance = estimated(improvement, [sample, sample], 1)
    assert chance.low < chance.value == 0.5 < chance.high and said(chance) == "open"
    assert said(Estimate(0.9, 0.6, 1.0)) == "first" and said(Estimate(0.1, 0.0, 0.4)) == "second"
    with pytest.raises(ParameterError, match="one or more of each"):
        estimated(interquartile_mean, [np.zeros((3, 0, 1))], 1)
    with pytest.raises(ParameterError, match="as many runs"):
        estimated(difference, [sample, sample[:, :5]], 1, paired=True)


def test_shares_of_an_additive_table_are_its_variances() -> None:
    a, b = np.array([0.0, 2.0]), np.array([0.0, 1.0, 2.0])
    noise = np.array([-0.5, 0.5])
    scores = a[:, None, None] + b[None, :, None] + noise[None, None, :]
    parts = np.array([1.0, 2 / 3, 0.0, 0.25])
    np.testing.assert_allclose(variance_shares(scores), parts / parts.sum(), atol=1e-12)
    rows = shares(scores, ("b?", "a?"), seed=1, searched=2, of="both")
    assert [row.factor for row in rows] == ["b?", "a?", "interactions", "tuning seed"]
    assert {row.of for row in rows} == {"both"}
    assert sum(row.share for row in rows) == pytest.approx(1.0)
    assert not variance_shares(np.ones((2, 2, 2))).any()


def test_a_front_has_what_nothing_dominates() -> None:
    points = np.array([[1.0, 5.0], [2.0, 2.0], [2.0, 3.0], [3.0, 2.0], [4.0, 1.0], [0.5, np.inf]])
    assert front(points).tolist() == [0, 1, 4]


# --- contestants and searches --------------------------------------------------------------------


def test_there_are_ten_classes_with_bandwidths_alike() -> None:
    assert len(CLASSES) >= 12
    for each in CLASSES.values():
        own = [knob for knob in each.knobs if knob.name in BANDWIDTH_NAMES]
        assert all((knob.low, knob.high) == BANDWIDTHS and knob.log for knob in own)
        assert own or each.name.startswith("valerio")


def test_a_search_of_twice_the_budget_begins_as_the_other(ground: Ground) -> None:
    once, twice = (searched(ground, CLASSES["lead"], 3, budget) for budget in (20, 40))
    assert len(once) == 20 and len(twice) == 40
    np.testing.assert_array_equal(once, twice[:20])
    best = best_of(twice)
    assert best[OBJECTIVE] == twice[:, OBJECTIVE].min()


def test_the_genetic_algorithm_searches_the_same_knobs(ground: Ground) -> None:
    found = searched(ground, CLASSES["lead"], 3, 34, "genetic")
    low = [knob.low for knob in CLASSES["lead"].knobs]
    assert len(found) == 34 and (found[:, :OBJECTIVE] >= low).all()


def test_too_much_effort_costs(ground: Ground) -> None:
    """The objective is the index but for what exceeds the allowed effort."""
    found = searched(ground, CLASSES["zv"], 1, 40)
    held = found[np.isfinite(found[:, OBJECTIVE])]
    over = np.maximum(held[:, EFFORT_COLUMN] / EFFORT - 1.0, 0.0)
    np.testing.assert_allclose(held[:, OBJECTIVE], held[:, INDEX] * (1 + STEEP * over), rtol=1e-12)
    assert over.any() and not over.all() and np.isnan(held[:, DIVERGED]).all()


def test_the_worst_of_two_plants_counts(ground: Ground) -> None:
    knobs = np.array(
        [[k.low * 2 if k.log else (k.low + k.high) / 2 for k in CLASSES["lead"].knobs]]
    )
    alone = [
        replace(ground, plants=(plant,)).tried(CLASSES["lead"], knobs).objective[0]
        for plant in (*ground.plants, Robot().plant("closed-chain", ground.setting))
    ]
    both = replace(ground, plants=(*ground.plants, Robot().plant("closed-chain", ground.setting)))
    assert both.tried(CLASSES["lead"], knobs).objective[0] == max(alone)


def test_the_diverged_rank_by_when(ground: Ground) -> None:
    knobs = np.array([[100.0, -0.5, 2.0, 100.0, -0.5, 2.0], [30.0, 0.8, 20.0, 30.0, 0.8, 20.0]])
    scores: Scores = ground.scores(CLASSES["zv"], knobs)[0]
    assert np.isinf(scores.indices[0]) and scores.growth[0] > 0 == scores.growth[1]
    assert np.isfinite(scores.indices[1])


def test_loops_that_grow_are_not_simulated_and_rank_behind_the_diverged(ground: Ground) -> None:
    found = searched(ground, CLASSES["zv"], 1, 40)
    grows = found[:, GROWTH] > 0
    assert grows.any() and not grows.all()
    assert np.isinf(found[grows, OBJECTIVE]).all() and not found[grows, DIVERGED].any()
    knobs = found[grows, :OBJECTIVE][:1]
    plain = replace(ground, setting=setting("none", HARDWARE["bench"]))
    built = stack([CLASSES["zv"].built(knobs[0], ground.designer)], 1e-3)
    alone, both = (g.growth(CLASSES["zv"], built)[0] for g in (plain, ground))
    assert both >= alone >= 0.0 and both == found[grows, GROWTH][0]
    scores = ground.scores(CLASSES["zv"], knobs)[0]
    most = max(path.end_time for path in ground.trajectories.values())
    assert scores.growth[0] == pytest.approx(most + both) and np.isinf(scores.indices[0])


def test_standing_still_is_as_long_as_the_path(ground: Ground) -> None:
    """A line of constant quintic: the integral of u^2 over it is 181/462 of its duration."""
    path = ground.trajectories["line"]
    far = math.dist(path.start, path.end) ** 2
    expected = far * (path.duration * 181 / 462 + path.hold)
    assert still(ground)[0] == pytest.approx(expected, rel=1e-4)


# --- nobody is told ------------------------------------------------------------------------------


def test_controllers_are_the_same_under_every_condition() -> None:
    knobs = tuple(math.sqrt(k.low * k.high) if k.log else 0.5 for k in CLASSES["pid"].knobs)
    tuned = [Tuned("pid", "bench", 1, knobs)]
    taps = []
    for condition in CONDITIONS.values():
        given = document(condition, tuned, ("assumed-modes:5",), 1, changes=SHORT)
        assert given["robots"][0] == {"name": NOMINAL}
        shop = workshop_of(given)
        if shop.study.period == 1e-3:
            taps.append(shop.controllers(0, (), np.ones((1, 6))).b)
    assert len(taps) >= 7 and all(np.array_equal(each, taps[0]) for each in taps)


def test_a_conditions_file_is_the_same_in_every_process() -> None:
    """Batches are kept by it: references stand in the order of the classes, not of a set's."""
    tuned = [
        Tuned(name, "bench", 1, tuple(k.low for k in CLASSES[name].knobs))
        for name in ("zvd-held", "pid", "zv", "zvd")
    ]
    given = document(CONDITIONS["payload"], tuned, ("assumed-modes:5",), 1)
    names = [each["name"].partition("+")[2] for each in given["trajectories"]]
    assert list(dict.fromkeys(names)) == ["", "zvd-held", "zv-free", "zvd-free"]


def test_a_class_is_a_function_of_a_study_file() -> None:
    with pytest.raises(ParameterError, match="class 'pd' is unknown; choose from fractional"):
        design(1e-3, Parameters(), "pd", [1.0])
    with pytest.raises(ParameterError, match="lead has 8 knobs, omega_c_1, phi_m_1"):
        design(1e-3, Parameters(), "lead", [1.0])
    with pytest.raises(ControllerError, match="lqg has no controller of these knobs"):
        design(1e-3, Parameters(), "lqg", [1.0] * 7)


# --- the whole -----------------------------------------------------------------------------------


def test_the_contract_of_results(quick_arena: QuickRun) -> None:
    found = pq.read_table(quick_arena.folder / "results.parquet")
    wanted = {"class", "plant", "trajectory", "setting", "hardware", "payload", "seed", "repeat"}
    assert wanted | {"index", "envelope", "rms_error", "residual_v", "effort", "diverged"} <= set(
        found.schema.names
    )
    assert set(found.column("class").to_pylist()) == set(EVERY)
    assert {"assumed-modes:5", "closed-chain:6"} <= set(found.column("plant").to_pylist())
    assert {0.0, 0.2} <= set(found.column("payload").to_pylist())
    assert set(found.column("reference").to_pylist()) >= {"plain", "true-tip", "feedforward"}
    verdicts = quick_arena.table("verdicts.csv")
    assert all(float(row["low"]) <= float(row["chance"]) <= float(row["high"]) for row in verdicts)
    assert {row["verdict"] for row in verdicts} <= {"first", "second", "open"}


def test_quick_figures_can_be_printed(quick_arena: QuickRun) -> None:
    assert quick_arena.faults() == []
    assert quick_arena.figures == {"scores.png", "profiles.png", "fronts.png"}


def test_scores_are_those_of_the_runs(quick_arena: QuickRun) -> None:
    found = pq.read_table(quick_arena.folder / "results.parquet").to_pylist()
    for row in quick_arena.table("scores.csv")[:5]:
        its = [
            each
            for each in found
            if all(
                each[name] == row[key]
                for name, key in (
                    *(("class", "contestant"), ("plant", "plant"), ("condition", "condition")),
                    *(("reference", "reference"), ("robot", "level")),
                )
            )
        ]
        if row["level"] == NOMINAL:
            assert len(its) == int(row["runs"])
            lost = sum(each["diverged"] for each in its)
            assert float(row["diverged"]) == pytest.approx(lost / len(its))


def test_parts_of_the_index_add_up_to_it(quick_arena: QuickRun) -> None:
    found = pq.read_table(quick_arena.folder / "results.parquet").to_pylist()
    ended = [each for each in found if not each["diverged"]]
    for each in ended:
        parts = [each[f"index_{name}"] for name in "xyv"]
        assert sum(parts) == pytest.approx(each["index"], rel=1e-9) and min(parts) >= 0.0
    assert max(each["index_v"] / each["index"] for each in ended if each["index"]) > 1e-3


def test_measures_are_medians_of_the_runs(quick_arena: QuickRun) -> None:
    found = pq.read_table(quick_arena.folder / "results.parquet").to_pylist()
    rows = quick_arena.table("measures.csv")
    assert {"push", "pulse", "line"} <= {row["trajectory"] for row in rows}
    names = ("condition", "plant", "reference", "trajectory", "hardware")
    for row in rows[:40]:
        if row["level"] != NOMINAL:
            continue
        its = [
            math.inf if each["diverged"] else each["rms_error"]
            for each in found
            if each["class"] == row["contestant"] and each["robot"] == NOMINAL
            if all(each[name] == row.get(name, "bench") for name in names)
            if (each["setting"], each["period"]) == ("simulink", 1e-3)
        ]
        assert len(its) == int(row["runs"])
        middle = float(np.median(its))
        assert float(row["rms_error"] or math.inf) == pytest.approx(middle, rel=1e-12)
        if row["rms_error_low"] and row["rms_error_high"]:
            assert float(row["rms_error_low"]) <= middle <= float(row["rms_error_high"])


def test_nothing_dominates_what_is_on_a_front(quick_arena: QuickRun) -> None:
    found = pq.read_table(quick_arena.folder / "results.parquet").to_pylist()
    rows = [row for row in quick_arena.table("fronts.csv") if row["condition"] == NOMINAL]
    assert {row["measure"] for row in rows} == {"variation", "rms"}
    for row in rows:
        if row["reference"] != "true-tip":
            continue
        its = [
            each
            for each in found
            if (each["condition"], each["reference"]) == (NOMINAL, "true-tip")
            and (each["plant"], each["trajectory"]) == (row["plant"], row["trajectory"])
            and not each["diverged"]
        ]
        assert its
        for each in its:
            efforts = {
                "variation": each["variation_1"] + each["variation_2"],
                "rms": math.hypot(each["rms_torque_1"], each["rms_torque_2"]),
            }
            effort, index = float(row["effort"]), float(row["index"])
            assert not (efforts[row["measure"]] < effort and each["index"] < index)


def test_a_finer_model_says_who_spills() -> None:
    """Two classes on three modes, two searches each: one controller of four diverges on five."""
    runs = [
        (name, seed, plant, name == "pid" and seed == 2 and plant != "assumed-modes:3")
        for name in ("pid", "lead")
        for seed in (1, 2)
        for plant in ("assumed-modes:3", "assumed-modes:5", "chain:6")
    ]
    columns: dict[str, list[object]] = {
        "class": [each[0] for each in runs],
        "seed": [each[1] for each in runs],
        "plant": [each[2] for each in runs],
        "diverged": [each[3] for each in runs],
    }
    same = {"tuning": spilling(3), "condition": NOMINAL, "reference": "plain", "repeat": 0}
    same |= {"trajectory": "line", "index": 1e-4}
    table = pa.table(columns | {name: [each] * len(runs) for name, each in same.items()})
    row = TunedRow("pid", spilling(3), 1, 20, 1.0, 0.0, 1.0, 1.0, 1.0, None, 3.0, "")
    tuned = [
        replace(row, contestant=name, seed=seed, growth=3.0 if name == "pid" else 0.0)
        for name in ("pid", "lead")
        for seed in (1, 2)
    ]
    found = {(r.contestant, r.plant): r for r in spill_rows(Judge(table, {"line": 1.0}, 1), tuned)}
    assert {plant for _, plant in found} == {"assumed-modes:5", "chain:6"}  # none on its own
    whole, pid, lead = (found[each, "assumed-modes:5"] for each in ("all", "pid", "lead"))
    assert (whole.controllers, whole.grows, whole.diverge, whole.share) == (4, 2, 1, 0.25)
    assert (pid.diverge, lead.diverge, lead.grows) == (1, 0, 0)
    assert whole.low < 0.25 < whole.high


def test_a_budget_is_enough_if_twice_as_much_moves_less_than_the_interval() -> None:
    row = TunedRow("lead", CORE, 1, 20, 1.0, 0.0, 1e-3, 1e-3, 1.0, 1e-4, 0.0, "")
    score = ScoreRow(
        "lead", "-", "-", CORE, NOMINAL, NOMINAL, "p", "plain", 9, *(2.0, 1.4, 2.6), 0, 0, 0
    )
    moved = [row, replace(row, seed=2, twice=1e-3), replace(row, seed=3, twice=None)]
    (found,) = budget_rows(moved, [score], "p", {"lead": "plain"})
    assert (found.searches, found.moved, found.enough) == (2, pytest.approx(0.5), True)
    narrow = replace(score, low=1.9, high=2.1)
    assert not budget_rows(moved, [narrow], "p", {"lead": "plain"})[0].enough


def test_one_class_under_two_names_is_as_good_and_a_bad_one_loses(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The bad one's joints are as good as free: at the least bandwidth, without lead."""
    lead = CLASSES["lead"]
    slow = tuple(
        knob._replace(low=3.0, high=3.1) if knob.name in BANDWIDTH_NAMES else knob
        for knob in CLASSES["zv"].knobs
    )
    monkeypatch.setitem(CLASSES, "again", replace(lead, name="again"))  # type: ignore[arg-type]
    bad = replace(CLASSES["zv"], name="bad", knobs=slow, aid="plain")
    monkeypatch.setitem(CLASSES, "bad", bad)  # type: ignore[arg-type]
    pairs = (("test", "lead", "again"), ("test", "bad", "lead"))
    monkeypatch.setattr("studies.arena.verdicts.judging.PAIRS", pairs)
    result = run(
        ArenaConfig(
            quick=True,
            classes=("lead", "again", "bad"),
            conditions=("nominal",),
            plants=("assumed-modes:5",),
        )
    )
    found = {(row.first, row.second): row for row in result.verdicts if row.factor == "test"}
    same, worse = found["lead", "again"], found["bad", "lead"]
    assert same.chance == 0.5 and same.difference == 0.0 and same.verdict == "open"
    assert worse.high < 0.5 and worse.verdict == "second" and worse.difference < -0.1


def test_a_run_goes_on(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:  # type: ignore[no-untyped-def]
    """What was searched and run is kept until the folder stands, and then is no more."""
    words = ["--classes", "lead", "--conditions", "nominal", "--seeds", "1", "--twice", "0"]
    words += ["--simulations", "20", "--repeats", "1", "--plants", "assumed-modes:5", "--quick"]
    assert main(["arena", *words, "--out", str(tmp_path / "run")]) == 0
    assert not (tmp_path / "run.begun").exists()
    assert "At equal effort lead is best" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said_"),
    [
        ("--classes zz", "class 'zz' is unknown; choose from fractional"),
        ("--conditions zz", "condition 'zz' is unknown; choose from nominal"),
        ("--simulations 5", "simulations is 5; give 20 or more"),
        ("--twice -1", "twice is -1; give 0 or more"),
        ("--robot.EI 0.5", "the arena is about the paper's robot"),
        ("--workers 2 --cluster tcp://x:1", "--workers and --cluster contradict"),
    ],
)
def test_what_cannot_be_run_is_refused(
    words: str, said_: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["arena", *words.split(), "--dry-run"]) == 2
    assert said_ in capsys.readouterr().err


def test_a_dry_run_says_what_it_costs(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--classes", "lead", "--conditions", "nominal", "--quick", "--dry-run"]
    assert main(["arena", *words]) == 0
    said_ = capsys.readouterr().out
    assert said_.startswith("60 individuals to be tried on three trajectories, 36 runs")
    assert cost_of({"a": 2.0}, {"a": 10}, 3, 3) == (10, 3, 22.0)
