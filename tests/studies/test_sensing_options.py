"""Sensors at the command line: their table, what `drive` logs, sites, refusals in a line."""

from pathlib import Path

import numpy as np
import pytest

import studies
from flexsim.loop.hardware import Sensing
from flexsim.loop.hardware.parts import part_rows, part_table
from studies.main import main

TORQUE = "t,tau1,tau2\n" + "".join(f"{k / 1000},{0.5 * (k % 7)},{-0.1}\n" for k in range(30))
PLANT = ["--plant", "assumed-modes"]


@pytest.fixture
def torque(tmp_path: Path) -> list[str]:
    (tmp_path / "tau.csv").write_text(TORQUE)
    return ["drive", "--torque", str(tmp_path / "tau.csv"), *PLANT]


def read(path: Path) -> tuple[str, np.ndarray]:
    return path.read_text().splitlines()[0], np.loadtxt(path, delimiter=",", skiprows=1)


def test_the_table_of_sensors_is_what_the_code_says() -> None:
    text = Path(studies.__file__).with_name("README.md").read_text(encoding="utf-8")
    table = text.split("part_table(Sensing) -->\n")[1].split("<!-- end of sensors -->")[0]
    assert table == part_table(Sensing)
    assert all(meaning and source for _, _, _, meaning, source in part_rows(Sensing))


def test_a_log_has_what_a_laboratory_has(tmp_path: Path, torque: list[str]) -> None:
    out = tmp_path / "log.csv"
    told = np.loadtxt((tmp_path / "tau.csv"), delimiter=",", skiprows=1)
    assert main([*torque, "--out", str(out)]) == 0
    header, motion = read(out)
    assert header == "t,x,y,theta1,theta2,v"
    assert main([*torque, "--out", str(out), "--force", "--log", "measured"]) == 0
    header, log = read(out)
    assert header == "t,tau1,tau2,theta1,theta2,v"
    assert np.array_equal(log[:, :3], told) and np.array_equal(log[:, 3:], motion[:, 3:])
    logs = []
    for number in ("0", "1"):
        words = ["--hardware", "bridges", "--log", "measured", "--run-number", number, "--force"]
        assert main([*torque, "--out", str(out), *words, "--seed", "3"]) == 0
        header, log = read(out)
        assert header == "t,tau1,tau2,theta1,theta2,v,strain1,strain2,w1,w2"
        logs.append(log)
    assert np.array_equal(logs[0][:, :3], told)  # as commanded: the limit and delay come behind
    assert not np.array_equal(logs[0][:, 5:], logs[1][:, 5:])  # noise of its own
    assert np.array_equal(logs[0][:, 3:5], logs[1][:, 3:5])  # encoders have none
    again = tmp_path / "again.csv"  # a log drives as a torque file
    assert main(["drive", "--torque", str(out), *PLANT, "--out", str(again)]) == 0
    assert np.array_equal(read(again)[1], motion)


def test_chain_writes_sites_that_drive_reads(tmp_path: Path, torque: list[str]) -> None:
    logs = []
    for places in (["0.025", "0.25"], ["0.1", "0.3"]):
        robot, out = tmp_path / f"arm{places[0]}.xml", tmp_path / f"log{places[0]}.csv"
        assert main(["chain", "--out", str(robot), "--bridges", *places]) == 0
        words = ["--mjcf", str(robot), "--hardware-with", "bridges=on", "--log", "measured"]
        assert main([*torque, *words, "--out", str(out)]) == 0
        logs.append(read(out)[1][:, 6:])
    assert logs[0].shape[1] == 2
    assert np.abs(logs[0]).max() > 1e-6 and not np.allclose(logs[0], logs[1], rtol=0.01)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["estimator=guess"], "estimator (what makes v of the strains) is guess; choose one of"),
        (["estimator=kalman:99"], "give kalman:n with 1 to 8 modes"),
        (["estimator=two-bridges", "bridge_places=0.1,0.9"], "0.9 m from the clamp, off the beam"),
        (["estimator=two-bridges", "bridge_places=0.1"], "tell two modes not apart"),
        (["bridge_gain=0.1"], "has no effect without bridges or estimator"),
        (["tachometer_noise=1"], "has no effect without tachometers"),
        (["motor_inertia=0.01"], "has no effect without shaft"),
        (["warming=5"], "has no effect without cold or warm"),
    ],
)
def test_bad_sensors_are_one_line_and_leave_nothing(
    words: list[str],
    named: str,
    tmp_path: Path,
    torque: list[str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "log.csv"
    assert main([*torque, "--hardware-with", *words, "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert named in error and error.count("\n") == 1
    assert not out.exists()
