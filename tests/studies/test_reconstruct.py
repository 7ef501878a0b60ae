"""The reconstruction's study: what stays bounded, what does not, how runs part, and the units."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from quick_run import QuickRun

from controllers import TABLE_2
from flexsim import AssumedModesPlant, Parameters, reference
from flexsim.arm.parameters import paper
from flexsim.loop.runs import measure
from flexsim.numerics.clocks import PERIOD
from flexsim.robot import Robot
from studies.core.evidence.intervals import share_interval
from studies.reconstruct.reconstruct import (
    FIGURES,
    ReconstructConfig,
    chaos_row,
    figure_row,
    unit_rows,
)
from studies.reconstruct.rows import FigureRow, misfit_row
from studies.reconstruct.variants import LIMITS, QUICK, Variant, variants

QUICKLY = ReconstructConfig(quick=True).asked()
BY_NAME = {variant.name: variant for variant in variants()}
AT_ONCE = 1.0  # [s] by which +v has diverged: 0.34 to 0.61 s
SPREAD = 0.25  # relative to the medians of twelve runs that the README quotes


def modes_row(name: str, figure: str) -> FigureRow:
    variant = BY_NAME[name]
    plant = variant.plants(Robot(paper()), 3, 6)[0]
    assert isinstance(plant, AssumedModesPlant)
    return figure_row(variant, figure, plant, QUICKLY)[0]


@pytest.mark.parametrize(
    ("figure", "envelope"), [("3", 0.0125), ("4", 0.0174), ("5", 0.0062), ("6", 0.0431)]
)
def test_as_reconstructed_all_runs_are_bounded(figure: str, envelope: float) -> None:
    row = modes_row("as reconstructed", figure)
    assert row.bounded_share == 1.0 and row.diverged_at is None
    assert row.envelope == pytest.approx(envelope, rel=SPREAD)
    assert row.envelope_quartile_1 <= row.envelope <= row.envelope_quartile_3
    assert (row.bounded_share_low, row.bounded_share_high) == share_interval(3, 3)
    assert row.envelope_low is None  # of three runs there is no interval


@pytest.mark.parametrize("figure", FIGURES)
def test_plus_v_diverges_at_once(figure: str) -> None:
    row = modes_row("+v in the loop", figure)
    assert row.bounded_share == 0.0 and row.envelope is None
    assert row.diverged_at < AT_ONCE


@pytest.mark.parametrize("name", ["no torque limits", "friction none", "friction jump"])
def test_table_2_needs_limits_and_friction_at_the_joints(name: str) -> None:
    assert modes_row(name, "4").bounded_share == 0.0


@pytest.mark.parametrize(("taps", "envelope"), [(9, 12.95), (10, None), (11, 6.19), (12, None)])
def test_an_even_number_of_taps_loses_figure_5(taps: int, envelope: float | None) -> None:
    """C_1's gain at rest is then below 0; the print of (2) has eleven."""
    variant = BY_NAME["as reconstructed"]
    plant = variant.plants(Robot(paper()), 3, 6)[0]
    path = reference(variant.trajectory("circle"), plant.parameters, PERIOD)
    filters = TABLE_2["figure-5"].filters(PERIOD, terms=taps - 1)
    (found,) = measure(plant, variant.setting, path, [filters])
    assert found["diverged"] is (envelope is None)
    if envelope is not None:
        assert 1e3 * found["envelope"] == pytest.approx(envelope, rel=SPREAD)


def test_v_is_not_needed() -> None:
    def moved(name: str) -> float:
        return modes_row(name, "6").envelope or np.inf

    assert moved("v left out") < moved("as reconstructed")


def test_variants_differ_in_one_thing_and_names_are_unique() -> None:
    everything = variants()
    assert len(BY_NAME) == len(everything) and set(QUICK) <= set(BY_NAME)
    assert BY_NAME["limit on joint 1 only"].setting.friction.torque_limit == (LIMITS[0], np.inf)
    assert BY_NAME["limit 2 -20 %"].setting.friction.torque_limit == (
        LIMITS[0],
        pytest.approx(0.8 * LIMITS[1]),
    )
    assert BY_NAME["I_m2 +20 %"].setting.I_m2 == pytest.approx(1.2 * 0.0557)
    assert BY_NAME["I_m2 = 0"].plants(Robot(), 3, 6)[0].parameters == Parameters()
    assert {plant.step for plant in BY_NAME["physics step 0.25 ms"].plants(Robot(), 3, 6)} == {
        0.25e-3
    }


def test_moved_and_resized_figures() -> None:
    base, moved = Variant("base", "as it is"), Variant("place", "x", centre=(0.5, 0.2), size=0.8)
    for path in ("line", "two-loop", "circle"):
        time = np.linspace(0, base.trajectory(path).duration, 2001)
        first, second = base.trajectory(path).at(time), moved.trajectory(path).at(time)
        middle = (second.max(axis=0) + second.min(axis=0)) / 2
        np.testing.assert_allclose(middle, (0.5, 0.2), atol=1e-6)
        np.testing.assert_allclose(np.ptp(second, axis=0), 0.8 * np.ptp(first, axis=0), rtol=1e-5)
    slow = Variant("fit", "slow", slowness=1.2).trajectory("line")
    assert slow.duration == pytest.approx(1.2 * base.trajectory("line").duration)


def test_small_hairs_last_on_the_assumed_modes() -> None:
    variant = BY_NAME["as reconstructed"]
    row, distance = chaos_row(variant, "5", variant.plants(Robot(paper()), 3, 6)[0], QUICKLY)
    assert row.kind != "chaotic" and row.apart["apart_1e-09"] == 0.0
    assert distance[0] == pytest.approx(1e-9, rel=1e-3) and distance.max() < 1e-6


def test_leading_gains_fall_inside_table_1_in_milliseconds_only() -> None:
    leading = [row for row in unit_rows() if row.gain in ("k_1", "k_4")]
    assert len(leading) == 6
    assert all(abs(row.deviations_milliseconds) < 2 for row in leading)
    assert not any(abs(row.deviations_seconds) < 2 for row in leading)
    assert {row.gain for row in unit_rows()} <= {f"k_{i}" for i in range(1, 7)}


def made_row(figure: str, share: float = 1.0) -> FigureRow:
    names = ("base", "as it is", figure, "chain", 8, share, 0.0, 1.0)
    return FigureRow(*names, 0.02, *[None] * 7, paper_simulation=0.01)


def test_misfit_is_a_factor_with_an_interval() -> None:
    """Twice as wide and half as wide are as far off; pairs of runs stay together."""
    sample = 0.02 * np.exp(0.05 * np.random.default_rng(1).normal(size=9))
    sample *= 0.02 / np.median(sample)
    rows = [made_row("3"), made_row("4")]
    found = misfit_row(rows, [sample, 0.01**2 / sample], seed=1)
    assert found.factor == pytest.approx(2)
    assert 1.9 < found.factor_low < 2 < found.factor_high < 2.1
    exact = misfit_row(rows, [[0.02] * 9, [0.005] * 9], seed=1)
    assert (exact.factor_low, exact.factor_high) == pytest.approx((2, 2))
    few = misfit_row(rows, [sample[:5], sample[:5]], seed=1)
    assert few.factor is not None and few.factor_low is None
    assert misfit_row([rows[0], made_row("4", 0.5)], [sample, sample], seed=1).factor is None


def test_digits_are_those_that_the_runs_support() -> None:
    row = made_row("3")
    assert replace(row, envelope_low=0.0199, envelope_high=0.0202).outcome == " 20.0"
    assert replace(row, envelope_low=0.017, envelope_high=0.031).outcome == "   20"
    lost = replace(row, bounded_share=0.0, diverged_at=1.304)
    assert replace(lost, diverged_at_low=1.30, diverged_at_high=1.31).outcome == "†1.30"
    assert replace(lost, diverged_at_low=1.1, diverged_at_high=1.7).outcome == "† 1.3"


def test_the_command_writes_its_folder(quick: Callable[[str], QuickRun]) -> None:
    run = quick("reconstruct")
    rows = run.content["rows"]
    assert [row["variant"] for row in rows[:: 2 * len(FIGURES)]] == list(QUICK)
    assert {row["plant"] for row in rows} == {"assumed-modes", "chain"}
    assert all(row["bounded_share"] == (row["variant"] == QUICK[0]) for row in rows)
    assert len(run.content["chaos"]) == 8
    assert run.figures == {"chaos.png", "envelopes.png"}
    assert run.faults() == []
    assert run.files == {
        "config.json",
        "tables.json",
        "figures",
        "results.csv",
        "chaos.csv",
        "misfits.csv",
        "units.csv",
    }
    assert {"apart_1e-09", "apart_1e-09_low", "lasting_high"} <= set(run.table("chaos.csv")[0])
    assert [row["variant"] for row in run.content["misfits"]] == list(QUICK)
    assert "Where all of 3 runs stay bounded at least 44 % do" in run.text
