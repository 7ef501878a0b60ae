"""The commands end to end: what they print for machines, what they write, what they promise."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.main import main
from studies.parity.motions import trial_torque

MODELS = Path(__file__).parents[2] / "models"
CLAMPED = 1e-9  # relative: the design tunes these to rounding
JOINT_FREE = 3e-4  # relative, promised for the default chain
COUPLING = 8e-4  # relative, promised for the default chain
SMALL_TIP = 1e-5  # [m] rms between the plants over 2 s, promised
SLACK = 2.0  # of chain loop over bare mj_step: promised 1.15, but test machines are shared


def printed(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> Any:
    assert main(arguments) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    return json.loads(shown.out)


def test_modes_of_the_default_chain(capsys: pytest.CaptureFixture[str]) -> None:
    shown = printed(["modes", "--json"], capsys)
    clamped, free = (
        {name: np.array(values) for name, values in shown[key].items()}
        for key in ("clamped_hz", "joint_free_hz")
    )
    assert np.abs(clamped["chain"] / clamped["exact"] - 1).max() < CLAMPED
    assert np.abs(free["chain"] / free["exact"] - 1).max() < JOINT_FREE
    assert 0 < shown["coupling_error_max"] < COUPLING
    assert len(shown["mac"]) == 3
    assert all(0.989 < value <= 1 for value in shown["mac"])
    assert shown["omega_max"]["chain"] > 1000 > shown["omega_max"]["assumed_modes"]


def test_modes_follows_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shown = printed(["modes", str(MODELS / "chain10.xml"), "--json"], capsys)
    assert shown["omega_max"]["chain"] > 3000
    assert shown["coupling_error_max"] < COUPLING / 5


def test_crosscheck_holds(capsys: pytest.CaptureFixture[str]) -> None:
    rungs = {rung["name"]: rung for rung in printed(["crosscheck", "--json"], capsys)["rungs"]}
    assert len(rungs) >= 9
    assert all(rung["ok"] for rung in rungs.values())
    assert sum(rung["limit"] is not None for rung in rungs.values()) >= 9
    printed_drift = next(v["value"] for k, v in rungs.items() if "printed equations, gentle" in k)
    energy = next(v for k, v in rungs.items() if "assumed modes, gentle" in k)
    assert energy["limit"] == 1e-11
    assert printed_drift > 1e4 * energy["value"]


def test_crosscheck_fails_on_another_beam(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Negative control: the untuned chain does not pass for the beam."""
    file = tmp_path / "plain.xml"
    arguments = ["chain", "--segments", "8", "--plain", "--timestep", "5e-4", "--out", str(file)]
    arguments += ["--robot.zeta", "0"]
    assert main(arguments) == 0
    capsys.readouterr()
    words = ["crosscheck", "--mjcf", str(file), "--json"]
    assert printed(words, capsys)["ok"]  # its own modes are those of the same chain
    with pytest.raises(SystemExit) as ended:
        main([*words, "--beam", "analytic"])
    assert ended.value.code == 1
    shown = json.loads(capsys.readouterr().out)
    failed = [rung["name"] for rung in shown["rungs"] if not rung["ok"]]
    assert not shown["ok"]
    assert any("clamped" in name for name in failed)
    assert any("acceleration" in name for name in failed)


def test_drive_replays_a_torque_on_both_plants(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torque = trial_torque(1.0)
    lines = [f"{k * 1e-3:.3f},{a!r},{b!r}" for k, (a, b) in enumerate(torque.tolist())]
    (tmp_path / "tau.csv").write_text("\n".join(["t,tau1,tau2", *lines]) + "\n")
    motions = {}
    for plant in ("assumed-modes", "chain"):
        out = tmp_path / f"{plant}.csv"
        words = ["drive", "--plant", plant, "--torque", str(tmp_path / "tau.csv")]
        shown = printed([*words, "--out", str(out), "--json"], capsys)
        assert shown["rows"] == len(torque)
        motions[plant] = np.genfromtxt(out, delimiter=",", names=True)
        assert motions[plant].dtype.names == ("t", "x", "y", "theta1", "theta2", "v")
    first, second = motions.values()
    start = [first[0][name] for name in ("t", "x", "y", "theta1", "theta2", "v")]
    assert start == pytest.approx([0, 0.895, 0, 0, 0, 0], abs=1e-12)  # row 0: at rest, straight
    distance = np.hypot(first["x"] - second["x"], first["y"] - second["y"])
    assert np.sqrt(np.mean(distance**2)) < SMALL_TIP
    assert np.abs(first["theta1"]).max() > 0.1  # it did move
    (tmp_path / "chain6.csv").write_text("")
    words = ["drive", "--plant", "chain", "--mjcf", str(MODELS / "chain6.xml"), "--force"]
    words += ["--torque", str(tmp_path / "tau.csv"), "--out", str(tmp_path / "chain6.csv")]
    printed([*words, "--json"], capsys)
    assert (tmp_path / "chain6.csv").read_text() == (tmp_path / "chain.csv").read_text()


def test_drive_under_friction_sticks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Torques inside Table 4's dead zone move nothing under `jump`."""
    (tmp_path / "tau.csv").write_text(
        "t,tau1,tau2\n" + "".join(f"{k * 1e-3:.3f},2.9,0.66\n" for k in range(50))
    )
    words = ["drive", "--torque", str(tmp_path / "tau.csv"), "--out", str(tmp_path / "o.csv")]
    assert printed([*words, "--setting", "jump", "--json"], capsys)["max_v"] == 0.0
    assert printed([*words, "--force", "--json"], capsys)["max_v"] > 0.0


@pytest.mark.slow
def test_benchmark_names_its_loops(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("studies.core.timing.TURN", 0.05)
    found = printed(["benchmark", "--rounds", "1", "--seconds", "0.2", "--json"], capsys)
    cost = found["us_per_ms"]
    loops = [
        f"{plant}_{n}" for plant in ("assumed_modes", "chain", "closed_chain") for n in (1, 50)
    ]
    measured = ["measured_50", "converged_10", "measured_converged_10"]
    assert list(cost) == [*loops, *measured, "bare_mj_step", "c_loop", "python_loop"]
    assert min(each for each in cost.values() if each is not None) > 0
    assert (cost["c_loop"] is None) == bool(found["notes"])
    assert set(found["tuning_budget"]) == {"assumed_modes", "chain", "closed_chain"}
    assert cost["chain_50"] < SLACK * cost["bare_mj_step"]
    assert cost["assumed_modes_50"] < cost["chain_50"] / 5
