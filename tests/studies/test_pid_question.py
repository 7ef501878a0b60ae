"""What decides the paper's negative result: the quick study, its keys and its direction."""

from collections.abc import Callable
from pathlib import Path

import pytest
from quick_run import QuickRun

from studies.main import main

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
    rows = run.content["rows"]
    assert all(set(row) >= KEYS for row in rows)
    share = {(row["order"], row["realisation"], row["range"]): row for row in rows}
    papers = share["integer", "truncated", "table-1"]
    assert papers["stable_draws"] == papers["stable_runs"] == 0
    assert papers["best_index"] is None
    textbook = share["integer", "textbook", "log-uniform"]
    assert textbook["stable_draws"] > 0.5
    assert textbook["best_index"] > 0
    assert run.files == {"config.json", "figures", "results.csv", "searches.csv"}
    assert len(run.table("searches.csv")) == len(rows) * 2
    assert main(["pid-question", "--quick", "--out", str(run.folder)]) == 2


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
