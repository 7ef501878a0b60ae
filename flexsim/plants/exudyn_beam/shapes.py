"""The cubic beam's shape between its nodes: where it is, what energy it holds, its modes' share.

>>> hermite(elements=8, length=0.5, points=place, derivative=0)     # (P, 18)
"""

from __future__ import annotations

import numpy as np

from flexsim.arm.beam import load_of, mode_shapes
from flexsim.arm.parameters import Parameters
from flexsim.numerics.dense import product
from flexsim.numerics.elementary import cubed
from flexsim.numerics.quadrature import gauss_legendre
from flexsim.numerics.types import Array
from flexsim.plants.exudyn_beam.frames import FIRST, OF_NODE

AXIAL_POINTS, BENDING_POINTS = 5, 3  # Gauss points to an element: EXUDYN's orders 9 and 5
MODAL_POINTS = 12  # to an element: modes 1 to 3 times a cubic, to rounding


def hermite(elements: int, length: float, points: Array, derivative: int) -> Array:
    """Return the matrix (P, 2 (N+1)) from nodes' values and slopes to values at points.

    Args:
        elements: N. length: of the beam [m]. points: (P,) from the clamp [m].
        derivative: 0, 1 or 2, with respect to the place.
    """
    h = length / elements
    k = np.minimum((points / h).astype(int), elements - 1)
    u = points / h - k
    one, zero = np.ones_like(u), np.zeros_like(u)
    start, rise = (
        (1 - 3 * u**2 + 2 * cubed(u), u - 2 * u**2 + cubed(u)),
        (6 * u**2 - 6 * u, 1 - 4 * u + 3 * u**2),
        (12 * u - 6, 6 * u - 4),
    )[derivative]
    end = ((one, zero, zero)[derivative]) - start
    fall = (cubed(u) - u**2, 3 * u**2 - 2 * u, 6 * u - 2)[derivative]
    matrix = np.zeros((len(points), 2 * (elements + 1)))
    rows = np.arange(len(points))
    for column, values in enumerate((start, h * rise, end, h * fall)):
        matrix[rows, 2 * k + column] = values
    scaled: Array = matrix / h**derivative
    return scaled


def gauss_points(elements: int, length: float, points: int) -> tuple[Array, Array]:
    """Return places from the clamp and weights (N P,) [m] of Gauss points in every element."""
    node, weight = gauss_legendre(points)
    h = length / elements
    starts = h * np.arange(elements)[:, None]
    return (starts + h * (node + 1) / 2).ravel(), np.tile(h * weight / 2, elements)


def nodal(q: Array, parameters: Parameters) -> tuple[Array, Array]:
    """Return nodes' values and slopes (K, 2 (N+1)), along from the clamp and across [m], of q.

    Args:
        q: (K, m) positions of states, see `.frames`.
    """
    free = q[:, FIRST:].reshape(len(q), -1, OF_NODE)  # (K, N, 4)
    N = free.shape[1]
    along, across = np.zeros((2, len(q), N + 1, 2))
    along[:, :, 0] = parameters.L / N * np.arange(N + 1)
    along[:, :, 1] = 1.0
    along[:, 0, 1] += q[:, FIRST - 1]
    along[:, 1:] += free[:, :, 0::2]
    across[:, 1:] = free[:, :, 1::2]
    return along.reshape(len(q), -1), across.reshape(len(q), -1)


def projection(parameters: Parameters, elements: int, n: int) -> Array:
    """Return the matrix (n, 2 (N+1)) from nodes' values and slopes across to modal coordinates.

    eta_i = (1/L) int chi_i v dx, with the payload's share of it. Source: (15).
    """
    L, load = parameters.L, load_of(parameters)
    place, weight = gauss_points(elements, L, MODAL_POINTS)
    weighted = mode_shapes(n, place / L, 0, load) * weight[:, None] / L  # (P, n)
    matrix: Array = product(hermite(elements, L, place, 0).T, weighted).T
    matrix[:, -2] += load.mass * mode_shapes(n, 1.0, 0, load)
    matrix[:, -1] += load.inertia * L * mode_shapes(n, 1.0, 1, load)
    return matrix


def strain_energy(
    parameters: Parameters, EA: float, elements: int, along: Array, across: Array
) -> Array:
    """Return the energy (K,) of stretching and bending [J], of nodes' values (K, 2 (N+1)).

    1/2 int EA (|r'| - 1)^2 + EI kappa^2 dx with kappa = (r' x r'')/|r'|^2, the turning of the
    tangent, by EXUDYN's Gauss points. Source: EXUDYN's documentation of `ObjectANCFCable2D`.
    """
    L = parameters.L

    def tangents(points: int) -> tuple[Array, Array, Array, Array]:
        place, weight = gauss_points(elements, L, points)
        slope = hermite(elements, L, place, 1)
        x, y = product(along, slope.T), product(across, slope.T)
        return place, weight, x, y

    _, weight, x, y = tangents(AXIAL_POINTS)
    energy = EA * product((np.hypot(x, y) - 1) ** 2, weight) / 2
    place, weight, x, y = tangents(BENDING_POINTS)
    second = hermite(elements, L, place, 2)
    turning = (x * product(across, second.T) - y * product(along, second.T)) / (x**2 + y**2)
    found: Array = energy + parameters.EI * product(turning**2, weight) / 2
    return found
