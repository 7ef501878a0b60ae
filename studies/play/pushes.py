"""Where a push acts: one material point, on MuJoCo's body and on the assumed-modes arm.

    >>> at = tip_point(model)
    >>> push_on_modes(plant, place_of(model, at), (0.0, 1.0), 0.0)

A point is one of a body of the MJCF. On the assumed modes it is the one at the same place of the
straight arm: of the rigid link, or of hub and beam at the same length along it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from flexsim.arm.beam import load_of, mode_shapes
from flexsim.errors import ParameterError
from flexsim.mjcf.reading.geometry import straight
from flexsim.numerics.dense import product
from flexsim.numerics.quadrature import gauss_legendre
from flexsim.numerics.types import Array
from flexsim.plants.chain_as_modes import vibration
from studies.play.laden import LadenModes
from studies.play.periods import BEAM, LINK, NOWHERE, Push

QUADRATURE = 48  # points, exact to rounding for the shortening of a dozen modes


@dataclass(frozen=True)
class Point:
    """A material point: a body by its name or number, and where in its frame [m]."""

    body: str | int
    at: tuple[float, float, float]


@dataclass(frozen=True)
class Place:
    """The same of the straight arm: on LINK or BEAM, along and across from its joint [m]."""

    part: int
    along: float
    across: float


def tip_point(model: mujoco.MjModel) -> Point:
    """Return the tip."""
    site = model.site("tip")
    body = int(site.bodyid[0])
    x, y, z = (float(value) for value in site.pos)
    return Point(model.body(body).name or body, (x, y, z))


def body_of(model: mujoco.MjModel, point: Point) -> int:
    """Return the number of a point's body.

    Raises:
        ParameterError: there is no such body, or it does not move.
    """
    try:
        body = int(model.body(point.body).id)
    except (KeyError, IndexError):
        raise ParameterError(f"push on body {point.body!r}: the arm has no such body") from None
    if int(model.jnt_bodyid[0]) not in _line(model, body):
        raise ParameterError(f"push on body {point.body!r}: it is not on the arm and does not move")
    return body


def _line(model: mujoco.MjModel, body: int) -> list[int]:
    """Return a body and all that carry it."""
    found = [body]
    while found[-1] != 0:
        found.append(int(model.body_parentid[found[-1]]))
    return found


def place_of(model: mujoco.MjModel, point: Point) -> Place:
    """Return a point's place on the straight arm; errors as `body_of`."""
    body = body_of(model, point)
    data = straight(model)
    where = data.xpos[body] + product(data.xmat[body].reshape(3, 3), point.at)
    second = int(model.jnt_bodyid[1])
    if second in _line(model, body):
        return Place(BEAM, float(where[0] - data.xanchor[1][0]), float(where[1]))
    return Place(LINK, float(where[0]), float(where[1]))


def push_on_modes(
    plant: LadenModes, place: Place | None, force: Sequence[float], torque: float
) -> Push:
    """Return a push as the assumed modes feel it; none without a place.

    Args:
        force: (fx, fy) [N]; torque: about z [N m]; both in the world.
    """
    n = plant.modes
    zero = (np.zeros(n), np.zeros(n), np.zeros((n, n)))
    if place is None:
        return Push(NOWHERE, 0.0, 0.0, 0.0, 0.0, 0.0, *zero)
    fx, fy = (float(each) for each in force)
    found = zero if place.part == LINK else _shapes(plant, place.along)
    return Push(place.part, fx, fy, float(torque), place.along, place.across, *found)


def _shapes(plant: LadenModes, along: float) -> tuple[Array, Array, Array]:
    """Return displacement (n,), rotation (n,) and shortening (n, n) of the modes at a place."""
    shape, slope, shortening = (_of_chain if plant.chain is not None else _of_beam)(plant, along)
    turn = plant.turn
    turned = product(turn.T, product(shortening, turn))
    return product(turn.T, shape), product(turn.T, slope), np.ascontiguousarray(turned)


def _of_beam(plant: LadenModes, along: float) -> tuple[Array, Array, Array]:
    """Return `_shapes` of a uniform beam, without the load's turn."""
    p, n = plant.parameters, plant.modes
    share = min(max((along - p.r) / p.L, 0.0), 1.0)
    load = load_of(p)
    node, weight = gauss_legendre(QUADRATURE)
    chi_x = mode_shapes(n, share * (node + 1) / 2, 1, load) / p.L  # (m, n)
    shortening = product((chi_x * (weight / 2 * share * p.L)[:, None]).T, chi_x)
    return mode_shapes(n, share, 0, load), mode_shapes(n, share, 1, load) / p.L, shortening


def _of_chain(plant: LadenModes, along: float) -> tuple[Array, Array, Array]:
    """Return `_shapes` of a file's own chain: its segments turn as a whole."""
    chain = plant.chain
    assert chain is not None
    angle = np.cumsum(vibration(chain, plant.parameters, plant.modes).hinges, axis=0)  # (N, n)
    starts = chain.root + np.append(0.0, np.cumsum(chain.lengths)[:-1])
    cover = np.clip(along - starts, 0.0, chain.lengths)  # (N,) of each segment, before the place
    carrier = int(np.searchsorted(starts, along, side="right")) - 1
    slope = angle[carrier] if carrier >= 0 else np.zeros(plant.modes)
    return product(angle.T, cover), slope.copy(), product(angle.T, cover[:, None] * angle)
