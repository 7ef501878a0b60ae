"""Convergence: the test of equivalence on made-up runs, what a ladder says, growth that steps hide,
and what the stored result says of the defaults.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from quick_run import QuickRun

from controllers import TUNED, TUNED_IDEAL, Controller, Gains
from flexsim import Robot, setting
from flexsim.arm.beam import MODES
from flexsim.arm.chain_design import SEGMENTS
from flexsim.arm.parameters import paper
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE
from studies.converge import judging
from studies.converge.converge import Task, changes_of, exact_growths, growths, tuned_for
from studies.converge.judging import BEYOND, FLOOR, OPEN, WITHIN
from studies.converge.report import verdict
from studies.converge.rows import CaseRow, Change, Convergence, RungRow
from studies.converge.rungs import REFERENCE, halvings, ladders
from studies.core.evidence.repeats import medians
from studies.main import main

STORED = Path(__file__).parents[2] / "studies" / "converge"
GROWS = Controller(  # grows at 191.6 Hz, joint-free mode 5, on a beam without damping
    "grows",
    Gains.from_milliseconds(
        9417.603258590882,
        0.40672707687516285,
        1.5695197899633948,
        -0.18580937642654677,
        -0.04838370124487103,
    ),
    Gains.from_milliseconds(
        129.83655059369727,
        0.15772114400349602,
        1.006131586628871,
        0.055098907217274645,
        0.05263870856726027,
    ),
    source="the genetic algorithm, with the friction 'jump'",
)


def runs(middle: float, spread: float, n: int, seed: int = 0) -> np.ndarray:
    return middle + spread * np.random.default_rng(seed).standard_normal(n)


# ---- one figure


def test_the_interval_must_lie_within_the_margin() -> None:
    assert judging.status_of(-0.4, 0.5, 0.5) == WITHIN
    assert judging.status_of(-0.6, 0.1, 0.5) == judging.status_of(0.4, 0.6, 0.5) == OPEN
    assert judging.status_of(0.6, 0.7, 0.5) == judging.status_of(-0.7, -0.6, 0.5) == BEYOND
    assert judging.status_of(-math.inf, math.inf, 0.5) == OPEN
    assert judging.status_of(0.0, 0.0, None) == OPEN


@pytest.mark.parametrize(
    ("shift", "status"), [(1e-5, WITHIN), (-1e-5, WITHIN), (2e-4, BEYOND), (-2e-4, BEYOND)]
)
def test_pairs_tell_small_changes_of_scattered_runs(shift: float, status: str) -> None:
    exact = runs(5e-3, 1e-4, 40)
    found = judging.change_of(exact + shift + runs(0, 5e-6, 40, 1), exact, 40, seed=1)
    assert found.change == pytest.approx(shift, abs=5e-6)
    assert found.low is not None and found.high is not None
    assert found.low <= found.change <= found.high
    assert found.status == status


def test_that_no_difference_is_found_proves_nothing() -> None:
    """The same distribution, other runs: 0 is in the interval, and the runs are too few."""
    found = judging.change_of(runs(5e-3, 5e-4, 20), runs(5e-3, 5e-4, 20, 1), 20, seed=1)
    assert found.low is not None and found.high is not None and found.low < 0 < found.high
    assert found.status == OPEN
    assert judging.change_of([5e-3] * 5, [5e-3] * 5, 5, seed=1).status == OPEN  # no interval


def test_more_runs_resolve_what_few_do_not() -> None:
    def status(n: int) -> str:
        mine, exact = (runs(3.6e-2, 4e-4, n, seed) for seed in (2, 3))
        published = judging.published_runs(exact.tolist())
        assert published == 20  # 1 % of the median is enough
        return judging.change_of(mine, exact, published, seed=1).status

    assert (status(20), status(600)) == (OPEN, WITHIN)


def test_a_change_as_large_as_the_margin_seldom_passes() -> None:
    """The level of two one-sided tests: 2.5 %, here at most 3 of 40 (5 or more: once in 300)."""
    passed = 0
    for seed in range(40):
        exact = runs(5e-3, 1e-5, 24, seed)
        found = judging.change_of(exact + FLOOR + runs(0, 2e-5, 24, 99 + seed), exact, 24, seed=1)
        assert found.margin == FLOOR
        passed += found.status == WITHIN
    assert passed <= 4


def test_margins_are_published_half_widths_or_half_a_digit() -> None:
    assert judging.margin_of(runs(5e-3, 1e-6, 40).tolist(), 20) == FLOOR
    wide = runs(3.6e-2, 4e-4, 80).tolist()
    low, high = sorted(wide[:20])[5], sorted(wide[:20])[14]  # ranks 6 and 15 of 20: 95 %
    assert judging.margin_of(wide, 20) == pytest.approx((high - low) / 2)
    assert judging.margin_of([math.inf] * 11 + [5e-3] * 9, 20) is None
    assert judging.published_runs(runs(5e-3, 1e-3, 60).tolist()) == 60  # never enough: all


def test_runs_that_diverge() -> None:
    fine, lost = np.full(20, 5e-3), np.full(20, math.inf)
    assert judging.change_of(lost, fine, 20, seed=1).status == BEYOND
    assert judging.change_of(fine, lost, 20, seed=1).status == BEYOND
    both = judging.change_of(lost, lost, 20, seed=1)
    assert (both.change, both.status) == (None, OPEN)
    assert judging.shares_status(0, 0, 20) == judging.shares_status(7, 7, 20) == WITHIN
    assert judging.shares_status(1, 0, 20) == OPEN
    assert judging.shares_status(20, 0, 20) == judging.shares_status(0, 20, 20) == BEYOND


def test_growth_has_the_sign_of_the_exact_loops() -> None:
    assert judging.growth_agrees(-0.01, -0.3) and judging.growth_agrees(1.5, 0.2)
    assert not judging.growth_agrees(-0.003, 1.57)
    assert not judging.growth_agrees(1.57, -0.003)
    assert judging.growth_agrees(1e-5, -1e-5)  # to what it is known


# ---- rungs and ladders


def case_row(shift: float, case: str = "line", growth: float = -1.0) -> CaseRow:
    """A case whose figures all move by a shift, of 40 runs."""
    exact, mine = (
        [
            {"diverged": False, "diverged_at": None, "envelope": w, "rms_error": w, "max_v": w}
            for w in 5e-3 + s + 1e-6 * np.arange(40)
        ]
        for s in (0.0, shift)
    )
    return CaseRow(
        *("Modes", "assumed-modes:3", 1e-3, case, case, "ideal", 0.0),
        *(medians(mine), changes_of(mine, exact, 1), growth, -1.0),
        *(judging.growth_agrees(growth, -1.0), WITHIN),
    )


def test_a_rung_is_as_good_as_its_worst_figure() -> None:
    good, bad = case_row(0.0), case_row(2e-4, "circle")
    assert judging.rung_status([good, good]) == (WITHIN, "")
    status, why = judging.rung_status([good, bad])
    assert status == BEYOND
    assert why.startswith("circle: ") and "+0.20 mm [+0.20, +0.20]" in why
    status, why = judging.rung_status([good, case_row(0.0, growth=0.5)])
    assert (status, why) == (BEYOND, "line: growth +0.5 instead of -1 1/s")
    assert bad.change("envelope") == Change(
        *(pytest.approx(2e-4),) * 3, FLOOR, BEYOND
    )  # comes back from the items of a file


def rung(size: int, status: str, default: bool = False) -> RungRow:
    zero, why = np.zeros(1), "line: envelope" * (status != WITHIN)
    numbers = (1.0, size / 12, zero, 0.0, 0.0, -1.0)
    plant = f"assumed-modes:{size}"
    return RungRow("Modes", plant, str(size), 1e-3, default, "", *numbers, status, why)


@pytest.mark.parametrize(
    ("statuses", "cheapest", "unresolved", "confirmed"),
    [
        ((BEYOND, WITHIN, WITHIN), 3, "", True),
        ((WITHIN, WITHIN, WITHIN), 2, "", False),
        ((OPEN, WITHIN, WITHIN), 3, "2", False),
        ((BEYOND, OPEN, WITHIN), 5, "3", False),
        ((BEYOND, BEYOND, WITHIN), 5, "", False),
        ((BEYOND, BEYOND, OPEN), None, "5", False),
    ],
)
def test_what_a_ladder_says(
    statuses: tuple[str, ...], cheapest: int | None, unresolved: str, confirmed: bool
) -> None:
    """The default is 3, of 2, 3 and 5."""
    sizes = zip((2, 3, 5), statuses, strict=True)
    rungs = [rung(size, status, size == 3) for size, status in sizes]
    found = judging.ladder_row(rungs)
    words = "assumed-modes:{} at 1 ms".format
    assert found.cheapest == (cheapest and words(cheapest))
    assert found.unresolved == (unresolved and words(unresolved))
    assert (found.default, found.default_status) == (words(3), statuses[1])
    assert found.confirmed is confirmed
    said = " ".join(verdict(Convergence([], rungs, [found], (), "", 40)).split())
    assert ("3 at 1 ms, the default." in said) is confirmed
    if statuses[1] != WITHIN:
        assert f"the default, 3 at 1 ms, is {statuses[1]} (line: envelope)" in said


def test_rungs_go_from_coarse_to_fine() -> None:
    rungs, exact = ladders(Robot(), setting("simulink"))
    assert exact == (f"assumed-modes:{REFERENCE}", 6.25e-5)
    assert list(halvings(1e-3, 1.25e-4)) == [1e-3, 5e-4, 2.5e-4, 1.25e-4]
    names = list(dict.fromkeys(each.ladder for each in rungs))
    assert names[:3] == ["Modes", "Modes, fine", "Segments"]
    for name in names:
        ladder = [each for each in rungs if each.ladder == name]
        work = [int(each.size) / each.step for each in ladder]
        assert work == sorted(work) and len(set(work)) == len(work)
        if name.startswith("Steps"):
            assert {each.against for each in ladder} == {ladder[-1].key}
        else:
            assert {each.against for each in ladder} == {exact}
    defaults = {each.key for each in rungs if each.default and each.ladder != "Modes, fine"}
    assert defaults == {(f"assumed-modes:{MODES}", 1e-3), (f"closed-chain:{SEGMENTS}", 1e-3)}


def test_defaults_only_are_held_against_the_exact_beam() -> None:
    rungs, exact = ladders(Robot(), setting("simulink"), part="defaults")
    assert [(each.key, each.default) for each in rungs] == [
        ((f"assumed-modes:{MODES}", 1e-3), True),
        (exact, False),
        ((f"closed-chain:{SEGMENTS}", 1e-3), True),
    ]
    assert {each.against for each in rungs} == {exact}
    sizes, _ = ladders(Robot(), setting("simulink"), part="sizes")
    assert {each.ladder for each in sizes} == {"Modes", "Segments"}
    assert sizes[7].key == exact and sizes[8].ladder == "Segments" and len(sizes) == 14
    found = [rung(3, OPEN, True), replace(rung(12, WITHIN), against="assumed-modes:12 at 1 ms")]
    said = verdict(Convergence([], found, [judging.ladder_row(found)], (), "", 40))
    assert said == "Modes: the default, 3 at 1 ms, is not resolved (line: envelope)."


def test_controllers_are_those_tuned_for_the_hardware() -> None:
    ideal, bench = (setting("simulink", HARDWARE[name]) for name in ("ideal", "bench"))
    assert tuned_for(ideal, "line") is TUNED_IDEAL["line"]
    assert tuned_for(bench, "line") is TUNED["line"]


def test_steps_hide_growth() -> None:
    """Mode 5 of an undamped beam grows; three modes have none, and RK4 at 1 ms damps it."""
    robot, chosen, task = Robot(paper()), setting("simulink"), Task("line", "line")
    controllers = stack([GROWS.filters(1e-3)], 1e-3)
    exact = exact_growths(robot, task, chosen, controllers)
    assert exact == pytest.approx(1.5, abs=0.2)

    def growth(name: str, step: float) -> float:
        return growths(robot.plant(name, chosen, step=step), task, chosen, controllers)

    for name, step in (("assumed-modes:3", 1.25e-4), ("assumed-modes:5", 1e-3)):
        assert not judging.growth_agrees(growth(name, step), exact)
    assert growth("assumed-modes:5", 1.25e-4) == pytest.approx(exact, abs=0.02)
    assert growth("assumed-modes:12", 6.25e-5) == pytest.approx(exact, abs=1e-3)


# ---- the command


@pytest.fixture
def converge(quick: Callable[[str], QuickRun]) -> QuickRun:
    return quick("converge")


def test_a_quick_run(converge: QuickRun) -> None:
    content: dict[str, Any] = converge.content
    tables = {"ladders.csv", "rows.csv", "rungs.csv"}
    assert converge.files == {"config.json", "tables.json", "figures"} | tables
    assert converge.figures == {"sizes.png", "steps.png"}
    assert converge.faults() == []
    assert content["cases"] == ["line"] and len(content["rows"]) == len(content["rungs"])
    assert [each["ladder"] for each in content["ladders"]] == [
        *("Modes", "Modes, fine", "Segments"),
        *(f"Steps, n = {MODES}", f"Steps, N = {SEGMENTS}", f"Steps, n = {REFERENCE}"),
    ]
    for row in content["rows"]:
        assert row["runs"] == 6 and row["plant"] and row["hardware"] and row["zeta"] == 0.001
        assert {row[f"{name}_status"] for name in ("envelope", "rms_error", "max_v")} <= {
            *(WITHIN, BEYOND, OPEN),
        }
    for each in content["rungs"]:
        assert each["us_per_ms"] > 0 and each["cost"] > 0
        if each["against"] == f"{each['plant']} at {1e3 * each['step']:g} ms":
            assert each["envelope_change"] == [0.0]
    *lines, folder = converge.text.splitlines()
    assert "rungs.csv" in folder and "Modes: " in converge.text and max(map(len, lines)) <= 80


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--perturbations", "0"], "perturbations is 0; give 1 or more"),
        (["--rounds", "0"], "rounds is 0; give 1 or more"),
        (["--setting", "sand"], "sand"),
        (["--hardware", "wooden"], "wooden"),
        (["--mjcf", "models/chain6.xml"], "is one chain, of which there is no finer one; leave"),
        (["--modal-damping", "0.1", "0.1", "0.1"], "--modal-damping gives 3 ratios"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(Path(__file__).parents[2])
    out = tmp_path / "run"
    assert main(["converge", "--quick", "--out", str(out), *arguments]) == 2
    shown = capsys.readouterr()
    assert words in shown.err and len(shown.err.splitlines()) == 1
    assert not out.exists()


def stored(name: str) -> dict[str, dict[str, str]]:
    with (STORED / name).open(newline="", encoding="utf-8") as file:
        return {row["ladder"]: row for row in csv.DictReader(file)}


def test_defaults_are_those_of_the_stored_verdicts() -> None:
    """Modes and steps are the cheapest within; the chain's size is as the README says."""
    sizes, every = stored("sizes.csv"), stored("ladders.csv")
    modes, chain = f"assumed-modes:{MODES} at 1 ms", f"closed-chain:{SEGMENTS} at 1 ms"
    own = [Robot().plant(name, setting("simulink")).step for name in ("assumed-modes", "chain")]
    assert own == [1e-3, 1e-3]
    assert sizes["Modes"]["default"] == sizes["Modes"]["cheapest"] == modes
    assert sizes["Modes"]["confirmed"] == "True"
    assert sizes["Segments"]["default"] == chain
    for name, usual in ((f"Steps, n = {MODES}", modes), (f"Steps, N = {SEGMENTS}", chain)):
        assert every[name]["default"] == every[name]["cheapest"] == usual
        assert every[name]["confirmed"] == "True"
    assert "The chain of six is within in eleven of twelve" in (STORED / "README.md").read_text()
