"""The live loop is the batch's, whatever the clock does; what is done to it can be done again."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexsim import ParameterError, closed_loop, setting
from flexsim.loop.hardware import HARDWARE
from studies.play.arm import Arm
from studies.play.events import Event, Shove, Turn, push_events, read_events, write_events
from studies.play.live import Live, Stage
from studies.play.pace import FRAME, Pace
from studies.play.periods import AGAIN, BACK, HOLD, row_of
from studies.play.pushes import Point

PERIODS = 1500
COLUMNS = ("time", "state", "torque", "error", "applied", "measured", "tip", "v", "reference_tip")
TWICE = 1e-9  # relative: a filter's taps times two, and sums in another order
EVENTS: list[Event] = [
    Shove(100, (0.2, -0.3), 0.01, Point("segment3", (0.01, 0.0, 0.0))),
    Shove(180, (0.0, 0.0)),
    Turn(200, "payload", 0.05),
    Turn(230, "gain", 1.1),
    Turn(260, "order", 0.02),
    Turn(300, "delay", 2.0),
    Turn(330, "damping", 3.0),
    Turn(360, "friction", 0.5),
    Turn(390, "law", 3.0),
    Turn(420, "payload", 0.0),
]


def moved(live: Live, parts: Iterator[int], periods: int) -> Live:
    """Advance a loop in parts until it has so many periods."""
    while live.period < periods:
        live.advance(min(next(parts), periods - live.period))
    return live


def at_random(seed: int) -> Iterator[int]:
    rng = np.random.default_rng(seed)
    while True:
        yield int(rng.integers(0, 70))


def same(one: Live, other: Live) -> bool:
    """Return whether both arms of two loops were seen to do the same, to the bit."""
    return all(
        np.array_equal(getattr(a.motion(one.stage.reference), column), getattr(its, column))
        for a, b in zip(one.arms, other.arms, strict=True)
        for its in [b.motion(one.stage.reference)]
        for column in COLUMNS
    )


def test_untouched_it_is_the_batchs_loop(bench_stage: Stage) -> None:
    """With delay, limits, encoders and noise, on both plants, every column to the bit."""
    live = moved(Live(bench_stage), at_random(1), PERIODS)
    for arm, plant in zip(live.arms, (bench_stage.modes, bench_stage.mujoco), strict=True):
        filters = bench_stage.controller.filters(1e-3)
        (batch,) = closed_loop(plant, bench_stage.setting, bench_stage.reference, [filters])
        found = arm.motion(bench_stage.reference)
        assert found.plant == batch.plant and len(found.time) == PERIODS
        for column in COLUMNS:
            expected = getattr(batch, column)[:PERIODS]
            np.testing.assert_array_equal(getattr(found, column), expected, err_msg=column)


@pytest.mark.parametrize("law", ["opposing", "lugre"])
@pytest.mark.slow  # another compilation of the live loop
def test_worn_joints_are_the_batchs_too(bench_stage: Stage, law: str) -> None:
    """Bristles, motors behind gaps, amplifiers, warming up: memories that go from call to call."""
    effects = replace(HARDWARE["worn"].effects, warming=(0.2, 0.3), encoder="motor")
    built = replace(HARDWARE["worn"], lag=5e-5, effects=effects)
    stage = replace(bench_stage, setting=setting(law, built))
    live = moved(Live(stage), at_random(2), PERIODS // 3)
    for arm, plant in zip(live.arms, (stage.modes, stage.mujoco), strict=True):
        filters = stage.controller.filters(1e-3)
        (batch,) = closed_loop(plant, stage.setting, stage.reference, [filters])
        found = arm.motion(stage.reference)
        assert len(found.time) == PERIODS // 3 and found.diverged is None
        for column in COLUMNS:
            expected = getattr(batch, column)[: PERIODS // 3]
            np.testing.assert_array_equal(getattr(found, column), expected, err_msg=column)
    other = closed_loop(stage.modes, bench_stage.setting, stage.reference, [filters])[0]
    assert not np.array_equal(
        other.state[: PERIODS // 3], live.arms[0].motion(stage.reference).state
    )


class Clock:
    """A wall clock that stands, jumps, and goes on at random."""

    def __init__(self, seed: int) -> None:
        self.time, self.rng = 0.0, np.random.default_rng(seed)

    def __call__(self) -> float:
        self.time += float(self.rng.choice([0.0, 0.003, 0.016, 0.4]))
        return self.time


def test_pauses_and_a_late_clock_change_nothing(bench_stage: Stage) -> None:
    clock = Clock(3)
    pace, rng = Pace(1e-3, 0.5, clock), np.random.default_rng(5)

    def due() -> Iterator[int]:
        while True:
            if rng.random() < 0.3:
                pace.pause(not pace.paused)
            yield pace.due()

    paced = moved(Live(bench_stage), due(), 600)
    whole = moved(Live(bench_stage), iter([600]), 600)
    assert pace.late > 0
    assert same(paced, whole)
    np.testing.assert_array_equal(paced.tally.rms, whole.tally.rms)  # as a replay prints it


def test_a_late_frame_gives_time_up_instead_of_periods() -> None:
    now = [0.0]
    pace = Pace(1e-3, 1.0, lambda: now[0])
    now[0] = 0.0165
    assert pace.due() == 16
    now[0] = 0.5165
    assert pace.due() == round(FRAME / 1e-3)
    assert pace.late == pytest.approx(0.4)
    now[0] += 0.01
    assert pace.due() == pytest.approx(10, abs=1)
    pace.pause(True)
    now[0] += 5.0
    assert pace.due() == 0
    pace.pause(False)
    assert pace.due() == 0 and pace.late == pytest.approx(0.4)


def test_what_was_done_is_done_again_to_the_bit(bench_stage: Stage, tmp_path: Path) -> None:
    """By hand, then from the file that it was written to, in other parts."""
    live = Live(bench_stage)
    for event in EVENTS:
        live.advance(event.period - live.period)
        if isinstance(event, Turn):
            live.turn(event.knob, event.value)
        else:
            live.shove(event.force, event.torque, event.point)
    live.advance(600 - live.period)
    facts = {"controller": "circle"}
    write_events(tmp_path / "done.json", live.done, live.period, facts)
    script, periods = read_events(tmp_path / "done.json", facts)
    assert periods == 600 and script == EVENTS
    again = moved(Live(bench_stage, script), at_random(2), periods)
    assert same(live, again) and again.done == live.done
    untouched = moved(Live(bench_stage), at_random(2), periods)
    assert not same(live, untouched)


def test_a_restart_is_a_new_loop_at_the_knobs_as_they_stand(bench_stage: Stage) -> None:
    live = Live(bench_stage)
    live.advance(50)
    live.turn("payload", 0.03)
    live.turn("delay", 3.0)
    live.restart()
    assert live.done == [Turn(0, "delay", 3.0), Turn(0, "payload", 0.03)]
    live.advance(200)
    other = Live(bench_stage, live.done)
    other.advance(200)
    assert same(live, other)


def test_commands_wait_for_another_delay_as_they_would_have(bench_stage: Stage) -> None:
    """Ideal but for the delay, what reaches the motors is the command of so many samples ago."""
    stage = replace(bench_stage, setting=setting("none"))
    for first, second in ((0, 3), (4, 1), (2, 0)):
        live = Live(stage, [Turn(0, "delay", float(first)), Turn(100, "delay", float(second))])
        live.advance(200)
        for arm in live.arms:
            motion = arm.motion(stage.reference)
            ago = np.arange(100, 200) - second
            np.testing.assert_array_equal(motion.applied[100:], motion.torque[ago])


def gained(stage: Stage, at: int) -> tuple[Arm, Arm]:
    """Return an arm whose gains were doubled at a period, and one as it was, both run beyond it."""
    loops = Live(stage, [Turn(at, "gain", 2.0)]), Live(stage)
    for live in loops:
        live.advance(at + 1)
    return loops[0].arms[0], loops[1].arms[0]


def test_a_new_filter_remembers_the_errors_before_it(bench_stage: Stage) -> None:
    """Of twice the gains it gives twice the torque at once; one that begins anew would not."""
    changed, plain = gained(bench_stage, 300)
    ref = bench_stage.reference
    torque, usual = changed.motion(ref).torque[300], plain.motion(ref).torque[300]
    np.testing.assert_allclose(torque, 2 * usual, rtol=TWICE)
    forgetful, _ = gained(bench_stage, 300)
    forgetful.blocks.clear()
    forgetful.retuned(forgetful.controllers)
    rows = forgetful.run(301, 1)
    assert np.abs(rows.torque[0] / torque - 1).max() > 0.1


def test_an_arm_that_diverges_stays_and_the_other_goes_on(bench_stage: Stage) -> None:
    live = Live(bench_stage)
    live.advance(100)
    live.arms[0].became(live.arms[0].body.prepared(0.0, 1.0))
    live.arms[0]._memory.state[1] += 4.0  # beyond half a turn off
    before = live.arms[0].motion(bench_stage.reference).state[-1]
    live.advance(100)
    first, second = live.arms
    assert (first.diverged, second.diverged) == (100, None)
    np.testing.assert_array_equal(first.state, before)
    assert len(first.motion(bench_stage.reference).time) == 100
    assert len(second.motion(bench_stage.reference).time) == 200
    assert live.tally.count.tolist() == [100, 200, 100]
    live.turn("gain", 1.2)
    live.shove((0.1, 0.0))
    live.advance(5)
    assert first.diverged == 100


def test_a_reference_is_held_or_comes_again() -> None:
    assert [row_of(k, 4, HOLD) for k in range(8)] == [0, 1, 2, 3, 3, 3, 3, 3]
    assert [row_of(k, 4, AGAIN) for k in range(8)] == [0, 1, 2, 3, 1, 2, 0, 1]
    assert [row_of(k, 4, BACK) for k in range(8)] == [0, 1, 2, 3, 2, 1, 0, 1]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"format": "other"}, "format"),
        ({"events": [{"period": -1, "knob": "gain", "value": 1}]}, "damaged"),
        ({"events": [{"period": 1, "push": [0.0, 1e400]}]}, "damaged"),
        ({"events": [{"period": 1, "push": [0.0]}]}, "damaged"),
        (
            {"events": [{"period": 5, "push": [0, 1]}, {"period": 1, "push": [0, 0]}]},
            "not in order",
        ),
        ({"loop": {"controller": "line"}}, "controller is line"),
        ({"periods": True}, "damaged"),
        ({"events": [3]}, "event 1 is damaged: it is 3, no object"),
        ({"events": [{"period": 1}]}, "event 1 is damaged: it has no push"),
        ({"events": 5}, "is damaged: its events are no list"),
    ],
)
def test_files_of_events_are_read_with_care(
    change: dict[str, object], said: str, tmp_path: Path
) -> None:
    path, facts = tmp_path / "events.json", {"controller": "circle"}
    write_events(path, [Turn(0, "gain", 1.1)], 10, facts)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ParameterError, match=said):
        read_events(path, facts)


def test_scripts_name_knobs_and_bodies_that_there_are(bench_stage: Stage) -> None:
    for script, said in (
        ([Turn(0, "gian", 1.0)], "gian"),
        ([Turn(0, "gain", -1.0)], "from 0 to 5"),
        ([Turn(0, "delay", 1.5)], "whole number"),
        ([Shove(0, (1.0, 0.0), 0.0, Point("nose", (0.0, 0.0, 0.0)))], "nose"),
        ([Shove(0, (1.0, 0.0), 0.0, Point("world", (0.0, 0.0, 0.0)))], "does not move"),
    ):
        with pytest.raises(ParameterError, match=said):
            Live(bench_stage, script)


def test_a_push_in_numbers_begins_and_ends() -> None:
    assert push_events((0.5, 1.0, -2.0, 0.2), 1e-3) == [
        Shove(500, (1.0, -2.0)),
        Shove(700, (0.0, 0.0)),
    ]
    for wrong in ((1.0,), (-1.0, 0.0, 1.0), (0.0, np.nan, 0.0), (0.0, 1.0, 1.0, 0.0)):
        with pytest.raises(ParameterError, match="--push"):
            push_events(wrong, 1e-3)
