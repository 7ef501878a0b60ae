"""`--hardware` of the commands: what it changes, where it is kept, what is refused in one line."""

import json
from pathlib import Path

import numpy as np
import pytest

import studies
from flexsim.loop.hardware import JointEffects
from flexsim.loop.hardware.parts import part_rows, part_table
from studies.core.options import HardwareOptions
from studies.main import main

TORQUE = "t,tau1,tau2\n0,0.5,0.1\n0.001,0.5,0.1\n0.002,0,0\n0.003,0,0\n"


def test_options_override_the_named_hardware() -> None:
    assert HardwareOptions().built.ideal
    bench = HardwareOptions(hardware="bench", hardware_delay=0, hardware_lag=2e-3).built
    assert (bench.delay, bench.lag, bench.counts, bench.noise_v) == (0, 2e-3, 8192, 1e-4)
    zeros = HardwareOptions(hardware="bench", hardware_counts=0, hardware_noise=0.0).built
    assert (zeros.counts, zeros.noise_v, zeros.torque_limit) == (0, 0.0, (10.0, 5.0))


def test_the_table_of_joints_is_what_the_code_says() -> None:
    text = Path(studies.__file__).with_name("README.md").read_text(encoding="utf-8")
    table = text.split("part_table(JointEffects) -->\n")[1].split("<!-- end of joints -->")[0]
    assert table == part_table(JointEffects)
    for name, unit, _, meaning, source in part_rows(JointEffects):
        assert name in table and unit and meaning and ("assumed" in source or "(" in source)


def test_driven_with_a_delay_the_motion_is_a_sample_later(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "tau.csv").write_text(TORQUE)
    tips = {}
    for name, more in (("ideal", []), ("late", ["--hardware-delay", "1"])):
        out = tmp_path / f"{name}.csv"
        words = ["--plant", "assumed-modes", "--torque", str(tmp_path / "tau.csv"), "--json"]
        assert main(["drive", *words, "--out", str(out), *more]) == 0
        tips[name] = np.loadtxt(out, delimiter=",", skiprows=1)[:, 1:3]
        told = json.loads(capsys.readouterr().out)["hardware"]
        assert told == ("ideal" if name == "ideal" else "delay of 1 sample")
    assert np.array_equal(tips["late"][1:], tips["ideal"][:-1])
    assert not np.array_equal(tips["late"], tips["ideal"])


def test_stability_sees_the_delay_and_keeps_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    words = "stability --hardware bench --plant assumed-modes --theta2 1.5 --map-points 0 --json"
    assert main([*words.split(), "--controllers", "ideal-line", "--out", str(out)]) == 0
    shown = json.loads(capsys.readouterr().out)
    (row,) = shown["rows"]
    assert 46 < row["growth_exact"] < 52
    assert row["growth_simulated"] == pytest.approx(row["growth_stepped"], rel=1e-6)
    assert shown["hardware"].startswith("delay of 1 sample, torques up to 10 and 5 N m")
    kept = json.loads((out / "config.json").read_text())
    assert kept["configuration"]["hardware"] == "bench" and kept["hardware"] == shown["hardware"]


def test_a_tuning_keeps_its_hardware_and_refuses_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    small = "--population 8 --survivors 2 --generations 2 --hardware bench --hardware-delay 0"
    limits = "--hardware-torque-limit 9 4".split()
    assert main(["tune", *small.split(), *limits, "--out", str(out), "--json"]) == 0
    first = (out / "generations.csv").read_bytes()
    kept = json.loads((out / "config.json").read_text())["configuration"]
    assert (kept["hardware"], kept["hardware_delay"]) == ("bench", 0)
    assert main(["tune", "--resume", str(out), "--json"]) == 0
    capsys.readouterr()
    assert main(["tune", "--resume", str(out), "--hardware", "ideal"]) == 2
    error = capsys.readouterr().err
    assert "--hardware ideal contradicts" in error and error.count("\n") == 1
    assert (
        main(["tune", "--resume", str(out), "--hardware-counts", "8192", "--json"]) == 0
    )  # bench's
    capsys.readouterr()
    assert main(["tune", "--resume", str(out), "--hardware-counts", "100"]) == 2
    assert "None" not in (error := capsys.readouterr().err) and "8192" in error
    other = tmp_path / "other"
    again = ["tune", *small.split(), *limits, "--threads", "1", "--out", str(other), "--json"]
    assert main(again) == 0
    assert (other / "generations.csv").read_bytes() == first


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("compare --hardware desk", "'desk' is unknown; choose one of ideal, delayed, bench"),
        ("tables --hardware-delay -1", "delay is -1"),
        ("tune --hardware-lag -1", "lag is -1.0 s"),
        ("stability --hardware-counts -5", "counts are -5"),
        ("reconstruct --hardware-noise nan", "noise is nan"),
        ("misprints --hardware-torque-limit 0 1", "torque limit is (0.0, 1.0)"),
        ("drive --torque x.csv --out y.csv --hardware-delay 1000", "0 to 100"),
    ],
)
def test_bad_hardware_is_one_line_and_leaves_nothing(
    words: str,
    named: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(words.split()) == 2
    error = capsys.readouterr().err
    assert named in error and error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_drive_says_its_hardware_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "tau.csv").write_text(TORQUE)
    words = ["drive", "--plant", "assumed-modes", "--torque", str(tmp_path / "tau.csv")]
    said = []
    for name, more in (("ideal", []), ("late", ["--hardware-delay", "1"])):
        assert main([*words, "--out", str(tmp_path / name), *more]) == 0
        said.append(capsys.readouterr().out)
    assert "Hardware" not in said[0] and "Hardware: delay of 1 sample.\n" in said[1]
