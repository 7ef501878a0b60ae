"""Errors along and across a path, on paths whose directions are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from flexsim.loop.metrics import along_across, tangents
from flexsim.loop.trajectories import trajectory

OFF = 2e-3  # [m]
STEP = 1e-3  # [s]
CHORD = 5e-5  # of a direction: central differences over a step, and rounding where it is slow


def test_on_a_circle_they_are_tangential_and_radial() -> None:
    """A tip that is too far out is to the right of a circle that goes left; one ahead, ahead."""
    circle = trajectory("circle")
    time = STEP * np.arange(4001)
    tip = circle.at(time)
    radial = (tip - circle.centre) / circle.half_width
    tangential = np.stack([-radial[:, 1], radial[:, 0]], axis=1)
    directions = tangents(tip)
    assert np.abs(np.linalg.norm(directions, axis=1) - 1).max() < 1e-12
    along, across = along_across(OFF * radial, directions)
    moving = slice(20, 3980)
    assert np.abs(along[moving]).max() < CHORD * OFF
    assert across[moving] == pytest.approx(np.full(3960, -OFF), rel=1e-8)
    along, across = along_across(OFF * tangential, directions)
    assert along[moving] == pytest.approx(np.full(3960, OFF), rel=1e-8)
    assert np.abs(across[moving]).max() < CHORD * OFF


def test_parts_have_the_length_of_the_whole() -> None:
    rng = np.random.default_rng(1)
    reference, apart = rng.normal(size=(50, 2)), rng.normal(size=(3, 50, 2))
    along, across = along_across(apart, tangents(reference))
    assert along.shape == across.shape == (3, 50)
    assert np.hypot(along, across) == pytest.approx(np.linalg.norm(apart, axis=-1), rel=1e-12)


def test_a_rest_holds_the_last_direction_and_a_start_the_first() -> None:
    """Rest, up, rest, left: nothing turns while nothing moves."""
    y = np.concatenate([np.zeros(5), np.arange(5), np.full(5, 4.0), np.full(5, 4.0)])
    x = np.concatenate([np.zeros(15), -np.arange(5.0)])
    found = tangents(np.stack([x, y], axis=1))
    assert np.allclose(found[:14], [0.0, 1.0])
    assert np.allclose(found[16:], [-1.0, 0.0])


@pytest.mark.parametrize("rows", [0, 1, 4])
def test_what_never_moves_goes_along_x(rows: int) -> None:
    assert np.array_equal(tangents(np.ones((rows, 2))), np.tile([1.0, 0.0], (rows, 1)))
