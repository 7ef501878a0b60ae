"""The loop that `flexsim watch` closes at every save: envelopes with intervals, growth, poles."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from edits import DEFAULT, EDITS
from rerun.chunk import RrdReader

from flexsim.loop.hardware import HARDWARE
from flexsim.robot import Robot
from studies.main import main
from studies.watch.closed_loop import RUNS, LoopAsked, asked_of, looped
from studies.watch.loop_recording import placed
from studies.watch.loop_report import loop_text, moved
from studies.watch.recording import RecordingFile
from studies.watch.report import json_line, show_save
from studies.watch.save import Save, answered

WIDTH = 80  # columns of a terminal
BENCH = replace(HARDWARE["bench"], seed=1)
SAME_GROWTH = 1e-4  # relative: plants of one beam
EDITED_GROWTH = 2e-3  # relative: of three modes and a chain whose segments differ
SAME_HZ = 5e-4  # relative, of the first three poles
PUBLISHED = (0.0135, 0.0155)  # [m] within the README's median of the circle, 14.5 mm
IDEALS = 40.0  # [1/s] at which loops tuned without delay grow with it, at least: 42.5 found


@pytest.fixture(scope="module")
def asked() -> LoopAsked:
    return asked_of("circle", hardware=BENCH)


@pytest.fixture(scope="module")
def saves(asked: LoopAsked, tmp_path_factory: pytest.TempPathFactory) -> list[Save]:
    """Return two saves with their loops: the default, and one with a soft hinge."""
    folder = tmp_path_factory.mktemp("loops")
    found = []
    for number, text in enumerate((DEFAULT, EDITS["soft hinge"]), start=1):
        (folder / "my.xml").write_text(text)
        at = datetime(2024, 5, 1)
        found.append(answered(folder / "my.xml", number=number, when=at, asked=asked))
    return found


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("my.xml").write_text(DEFAULT)


def test_both_plants_agree_on_envelope_growth_and_poles(saves: list[Save]) -> None:
    loop = saves[0].loop
    assert loop is not None and loop.problem == ""
    modes, chain = (loop.loops[key] for key in ("assumed_modes", "chain"))
    for each in (modes, chain):
        assert each.medians is not None and each.medians.runs == RUNS
        assert each.medians.envelope is not None and not each.medians.diverged
        assert PUBLISHED[0] < each.medians.envelope < PUBLISHED[1]
        assert each.growth < 0 and each.gain_margin > 1.1
        assert each.error is not None and 0 < each.error.max() < 0.1
    assert chain.growth == pytest.approx(modes.growth, rel=SAME_GROWTH)
    for one, other in zip(modes.slowest[:3], chain.slowest[:3], strict=True):
        assert one["hz"] == pytest.approx(other["hz"], rel=SAME_HZ)


def test_an_edit_moves_the_poles(saves: list[Save]) -> None:
    """A softer beam has slower poles, on both plants alike."""
    first, second = (save.loop for save in saves)
    assert first is not None and second is not None
    for key in ("assumed_modes", "chain"):
        assert second.loops[key].slowest[0]["hz"] < first.loops[key].slowest[0]["hz"] - 0.01
    chain, modes = (second.loops[key].growth for key in ("chain", "assumed_modes"))
    assert chain == pytest.approx(modes, rel=EDITED_GROWTH)


def test_what_grows_is_said(saves: list[Save]) -> None:
    """Negative control: controllers of the ideal loop do not hold with a sample of delay."""
    unfit = asked_of("ideal-circle", friction="none", hardware=HARDWARE["delayed"])
    answer = looped(saves[0].robot, unfit)
    assert all(each.growth > IDEALS and each.gain_margin == 1 for each in answer.loops.values())
    found = [each.medians for each in answer.loops.values()]
    assert all(each is not None and each.diverged_share == 1 for each in found)
    text = loop_text(answer, None)
    assert f"{RUNS} of {RUNS} diverge" in text


def test_a_uniform_beam_has_the_exact_poles_beside(asked: LoopAsked) -> None:
    answer = looped(Robot.of("my.xml", "analytic"), asked)
    loops = answer.loops
    assert list(loops) == ["assumed_modes", "chain", "exact"]
    assert loops["exact"].medians is None and loops["exact"].error is None
    assert loops["exact"].growth == pytest.approx(loops["chain"].growth, rel=SAME_GROWTH)
    assert "exact" in loop_text(answer, None)


def test_a_loop_that_cannot_be_closed_is_a_problem_of_the_loop(asked: LoopAsked) -> None:
    far = replace(asked, path=replace(asked.path, centre=(0.8, 0.5)))
    save = answered(Path("my.xml"), asked=far)
    assert save.loop is not None and "out of reach" in save.loop.problem
    shown = json.loads(json_line(save.when, save))
    assert shown["ok"] and "out of reach" in shown["loop_error"] and shown["poles"] == {}
    assert "No loop could be closed" in loop_text(save.loop, None)
    RecordingFile(Path("watch.rrd")).show([save])


def test_the_console_fits_a_terminal(
    saves: list[Save], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    show_save(saves[1], saves[0])
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= WIDTH
    assert "Closed loop: circle on the circle, setting simulink" in shown
    rows = {line.split("]")[0].strip() + "]": line.split() for line in shown.splitlines()}
    assert rows["growth [1/s]"][2].startswith("-0.0") and rows["pole 1 [Hz]"][4][0] == "-"
    assert moved(2.0, 1.5) == "+0.5" and moved(2.0, 2.0) == "=" and moved(2.0, None) == ""


def test_the_recording_has_errors_poles_and_words(saves: list[Save]) -> None:
    RecordingFile(Path("watch.rrd")).show(saves)
    chunks = RrdReader(Path("watch.rrd")).store().stream().to_chunks()
    moving = {each.entity_path for each in chunks if not each.is_static}
    still = {each.entity_path for each in chunks if each.is_static}
    plants = ("assumed_modes", "chain")
    assert {f"/loop/tip_error/{plant}" for plant in plants} <= moving
    assert {
        f"/loop/poles/{when}/{plant}" for when in ("now", "before") for plant in plants
    } <= still
    assert {"/loop/words", "/loop/poles/axes"} <= still
    assert {"/arm/before", "/arm/curves"} <= moving  # what it had


def test_the_chart_parts_what_grows_from_what_does_not() -> None:
    poles = np.array([-0.01 + 14j, 0.01 + 14j, -50.0, 1e9 + 1e9j])
    x, y = placed(poles).T
    assert x[0] == -x[1] < 0 and x[2] < x[0] and x[3] == 1 and y[3] == -1 and y[2] == 0
    assert -1 < y[0] == y[1] < 0


def test_once_as_json_and_without_a_loop(
    saves: list[Save], capsys: pytest.CaptureFixture[str]
) -> None:
    found = []
    for more in ([], ["--no-loop"]):
        assert main(["watch", "my.xml", "--once", "--json", "--no-viewer", *more]) == 0
        found.append(json.loads(capsys.readouterr().out))
    with_loop, without = found
    loop = saves[0].loop
    assert loop is not None  # the default's: circle, simulink, bench
    assert with_loop["growth"] == {key: each.growth for key, each in loop.loops.items()}
    assert with_loop["envelope"]["chain"] == loop.loops["chain"].medians.envelope  # type: ignore[union-attr]
    assert with_loop["poles"]["chain"][0]["growth"] == with_loop["growth"]["chain"]
    assert without["envelope"] is without["poles"] is without["loop_error"] is None
    assert {key: without[key] for key in ("clamped_hz", "tip_rms")} == {
        key: with_loop[key] for key in ("clamped_hz", "tip_rms")
    }


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("--controller sircle", "controller 'sircle' is unknown"),
        ("--trajectory square", "'square'"),
        ("--setting ice", "'ice'"),
        ("--hardware tin", "'tin'"),
        ("--hardware-delay -1", "delay"),
        ("--seed -1", "seed is -1"),
        ("--loop maybe", "maybe"),
    ],
)
def test_a_loop_that_there_is_not_is_refused_in_one_line(
    arguments: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["watch", "my.xml", "--no-viewer", "--once", *arguments.split()]) == 2
    said = capsys.readouterr()
    assert said.out == "" and words in said.err and said.err.count("\n") == 1
