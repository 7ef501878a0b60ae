"""The chain in closed form: equal to MuJoCo's to rounding, over states, files and torques."""

from __future__ import annotations

import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
from edits import DEFAULT, EDITS, edited
from random_edits import random_edit

from controllers import TUNED_IDEAL
from flexsim import (
    FlexsimError,
    ModelError,
    Parameters,
    Robot,
    evaluate,
    reference,
    setting,
    trajectory,
)
from flexsim.mjcf.chain_file import ChainModel, load_chain, mass_matrix
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.types import Array
from flexsim.plants.chain_plant import ChainPlant, ClosedChainPlant
from flexsim.plants.closed_form_chain import closed_form
from flexsim.plants.dispatch import physics_step, work_space

STEPS = 500
MOVED = 0.01  # [rad] at least: angles that rounding would not hide
AGREES = 1e-12  # [rad] after STEPS; MuJoCo's own motion moves by as much after a rounding
HAIR = 1e-15  # [rad] by which a second run of MuJoCo's starts apart
NO_FASTER = 100  # times as far apart as those two: each step rounds by about a hair
VIOLENT = 20  # times the moderate rates: a motion that tells roundings apart
HUB = 0.01  # [kg m2] about joint 2 of the shipped arm, beam and all
RANDOM = 120  # edits of the shipped chains
FEWEST = 0.2  # of them that must have a closed form: else nothing is tested
MODELS = sorted((Path(__file__).parents[2] / "models").glob("chain*.xml"))

ASIDE = edited(  # a mass beside the beam's axis, and a hub's along and beside it
    '<site name="tip" pos="0.03469 0 0"/>',
    '<site name="tip" pos="0.03469 0 0"/><body name="aside" pos="0.02 0.03 0">'
    '<inertial pos="0.01 0 0" mass="0.03" diaginertia="1e-5 1e-5 2e-5"/></body>',
    edited(
        '<inertial pos="0 0 0" mass="0.47"', '<inertial pos="0.02 -0.01 0" mass="0.47"', DEFAULT
    ),
)
EULER = edited('integrator="RK4"', 'integrator="Euler"', EDITS["damped"])
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
    "Euler, armatures": EULER.replace('armature="0"', 'armature="0.01"'),
    "springs at the joints": edited(
        '<joint name="joint1"', '<joint name="joint1" stiffness="2"'
    ).replace('<joint name="joint2"', '<joint name="joint2" stiffness="0.3"'),
    "a joint's armature in the beam": edited(
        '<joint name="hinge3"', '<joint name="hinge3" armature="1e-4"'
    ),
    "inertia turned": edited(
        '<inertial pos="0 0 0" mass="0.47" ', '<inertial pos="0 0 0" mass="0.47" euler="0.3 0.2 0" '
    ).replace('diaginertia="0.001322 0.001322 0.001322"', 'diaginertia="0.001 0.0012 0.0015"'),
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


def apart(chain: ChainModel, start: Array, torques: Array) -> tuple[float, float, float]:
    """Return how far the closed form's angles are from MuJoCo's, MuJoCo's from those of a run of
    its own a hair aside, and how far they moved [rad]."""
    m = chain.model.nq
    hair = np.zeros_like(start)
    hair[:m] = HAIR
    own, beside = moved(chain.model, start, torques), moved(chain.model, start + hair, torques)
    ours = by_equations(ClosedChainPlant(Parameters(), chain), start, torques)
    away = np.abs(own - start)[:m].max()
    return np.abs(own - ours)[:m].max(), np.abs(own - beside)[:m].max(), away


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", FILES)
def test_it_moves_as_mujoco_does(name: str, seed: int) -> None:
    chain = load_chain(text=FILES[name])
    found, _, away = apart(chain, *started(chain.model.nq, seed))
    assert found < AGREES
    assert away > MOVED


@pytest.mark.parametrize("name", FILES)
def test_it_parts_from_mujoco_no_faster_than_mujoco_from_itself(name: str) -> None:
    chain = load_chain(text=FILES[name])
    start, torques = started(chain.model.nq, 7)
    start[chain.model.nq :] *= VIOLENT
    found, itself, _ = apart(chain, start, np.tile(torques, (8, 1)))
    assert found < NO_FASTER * max(itself, HAIR)


def test_whatever_is_done_to_a_file() -> None:
    """Its closed form moves as MuJoCo moves it, or is refused; gentle, as a light arm flies."""
    rng, tried = np.random.default_rng(3), 0
    texts = [path.read_text() for path in MODELS]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for i in range(RANDOM):
            done, text = random_edit(rng, texts[i % len(texts)])
            try:
                chain = load_chain(text=text)
                ClosedChainPlant(Parameters(), chain)
            except FlexsimError:
                continue
            start, torques = started(chain.model.nq, i)
            felt = min(1.0, float(mass_matrix(chain.model, start[: chain.model.nq])[1, 1]) / HUB)
            with quiet_warnings():
                found, itself, _ = apart(chain, start, torques * felt)
            assert found < max(AGREES, NO_FASTER * itself), done
            tried += 1
    assert tried > FEWEST * RANDOM


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
    short = edited('timestep="0.001"', 'timestep="0.0005"')
    chain = load_chain(text=edited(old, new, short))
    with pytest.raises(ModelError, match=named):
        ClosedChainPlant(Parameters(), chain)


def test_a_robot_has_it_by_name_and_its_loops_are_the_chains() -> None:
    """Without friction, where no rounding is amplified."""
    robot, ideal = Robot(), setting("none")
    chain, closed = robot.plant("chain", ideal), robot.plant("closed-chain:6", ideal)
    assert isinstance(closed, ChainPlant) and closed.name == "closed-chain:6"
    circle = reference(trajectory("circle"), robot.parameters)
    filters = [TUNED_IDEAL["circle"].filters(1e-3)]
    index = [evaluate(plant, ideal, circle, filters).indices[0] for plant in (chain, closed)]
    assert index[1] == pytest.approx(index[0], rel=1e-9)
