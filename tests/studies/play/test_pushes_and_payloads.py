"""A force and a payload act alike on both arms: the same work, the same momentum, one motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controllers import TUNED
from flexsim import Parameters, Robot, reference, setting, trajectory
from flexsim.mjcf.chain_file import mass_matrix as mass_of_chain
from flexsim.plants.assumed_modes import mass_matrix
from studies.play.bodies import ModesBody, MujocoBody
from studies.play.events import Event, Shove, Turn
from studies.play.laden import LadenModes, laden
from studies.play.live import Live, Stage
from studies.play.periods import pushing
from studies.play.pushes import Place, Point, place_of, push_on_modes, tip_point

FREE = [Turn(0, "gain", 0.0)]
ALIKE = 2.5e-4  # [m] between tips: what three modes and six segments leave of a blow
APART = 5e-3  # [m] that a force in the other direction, or none, would leave
WORK = 1e-5  # relative: RK4's at 1 ms
LEVER = 3e-4  # relative: MuJoCo's lever from a body's centre, held over a period
SMALL = 1e-6  # [rad, m] for differences
POINTS = {
    "tip": (Shove(0, (0.3, -0.2)), ALIKE),
    "tip, twisted": (Shove(0, (0.3, -0.2), 0.02), ALIKE),
    "middle": (Shove(0, (0.5, 0.5), 0.0, Point("segment3", (0.02, 0.01, 0.0))), ALIKE),
    "hub": (Shove(0, (2.0, 2.0), 0.05, Point("hub", (0.05, 0.02, 0.0))), 1e-4),
    "link": (Shove(0, (8.0, -9.0), 0.4, Point("link1", (0.2, 0.03, 0.0))), 1e-5),
}


def stage_of(parameters: Parameters) -> Stage:
    """Return a robot without any friction but its own."""
    robot, none = Robot(parameters), setting("none")
    modes, chain = robot.both(none)
    ref = reference(trajectory("circle"), robot.parameters)
    return Stage(modes, chain, none, TUNED["circle"], ref)


@pytest.fixture(scope="module")
def free_stage() -> Stage:
    return stage_of(Parameters())


def run(stage: Stage, events: list[Event], periods: int) -> Live:
    live = Live(stage, events)
    live.advance(periods)
    return live


@pytest.mark.parametrize("where", POINTS)
def test_a_push_moves_both_arms_alike(free_stage: Stage, where: str) -> None:
    """At rest, its loop open, for 0.1 s; and the motion is of the push, whose sign counts."""
    shove, alike = POINTS[where]
    live = run(free_stage, [*FREE, shove, Shove(100, (0.0, 0.0))], 300)
    assert live.tally.most[2] < alike
    back = replace(shove, force=(-shove.force[0], -shove.force[1]), torque=-shove.torque)
    other = run(free_stage, [*FREE, back, Shove(100, (0.0, 0.0))], 300)
    tips = [loop.arms[0].motion(free_stage.reference).tip[-1] for loop in (live, other)]
    chain = other.arms[1].motion(free_stage.reference).tip[-1]
    assert np.linalg.norm(tips[0] - tips[1]) > APART and np.linalg.norm(tips[0] - chain) > APART


def test_a_push_does_its_work() -> None:
    """Without any friction the energy of both arms is force times way, plus at the start none."""
    stage = stage_of(Parameters(F_1=0.0, F_2=0.0, zeta=0.0))
    force = (0.2, -0.3)
    live = run(stage, [*FREE, Shove(0, force)], 200)
    for arm, within in zip(live.arms, (WORK, LEVER), strict=True):
        motion = arm.motion(stage.reference)
        way = motion.tip[-1] - motion.tip[0]
        assert motion.energy[-1] == pytest.approx(float(np.dot(force, way)), rel=within)


def test_generalised_forces_are_the_works_derivative(free_stage: Stage) -> None:
    """F . dx/dq of the tip at a bent arm, against `observe`, with the load's coordinates."""
    plant = laden(free_stage.modes, 0.03, 1.0)
    model = free_stage.mujoco.model
    q = np.array([0.4, 1.1, 0.02, -0.003, 0.001])
    force = (0.7, -1.3)
    push = push_on_modes(plant, place_of(model, tip_point(model)), force, 0.0)
    Q = np.empty(3)
    found = np.array([*pushing(push, plant.parameters.L_R, q, Q), *Q])
    steps = SMALL * np.eye(5)
    there = np.hstack([np.vstack([q + steps, q - steps]), np.zeros((10, 5))])
    tips = plant.observe(there, energy=False).tip
    work = (tips[:5] - tips[5:]) @ np.array(force) / (2 * SMALL)
    np.testing.assert_allclose(found, work, rtol=1e-7, atol=1e-8)


def test_points_of_the_file_are_places_of_the_arm(free_stage: Stage) -> None:
    model, p = free_stage.mujoco.model, free_stage.modes.parameters
    tip = place_of(model, tip_point(model))
    assert tip.along == pytest.approx(p.r + p.L) and tip.across == 0.0
    link = place_of(model, Point("link1", (0.2, 0.03, 0.0)))
    assert link == Place(1, 0.2, 0.03)


MOVING = np.array([0.3, 1.2, 0.01, 0.001, 0.0, 1.0, -2.0, 0.2, 0.1, 0.0])


def spun(momentum: np.ndarray, mass: float, tip: np.ndarray, rate: np.ndarray) -> float:
    """Return an arm's angular momentum about joint 1, with that of a mass at its tip."""
    return float(momentum[0] + mass * (tip[0] * rate[1] - tip[1] * rate[0]))


def tip_and_rate(plant: object, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the tip and its velocity, by a small step along the rates."""
    m = len(state) // 2
    ahead, behind = state.copy(), state.copy()
    ahead[:m] += SMALL * state[m:]
    behind[:m] -= SMALL * state[m:]
    tips = plant.observe(np.vstack([state, ahead, behind]), energy=False).tip  # type: ignore[attr-defined]
    return tips[0], (tips[1] - tips[2]) / (2 * SMALL)


def test_a_load_at_rest_is_picked_up_at_constant_momentum(free_stage: Stage) -> None:
    """Angular momentum about joint 1 of arm and load, the load's from its place and velocity."""
    load = 0.05
    body = ModesBody(free_stage.modes, free_stage.mujoco.model)
    before = mass_matrix(free_stage.modes.coefficients, MOVING[:5]) @ MOVING[5:]
    place, _ = tip_and_rate(free_stage.modes, MOVING)
    plant = body.prepared(load, 1.0)
    state = body.take(plant, MOVING)
    tip, rate = tip_and_rate(plant, state)
    assert isinstance(plant, LadenModes)
    np.testing.assert_allclose(tip, place, atol=1e-14)
    unladen = np.concatenate([state[:2], plant.turn @ state[2:5], state[5:7]])
    unladen = np.concatenate([unladen, plant.turn @ state[7:]])
    arm = mass_matrix(free_stage.modes.coefficients, unladen[:5]) @ unladen[5:]
    assert spun(arm, load, tip, rate) == pytest.approx(before[0], rel=1e-4)  # of second order
    assert abs(arm[0] / before[0] - 1) > 0.01  # the load has got some of it


def test_the_chain_keeps_its_momentum_too(free_stage: Stage) -> None:
    load, chain = 0.05, free_stage.mujoco
    state = np.zeros(16)
    state[:8] = [0.3, 1.2, 0.02, 0.01, 0.0, -0.01, 0.0, 0.0]
    state[8:] = [1.0, -2.0, 0.1, 0.2, 0.0, 0.0, -0.3, 0.1]
    body = MujocoBody(chain)
    before = mass_of_chain(chain.model, state[:8]) @ state[8:]
    plant = body.prepared(load, 1.0)
    after = body.take(plant, state)
    np.testing.assert_array_equal(after[:8], state[:8])
    tip, rate = tip_and_rate(plant, after)
    arm = mass_of_chain(chain.model, after[:8]) @ after[8:]
    assert spun(arm, load, tip, rate) == pytest.approx(before[0], rel=1e-8)
    np.testing.assert_array_equal(body.take(body.prepared(0.0, 1.0), after), after)


def test_a_load_let_go_takes_its_momentum_along(free_stage: Stage) -> None:
    """Rates stay as they are, in the coordinates without it."""
    body = ModesBody(free_stage.modes, free_stage.mujoco.model)
    plant = body.prepared(0.05, 1.0)
    state = body.take(plant, np.zeros(10))
    state = state + MOVING
    tip, rate = tip_and_rate(plant, state)
    free = body.take(body.prepared(0.0, 1.0), state)
    for found, expected in zip(tip_and_rate(body.plant, free), (tip, rate), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_both_arms_go_on_alike_with_a_load(free_stage: Stage) -> None:
    """In the closed loop, picked up in full motion; as they would not at unchanged rates."""
    for script in (
        [Turn(1500, "payload", 0.05)],
        [Turn(0, "payload", 0.05), Turn(1500, "payload", 0.0)],
    ):
        assert run(free_stage, script, 1800).tally.most[2] < ALIKE
    careless = Live(free_stage)
    careless.advance(1500)
    rates = careless.arms[1].state.copy()
    careless.turn("payload", 0.05)
    careless.arms[1]._memory.state[:] = rates  # no momentum is shared
    careless.advance(300)
    assert careless.tally.most[2] > 4 * ALIKE


def test_a_laden_beam_is_nearly_that_of_a_robot_with_the_load(free_stage: Stage) -> None:
    """Its mode 1 to a thousandth; without a load or factor, the plant to the bit."""
    own = free_stage.modes
    for name, value in own.coefficients._asdict().items():
        np.testing.assert_array_equal(getattr(laden(own, 0.0, 1.0).coefficients, name), value)
    p = laden(own, 0.05, 1.0).coefficients
    q = Robot(Parameters(payload=0.05)).modes_plant().coefficients
    ours, theirs = (np.sqrt(each.stiffness / each.mass) for each in (p, q))
    assert ours[0] == pytest.approx(theirs[0], rel=1e-3)
    assert (ours >= theirs).all() and ours[1] == pytest.approx(theirs[1], rel=1e-2)
    damped = laden(own, 0.0, 3.0).coefficients
    np.testing.assert_array_equal(damped.damping, 3.0 * own.coefficients.damping)
