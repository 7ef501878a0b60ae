"""What knobs make of a controller and of friction; poles and margins in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controllers import TUNED
from flexsim import ModelError, ParameterError, Parameters, setting
from flexsim.linear.exact_loop import exact_loops
from flexsim.linear.reserves import reserves
from flexsim.loop.control.stacking import stack
from flexsim.loop.friction import LAWS
from flexsim.loop.hardware import Hardware
from studies.play.knobs import KNOBS, PIVOT, Knobs, friction_at, retuned
from studies.play.live import Live, Stage
from studies.play.reserves import FACTORS, Answer, Question, Watcher, live_reserves, with_load
from studies.tuning.found import FoundController
from studies.tuning.tuning import Tuning

CIRCLE = TUNED["circle"]
FEWER = 2e-2  # relative: margins with five modes for twelve, and the parts of a grid's step


def question(theta2: float = 1.5, delay: int = 0) -> Question:
    return Question(
        Parameters(),
        theta2,
        stack([CIRCLE], 1e-3),
        setting("simulink").friction,
        Hardware(delay=delay),
        -1.0,
        1e-3,
    )


@pytest.mark.parametrize("delay", [0, 1])
def test_they_are_the_exact_loops(delay: int) -> None:
    found = live_reserves(question(1.5, delay))
    slope = (setting("simulink").friction.mu, (0.0, 0.0))
    loops = exact_loops(Parameters(), (1.5,), slopes=(slope,), hardware=Hardware(delay=delay))
    exact = reserves(loops, stack([CIRCLE], 1e-3))
    assert found.growth == pytest.approx(exact.growth, abs=2e-6)
    assert found.hz == pytest.approx(exact.fastest_hz, rel=1e-4)
    _, high = exact.gains[2]
    assert found.gain_high == pytest.approx(high, rel=FEWER)
    assert found.delay == pytest.approx(exact.delay_margin, abs=0.25e-3 / 16 * 1.1)


def test_a_loop_that_grows_has_nothing_to_spare() -> None:
    asked = question()
    wild = asked.controllers._replace(b=asked.controllers.b * FACTORS[-1])
    found = live_reserves(replace(asked, controllers=wild))
    assert found.growth > 0 and (found.gain_high, found.delay) == (1.0, 0.0)


def test_a_robot_without_a_linear_loop_says_why() -> None:
    class Stuck:
        def linearised(self, theta2: float) -> None:
            raise ModelError("joint 'hinge1' has dry friction")

    found = live_reserves(replace(question(), robot=Stuck()))  # type: ignore[arg-type]
    assert "dry friction" in found.why_not and np.isnan(found.growth)


def test_the_last_question_is_answered() -> None:
    watcher = Watcher()
    for theta2 in (0.8, 1.0, 1.2, 1.4):
        watcher.ask(question(theta2))
    answer = watcher.wait()
    assert isinstance(answer, Answer) and answer.theta2 == 1.4
    assert 1 <= len(watcher.took) <= 4 and all(each > 0 for each in watcher.took)
    watcher.end()
    assert not watcher._thread.is_alive()


def test_knobs_ask_of_the_loop_that_they_make(bench_stage: Stage) -> None:
    live = Live(bench_stage)
    usual = live_reserves(live.question())
    for name, value in (("gain", 1.1), ("order", 0.03), ("delay", 0.0), ("payload", 0.1)):
        before = live_reserves(live.question())
        live.turn(name, value)
        assert live_reserves(live.question()) != before, name
    assert usual.growth < 0
    loaded = with_load(Parameters(payload=0.01), 0.05, 2.0)
    assert (loaded.payload, loaded.zeta) == (pytest.approx(0.06), 2e-3)


def test_usual_knobs_change_nothing() -> None:
    friction = setting("simulink").friction
    knobs = Knobs(law=float(LAWS.index("simulink")))
    assert retuned(CIRCLE, knobs) is CIRCLE and friction_at(friction, knobs) is friction


def test_an_order_moves_at_constant_size_where_the_loop_crosses() -> None:
    moved = retuned(CIRCLE, Knobs(order=0.1))
    for own, other in ((CIRCLE.joint1, moved.joint1), (CIRCLE.joint2, moved.joint2)):  # type: ignore[union-attr]
        assert other.nu1 == own.nu1 + 0.1 and other.k3 == own.k3
        assert other.k1 * PIVOT**other.nu1 == pytest.approx(own.k1 * PIVOT**own.nu1)


def test_a_tuned_controllers_order_moves_as_one_of_ours() -> None:
    """Its gains are for time in milliseconds."""
    own = [CIRCLE.joint1, CIRCLE.joint2]
    drawn = [x for g in own for x in (g.k1 * 1e3**g.nu1, g.nu1, g.k2 * 1e3**g.nu2, g.nu2, g.k3)]  # type: ignore[operator]
    found = FoundController("run", Tuning(), np.array(drawn))
    knobs = Knobs(order=0.1, gain=1.3, proportional=0.8)
    ours, theirs = (retuned(each, knobs).filters(1e-3) for each in (CIRCLE, found))
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(one[0], other[0], rtol=1e-9)
    pid = FoundController("run", Tuning(controller="pid"), np.array(drawn))
    with pytest.raises(ParameterError, match="whole numbers"):
        retuned(pid, knobs)


def test_friction_by_a_factor_leaves_the_torques_gain() -> None:
    own = setting("simulink").friction
    half = friction_at(own, Knobs(law=1.0, friction=0.5))
    assert half.mu == own.mu and half.tau_0[0] == own.tau_0[0] / 2
    assert half.dead_zone[0] == (own.dead_zone[0][0] / 2, own.dead_zone[0][1] / 2)
    assert friction_at(own, Knobs(law=3.0, friction=0.5)).mu[1] == own.mu[1] / 2


def test_keys_go_through_every_knob_and_stop_at_its_limits() -> None:
    for name, knob in KNOBS.items():
        value = getattr(Knobs(), name)
        assert knob.stepped(value, up=True) != value
        for up, limit in ((True, knob.high), (False, knob.low)):
            for _ in range(200):
                value = knob.stepped(value, up)
                Knobs().turned(name, value)
            assert value == pytest.approx(limit), name


def test_what_its_step_cannot_take_is_refused_and_nothing_changes(bench_stage: Stage) -> None:
    stage = replace(bench_stage, modes=replace(bench_stage.modes, modes=8, step=2.5e-4))
    live = Live(stage)
    with pytest.raises(ParameterError, match="step"):
        live.turn("damping", 20.0)
    assert live.knobs == stage.knobs and live.done == []
