"""The benchmark's arithmetic: loops in turn, the least time, and what counts as a millisecond."""

from __future__ import annotations

import pytest

from controllers import TUNED
from flexsim import AssumedModesPlant, ChainPlant, ParameterError, Parameters
from studies.core.timing import least_cost
from studies.tools.benchmark import (
    BenchmarkConfig,
    BenchmarkResult,
    as_drawn,
    bare_run,
    closed_loop_run,
    command,
    generation_run,
    run,
    tables,
    tuning_budget,
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
    cost = least_cost({"a": lambda: loop("a", 10), "b": lambda: loop("b", 20)}, rounds=3)
    assert cost == pytest.approx({"a": 2.0, "b": 5.0}, rel=COUNTED)  # us per ms
    assert order == ["a", "b"] * 4  # once to compile, then in turn


def test_loops_tell_what_they_simulated() -> None:
    modes, chain = AssumedModesPlant(Parameters()), ChainPlant.designed(Parameters())
    assert closed_loop_run(modes, 3, 0.1)() == pytest.approx(300, rel=COUNTED)
    assert closed_loop_run(chain, 1, 0.1)() == pytest.approx(100, rel=COUNTED)
    assert bare_run(chain, in_python=True)() == pytest.approx(1000, rel=COUNTED)
    assert bare_run(chain, in_python=False)() == pytest.approx(5000, rel=COUNTED)


@pytest.mark.parametrize("rounds", [0, -1])
def test_rounds_out_of_range(rounds: int) -> None:
    with pytest.raises(ParameterError, match=f"rounds is {rounds}; give 1 or more"):
        run(BenchmarkConfig(rounds=rounds))


@pytest.mark.parametrize("seconds", [0.0, -1.0, 6.0, float("nan")])
def test_seconds_out_of_range(seconds: float) -> None:
    with pytest.raises(ParameterError, match=f"seconds is {seconds}; give 0.01 to 5"):
        run(BenchmarkConfig(seconds=seconds))


def test_table_states_ratios() -> None:
    figures = {"chain_1": 23.0, "bare_mj_step": 20.0}
    made = BenchmarkResult(figures, {3: 0.5}, {6: 20.0}, {1: {"assumed_modes": 1.0, "chain": 2.0}})
    costs = tables(made)[0]
    rows = [costs.cells(line) for line in costs.lines()]
    assert rows == [["chain_1", "23.000", "1.150"], ["bare_mj_step", "20.000", "1.000"]]


def test_generations_are_near_the_tuned_controller_and_run_to_the_end() -> None:
    modes = AssumedModesPlant(Parameters())
    center = as_drawn(TUNED["circle"])
    drawn = TUNED["circle"].joint2
    assert center[5] == pytest.approx(drawn.k1 * 1000**drawn.nu1)
    ((one, two),) = ControllerDesign().filters(center[None])
    for built, own in zip((one, two), TUNED["circle"].filters(1e-3), strict=True):
        assert built[0] == pytest.approx(own[0], rel=ROUNDING)
    once = generation_run(modes, 0.1)
    assert once() == pytest.approx(4400, rel=COUNTED)  # 44 individuals of 100 ms
    assert once() == pytest.approx(4400, rel=COUNTED)


def test_tuning_budget_divides_by_what_it_says() -> None:
    """A generation on two threads at 0.6 us a simulated ms, the population at 0.5, or 1 on one."""
    costs = {"chain_50": 1.0, "chain 2": 0.5, "chain generation": 0.6}
    costs |= {key.replace("chain", "assumed_modes"): 2 * cost for key, cost in costs.items()}
    found = tuning_budget(costs, threads=2)
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
