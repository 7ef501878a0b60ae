"""`flexsim beam`: what is written, what is printed, what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from studies.beam.beam import BeamConfig, run
from studies.main import main

MODEL = Path(__file__).parents[2] / "models" / "chain4.xml"
NUMBERS = ["--length", "0.5", "--EI", "0.349", "--rho", "0.157"]


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "robot.xml"
    path.write_text(MODEL.read_text())
    return path


def test_the_file_has_the_beams_frequencies(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["beam", "--mjcf", str(robot), "--parent", "link1", *NUMBERS, "--segments", "4"]
    assert main([*words, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    written = robot.with_name("robot-beam.xml")
    assert printed["file"] == str(written) and robot.read_text() == MODEL.read_text()
    np.testing.assert_allclose(
        np.array(printed["frequency"]) / (2 * np.pi), [3.33729, 20.91443, 58.56101], atol=6e-6
    )
    model = mujoco.MjModel.from_xml_path(str(written))
    assert [model.joint(name).stiffness[0] for name in printed["joints"]] == pytest.approx(
        printed["stiffness"], rel=1e-11
    )
    assert main(words) == 2  # it is there
    assert "--force" in capsys.readouterr().err
    assert main([*words, "--force"]) == 0
    assert "all else in it compiles as before" in " ".join(capsys.readouterr().out.split())


def test_stations_are_the_beam_that_they_say(robot: Path, tmp_path: Path) -> None:
    """Those of a uniform beam give the uniform beam; a fourth column lets it out of the plane."""
    stations = tmp_path / "beam.csv"
    stations.write_text("s,EI,rho,EI_out\n0,0.349,0.157,2\n0.2,0.349,0.157,2\n0.5,0.349,0.157,2\n")
    one = run(BeamConfig(robot, "hub", stations=stations, segments=4))
    other = run(BeamConfig(robot, "hub", 0.5, 0.349, 0.157, EI_out=2.0, segments=4))
    np.testing.assert_allclose(one.chain.stiffness, other.chain.stiffness, rtol=1e-12)
    assert one.part.joints_out == other.part.joints_out != []
    stations.write_text("s,EI,rho\n0,0.349,0.157\n0.5,0.1,0.1\n")
    tapered = run(BeamConfig(robot, "hub", stations=stations, segments=4, zeta=0.01))
    assert tapered.part.joints_out == []
    np.testing.assert_allclose(tapered.made.frequency, tapered.made.wanted, rtol=1e-9)
    first = 2 * 0.01 / tapered.made.wanted[0]
    assert tapered.part.eta == pytest.approx(first, rel=1e-12)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--parent", "hbu", *NUMBERS], "has no body 'hbu'; choose world, link1, hub"),
        (["--parent", "hub", "--length", "0.5"], "--EI, --rho missing"),
        (["--parent", "hub", *NUMBERS, "--segments", "17"], "give a whole number from 3 to 16"),
        (["--parent", "hub", *NUMBERS, "--EI", "0"], "EI is 0 N m2"),
        (["--parent", "hub", *NUMBERS, "--EI", "nan"], "EI is nan N m2"),
        (["--parent", "hub", *NUMBERS, "--taper", "0"], "the tip's thickness is 0"),
        (["--parent", "hub", *NUMBERS, "--quat", "0", "0", "0", "0"], "not all zero"),
        (["--parent", "hub", *NUMBERS, "--zeta", "1"], "zeta is 1"),
        (["--parent", "hub", *NUMBERS, "--zeta", "0", "--damping", "0"], "contradict each other"),
        (["--parent", "hub", *NUMBERS, "--prefix", "a b"], "prefix is 'a b'"),
        (["--parent", "hub", *NUMBERS, "--out", "beam.txt"], "ends in .xml"),
        (["--parent", "hub", *NUMBERS, "--out", "./robot.xml", "--force"], "is the file of --mjcf"),
        (["--parent", "hub", *NUMBERS, "--stations", "s.csv"], "contradict each other"),
        (["--parent", "hub", "--stations", "none.csv"], "none.csv: cannot read"),
        (["--parent", "hub", "--stations", "bad.csv"], "line 3 has 'x' for EI; give a number"),
        (["--parent", "hub", "--stations", "names.csv"], "give the names s,EI,rho"),
    ],
)
def test_bad_input_is_one_line(
    more: list[str],
    words: str,
    robot: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(robot.parent)
    Path("bad.csv").write_text("s,EI,rho\n0,1,1\n1,x,1\n")
    Path("names.csv").write_text("s,E,rho\n0,1,1\n1,1,1\n")
    before = sorted(Path().iterdir())
    assert main(["beam", "--mjcf", "robot.xml", *more]) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and words in shown.err and len(shown.err.splitlines()) == 1
    assert sorted(Path().iterdir()) == before
