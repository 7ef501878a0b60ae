"""Where individuals of a tuning are simulated, and where their exact linear loops may not grow.

>>> robot = robot_of(tuning)
>>> scenarios_of(tuning, robot)    # plants, each with its setting and hardware
>>> exact_of(tuning, robot)        # exact linear loops, none unless asked for
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.linear.exact_loop import NO_FRICTION, exact_loops
from flexsim.linear.loop_poles import SampledPlant, small_signal
from flexsim.loop.friction import Friction
from flexsim.loop.settings import Setting, setting
from flexsim.mjcf.reading.names import Names
from flexsim.plants.base import Plant
from flexsim.robot import Robot
from flexsim.robot.named import robot_named
from studies.tuning.tuning import Tuning

PERTURBATION_STREAM = (0, 1)  # of the seed; generations use (0,), (1,), ...


class Perturbation(NamedTuple):
    """Factors of EI, rho and friction, and the payload at the tip [kg]."""

    stiffness: float
    density: float
    friction: float
    payload: float


def perturbations(tuning: Tuning) -> list[Perturbation]:
    """Return what perturbed robots differ by, even between the bounds that a tuning gives.

    One factor for all of Table 4's friction: dead zones, Coulomb friction and slopes.
    """
    rng = np.random.default_rng(np.random.SeedSequence(tuning.seed, spawn_key=PERTURBATION_STREAM))
    spread, most = tuning.perturb_spread, tuning.perturb_payload
    found = []
    for _ in range(tuning.perturb):
        stiffness, density, friction = (float(x) for x in 1 + rng.uniform(-spread, spread, 3))
        found.append(Perturbation(stiffness, density, friction, float(rng.uniform(0, most))))
    return found


def _scaled(friction: Friction, factor: float) -> Friction:
    """Return friction with its dead zones, Coulomb friction and slopes times a factor."""
    (low_1, high_1), (low_2, high_2) = friction.dead_zone
    return replace(
        friction,
        dead_zone=((factor * low_1, factor * high_1), (factor * low_2, factor * high_2)),
        tau_0=(factor * friction.tau_0[0], factor * friction.tau_0[1]),
        mu=(factor * friction.mu[0], factor * friction.mu[1]),
    )


def scenarios_of(tuning: Tuning, robot: Robot) -> tuple[tuple[Plant, Setting], ...]:
    """Return the plants that a tuning asks for, the nominal robot's first, with their settings.

    Raises:
        ParameterError, ModelError: modes or segments out of range, or a robot without such a plant.
    """
    nominal = setting(tuning.setting)
    robots = [(each, nominal) for each in loaded(tuning, robot)]
    for each in perturbations(tuning):
        other = robot.changed(each.stiffness, each.density, each.payload)
        robots.append((other, replace(nominal, friction=_scaled(nominal.friction, each.friction))))
    return tuple(
        (plant, replace(its, hardware=hardware))
        for each, its in robots
        for plant in (
            each.plant(name, its, tuning.modes, tuning.segments) for name in tuning.plants
        )
        for hardware in tuning.built
    )


def loaded(tuning: Tuning, robot: Robot) -> list[Robot]:
    """Return the robot with each of the tuning's payloads."""
    return [robot.changed(1.0, 1.0, each) if each else robot for each in tuning.payloads]


def exact_of(tuning: Tuning, robot: Robot) -> tuple[SampledPlant, ...]:
    """Return the exact linear loops in which a tuning's individuals may not grow; none unasked.

    With every payload and hardware, at `EXACT_POSES`, without friction and with its slopes; and
    with the beam's EI less and more, and with another payload, if so asked.

    Raises:
        ParameterError: a robot whose beam is not that of the equations.
    """
    if not tuning.exact:
        return ()
    if robot.given is not None or robot.modal_damping:
        what = "--modal-damping" if robot.modal_damping else "--mjcf"
        raise ParameterError(
            f"--exact and {what} contradict each other: the exact linear loop has a uniform beam "
            "with --robot.zeta; leave one out"
        )
    own = setting(tuning.setting)
    slopes = tuple(dict.fromkeys((NO_FRICTION, small_signal(own.friction))))
    spread, more = tuning.exact_spread, tuning.exact_payload
    robots = loaded(tuning, robot)
    robots += [robot.changed(1 + each, 1.0, 0.0) for each in (-spread, spread) if each]
    robots += [robot.changed(1.0, 1.0, more)] if more else []
    linear = dict.fromkeys(each.linear for each in tuning.built)
    return tuple(
        loop
        for each in robots
        for hardware in linear
        for loop in exact_loops(
            own.applied(each.parameters),
            slopes=slopes,
            period=tuning.period,
            hardware=hardware,
            v_gain=tuning.v_gain,
            link1=each.link1,
        )
    )


def robot_of(tuning: Tuning) -> Robot:
    """Return the robot that a tuning names.

    Raises:
        ParameterError, ModelError: its file cannot be used.
    """
    names = Names(**{item.name: getattr(tuning, item.name) for item in fields(Names)})
    own = tuning.robot if tuning.mjcf is None or tuning.robot != Parameters() else None
    if tuning.arm != "paper":
        unusual = None if tuning.robot == Parameters() else tuning.robot
        damping = tuning.modal_damping
        return robot_named(tuning.arm, tuning.mjcf, unusual, tuning.beam, damping, names)
    return Robot.of(tuning.mjcf, tuning.beam, own, names=names, modal_damping=tuning.modal_damping)
