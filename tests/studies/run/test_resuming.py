"""Killed anywhere, a study goes on to the same bytes; nothing of it is swept or replaced."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from processes import PATIENCE, flexsim, process, wait_for

from flexsim import RunError
from studies.core.folders.marker import MARKER, is_unfinished, require_ours
from studies.main import main
from studies.run import store
from studies.run.run import workshop_of
from studies.run.scaling import simulated
from studies.run.workers import cluster, spread

STUDY = """
repeats = 2
batch = 50
plants = ["assumed-modes"]
controllers = ["line"]
hardware = ["bench"]
[[trajectories]]
use = "line"
duration = 0.4
hold = 0.1
end = [0.69, 0.21]
[sweep]
samples = 400
"settings[0].mu[0]" = { uniform = [0.2, 0.3] }
"""
RUNS = 800


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of an undisturbed run, its file beside it."""
    where = tmp_path_factory.mktemp("whole")
    (where / "study.toml").write_text(STUDY)
    assert main(["run", str(where / "study.toml"), "--out", str(where / "run")]) == 0
    return where / "run"


def batches(folder: Path) -> list[Path]:
    return sorted((folder / "batches").glob("*.arrow"))


def same(one: Path, other: Path) -> bool:
    return (one / "results.parquet").read_bytes() == (other / "results.parquet").read_bytes()


def killed(
    study: Path,
    out: Path,
    count: int,
    how: int = signal.SIGKILL,
    before: Callable[[], None] = lambda: None,
) -> str:
    """Kill a run once it has some batches; return what it said on stderr."""
    with flexsim("run", study, "--out", out) as started:
        wait_for(lambda: len(batches(out)) >= count, started)
        started.send_signal(signal.SIGSTOP)
        before()
        started.send_signal(how)
        started.send_signal(signal.SIGCONT)
        return started.communicate(timeout=PATIENCE)[1]


def test_one_process_at_a_time_killed_and_gone_on_with(whole: Path, tmp_path: Path) -> None:
    study, out = whole.parent / "study.toml", tmp_path / "run"

    def only_one() -> None:
        with flexsim("run", study, "--out", out, "--resume") as second:
            _, said = second.communicate(timeout=PATIENCE)
        assert second.returncode == 2 and "at work in another process" in said

    killed(study, out, 3, before=only_one)
    assert is_unfinished(out) and not (out / "results.parquet").exists()
    kept = {path: path.stat().st_mtime_ns for path in batches(out)}
    assert 3 <= len(kept) < RUNS // 50
    torn, other, altered = batches(out)[:3]  # a disk's fault: all run again
    torn.write_bytes(b"torn")
    content = altered.read_bytes()
    other.write_bytes(content)
    altered.write_bytes(content[:5000] + bytes(100) + content[5100:])
    assert main(["run", str(study), "--out", str(out), "--resume", "--threads", "1"]) == 0
    assert same(out, whole) and not is_unfinished(out) and not (out / "batches").exists()
    require_ours(out)  # may be replaced now


@pytest.mark.slow  # killed ones are above, Ctrl-C in test_cli
def test_ctrl_c_says_how_to_go_on(whole: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    said = killed(whole.parent / "study.toml", out, 2, signal.SIGINT)
    assert said == f"flexsim: interrupted; continue with flexsim run --out {out} --resume\n"
    assert main(["run", "--out", str(out), "--resume"]) == 0  # its own file
    assert same(out, whole)


def begun(whole: Path, folder: Path) -> Path:
    """Return a copy of a run as if it had not ended."""
    shutil.copytree(whole, folder)
    (folder / "results.parquet").unlink()
    marker = json.loads((folder / MARKER).read_text())
    (folder / MARKER).write_text(json.dumps({**marker, "unfinished": True}))
    return folder


def test_an_unfinished_run_is_spared(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = begun(whole, tmp_path / "run")
    for words in (
        ["run", str(whole.parent / "study.toml"), "--out", str(out)],
        ["run", str(whole.parent / "study.toml"), "--out", str(out), "--force"],
        ["stability", "--quick", "--out", str(out), "--force"],
    ):
        assert main(words) == 2
        assert f"{out} holds an unfinished run; continue it" in capsys.readouterr().err
    with pytest.raises(RunError, match="holds an unfinished run; continue it with flexsim run"):
        require_ours(out)
    assert is_unfinished(out)


def test_a_finished_run_is_shown_again(whole: Path, capsys: pytest.CaptureFixture[str]) -> None:
    require_ours(whole)
    before = (whole / "results.parquet").stat().st_mtime_ns
    assert main(["run", "--out", str(whole), "--resume", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["runs"] == RUNS
    assert (whole / "results.parquet").stat().st_mtime_ns == before


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (["--set", "robot.zeta=0.002"], "'zeta = 0.001' there, 'zeta = 0.002' here"),
        (["--set", "sweep.samples=401"], "'samples = 400' there, 'samples = 401' here"),
        (["--quick"], "holds another study"),
        (["--force"], "--resume continues a run, --force replaces it"),
    ],
)
def test_another_study_is_not_gone_on_with(
    whole: Path, change: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    study = whole.parent / "study.toml"
    assert main(["run", str(study), "--out", str(whole), "--resume", *change]) == 2
    assert said in capsys.readouterr().err


def test_other_versions_do_not_go_on(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    out = begun(whole, tmp_path / "run")
    now = store.identity()
    monkeypatch.setattr(store, "identity", lambda: now | {"numpy": "99.0"})
    assert main(["run", "--out", str(out), "--resume"]) == 2
    said = capsys.readouterr().err
    assert f"was made with numpy {now['numpy']}, this is 99.0" in said


@pytest.mark.parametrize("what", ["study.toml", "config.json", MARKER])
def test_a_damaged_run_is_refused(
    whole: Path, tmp_path: Path, what: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = begun(whole, tmp_path / "run")
    (out / what).write_text("{")
    status = main(["run", str(whole.parent / "study.toml"), "--out", str(out), "--resume"])
    assert (status, capsys.readouterr().err.count("\n")) in {(2, 1), (0, 0)}


@pytest.mark.parametrize("what", [MARKER, "summary.csv", "results.csv", "results.parquet"])
def test_what_is_missing_of_a_run_is_made(whole: Path, tmp_path: Path, what: str) -> None:
    shutil.copytree(whole, tmp_path / "run")
    (tmp_path / "run" / what).unlink()
    assert main(["run", "--out", str(tmp_path / "run"), "--resume"]) == 0
    assert same(tmp_path / "run", whole)
    require_ours(tmp_path / "run")
    names = ({p.name for p in folder.iterdir()} for folder in (whole, tmp_path / "run"))
    assert next(names) == next(names)


@pytest.mark.slow  # results are above
def test_traces_that_are_not_as_they_were_are_made_again(whole: Path, tmp_path: Path) -> None:
    out, words = tmp_path / "run", ["--traces", "nominal", "--set", "sweep.samples=60"]
    study = str(whole.parent / "study.toml")
    with flexsim("run", study, "--out", out, *words) as started:
        wait_for(lambda: len(batches(out)) >= 2, started)
        started.kill()
        started.wait()
    kept = sorted((out / "traces").glob("*.parquet"))
    before = [path.read_bytes() for path in kept[:2]]
    kept[0].unlink()
    kept[1].write_bytes(b"garbage")
    assert main(["run", "--out", str(out), "--resume"]) == 0
    assert [path.read_bytes() for path in kept[:2]] == before


FULL = """
import resource, sys
from studies.main import main
resource.setrlimit(resource.RLIMIT_FSIZE, (12000, 12000))
sys.exit(main())
"""


@pytest.mark.slow  # full disks are in test_full_disk, going on above
def test_a_full_disk_ends_it_and_room_goes_on(whole: Path, tmp_path: Path) -> None:
    """What a batch takes is more than what is left: one line, and nothing half-written."""
    study, out = whole.parent / "study.toml", tmp_path / "run"
    with process([sys.executable, "-c", FULL, "run", str(study), "--out", str(out)]) as started:
        _, said = started.communicate(timeout=PATIENCE)
    assert started.returncode == 2 and said.count("\n") == 1
    assert "cannot write the batch: File too large" in said
    assert is_unfinished(out) and not [p for p in (out / "batches").iterdir() if p.is_file()]
    assert main(["run", "--out", str(out), "--resume"]) == 0
    assert same(out, whole)


# --- workers ------------------------------------------------------------------------------------


def test_workers_give_the_same_bytes_though_one_is_killed(whole: Path, tmp_path: Path) -> None:
    """A real scheduler with two worker processes, one of which dies while it runs a batch."""
    shop = workshop_of(whole / "study.toml")
    with cluster(None, 2) as client:
        pids: dict[str, int] = client.run(os.getpid)
        spans = iter([(a, min(a + 50, RUNS)) for a in range(0, RUNS, 50)])
        rows: dict[int, Any] = {}
        for first, _, table, _ in spread(shop.resolved, spans, client):
            if not rows:
                os.kill(next(iter(pids.values())), signal.SIGKILL)
            rows[first] = table
        client.wait_for_workers(2, timeout=PATIENCE)
        assert set(client.run(os.getpid).values()) != set(pids.values())  # one was replaced
    expected = pq.read_table(whole / "results.parquet")
    for first, table in rows.items():
        assert table.to_pylist() == expected.slice(first, 50).to_pylist()
    assert len(rows) == RUNS // 50


@pytest.mark.slow  # workers and their scheduler are tested above
def test_a_scheduler_at_an_address(whole: Path, tmp_path: Path) -> None:
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as local:
        words = ["run", str(whole / "study.toml"), "--out", str(tmp_path / "run")]
        assert main([*words, "--cluster", local.scheduler_address]) == 0
    assert same(tmp_path / "run", whole)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--workers", "0"], "workers are 0; give 1 or more"),
        (["--workers", "2", "--threads", "2"], "--threads is of this process"),
        (["--workers", "2", "--cluster", "tcp://a:1"], "contradict each other"),
        (["--cluster", "nonsense"], "--cluster nonsense: no scheduler answers there"),
    ],
)
def test_workers_that_cannot_be(
    whole: Path, tmp_path: Path, words: list[str], said: str, capsys: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("studies.run.workers.CONNECTED", 0.5)
    out = tmp_path / "run"
    assert main(["run", str(whole / "study.toml"), "--out", str(out), *words]) == 2
    assert said in capsys.readouterr().err


def test_workers_of_other_versions_are_refused(
    whole: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shop, now = workshop_of(whole / "study.toml"), store.identity()

    class Client:
        """As little of a client as is asked before anything is submitted."""

        def run(self, _: Callable[[], Any]) -> dict[str, Any]:
            return {"tcp://there:1": now, "tcp://here:2": now | {"numba": "0.1"}}

    with pytest.raises(RunError, match=r"the worker tcp://here:2 has numba 0.1, this process"):
        next(spread(shop.resolved, iter([(0, 50)]), Client()))


def test_the_queue_of_many_workers() -> None:
    """Without a cost all work; with one that is too large, the one process sets the pace."""
    assert simulated(16, 2.0, 0.0) > 0.98
    assert simulated(64, 2.0, 0.001) > 0.97
    workers, length, cost = 64, 1.0, 0.05
    limit = length / (workers * cost)
    assert simulated(workers, length, cost) == pytest.approx(limit, rel=0.1)  # its ends apart
