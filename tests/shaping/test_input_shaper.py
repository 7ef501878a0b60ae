"""Input shapers: an oscillator's residual vibration, sensitivity, rounding, shaped references."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from controllers.shaped import pd
from flexsim import ParameterError
from flexsim.arm.parameters import paper
from flexsim.linear.linearise import linearise
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.runs import measure
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import CIRCLE, TRAJECTORIES, reference
from flexsim.robot import Robot
from flexsim.shaping.input_shaper import (
    Shaper,
    for_modes,
    in_series,
    joint_free_modes,
    joint_held_modes,
    residual_vibration,
    shaped_by,
    zv,
    zvd,
)

OMEGA, ZETA = 21.0, 0.02
PERIOD = 1e-3
ROUNDING = 1e-12
INSENSITIVITY = {"zv": 0.06, "zvd": 0.29}  # published: widths at 5 % vibration, in omega/omega_0
AT = 0.05
WIDTH_DIGITS = 0.005  # they are printed with two digits


def ring(shaper, omega, zeta):
    """Amplitude that impulses leave an oscillator with, in its motion's closed form (complex)."""
    damped = omega * math.sqrt(1 - zeta**2)
    last = shaper.times[-1]
    return abs(
        sum(
            a * np.exp((-zeta * omega + 1j * damped) * (last - t))
            for t, a in zip(shaper.times, shaper.amplitudes, strict=True)
        )
    )


@pytest.mark.parametrize("shape", [zv, zvd])
@pytest.mark.parametrize("zeta", [0.0, ZETA, 0.3])
def test_no_vibration_is_left_at_the_frequency(shape, zeta):
    shaper = shape(OMEGA, zeta)
    assert shaper.amplitudes.sum() == pytest.approx(1.0, rel=ROUNDING)
    assert ring(shaper, OMEGA, zeta) < ROUNDING
    assert residual_vibration(shaper, OMEGA, zeta) < ROUNDING


@pytest.mark.parametrize("ratio", [0.8, 1.0, 1.3])
def test_undamped_residuals_are_the_closed_forms(ratio):
    """|cos(pi/2 omega/omega_0)| of ZV, its square of ZVD."""
    expected = abs(math.cos(math.pi / 2 * ratio))
    assert residual_vibration(zv(OMEGA), ratio * OMEGA) == pytest.approx(expected, abs=ROUNDING)
    assert residual_vibration(zvd(OMEGA), ratio * OMEGA) == pytest.approx(expected**2, abs=ROUNDING)
    assert residual_vibration(in_series(), ratio * OMEGA) == 1.0


def test_zvd_has_no_slope_and_zv_has_one():
    near = 1e-4
    assert residual_vibration(zvd(OMEGA), OMEGA * (1 + near)) < 3 * near**2
    assert residual_vibration(zv(OMEGA), OMEGA * (1 + near)) == pytest.approx(
        math.pi / 2 * near, rel=1e-3
    )


@pytest.mark.parametrize("kind", INSENSITIVITY)
def test_insensitivity_is_the_published_one(kind):
    shaper = for_modes(kind, [(1.0, 0.0)])
    ratio = np.linspace(0.5, 1.5, 20001)
    left = np.array([residual_vibration(shaper, float(each)) for each in ratio])
    width = np.ptp(ratio[left < AT])
    assert width == pytest.approx(INSENSITIVITY[kind], abs=WIDTH_DIGITS)


def test_a_two_mass_system_comes_to_rest():
    """Two masses and a spring, the first struck by each impulse: motion by the exponential."""
    k, (m1, m2) = 3.0, (2.0, 0.5)
    spring = k * np.array([[-1 / m1, 1 / m1], [1 / m2, -1 / m2]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [spring, np.zeros((2, 2))]])
    omega = math.sqrt(k * (1 / m1 + 1 / m2))
    for shaper, rests in ((zv(omega), True), (zvd(omega), True), (in_series(), False)):
        state, before = np.zeros(4), 0.0
        for t, a in zip(shaper.times, shaper.amplitudes, strict=True):
            state = expm(A * (t - before)) @ state
            state[2] += a / m1
            before = t
        moving = abs(state[3] - state[2]) + abs(state[1] - state[0])  # of one against the other
        assert (moving < ROUNDING) == rests
        assert m1 * state[2] + m2 * state[3] == pytest.approx(1.0)  # all of the push is there


def test_shapers_in_series_serve_all_modes():
    shaper = for_modes("zv", [(21.0, 0.0), (131.0, 0.01)])
    assert len(shaper.times) == 4 and (np.diff(shaper.times) > 0).all()
    assert residual_vibration(shaper, 21.0) < ROUNDING
    assert residual_vibration(shaper, 131.0, 0.01) < ROUNDING
    assert residual_vibration(shaper, 60.0) > 0.05


@pytest.mark.parametrize("omega", [21.0, 131.4, 368.0])
def test_rounding_between_samples_costs_the_square_of_the_step(omega):
    """Interpolated it is at most (omega T)^2 / 16 of a ZV; to the nearest sample far more."""
    exact = zv(omega)
    rounded = exact.on_samples(PERIOD)
    assert rounded.amplitudes.sum() == pytest.approx(1.0, rel=ROUNDING)
    left = residual_vibration(rounded, omega)
    share = exact.times[1] / PERIOD % 1
    step = omega * PERIOD
    assert left == pytest.approx(0.5 * share * (1 - share) * step**2 / 2, rel=0.05, abs=1e-15)
    assert left <= step**2 / 16 * 1.01
    nearest = Shaper(PERIOD * np.round(exact.times / PERIOD), exact.amplitudes)
    assert residual_vibration(nearest, omega) > 3 * left


def test_a_shaped_reference_is_the_convolution_on_samples():
    path = reference(CIRCLE, paper(), PERIOD)
    shaper = zvd(OMEGA, ZETA)
    shaped = shaped_by(path, shaper)
    taps = shaper.on_samples(PERIOD).amplitudes
    padded = np.pad(path.joint, ((len(taps) - 1, 0), (0, 0)), mode="edge")
    expected = np.stack([np.convolve(padded[:, j], taps, "valid") for j in (0, 1)], axis=1)
    np.testing.assert_allclose(shaped.joint, expected, atol=ROUNDING)
    assert shaped.tip is path.tip and len(shaped.time) == len(path.time)
    np.testing.assert_allclose(shaped.joint[-1], path.joint[-1], atol=ROUNDING)  # it arrives
    unshaped = shaped_by(path, in_series())
    np.testing.assert_array_equal(unshaped.joint, path.joint)


def test_an_oscillator_rides_a_shaped_reference_to_rest():
    """A spring's end moved as joint 2 is rings after the path, a thousandth as much if shaped."""
    path = reference(replace(CIRCLE, duration=0.9), paper(), PERIOD)

    def ringing(joint):
        x, after = np.zeros(2), []
        turn = OMEGA * PERIOD
        c, s = math.cos(turn), math.sin(turn)
        for held in (joint[:, 1] - joint[0, 1])[:-1]:
            off, rate = x[0] - held, x[1] / OMEGA
            x = np.array([held + c * off + s * rate, OMEGA * (c * rate - s * off)])
            after.append(math.hypot(x[0] - (joint[-1, 1] - joint[0, 1]), x[1] / OMEGA))
        return np.mean(after[-50:])

    shaped = shaped_by(path, zvd(OMEGA))
    assert ringing(shaped.joint) < 1e-3 * ringing(path.joint)


def test_joint_free_modes_are_the_robots():
    """7.77935 and 24.3014 Hz in the closed form, straight arm; ratios grow with frequency."""
    linear = linearise(Robot().plant("assumed-modes:5"), 0.0)
    (first, ratio), (second, more) = joint_free_modes(linear, 2)
    assert first / (2 * math.pi) == pytest.approx(7.77935, rel=2e-4)
    assert second / (2 * math.pi) == pytest.approx(24.3014, rel=2e-3)
    assert 0 < ratio < more
    with pytest.raises(ParameterError, match="0 to 5"):
        joint_free_modes(linear, 6)


def test_joint_held_modes_are_the_clamped_beams():
    """3.33729 Hz, and the damping ratio that a robot has in mode 1."""
    ((omega, zeta),) = joint_held_modes(linearise(Robot().plant("assumed-modes:5"), 1.2), 1)
    assert omega / (2 * math.pi) == pytest.approx(3.33729, rel=1e-5)
    assert zeta == pytest.approx(Robot().parameters.zeta, rel=1e-6)


def test_a_loops_vibration_after_a_fast_line_is_shaped_away():
    """7.1 mm of v unshaped, 1.0 mm by the mode of held joints; that of free joints does little."""
    bench = setting("none", HARDWARE["bench"])
    plant = Robot().plant("assumed-modes:5", bench)
    path = reference(replace(TRAJECTORIES["line"], duration=1.0), plant.parameters, PERIOD)
    linear = linearise(plant, float(path.joint[len(path.joint) // 2, 1]))
    pair = pd.design([60.0, 0.5, 15.0, 80.0, 0.3, 15.0], np.diag(linear.M)[:2], PERIOD)
    left = {}
    for name, modes in (
        ("none", []),
        ("held", joint_held_modes(linear)),
        ("free", joint_free_modes(linear)),
    ):
        shaped = shaped_by(path, for_modes("zv", modes))
        (found,) = measure(plant, bench, shaped, [pair], hold=0.5, v_gain=0.0)
        left[name] = found["residual_v"]
    assert left["held"] < left["none"] / 5
    assert left["free"] > left["none"] / 2


@pytest.mark.parametrize(("omega", "zeta"), [(0.0, 0.0), (math.nan, 0.0), (1.0, 1.0), (1.0, -0.1)])
def test_a_mode_that_is_none_is_refused(omega, zeta):
    with pytest.raises(ParameterError, match="cannot be shaped for"):
        zvd(omega, zeta)


def test_what_cannot_be_shaped_is_refused():
    path = reference(CIRCLE, paper(), PERIOD)
    with pytest.raises(ParameterError, match="fed forward"):
        shaped_by(replace(path, torque=np.zeros_like(path.joint)), zv(OMEGA))
    with pytest.raises(ParameterError, match="longer hold"):
        shaped_by(path, zv(1.0))
    with pytest.raises(ParameterError, match="unknown"):
        for_modes("zvdd", [])
