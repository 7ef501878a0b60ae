"""The misprints' study: nothing without misprints, more with each, and the command's folder."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from quick_run import QuickRun

from controllers import TUNED_IDEAL
from flexsim import AssumedModesPlant, Parameters, drive, reference, setting, trajectory
from flexsim.loop.metrics import rms_distance
from flexsim.plants.printed import AS_PRINTED, MISPRINTS
from flexsim.robot import Robot
from studies.main import main
from studies.misprints.misprints import (
    STARTS,
    VARIANTS,
    apart,
    free_motion,
    middle,
    rank_with_printed_ranges,
    tracked,
    unrunnable,
)
from studies.misprints.report import (
    ENTRIES,
    RANGES,
    MisprintRow,
    MisprintsResult,
    costliest,
    tables,
    verdict,
)
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
    assert rms_distance(motions["none"].tip, consistent.tip) < ROUNDING
    assert rms_distance(motions["all"].tip, as_printed.tip) == 0.0
    for name in MISPRINTS:
        assert rms_distance(motions[name].tip, consistent.tip) > 1000 * ROUNDING


def test_loop_without_misprints_is_the_consistent_loop_and_46_moves_it() -> None:
    circle = reference(trajectory("circle"), Parameters())
    controllers = [TUNED_IDEAL["circle"]]
    (right,) = tracked(AssumedModesPlant(Parameters()), setting("none"), circle, controllers)
    (none,) = tracked(
        AssumedModesPlant(Parameters(), form="printed", misprints=0),
        setting("none"),
        circle,
        controllers,
    )
    (wrong,) = tracked(PLANT, setting("none"), circle, controllers)
    assert apart(right, none) < ROUNDING
    assert apart(right, wrong) > 1e-3
    assert apart(right, None) == np.inf


def fabricated(name: str, scale: float) -> MisprintRow:
    columns = [f"drift_{start}" for start in STARTS]
    columns += [f"tip_to_{w}_{a}" for w in ("chain", "consistent") for a in ("small", "large")]
    columns += [
        f"{w}_{r}" for w in ("envelope", "loop_to_consistent") for r in ("none", "simulink")
    ]
    return MisprintRow(name, 5, **dict.fromkeys(columns, scale))


def test_costliest_is_a_single_misprint() -> None:
    rows = [fabricated(name, float(i)) for i, name in enumerate(VARIANTS)]
    assert VARIANTS["all"] == AS_PRINTED
    assert costliest(rows, "drift_brisk") == list(MISPRINTS)[-1] == "(46) range"
    assert "in energy: (46) range" in verdict(MisprintsResult(rows, [], {}))


def test_a_median_is_shown_with_its_interval() -> None:
    row = replace(
        fabricated("all", 0.5),
        envelope_none=22.69e-3,
        envelope_none_low=22.6e-3,
        envelope_none_high=22.8e-3,
        envelope_simulink_high=math.inf,
    )
    envelopes = tables(MisprintsResult([row], [], {}))[1]
    assert envelopes.cells([row])[1] == "22.7 [22.6, 22.8]"
    assert envelopes.cells([row])[2] == "500.0 [?, ?]"


@pytest.mark.parametrize("modes", [1, 2, 3, 5])
def test_the_printed_ranges_leave_no_motion(modes: int) -> None:
    """Rows n+1 and n+2 of H are empty, all flexible ones for one mode."""
    plant = AssumedModesPlant(Parameters(), modes)
    assert rank_with_printed_ranges(plant) == max(modes, 2)
    shown, *loops, _ = tables(MisprintsResult([MisprintRow(RANGES, 3)], [], {}))
    assert shown.cells(shown.rows) == [RANGES, *["-"] * 4]
    assert not any(table.rows for table in loops)


@pytest.mark.parametrize(("modes", "missing"), [(1, -1), (2, None), (3, 1), (5, 3)])
def test_f_of_31_fits_two_modes_only(modes: int, missing: int | None) -> None:
    rows = {row.misprint: row for row in unrunnable(AssumedModesPlant(Parameters(), modes))}
    assert rows[RANGES].rank_of_H == max(modes, 2)
    assert (rows[ENTRIES].missing_F if ENTRIES in rows else None) == missing


def test_medians_have_their_intervals_and_what_diverged_counts_as_large() -> None:
    twenty = [float(i) for i in range(20)]
    assert middle(twenty) == (9.5, 5.0, 14.0)  # ranks 6 and 15 of 20: 95.9 %
    assert middle(twenty[:15] + [np.inf] * 5) == (9.5, 5.0, 14.0)
    assert middle(twenty[:14] + [np.inf] * 6) == (9.5, 5.0, np.inf)
    assert middle(twenty[:5]) == (2.0, None, None)


@pytest.mark.parametrize("command", ["misprints", "reconstruct", "realisations"])
@pytest.mark.parametrize("wrong", [("--perturbations", "0"), ("--seed", "-1")])
def test_impossible_numbers_are_one_line(
    command: str, wrong: tuple[str, str], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "run"
    assert main([command, *wrong, "--out", str(out)]) == 2
    assert capsys.readouterr().err.count("\n") == 1 and not out.exists()


def test_the_command_writes_its_folder(quick: Callable[[str], QuickRun]) -> None:
    run = quick("misprints")
    rows = run.content["rows"]
    assert [row["misprint"] for row in rows] == [*VARIANTS, RANGES, ENTRIES]
    assert [row["missing_F"] for row in rows] == [*[0] * len(VARIANTS), 0, 1]
    assert run.files == {"config.json", "tables.json", "details.csv", "figures", "results.csv"}
    assert run.figures == {"energy.png", "tip.png"}
    assert run.faults() == []
    cases = {(row["misprint"], row["case"]) for row in run.table("details.csv")}
    assert len(cases) == len(VARIANTS) * 4
