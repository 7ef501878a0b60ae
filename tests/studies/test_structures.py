"""Structures at equal search effort: the same budget, fair pairs, the mirrored tip's factor."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from quick_run import QuickRun

from controllers import textbook_pid
from flexsim import ParameterError, reference, setting, trajectory
from flexsim.robot import Robot
from studies.main import main
from studies.pid_question.designs import (
    FILTER_TIMES,
    GROUNDS,
    STRUCTURES,
    TORQUE_LIMIT,
    Effort,
    designs,
    draws_of,
    problems_of,
    shaken,
    tunings_of,
)
from studies.pid_question.structures import StructuresConfig, run, summary
from studies.pid_question.structures_report import REFERENCE, Design, SearchRow
from studies.pid_question.winners import error_over_v, ratio_of
from studies.tuning.distributions import NAMES
from studies.tuning.peers import peer_generations

PERIOD = 1e-3
SMALL = Effort("circle", individuals=96, population=16, weight=1e-7, terms=10)
SLACK = 0.1  # a stiff loop's own error, in parts of v: its PDs are of a short search
STIFF = tuple(textbook_pid(kp, 0.0, kd, PERIOD, 1e-3) for kp, kd in ((1700.0, 2.0), (100.0, 1.0)))
LOST = SearchRow("ideal", REFERENCE, 1, None, None, 96, dict.fromkeys(NAMES))


@pytest.mark.parametrize(("individuals", "population"), [(1, 7), (96, 16), (100, 16), (960, 16)])
def test_every_structure_has_as_many_individuals(individuals: int, population: int) -> None:
    effort = Effort("circle", individuals, population, 0.0, 10)
    one, three = (peer_generations(effort.settings(n)) for n in (1, len(FILTER_TIMES)))
    assert one == three * len(FILTER_TIMES)
    assert individuals <= one * population < individuals + population * len(FILTER_TIMES)


def test_v_is_mirrored_or_ignored_in_runs_and_exact_loops() -> None:
    for design in designs(("pid",)):
        ((tuning, problem), *others) = problems_of(design, GROUNDS["bench"], SMALL, 1)
        assert [each.filter_time for each, _ in ((tuning, problem), *others)] == [*FILTER_TIMES]
        assert problem.v_gain == tuning.v_gain == (-1.0 if design.v == "mirrored" else 0.0)
        assert {loop.options.v_gain for loop in problem.exact} == {tuning.v_gain}
        assert {loop.options.hardware.delay for loop in problem.exact} == {0, 1}
        assert {its.hardware.torque_limit for _, its in problem.scenarios} == {TORQUE_LIMIT}
        assert len(problem.scenarios) == 3 and problem.effort == SMALL.weight


def test_a_pd_has_no_integral_and_a_pid_has() -> None:
    for name in ("pid", "pd"):
        tuning, *_ = tunings_of(Design(name, "ignored"), GROUNDS["ideal"], SMALL, 1)
        draws = draws_of(Design(name, "ignored"), tuning)
        assert len(draws.free) == (6 if name == "pid" else 4)
        pairs = tuning.design.filters(draws.sample(np.random.default_rng(1), 3))
        integral = [abs(np.polyval(a, 1.0)) < 1e-12 for pair in pairs if pair for _, a in pair]
        assert integral == [name == "pid"] * 6
    assert STRUCTURES["fractional"].filter_times == (0.0,)


def test_pairs_have_the_same_relative_changes_and_orders_none() -> None:
    one, other = np.arange(1.0, 11.0), np.linspace(5.0, -4.5, 10)
    first, second = (shaken(each, 4, 1e-2, seed=3) / each for each in (one, other))
    assert first == pytest.approx(second, rel=1e-12)
    orders = [i for i, name in enumerate(NAMES) if name.startswith("nu")]
    gains = [i for i in range(10) if i not in orders]
    assert np.all(np.abs(first[:, orders] - 1) < 1e-15)
    assert np.all(first[:, gains] != 1) and abs(np.std(first[:, gains]) / 1e-2 - 1) < 0.5


def test_the_mirrored_tip_errs_by_two_v_and_the_joints_by_one() -> None:
    """Joint 2 follows reference minus v_gain v/(r+L), and the tip is v farther: |1 - v_gain| v."""
    plant, path = Robot().modes_plant(), trajectory("circle")
    ref = reference(path, plant.parameters, PERIOD)
    found = [
        error_over_v(plant, setting("none"), ref, STIFF, v_gain) for v_gain in (-1.0, 0.0, 0.5)
    ]
    assert found == pytest.approx([2.0, 1.0, 0.5], abs=SLACK)


def test_ratios_are_of_medians_and_none_where_half_diverged() -> None:
    ones, twos = [1.0, 1.1, 0.9, 1.0, 1.05, 0.95], [2.0, 2.2, 1.8, 2.0, 2.1, 1.9]
    ratio, low, high = ratio_of(twos, ones, seed=1)
    assert ratio == low == high == pytest.approx(2.0)  # pairs, each of the same ratio
    _, low, high = ratio_of(twos, ones, seed=1, paired=False)
    assert low is not None and high is not None and low < 2.0 < high
    assert ratio_of(twos, None, seed=1) == (None, None, None)
    assert ratio_of([math.inf] * 4 + [1.0] * 2, ones, seed=1) == (None, None, None)
    assert ratio_of(twos[:5], ones[:5], seed=1)[1:] == (None, None)  # too few for an interval


def test_a_search_that_finds_nothing_is_counted_as_such() -> None:
    row = summary("ideal", {REFERENCE: [LOST, LOST]}, REFERENCE, seed=1)
    assert (row.found, row.seeds, row.cost, row.ratio) == (0, 2, None, None)


@pytest.mark.slow  # its parts are tested above
def test_quick_run(quick: Callable[[str], QuickRun]) -> None:
    found = quick("structures")
    rows, winners = found.content["rows"], found.content["winners"]
    assert {row["evaluations"] for row in rows} == {96}
    assert len(rows) == 6
    assert all(row["found"] == 2 for row in rows if row["structure"] != "fractional")
    tables = {"results.csv", "winners.csv", "searches.csv"}
    assert found.files == {"config.json", "tables.json", "figures"} | tables
    assert len(found.table("searches.csv")) == 12
    assert found.faults() == []
    ignored = [row for row in winners if row["v"] == "ignored" and row["plant"] != "closed-chain"]
    assert {"pid", "pd"} <= {row["structure"] for row in ignored}
    for row in ignored:  # (2 v)^2 against v^2, but for what a short search leaves
        assert row["to_mirrored"] is None or row["to_mirrored"] < 0.75
        assert row["error_over_v"] == pytest.approx(1.0, abs=0.4)
        assert row["growth"] < 0 < row["delay_margin"]
    assert "with v mirrored" in found.text and "Ignoring v" in found.text
    assert max(map(len, found.text.splitlines()[:-8])) <= 80
    assert main(["structures", "--quick", "--out", str(found.folder)]) == 2


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("--grounds moon", "moon"),
        ("--grounds ideal ideal", "once"),
        ("--hardware bench", "--hardware has no effect"),
        ("--hardware-delay 2", "--hardware-delay has no effect"),
        ("--individuals 0", "individuals"),
        ("--population 6", "population"),
        ("--seeds 0", "seeds"),
        ("--trajectory square", "square"),
        ("--effort -1", "effort"),
        ("--perturbations 0", "perturbations"),
    ],
)
def test_a_wrong_option_is_one_line_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: str, named: str
) -> None:
    assert main(["structures", *words.split(), "--out", str(tmp_path / "run")]) == 2
    complaint = capsys.readouterr().err
    assert named in complaint and complaint.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_seed_must_leave_room_for_all() -> None:
    with pytest.raises(ParameterError, match="seed"):
        run(StructuresConfig(seed=2**32 - 1))
