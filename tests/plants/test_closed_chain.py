"""The chain in closed form: equal to MuJoCo's to rounding, over states, files and torques."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from edits import DEFAULT, EDITS, edited

from controllers import TUNED
from flexsim import ModelError, Parameters, Robot, evaluate, reference, setting, trajectory
from flexsim.mjcf.chain_file import load_chain
from flexsim.numerics.types import Array
from flexsim.plants.chain_plant import ChainPlant, ClosedChainPlant
from flexsim.plants.closed_form_chain import closed_form
from flexsim.plants.dispatch import physics_step, work_space

STEPS = 500
AGREES = 1e-12  # [rad] after STEPS; MuJoCo's own motion moves by as much after a rounding
HAIR = 1e-15  # [rad] by which a second run of MuJoCo's starts apart
NO_FASTER = 1e3  # times as far apart as those two, in a motion that tells roundings apart

ASIDE = edited(  # a mass beside the beam's axis, and a hub's along and beside it
    '<site name="tip" pos="0.077095 0 0"/>',
    '<site name="tip" pos="0.077095 0 0"/><body name="aside" pos="0.05 0.03 0">'
    '<inertial pos="0.01 0 0" mass="0.03" diaginertia="1e-5 1e-5 2e-5"/></body>',
    edited(
        '<inertial pos="0 0 0" mass="0.47"', '<inertial pos="0.02 -0.01 0" mass="0.47"', DEFAULT
    ),
)
EULER = edited('integrator="RK4"', 'integrator="Euler"', EDITS["damped"]).replace(
    'timestep="0.001"', 'timestep="0.0005"'
)
FILES = {
    "default": DEFAULT,
    "payload": EDITS["payload"],
    "damped": EDITS["damped"],
    "4 segments": EDITS["4 segments"],
    "16 segments": EDITS["16 segments"],
    "masses aside": ASIDE,
    "armatures, gears": DEFAULT.replace('armature="0"', 'armature="0.05"').replace(
        'gear="1"', 'gear="2.5"'
    ),
    "Euler, damped": EULER,
}


def moved(model: mujoco.MjModel, start: Array, torques: Array) -> Array:
    """Return MuJoCo's own state (2 m,) after the torques (K, 2), a step each."""
    data, m = mujoco.MjData(model), model.nq
    data.qpos[:], data.qvel[:] = start[:m], start[m:]
    for torque in torques:
        data.ctrl[:] = torque
        mujoco.mj_step(model, data)
    return np.concatenate([data.qpos, data.qvel])


def by_equations(plant: ClosedChainPlant, start: Array, torques: Array) -> Array:
    """Return the closed form's state (2 m,) after the same."""
    state, p = start.copy(), closed_form(plant.chain)
    work = work_space(len(state) // 2)
    for tau_1, tau_2 in torques:
        physics_step(p, 0, state, tau_1, tau_2, work)
    return state


def started(m: int, seed: int) -> tuple[Array, Array]:
    """Return a random state (2 m,) and torques (STEPS, 2), moderate."""
    rng = np.random.default_rng(seed)
    q = np.concatenate([rng.uniform(-3, 3, 2), rng.normal(size=m - 2) * 0.02])
    w = np.concatenate([rng.normal(size=2), rng.normal(size=m - 2) * 0.2])
    return np.concatenate([q, w]), rng.uniform(-1, 1, (STEPS, 2)) * (0.5, 0.05)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", FILES)
def test_it_moves_as_mujoco_does(name: str, seed: int) -> None:
    chain = load_chain(text=FILES[name])
    start, torques = started(chain.model.nq, seed)
    own, ours = moved(chain.model, start, torques), None
    ours = by_equations(ClosedChainPlant(Parameters(), chain), start, torques)
    m = chain.model.nq
    assert np.abs(own[:m] - ours[:m]).max() < AGREES
    assert np.abs(own[m:] - start[m:]).max() > 0.1  # it did move


def test_it_parts_from_mujoco_no_faster_than_mujoco_from_itself() -> None:
    chain = load_chain(text=DEFAULT)
    start, torques = started(chain.model.nq, 7)
    start[chain.model.nq :] *= 5
    torques = np.tile(torques, (8, 1))
    apart = np.zeros_like(start)
    apart[0] = HAIR
    own, beside = moved(chain.model, start, torques), moved(chain.model, start + apart, torques)
    ours = by_equations(ClosedChainPlant(Parameters(), chain), start, torques)
    assert np.abs(own - ours).max() < NO_FASTER * max(np.abs(own - beside).max(), HAIR)


def test_masses_aside_are_in_the_moments_across_alone() -> None:
    """Negative control: without these the motion is another."""
    assert np.abs(closed_form(load_chain(text=DEFAULT)).h_y).max() < 1e-15
    chain = load_chain(text=ASIDE)
    p = closed_form(chain)
    start, torques = started(chain.model.nq, 1)
    state, work = start.copy(), work_space(len(start) // 2)
    without = p._replace(h_y=np.zeros_like(p.h_y))
    for tau_1, tau_2 in torques:
        physics_step(without, 0, state, tau_1, tau_2, work)
    assert np.abs(state - moved(chain.model, start, torques)).max() > 1e-6


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ('integrator="RK4"', 'integrator="implicitfast"', "implicitfast"),
        ('<joint name="joint2"', '<joint name="joint2" frictionloss="0.01"', "joint2"),
    ],
)
def test_what_it_does_not_have_is_refused_by_name(old: str, new: str, named: str) -> None:
    chain = load_chain(text=edited(old, new))
    with pytest.raises(ModelError, match=named):
        ClosedChainPlant(Parameters(), chain)


def test_a_robot_has_it_by_name_and_its_loops_are_the_chains() -> None:
    """Without friction, where no rounding is amplified."""
    robot, ideal = Robot(), setting("none")
    chain, closed = robot.plant("chain", ideal), robot.plant("closed-chain:6", ideal)
    assert isinstance(closed, ChainPlant) and closed.name == "closed-chain:6"
    circle = reference(trajectory("circle"), robot.parameters)
    filters = [TUNED["circle"].filters(1e-3)]
    index = [evaluate(plant, ideal, circle, filters).indices[0] for plant in (chain, closed)]
    assert index[1] == pytest.approx(index[0], rel=1e-9)
