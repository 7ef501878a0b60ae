"""The numbers of a linear model that controllers are designed on, of any plant and hardware.

    >>> from controllers.model_based import LinearModel, lqg
    >>> model = LinearModel(*model_of(plant, 1.2, HARDWARE["bench"]))
    >>> controller = lqg.design(knobs, model)          # for a loop whose v_gain is 0

Of the plant handed in, with its number of modes: whoever wants a design on fewer hands in a plant
of fewer. The friction of a setting is not in it unless it is given; of strain bridges their filter
and estimator are, but not their noise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexsim.linear.loop_poles import LoopOptions, sampled_plant
from flexsim.loop.hardware import IDEAL, Hardware
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.linear_plant import LinearPlant

NOISE_LEAST = 1e-6  # [rad], [m] rms: what exact measurements count as
UNIFORM = np.sqrt(12.0)  # a step over the rms of what rounding to steps leaves


class DesignNumbers(NamedTuple):
    """A sampled arm, in the order of `controllers.model_based.LinearModel`; n states.

    A (n, n), B (n, 2) from commanded torques [N m], C (3, n) to theta1, theta2 [rad] and v [m];
    period [s]; reach r + L [m]; J (2, 2) inertia with the beam rigid [kg m2]; E (n, 2) what a
    period of each joint's unit acceleration, of the whole arm rigidly, adds to the states; noise
    (3,) rms of the measurements of theta1, theta2 [rad] and v [m].
    """

    A: Array
    B: Array
    C: Array
    period: float
    reach: float
    J: Array
    E: Array
    noise: Array


def model_of(
    plant: Plant,
    theta2: float,
    hardware: Hardware = IDEAL,
    period: float = PERIOD,
    torque_gain: tuple[float, float] = (1.0, 1.0),
    joint_damping: tuple[float, float] = (0.0, 0.0),
) -> DesignNumbers:
    """Return the plant about rest at theta2 [rad], sampled, with what a design needs to know.

    Args:
        hardware: whose delay and lags are states, and whose counts and noise are the noise.
        period: [s]. torque_gain, joint_damping: of friction, see `LoopOptions`.

    Raises:
        ParameterError: theta2, the period or an option cannot be used.
    """
    options = LoopOptions(period, 0.0, torque_gain, joint_damping, hardware=hardware.linear)
    sampled = sampled_plant(plant, theta2, options)
    C = np.array([-1.0, -1.0, 1.0])[:, None] * sampled.C  # errors are less the angles
    turned, J = rigid(sampled.linear)
    E = np.zeros((len(sampled.A), 2))
    m = len(turned)
    E[:m], E[m : 2 * m] = turned * period**2 / 2, turned * period
    counts = np.array([*hardware.quanta, 0.0]) / UNIFORM
    noise = np.maximum(np.hypot(counts, [0.0, 0.0, hardware.noise_v]), NOISE_LEAST)
    return DesignNumbers(sampled.A, sampled.B, C, period, sampled.reach, J, E, noise)


def rigid(linear: LinearPlant) -> tuple[Array, Array]:
    """Return the rigid motions (m, 2) of a unit of each joint's angle, and the inertia J (2, 2).

    J takes both joints' accelerations [rad/s2] to the torques at the motors [N m].
    """
    free = np.linalg.svd(linear.K)[2][-2:].T  # (m, 2): what no spring resists
    turned = free @ np.linalg.inv(linear.C[:2, : len(linear.M)] @ free)
    J = np.linalg.solve(turned.T @ linear.S, turned.T @ linear.M @ turned)
    return turned, J
