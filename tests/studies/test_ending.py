"""Ctrl-C and SIGTERM end a command within two seconds at any moment, quietly, leaving nothing."""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
import rerun as rr
from processes import PATIENCE, ROOT, flexsim, of_session, process, wait_for

from flexsim import model_path
from studies.core.ending import INTERRUPTED, TERMINATED, ends_on_signals, received, saying

WITHIN = 2.0  # [s] as promised
SAID = {signal.SIGINT: "flexsim: interrupted; nothing was kept\n", signal.SIGTERM: ""}
STATUS = {signal.SIGINT: INTERRUPTED, signal.SIGTERM: TERMINATED}
STUCK = """
import ctypes, signal, sys
from contextlib import suppress
from pathlib import Path
signal.signal(signal.SIGINT, signal.default_int_handler)
from flexsim.files.cleanup import child
from flexsim.files.scratch import scratch
from studies.core.ending import ends_on_signals
nested = "import subprocess; subprocess.run(['sleep', '600'])"
with ends_on_signals(), scratch(Path("out")) as folder, child([sys.executable, "-c", nested]):
    (folder / "half").write_text("half")
    print(flush=True)
    mutex = ctypes.create_string_buffer(64)
    lock = ctypes.CDLL(None).pthread_mutex_lock
    lock(mutex), lock(mutex)  # for ever, and no signal ends it: like a loop in compiled code
"""
SWALLOWS = """
import signal, time
signal.signal(signal.SIGINT, signal.default_int_handler)
from studies.core.ending import ends_on_signals
class Deaf:
    def __del__(self):
        print(flush=True)
        time.sleep(600)  # what is raised here is ignored
with ends_on_signals():
    Deaf()
    time.sleep(600)
"""
COMPILES = """
import mujoco
from studies.core.ending import ends_on_signals
bodies = '<replicate count="9000" offset="1 0 0"><body><geom size=".1"/></body></replicate>'
with ends_on_signals():
    print(flush=True)
    mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    print("compiled")
"""
COMMANDS = (  # for the slow test: [seconds after which it is over] and words
    "compare --quick --out run",
    "modes my.xml",
    "crosscheck --json",
    "ladder --quick --out new/run",
    "tune --plant chain --population 3000 --out run",
    "stability --quick --out run",
    "tables --quick --out run",
    "chain --segments 16 --out chain.xml",
    "watch my.xml --rrd run.rrd",
    "misprints --quick --out run",
    "realisations --quick --out run",
)
MOMENTS = 60
EARLIEST, LATEST = 0.2, 8.0  # [s] after the start; before, Python itself is starting


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ended_where_python_cannot_be_reached(tmp_path: Path, number: signal.Signals) -> None:
    """Its folder is gone, and so is its child with a child of its own."""
    with process([sys.executable, "-c", STUCK], cwd=tmp_path) as stuck:
        assert stuck.stdout and stuck.stdout.readline()
        (left,) = tmp_path.iterdir()
        assert (left / "half").exists()
        wait_for(lambda: len(of_session(stuck.pid)) == 3, stuck)
        sent = time.monotonic()
        stuck.send_signal(number)
        out, err = stuck.communicate(timeout=PATIENCE)
        assert time.monotonic() - sent < WITHIN
        assert (stuck.returncode, out, err) == (STATUS[number], "", SAID[number])
        assert list(tmp_path.iterdir()) == [] and of_session(stuck.pid) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ended_where_exceptions_are_ignored(number: signal.Signals) -> None:
    with process([sys.executable, "-c", SWALLOWS]) as deaf:
        assert deaf.stdout and deaf.stdout.readline()
        sent = time.monotonic()
        deaf.send_signal(number)
        _, err = deaf.communicate(timeout=PATIENCE)
        assert time.monotonic() - sent < WITHIN
        assert (deaf.returncode, err) == (STATUS[number], SAID[number])


def test_a_population_in_compiled_threads_is_ended(tmp_path: Path) -> None:
    """A generation that takes minutes holds the main thread all the while."""
    words = ("tune", "--plant", "rod", "--population", "5000", "--out", tmp_path / "run")
    with flexsim(*words, "--setting", "none") as tuning:
        wait_for(lambda: cpu_seconds(tuning.pid) > 4.0, tuning)
        sent = time.monotonic()
        tuning.send_signal(signal.SIGINT)
        assert tuning.communicate(timeout=PATIENCE) == ("", SAID[signal.SIGINT])
        assert time.monotonic() - sent < WITHIN
        assert tuning.returncode == INTERRUPTED
    assert list(tmp_path.iterdir()) == []


def cpu_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


VIEWS = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from flexsim.recording import rerun_file
from flexsim.recording import viewer
nested = "import subprocess; subprocess.run(['sleep', '600'])"
rerun_file.RERUN_TOOL = viewer.RERUN_TOOL = (sys.executable, "-c", nested)
viewer.DEFAULT_URL = "rerun+http://127.0.0.1:1/proxy"
from studies.main import main
sys.exit(main())
"""


@pytest.mark.parametrize(
    "words", ["view run.rrd", pytest.param("watch my.xml", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_viewer_ends_with_its_command(words: str, number: signal.Signals, tmp_path: Path) -> None:
    """And so does what it started; Ctrl-C is how both are ended, and no failure."""
    with rr.RecordingStream("flexsim") as stream:
        stream.save(tmp_path / "run.rrd")
        stream.log("a", rr.Scalars(1.0))
    stream.disconnect()
    (tmp_path / "my.xml").write_text(model_path("chain6.xml").read_text())
    with process([sys.executable, "-c", VIEWS, *words.split()], cwd=tmp_path) as viewing:
        wait_for(lambda: len(started_by(viewing.pid)) == 2, viewing)
        viewers = started_by(viewing.pid)
        sent = time.monotonic()
        viewing.send_signal(number)
        _, err = viewing.communicate(timeout=PATIENCE)
        assert time.monotonic() - sent < WITHIN
        assert (viewing.returncode, err) == (0 if number == signal.SIGINT else TERMINATED, "")
        assert not any(map(running, viewers))


def running(pid: int) -> bool:
    """Return whether a process runs: it may be dead and wait for its parent to notice."""
    try:
        return Path("/proc", str(pid), "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def started_by(pid: int) -> list[int]:
    """Return the children of a process that run, theirs, and so on."""
    children = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, parent = stat.read_text().rpartition(")")[2].split()[:2]
            if int(parent) == pid and state != "Z":
                child = int(stat.parent.name)
                children += [child, *started_by(child)]
    return children


def test_ended_while_mujoco_compiles() -> None:
    """Seconds in C++, if a limit of what is read should let them pass."""
    with process([sys.executable, "-c", COMPILES]) as compiling:
        assert compiling.stdout and compiling.stdout.readline()
        time.sleep(0.3)
        sent = time.monotonic()
        compiling.terminate()
        assert compiling.communicate(timeout=PATIENCE) == ("", "")
        assert time.monotonic() - sent < WITHIN and compiling.returncode == TERMINATED


def test_what_is_ignored_stays_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    """As under nohup; and what was there before is there again."""
    before = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        with ends_on_signals():
            os.kill(os.getpid(), signal.SIGINT)
            assert received() is None
            assert signal.getsignal(signal.SIGTERM) is not before[signal.SIGTERM]
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGTERM) is before[signal.SIGTERM]
    finally:
        signal.signal(signal.SIGINT, before[signal.SIGINT])


@pytest.mark.usefixtures("interruptible")
def test_a_second_signal_does_not_disturb_the_unwinding() -> None:
    unwound = False
    with pytest.raises(KeyboardInterrupt), ends_on_signals(), saying(lambda: "later"):
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(PATIENCE)
        finally:
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.01)
            unwound = True
    assert unwound and received() == signal.SIGINT


@pytest.mark.slow
def test_ended_at_any_moment(tmp_path: Path) -> None:
    """Imports, compilation, runs, figures; with and without what was compiled before."""
    rng = random.Random(1)
    for i in range(MOMENTS):
        folder = tmp_path / str(i)
        folder.mkdir()
        (folder / "my.xml").write_text(model_path("chain6.xml").read_text())
        words, number = rng.choice(COMMANDS), rng.choice([signal.SIGINT, signal.SIGTERM])
        how = {"PYTHONPATH": str(ROOT)}
        if rng.random() < 0.3:
            how["XDG_CACHE_HOME"] = str(tmp_path / "cache")
        with flexsim(*words.split(), cwd=folder, env={**os.environ, **how}) as ended:
            time.sleep(rng.uniform(EARLIEST, rng.choice([1.5, LATEST])))
            if ended.poll() is not None:
                continue
            sent = time.monotonic()
            ended.send_signal(number)
            _, err = ended.communicate(timeout=PATIENCE)
            about = f"{words}, {number.name}: status {ended.returncode}, {err}"
            assert time.monotonic() - sent < WITHIN, about
        watched = words.startswith("watch") and number == signal.SIGINT
        over = ended.returncode in (0, -number)  # it was, when the signal came
        assert ended.returncode == STATUS[number] or watched or over, about
        assert err.count("\n") <= (number == signal.SIGINT), about
        left = {path.name for path in folder.iterdir()} - {"my.xml"}
        assert not left or over or "generation(s) kept" in err or "tune" in words, about
        assert not list(folder.rglob(".flexsim-*[0-9a-f]")) or over, about
