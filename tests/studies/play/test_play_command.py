"""`flexsim play --headless`: what it prints, records and replays; what it refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from flexsim import RunError
from studies.main import main
from studies.play.window import require_display

SOON = 100.0  # [ms] in which poles and margins follow a knob
SLOW = 4.0  # times, on a machine that is busy with other tests


def played(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    assert main(["play", "--headless", *words]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    found: dict[str, Any] = json.loads(said.out)
    return found


def test_it_prints_what_it_did(capsys: pytest.CaptureFixture[str]) -> None:
    found = played(capsys, "--seconds", "0.5", "--push", "0.1", "0", "0.5", "0.05")
    assert (found["seconds"], found["periods"]) == (pytest.approx(0.5), 500)
    assert found["plants"] == ["assumed-modes", "chain"]
    assert [event["period"] for event in found["events"]] == [100, 150]
    assert found["diverged"] == {"assumed-modes": None, "chain": None}
    rms = [found["tip_error"][name]["rms"] for name in found["plants"]]
    assert all(0 < value < 0.1 for value in rms)
    assert 0 < found["difference"]["rms"] < max(rms)
    assert found["margins"]["growth"] < 0 < found["margins"]["delay"]
    assert found["margins_ms"]["median"] < SLOW * SOON
    assert found["real_time_factor"] > 1


def test_what_is_recorded_can_be_done_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From an events file of one's own: the same numbers, and the same file."""
    rrd, events = tmp_path / "first.rrd", tmp_path / "first.json"
    mine = {
        "format": "flexsim-play-events-1",
        "periods": 400,
        "events": [
            {"period": 50, "knob": "payload", "value": 0.05},
            {"period": 90, "push": [0.5, 0.0], "body": "segment2", "at": [0, 0, 0]},
            {"period": 120, "push": [0, 0]},
            {"period": 200, "knob": "gain", "value": 1.2},
        ],
    }
    (tmp_path / "mine.json").write_text(json.dumps(mine))
    words = ("--hardware", "bench", "--setting", "none")
    first = played(capsys, *words, "--replay", str(tmp_path / "mine.json"), "--record", str(rrd))
    assert first["recorded"] == [str(rrd)] and rrd.read_bytes()[:4] == b"RRF2"
    again = played(capsys, *words, "--replay", str(events))
    for key in ("tip_error", "difference", "events", "knobs", "periods"):
        assert again[key] == first[key], key
    assert first["knobs"]["payload"] == 0.05 and first["periods"] == 400
    assert main(["play", "--headless", "--replay", str(events), "--setting", "none"]) == 2
    assert "hardware" in capsys.readouterr().err


def test_a_diverged_arm_is_an_outcome(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wild = {"format": "flexsim-play-events-1", "periods": 900, "events": []}
    wild["events"] = [
        {"period": 10, "knob": "gain", "value": 5.0},
        {"period": 10, "knob": "delay", "value": 20},
    ]
    (tmp_path / "wild.json").write_text(json.dumps(wild))
    words = ("--setting", "none", "--replay", str(tmp_path / "wild.json"))
    found = played(capsys, *words, "--record", str(tmp_path / "seen.rrd"))
    times = found["diverged"].values()
    assert all(time is not None and 0.01 < time < 0.9 for time in times)
    assert found["margins"]["growth"] > 0 and found["periods"] == 900


@pytest.mark.parametrize("name", ["chain6.xml", "rod.xml"])
def test_a_file_is_the_robot(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    file = Path(__file__).parents[3] / "models" / name
    found = played(capsys, str(file), "--seconds", "0.1", "--push", "0.02", "0", "1", "0.05")
    assert found["robot"].endswith(name)
    assert found["plants"][1] == name.removesuffix(".xml").rstrip("6")
    assert 0 < found["difference"]["max"] < 1e-3
    assert not found["margins"]["why_not"]


BAD = {
    "speed": (["--speed", "2"], "speed is 2"),
    "no speed": (["--speed", "0"], "speed is 0"),
    "push": (["--push", "1", "2"], "--push has 2"),
    "seconds": (["--seconds", "-1"], "--seconds is -1"),
    "plant": (["--plant", "closed-chain"], "not MuJoCo's"),
    "no model": (["--plant", "assumed-modes"], "'assumed-modes' is not MuJoCo's"),
    "controller": (["--controller", "nobody"], "'nobody' is unknown"),
    "trajectory": (["--trajectory", "square"], "'square' is unknown"),
    "file": (["gone.xml"], "gone.xml"),
    "twice": (["a.xml", "--mjcf", "b.xml"], "give one"),
    "record": (["--record", "play.mp4"], "ends in .rrd"),
    "nowhere": (["--record", "gone/play.rrd"], "no such folder"),
    "replay": (["--replay", "gone.json"], "gone.json"),
    "payload": (["--payload-step", "0"], "--payload-step is 0"),
    "modes": (["--modes", "0"], "modes"),
    "seed": (["--seed", "-1"], "seed is -1"),
}


@pytest.mark.parametrize("case", BAD)
def test_wrong_input_is_one_line(case: str, capsys: pytest.CaptureFixture[str]) -> None:
    words, said = BAD[case]
    assert main(["play", "--headless", *words]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("flexsim: ") and err.count("\n") == 1
    assert said in err


def test_files_that_are_there_stay_unless_forced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rrd = tmp_path / "mine.rrd"
    rrd.with_suffix(".json").write_text("mine")
    words = ["play", "--headless", "--seconds", "0.05", "--record", str(rrd)]
    assert main(words) == 2
    assert "mine.json" in capsys.readouterr().err and not rrd.exists()
    assert rrd.with_suffix(".json").read_text() == "mine"
    assert main([*words, "--force"]) == 0 and rrd.exists()


def test_without_a_display_it_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "XDG_SESSION_TYPE"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(RunError, match="--headless"):
        require_display()
