"""Does the nonlinear simulation do near rest what the linear loop says? Its growth, measured."""

from __future__ import annotations

import math

import numpy as np

from flexsim.arm.kinematics import tip_position
from flexsim.linear.controller_space import controller_states
from flexsim.linear.loop_poles import LinearLoop, LoopOptions
from flexsim.loop.compiled_loop import Outcome
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.friction import Friction
from flexsim.loop.populations import Stage, run_population
from flexsim.loop.runs import loop_of
from flexsim.loop.settings import Setting
from flexsim.loop.trajectories import Reference
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant

OFFSET = 1e-7  # [rad] initial error: nonlinear terms are smaller by as much
GROWN = 1e3  # the most a motion may grow by while it is measured
LONGEST = 2.0  # [s]
OUTGROWN = 10.0  # times the initial error: no decaying motion is so large so late


def linear_friction(options: LoopOptions) -> Friction:
    """Return friction without dead zone and offset: a torque gain or a viscous one per joint."""
    none = ((0.0, 0.0), (0.0, 0.0))
    law, slope = ("jump", options.torque_gain)
    if any(options.joint_damping):
        law, slope = ("opposing", options.joint_damping)
    return Friction(law, dead_zone=none, tau_0=(0.0, 0.0), mu=slope)


def still(plant: Plant, theta2: float, period: float, samples: int, offset: float) -> Reference:
    """Return a reference that stands at (0, theta2) but for its first sample, `offset` away.

    A run starts at rest on the first sample, so this is a run with an initial error.
    """
    joint = np.tile([0.0, theta2], (samples, 1))
    joint[0] += offset
    tip = tip_position(plant.parameters, joint)
    return Reference(period * np.arange(samples, dtype=float), tip, joint)


def simulated_errors(
    plant: Plant,
    theta2: float,
    controllers: Controllers,
    options: LoopOptions,
    samples: int,
    offset: float = OFFSET,
) -> Outcome:
    """Return the outcome, every sample recorded, of P loops with an initial error.

    Args:
        controllers: P of them. samples: K. offset: of both joints [rad].
    """
    ref = still(plant, theta2, options.period, samples, offset)
    chosen = Setting("linear", linear_friction(options), "a torque gain per joint")
    loop = loop_of(plant, ref, v_gain=options.v_gain)
    start = plant.rest_state(ref.joint[0])
    stage = Stage(plant, chosen.friction.numbers(), loop, start, options.hardware.linear)
    return run_population(stage, controllers, stride=1)


def simulated_growth(plant: Plant, loop: LinearLoop, options: LoopOptions) -> float | None:
    """Return the rate at which the dominant mode grows in the nonlinear simulation [1/s].

    The motion after a tiny initial error is projected on the linear loop's dominant left
    eigenvector; if the linear model holds, that is one exponential, else it is none at all.

    Args:
        plant: any. loop: 'stepped'. options: as the loop has them.

    Returns:
        The fitted rate; None where both a torque gain and joint damping are given, which no law of
        friction has.
    """
    if any(options.joint_damping) and options.torque_gain != (1.0, 1.0):
        return None
    rate = max(abs(loop.growth_rate), 1e-9)
    order = len(loop.matrix) - len(loop.sampled.A)
    samples = round(min(LONGEST, math.log(GROWN) / rate) / options.period) + order
    theta2 = loop.sampled.linear.theta2
    ran = simulated_errors(plant, theta2, loop.controllers, options, samples)
    deviation = loop.sampled.linear.state(ran.states[0]).copy()
    deviation[:, 1] -= theta2
    behind = np.hstack([deviation, loop.sampled.motor_states(ran.torques[0])])
    memory = loop.sampled.memory_states(behind, ran.torques[0])
    measured = np.column_stack([ran.errors[0], ran.measured[0, :, 2]])
    delays = controller_states(loop.controllers, measured)
    values, vectors = np.linalg.eig(loop.matrix.T)
    left = vectors[:, np.argmax(np.abs(values))]
    size = np.log(np.abs(np.hstack([behind, memory, delays]) @ left))[1:]
    return float(np.polyfit(options.period * np.arange(len(size)), size, 1)[0])


def simulated_rates(
    plant: Plant, theta2: float, controllers: Controllers, options: LoopOptions, samples: int
) -> Array:
    """Return how fast the joint errors grow (P,) [1/s] in a simulation; no linear model enters.

    From the last but one quarter of the run to the last, or, for errors that outgrew the initial
    one and may have stopped growing for nonlinear reasons, from the start; inf if diverged.
    """
    errors = simulated_errors(plant, theta2, controllers, options, samples).errors
    quarter = samples // 4
    parts = [errors[:, -2 * quarter : -quarter], errors[:, -quarter:]]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        size = [np.sqrt(np.mean(part**2, axis=(1, 2))) for part in parts]
        rates = np.log(size[1] / size[0]) / (quarter * options.period)
        overall = np.log(size[1] / OFFSET) / (samples * options.period)
        rates = np.where(size[1] > OUTGROWN * OFFSET, np.maximum(rates, overall), rates)
    return np.where(np.isfinite(errors).all(axis=(1, 2)), rates, np.inf)
