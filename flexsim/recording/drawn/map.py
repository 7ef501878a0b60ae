"""What the map of a case covers: where things are, its ticks, where its magnifying glasses go.

>>> sheet = sheet_of(case, parameters)
>>> sheet.bounds                                    # x and y from and to [m]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexsim.arm.parameters import Parameters
from flexsim.numerics.types import Array
from flexsim.recording.case import Case
from flexsim.recording.drawn.arms import elbow
from flexsim.recording.drawn.magnifier import RADIUS, Glass, factor_for
from flexsim.recording.traces import difference

GRID = 0.1  # of the map [m]
MARGIN = 0.06  # around all that moves, and between it and the glasses [m]
SAID = 0.08  # for the words below a glass [m]
LABELS = 0.09  # for the ticks' texts, left of it and below [m]
BEYOND = 1.1  # of the arm's reach: what is farther has diverged, and is not made room for
DASH, GAP = 0.014, 0.016  # of the reference path [m]


@dataclass(frozen=True, eq=False)
class Sheet:
    """The map of a case.

    Attributes:
        corners: (2, 2) lowest and highest of the grid [m]. bounds: all of it, x and y from and to.
        within: of the grid, without ticks' texts and glasses.
        about_reference, about_first: glasses; None without a reference, without a second plant.
    """

    corners: Array
    bounds: tuple[float, float, float, float]
    within: tuple[float, float, float, float]
    about_reference: Glass | None
    about_first: Glass | None


def covered(case: Case, parameters: Parameters) -> Array:
    """Return the lowest and highest corner (2, 2) [m] of what moves, within the arm's reach."""
    points = [np.zeros((1, 2)), case.reference_tip[1]]
    for motion in case.motions.values():
        points += [elbow(motion, parameters), motion.tip]
    every = np.concatenate(points)
    every = every[np.linalg.norm(every, axis=1) <= BEYOND * (parameters.L_R + parameters.reach)]
    return np.stack([every.min(axis=0), every.max(axis=0)])


def sheet_of(case: Case, parameters: Parameters) -> Sheet:
    """Return the map of a case, its glasses to the right of all that moves."""
    low, high = covered(case, parameters)
    corners = np.stack(
        [
            GRID * np.floor((low - MARGIN) / GRID),
            GRID * np.ceil((high + MARGIN) / GRID),
        ]
    )
    deviations = _deviations(case)
    x = corners[1, 0] + MARGIN + RADIUS
    middle = corners[:, 1].mean()
    offsets = (RADIUS + SAID, -RADIUS) if deviations[1] is not None else (0.0, 0)
    glasses = [
        None if found is None else Glass(np.array([x, middle + offset]), factor_for(found))
        for found, offset in zip(deviations, offsets, strict=True)
    ]
    right = x + RADIUS + MARGIN / 2 if any(glasses) else corners[1, 0] + MARGIN / 2
    half = max(corners[1, 1] - middle, 2 * RADIUS + SAID)
    bounds = (corners[0, 0] - LABELS, right, middle - half - LABELS, middle + half + MARGIN / 2)
    (x0, y0), (x1, y1) = corners.tolist()
    edge = MARGIN / 4
    within = (x0 - edge, x1 + edge, y0 - edge, y1 + edge)
    return Sheet(corners, tuple(map(float, bounds)), within, *glasses)  # type: ignore[arg-type]


def _deviations(case: Case) -> tuple[Any | None, Any | None]:
    """Return the tips' distances from the reference, and of the plants from each other [m]."""
    moved = [each for each in case.motions.values() if each.time.size]
    errors = [np.linalg.norm(each.tip - each.reference_tip, axis=1) for each in moved]
    off = np.concatenate(errors) if errors else np.zeros(0)
    apart = None
    if len(case.motions) == 2:
        time, between = difference(case.motions, lambda motion: motion.tip)
        apart = np.linalg.norm(between, axis=1) if time.size else None
    return (off if np.isfinite(off).any() else None), apart


def grid(sheet: Sheet) -> list[Array]:
    """Return the lines of the map's grid, (2, 2) [m] each."""
    (x0, y0), (x1, y1) = sheet.corners
    xs, ys = ticks(x0, x1), ticks(y0, y1)
    return [
        *(np.array([[x, y0], [x, y1]]) for x in xs),
        *(np.array([[x0, y], [x1, y]]) for y in ys),
    ]


def ticks(low: float, high: float) -> Array:
    """Return the multiples of the grid's pitch from one number to another."""
    return GRID * np.arange(round(low / GRID), round(high / GRID) + 1, dtype=float)


def labels(sheet: Sheet) -> tuple[Array, list[str]]:
    """Return where the ticks' texts stand (n, 2) [m], and what they say."""
    (x0, y0), (x1, y1) = sheet.corners
    xs, ys = ticks(x0, x1), ticks(y0, y1)
    below = [[x, y0 - LABELS / 3] for x in xs]
    left = [[x0 - LABELS / 2, y] for y in ys]
    said = [_tick(x, "x", i == len(xs) - 1) for i, x in enumerate(xs)]
    said += [_tick(y, "y", i == len(ys) - 1) for i, y in enumerate(ys)]
    return np.array(below + left), said


def _tick(value: float, axis: str, last: bool) -> str:
    """Return a tick's text; the last of an axis says which it is, and the unit."""
    number = f"{value + 0.0:.1f}"
    return f"{axis} = {number} m" if last else number


def dashes(path: Array) -> list[Array]:
    """Return a path (K, 2) [m] cut into dashes, each (m, 2); none where it has no length."""
    path = path[np.isfinite(path).all(axis=1)]
    step = np.linalg.norm(np.diff(path, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(step)]) if path.size else np.zeros(1)
    found = []
    for start in np.arange(0.0, length[-1], DASH + GAP):
        s = np.linspace(start, min(start + DASH, length[-1]), 4)
        found.append(np.column_stack([np.interp(s, length, path[:, i]) for i in range(2)]))
    return found
