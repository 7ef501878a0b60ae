"""One closed loop of any controller: its file, its figures, and what it cannot do."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from controllers import TUNED
from flexsim import Robot, closed_loop, reference, setting, trajectory
from flexsim.loop.hardware import overridden
from flexsim.loop.metrics import measures
from studies.main import main
from studies.tools.follow import MOTION_HEADER
from studies.tuning.found import found_in

STAMP = 1e-12  # [s] nine digits of a time below 10 s


def columns(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="") as file:
        head, *rows = csv.reader(file)
    assert tuple(head) == MOTION_HEADER
    return dict(zip(head, np.array(rows, dtype=float).T, strict=True))


def test_it_is_the_librarys_loop(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of our circle, on its own trajectory, torques as commanded, to the last digit."""
    out = tmp_path / "circle.csv"
    words = ["follow", "--controller", "circle", "--plant", "assumed-modes", "--out", str(out)]
    assert main([*words, "--hardware", "bench", "--seed", "3", "--json"]) == 0
    told, found = json.loads(capsys.readouterr().out), columns(out)
    chosen = setting("simulink", overridden("bench", seed=3))
    plant, path = Robot().plant("assumed-modes", chosen), trajectory("circle")
    ref = reference(path, plant.parameters)
    (motion,) = closed_loop(plant, chosen, ref, [TUNED["circle"].filters(1e-3)])
    assert np.allclose(found["t"], motion.time, atol=STAMP)
    for names, rows in (
        (("x", "y"), motion.tip),
        (("theta1", "theta2"), motion.joint),
        (("tau1", "tau2"), motion.torque),
        (("x_ref", "y_ref"), ref.tip),
        (("theta1_ref", "theta2_ref"), ref.joint),
    ):
        np.testing.assert_array_equal(np.column_stack([found[name] for name in names]), rows)
    np.testing.assert_array_equal(found["v"], motion.v)
    figures = measures(motion, ref, path.hold)
    assert {name: told[name] for name in figures} == figures
    assert (told["rows"], told["trajectory"], told["plant"]) == (5001, "circle", "assumed-modes")
    assert told["hardware"].endswith("(seed 3)") and told["out"] == str(out)


def test_a_run_follows_at_its_own_period_with_its_own_v(
    tuned_otherwise: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "line.csv"
    words = ["follow", "--controller", str(tuned_otherwise), "--plant", "assumed-modes"]
    words += ["--trajectory", "line", "--setting", "none", "--out", str(out)]
    assert main([*words, "--json"]) == 0
    told, found = json.loads(capsys.readouterr().out), columns(out)
    assert (told["period"], told["v_gain"], told["rows"]) == (2e-3, 0.0, 2501)
    assert (told["trajectory"], told["controller"]) == ("line", "run otherwise")
    chosen = setting("none")
    plant = Robot().plant("assumed-modes", chosen)
    ref = reference(trajectory("line"), plant.parameters, 2e-3)
    filters = found_in(tuned_otherwise).filters(2e-3)
    mirrored, ignored = (
        closed_loop(plant, chosen, ref, [filters], v_gain=v_gain)[0] for v_gain in (-1.0, 0.0)
    )
    np.testing.assert_array_equal(found["v"], ignored.v)
    assert not np.array_equal(mirrored.v[: len(ignored.v)], ignored.v)
    assert main([*words, "--force"]) == 0
    assert f"{out}: 2501 rows of the assumed-modes plant, line by run otherwise; envelope" in (
        capsys.readouterr().out
    )


def test_a_divergence_is_said_and_the_motion_up_to_it_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Figure 3's controller under a friction that does not bound it."""
    out = tmp_path / "line.csv"
    words = ["follow", "--controller", "figure-3", "--plant", "assumed-modes", "--out", str(out)]
    assert main(words) == 0
    said = capsys.readouterr().out.splitlines()
    found = columns(out)
    assert f"diverged at t = {found['t'].size * 1e-3:.4g} s, the motion up to then" in said[0]
    assert all(np.isfinite(each).all() for each in found.values())
    assert main([*words, "--setting", "reconstructed", "--force", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["diverged"] is False and told["rows"] == 5791  # the fit's trajectory


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--controller circel --out o.csv", "Did you mean circle"),
        ("--controller circle --out taken.csv", "exists already"),
        ("--controller circle --trajectory square --out o.csv", "two-loop"),
        ("--controller circle --plant beam --out o.csv", "rigid"),
        ("--controller circle --setting ice --out o.csv", "opposing"),
        ("--controller circle --hardware desk --out o.csv", "bench"),
        ("--controller circle --seed -1 --out o.csv", "seed"),
        ("--controller ./circle --out o.csv", "not a run of flexsim tune"),
        ("--out o.csv", "--controller"),
        ("--controller circle", "--out"),
    ],
)
def test_what_cannot_be_followed_is_said_in_one_line(
    words: str,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken.csv").write_text("mine")
    assert main(["follow", *words.split()]) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and shown.err.count("\n") == 1 and said in shown.err
    assert [each.name for each in tmp_path.iterdir()] == ["taken.csv"]
    assert Path("taken.csv").read_text() == "mine"
