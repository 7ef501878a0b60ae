"""How is the beam curved at a place? Rows that a plant's positions are multiplied with.

    >>> curvature_of_modes(Parameters(), 3, [0.025, 0.25])        # (2, 3) [1/m] of 1 m of each mode

v'' to first order in the deflection, at places from the clamp, positive where the beam bends
towards +v; strain on the surface is that times the distance from the neutral axis. Assumed modes
have it in closed form, chi_i''. A chain is straight between its hinges, but a hinge carries the
moment k_j q_j, and moments over EI are the curvature at the hinges' places: between these a cubic
spline, which ends at no moment at the tip. Under a force at the tip that is the beam's own
curvature, exactly; in modes 1, 2, 3 of the tuned chain of six, at 5 % to 80 % of the beam, it is
off by 0.01, 0.2 and 2 % of the curvature at the clamp (`tests/plants/test_curvature.py`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from flexsim.arm.beam import load_of, mode_shapes
from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError, ParameterError
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.rod_file import RodModel
from flexsim.numerics.types import Array

FEWEST = 2  # hinges that moments are between
ROUNDING = 1e-9  # of a beam's length, a sum of its segments


def on_beam(places: ArrayLike, L: float) -> Array:
    """Return places (P,) from the clamp [m], checked.

    Raises:
        ParameterError: one is off the beam.
    """
    found = np.atleast_1d(np.asarray(places, dtype=float))
    for place in found:
        if not 0 <= place <= L * (1 + ROUNDING):
            raise ParameterError(
                f"a strain bridge is {place:g} m from the clamp, off the beam; give 0 to {L:g} m"
            )
    return np.minimum(found, L)


def curvature_of_modes(parameters: Parameters, n: int, places: ArrayLike) -> Array:
    """Return the curvature (P, n) at places of a unit of each clamped mode [1/m2]: chi_i''.

    Raises:
        ParameterError: a place off the beam.

    Source: (15).
    """
    L = parameters.L
    s = on_beam(places, L)
    rows: Array = mode_shapes(n, s / L, 2, load_of(parameters)) / L**2
    return rows


def curvature_of_chain(chain: ChainModel, parameters: Parameters, places: ArrayLike) -> Array:
    """Return the curvature (P, N) at places of a unit angle of each hinge along the beam [1/m].

    Args:
        parameters: of the uniform beam, whose EI makes curvature of moments.

    Raises:
        ParameterError: a place off the beam, or a single hinge. ModelError: springs that rest at
            an angle.
    """
    model, N = chain.model, len(chain.lengths)
    if model.qpos_spring[-N:].any():
        raise ModelError(
            f"{chain.source}: hinges of the beam rest at an angle, of which strain bridges know "
            "nothing; give springref 0"
        )
    s = on_beam(places, chain.reach - chain.clamp)
    turning = model.jnt_stiffness[-N:] / parameters.EI
    rows: Array = between(chain.hinges, chain.reach - chain.clamp, parameters, s) * turning
    return rows


def curvature_of_rod(rod: RodModel, parameters: Parameters, places: ArrayLike) -> Array:
    """Return the curvature (P, m) at places of a unit of each of a rod's slides [1/m2].

    Of the moments 2 k kb at its vertices, kb the angle between edges, as `rod_file` has the energy.

    Raises:
        ParameterError: a place off the beam.
    """
    s = on_beam(places, rod.reach - rod.clamp)
    nodes = rod.vertices - rod.clamp
    moved = np.zeros((len(nodes), rod.model.nq))  # across, of each coordinate
    moved[np.arange(2, len(nodes)), np.arange(3, rod.model.nq, 2)] = 1.0
    slopes = np.diff(moved, axis=0) / np.diff(nodes)[:, None]
    bent = 2 * rod.bending[:, None] * np.diff(slopes, axis=0) / parameters.EI  # (N, m)
    rows: Array = between(nodes[1:-1], nodes[-1], parameters, s) @ bent
    return rows


def between(nodes: Array, tip: float, parameters: Parameters, places: Array) -> Array:
    """Return the matrix (P, N) from moments at nodes to those at places, by a cubic spline.

    Without a payload's inertia the moment at the tip is zero, another node.
    """
    if len(nodes) < FEWEST:
        raise ParameterError(f"curvature needs {FEWEST} hinges along the beam; this one has fewer")
    known = np.eye(len(nodes))
    if parameters.payload_inertia == 0:
        nodes, known = np.append(nodes, tip), np.vstack([known, np.zeros(len(nodes))])
    rows: Array = CubicSpline(nodes, known)(places)
    return rows
