"""What helps a reference: the rigid arm's torque, a pulse; and what a push leaves behind."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flexsim import (
    ParameterError,
    Parameters,
    Reference,
    closed_loop,
    drive,
    reference,
    setting,
)
from flexsim.linear.pushed import pushed
from flexsim.loop.trajectories import TRAJECTORIES
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.shaping.aids import AIDS, aided, pulsed, rigid_torque

STIFF = Parameters(EI=1e5)
NOTHING = (np.zeros(1), np.ones(1))
IMPULSE = 0.02  # [N s]


@pytest.fixture(scope="module")
def path() -> Reference:
    return reference(replace(TRAJECTORIES["line"], duration=1.0, hold=0.2), Parameters())


def test_without_a_controller_the_rigid_arm_follows_its_torque(path: Reference) -> None:
    """Open loop: nothing but the torque; on a stiff beam the joints end where they should."""
    plant = AssumedModesPlant(STIFF, modes=1, step=2e-5)
    helped = rigid_torque(reference(_short(), STIFF), plant)
    motion, *_ = closed_loop(plant, setting("none"), helped, [(NOTHING, NOTHING)], energy=False)
    np.testing.assert_allclose(motion.joint[-1], helped.joint[-1], atol=2e-3)
    still = replace(helped, torque=None)
    alone, *_ = closed_loop(plant, setting("none"), still, [(NOTHING, NOTHING)], energy=False)
    assert np.abs(alone.joint[-1] - helped.joint[-1]).max() > 0.05  # negative control


def _short():  # type: ignore[no-untyped-def]
    return replace(TRAJECTORIES["line"], duration=0.5, hold=0.0)


def test_a_pulse_is_added_where_it_is_told(path: Reference) -> None:
    once = pulsed(path, (0.5, -0.1), (0.3, 0.35))
    twice = pulsed(once, (0.5, -0.1), (0.3, 0.35))
    assert once.torque is not None and twice.torque is not None
    inside = (path.time >= 0.3) & (path.time < 0.35)
    np.testing.assert_array_equal(once.torque[inside], np.tile((0.5, -0.1), (inside.sum(), 1)))
    assert not once.torque[~inside].any()
    np.testing.assert_array_equal(twice.torque, 2 * once.torque)
    with pytest.raises(ParameterError, match=r"from 1 to 9 s; give a span within the traj"):
        pulsed(path, (1.0, 0.0), (1.0, 9.0))


def test_an_unknown_aid_is_named(modes_plant: AssumedModesPlant, path: Reference) -> None:
    with pytest.raises(ParameterError, match="aid 'zz' is unknown; choose one of plain"):
        aided(path, modes_plant, "zz", 0.0)
    assert aided(path, modes_plant, "plain", 0.0) is path
    assert set(AIDS) >= {"plain", "true-tip", "feedforward"}


def test_a_push_gives_the_momentum_that_it_has(plant: Plant) -> None:
    """About joint 1: all of the arm's angular momentum is the push's, lever times impulse."""
    theta2 = 1.1
    p, m = plant.parameters, len(plant.rest_state((0.3, theta2))) // 2
    rates = pushed(plant, (0.3, theta2), IMPULSE)[m:]
    momentum = plant.linearised(theta2).M @ rates
    assert momentum[0] == pytest.approx(IMPULSE * (p.L_R * math.cos(theta2) + p.reach), rel=1e-9)
    assert momentum[1] == pytest.approx(IMPULSE * p.reach, rel=1e-9)
    assert not pushed(plant, (0.3, theta2), 0.0)[m:].any()


def test_both_plants_move_alike_after_a_push(
    modes_plant: AssumedModesPlant, chain_plant: ChainPlant
) -> None:
    """Whatever of it goes into modes that one of them lacks: joints, 0.3 s later, within 2 %."""
    ends = [
        drive(
            plant,
            setting("none"),
            np.zeros((300, 2)),
            state=pushed(plant, (0.3, 1.1), IMPULSE),
            look=False,
        ).joint[-1]
        for plant in (AssumedModesPlant(modes_plant.parameters, modes=5), chain_plant)
    ]
    moved = np.array(ends) - (0.3, 1.1)
    np.testing.assert_allclose(moved[0], moved[1], rtol=0.02, atol=2e-3)
    assert np.abs(moved).max() > 0.02


def test_a_push_that_is_no_number_is_refused(modes_plant: AssumedModesPlant) -> None:
    with pytest.raises(ParameterError, match="a push is inf N s; give a finite number"):
        pushed(modes_plant, (0.0, 1.0), math.inf)
