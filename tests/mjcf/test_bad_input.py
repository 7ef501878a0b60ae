"""Wrong input: one line on stderr, status 2, nothing on stdout, nothing written."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from flexsim import ChainPlant, ModelError, ParameterError, Parameters, load_chain, reference
from flexsim.loop.runs import loop_of
from flexsim.loop.trajectories import TRAJECTORIES
from studies.commands import COMMANDS
from studies.main import main

MODEL = (Path(__file__).parents[2] / "models" / "chain6.xml").read_text()
TORQUE = "t,tau1,tau2\n0,0.1,0\n0.001,0.1,0\n"


def refused(
    arguments: list[str], capsys: pytest.CaptureFixture[str], folder: Path, *words: str
) -> None:
    """Check that the arguments are refused in one line with these words, the folder untouched."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    folders = sorted(path for path in folder.rglob("*") if path.is_dir())
    assert main(arguments) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1, shown.err
    for word in words:
        assert word in shown.err
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    assert sorted(path for path in folder.rglob("*") if path.is_dir()) == folders


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tau.csv").write_text(TORQUE)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("comp", ("'comp'", "compare")),
        ("compare --plnt x", ("--plnt", "--help")),
        ("compare --setting foo", ("'foo'", "reconstructed")),
        ("compare --line.end 2 2", ("'line'", "out of reach", "0.895")),
        ("compare --circle.centre 0.575 0 --circle.half-width 0.32", ("'circle'", "singular")),
        ("compare --line.shape spiral", ("'spiral'", "two-loop")),
        ("compare --period 0.0015", ("0.0015", "0.001")),
        ("compare --step 0.02", ("0.02", "0.00684")),
        ("compare --chain-step 0.01", ("0.01", "0.00114")),
        ("compare --robot.EI -1", ("EI", "-1", "more than 0")),
        ("compare --robot.L nan", ("L", "nan", "finite")),
        ("compare --robot.F-1 inf", ("F_1", "inf", "finite")),
        ("compare --segments 99", ("99", "16")),
        ("compare --segments six", ("--segments", "six")),
        ("compare --modes 0", ("0", "1 to 40")),
        ("compare --perturbations 0", ("perturbations",)),
        ("compare --seed -1", ("seed", "-1")),
        ("crosscheck --seed -1", ("seed", "-1")),
        ("compare --threads 0", ("threads",)),
        ("compare --threads 1000", ("threads",)),
        ("compare --out tau.csv/run", ("tau.csv",)),
        ("compare --out .", ("exists",)),
        ("compare --out . --force", ("cannot replace it",)),
        ("drive --torque tau.csv --out o.csv --plant rope", ("'rope'", "assumed-modes")),
        ("drive --torque tau.csv --out o.csv --setting foo", ("'foo'", "opposing")),
        ("drive --torque tau.csv --out o.csv --setting joint", ("'joint'", "opposing")),
        ("compare --setting print", ("'print'", "'jump'")),
        ("drive --torque none.csv --out o.csv", ("none.csv",)),
        ("drive --torque tau.csv --out tau.csv", ("exists", "--force")),
        ("drive --torque tau.csv --out no/o.csv", ("no/o.csv",)),
        ("drive --torque tau.csv --out o.csv --theta1 nan", ("nan",)),
        ("drive --out o.csv", ("--torque",)),
        ("chain --segments 1 --out x.xml", ("1", "3 to 16")),
        ("chain --segments 10 --timestep 0.001 --out x.xml", ("0.001", "5978")),
        ("chain --out x.txt", (".xml",)),
        ("chain --out no/x.xml", ("no/x.xml",)),
        ("filter --order 0.5 --realisation foo", ("'foo'", "oustaloup")),
        ("filter --order nan", ("nan",)),
        ("filter --order 0.5 --period 0", ("period",)),
        ("filter --order 0.5 --terms 0", ("terms",)),
        ("benchmark --rounds 0", ("rounds",)),
        ("modes none.xml", ("none.xml",)),
        ("modes .", ("MJCF",)),
        ("view none", ("none",)),
        ("view tau.csv", ("tau.csv",)),
    ],
)
def test_refused_in_one_line(
    arguments: str, words: tuple[str, ...], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    refused(arguments.split(), capsys, tmp_path, *words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ("t,tau1,tau2",)),
        ("t,tau1\n0,0\n", ("no column is called 'tau2'", "--columns")),
        ("t,tau1,tau2\n", ("no rows",)),
        ("t,tau1,tau2\n0,1\n", ("line 2",)),
        ("t,tau1,tau2\n0,1,0\n0.001,one,0\n", ("line 3", "one")),
        ("t,tau1,tau2\n0,nan,0\n", ("column 'tau1' is empty",)),
        ("t,tau1,tau2\n0,1,0\n0,1,0\n", ("line 3",)),
        ("t,tau1,tau2\n0,1e300,0\n", ("ran away",)),
        ("\0\x01", ("no column is called 't'",)),
    ],
)
def test_torque_file_refused(
    text: str, words: tuple[str, ...], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "bad.csv").write_text(text)
    arguments = ["drive", "--torque", "bad.csv", "--out", "o.csv"]
    refused(arguments, capsys, tmp_path, *words)


def edited(pattern: str, replacement: str) -> str:
    text, count = re.subn(pattern, replacement, MODEL)
    assert count, pattern
    return text


EDITS = {
    "empty": ("", ("empty",)),
    "malformed": (MODEL[:-30], ("not valid MJCF",)),
    "other element": ("<mujoco><foo/></mujoco>", ("foo",)),
    "no include": ('<mujoco><include file="gone.xml"/></mujoco>', ("gone.xml",)),
    "no arm": ("<mujoco/>", ("joint1",)),
    "joint2 renamed": (edited('"joint2"', '"elbow"'), ("joint2",)),
    "hub site gone": (edited(r'<site name="hub"/>|.*refname="hub".*\n', ""), ("site", "hub")),
    "tip site gone": (edited(r'.*site name="tip".*\n|.*objname="tip".*\n', ""), ("site", "tip")),
    "motor1 gone": (edited(r'.*name="motor1".*\n', ""), ("motor1",)),
    "motor2 renamed": (edited('name="motor2"', 'name="drive2"'), ("motor2",)),
    "long step": (edited('timestep="0.001"', 'timestep="0.005"'), ("0.005", "0.00114")),
    "negative stiffness": (edited('hinge1" stiffness="', 'hinge1" stiffness="-'), ("hinge1",)),
    "nan stiffness": (edited('hinge1" stiffness="[^"]*"', 'hinge1" stiffness="nan"'), ("nan",)),
    "negative damping": (edited('damping="0.0002"', 'damping="-1"'), ("joint1", "damping")),
    "negative mass": (edited('mass="0.47"', 'mass="-0.47"'), ("hub", "-0.47")),
    "nan mass": (edited('mass="0.47"', 'mass="nan"'), ("hub", "nan")),
    "slide": (
        edited('<joint name="hinge3"', '<joint name="hinge3" type="slide"'),
        ("hinge3", "hinge"),
    ),
    "hinge aside": (
        edited('<joint name="hinge3"', '<joint name="hinge3" pos="0 0.01 0"'),
        ("'hinge3'", "along the x-axis"),
    ),
}


@pytest.mark.parametrize("edit", EDITS)
@pytest.mark.parametrize("command", ["modes m.xml", "crosscheck --mjcf m.xml"])
def test_mjcf_refused(
    edit: str, command: str, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    text, words = EDITS[edit]
    (tmp_path / "m.xml").write_text(text)
    refused(command.split(), capfd, tmp_path, "m.xml", *words)


def test_binary_mjcf_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "m.xml").write_bytes(bytes(range(256)))
    refused(["modes", "m.xml"], capsys, tmp_path, "not text")


def test_step_that_does_not_divide_the_rows(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "m.xml").write_text(edited('timestep="0.001"', 'timestep="0.0007"'))
    arguments = "drive --mjcf m.xml --torque tau.csv --out o.csv".split()
    refused(arguments, capsys, tmp_path, "0.001", "0.0007")


def test_the_unedited_file_is_accepted(tmp_path: Path) -> None:
    """Guards the edits above: what they refuse is the edit."""
    (tmp_path / "m.xml").write_text(MODEL)
    assert load_chain(tmp_path / "m.xml").model.nv == 8
    with pytest.raises(ModelError):
        load_chain(tmp_path / "n.xml")


def test_library_names_both_clocks() -> None:
    plant = ChainPlant.designed(Parameters())
    with pytest.raises(ParameterError, match=r"0\.0015.*0\.001"):
        loop_of(plant, reference(TRAJECTORIES["line"], Parameters(), 0.0015))


def test_library_names_the_point_out_of_reach() -> None:
    far = replace(TRAJECTORIES["circle"], centre=(0.8, 0.5))
    with pytest.raises(ParameterError, match=r"'circle'.*point 0 .*out of reach"):
        reference(far, Parameters())


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--help"]) == 0
    shown = capsys.readouterr()
    assert "usage" in shown.out.lower()
    assert ("--json" in shown.out) == (command not in ("view", "completion"))


def test_status_of_the_process(tmp_path: Path) -> None:
    """The shell sees status 2 and no traceback."""
    done = subprocess.run(
        [sys.executable, "-m", "studies.main", "filter", "--order", "0.5", "--terms", "-1"],
        capture_output=True,
        text=True,
        cwd=Path(__file__).parents[2],
        check=False,
    )
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
