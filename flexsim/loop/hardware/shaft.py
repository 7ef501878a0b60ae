"""Backlash: a motor with an inertia of its own, an elastic shaft with a gap, then the joint.

J phi'' = tau - T, T = k (phi - theta -+ gap/2) + d (phi' - theta') where they touch, 0 in the gap
and wherever the shaft would pull: with damping the plain dead-zone model does, and must not
(Nordin, Galic and Gutman 1997). The torque of a step is that of its middle, to which both sides are
moved at the rates of its start, and is held, as the plant holds it: position Verlet for motor and
joint together, symplectic without damping, of second order, stable for
k h^2 (1/J + 1/J_joint) < 4.

The gear is taken as 1: motors' numbers are at the joints.
"""

from __future__ import annotations

from flexsim.loop.hardware.effects import HALF_GAP, MOTOR_INERTIA, SHAFT, SHAFT_DAMPING
from flexsim.loop.hardware.memory import ANGLE, RATE
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array


@jit
def touching(twist: float, rate: float, half_gap: float, k: float, damping: float) -> float:
    """Return the torque of a shaft behind a gap [N m]; it never pulls.

    Args:
        twist, rate: of the motor against the joint [rad], [rad/s].
    """
    if twist > half_gap:
        return max(k * (twist - half_gap) + damping * rate, 0.0)
    if twist < -half_gap:
        return min(k * (twist + half_gap) + damping * rate, 0.0)
    return 0.0


@jit
def shaft_torque(row: Array, memory: Array, h: float, tau: float, theta: float, w: float) -> float:
    """Return the torque that a shaft gives its joint over a step [N m]; the motor moves on.

    Args:
        row: of `EffectNumbers.per_joint`. memory: of the joint. h: physics step [s].
        tau: at the motor, held [N m]. theta, w: of the joint [rad], [rad/s].
    """
    rate = memory[RATE]
    twist = memory[ANGLE] + h / 2 * rate - (theta + h / 2 * w)
    T = touching(twist, rate - w, row[HALF_GAP], row[SHAFT], row[SHAFT_DAMPING])
    acceleration = (tau - T) / row[MOTOR_INERTIA]
    memory[ANGLE] += h * rate + h * h / 2 * acceleration
    memory[RATE] = rate + h * acceleration
    return T
