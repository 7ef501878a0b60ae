"""Reference trajectories: time law, coordinates as documented, and what is refused."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from flexsim import ParameterError, Parameters
from flexsim.arm.kinematics import tip_position
from flexsim.loop.trajectories import (
    RECONSTRUCTED_TRAJECTORIES,
    TRAJECTORIES,
    Trajectory,
    reference,
    trajectory,
)

PARAMETERS = Parameters()
ROUNDING = 1e-14  # [m] a few operations on numbers of size 1
FINE = 1e-4  # [s] step of the finite differences below
NAMES = ("line", "two-loop", "circle")


def u_of(time: np.ndarray) -> np.ndarray:
    """The quintic law of a 1 m line along x."""
    line = Trajectory("line", duration=2.0, start=(0.0, 0.0), end=(1.0, 0.0))
    return line.at(time)[:, 0]


def test_time_law_is_the_quintic_with_six_rest_conditions() -> None:
    t = np.linspace(0.0, 2.0, 9)
    quintic = np.linalg.solve(  # c0..c5 from values, rates and accelerations 0, 0, 0, 1, 0, 0
        [
            [1, 0, 0, 0, 0, 0],
            [0, 1, 0, 0, 0, 0],
            [0, 0, 2, 0, 0, 0],
            [1, 1, 1, 1, 1, 1],
            [0, 1, 2, 3, 4, 5],
            [0, 0, 2, 6, 12, 20],
        ],
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    )
    expected = np.polynomial.polynomial.polyval(t / 2.0, quintic)
    np.testing.assert_allclose(u_of(t), expected, atol=ROUNDING)


@pytest.mark.parametrize("name", NAMES)
def test_at_rest_at_both_ends_and_through_the_hold(name: str) -> None:
    path = TRAJECTORIES[name]
    for end in (0.0, path.duration):
        before, at, after = path.at(np.array([end - FINE, end, end + FINE]))
        jerk = 60 * 2 * np.pi * 0.5 / path.duration**3  # [m/s3] of the law times the paths' size
        assert np.abs(after - before).max() / (2 * FINE) < jerk * FINE**2
        assert np.abs(after - 2 * at + before).max() / FINE**2 < jerk * FINE + 1e-7  # rounding
    middle = path.at(path.duration / 2 + np.array([-FINE, FINE]))
    assert np.linalg.norm(middle[1] - middle[0]) / (2 * FINE) > 0.1  # [m/s] control: moving there
    hold = path.at(np.linspace(path.duration, path.end_time, 50))
    np.testing.assert_array_equal(hold, np.broadcast_to(hold[0], hold.shape))


def test_line_goes_from_start_to_end_and_stays_on_it() -> None:
    xy = trajectory("line").at(np.linspace(0.0, 5.0, 101))
    np.testing.assert_allclose(xy[[0, -1]], [(0.70, 0.20), (0.30, 0.60)], atol=ROUNDING)
    np.testing.assert_allclose(xy.sum(axis=1), 0.9, atol=ROUNDING)
    assert (np.diff(xy[:81, 0]) < 0).all()


def test_circle_is_one_turn_about_its_centre() -> None:
    xy = trajectory("circle").at(np.linspace(0.0, 5.0, 501)) - (0.55, 0.35)
    np.testing.assert_allclose(np.hypot(*xy.T), 0.12, atol=ROUNDING)
    turned = np.unwrap(np.arctan2(xy[:, 1], xy[:, 0]))
    assert turned[-1] - turned[0] == pytest.approx(2 * np.pi, abs=1e-12)
    np.testing.assert_allclose(xy[0], (0.12, 0.0), atol=ROUNDING)


def test_two_loop_is_a_figure_eight_of_its_half_sizes() -> None:
    xy = trajectory("two-loop").at(np.linspace(0.0, 4.0, 4001)) - (0.55, 0.35)
    x, y = xy[:, 0] / 0.15, xy[:, 1] / 0.12
    np.testing.assert_allclose(y**2, 4 * x**2 * (1 - x**2), atol=1e-13)  # its implicit equation
    assert np.abs(x).max() == pytest.approx(1.0, abs=1e-5)  # samples miss the extremes by 1e-3 rad
    assert np.abs(y).max() == pytest.approx(1.0, abs=1e-5)
    np.testing.assert_allclose(xy[[0, 2000, -1]], 0.0, atol=ROUNDING)  # it crosses itself here


@pytest.mark.parametrize("name", NAMES)
def test_reconstructed_ones_last_579_at_constant_parameter_speed(name: str) -> None:
    path = trajectory(name, reconstructed=True)
    assert (path.duration, path.hold, path.time_law) == (5.79, 0.0, "constant-speed")
    xy = path.at(np.linspace(0.0, 5.79, 1001))
    speed = np.linalg.norm(np.diff(xy, axis=0), axis=1) * 1000 / 5.79
    if name == "line":
        assert speed == pytest.approx(0.45 / 5.79, rel=1e-9)
        np.testing.assert_allclose(xy[:, 0] + xy[:, 1], xy[0].sum(), atol=ROUNDING)  # its slope
    elif name == "circle":
        assert speed == pytest.approx(2 * np.pi * 0.061 / 5.79, rel=1e-5)  # chords
    else:
        assert np.abs(xy[:, 0] - path.centre[0]).max() == pytest.approx(0.052, rel=1e-5)
        assert np.abs(xy[:, 1] - path.centre[1]).max() == pytest.approx(0.052 * 0.8, rel=1e-4)


@pytest.mark.parametrize("table", [TRAJECTORIES, RECONSTRUCTED_TRAJECTORIES])
@pytest.mark.parametrize("name", NAMES)
def test_every_reference_is_in_reach_and_its_angles_lead_back_to_it(
    table: dict[str, Trajectory], name: str
) -> None:
    sampled = reference(table[name], PARAMETERS)
    assert len(sampled.time) == len(sampled.tip) == len(sampled.joint)
    assert sampled.time[-1] == pytest.approx(table[name].end_time)
    np.testing.assert_allclose(np.diff(sampled.time), 1e-3, atol=1e-15)
    np.testing.assert_allclose(tip_position(PARAMETERS, sampled.joint), sampled.tip, atol=ROUNDING)
    assert (sampled.joint[:, 1] > 0).all()
    assert np.abs(np.diff(sampled.joint, axis=0)).max() < 0.01  # [rad] per ms: no branch jump


def test_names() -> None:
    assert tuple(TRAJECTORIES) == tuple(RECONSTRUCTED_TRAJECTORIES) == NAMES
    for name in NAMES:
        assert trajectory(name).shape == trajectory(name).name == name
    assert Trajectory("line", name="short").name == "short"


def test_unknown_name_is_an_error_naming_the_choices() -> None:
    with pytest.raises(ParameterError, match=r"'square' is unknown.*line, two-loop, circle"):
        trajectory("square")
    with pytest.raises(ParameterError, match=r"'square' is unknown.*line, two-loop, circle"):
        Trajectory("square")
    with pytest.raises(ParameterError, match=r"time law 'cubic'.*quintic, constant-speed"):
        Trajectory("line", time_law="cubic")


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("name", ["duration", "half_width", "half_height"])
def test_number_that_cannot_be_used_is_an_error(name: str, value: float) -> None:
    with pytest.raises(ParameterError, match=name.replace("_", " ") + ".*0"):
        Trajectory("circle", **{name: value})  # type: ignore[arg-type]


@pytest.mark.parametrize("hold", [-1.0, np.nan, np.inf])
def test_impossible_hold_is_an_error_and_none_is_not(hold: float) -> None:
    with pytest.raises(ParameterError, match="hold"):
        Trajectory("circle", hold=hold)
    assert Trajectory("circle", hold=0.0).end_time == 4.0


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"centre": (0.8, 0.35)}, "out of reach"),
        ({"centre": (0.0, 0.0), "half_width": 0.255}, "singular"),
        ({"centre": (0.0, 0.0), "half_width": 0.1}, "out of reach"),
    ],
)
def test_path_out_of_reach_names_trajectory_and_point(change: dict[str, Any], what: str) -> None:
    path = replace(trajectory("circle"), **change)
    with pytest.raises(ParameterError, match=rf"trajectory 'circle': reference point .*{what}"):
        reference(path, PARAMETERS)


@pytest.mark.parametrize("period", [0.0, -1e-3, np.nan, np.inf])
def test_impossible_period_is_an_error_naming_it(period: float) -> None:
    with pytest.raises(ParameterError, match=f"control period is {period}"):
        reference(trajectory("line"), PARAMETERS, period)


def test_a_period_that_does_not_divide_the_end_covers_it() -> None:
    line = trajectory("line")
    for period in (1e-3, 2e-3, 3.3e-3, 7e-3):
        last = reference(line, Parameters(), period).time[-1]
        assert line.end_time - 1e-9 <= last < line.end_time + period
    assert len(reference(line, Parameters(), 1e-3).time) == 5001
