"""Replayed torque: when each row acts, what is written, and what a torque file may not be."""

from __future__ import annotations

import csv
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexsim import (
    AssumedModesPlant,
    ChainPlant,
    DivergenceError,
    ParameterError,
    Parameters,
    RunError,
    drive,
)
from flexsim.arm.parameters import paper
from flexsim.loop.settings import setting
from flexsim.robot import Robot
from studies.main import main
from studies.parity.motions import trial_torque
from studies.tools.drive import MOTION_HEADER, write_motion
from studies.tools.logs import read_log

PLANTS = ("assumed-modes", "chain")
MODELS = Path(__file__).parents[2] / "models"
HEADER = "t,tau1,tau2\n"
WORK = 1e-7  # relative: RK4 and the trapezoidal rule at 1 ms
TIP = 1e-5  # [m] rms over 2 s, promised of the two plants under small torques
TEETH = 3  # times the bound: what the equations as printed exceed at least
STAMP = 1e-12  # [s] nine digits of a time below 1 s

Columns = dict[str, Any]


def write_torque(path: Path, torque: Any, end: str = "\n") -> Path:
    rows = [f"{1e-3 * k:.3f},{a!r},{b!r}" for k, (a, b) in enumerate(np.asarray(torque).tolist())]
    path.write_bytes(end.join(["t,tau1,tau2", *rows, ""]).encode())
    return path


def columns(path: Path) -> Columns:
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == MOTION_HEADER
    values = np.array([[float(cell) for cell in row] for row in rows[1:]])
    return dict(zip(MOTION_HEADER, values.T, strict=True))


def replayed(folder: Path, torque: Any, *options: str) -> Columns:
    """Return the columns that the command writes for a torque (K, 2)."""
    file = write_torque(folder / "tau.csv", torque)
    words = ["drive", "--torque", str(file), "--out", str(folder / "out.csv"), "--force"]
    assert main([*words, *options]) == 0
    return columns(folder / "out.csv")


def refused(folder: Path, capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """Return the one line of a command that is refused and leaves the folder as it was."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert main(["drive", *words]) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and shown.err.count("\n") == 1, shown
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    return shown.err


@pytest.mark.parametrize("plant", PLANTS)
def test_row_k_is_the_state_as_torque_k_sets_in(plant: str, tmp_path: Path) -> None:
    torque = np.zeros((6, 2))
    rest = replayed(tmp_path, torque, "--plant", plant, "--theta2", "1.2")
    torque[3] = 0.5, 0.0
    pushed = replayed(tmp_path, torque, "--plant", plant, "--theta2", "1.2")
    changed = np.array([pushed[name] != rest[name] for name in ("theta1", "theta2", "v")])
    assert changed.any(axis=0).tolist() == [False] * 4 + [True] * 2
    np.testing.assert_allclose(rest["t"], 1e-3 * np.arange(6), atol=STAMP)
    for name, start in (("theta1", 0.0), ("theta2", 1.2), ("v", 0.0)):
        assert (rest[name] == start).all()
    p = Parameters()
    assert rest["x"][0] == pytest.approx(p.L_R + p.reach * np.cos(1.2), rel=1e-12)  # rounding
    assert rest["y"][0] == pytest.approx(p.reach * np.sin(1.2), rel=1e-12)


@pytest.mark.parametrize("plant", PLANTS)
def test_energy_is_the_work_of_the_held_torque(plant: str, tmp_path: Path) -> None:
    """What a constant torque puts in, less the friction (31), is in the motion."""
    p = paper()
    push = np.tile([1.0, 0.0], (101, 1))
    motion = drive(Robot(p).plant(plant, setting("none")), setting("none"), push[:-1])
    written = replayed(tmp_path, push, "--plant", plant, "--robot.zeta", "0")
    np.testing.assert_array_equal(written["theta1"], motion.joint[:, 0])
    m = motion.state.shape[1] // 2
    power = motion.state[:, m : m + 2] ** 2 @ (p.F_1, p.F_2)
    lost = float(np.trapezoid(power, motion.time))
    work = motion.joint[-1, 0]  # of 1 N m from 0
    assert 100 * WORK * work < lost  # friction is seen
    assert motion.energy[-1] == pytest.approx(work - lost, rel=WORK)


def test_library_and_command_agree_to_the_last_digit(tmp_path: Path) -> None:
    """A motion of the library has one row more: the state after the last torque."""
    torque = trial_torque(1.0, duration=0.1)
    plant = ChainPlant.designed(Parameters())
    motion = drive(plant, setting("none"), torque, theta=(0.1, 0.2))
    assert len(motion.time) == len(torque) + 1
    written = replayed(tmp_path, torque, "--theta1", "0.1", "--theta2", "0.2")
    np.testing.assert_array_equal(written["v"], motion.v[:-1])
    np.testing.assert_array_equal(np.stack([written["x"], written["y"]], 1), motion.tip[:-1])


def test_plants_agree_and_the_printed_equations_do_not(tmp_path: Path) -> None:
    """The bound has teeth: the equations as printed are outside it."""
    torque = trial_torque(1.0)
    pose = (0.0, 1.2)
    tips = {}
    for plant in PLANTS:
        got = replayed(tmp_path, torque, "--plant", plant, "--theta2", "1.2")
        tips[plant] = np.stack([got["x"], got["y"]], axis=1)
    printed = AssumedModesPlant(Parameters(), form="printed")
    tips["printed"] = drive(printed, setting("none"), torque, theta=pose).tip[:-1]

    def rms(first: str, second: str) -> float:
        return float(np.sqrt(np.mean(np.sum((tips[first] - tips[second]) ** 2, axis=1))))

    assert rms(*PLANTS) < TIP
    assert rms("printed", "chain") > TEETH * TIP


@pytest.mark.parametrize("plant", PLANTS)
def test_a_setting_brings_its_friction_and_its_motor(plant: str, tmp_path: Path) -> None:
    torque = trial_torque(18.0, duration=0.2)  # beyond the friction, within the limits
    options = ("--plant", plant, "--theta2", "1.2")
    free = replayed(tmp_path, torque, *options)
    fitted = replayed(tmp_path, torque, *options, "--setting", "reconstructed")
    chosen = setting("reconstructed")
    made = Robot().plant(plant, setting("reconstructed"))
    wanted = drive(made, chosen, torque, theta=(0.0, 1.2))
    np.testing.assert_array_equal(fitted["theta2"], wanted.joint[:-1, 1])
    assert np.abs(fitted["theta1"] - free["theta1"]).max() > 1e-3
    light = Robot().plant(plant, setting("opposing"))  # the same friction without the motor
    other = drive(light, replace(chosen, I_m2=None), torque, theta=(0.0, 1.2))
    assert np.abs(wanted.joint - other.joint).max() > 1e-4


@pytest.mark.parametrize("plant", PLANTS)
def test_an_edited_file_moves_otherwise(plant: str, tmp_path: Path) -> None:
    text = (MODELS / "chain6.xml").read_text()
    (tmp_path / "heavy.xml").write_text(text.replace('mass="0.47"', 'mass="4.7"'))
    torque = trial_torque(4.0, duration=0.1)
    options = ("--plant", plant, "--mjcf")
    usual = replayed(tmp_path, torque, *options, str(MODELS / "chain6.xml"))
    heavy = replayed(tmp_path, torque, *options, str(tmp_path / "heavy.xml"))
    assert np.abs(heavy["theta1"]).max() < 0.9 * np.abs(usual["theta1"]).max()


@pytest.mark.parametrize(
    "plant", ["rigid", "assumed-modes:5", "printed", "chain:4", "untuned:8", "rod:8"]
)
def test_every_rung_can_be_driven(plant: str, tmp_path: Path) -> None:
    """All of them are one robot: after 0.1 s their tips are within the beam's deflection."""
    torque = trial_torque(1.0, duration=0.1)
    options = ("--theta2", "1.2", "--plant")
    usual = replayed(tmp_path, torque, *options, "chain")
    other = replayed(tmp_path, torque, *options, plant)
    apart = np.hypot(other["x"] - usual["x"], other["y"] - usual["y"]).max()
    assert 0 < apart < 2 * np.abs(usual["v"]).max()


@pytest.mark.parametrize("prefix", ["", "\ufeff"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_files_of_spreadsheets_are_read(tmp_path: Path, prefix: str, end: str) -> None:
    path = tmp_path / "tau.csv"
    path.write_bytes(f"{prefix}t, tau1, tau2{end}0, 0.5, -1e-1{end}1e-3,2,3{end}".encode())
    np.testing.assert_array_equal(read_log(path).resampled(), [[0.5, -0.1], [2.0, 3.0]])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", ("is empty", "t,tau1,tau2")),
        (b"t;tau1\n0;0\n", ("no column is called 'tau2'", "has 't', 'tau1'", "--columns")),
        (b"0,0,0\n0.001,0,0\n", ("no column is called 't'", "has '0', '0', '0'")),
        (HEADER.encode(), ("has no rows", "at least one")),
        (HEADER.encode() + b"0,0\n", ("line 2", "'0,0' has 2 cells, the first line 3")),
        (HEADER.encode() + b"0,0,0,0\n", ("line 2", "'0,0,0,0'")),
        (HEADER.encode() + b"0,-inf,0\n", ("line 2", "-inf")),
        (HEADER.encode() + b"0,1e400,0\n", ("line 2", "1e400")),
        (HEADER.encode() + b"0,0,0\n0,0,0\n", ("line 3", "t = 0 is not after 0 of line 2")),
        (HEADER.encode() + b"0,0,0\n2,0,0\n2.1,0,0\n2.2,0,0\n", ("line 3", "2 s", "--gap 2")),
        (HEADER.encode() + b"0,0,0\n1e9,0,0\n", ("1e+09 s apart", "--time-unit")),
        (HEADER.encode() + b'"0\n', ("line 2",)),
        (b"\xff\xfe\x00t", ("not text in UTF-8",)),
        (bytes(5000), ("no column is called 't'", "...")),
        (HEADER.encode() + b'"' + b"x" * 200_000 + b'"\n', ("not a CSV file",)),
    ],
)
def test_torque_file_is_refused(
    content: bytes, words: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "tau.csv"
    path.write_bytes(content)
    said = refused(tmp_path, capsys, "--torque", str(path), "--out", str(tmp_path / "o.csv"))
    assert "tau.csv" in said and all(word in said for word in words)
    assert len(said) < 500 + len(str(path))  # a binary file is not shown whole


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--torque tau.csv --out tau.csv", ("tau.csv exists already", "--force")),
        ("--torque tau.csv --out folder --force", ("folder: cannot write the motion",)),
        ("--torque tau.csv --out tau.csv/o.csv", ("tau.csv/o.csv: cannot write",)),
        ("--torque tau.csv --out none/o.csv", ("none/o.csv: cannot write",)),
        (f"--torque tau.csv --out {'o' * 300}.csv", ("too long",)),
        ("--torque folder --out o.csv", ("folder: cannot read the torque file",)),
        ("--torque tau.csv --out o.csv --plant untuned --mjcf m.xml", ("m.xml: cannot read",)),
        ("--torque tau.csv --out o.csv --beam analytic", ("--beam", "no effect without --mjcf")),
        ("--torque tau.csv --out o.csv --mjcf none.xml", ("none.xml: cannot read",)),
        ("--torque tau.csv --out o.csv --theta2 inf", ("inf", "finite")),
        ("--torque tau.csv --out o.csv --theta2 bent", ("--theta2", "'bent'")),
        ("--torque tau.csv --out o.csv --columns t=Time", ("'Time', which is to be t",)),
        ("--torque tau.csv --out o.csv --period 0.0007", ("0.0007 s is not a whole multiple",)),
        ("--torque tau.csv --out o.csv --gap -1", ("--gap is -1.0 s",)),
        ("--torque tau.csv --out o.csv --time-unit h", ("'h'", "--time-unit")),
        ("--torque tau.csv --out o.csv --start bend", ("'bend'; choose home, bent. Did you",)),
        ("--torque tau.csv --out o.csv --start bent --theta1 0", ("--theta1 0 contradict",)),
        ("--torque tau.csv --out o.csv --start bent --theta2 1", ("--theta2 1 contradict",)),
        ("--torque tau.csv --out o.csv --start bent --plant rigid", ("plant 'rigid' cannot be",)),
        ("--torque tau.csv --out o.csv --start bent --plant exudyn", ("plant 'exudyn' cannot",)),
        ("--torque tau.csv --out o.csv --lock joint3", ("'joint3'", "--lock")),
    ],
)
def test_options_are_refused(
    options: str,
    words: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    write_torque(tmp_path / "tau.csv", np.zeros((2, 2)))
    said = refused(tmp_path, capsys, *options.split())
    assert all(word in said for word in words), said


@pytest.mark.parametrize("name", ["zero", "pipe", "folder"])
def test_a_torque_that_is_no_file_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("zero").symlink_to("/dev/zero")
    os.mkfifo("pipe")
    Path("folder").mkdir()
    said = refused(tmp_path, capsys, "--torque", name, "--out", "o.csv")
    assert f"{name}: cannot read the torque file: it is a" in said


@pytest.mark.parametrize("name", ["link", "dangling", "pipe"])
def test_only_a_regular_file_is_overwritten(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_torque(tmp_path / "tau.csv", np.zeros((2, 2)))
    Path("mine").write_text("mine")
    Path("link").symlink_to("mine")
    Path("dangling").symlink_to("nothing")
    os.mkfifo("pipe")
    said = refused(tmp_path, capsys, "--torque", "tau.csv", "--out", name, "--force")
    assert f"{name}: cannot write the motion: it is a" in said
    assert Path("mine").read_text() == "mine" and not Path("nothing").exists()


@pytest.mark.parametrize("plant", PLANTS)
def test_a_runaway_writes_nothing(
    plant: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_torque(tmp_path / "tau.csv", np.full((300, 2), 1e8))
    said = refused(tmp_path, capfd, "--plant", plant, "--torque", "tau.csv", "--out", "o.csv")
    assert f"the {plant} plant ran away at t = 0" in said and "smaller torques" in said


def test_a_write_that_fails_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    motion = drive(AssumedModesPlant(Parameters()), setting("none"), np.zeros((3, 2)))

    def full(source: object, target: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("flexsim.files.atomic.os.replace", full)
    with pytest.raises(RunError, match=r"o\.csv: cannot write the motion: No space left"):
        write_motion(tmp_path / "o.csv", motion)
    assert list(tmp_path.iterdir()) == []


def laboratory(folder: Path) -> Path:
    """Write 1 s of a log at 250 Hz with jitter, in semicolons, since 1970, a row missing."""
    rng = np.random.default_rng(1)
    stamps = 0.004 * np.arange(250) + rng.uniform(0, 5e-4, 250)
    lines = ["Time;Temperature;Torque 1;Torque 2"]
    for k in range(250):
        cells = f"1700000000{stamps[k]:.6f}"[:-8] + f"{stamps[k]:.6f}"[1:]
        lines += [f"{cells};21;{0.5 * np.sin(k / 20):.4f};0.01".replace(".", ",")] * (k != 100)
    path = folder / "lab.csv"
    path.write_text("\n".join(lines))
    return path


LABORATORY = ("--columns", "t=Time,tau1=Torque 1,tau2=Torque 2")


def test_a_laboratorys_log_drives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As its samples held by hand do, row for row; and it says what was done."""
    file = laboratory(tmp_path)
    words = ["drive", "--torque", str(file), "--out", str(tmp_path / "o.csv"), *LABORATORY]
    assert main([*words, "--theta2", "1.2"]) == 0
    said = capsys.readouterr().out
    for part in ("249 rows every 4", "1 gap held over, 1 sample", "columns left out: Temperature"):
        assert part in said
    got = columns(tmp_path / "o.csv")
    rows = [line.replace(",", ".").split(";") for line in file.read_text().splitlines()[1:]]
    stamps = np.array([float(row[0][10:]) for row in rows])  # of the second
    held = [
        max(j for j, t in enumerate(stamps - stamps[0]) if t <= k * 1e-3 + 1e-6)
        for k in range(len(got["t"]))
    ]
    torque = np.array([[float(row[2]), float(row[3])] for row in rows])[held]
    np.testing.assert_array_equal(replayed(tmp_path, torque, "--theta2", "1.2")["v"], got["v"])
    capsys.readouterr()
    assert main([*words, "--force", "--json"]) == 0
    log = json.loads(capsys.readouterr().out)["log"]
    assert (log["rows"], log["gaps"], log["filled"], log["resampled"]) == (249, 1, 1, True)
    assert log["rows_resampled"] == len(got["t"]) and log["start"] == pytest.approx(1.7e9)


def test_another_period_is_the_loops(tmp_path: Path) -> None:
    """Every other row of a log at 1 kHz, each held for 2 ms."""
    torque = trial_torque(1.0, duration=0.1)
    got = replayed(tmp_path, torque, "--period", "0.002")
    motion = drive(ChainPlant.designed(Parameters()), setting("none"), torque[::2], 2e-3)
    np.testing.assert_array_equal(got["theta1"], motion.joint[:-1, 0])
    np.testing.assert_allclose(got["t"], 2e-3 * np.arange(50), atol=STAMP)


@pytest.mark.parametrize("plant", ["assumed-modes", "chain", "closed-chain"])
def test_a_keyframe_of_the_file_is_the_start(
    plant: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = MODELS / "chain6.xml"
    options = ("--plant", plant, "--mjcf", str(file), "--start", "bent")
    got = replayed(tmp_path, np.zeros((50, 2)), *options)
    assert (got["theta1"][0], got["theta2"][0]) == (0.3, 1.2)
    assert got["v"][0] == pytest.approx(0.025, rel=3e-3)  # three modes of a force at the tip
    assert np.ptp(got["v"]) > 0.01
    said = capsys.readouterr().out
    assert f"Start: keyframe bent of {file}, at rest at (0.3, 1.2) rad, v 24.9" in said
    replayed(tmp_path, np.zeros((2, 2)), *options, "--json")
    start = json.loads(capsys.readouterr().out)["start"]
    assert start["keyframe"] == "bent" and start["theta"] == [0.3, 1.2]
    assert start["v"] == got["v"][0] and start["rates"] == [0.0, 0.0]


def test_without_a_file_keyframes_are_the_designed_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    got = replayed(tmp_path, np.zeros((3, 2)), "--start", "home")
    assert (got["theta1"][0], got["theta2"][0], got["v"][0]) == (0.3, 1.2, 0.0)
    assert "Start: keyframe home of the designed chain, at rest" in capsys.readouterr().out
    replayed(tmp_path, np.zeros((3, 2)), "--theta2", "1.2")
    assert "Start: at rest at (0, 1.2) rad, beam straight." in capsys.readouterr().out


@pytest.mark.parametrize("plant", ["assumed-modes", "chain", "rod", "exudyn"])
def test_a_locked_joint_stays(
    plant: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torque = trial_torque(1.0, duration=0.1)
    options = ("--plant", plant, "--theta1", "0.3", "--theta2", "1.2", "--lock")
    got = replayed(tmp_path, torque, *options, "joint1")
    assert np.abs(got["theta1"] - 0.3).max() < 1e-9 < 1e-4 < np.ptp(got["theta2"])
    assert "Locked: joint1." in capsys.readouterr().out
    both = replayed(tmp_path, torque, *options, "joint1", "joint2", "--json")
    for name, angle in (("theta1", 0.3), ("theta2", 1.2)):
        assert np.abs(both[name] - angle).max() < 1e-9
    assert json.loads(capsys.readouterr().out)["locked"] == ["joint1", "joint2"]


def test_a_keyframe_that_moves_a_locked_joint_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (MODELS / "chain6.xml").read_text()
    swung = '<key name="home" qvel="1 0 0 0 0 0 0 0"'
    (tmp_path / "m.xml").write_text(text.replace('<key name="home"', swung))
    write_torque(tmp_path / "tau.csv", np.zeros((2, 2)))
    words = ["--torque", str(tmp_path / "tau.csv"), "--out", str(tmp_path / "o.csv")]
    words += ["--mjcf", str(tmp_path / "m.xml"), "--start", "home", "--lock"]
    said = refused(tmp_path, capsys, *words, "joint1")
    assert "keyframe 'home' moves joint1 at 1 rad/s, which --lock holds" in said
    assert main(["drive", *words, "joint2"]) == 0


def test_summary_says_where_the_tip_ends(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torque = trial_torque(4.0, duration=0.05)
    got = replayed(tmp_path, torque)
    assert f"({got['x'][-1]:.6f}, {got['y'][-1]:.6f}) m" in capsys.readouterr().out
    replayed(tmp_path, torque, "--json")
    shown = json.loads(capsys.readouterr().out)
    assert shown["end_tip"] == [got["x"][-1], got["y"][-1]]
    assert shown["max_v"] == np.abs(got["v"]).max()
    assert (shown["plant"], shown["rows"]) == ("chain", 50)


def test_unknown_names_list_the_known() -> None:
    with pytest.raises(ParameterError, match="'rope' is unknown; choose rigid, assumed-modes"):
        Robot().plant("rope")


def test_a_rod_that_is_torn_has_run_away() -> None:
    """Torques that stretch its edges beyond any beam's length are no motion of the arm."""
    torque = np.full((300, 2), 50.0)
    with pytest.raises(DivergenceError, match="the rod plant ran away at t = 0"):
        drive(Robot().plant("rod"), setting("none"), torque)
