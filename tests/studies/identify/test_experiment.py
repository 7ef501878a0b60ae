"""Torques that tell numbers: no net push, inside the bounds, and the errors that they predict."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from studies.experiment.torques import KINDS, Band, balanced, shapes
from studies.main import main

PUSH = 1e-9  # relative, of what is balanced


@pytest.mark.parametrize("kind", KINDS)
def test_no_kind_pushes_the_arm_away(kind: str) -> None:
    time = 1e-3 * np.arange(3000)
    shape = shapes(kind, time, Band(0.5, 12.0))
    assert np.abs(shape).max(axis=0) == pytest.approx([1, 1])
    speed = np.cumsum(shape, axis=0)
    assert np.abs(speed[-1]).max() < PUSH * 3000
    ahead = 1 - (np.arange(3000) + 0.5) / 3000
    assert np.abs(ahead @ shape).max() < PUSH * 3000
    assert abs(np.corrcoef(shape.T)[0, 1]) < 0.9  # the joints can be told apart


def test_balance_takes_what_it_must_and_no_more() -> None:
    rng = np.random.default_rng(1)
    once = balanced(rng.standard_normal(500))
    assert balanced(once) == pytest.approx(once, abs=1e-12)


def test_a_multisine_has_its_lines_and_schroeders_crest() -> None:
    time = 1e-3 * np.arange(4000)
    shape = shapes("multisine", time, Band(2.0, 20.0))
    power = np.abs(np.fft.rfft(shape, axis=0)) ** 2
    lines = np.arange(8, 81)
    assert power[lines].sum() > 0.9 * power[1:].sum()
    first, other = power[lines[2::2]], power[lines[3::2]]
    assert first[:, 0].min() > 50 * other[:, 0].max() and other[:, 1].min() > 50 * first[:, 1].max()


def told(capsys: pytest.CaptureFixture[str], *words: str) -> dict:  # type: ignore[type-arg]
    assert main(["experiment", "--duration", "1.5", "--band", "0.7", "15", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_torques_are_scaled_until_the_arm_stays_inside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "tau.csv"
    words = ("--free", "EI,I_R0", "--torques", "5", "1")
    shown = told(capsys, *words, "--v-most", "0.01", "--out", str(out))
    assert shown["scale"] < 0.5 and 0.008 < shown["max_v"] <= 0.01
    motion = tmp_path / "motion.csv"
    drive = ["drive", "--plant", "assumed-modes", "--torque", str(out), "--out", str(motion)]
    assert main([*drive, "--theta2", "1.2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["max_v"] == pytest.approx(shown["max_v"], rel=1e-6)
    wider = told(capsys, *words, "--v-most", "0.02")
    error = [each["numbers"]["I_R0"]["error"] for each in (shown, wider)]
    assert error[0] > 1.5 * error[1]  # twice the motion, half the error


def test_what_cannot_be_told_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    shown = told(capsys, "--free", "EI,I_R0,m_H,F_1", "--torques", "0.01", "0.005")
    assert shown["silent"] == ["F_1"]
    assert [set(group) for group in shown["only_together"]] == [{"I_R0", "m_H"}]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--theta2", "3"), "--theta2 3 rad is not within --theta2-range 0.2 2.6"),
        (("--v-most", "1e-9"), "no share of these torques keeps the arm inside"),
        (("--setting", "simulink", "--torques", "1", "0.2"), "nothing moves under torques"),
        (("--band", "5", "2"), "band is 5 to 2 Hz"),
        (("--torques", "0", "0"), "not both 0"),
        (("--duration", "0.05"), "fewer than 100 periods"),
        (("--theta1-range", "1", "-1"), "give low < high"),
    ],
)
def test_what_no_torque_can_do_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], said: str
) -> None:
    out = tmp_path / "tau.csv"
    given = ["experiment", "--free", "EI", "--duration", "1.5", "--out", str(out)]
    assert main([*given, *words]) == 2
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1 and said in complaint
    assert not out.exists()


def test_draws_of_the_other_model_are_identified(capsys: pytest.CaptureFixture[str]) -> None:
    """Two draws of the README's hundred, half a second each."""
    words = ("--free", "EI,I_R0", "--duration", "0.5", "--band", "2", "12", "--check", "2")
    assert main(["experiment", *words, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["check_plant"] == "closed-chain" and shown["not_identified"] == []
    for row in shown["covered"]:
        assert row["inside"] == 2 and row["worst"] < 0.02, row
        assert row["half"] < 0.1, row  # an interval of anything would hold
