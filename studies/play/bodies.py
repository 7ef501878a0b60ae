"""The two arms that move: what is pushed, laden and damped while it does.

    >>> body = MujocoBody(robot.chain_plant(setting))
    >>> state = body.change(payload=0.05, damping=1.0, state=state)

Each has a plant as the rest of the project knows it, for looking at and linearising, and
coefficients for compiled code. A change makes a new plant; the old one stays what it was.
"""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from flexsim.errors import ModelError, ParameterError
from flexsim.mjcf.chain_file import mass_matrix, motor_matrix
from flexsim.mjcf.edits import changed
from flexsim.numerics.dense import product, solve
from flexsim.numerics.mujoco_c import quiet_warnings
from flexsim.numerics.step_limits import POSES, longest_step
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.rod_plant import RodPlant
from flexsim.plants.stepped import stepped
from studies.play.laden import carried_over, laden
from studies.play.periods import Push
from studies.play.pushes import Point, body_of, place_of, push_on_modes


class ModesBody:
    """The assumed-modes arm.

    Attributes:
        plant: as it is now. coefficients: for compiled code.
    """

    every_period = False  # whether a push must be set anew for each period

    def __init__(self, plant: AssumedModesPlant, model: mujoco.MjModel) -> None:
        """Take a plant, and the MuJoCo model whose bodies pushes are said to act on."""
        self._base, self._model = plant, model
        self.plant = laden(plant, 0.0, 1.0)
        self.coefficients: Any = self.plant.coefficients
        self.no_push = push_on_modes(self.plant, None, (0.0, 0.0), 0.0)

    def prepared(self, payload: float, damping: float) -> Plant:
        """Return the plant with a payload [kg] and its damping times a factor."""
        return laden(self._base, payload, damping)

    def take(self, plant: Any, state: Array) -> Array:
        """Become a plant of `prepared`; return the state that the motion goes on from."""
        before, self.plant, self.coefficients = self.plant, plant, plant.coefficients
        return state if before.load == plant.load else carried_over(before, plant, state)

    def push(self, point: Point, force: tuple[float, float], torque: float, state: Array) -> Push:
        """Return a push as compiled code takes it."""
        return push_on_modes(self.plant, place_of(self._model, point), force, torque)

    def release(self) -> Push:
        """Return no push."""
        return self.no_push


class MujocoBody:
    """MuJoCo's arm, a chain or a rod; attributes as of `ModesBody`."""

    every_period = True

    def __init__(self, plant: ChainPlant | RodPlant) -> None:
        """Take a plant.

        Raises:
            ParameterError: it is not one that MuJoCo steps.
        """
        if type(plant) not in (ChainPlant, RodPlant):
            raise ParameterError(
                f"plant {plant.name!r} is not MuJoCo's; choose chain, chain:N, untuned, "
                "rule-of-thumb or rod"
            )
        self._base = self.plant = plant
        self._enter(plant)
        self.no_push = push_on_modes(laden(AssumedModesPlant(), 0.0, 1.0), None, (0.0, 0.0), 0.0)

    def _enter(self, plant: ChainPlant | RodPlant) -> None:
        """Step this plant from now on, in an mjData of our own, where pushes are put."""
        self.plant = plant
        self._model = stepped(plant.model, plant.mjcf)
        self._data = mujoco.MjData(self._model)
        own = {"model": self._model._address, "data": np.array([self._data._address])}
        with plant.running(1) as given:
            self.coefficients: Any = given._replace(**own)

    def prepared(self, payload: float, damping: float) -> Plant:
        """Return the plant with a payload [kg] and its damping times a factor.

        Raises:
            ParameterError: it is a rod, whose numbers are its own.
        """
        base = self._base
        if isinstance(base, RodPlant):
            if payload or damping != 1.0:
                raise ParameterError(
                    "a rod's payload and damping cannot change while it moves; give a chain"
                )
            return base
        chain = base.chain
        if payload:
            chain = changed(chain, payload=payload)
        if damping != 1.0:
            model = copy.copy(chain.model)
            model.dof_damping[2:] *= damping
            chain = replace(chain, model=model)
        return replace(base, chain=chain)

    def take(self, plant: Any, state: Array) -> Array:
        """Become a plant of `prepared`; return the state that the motion goes on from.

        A load that was at rest is picked up at constant generalised momenta, one that is let go
        takes its own along; positions stay.
        """
        before = self.plant.model
        self._enter(plant)
        after, m = self.plant.model, len(state) // 2
        if after.body_mass.sum() <= before.body_mass.sum():
            return state
        q = state[:m]
        momentum = product(mass_matrix(before, q), state[m:])
        return np.concatenate([q, solve(mass_matrix(after, q), momentum)])

    def push(self, point: Point, force: tuple[float, float], torque: float, state: Array) -> Push:
        """Put a push on the point where it is now; return what compiled code takes: nothing."""
        model, data = self._model, self._data
        body = body_of(model, point)
        data.qpos[:] = state[: model.nq]
        with quiet_warnings():
            mujoco.mj_kinematics(model, data)
        lever = data.xpos[body] + product(data.xmat[body].reshape(3, 3), point.at)
        lever -= data.xipos[body]
        fx, fy = force
        data.xfrc_applied[:] = 0.0
        data.xfrc_applied[body, :2] = fx, fy
        data.xfrc_applied[body, 5] = lever[0] * fy - lever[1] * fx + torque
        return self.no_push

    def release(self) -> Push:
        """Take the push away."""
        self._data.xfrc_applied[:] = 0.0
        return self.no_push


def require_stable(plant: Plant, slopes: tuple[float, float]) -> None:
    """Refuse a plant that its integrator cannot step, as far as it can be linearised.

    Args:
        slopes: of what is held over a step, see `flexsim.loop.settings.held_slopes`.

    Raises:
        ParameterError: its step is too long for its damping, or for friction held over a step.
    """
    try:
        linear = [plant.linearised(float(pose)) for pose in POSES]
    except ModelError:
        return
    motions = [(each.M, each.D, each.K) for each in linear]
    held = np.zeros_like(linear[0].D)
    gears = np.diag(linear[0].S[:2]) if plant.model is None else np.diag(motor_matrix(plant.model))
    held[[0, 1], [0, 1]] = slopes * gears[:2]
    longest = longest_step(plant.integrator, motions, held if held.any() else None)
    if plant.step >= longest:
        raise ParameterError(
            f"the {plant.name} plant's step of {plant.step:g} s is too long for this; it takes "
            f"less than {longest:.3g} s: start with it, and the step is chosen to suit"
        )
