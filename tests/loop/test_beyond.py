"""Notes that a model was used beyond itself: whose, from where on, and in the commands."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flexsim.loop.beyond import V_MOST, beyond
from studies.main import main
from studies.parity.crosscheck import CrosscheckConfig, content, notes, run
from studies.parity.motions import trial_torque

L = 0.5  # [m]


@pytest.mark.parametrize("plant", ["assumed-modes", "assumed-modes:5", "printed:3"])
def test_only_more_than_two_percent_is_beyond(plant: str) -> None:
    assert beyond(plant, V_MOST * L, L) == () == beyond(plant, None, L)
    (note,) = beyond(plant, 0.0155, L)
    assert note.startswith(f"{plant}: v/L reaches 3.1 %, above 2 %")


@pytest.mark.parametrize("plant", ["rigid", "chain", "closed-chain:10", "untuned", "rod"])
def test_other_plants_have_no_truncation(plant: str) -> None:
    assert beyond(plant, 0.2, L) == ()


@pytest.mark.parametrize(("scale", "count"), [(1.0, 0), (4.0, 1)])
def test_drive_says_it(
    scale: float, count: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torque = tmp_path / "tau.csv"
    lines = [f"{k * 1e-3:.3f},{a!r},{b!r}" for k, (a, b) in enumerate(trial_torque(scale).tolist())]
    torque.write_text("\n".join(["t,tau1,tau2", *lines]) + "\n")
    words = ["drive", "--torque", str(torque), "--out", str(tmp_path / "o.csv"), "--theta2", "1.2"]
    words += ["--force", "--plant"]
    for plant, expected in (("assumed-modes", count), ("chain", 0)):
        assert main([*words, plant, "--json"]) == 0
        assert len(json.loads(capsys.readouterr().out)["beyond"]) == expected
        assert main([*words, plant]) == 0
        assert capsys.readouterr().out.count("Note: assumed-modes: v/L") == expected


def test_crosscheck_says_it_of_the_large_torques_only() -> None:
    result = run(CrosscheckConfig())
    (note,) = content(result)["beyond"]
    assert note in notes(result)
    assert [check.name for check in result.checks if check.beyond] == [
        check.name for check in result.checks if "large torques" in check.name
    ]
