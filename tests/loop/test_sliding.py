"""Stribeck and LuGre: their curves by hand, presliding in closed form, passivity, break-away."""

import math
from dataclasses import replace

import numpy as np
import pytest

from flexsim import ParameterError, Plant, drive, setting
from flexsim.linear.loop_poles import small_signal
from flexsim.loop.friction import Friction, joint_torques
from flexsim.loop.hardware import IDEAL, JointEffects, joint_memory, joint_step
from flexsim.loop.hardware.memory import BRISTLE
from flexsim.loop.settings import SETTINGS, Setting
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.jit import jit

FREE = ((0.0, 0.0), (0.0, 0.0))  # no dead zone
LUGRE = Friction("lugre", dead_zone=FREE, tau_0=(4.0, 1.0), mu=(0.3, 0.2))
QUIET = replace(LUGRE, sigma_1=(0.0, 0.0), mu=(0.0, 0.0))  # bristles' springs alone
SUMS = 1e-12  # relative: the same sums in another order
H = 1e-3  # [s]


def held(f: Friction, rates: np.ndarray, step: float = H) -> tuple[np.ndarray, np.ndarray]:
    """Return joint 1's friction over every step [N m] and bristles' bend before it [rad]."""
    return along(f.numbers(), *numbers(step), step, np.asarray(rates, dtype=float))


def numbers(step: float) -> tuple:
    return IDEAL.numbers(step, 1), JointEffects().numbers(step)


@jit
def along(f, h, e, step, rates):  # type: ignore[no-untyped-def]
    state, torque, bend = np.zeros(4), np.zeros(len(rates)), np.zeros(len(rates))
    memory = joint_memory(state)
    for k in range(len(rates)):
        state[2] = rates[k]
        tau, _ = joint_step(f, h, e, memory, 0.0, 0.0, 0.0, state)
        torque[k], bend[k] = -tau, memory[0, BRISTLE]
        state[0] += step * rates[k]
    return torque, bend


@jit
def of_a_mass(f, h, e, step, J, tau):  # type: ignore[no-untyped-def]
    """Return angles and rates (K+1, 2) of an inertia under torques (K,) held over steps."""
    state, seen = np.zeros(4), np.zeros((len(tau) + 1, 2))
    memory = joint_memory(state)
    for k in range(len(tau)):
        got, _ = joint_step(f, h, e, memory, k * step, tau[k], 0.0, state)
        state[0] += step * state[2] + step * step / 2 * got / J
        state[2] += step * got / J
        seen[k + 1, 0], seen[k + 1, 1] = state[0], state[2]
    return seen


def curve(f: Friction, w: float) -> float:
    """Return joint 1's Stribeck curve at a rate above 0 [N m]."""
    return f.tau_0[0] * (1 + (f.stiction[0] - 1) * math.exp(-((w / f.stribeck) ** 2)))


@pytest.mark.parametrize("w", [0.01, -0.1, 0.7])
def test_stribeck_by_hand(w: float) -> None:
    f = Friction("stribeck", dead_zone=FREE)
    first, second = joint_torques(f.numbers(), 10.0, 10.0, w, w)
    peak = 4.56 + (1.5 * 4.56 - 4.56) * math.exp(-((w / 0.1) ** 2))
    assert first == pytest.approx(10 - peak * math.tanh(w / 0.02) - 0.2585 * w, rel=SUMS)
    assert second == pytest.approx(10 - 1.0231 * w, rel=SUMS)


def test_without_stiction_stribeck_is_opposing_to_the_bit() -> None:
    plain = Friction("stribeck", stiction=(1.0, 1.0)).numbers()
    for w in np.linspace(-1, 1, 41):
        expected = joint_torques(Friction("opposing").numbers(), 5.0, -2.0, w, -w)
        assert joint_torques(plain, 5.0, -2.0, w, -w) == expected
        with_it = joint_torques(Friction("stribeck").numbers(), 5.0, -2.0, w, -w)
        assert (with_it == expected) == (w == 0 or abs(w) > 0.62)  # exp(-37) is below a bit


@pytest.mark.parametrize("w", [0.01, 0.05, -0.3, 2.0])
def test_steady_sliding_is_on_stribecks_curve(w: float) -> None:
    """Bristles reach it within a step where they are stiff, in seconds where slow."""
    torque, bend = held(LUGRE, np.full(20_000, w))
    assert torque[-1] == pytest.approx(math.copysign(curve(LUGRE, w), w) + 0.3 * w, rel=1e-9)
    assert bend[-1] * 2000.0 == pytest.approx(math.copysign(curve(LUGRE, w), w), rel=1e-9)
    assert joint_torques(LUGRE.numbers(), 0.0, 0.0, w, w)[0] == pytest.approx(-torque[-1])


def test_presliding_is_an_exponential_of_the_angle() -> None:
    """F = g (1 - exp(-sigma_0 x/g)) from rest at a slow rate: its slope at first is sigma_0."""
    w, g = 1e-4, curve(QUIET, 1e-4)
    _, bend = held(QUIET, np.full(30_000, w))
    x = w * H * np.arange(30_000)
    np.testing.assert_allclose(bend, g / 2000.0 * -np.expm1(-2000.0 * x / g), rtol=1e-9)
    first, _ = held(QUIET, np.full(2, w))
    assert first[0] == pytest.approx(2000.0 * w * H / 2, rel=1e-4)  # the mean over the step


def test_a_hysteresis_loop_closes_and_dissipates() -> None:
    phase = np.linspace(0, 2 * np.pi, 4001)
    rates = np.tile(np.diff(6e-3 * np.sin(phase)) / H, 4)
    torque, bend = held(QUIET, rates)
    work = (torque * rates * H).reshape(4, -1).sum(axis=1)
    assert work[2] == pytest.approx(work[3], rel=1e-5) and work[3] > 0.5 * 4 * 6e-3 * 4.0
    assert bend[-1] == pytest.approx(bend[-4001], rel=1e-5)
    slight = np.tile(np.diff(1e-6 * np.sin(phase)) / H, 2)  # of a spring there is hardly a loop
    torque, _ = held(QUIET, slight)
    stored = 2000.0 * 1e-6**2
    assert abs((torque * slight * H)[4000:].sum()) < 1e-3 * stored


def test_no_energy_is_made_however_stiff_the_bristles() -> None:
    """Work is at least the change of sigma_0 z^2/2, step by step; explicit Euler's is not."""
    rng = np.random.default_rng(4)
    rates = np.concatenate([s * rng.standard_normal(2000) for s in (1e-3, 0.05, 1.0, 30.0)])
    torque, bend = held(LUGRE, rates)
    stored = 2000.0 / 2 * np.diff(bend**2)
    assert ((torque * rates * H)[:-1] - stored >= -1e-12).all()
    assert np.abs(bend).max() * 2000.0 <= 1.5 * 4.0 * (1 + 1e-12)
    stiff = 2000.0 * np.abs(rates) * H / 4.0
    assert stiff.max() > 10  # where z + H z' leaves every bound


def test_friction_lags_behind_the_rate() -> None:
    """Sliding on, it is larger while the rate rises (Canudas de Wit 1995, Fig. 3)."""
    phase = 2 * np.pi * 20 * H * np.arange(1000)
    rates = 0.1 + 0.08 * np.sin(phase)
    torque, _ = held(QUIET, rates)
    last, rising = slice(900, 1000), np.cos(phase) > 0
    at = np.interp
    order = np.argsort(rates[last][rising[last]])
    up = at(0.1, rates[last][rising[last]][order], torque[last][rising[last]][order])
    order = np.argsort(rates[last][~rising[last]])
    down = at(0.1, rates[last][~rising[last]][order], torque[last][~rising[last]][order])
    assert up > down + 0.05


def test_a_joint_breaks_away_at_its_stiction() -> None:
    ramp = np.linspace(0.0, 8.0, 8000)
    seen = of_a_mass(LUGRE.numbers(), *numbers(H), H, 0.4, ramp)
    moving = np.argmax(seen[1:, 0] > 0.02)
    assert ramp[moving] == pytest.approx(6.0, abs=0.15)
    free = of_a_mass(Friction().numbers(), *numbers(H), H, 0.4, ramp)
    assert free[int(0.2 * 8000), 0] > 0.5


def test_the_held_torque_is_right_to_first_order_in_the_step() -> None:
    """As the other laws': of the rate at the step's start."""
    ends = []
    for parts in (1, 2, 4, 32):
        step = H / parts
        t = step * np.arange(400 * parts)
        tau = 6.5 * np.sin(2 * np.pi * 2.5 * (np.floor(t / H + 1e-9) * H))
        ends.append(of_a_mass(LUGRE.numbers(), *numbers(step), step, 0.4, tau)[:: 40 * parts])
    off = [np.abs(each - ends[-1])[:, 0].max() for each in ends[:-1]]
    slope = np.polyfit(np.log([1, 0.5, 0.25]), np.log(off), 1)[0]
    assert slope == pytest.approx(1.1, abs=0.3)


def test_held_slopes_say_which_inertia_a_step_bears() -> None:
    """Bristles as a spring held with its mean over the step: stable below twice J/h."""
    (slope, _), tiny = LUGRE.steepest, np.append(1e-9, np.zeros(3000))
    assert slope == 0.3 + 30.0 + 2000.0 * PERIOD / 2
    for share, grows in ((0.98, True), (1.03, False)):
        J = share * slope * PERIOD / 2
        seen = of_a_mass(LUGRE.numbers(), *numbers(PERIOD), PERIOD, J, tiny)[:, 1]
        assert (np.abs(seen[-10:]).max() > np.abs(seen[:10]).max()) == grows


def test_slopes_of_the_new_laws() -> None:
    stuck = Friction("stribeck").steepest
    assert stuck == pytest.approx((0.2585 + 1.5 * 4.56 / 0.02, 1.0231))
    assert Friction("lugre").steepest[1] == 1.0231  # no tau_0, no bristles
    for law in ("stribeck", "lugre"):
        assert small_signal(Friction(law)) == ((1.0, 1.0), (0.2585, 1.0231))


def test_lugre_holds_a_joint_of_any_plant_where_its_bristles_bend(plant: Plant) -> None:
    """Static friction: 2 N m on joint 1 leave it -g/sigma_0 log(1 - tau/g) from where it was."""
    f = replace(SETTINGS["lugre"].friction, tau_0=(4.0, 0.5), sigma_0=(400.0, 100.0))
    g = 6.0
    steps = plant.step
    torque = np.tile([2.0, 0.0], (round(1.5 / PERIOD), 1))
    torque[:500, 0] = np.linspace(0.0, 2.0, 500)
    assert PERIOD % steps < 1e-12 or steps == PERIOD
    motion = drive(plant, Setting("held", f, "for tests"), torque, PERIOD, theta=(0.0, 1.2))
    bent = -g / 400.0 * math.log(1 - 2.0 / g)
    assert motion.joint[-300:, 0].mean() == pytest.approx(bent, rel=0.02)
    gone = drive(plant, setting("none"), torque, PERIOD, theta=(0.0, 1.2))
    assert gone.joint[-1, 0] > 100 * bent


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"stiction": (0.9, 1.0)}, r"stiction is \(0.9.*1 or more"),
        ({"stiction": (1.5,)}, "stiction is .*two joints"),
        ({"stribeck": 0.0}, "stribeck is 0.0; give more than 0"),
        ({"sigma_0": (-1.0, 1.0)}, "sigma_0 is"),
        ({"sigma_0": (0.0, 1.0)}, "sigma_0 is .*more than 0 .*tau_0"),
        ({"sigma_1": (math.nan, 1.0)}, "sigma_1 is"),
    ],
)
def test_numbers_that_cannot_be_used_are_named(change: dict, what: str) -> None:
    with pytest.raises(ParameterError, match=what):
        Friction("lugre", **change)
