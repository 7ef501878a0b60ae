"""Margins of the exact loop: a crossing is one, below it nothing grows, and simulations agree."""

import math
from dataclasses import replace

import numpy as np
import pytest
from trial_controllers import TRIAL

from controllers import TUNED_IDEAL, textbook_pid
from flexsim import ParameterError, Parameters
from flexsim.arm.parameters import paper
from flexsim.linear.delay_margin import LONGEST, PARTS, delay_margin, late, late_growth
from flexsim.linear.exact_loop import exact_growth, exact_loops
from flexsim.linear.linearise import split_hold, zero_order_hold
from flexsim.linear.loop_poles import LinearLoop, LoopOptions, linear_loop, sampled_plant
from flexsim.linear.margins import common_gains
from flexsim.linear.reserves import reserves
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import Hardware
from flexsim.plants.modes_plant import AssumedModesPlant
from studies.stability.simulated import simulated_growth

PERIOD = 1e-3
ON_CIRCLE = 1e-9
PD = (textbook_pid(50.0, 0.0, 8.0, PERIOD), textbook_pid(1.0, 0.0, 0.1, PERIOD))  # bears 3.9 ms
LOOPS = {
    "line": stack([TUNED_IDEAL["line"]], PERIOD),
    "circle": stack([TUNED_IDEAL["circle"]], PERIOD),
    "PD": stack([PD], PERIOD),
}


def times(controllers: Controllers, factors: tuple[float, float]) -> Controllers:
    b = controllers.b.copy()
    b *= np.array(factors)[None, :, None, None, None]
    return controllers._replace(b=b)


@pytest.mark.parametrize("lag", [0.0, 3e-4])
def test_a_split_hold_is_two_holds(lag: float) -> None:
    plant = AssumedModesPlant(Parameters()).linearised(1.2)
    whole = zero_order_hold(plant, PERIOD, lag)
    A, old, new = split_hold(plant, PERIOD, 0.3 * PERIOD, lag)
    assert pytest.approx(whole[0], rel=1e-9, abs=1e-12) == A
    assert old + new == pytest.approx(whole[1], rel=1e-9, abs=1e-12)  # the same command, unsplit
    assert new == pytest.approx(zero_order_hold(plant, 0.7 * PERIOD, lag)[1], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("extra", [0, 1, 3])
@pytest.mark.parametrize("built", [Hardware(), Hardware(delay=2, lag=2e-4)])
def test_whole_samples_are_the_hardwares(extra: int, built: Hardware) -> None:
    (plant,) = exact_loops(Parameters(), (1.5,), hardware=built)
    found = late_growth([plant], LOOPS["PD"], extra * PERIOD)
    other = exact_loops(Parameters(), (1.5,), (extra,), hardware=built)
    assert found == pytest.approx(exact_growth(other, LOOPS["PD"]), abs=1e-8)


def test_growth_has_no_jump_at_whole_samples() -> None:
    loops = exact_loops(Parameters(), (1.5,))
    for whole in (0.0, PERIOD, 4 * PERIOD):
        at = late_growth(loops, LOOPS["PD"], whole)[0]
        after = late_growth(loops, LOOPS["PD"], whole + 1e-7 * PERIOD)[0]
        assert after == pytest.approx(at, abs=1e-4)
    before = late_growth(loops, LOOPS["PD"], (1 - 1e-7) * PERIOD)[0]
    assert before == pytest.approx(late_growth(loops, LOOPS["PD"], PERIOD)[0], abs=1e-4)


def test_a_part_of_a_period_is_what_finer_sampling_makes_of_it() -> None:
    """The same loop over quarter periods: commands change at every fourth, a whole one late."""
    (plant,) = exact_loops(Parameters(), (1.5,))
    quarter = sampled_plant(AssumedModesPlant(Parameters(), 12, 1e-7), 1.5, LoopOptions(PERIOD / 4))
    fast, into, n = quarter.A, quarter.B, len(quarter.A)
    rng = np.random.default_rng(3)
    state, commands = rng.standard_normal(n) * 1e-3, rng.standard_normal((6, 2))
    found = late(plant, PERIOD / 4)
    total, slow = np.concatenate([state, [0.0, 0.0]]), state
    for k, command in enumerate(commands):
        total = found.A @ total + found.B @ command
        for part in range(4):
            held = command if part else (commands[k - 1] if k else np.zeros(2))
            slow = fast @ slow + into @ held
        assert total[:n] == pytest.approx(slow, rel=1e-8, abs=1e-8 * np.abs(slow).max())


@pytest.mark.parametrize("name", LOOPS)
def test_delay_margin_is_a_first_crossing(name: str) -> None:
    loops = exact_loops(Parameters())
    found = delay_margin(loops, LOOPS[name])
    assert 0 < found < LONGEST
    crossing = late_growth(loops, LOOPS[name], found)[0]
    assert crossing == pytest.approx(0.0, abs=1e-4)
    assert late_growth(loops, LOOPS[name], found + 1e-6)[0] > 0
    earlier = np.linspace(0.0, found, 3 * PARTS + 1)[:-1]
    assert max(late_growth(loops, LOOPS[name], x)[0] for x in earlier) <= 0


def test_delay_margin_is_the_simulations_at_whole_samples() -> None:
    """A loop that bears 3.9 samples: it decays with 3, grows with 4, as steps of 0.125 ms do."""
    plant = AssumedModesPlant(Parameters(), 3, PERIOD / 8)
    exact = sampled_plant(plant, 1.5, LoopOptions())
    margin = delay_margin([exact], LOOPS["PD"])
    for delay in (2, 3, 4, 5):
        options = LoopOptions(PERIOD, hold="stepped", hardware=Hardware(delay=delay))
        loop = linear_loop(plant, 1.5, LOOPS["PD"], options)
        rate = simulated_growth(plant, loop, options)
        assert rate is not None
        assert (rate > 0) == (delay * PERIOD > margin)
    assert 3 * PERIOD < margin < 4 * PERIOD


def test_ends_of_the_delay_margin() -> None:
    growing = stack([TUNED_IDEAL["line"]], PERIOD)
    assert delay_margin(exact_loops(paper()), growing) == 0.0
    assert delay_margin(exact_loops(Parameters()), LOOPS["PD"], 2e-3) == math.inf
    with pytest.raises(ParameterError, match="2 controllers"):
        delay_margin(exact_loops(Parameters()), stack([PD, PD], PERIOD))
    stepped = sampled_plant(AssumedModesPlant(), 1.5, LoopOptions(hold="stepped"))
    with pytest.raises(ParameterError, match="exact hold"):
        delay_margin([stepped], LOOPS["PD"])
    with pytest.raises(ParameterError, match="extra delay"):
        late(exact_loops(Parameters(), (1.5,))[0], -1e-3)


@pytest.mark.parametrize("name", [*LOOPS, "trial"])
def test_common_gains_put_a_pole_on_the_circle(name: str) -> None:
    (plant,) = exact_loops(paper() if name == "trial" else Parameters(), (1.5,))
    controllers = LOOPS.get(name, stack([TRIAL["circle"]], PERIOD))
    loop = LinearLoop(plant, controllers)
    low, high = common_gains(loop)
    for factor in (low, high):
        if 0 < factor < math.inf:
            moved = LinearLoop(plant, times(controllers, (factor, factor)))
            assert np.abs(np.abs(moved.poles) - 1).min() < ON_CIRCLE
    stable = loop.growth_rate < 0
    for factor in np.geomspace(max(low, 1e-2), min(high, 1e2), 40)[1:-1]:  # no crossing between
        moved = LinearLoop(plant, times(controllers, (factor, factor)))
        assert (moved.growth_rate < 0) == stable


def test_reserves_are_the_least() -> None:
    loops = exact_loops(Parameters())
    found = reserves(loops, LOOPS["line"])
    assert found.growth == pytest.approx(exact_growth(loops, LOOPS["line"])[0], abs=1e-6)
    assert not found.grows
    assert found.gain_margin == min(high for _, high in found.gains)
    assert found.delay_margin == delay_margin(loops, LOOPS["line"])
    single = [reserves([each], LOOPS["line"]) for each in loops]
    assert found.gain_margin == pytest.approx(min(one.gain_margin for one in single))
    ways = ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0))
    for way, (_, high) in zip(ways, found.gains, strict=True):
        for factor, holds in ((0.999, True), (1.001, False)):
            factors = tuple((factor * high) ** on for on in way)
            growth = exact_growth(loops, times(LOOPS["line"], factors))[0]
            assert (growth <= 0) == holds


def test_nothing_is_to_spare_where_a_mode_grows() -> None:
    found = reserves(exact_loops(paper()), LOOPS["line"])
    assert found.grows and found.delay_margin == 0.0
    assert found.gain_margin == found.gain_margin_low == 1.0
    assert found.fastest_hz == pytest.approx(191.6, abs=0.3)
    with pytest.raises(ParameterError, match="0 plants"):
        reserves([], LOOPS["line"])


def test_hardware_takes_its_share_of_the_delay() -> None:
    plain = exact_loops(Parameters(), (1.5,))
    built = exact_loops(Parameters(), (1.5,), hardware=Hardware(delay=2))
    assert delay_margin(built, LOOPS["PD"]) == pytest.approx(
        delay_margin(plain, LOOPS["PD"]) - 2 * PERIOD, abs=1e-9
    )
    assert replace(plain[0].options, hardware=Hardware(delay=2)) == built[0].options
