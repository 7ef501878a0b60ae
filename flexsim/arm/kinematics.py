"""The rigid arm's kinematics: two links of L_R and r + L, theta1 absolute, theta2 relative.

Elbow-up is the branch with theta2 > 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.elementary import arctan2, cos, sin
from flexsim.numerics.types import Array

SINGULAR_MARGIN = (
    1e-3  # sin(theta2) below this: the Jacobian's determinant is L_R (r+L) sin(theta2)
)


def tip_position(
    parameters: Parameters, theta: ArrayLike, v: ArrayLike = 0.0, shortening: ArrayLike = 0.0
) -> Array:
    """Return the tip's position (..., 2) [m].

    Args:
        parameters: the robot.
        theta: (..., 2) joint angles [rad].
        v: (...) tip deflection across the undeformed beam [m].
        shortening: (...) tip displacement along it, 0 or negative [m].
    """
    th = np.asarray(theta, dtype=float)
    first, second = th[..., 0], th[..., 0] + th[..., 1]
    along, across = parameters.reach + np.asarray(shortening), np.asarray(v)
    return np.stack(
        [
            parameters.L_R * cos(first) + along * cos(second) - across * sin(second),
            parameters.L_R * sin(first) + along * sin(second) + across * cos(second),
        ],
        axis=-1,
    )


def joint_angles(parameters: Parameters, tip: ArrayLike, positive_elbow: bool = True) -> Array:
    """Return the joint angles (K, 2) that put the rigid arm's tip there [rad], continuous in K.

    Args:
        parameters: the robot.
        tip: (K, 2) positions [m].
        positive_elbow: the branch with theta2 > 0; otherwise theta2 < 0.

    Raises:
        ParameterError: a point is out of reach, or at a singular pose (arm straight or folded);
            the message names the point.
    """
    xy = np.atleast_2d(np.asarray(tip, dtype=float))
    if xy.ndim != 2 or xy.shape[1] != 2:
        raise ParameterError(f"tip positions have shape {xy.shape}; give (K, 2) [m]")
    l1, l2 = parameters.L_R, parameters.reach
    squared = np.sum(xy * xy, axis=-1)
    cosine = (squared - l1 * l1 - l2 * l2) / (2 * l1 * l2)
    sine = np.sqrt(np.maximum(1 - cosine * cosine, 0.0))
    bad = ~(np.isfinite(cosine) & (np.abs(cosine) <= 1) & (sine >= SINGULAR_MARGIN))
    if bad.any():
        first = int(np.argmax(bad))
        x, y = xy[first]
        what = "at a singular pose" if np.abs(cosine[first]) < 1 + 1e-9 else "out of reach"
        raise ParameterError(
            f"reference point {first} at ({x:.4g}, {y:.4g}) m is {what}; keep its distance from "
            f"joint 1 between {abs(l1 - l2):.4g} and {l1 + l2:.4g} m, ends excluded"
        )
    theta2 = arctan2(sine if positive_elbow else -sine, cosine)
    theta1 = arctan2(xy[..., 1], xy[..., 0]) - arctan2(l2 * sin(theta2), l1 + l2 * cos(theta2))
    return np.stack([np.unwrap(theta1), theta2], axis=-1)


def in_world(L_R: float, theta: Array, along: Array, across: Array) -> Array:
    """Return world positions (K, P, 2) [m] of points given in the hub's frame (K, P)."""
    first, second = theta[:, :1], theta[:, :1] + theta[:, 1:2]
    return np.stack(
        [
            L_R * cos(first) + along * cos(second) - across * sin(second),
            L_R * sin(first) + along * sin(second) + across * cos(second),
        ],
        axis=-1,
    )
