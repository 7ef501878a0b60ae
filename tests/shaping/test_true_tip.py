"""The inversion of the tip: through the linear plant, the nonlinear one, and the closed loop."""

import math
from dataclasses import replace

import numpy as np
import pytest
from trial_controllers import TRIAL

from controllers import TUNED_IDEAL
from flexsim import ParameterError, Parameters
from flexsim.linear.linearise import linearise, zero_order_hold
from flexsim.loop.friction import Friction
from flexsim.loop.metrics import measures
from flexsim.loop.runs import closed_loop, drive
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import Reference, Trajectory, reference, trajectory
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.linear_plant import LinearPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.shaping import feedforward
from flexsim.shaping.feedforward import Filters, dead_zone_error
from flexsim.shaping.true_tip import REST, shaped_reference, tip_zeros, true_tip_motion

PARAMETERS = Parameters()
PERIOD = 1e-3  # [s]
NAMES = ("line", "two-loop", "circle")
HOLDING = TRIAL["circle"].filters(PERIOD)  # stable without friction on every trajectory
FIFTH = 0.2  # the aim: shaped over unshaped envelope
THOUSANDTH = 1e-3  # the same with the filters' errors and a lead added; measured: 5e-4 at most
ON_PATH = 1e-12  # [m]; the tip of the motion, by construction
FOLLOWED = 0.05  # of v's peak (2 unshaped): what turns to second order, held torques
OPEN_LOOP = 0.01  # of v's peak: central differences and torques held over a period
SAME = 0.01  # relative difference of two plants' envelopes
MODEL = 0.02  # relative, of a stiff beam's v against the statics' leading term
SLOW = 4.0  # times the duration, so 1/16 of every acceleration
DITHERED = 0.1  # dithered over plain envelope; measured: 0.08 at most
LEAD = 0.3  # [s], exp(-53.9 x 0.3) = 1e-7


def path(name: str, **changes: float) -> Reference:
    return reference(replace(trajectory(name), **changes), PARAMETERS, PERIOD)


def envelope(
    plant: Plant, ref: Reference, filters: Filters = HOLDING, setting_name: str = "none"
) -> float:
    motion = closed_loop(plant, setting(setting_name), ref, [filters], energy=False)[0]
    assert motion.diverged is None
    return float(measures(motion, ref)["envelope"])


def held(torque: np.ndarray) -> np.ndarray:
    """Torques to hold over each period: the mean of its ends."""
    return (torque[1:] + torque[:-1]) / 2


def test_inversion_reproduces_the_tip_through_the_linear_plant(plant: Plant) -> None:
    small = Trajectory("line", 0.8, 0.2, start=(0.55, 0.35), end=(0.55001, 0.35002))
    ref = reference(small, PARAMETERS, PERIOD)
    motion = true_tip_motion(ref, plant)
    linear = linearise(plant, ref.joint[0, 1])
    A, B = zero_order_hold(linear, PERIOD)
    state = np.zeros(len(A))
    tip = np.empty((len(motion.time), 2))
    for k, torque in enumerate([*held(motion.torque), np.zeros(2)]):
        tip[k] = linear_tip(linear, ref.joint[0], state)
        state = A @ state + B @ torque
    start, count = round(REST / PERIOD), len(ref.time)
    error = np.abs(tip[start : start + count] - (ref.tip - ref.tip[0])).max()
    assert error < FOLLOWED * np.abs(motion.v).max()


def linear_tip(linear: LinearPlant, joint: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Displacement (2,) [m] of the tip to first order in the state's deviations."""
    th1, th12 = joint[0], joint.sum()
    across = np.array([-np.sin(th12), np.cos(th12)])
    link = PARAMETERS.L_R * np.array([-np.sin(th1), np.cos(th1)])
    turn = PARAMETERS.reach * across
    theta1, theta2, v = linear.C @ state
    moved: np.ndarray = theta1 * (link + turn) + theta2 * turn + v * across
    return moved


@pytest.mark.parametrize("name", NAMES)
def test_the_motions_torque_takes_the_nonlinear_tip_along_the_path(plant: Plant, name: str) -> None:
    ref = path(name, duration=1.5, hold=0.2)
    motion = true_tip_motion(ref, plant)
    start = plant.rest_state(motion.q[0, :2])
    driven = drive(plant, setting("none"), held(motion.torque), PERIOD, state=start)
    first = round(REST / PERIOD)
    error = np.linalg.norm(driven.tip[first : first + len(ref.time)] - ref.tip, axis=1)
    assert error.max() < OPEN_LOOP * np.abs(motion.v).max()  # open loop, no feedback


@pytest.mark.parametrize("name", NAMES)
def test_the_motions_tip_is_on_the_path_at_every_sample(plant: Plant, name: str) -> None:
    ref = path(name)
    motion = true_tip_motion(ref, plant)
    first = round(REST / PERIOD)
    states = np.hstack([motion.q, np.zeros_like(motion.q)])[first : first + len(ref.time)]
    seen = plant.observe(states, energy=False)
    assert np.abs(seen.tip - ref.tip).max() < ON_PATH
    assert seen.v == pytest.approx(motion.v[first : first + len(ref.time)], abs=ON_PATH)


@pytest.mark.parametrize("name", NAMES)
def test_true_tip_follows_to_a_fifth_of_the_envelope(plant: Plant, name: str) -> None:
    ref = path(name)
    plain, shaped = envelope(plant, ref), envelope(plant, shaped_reference(ref, plant))
    assert shaped < FIFTH * plain  # measured: 0.127, 0.061, 0.057


@pytest.mark.parametrize("name", NAMES)
def test_with_the_filters_errors_next_to_nothing_is_left(plant: Plant, name: str) -> None:
    ref = path(name)
    shaped = shaped_reference(ref, plant, lead=LEAD, filters=HOLDING)
    assert envelope(plant, shaped) < THOUSANDTH * envelope(plant, ref)


@pytest.mark.parametrize("name", NAMES)
def test_either_plants_inversion_serves_both(
    name: str, modes_plant: AssumedModesPlant, chain_plant: ChainPlant
) -> None:
    ref = path(name)
    crossed = envelope(chain_plant, shaped_reference(ref, modes_plant))
    own = envelope(chain_plant, shaped_reference(ref, chain_plant))
    assert crossed == pytest.approx(own, rel=SAME)


def test_every_controller_gains_that_holds_without_friction(modes_plant: AssumedModesPlant) -> None:
    ref = path("two-loop")
    shaped = shaped_reference(ref, modes_plant)
    for name in ("line", "circle"):  # 'two-loop' itself is unstable without friction
        filters = TRIAL[name].filters(PERIOD)
        assert envelope(modes_plant, shaped, filters) < FIFTH * envelope(modes_plant, ref, filters)


def test_the_opposite_shaping_makes_it_worse(modes_plant: AssumedModesPlant) -> None:
    ref = path("circle")
    shaped = shaped_reference(ref, modes_plant)
    opposite = replace(shaped, joint=2 * ref.joint - shaped.joint)
    assert envelope(modes_plant, opposite) > 1.5 * envelope(modes_plant, ref)


def test_a_tip_at_rest_leaves_the_reference_as_it_is(plant: Plant) -> None:
    ref = path("line", duration=0.5, hold=0.0)
    still = Reference(
        ref.time, np.tile(ref.tip[:1], (len(ref.time), 1)), np.tile(ref.joint[:1], (501, 1))
    )
    shaped = shaped_reference(still, plant, filters=HOLDING)
    assert shaped.joint == pytest.approx(still.joint, abs=1e-14)
    assert np.array_equal(shaped.time, still.time)


def test_a_slow_trajectory_is_hardly_shaped(modes_plant: AssumedModesPlant) -> None:
    change = []
    for factor in (1.0, SLOW):
        ref = path("circle", duration=4.0 * factor)
        shaped = shaped_reference(ref, modes_plant)
        change.append(np.abs(shaped.joint - ref.joint).max())
    assert change[0] / change[1] == pytest.approx(SLOW**2, rel=MODEL)


def test_a_stiff_beam_is_hardly_shaped() -> None:
    ref = path("circle")
    change = []
    for factor in (16.0, 64.0):
        stiff = AssumedModesPlant(replace(PARAMETERS, EI=0.349 * factor), step=1e-4)
        change.append(np.abs(shaped_reference(ref, stiff).joint - ref.joint).max())
    assert change[0] / change[1] == pytest.approx(4.0, rel=MODEL)


def test_zeros_lie_in_both_half_planes_alike(plant: Plant) -> None:
    zeros = tip_zeros(linearise(plant.undamped()), PARAMETERS.reach)  # damping moves both left
    assert np.sum(zeros.real > 0) == np.sum(zeros.real < 0) == len(zeros) // 2
    assert np.abs(zeros.real).min() == pytest.approx(53.9, abs=0.1)


def test_what_precedes_the_path_dies_out_at_the_first_zero(modes_plant: AssumedModesPlant) -> None:
    motion = true_tip_motion(path("circle"), modes_plant)
    before = (motion.time > -0.15) & (motion.time < -0.05)
    rate = np.polyfit(motion.time[before], np.log(np.abs(motion.v[before])), 1)[0]
    assert rate == pytest.approx(53.9, rel=0.01)


def test_a_lead_is_a_hold_put_first(modes_plant: AssumedModesPlant) -> None:
    ref = path("line")
    plain, led = shaped_reference(ref, modes_plant), shaped_reference(ref, modes_plant, lead=LEAD)
    extra = round(LEAD / PERIOD)
    assert len(led.time) == len(ref.time) + extra
    assert led.joint[extra:] == pytest.approx(plain.joint, abs=1e-12)
    assert np.array_equal(led.tip[:extra], np.tile(ref.tip[:1], (extra, 1)))
    assert envelope(modes_plant, led) < envelope(modes_plant, plain)


def test_a_start_at_speed_needs_the_lead(modes_plant: AssumedModesPlant) -> None:
    ref = reference(trajectory("circle", reconstructed=True), PARAMETERS, PERIOD)
    late, led = (envelope(modes_plant, shaped_reference(ref, modes_plant, x)) for x in (0, LEAD))
    assert led < 0.25 * late


def test_the_dead_zone_bounds_what_is_left_under_friction(plant: Plant) -> None:
    ref = path("two-loop")
    friction = setting("opposing").friction
    hidden = PARAMETERS.reach * dead_zone_error(HOLDING, friction)[1]
    assert hidden == pytest.approx(0.0101, abs=1e-4)  # 0.66 N m over 37 N m/rad, times 0.575 m
    plain = envelope(plant, ref, setting_name="opposing")
    shaped = shaped_reference(ref, plant, filters=HOLDING, friction=friction)
    left = envelope(plant, shaped, setting_name="opposing")
    assert left < 0.4 * plain  # measured: 0.32
    assert 0.5 * hidden < left < 2 * hidden  # measured: 1.25


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("filters", [HOLDING, None], ids=["trial", "tuned"])
def test_a_dither_takes_the_dead_zone_away(
    plant: Plant, name: str, filters: Filters | None
) -> None:
    ref, friction = path(name), setting("jump").friction
    chosen = filters or TUNED_IDEAL[name].filters(PERIOD)
    plain = envelope(plant, ref, chosen, "jump")
    shaped = shaped_reference(ref, plant, filters=chosen, friction=friction, dither=True)
    assert envelope(plant, shaped, chosen, "jump") < DITHERED * plain


def test_a_dither_inside_the_dead_zone_does_not(
    modes_plant: AssumedModesPlant, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feedforward, "PEAK", 0.5)
    ref, friction = path("line"), setting("jump").friction
    plain = envelope(modes_plant, ref, HOLDING, "jump")
    shaped = shaped_reference(ref, modes_plant, filters=HOLDING, friction=friction, dither=True)
    assert envelope(modes_plant, shaped, HOLDING, "jump") > 2 * DITHERED * plain


@pytest.mark.parametrize("scale", [0.8, 1.2])
def test_the_dither_bears_another_dead_zone(modes_plant: AssumedModesPlant, scale: float) -> None:
    ref, friction = path("two-loop"), setting("jump").friction
    zone = tuple((scale * low, scale * high) for low, high in friction.dead_zone)
    other = replace(setting("jump"), friction=replace(friction, dead_zone=zone))
    shaped = shaped_reference(ref, modes_plant, filters=HOLDING, friction=friction, dither=True)
    motion = closed_loop(modes_plant, other, shaped, [HOLDING], energy=False)[0]
    plain = closed_loop(modes_plant, other, ref, [HOLDING], energy=False)[0]
    assert measures(motion, ref)["envelope"] < DITHERED * measures(plain, ref)["envelope"]


def test_less_friction_leaves_less_error(modes_plant: AssumedModesPlant) -> None:
    ref = path("circle")
    left = []
    for scale in (0.01, 0.1, 1.0):
        friction = setting("opposing").friction
        zone = tuple((scale * low, scale * high) for low, high in friction.dead_zone)
        tau_0, mu = (tuple(scale * x for x in each) for each in (friction.tau_0, friction.mu))
        scaled = replace(friction, dead_zone=zone, tau_0=tau_0, mu=mu)
        ref_scaled = shaped_reference(ref, modes_plant, LEAD, HOLDING, scaled)
        chosen = replace(setting("opposing"), friction=scaled)
        motion = closed_loop(modes_plant, chosen, ref_scaled, [HOLDING], energy=False)[0]
        left.append(measures(motion, ref_scaled)["envelope"])
    assert left[0] < 0.3 * left[1] < 0.3 * left[2] * 0.5  # measured: 0.2, 2.5, 9.7 mm
    assert dead_zone_error(HOLDING, Friction("none")).tolist() == [0.0, 0.0]


def test_an_elbow_bent_the_other_way_is_shaped_alike(modes_plant: AssumedModesPlant) -> None:
    ref, mirror = path("circle"), np.array([1.0, -1.0])
    other = Reference(ref.time, ref.tip * mirror, -ref.joint)
    assert (other.joint[:, 1] < 0).all()
    shaped = shaped_reference(other, modes_plant)
    assert shaped.joint == pytest.approx(-shaped_reference(ref, modes_plant).joint, abs=1e-9)


@pytest.mark.parametrize("v_gain", [0.0, 1.0])
def test_the_loops_reading_of_v_is_in_the_reference(
    modes_plant: AssumedModesPlant, v_gain: float
) -> None:
    ref = path("circle")
    motion = true_tip_motion(ref, modes_plant)
    first = round(REST / PERIOD)
    rows = slice(first, first + len(ref.time))
    wanted = motion.q[rows, 1] + v_gain * np.arctan(motion.v[rows] / PARAMETERS.reach)
    shaped = shaped_reference(ref, modes_plant, v_gain=v_gain)
    assert shaped.joint[:, 1] == pytest.approx(wanted, abs=1e-12)
    assert np.abs(motion.v).max() > 1e-3


def test_the_printed_equations_can_be_inverted_too() -> None:
    printed = AssumedModesPlant(PARAMETERS, form="printed")
    ref = path("circle")
    shaped = shaped_reference(ref, printed, LEAD, HOLDING)
    assert envelope(printed, shaped) < THOUSANDTH * envelope(printed, ref)


def test_what_cannot_be_shaped_is_refused(modes_plant: AssumedModesPlant) -> None:
    ref = path("circle")
    for lead in (-0.1, math.nan, math.inf):
        with pytest.raises(ParameterError, match="lead"):
            shaped_reference(ref, modes_plant, lead)
    with pytest.raises(ParameterError, match="torque fed forward"):
        shaped_reference(replace(ref, torque=np.zeros_like(ref.joint)), modes_plant)
    difference = (np.array([1.0, -1.0]), np.ones(1))
    with pytest.raises(ParameterError, match="joint 1 passes nothing"):
        shaped_reference(ref, modes_plant, filters=(difference, difference))
    with pytest.raises(ParameterError, match="dither needs the filters"):
        shaped_reference(ref, modes_plant, filters=HOLDING, dither=True)
    with pytest.raises(ParameterError, match="no constant error"):
        dead_zone_error((difference, difference), Friction("opposing"))
    with pytest.raises(ParameterError, match=r"too fast|cannot reach"):
        shaped_reference(path("two-loop", duration=0.2), modes_plant)
