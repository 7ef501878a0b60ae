"""`flexsim watch`: every save is answered once, a broken one in one line, and watching goes on."""

from __future__ import annotations

import functools
import json
import os
import re
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from edits import DEFAULT, EDITS, edited
from rerun.chunk import RrdReader

from flexsim import ModelError, RunError, load_chain
from flexsim.mjcf import differences as mjcf_differences
from flexsim.mjcf.designed import designed_chain
from flexsim.mjcf.reading.names import Names
from flexsim.recording import viewer as watch_viewer
from flexsim.recording.viewer import answers
from studies.main import main
from studies.watch import watch as watch_module
from studies.watch.files import POLL, snapshot_of
from studies.watch.recording import RecordingFile, changes_of, text_of
from studies.watch.report import change, show_save
from studies.watch.save import Save, answered
from studies.watch.watch import Watch, WatchConfig

SOFT = EDITS["soft hinge"]
CLAMPED = 1e-9  # relative: the design tunes these to rounding
SMALL_TIP = 1e-5  # [m] rms between the default plants over 2 s, promised
WIDTH = 80  # columns of a terminal
BAD = {  # what the line must name
    "empty": ("", "my.xml: the MJCF file is empty"),
    "negative stiffness": (edited('hinge1" stiffness="', 'hinge1" stiffness="-'), "joint 'hinge1'"),
    "negative mass": (edited('mass="0.47"', 'mass="-0.47"'), "body 'hub'"),
    "missing joint": (re.sub(r'.*name="joint2" damp.*\n', "", DEFAULT), "'joint2'"),
    "renamed actuator": (edited('motor name="motor2"', 'motor name="drive2"'), "'motor2'"),
    "long step": (edited('timestep="0.001"', 'timestep="0.005"'), "timestep 0.005 s"),
    "no such include": ('<mujoco><include file="gone.xml"/></mujoco>', "'gone.xml'"),
    "half a file": (DEFAULT[: len(DEFAULT) // 2], "my.xml: not valid MJCF"),
}


class Script:
    """A clock that edits files at given times [s] and presses Ctrl-C at the end."""

    def __init__(self, end: float, **deeds: Callable[[], object]) -> None:
        self.time, self.end = 0.0, end
        self.ahead = sorted((float(at[1:].replace("_", ".")), deed) for at, deed in deeds.items())

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self.time += seconds
        while self.ahead and self.ahead[0][0] <= self.time:
            self.ahead.pop(0)[1]()
        if self.time > self.end:
            raise KeyboardInterrupt


class Shown:
    """A screen that remembers what it was shown: the number of good saves, and the error."""

    def __init__(self, problem: str | None = None) -> None:
        self.seen: list[tuple[int, str | None]] = []
        self.problem = problem

    def show(self, saves: list[Save], error: str | None = None) -> None:
        self.seen.append((len(saves), error))
        if self.problem:
            raise RunError(self.problem)


designed = functools.cache(designed_chain)  # the default of every answer, tuned once


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(mjcf_differences, "designed_chain", designed)
    write(DEFAULT)


@pytest.fixture(scope="module")
def saves(tmp_path_factory: pytest.TempPathFactory) -> list[Save]:
    """Return three saves: the default, a soft hinge, dampers in the hinges."""
    folder = tmp_path_factory.mktemp("saves")
    found = []
    for number, text in enumerate((DEFAULT, SOFT, EDITS["damped"]), start=1):
        (folder / "my.xml").write_text(text)
        found.append(answered(folder / "my.xml", number=number, when=datetime(2024, 5, 1)))
    return found


@pytest.fixture
def quick(saves: list[Save], monkeypatch: pytest.MonkeyPatch) -> None:
    """Check the file in earnest, but answer with what another brought."""

    def answer(
        path: Path, beam: str, number: int, when: datetime, names: Names, asked: object
    ) -> Save:
        chain = load_chain(path, names=names)
        return replace(saves[0], chain=chain, number=number, when=when)

    monkeypatch.setattr(watch_module, "answered", answer)


def write(text: str, name: str = "my.xml") -> None:
    Path(name).write_text(text)


def replaced(text: str) -> None:
    """Save as many editors do: another file takes the name."""
    write(text, "my.xml.new")
    os.replace("my.xml.new", "my.xml")


def watched(
    capsys: pytest.CaptureFixture[str], script: Script, screen: Shown | None = None
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the answers and the lines on stderr of a watched session."""
    watch = Watch(WatchConfig(Path("my.xml"), json=True), screen, script.sleep)
    with pytest.raises(KeyboardInterrupt):
        watch.run()
    assert not script.ahead, "the session ended before the script"
    said = capsys.readouterr()
    return [json.loads(line) for line in said.out.splitlines()], said.err.splitlines()


def test_a_save_is_answered(capsys: pytest.CaptureFixture[str]) -> None:
    found, complaints = watched(capsys, Script(3, t1=lambda: write(SOFT)))
    assert complaints == [] and [answer["save"] for answer in found] == [1, 2]
    first, second = found
    assert first["differences"] == [] and first["tip_rms"] < SMALL_TIP
    (row,) = [row for row in second["differences"] if row["element"] == "hinge3"]
    assert row["attribute"] == "stiffness [N m/rad]" and row["yours"] == "1.72894"
    for plant in ("assumed_modes", "chain"):
        for key in ("clamped_hz", "joint_free_hz"):
            assert np.all(np.array(second[key][plant]) < first[key][plant])
    ratio = np.array(second["clamped_hz"]["chain"]) / second["clamped_hz"]["assumed_modes"]
    assert np.abs(ratio - 1).max() < CLAMPED


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("bad", BAD)
def test_a_bad_edit_is_one_line_and_a_good_one_recovers(
    bad: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text, words = BAD[bad]
    screen = Shown()
    script = Script(5, t1=lambda: write(text), t3=lambda: write(SOFT))
    found, complaints = watched(capsys, script, screen)
    assert [answer["ok"] for answer in found] == [True, False, True]
    (line,) = complaints
    assert line.startswith("flexsim: my.xml: ") and words in line
    assert line == f"flexsim: {found[1]['error']}" and found[1]["clamped_hz"] is None
    assert [error for _, error in screen.seen] == [None, found[1]["error"], None]
    assert found[2]["error"] is None and found[2]["save"] == 2


@pytest.mark.usefixtures("quick")
def test_a_file_bad_from_the_start_is_watched(capsys: pytest.CaptureFixture[str]) -> None:
    write("")
    found, complaints = watched(capsys, Script(4, t2=lambda: write(DEFAULT)))
    assert [answer["ok"] for answer in found] == [False, True] and len(complaints) == 1


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("pause", [POLL, 3 * POLL])
def test_a_half_written_file_is_waited_for(
    pause: float, capsys: pytest.CaptureFixture[str]
) -> None:
    rest = f"t{1 + pause}".replace(".", "_")
    half = SOFT[: len(SOFT) // 2]
    script = Script(4, t1=lambda: write(half), **{rest: lambda: write(SOFT)})
    found, complaints = watched(capsys, script)
    assert complaints == [] and [answer["save"] for answer in found] == [1, 2]


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("gap", [False, True])
def test_a_file_replaced_by_another_is_noticed(
    gap: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    deeds: dict[str, Callable[[], object]] = {"t1_3": lambda: replaced(SOFT)}
    if gap:
        deeds["t1"] = lambda: Path("my.xml").unlink()
    found, complaints = watched(capsys, Script(3, **deeds))
    assert complaints == [] and [answer["save"] for answer in found] == [1, 2]


@pytest.mark.usefixtures("quick")
def test_nothing_changed_nothing_said(capsys: pytest.CaptureFixture[str]) -> None:
    later = time.time() + 5
    script = Script(
        5,
        t1=lambda: os.utime("my.xml", (later, later)),
        t2=lambda: replaced(DEFAULT),
        t3=lambda: write(DEFAULT[:2000]),
        t3_2=lambda: write(DEFAULT),
    )
    found, complaints = watched(capsys, script)
    assert complaints == [] and len(found) == 1


@pytest.mark.usefixtures("quick")
def test_a_deleted_file_is_awaited(capsys: pytest.CaptureFixture[str]) -> None:
    script = Script(5, t1=lambda: Path("my.xml").unlink(), t3=lambda: write(DEFAULT))
    found, complaints = watched(capsys, script)
    assert complaints == ["flexsim: my.xml: the file is gone; waiting for it to return"]
    assert [answer["ok"] for answer in found] == [True, False, True]


def test_what_never_ends_or_never_begins_is_no_include(capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo("pipe")
    for name, words in (("/dev/zero", "a device"), ("pipe", "a pipe"), (".", "a folder")):
        write(f'<mujoco><include file="{name}"/></mujoco>')
        seen = snapshot_of(Path("my.xml"))
        assert list(seen.contents.values())[1:] == [None]
        with pytest.raises(SystemExit, match="2"):
            main(["watch", "my.xml", "--once", "--no-viewer"])
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and f"it is {words}" in said


@pytest.mark.usefixtures("quick")
def test_included_files_are_watched(capsys: pytest.CaptureFixture[str]) -> None:
    write("<mujoco><!-- <include file='old.xml'/> --><include file='arm.xml'/></mujoco>")
    assert [path.name for path in snapshot_of(Path("my.xml")).stamps] == ["my.xml", "arm.xml"]
    script = Script(6, t2=lambda: write(DEFAULT, "arm.xml"), t4=lambda: write(SOFT, "arm.xml"))
    found, complaints = watched(capsys, script)
    assert [answer["ok"] for answer in found] == [False, True, True]
    assert len(complaints) == 1 and "'arm.xml'" in complaints[0]
    assert found[1]["differences"] == [] != found[2]["differences"]


@pytest.mark.usefixtures("quick")
def test_a_screen_that_fails_is_said_and_watched_on(capsys: pytest.CaptureFixture[str]) -> None:
    screen = Shown("no viewer answers at X")
    found, complaints = watched(capsys, Script(3, t1=lambda: write(SOFT)), screen)
    assert complaints == ["flexsim: no viewer answers at X"] * 2
    assert [count for count, _ in screen.seen] == [1, 2] and all(a["ok"] for a in found)


def test_the_console_fits_a_terminal(
    saves: list[Save], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    show_save(saves[1], saves[0])
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= WIDTH
    row = next(line for line in shown.splitlines() if "clamped 1 [Hz]" in line)
    assert row.split() == "clamped 1 [Hz] 3.06458 -8.172 % 3.06458 -8.172 %".split()
    assert "save 2; change: since save 1" in shown and "damping ratio 1 [-]" in shown
    show_save(saves[2], None)
    shown = capsys.readouterr().out
    assert "damping ratio 3 [-]" in shown and "%" not in shown


def test_changes_are_in_percent() -> None:
    assert [change(2.0, 1.0), change(1.0, 1.0), change(1.0, None)] == ["+100.000 %", "=", ""]
    assert change(0.1, 0.0) == ""  # damping where there was none


def test_texts_say_what_is_wrong_and_what_is_shown(saves: list[Save]) -> None:
    text = text_of(saves[:2], "my.xml: joint 'hinge1' has stiffness -1")
    assert text.startswith("# Not usable") and "'hinge1'" in text and "of save 2, 00:00:00" in text
    assert "**bad**" in text_of([], "bad") and "hinge3" in changes_of(saves[1], None)
    assert "the same robot" in changes_of(saves[0], None).lower()


def test_once_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main("watch my.xml --once --json --no-viewer".split()) == 0
    said = capsys.readouterr()
    (answer,) = map(json.loads, said.out.splitlines())
    assert said.err == "" and answer["ok"] and answer["error"] is None
    keys = "time ok error save clamped_hz joint_free_hz damping_ratio tip_rms differences"
    more = "envelope envelope_low envelope_high diverged_share growth gain_margin poles loop_error"
    assert list(answer) == [*keys.split(), *more.split()]
    datetime.fromisoformat(answer["time"])


def test_once_with_a_bad_file_has_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    write("")
    with pytest.raises(SystemExit) as stop:
        main("watch my.xml --once --no-viewer".split())
    assert stop.value.code == 2
    assert capsys.readouterr() == ("", "flexsim: my.xml: the MJCF file is empty\n")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("none.xml", "there is no file none.xml; give an MJCF file that exists"),
        ("my.xml --no-viewer --rrd a.rrd", "--connect, --no-viewer and --rrd exclude each other"),
        (
            "my.xml --rrd none/a.rrd",
            "none/a.rrd: cannot write the recording: there is",
        ),
        ("my.xml --connect nonsense", "'nonsense' is no viewer's address; give one as rerun+http"),
    ],
)
def test_refused_in_one_line(
    arguments: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["watch", *arguments.split()]) == 2
    said = capsys.readouterr()
    assert said.out == "" and words in said.err and said.err.count("\n") == 1


def test_a_viewer_that_does_not_answer_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        url = f"rerun+http://127.0.0.1:{listening.getsockname()[1]}/proxy"
        assert answers(url)
    assert main(["watch", "my.xml", "--connect", url]) == 2
    assert capsys.readouterr().err.startswith(f"flexsim: no viewer answers at {url}")


def test_without_a_viewer_it_prints(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = (sys.executable, "-c", "import sys; sys.exit(1)")
    monkeypatch.setattr(watch_viewer, "RERUN_TOOL", broken)
    monkeypatch.setattr(watch_viewer, "answers", lambda url: False)
    monkeypatch.setattr(watch_viewer, "STAYS", 0.0)
    assert main("watch my.xml --once".split()) == 0
    said = capsys.readouterr()
    assert "cannot start, as without a display; printing only" in said.err
    assert "clamped 1 [Hz]" in said.out


def test_the_recording_holds_arms_curves_modes_and_history(saves: list[Save]) -> None:
    RecordingFile(Path("watch.rrd")).show(saves)
    assert sorted(path.name for path in Path().iterdir()) == ["my.xml", "watch.rrd"]
    reader = RrdReader(Path("watch.rrd"))
    chunks = reader.store().stream().to_chunks()
    moving = {c.entity_path for c in chunks if not c.is_static}
    still = {c.entity_path for c in chunks if c.is_static}
    for plant in ("assumed-modes", "chain"):
        assert {f"/arm/scene/{plant}/beam", f"/arm/scene/{plant}/tip"} <= moving
    assert {"/arm/curves", "/arm/before", "/arm/solids/boxes"} <= moving
    (curves,) = (c for c in chunks if c.entity_path == "/arm/curves")
    assert {"assumed_modes", "chain", "difference"} <= set(curves.to_record_batch().schema.names)
    assert {"/frequencies", "/differences", "/mode_shapes/lines", "/history/marks"} <= still
    (history,) = (c for c in chunks if c.entity_path == "/history_hz" and not c.is_static)
    assert history.timeline_names == ["save"]
    batch = history.to_record_batch()
    column = next(name for name in batch.schema.names if name.endswith("scalars"))
    hertz = np.array(batch.column(column).to_pylist())
    assert np.array_equal(hertz, [save.modes.clamped_hz["chain"] for save in saves])
    assert batch.column("save").to_pylist() == [1, 2, 3]
    (blueprint,) = reader.blueprints()
    assert blueprint.application_id == "flexsim watch"


def test_a_file_that_was_never_good_is_recorded_as_text() -> None:
    RecordingFile(Path("watch.rrd")).show([], "my.xml: the MJCF file is empty")
    chunks = RrdReader(Path("watch.rrd")).store().stream().to_chunks()
    paths = {chunk.entity_path for chunk in chunks if "__" not in chunk.entity_path}
    assert paths == {"/frequencies"}


def test_messages_name_the_file() -> None:
    write(edited('timestep="0.001"', 'timestep="0.0007"'))
    with pytest.raises(ModelError, match=r"^my\.xml: control period 0\.001 s"):
        answered(Path("my.xml"))


@pytest.mark.usefixtures("quick", "interruptible")
def test_ctrl_c_ends_it_quietly(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = watch_module.answered

    def pressed(*arguments: Any) -> Save:
        threading.Timer(3 * POLL, os.kill, (os.getpid(), signal.SIGINT)).start()
        return answer(*arguments)

    monkeypatch.setattr(watch_module, "answered", pressed)
    assert main("watch my.xml --no-viewer --json".split()) == 0
    said = capsys.readouterr()
    assert said.err == "" and said.out.count("\n") == 1
