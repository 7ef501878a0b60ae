"""Ways through points: what each time law promises, against closed forms."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from flexsim import ParameterError, Parameters
from flexsim.loop.trajectories import Trajectory, reference
from flexsim.loop.waypoints import LAWS, Waypoints

POINTS = ((0.70, 0.20), (0.55, 0.45), (0.50, 0.30), (0.30, 0.60))
ROUNDING = 1e-12  # [m]
FINE = 1e-4  # [s] step of finite differences


def way(law: str, **more: Any) -> Waypoints:
    return Waypoints(POINTS, law, **more)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("times", [(), (0.0, 1.0, 2.5, 4.0)])
def test_passes_every_point_at_its_time(law: str, times: tuple[float, ...]) -> None:
    path = way(law, times=times, lead=0.5)
    if law == "quintic" and not times:  # the time at a point is the law's
        u = np.linspace(0.0, 1.0, 100_001)
        gone = path.lengths[-1] * u**3 * (10 - 15 * u + 6 * u**2)
        knots = path.duration * u[np.searchsorted(gone, path.lengths * (1 - 1e-15))]
        found, near = path.at(knots + 0.5), 1e-4
    else:
        found, near = path.at(path.knots + 0.5), ROUNDING
    np.testing.assert_allclose(found, POINTS, atol=near)


@pytest.mark.parametrize("law", LAWS)
def test_rests_before_and_after(law: str) -> None:
    path = way(law, lead=0.3, hold=0.7)
    assert path.end_time == 0.3 + 4.0 + 0.7
    for t, point in ((np.linspace(0, 0.3, 7), POINTS[0]), (np.linspace(4.3, 5.0, 7), POINTS[-1])):
        np.testing.assert_array_equal(path.at(t), np.tile(point, (7, 1)))


@pytest.mark.parametrize("law", ["quintic", "minimum-jerk"])
def test_between_two_points_both_are_the_quintic_of_the_line(law: str) -> None:
    """Flash and Hogan's closed form, which our line has, too."""
    line = Trajectory("line", duration=2.0)
    path = Waypoints((line.start, line.end), law, duration=2.0)
    t = np.linspace(0.0, 3.0, 301)
    np.testing.assert_allclose(path.at(t), line.at(t), atol=ROUNDING)


def test_constant_speed_is_constant() -> None:
    path = way("constant-speed")
    t = np.linspace(0.0, 4.0, 4001)
    steps = np.linalg.norm(np.diff(path.at(t), axis=0), axis=1) / 1e-3
    straight = path.lengths[-1] / path.duration
    corners = 2  # a step that holds one is shorter
    assert (np.abs(steps - straight) > 1e-9).sum() == corners


def test_the_spline_is_scipys_clamped_one() -> None:
    path = way("spline", times=(0.0, 1.0, 2.5, 4.0))
    t = np.linspace(0.0, 4.0, 401)
    expected = CubicSpline(path.knots, POINTS, bc_type="clamped")(t)
    np.testing.assert_allclose(path.at(t), expected, atol=ROUNDING)


def jerk(path: Waypoints, change: np.ndarray | float = 0.0) -> float:
    """The integral of squared jerk, by differences, of a way and a change to it."""
    t = np.arange(0.0, path.duration + 1e-12, 2e-3)
    third = np.diff(path.at(t) + change, 3, axis=0) / 2e-3**3
    return float(np.sum(third**2) * 2e-3)


def test_minimum_jerk_is_a_minimum() -> None:
    """Whatever vanishes at the points and rests at the ends only adds to it."""
    path = way("minimum-jerk", times=(0.0, 1.0, 2.5, 4.0))
    t = np.arange(0.0, path.duration + 1e-12, 2e-3)
    least = jerk(path)
    rng = np.random.default_rng(1)
    bump = np.prod([(t - knot) for knot in path.knots], axis=0) * (t * (4.0 - t)) ** 2
    for _ in range(20):
        shape = np.polynomial.Chebyshev(rng.standard_normal(4), [0.0, 4.0])(t)
        change = rng.standard_normal(2) * (bump * shape)[:, None]
        assert jerk(path, 0.01 / np.abs(change).max() * change) > least
    assert jerk(replace(path, law="quintic")) > least  # rests at the points, too


@pytest.mark.parametrize("law", ["spline", "minimum-jerk"])
def test_accelerations_are_continuous_at_the_points(law: str) -> None:
    path = way(law)
    for knot in path.knots[1:-1]:
        before, after = (
            np.diff(path.at(knot + FINE * np.arange(3) + side), 2, axis=0)[0] / FINE**2
            for side in (-2 * FINE, 0.0)
        )
        assert np.abs(after - before).max() < 60 * FINE  # [m/s2], of a jerk of some 10 m/s3


def test_a_reference_takes_it() -> None:
    ref = reference(way("minimum-jerk", lead=0.25), Parameters())
    assert len(ref.time) == 5251
    np.testing.assert_allclose(ref.tip[0], POINTS[0])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"law": "cubic"}, "law 'cubic' is unknown"),
        ({"points": POINTS[:1]}, "1 points; give 2 to"),
        ({"points": (POINTS[0], POINTS[0])}, "points 0 and 1 are the same"),
        ({"points": ((0.1, float("nan")), POINTS[0])}, "finite numbers"),
        ({"duration": 0.0}, "duration is 0.0 s"),
        ({"lead": -1.0}, "lead is -1.0 s"),
        ({"times": (0.0, 2.0, 1.0, 4.0)}, "rising from 0"),
        ({"times": (0.0, 4.0)}, "times are 2 for 4 points"),
        ({"times": (0.0, 1.0, 2.0, 3.0)}, "to the duration, 4 s"),
    ],
)
def test_what_is_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        replace(way("spline"), **change)
