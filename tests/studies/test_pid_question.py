"""What decides the paper's negative result: the quick study, its keys and its direction."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from quick_run import QuickRun

from studies.core.evidence.intervals import share_interval, share_of
from studies.core.evidence.repeats import summary
from studies.main import main
from studies.pid_question.pid_question import PidQuestionConfig, cases, searched
from studies.pid_question.report import CaseRow, Names, PidQuestionResult, tables, verdict

KEYS = {
    "order",
    "realisation",
    "range",
    "plant",
    "setting",
    "seeds",
    "stable_draws",
    "stable_runs",
    "best_index",
}


def test_textbook_and_log_uniform_draws_are_stable_where_the_papers_are_not(
    quick: Callable[[str], QuickRun],
) -> None:
    run = quick("pid-question")
    assert run.faults() == []
    rows = run.content["rows"]
    assert all(set(row) >= KEYS for row in rows)
    share = {(row["order"], row["realisation"], row["range"]): row for row in rows}
    papers = share["integer", "truncated", "table-1"]
    assert papers["stable_draws"] == papers["stable_runs"] == 0
    assert papers["best_index"] is None
    textbook = share["integer", "textbook", "log-uniform"]
    assert textbook["stable_draws"] > 0.5
    assert textbook["best_index"] > 0
    for row in rows:
        assert row["stable_draws"] <= row["bounded_draws"]
        assert row["stable_runs"] <= row["bounded_runs"]
        counts = {"draws": row["draws"], "runs": row["seeds"]}
        shares = [(f"{of}_{what}", counts[what]) for of in ("bounded", "stable") for what in counts]
        for name, count in shares:
            ends = share_interval(round(row[name] * count), count)
            assert (row[f"{name}_low"], row[f"{name}_high"]) == ends
        assert row["best_index_low"] is None  # of two searches there is no interval
    assert run.files == {"config.json", "tables.json", "figures", "results.csv", "searches.csv"}
    assert len(run.table("searches.csv")) == len(rows) * 2
    assert main(["pid-question", "--quick", "--out", str(run.folder)]) == 2


def made_row(plant: str, stable: float, best: list[float]) -> CaseRow:
    kind = ("integer", "truncated", "table-1")
    share = share_of("stable_draws", [i < stable * 100 for i in range(100)])
    runs = share_of("stable_runs", [True] * len(best))
    bounded = {name.replace("stable", "bounded"): each for name, each in {**share, **runs}.items()}
    figures: dict[str, Any] = {**bounded, **share, **runs, **summary("best_index", best)}
    return CaseRow(
        Names(*kind, plant, "none"),
        len(best),
        **figures,
        best_index_least=min(best),
        best_index_most=max(best),
        draws=100,
        evaluations=1,
        generations_most=1,
    )


def test_cells_have_intervals_or_the_range() -> None:
    many = made_row("assumed-modes", 0.05, [i * 1e-5 for i in range(1, 11)])
    few = made_row("chain", 0.15, [2e-4, 3e-4, 7e-4])
    result = PidQuestionResult([many, few], [], "circle")
    cells = [tables(result)[0].cells([row]) for row in (many, few)]
    assert cells[0][:3] == ["PID by (2)", "Table 1", "5 [2, 11]"]
    assert cells[0][3:] == ["5 [2, 11]", "100 [72, 100]", "0.6 [0.2, 0.9]"]
    assert cells[1][-1] == "3 (2 to 7)"
    # the same draws on both plants: no more is known of a tenth than of 10 of 100
    assert " 10 [6, 17] of draws  100 [72, 100] of runs" in verdict(result)


def test_bounded_is_not_yet_stable() -> None:
    """A fractional draw that the simulation bounds, and that grows on the exact linear loop."""
    config = PidQuestionConfig(plants=("assumed-modes",), settings=("simulink",), seeds=1)
    (case,) = (
        each for each in cases(config) if each.names.kind == ("fractional", "truncated", "table-1")
    )
    (row,) = searched(
        replace(case, tuning=replace(case.tuning, generations=1)), [1], None, lambda: None
    )
    assert row.bounded_draws > row.stable_draws and row.best_index is not None
    assert not row.best_stable


@pytest.mark.parametrize(
    "words, named",
    [
        ("--seeds 0", "seeds"),
        ("--seed -1", "seed"),
        ("--plants chain chain", "plants"),
        ("--plants beam", "beam"),
        ("--settings ice", "ice"),
        ("--plants assumed-modes --chain-generations -2", "chain generations"),
        ("--segments 0", "segments"),
        ("--threads 0", "threads"),
    ],
)
def test_a_wrong_option_is_one_line_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: str, named: str
) -> None:
    assert main(["pid-question", *words.split(), "--out", str(tmp_path / "run")]) == 2
    complaint = capsys.readouterr().err
    assert named in complaint and complaint.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
