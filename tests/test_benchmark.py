"""The benchmark's arithmetic: loops in turn, the least time, and what counts as a millisecond."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from flexsim import AssumedModesPlant, ChainPlant, ParameterError, Parameters
from studies import benchmark
from studies.benchmark import (
    BenchmarkConfig,
    BenchmarkResult,
    bare_run,
    closed_loop_run,
    command,
    least_cost,
    run,
)

COUNTED = 1e-9  # relative: sums of steps that are no binary fractions


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

    monkeypatch.setattr("studies.benchmark.time.perf_counter", lambda: now)
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


def test_table_states_ratios(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = {"chain_1": 23.0, "bare_mj_step": 20.0}
    made = BenchmarkResult(figures, {3: 0.5}, {6: 20.0}, {1: {"assumed_modes": 1.0, "chain": 2.0}})
    monkeypatch.setattr(benchmark, "run", lambda config: made)
    command(BenchmarkConfig())
    lines: Iterator[str] = iter(capsys.readouterr().out.splitlines())
    rows = {row.split()[1]: row for row in lines if row.startswith("│")}
    assert "1.150" in rows["chain_1"] and "1.000" in rows["bare_mj_step"]
