"""`flexsim tune --live`: what the viewer is shown, and that it decides nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexsim import RunError
from flexsim.loop.metrics import performance_index
from flexsim.recording import viewer
from flexsim.recording.case import Case
from flexsim.recording.tuning import live
from flexsim.recording.tuning.convergence import Course
from studies.main import main

SMALL = "tune --trajectory circle --generations 5 --population 20 --seed 1".split()


class Screen:
    """A viewer that takes down what it is shown, and is closed after some generations."""

    shown: list[tuple[Course, Case | None]]
    closes_after = 99

    def __init__(self, url: str, title: str, most: int, parameters: object) -> None:
        assert (url, most) == ("rerun+http://127.0.0.1:1/proxy", 5)

    def show(self, course: Course, case: Case | None) -> None:
        if len(self.shown) >= self.closes_after:
            raise RunError("no viewer answers")
        self.shown.append((course, case))


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> type[Screen]:
    screen = type("Fresh", (Screen,), {"shown": []})
    monkeypatch.setattr(live, "LiveTuning", screen)
    monkeypatch.setattr(viewer, "running_or_new", lambda url: url)
    return screen


def tuned(folder: Path, *more: str) -> bytes:
    assert main([*SMALL, "--out", str(folder), "--format", "png", *more]) == 0
    return (folder / "generations.csv").read_bytes()


LIVE = ("--live", "--connect", "rerun+http://127.0.0.1:1/proxy")


def test_every_generation_is_shown_and_each_better_individual(
    screen: type[Screen], tmp_path: Path
) -> None:
    tuned(tmp_path / "run", *LIVE)
    assert [len(course.best) for course, _ in screen.shown] == [1, 2, 3, 4, 5]
    last, _ = screen.shown[-1]
    before = np.concatenate([[np.inf], last.best[:-1]])
    better = (last.best < before) & np.isfinite(last.best)
    assert [case is not None for _, case in screen.shown] == list(better) and better.any()
    for (course, case), _ in zip(screen.shown, last.best, strict=True):
        if case is not None:
            (motion,) = case.motions.values()
            assert performance_index(motion) == pytest.approx(course.best[-1], rel=1e-6)
            assert case.reference is not None


def test_a_closed_viewer_does_not_end_the_tuning(
    screen: type[Screen], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plain = tuned(tmp_path / "plain")
    screen.closes_after = 1
    assert tuned(tmp_path / "live", *LIVE) == plain
    assert capsys.readouterr().err.count("no viewer answers; tuning goes on") == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--connect", "rerun+http://127.0.0.1:1/proxy"], "--connect has no effect: nothing is"),
        (["--live", "--connect", "nonsense"], "'nonsense' is no viewer's address"),
        (list(LIVE), "no viewer answers at rerun+http://127.0.0.1:1/proxy; start one"),
    ],
)
def test_refused_before_anything_runs(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*SMALL, "--out", str(tmp_path / "run"), *words]) == 2
    complaint = capsys.readouterr().err
    assert said in complaint and complaint.count("\n") == 1
    assert not list(tmp_path.iterdir())
