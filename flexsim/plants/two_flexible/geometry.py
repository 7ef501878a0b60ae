"""Where two bent links are: points in their hubs' frames, put into the world.

>>> link1, beam = in_world(theta, first, second)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexsim.numerics.elementary import cos, sin
from flexsim.numerics.types import Array


class Bent(NamedTuple):
    """Points of a link in its hub's frame: along and across (K, P) [m]; its end's turn (K,) [rad].

    The last point is the end.
    """

    along: Array
    across: Array
    turned: Array


def in_world(theta: Array, first: Bent, second: Bent) -> tuple[Array, Array]:
    """Return the points of both links (K, P1, 2), (K, P2, 2) in the world [m].

    Args:
        theta: (K, 2) joint angles [rad]. first, second: links 1 and 2.
    """
    one = _turned(theta[:, 0], first)
    two = _turned(theta[:, 0] + first.turned + theta[:, 1], second)
    return one, one[:, -1:] + two


def _turned(angle: Array, link: Bent) -> Array:
    c, s = cos(angle)[:, None], sin(angle)[:, None]
    return np.stack([c * link.along - s * link.across, s * link.along + c * link.across], axis=-1)
