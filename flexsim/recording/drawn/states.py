"""Does a joint move, and does the motor's torque reach it? Dead zone and stick-slip over time.

>>> states = joint_states(friction, motion)              # (K, 2) indices into STATES
>>> at, shown = frames_of(states[:, 0], every=20)        # by frames, as lanes show them
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexsim.loop.friction import RESISTING, Friction
from flexsim.loop.motion import Motion
from flexsim.numerics.types import Array
from flexsim.recording.colours import Colour

STATES = ("driven", "dead zone", "sticks", "switches", "diverged")
KEY = "blue: driven · pink: dead zone · grey: sticks · green: switches"
STATE_COLOURS: tuple[Colour, ...] = (
    (0, 114, 178),
    (204, 121, 167),
    (120, 124, 130),
    (0, 158, 115),
    (213, 94, 0),
)
DRIVEN, DEAD_ZONE, STICKS, SWITCHES, DIVERGED = range(len(STATES))
REST = 0.01  # [rad/s] below which a joint counts as at rest; for display only


def joint_states(friction: Friction, motion: Motion) -> NDArray[np.int64]:
    """Return what each joint does at every sample, (K, 2) indices into STATES.

    Driven: the torque is beyond the dead zone. Sticks: it is not, and the joint is at rest; under
    laws that oppose motion also where Coulomb friction holds the joint.
    """
    speed = np.abs(rates(motion))
    limit = np.array(friction.torque_limit)
    torque = np.clip(motion.applied, -limit, limit)
    (low, high) = np.array(friction.dead_zone).T
    inside = (low < torque) & (torque < high)
    held = inside
    if friction.law in RESISTING:
        held = inside | (np.abs(torque) <= np.array(friction.tau_0))
    return np.where(held & (speed < REST), STICKS, np.where(inside, DEAD_ZONE, DRIVEN))


def rates(motion: Motion) -> Array:
    """Return the joints' velocities, (K, 2) [rad/s]."""
    half = motion.state.shape[1] // 2
    return motion.state[:, half : half + 2]


def frames_of(states: NDArray[np.int64], every: int) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
    """Return the samples at which a joint's state changes, by frames, and the states from then on.

    A frame of several states is SWITCHES: a lane of single milliseconds cannot be read.

    Args:
        states: (K,). every: samples of a frame.
    """
    starts = np.arange(0, states.size, every)
    if not starts.size:
        return starts, states
    least, most = np.minimum.reduceat(states, starts), np.maximum.reduceat(states, starts)
    shown = np.where(least == most, least, SWITCHES)
    changed = np.concatenate([[0], 1 + np.flatnonzero(np.diff(shown))])
    return starts[changed], shown[changed]
