"""Amplifiers, ripple, warming up, configuration, backlash: closed forms, reductions, refusals."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import signal

from controllers import TUNED
from flexsim import ParameterError, Parameters, Plant, closed_loop, drive, reference, setting
from flexsim.loop.friction import LAWS, Friction, joint_torques
from flexsim.loop.hardware import (
    HARDWARE,
    IDEAL,
    Hardware,
    JointEffects,
    cascade,
    joint_memory,
    joint_step,
    lag_factors,
)
from flexsim.loop.hardware.effects import EffectNumbers
from flexsim.loop.hardware.memory import ANGLE, RATE
from flexsim.loop.settings import Setting, held_slopes
from flexsim.loop.trajectories import Trajectory
from flexsim.numerics.jit import jit
from flexsim.plants.modes_plant import AssumedModesPlant

SUMS = 1e-12  # relative: the same sums in another order
H = 1e-3  # [s]
SHORT = Trajectory("line", duration=0.3, hold=0.1, start=(0.60, 0.30), end=(0.55, 0.35))
J, JOINT, K, HALF = 0.02, 0.3, 300.0, 1e-3  # of a motor, a joint, a shaft, half a gap
EVERYTHING = JointEffects(
    amplifier=2e-4,
    ripple=(0.02, 0.01),
    cogging=(0.02, 0.005),
    cold=(0.3, 0.2),
    warm=(-0.1, -0.2),
    warming=(0.2, 0.4),
    pose=(0.1, 0.2),
    pose_phase=(0.3, 1.0),
    backlash=(1e-3, 2e-3),
    shaft=(900.0, 90.0),
    shaft_damping=(1.0, 0.05),
    motor_inertia=(0.01, 1e-3),
    encoder="motor",
)


def with_effects(effects: JointEffects, law: str = "none", **built: Any) -> Setting:
    return Setting("test", Friction(law), "for tests", hardware=Hardware(effects=effects, **built))


def once(effects: JointEffects, friction: Friction, t: float, state: np.ndarray) -> tuple:
    """Return what 6 and -2 N m become at the joints at a time."""
    numbers = (friction.numbers(), IDEAL.numbers(H, 1), effects.numbers(H))
    return joint_step(*numbers, joint_memory(state), t, 6.0, -2.0, state)


@pytest.mark.parametrize(("lag", "amplifier"), [(1e-3, 3e-4), (5e-4, 5e-4), (2e-3, 1e-6)])
def test_two_lags_are_scipys(lag: float, amplifier: float) -> None:
    """From x and y anywhere, the command 0: decay by the states' own matrix; its mean by sums."""
    A = np.array([[-1 / lag, 1 / lag], [0.0, -1 / amplifier]])
    c = cascade(lag, amplifier, H)
    t = np.linspace(0, H, 40_001)
    for start, ends, mean in (
        ((1.0, 0.0), (c.motor, 0.0), c.mean),
        ((0.0, 1.0), (c.amplifier, c.own), c.mean_amplifier),
    ):
        system = signal.StateSpace(A, np.zeros((2, 1)), np.eye(2), np.zeros((2, 1)))
        _, y, _ = signal.lsim(system, np.zeros(len(t)), t, X0=start)
        assert ends == pytest.approx(tuple(y[-1]), abs=1e-9)
        assert mean == pytest.approx(np.trapezoid(y[:, 0], t) / H, abs=1e-6)


def test_one_lag_is_as_before_to_the_bit() -> None:
    decay, mean = lag_factors(7e-4, H)
    for each in (cascade(7e-4, 0.0, H), cascade(0.0, 7e-4, H)):
        assert (each.motor, each.amplifier, each.mean, each.mean_amplifier) == (decay, 0, mean, 0)
    assert cascade(0.0, 0.0, H)[:2] == (0.0, 0.0)


def test_a_driven_plant_gets_what_amplifiers_and_motors_give(
    modes_plant: AssumedModesPlant,
) -> None:
    """Means over a period of the filter 1/((T_a s + 1)(T_m s + 1))."""
    torque = np.random.default_rng(3).standard_normal((12, 2)) * [0.5, 0.05]
    chosen = with_effects(JointEffects(amplifier=4e-4), lag=9e-4)
    motion = drive(modes_plant, chosen, torque, theta=(0.0, 1.2))
    fine = 2000
    t = np.linspace(0, 12 * H, 12 * fine + 1)
    u = np.append(np.repeat(torque[:, 0], fine), torque[-1, 0])
    system = signal.lti([1.0], np.polymul([4e-4, 1], [9e-4, 1]))
    _, y, _ = signal.lsim(system, u, t, interp=False)
    mean = [np.trapezoid(y[k * fine : (k + 1) * fine + 1], dx=1 / fine) for k in range(12)]
    assert motion.applied[:12, 0] == pytest.approx(np.array(mean), abs=1e-5)
    swapped = with_effects(JointEffects(amplifier=9e-4), lag=4e-4)
    other = drive(modes_plant, swapped, torque, theta=(0.0, 1.2))
    assert other.applied == pytest.approx(motion.applied, abs=1e-12)  # linear: in either order


def test_ripple_and_cogging_by_hand() -> None:
    effects = JointEffects(
        ripple=(0.1, 0.2), ripple_periods=(3.0, 5.0), cogging=(0.4, 0.3), cogging_periods=(7.0, 2.0)
    )
    first, second = once(effects, Friction(), 0.0, np.array([0.4, 1.1, 0.0, 0.0]))
    assert first == pytest.approx(6 * (1 + 0.1 * math.sin(1.2)) + 0.4 * math.sin(2.8), rel=SUMS)
    assert second == pytest.approx(-2 * (1 + 0.2 * math.sin(5.5)) + 0.3 * math.sin(2.2), rel=SUMS)


@pytest.mark.parametrize("law", LAWS[:-1])
@pytest.mark.parametrize("t", [0.0, 2.0, 1e4])
def test_friction_warms_up_and_knows_its_pose(law: str, t: float) -> None:
    """All numbers of Table 4 times one factor: cold at first, warm at last."""
    effects = JointEffects(
        cold=(0.5, 0.2),
        warm=(-0.2, 0.1),
        warming=(2.0, 5.0),
        pose=(0.3, 0.1),
        pose_periods=(2.0, 1.0),
        pose_phase=(0.5, 0.0),
    )
    state = np.array([0.4, 1.1, 0.3, -0.2])
    factors = (
        (1 + 0.5 * math.exp(-t / 2) - 0.2 * (1 - math.exp(-t / 2))) * (1 + 0.3 * math.cos(0.3)),
        (1 + 0.2 * math.exp(-t / 5) + 0.1 * (1 - math.exp(-t / 5))) * (1 + 0.1 * math.cos(1.1)),
    )
    usual = Friction(law)
    scaled = replace(
        usual,
        tau_0=tuple(f * x for f, x in zip(factors, usual.tau_0, strict=True)),
        mu=tuple(f * x for f, x in zip(factors, usual.mu, strict=True)),
        dead_zone=tuple((f * a, f * b) for f, (a, b) in zip(factors, usual.dead_zone, strict=True)),
    )
    expected = joint_torques(scaled.numbers(), 6.0, -2.0, 0.3, -0.2)
    assert once(effects, usual, t, state) == pytest.approx(expected, rel=SUMS)


@jit
def play(h, e, f, k, J, half, JOINT, count):  # type: ignore[no-untyped-def]
    """Return the twist, energy and momentum (count, 3) of a motor and a joint of rigid inertia."""
    state, seen = np.zeros(4), np.zeros((count, 3))
    memory = joint_memory(state)
    memory[0, RATE] = 1.0
    for i in range(count):
        tau, _ = joint_step(f, h, e, memory, 0.0, 0.0, 0.0, state)
        step = e.step
        state[0] += step * state[2] + step * step / 2 * tau / JOINT
        state[2] += step * tau / JOINT
        x = memory[0, ANGLE] - state[0]
        pressed = max(abs(x) - half, 0.0)
        seen[i, 0] = x
        seen[i, 1] = (J * memory[0, RATE] ** 2 + JOINT * state[2] ** 2 + k * pressed**2) / 2
        seen[i, 2] = J * memory[0, RATE] + JOINT * state[2]
    return seen


def played(step: float, damping: float = 0.0, time: float = 2.0) -> np.ndarray:
    effects = JointEffects(
        backlash=(2 * HALF, 0.0),
        shaft=(K, 0.0),
        shaft_damping=(damping, 0.0),
        motor_inertia=(J, 0.0),
    )
    numbers = (IDEAL.numbers(step, 1), effects.numbers(step), Friction().numbers())
    return play(*numbers, K, J, HALF, JOINT, round(time / step))


def test_impacts_without_damping_conserve_energy_to_second_order() -> None:
    steps = H / np.array([1, 2, 4, 8])
    off = []
    for step in steps:
        seen = played(step)
        off.append(np.abs(seen[:, 1] / (J / 2) - 1).max())
        assert np.abs(seen[:, 2] - J).max() < 1e-12 * J * len(seen)  # momentum, at any step
    assert np.polyfit(np.log(steps), np.log(off), 1)[0] == pytest.approx(2, abs=0.1)
    assert off[0] < 0.005
    assert np.diff(played(H, damping=0.5)[:, 1]).max() < 0.02 * J / 2
    assert played(H, damping=0.5)[-1, 1] == pytest.approx(J**2 / (J + JOINT) / 2, rel=0.01)


def test_motion_to_and_fro_in_the_gap_has_its_period_in_closed_form() -> None:
    """Twice across the gap and half a vibration of the two inertias at either end."""
    between = 1 / (1 / J + 1 / JOINT)
    period = 2 * (2 * HALF / 1.0) + 2 * math.pi * math.sqrt(between / K)
    steps, off = H / np.array([1, 2, 4, 8]), []
    for step in steps:
        x = played(step)[:, 0]
        up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
        times = step * (up + 1 - x[up] / (x[up + 1] - x[up]))
        off.append(abs(np.diff(times).mean() / period - 1))
    assert off[0] < 1e-3 and np.polyfit(np.log(steps), np.log(off), 1)[0] > 1.8


def test_a_stiff_shaft_without_gap_is_a_motor_at_the_joint(modes_plant: AssumedModesPlant) -> None:
    """The plant with I_m, to first order in the shaft's compliance."""
    t = H * np.arange(300)
    torque = (1 - np.cos(2 * np.pi * t / 0.15))[:, None] * [0.3, 0.02]
    own = {"I_m1": 0.05, "I_m2": 0.02}
    rigid = drive(AssumedModesPlant(Parameters(**own)), setting("none"), torque, theta=(0.0, 1.2))
    stiffness, off = np.array([500.0, 1000.0, 2000.0]), []
    for k in stiffness:
        effects = JointEffects(shaft=(5 * k, k), motor_inertia=(0.05, 0.02))
        motion = drive(modes_plant, with_effects(effects), torque, theta=(0.0, 1.2))
        off.append(np.abs(motion.joint - rigid.joint).max())
    assert np.polyfit(np.log(stiffness), np.log(off), 1)[0] == pytest.approx(-1, abs=0.15)
    assert off[-1] < 2e-4 < np.abs(motion.joint - motion.joint[0]).max() / 100


def test_what_does_not_act_changes_nothing(plant: Plant) -> None:
    ref = reference(SHORT, Parameters())
    filters = [TUNED["line"].filters(H)]
    idle = JointEffects(
        ripple_periods=(7.0, 7.0),
        warming=(1.0, 1.0),
        pose_phase=(1.0, 1.0),
        shaft_damping=(1.0, 1.0),
        motor_inertia=(1.0, 1.0),
        encoder="motor",
    )
    for name in ("simulink", "opposing"):
        (plain,) = closed_loop(plant, setting(name), ref, filters)
        (other,) = closed_loop(plant, with_effects(idle, name), ref, filters)
        assert np.array_equal(plain.state, other.state)
        warm = JointEffects(cold=(0.1, 0.1), warm=(0.1, 0.1))
        (third,) = closed_loop(plant, with_effects(warm, name), ref, filters)
        assert not np.array_equal(plain.state, third.state)


def test_encoders_at_the_motors_see_their_angles(plant: Plant) -> None:
    """They differ from the joints' by the gap and the shaft's twist; at the joints by nothing."""
    ref, filters = reference(SHORT, Parameters()), [TUNED["line"].filters(H)]
    for side in ("joint", "motor"):
        effects = replace(EVERYTHING, encoder=side)
        (motion,) = closed_loop(plant, with_effects(effects, "opposing"), ref, filters)
        twist = motion.measured[:, :2] - motion.joint
        assert motion.diverged is None and twist[0].tolist() == [0.0, 0.0]
        if side == "joint":
            assert not twist.any()
        else:
            assert 4e-4 < np.abs(twist[:, 0]).max() < 0.05 and np.abs(twist[:, 1]).max() > 9e-4


def test_shafts_and_warmth_bound_the_step() -> None:
    effects = JointEffects(
        cold=(0.5, 0.0),
        pose=(0.2, 0.0),
        shaft=(400.0, 0.0),
        shaft_damping=(2.0, 3.0),
        motor_inertia=(0.1, 0.0),
    )
    own = Friction("opposing").steepest
    first, second = held_slopes(Friction("opposing"), Hardware(effects=effects))
    assert (first, second) == pytest.approx((1.5 * 1.2 * own[0] + 2.0 + 400.0 * 1e-3, own[1]))
    with pytest.raises(ParameterError, match=r"shaft of 400 .* use less than 0.2 N m/rad"):
        replace(effects, motor_inertia=(1e-7, 0.0)).numbers(1e-3)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"backlash": (1e-3, 0.0)}, "backlash is .*shaft of more than 0"),
        ({"shaft": (10.0, 0.0)}, "motor_inertia .*more than 0"),
        ({"encoder": "hub"}, "is hub; choose one of joint, motor"),
        ({"warming": (0.0, 1.0)}, "warming .* above 0"),
        ({"cold": (-1.5, 0.0)}, "cold .* from -1"),
        ({"ripple": (2.0, 0.0)}, "ripple .*0 to 1"),
        ({"pose": (1.2, 0.0)}, "pose .*0 to 1"),
        ({"amplifier": -1e-3}, "amplifier"),
        ({"pose_phase": (math.inf, 0.0)}, "pose_phase"),
    ],
)
def test_numbers_that_cannot_be_used_are_named(change: dict[str, Any], what: str) -> None:
    with pytest.raises(ParameterError, match=what) as refused:
        JointEffects(**change)
    assert "\n" not in str(refused.value)


def test_hardware_says_what_is_on() -> None:
    effects = JointEffects(amplifier=2e-4, cold=(0.3, 0.0), encoder="motor")
    assert Hardware(effects=effects).words() == (
        "amplifier 0.0002 s, cold 0.3 and 0, encoder motor"
    )
    assert not Hardware(effects=effects).ideal
    known = Hardware(lag=1e-3, counts=8, effects=EVERYTHING).linear
    assert (known.lag, known.counts, known.effects.backlash) == (1e-3, 0, (0.0, 0.0))
    assert (known.effects.shaft, known.effects.amplifier) == (EVERYTHING.shaft, 2e-4)
    assert isinstance(HARDWARE["bench"].effects.numbers(H), EffectNumbers)
