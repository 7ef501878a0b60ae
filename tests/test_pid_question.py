"""What decides the paper's negative result: the quick study, its keys and its direction."""

import json
from pathlib import Path

import pytest

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
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["pid-question", "--quick", "--json", "--out", str(tmp_path / "run")]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert all(set(row) >= KEYS for row in rows)
    share = {(row["order"], row["realisation"], row["range"]): row for row in rows}
    papers = share["integer", "truncated", "table-1"]
    assert papers["stable_draws"] == papers["stable_runs"] == 0
    assert papers["best_index"] is None
    textbook = share["integer", "textbook", "log-uniform"]
    assert textbook["stable_draws"] > 0.5
    assert textbook["best_index"] > 0
    assert (tmp_path / "run" / "results.csv").is_file()
    assert main(["pid-question", "--quick", "--out", str(tmp_path / "run")]) == 2
