"""The benchmark's arithmetic: loops in turn, the least time, and what counts as a millisecond."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from controllers import TUNED_IDEAL
from flexsim import AssumedModesPlant, ChainPlant, ParameterError, Parameters
from studies.core.timing import least_cost
from studies.tools import c_loop
from studies.tools.benchmark import (
    BenchmarkConfig,
    BenchmarkResult,
    command,
    run,
    tables,
    tuning_budget,
    verdict,
)
from studies.tools.timed_loops import (
    BRIEF,
    WHOLE,
    as_drawn,
    bare_run,
    c_run,
    closed_loop_run,
    generation_run,
)
from studies.tuning.individuals import ControllerDesign

COUNTED = 1e-9  # relative: sums of steps that are no binary fractions
ROUNDING = 1e-12  # relative: gains to milliseconds and back


def test_least_cost_is_that_of_the_best_round(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two loops of 10 and 20 simulated ms over three rounds, by a clock we set."""
    taken = {"a": iter([9.0, 3e-5, 2e-5, 4e-5]), "b": iter([9.0, 1e-4, 3e-4, 2e-4])}
    order: list[str] = []
    now = 0.0

    def loop(name: str, simulated: float) -> float:
        nonlocal now
        order.append(name)
        now += next(taken[name])
        return simulated

    monkeypatch.setattr("studies.core.timing.time.perf_counter", lambda: now)
    monkeypatch.setattr("studies.core.timing.TURN", 0.0)
    both = {"a": lambda: loop("a", 10), "b": lambda: loop("b", 20)}
    cost = least_cost(both, rounds=3, clock=lambda: now)
    assert cost == pytest.approx({"a": 2.0, "b": 5.0}, rel=COUNTED)  # us per ms
    assert order == ["a", "b"] * 4  # once to compile, then in turn


def test_loops_tell_what_they_simulated() -> None:
    modes, chain = AssumedModesPlant(Parameters()), ChainPlant.designed(Parameters())
    assert closed_loop_run(modes, 3, 0.1)() == pytest.approx(300, rel=COUNTED)
    assert closed_loop_run(chain, 1, 0.1)() == pytest.approx(100, rel=COUNTED)
    assert bare_run(chain, in_python=True)() == pytest.approx(1e3 * BRIEF, rel=COUNTED)
    assert bare_run(chain, in_python=False)() == pytest.approx(1e3 * BRIEF, rel=COUNTED)


@pytest.mark.parametrize("rounds", [0, -1])
def test_rounds_out_of_range(rounds: int) -> None:
    with pytest.raises(ParameterError, match=f"rounds is {rounds}; give 1 or more"):
        run(BenchmarkConfig(rounds=rounds))


@pytest.mark.parametrize("seconds", [0.0, -1.0, 6.0, float("nan")])
def test_seconds_out_of_range(seconds: float) -> None:
    with pytest.raises(ParameterError, match=f"seconds is {seconds}; give 0.01 to 5"):
        run(BenchmarkConfig(seconds=seconds))


def test_table_states_ratios() -> None:
    figures = {"chain_1": 23.0, "assumed_modes_1": 0.5, "bare_mj_step": 20.0, "c_loop": 0.4}
    made = BenchmarkResult(figures, {3: 0.5}, {6: 20.0}, {1: {"assumed_modes": 1.0, "chain": 2.0}})
    costs = tables(made)[0]
    rows = [costs.cells(line) for line in costs.lines()]
    assert rows == [
        ["chain_1", "23.000", "1.150", "0.92 at most"],
        ["assumed_modes_1", "0.500", "0.025", "1.250 of c_loop, 1.2 at most"],
        ["bare_mj_step", "20.000", "1.000", ""],
        ["c_loop", "0.400", "0.020", ""],
    ]
    assert command.content(made)["ratios"]["assumed_modes_1 / c_loop"] == pytest.approx(1.25)


def test_a_loop_that_was_not_timed_is_none_and_said() -> None:
    figures = {"assumed_modes_1": 0.5, "bare_mj_step": 20.0, "c_loop": None}
    made = BenchmarkResult(figures, {}, {}, {}, notes=("no C compiler",))
    costs = tables(made)[0]
    assert [costs.cells(line)[1:] for line in costs.lines()][2] == ["-", "-", ""]
    assert verdict(made).splitlines() == ["no C compiler"]
    assert command.content(made)["ratios"]["assumed_modes_1 / c_loop"] is None


@pytest.mark.skipif(shutil.which(c_loop.COMPILER) is None, reason="no C compiler")
@pytest.mark.parametrize("modes", [1, 3, 5])
def test_the_loop_in_c_is_the_same(modes: int) -> None:
    """c_run itself refuses one that moves otherwise; a wrong number in it is seen."""
    plant = AssumedModesPlant(Parameters(zeta=0.0), modes)
    in_c, note = c_run(plant)
    assert in_c is not None and not note
    assert in_c() == pytest.approx(1e3 * WHOLE, rel=COUNTED)


@pytest.mark.skipif(shutil.which(c_loop.COMPILER) is None, reason="no C compiler")
def test_a_loop_in_c_that_moves_otherwise_is_not_timed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / "other.c"
    text = c_loop.SOURCE.read_text()
    assert "wb * wb * (p->mass[j] * e - N_e)" in text
    other.write_text(text.replace("wb * wb * (p->mass[j] * e - N_e)", "wb * wb * p->mass[j] * e"))
    monkeypatch.setattr(c_loop, "SOURCE", other)
    in_c, note = c_run(AssumedModesPlant(Parameters()))
    assert in_c is None and "c_loop is not timed" in note


def test_without_a_compiler_there_is_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(c_loop, "COMPILER", "no-such-compiler")
    assert c_run(AssumedModesPlant(Parameters())) == (
        None,
        "no C compiler (cc) here: c_loop is not timed",
    )


def test_generations_are_near_the_tuned_controller_and_run_to_the_end() -> None:
    modes = AssumedModesPlant(Parameters())
    center = as_drawn(TUNED_IDEAL["circle"])
    drawn = TUNED_IDEAL["circle"].joint2
    assert center[5] == pytest.approx(drawn.k1 * 1000**drawn.nu1)
    ((one, two),) = ControllerDesign().filters(center[None])
    for built, own in zip((one, two), TUNED_IDEAL["circle"].filters(1e-3), strict=True):
        assert built[0] == pytest.approx(own[0], rel=ROUNDING)
    once = generation_run(modes, 0.1)
    assert once() == pytest.approx(4400, rel=COUNTED)  # 44 individuals of 100 ms
    assert once() == pytest.approx(4400, rel=COUNTED)


def test_tuning_budget_divides_by_what_it_says() -> None:
    """A generation on two threads at 0.6 us a simulated ms, the population at 0.5, or 1 on one."""
    costs = {"chain_50": 1.0, "chain 2": 0.5, "chain generation": 0.6}
    costs |= {key.replace("chain", "assumed_modes"): 2 * cost for key, cost in costs.items()}
    found = tuning_budget(costs | {"bare_mj_step": 9.0}, threads=2)
    assert list(found) == ["chain", "assumed_modes"]
    assert found["chain"]["simulations"] == 50 + 99 * 44
    assert found["chain"]["seconds"] == pytest.approx(4406 * 5000 * 0.6e-6)
    assert found["chain"]["ratio"] == pytest.approx(0.6 / (1.0 / 2))
    assert found["chain"]["ratio_threaded"] == pytest.approx(0.6 / 0.5)
    assert found["assumed_modes"]["seconds"] == pytest.approx(2 * found["chain"]["seconds"])


def test_budget_is_stated() -> None:
    budget = {"simulations": 4406, "seconds": 61.25, "ratio": 1.125, "ratio_threaded": 1.05}
    made = BenchmarkResult({"bare_mj_step": 20.0}, {}, {}, {}, {"chain": budget})
    stated = tables(made)[1]
    assert stated.cells(stated.rows) == ["chain", "4406", "61.2", "1.125", "1.050"]
    assert command.content(made)["tuning_budget"]["chain"] == budget
