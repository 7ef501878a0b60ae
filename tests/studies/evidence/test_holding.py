"""Holding: bounded, quiet and without growth, each of which alone can fail."""

import math
from dataclasses import replace

import numpy as np
import pytest

from controllers import TUNED_IDEAL, textbook_pid
from flexsim import Parameters
from flexsim.arm.parameters import paper
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE, Hardware
from flexsim.loop.runs import closed_loop
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import reference, trajectory
from flexsim.robot import Robot
from studies.core.evidence.holding import (
    HOLD,
    MOST,
    WINDOW,
    Holding,
    _counts,
    _decided,
    holding,
    holdings,
)
from studies.core.evidence.holding_table import HoldingRow, holding_table, said

PERIOD = 1e-3
LINE = trajectory("line")
PD = (textbook_pid(50.0, 0.0, 8.0, PERIOD), textbook_pid(1.0, 0.0, 0.1, PERIOD))


def of(
    controller: object,
    robot: Robot,
    name: str = "none",
    built: Hardware = HARDWARE["ideal"],
    hold: float = HOLD,
) -> Holding:
    chosen = setting(name, built)
    return holding(robot.modes_plant(chosen), chosen, LINE, controller, PERIOD, robot, hold)


def test_a_damped_loop_holds_and_an_undamped_one_does_not() -> None:
    """Three modes at 1 ms never show the growth of mode 5; the exact loop does."""
    damped, undamped = (of(TUNED_IDEAL["line"], Robot(each)) for each in (Parameters(), paper()))
    assert damped.holds and damped.why_not == ""
    assert damped.v_ratio is not None and damped.v_ratio < 1
    assert damped.growth < 0 < damped.growth_undamped
    assert undamped.bounded and undamped.quiet and not undamped.holds
    assert undamped.growth == undamped.growth_undamped
    assert undamped.why_not == "the exact loop grows at 1.5 1/s"
    assert undamped.delay_margin == 0.0 and undamped.gain_margin == 1.0


def test_a_loop_that_diverges_does_not_hold() -> None:
    found = of(TUNED_IDEAL["line"], Robot(), "simulink", HARDWARE["bench"])
    assert not found.bounded and not found.holds and found.v_ratio is None
    assert found.diverged_at is not None and 0 < found.diverged_at < 24
    assert "diverged at" in found.why_not and "grows at 49" in found.why_not


def test_v_is_compared_over_the_last_two_windows() -> None:
    plant, chosen = Robot().modes_plant(), setting("none")
    path = reference(replace(LINE, hold=HOLD), plant.parameters, PERIOD)
    (motion,) = closed_loop(plant, chosen, path, [TUNED_IDEAL["line"]])
    last, before = (
        np.sqrt(np.mean(motion.v[start:stop] ** 2))
        for start, stop in ((-round(WINDOW / PERIOD), None), (-round(2 * WINDOW / PERIOD), -5000))
    )
    found = of(TUNED_IDEAL["line"], Robot())
    assert found.v_ratio == pytest.approx(last / before, rel=1e-3)
    slowest = math.exp(found.growth * WINDOW)  # the mirrored tip's own swing is what is left
    assert found.v_ratio == pytest.approx(slowest, rel=0.01)


@pytest.mark.slow
def test_growth_shows_in_v_where_the_plant_has_the_mode() -> None:
    """C2 beyond its gain margin by 2 %: it grows at 0.76 1/s and is lost at 24 s."""
    pair = TUNED_IDEAL["line"].filters(PERIOD)
    robot = Robot()
    base = of(TUNED_IDEAL["line"], robot)
    louder = ((pair[0][0], pair[0][1]), (1.02 * base.gain_margin * pair[1][0], pair[1][1]))
    found = of(louder, robot)
    assert found.grows and not found.holds
    chosen = setting("none")
    plant = robot.modes_plant(chosen, modes=5, step=PERIOD / 4)
    lost = holding(plant, chosen, LINE, louder, PERIOD, robot)
    assert lost.diverged_at is not None and 22 < lost.diverged_at < 24
    seen = holding(plant, chosen, LINE, louder, PERIOD, robot, hold=17.5)
    assert seen.bounded and not seen.quiet
    assert seen.v_ratio is not None and seen.v_ratio > MOST
    assert seen.growth == lost.growth == found.growth > 0
    assert f"v grew to {seen.v_ratio:.2g} times" in seen.why_not


@pytest.mark.slow
def test_the_settings_slope_counts() -> None:
    """At the friction's slope of 0.2585 joint 1 has a quarter of its gain, joint 2 1.0231 times."""
    found = of(PD, Robot(), "simulink")
    plain = of(PD, Robot())
    assert found.growth == plain.growth == plain.growth_friction != found.growth_friction
    margin = of(TUNED_IDEAL["line"], Robot()).gain_margin
    pair = TUNED_IDEAL["line"].filters(PERIOD)
    near = ((pair[0][0], pair[0][1]), (margin / 1.01 * pair[1][0], pair[1][1]))
    close = of(near, Robot(), "simulink", hold=2.0)
    assert close.growth <= 0 < close.growth_friction and not close.holds


def test_v_enters_run_and_exact_loop_as_it_is_told() -> None:
    robot, chosen = Robot(), setting("none")
    of_gain = {
        v_gain: holdings([robot.modes_plant(chosen)], chosen, LINE, PD, PERIOD, robot, 2.0, v_gain)[
            0
        ]
        for v_gain in (-1.0, 0.0, 1.0)
    }
    assert of_gain[-1.0] == of(PD, robot, hold=2.0)
    assert of_gain[0.0].growth < of_gain[-1.0].growth < 0  # no slow zero of the mirrored tip
    assert of_gain[1.0].growth > 1 and of_gain[1.0].delay_margin == 0.0


def test_hardware_counts() -> None:
    late = of(PD, Robot(), built=Hardware(delay=2))
    plain = of(PD, Robot())
    assert late.delay_margin == pytest.approx(plain.delay_margin - 2 * PERIOD, abs=1e-6)
    noisy = of(PD, Robot(), built=Hardware(noise_v=1e-4))
    assert noisy.v_ratio == pytest.approx(1.0, abs=0.1)
    assert noisy.holds and noisy.growth == plain.growth


def test_where_nothing_moves_rounding_does_not_decide() -> None:
    found = of(PD, Robot())
    assert found.v_ratio is None and found.holds  # it decays at 2 1/s: 1e-18 m after 20 s


def test_the_margin_is_the_linear_loops() -> None:
    found = of(PD, Robot())
    assert len(stack([PD], PERIOD).b) == 1
    assert 3e-3 < found.delay_margin < 5e-3
    assert found.gain_margin_low < 1 < found.gain_margin


@pytest.mark.slow
def test_several_plants_share_their_exact_loop() -> None:
    robot, chosen = Robot(), setting("simulink")
    plants = [robot.modes_plant(chosen), robot.plant("closed-chain", chosen)]
    pair = holdings(plants, chosen, LINE, TUNED_IDEAL["line"], PERIOD, robot)
    for plant, found in zip(plants, pair, strict=True):
        assert found == holding(plant, chosen, LINE, TUNED_IDEAL["line"], PERIOD, robot)
    assert pair[0].v_ratio != pair[1].v_ratio


def test_chance_is_told_from_growth_by_all_repeats() -> None:
    """Noise alone, on a loop whose v would decay: a run's ratio is chance, that of all 1."""
    chosen = setting("none", Hardware(noise_v=1e-4))
    plant = Robot().modes_plant(chosen)
    alone = holding(plant, chosen, LINE, PD, PERIOD, Robot())
    assert (alone.ratio_runs, alone.ratio_pooled, alone.ratio_low) == (1, alone.v_ratio, None)
    found = holding(plant, chosen, LINE, PD, PERIOD, Robot(), HOLD, [PD] * 19)
    assert found.v_ratio == alone.v_ratio and found.ratio_runs == 20
    assert found.ratio_low is not None and found.ratio_high is not None
    assert found.ratio_low < found.ratio_pooled < found.ratio_high
    assert found.ratio_pooled == pytest.approx(1.0, abs=0.05) and found.quiet
    unlucky = replace(found, v_ratio=1.3)
    assert unlucky.quiet and not replace(unlucky, ratio_pooled=1.11).quiet


def test_more_repeats_are_run_until_the_ratio_is_decided() -> None:
    assert _counts(1) == [1] and _counts(160) == [40, 80, 160] and _counts(100) == [40, 80, 100]
    sides = {(0.9, 1.1): True, (1.11, 1.4): True, (1.0, 1.2): False, (None, None): False}
    for (low, high), decided in sides.items():
        assert _decided({"ratio_low": low, "ratio_high": high}) is decided
    chosen = setting("none")
    plant, pair = Robot().modes_plant(chosen), TUNED_IDEAL["line"].filters(PERIOD)
    clear = holding(plant, chosen, LINE, pair, PERIOD, Robot(), 4.0, [pair] * 59)
    assert clear.ratio_runs == 40 and clear.ratio_high is not None and clear.ratio_high <= MOST


def test_one_repeat_that_diverges_is_enough() -> None:
    chosen = setting("none")
    plant, pair = Robot().modes_plant(chosen), TUNED_IDEAL["line"].filters(PERIOD)
    wild = (pair[0], (3.0 * pair[1][0], pair[1][1]))
    found = holding(plant, chosen, LINE, pair, PERIOD, Robot(), 2.0, [pair] * 6 + [wild])
    assert not found.bounded and found.ratio_pooled is None
    assert found.v_ratio is not None and found.ratio_share == pytest.approx(7 / 8)
    assert not found.holds and "diverged" in found.why_not


def test_the_table_shows_both_plants_and_says_why_not() -> None:
    held = of(TUNED_IDEAL["line"], Robot())
    lost = replace(held, bounded=False, diverged_at=2.89, v_ratio=None, ratio_pooled=None)
    grown = replace(held, growth=1.5)
    names = ("assumed-modes", "closed-chain")
    rows = [
        HoldingRow.of("line", devised, plant, found)
        for devised, pair in (("line", (held, lost)), ("two-loop", (grown, held)))
        for plant, found in zip(names, pair, strict=True)
    ]
    table = holding_table(rows)
    first, second = (table.cells(line) for line in table.lines())
    ratios = [f"{held.v_ratio:.2f}|-", f"{held.ratio_pooled:.1f}|-"]
    assert first[:5] == ["line", "yes|to 2.9 s", *ratios, f"{held.growth:+.2g}"]
    assert second[:2] == ["line by two-loop", "grows|yes"]
    shown = table.as_json()[0]
    assert shown["holds"] is True and shown["delay_margin"] == held.delay_margin
    assert said(rows) == "2 of 4 loops hold. closed-chain, line: diverged at 2.9 s."
    assert said(rows[:1]) == "1 of 1 loops hold."
    assert all(len(line) < 80 for line in table.note.splitlines())
