"""The misprints' study: nothing without misprints, more with each, and the command's folder."""

import json
from pathlib import Path

import numpy as np
import pytest

from controllers import TUNED
from flexsim import AssumedModesPlant, Parameters, drive, reference, setting, trajectory
from flexsim.plants.printed import AS_PRINTED, MISPRINTS
from flexsim.robot import Robot
from studies.main import main
from studies.misprints.misprints import (
    RANGES,
    STARTS,
    VARIANTS,
    MisprintsConfig,
    apart,
    free_motion,
    rank_with_printed_ranges,
    tracked,
)
from studies.misprints.report import costliest, energy_figure, table, tip_figure, verdict
from studies.parity.crosscheck import tip_difference
from studies.parity.motions import trial_torque

CONSERVED = 1e-11  # relative over 2 s at 0.25 ms; RK4 leaves 2e-13 from a straight beam
BENT = 1e-7  # the same from a bent beam, whose third mode RK4 damps: 2.7e-8
DRIFT_46 = 1e-5  # of (46) alone in brisk motion: 3.0e-5
ROUNDING = 1e-9  # [m] of the tip over 2 s; a dense solve against a 2x2 one
PLANT = AssumedModesPlant(Parameters(), form="printed")


@pytest.mark.parametrize(("start", "limit"), [("gentle", CONSERVED), ("bent", BENT)])
def test_without_misprints_energy_stays(start: str, limit: float) -> None:
    assert np.abs(free_motion(Robot(), 0, start)).max() < limit


def test_every_misprint_alone_makes_energy_from_a_bent_beam() -> None:
    for switch in MISPRINTS.values():
        assert np.abs(free_motion(Robot(), switch, "bent")).max() > 100 * BENT
    assert np.abs(free_motion(Robot(), MISPRINTS["(46) square"], "brisk")).max() > DRIFT_46


def test_switches_reach_the_plant() -> None:
    motions = {
        name: drive(
            AssumedModesPlant(Parameters(), form="printed", misprints=bits),
            setting("none"),
            trial_torque(4),
        )
        for name, bits in VARIANTS.items()
    }
    consistent = drive(AssumedModesPlant(Parameters()), setting("none"), trial_torque(4))
    as_printed = drive(
        AssumedModesPlant(Parameters(), form="printed"), setting("none"), trial_torque(4)
    )
    assert tip_difference(motions["none"], consistent) < ROUNDING
    assert tip_difference(motions["all"], as_printed) == 0.0
    for name in MISPRINTS:
        assert tip_difference(motions[name], consistent) > 1000 * ROUNDING


def test_loop_without_misprints_is_the_consistent_loop_and_46_moves_it() -> None:
    circle = reference(trajectory("circle"), Parameters())
    controllers = [TUNED["circle"]]
    (right,) = tracked(AssumedModesPlant(Parameters()), "none", circle, controllers)
    (none,) = tracked(
        AssumedModesPlant(Parameters(), form="printed", misprints=0), "none", circle, controllers
    )
    (wrong,) = tracked(PLANT, "none", circle, controllers)
    assert apart(right, none) < ROUNDING
    assert apart(right, wrong) > 1e-3
    assert apart(right, None) == np.inf


def fabricated(name: str, scale: float) -> dict[str, float | str]:
    columns = [f"drift_{start}" for start in STARTS]
    columns += [f"tip_to_{w}_{a}" for w in ("chain", "consistent") for a in ("small", "large")]
    columns += [f"{w}_{r}" for w in ("envelope", "loop_to_consistent") for r in ("none", "print")]
    return {"misprint": name} | dict.fromkeys(columns, scale)


def test_costliest_is_a_single_misprint() -> None:
    rows = [fabricated(name, float(i)) for i, name in enumerate(VARIANTS)]
    assert VARIANTS["all"] == AS_PRINTED
    assert costliest(rows, "drift_brisk") == list(MISPRINTS)[-1]
    assert "(46) square" in verdict(rows)
    assert table(rows).row_count == len(rows)


@pytest.mark.parametrize("modes", [1, 2, 3, 5])
def test_the_printed_ranges_leave_no_motion(modes: int) -> None:
    """Rows n+1 and n+2 of H are empty, all flexible ones for one mode."""
    plant = AssumedModesPlant(Parameters(), modes)
    assert rank_with_printed_ranges(plant) == max(modes, 2)
    row = {"misprint": "(39)-(41) ranges", "drift_brisk": None, "rank_of_H": 3}
    assert table([row]).row_count == 1


def test_figures_are_written(tmp_path: Path) -> None:
    energy = {name: np.array([0.0, 1e-9, 1e-8]) for name in VARIANTS}
    energy_figure(energy, "bent", 1e-3, tmp_path / "energy.png")
    details = [
        {"misprint": name, "case": f"torques {size}", "theta2": pose, "tip_to_chain": 1e-6}
        for name in VARIANTS
        for size in ("small", "large")
        for pose in (0.4, 0.8)
    ]
    tip_figure(details, tmp_path / "tip.png")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["energy.png", "tip.png"]


@pytest.mark.parametrize("command", ["misprints", "reconstruct", "realisations"])
@pytest.mark.parametrize("wrong", [("--perturbations", "0"), ("--seed", "-1")])
def test_impossible_numbers_are_one_line(
    command: str, wrong: tuple[str, str], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "run"
    assert main([command, *wrong, "--out", str(out)]) == 2
    assert capsys.readouterr().err.count("\n") == 1 and not out.exists()


@pytest.mark.slow
def test_the_command_writes_its_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["misprints", "--quick", "--json", "--out", str(tmp_path / "run")]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [row["misprint"] for row in rows] == [*VARIANTS, RANGES]
    assert MisprintsConfig(quick=True).runs == 2
    assert {path.name for path in (tmp_path / "run").iterdir()} == {
        ".flexsim-run",
        "config.json",
        "details.csv",
        "figures",
        "results.csv",
    }
