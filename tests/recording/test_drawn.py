"""What is drawn: strains, arrows, glasses, states, axes, each against what it must be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from recorded_cases import made_up_cases, made_up_motion

from flexsim import Parameters
from flexsim.arm.beam import mode_shapes
from flexsim.loop.friction import Friction
from flexsim.loop.motion import Motion
from flexsim.recording.drawn.arms import (
    ARC,
    ARC_POINTS,
    COMPRESSION,
    TENSION,
    UNSTRAINED,
    beam_segments,
    links,
    strain,
    strain_colours,
    torque_arrows,
)
from flexsim.recording.drawn.magnifier import RADIUS, Glass, factor_for, trails
from flexsim.recording.drawn.map import sheet_of
from flexsim.recording.drawn.states import (
    DEAD_ZONE,
    DRIVEN,
    STICKS,
    SWITCHES,
    frames_of,
    joint_states,
)
from flexsim.recording.panels import DENSEST, LABELS, rounded

HALF_STRIP = 0.5e-3  # [m]
CHORD = 1e-5  # a chord is shorter than its arc by an eighth of a part in 10,000 at most
CURVED = 0.02  # of the curvature, by differences over 40 pieces


def bent(radius: float, points: int = 41) -> np.ndarray:
    """Return a beam along an arc that bends to the left, (1, P, 2) [m]."""
    angle = np.linspace(0, 0.5 / radius, points)
    return (radius * np.column_stack([np.sin(angle), 1 - np.cos(angle)]))[None]


def test_strain_of_an_arc_is_half_the_strip_over_its_radius() -> None:
    """Bent to the left, the left side is compressed."""
    for radius in (2.0, 5.0):
        inner = strain(bent(radius))[0, :-1]
        assert inner == pytest.approx(np.full(40, -HALF_STRIP / radius), rel=CHORD)
    mirrored = bent(2.0) * np.array([1, -1])
    assert strain(mirrored)[0, 5] == pytest.approx(HALF_STRIP / 2.0, rel=CHORD)
    assert not strain(np.array([[[0.0, 0.0], [0.2, 0.0], [0.5, 0.0]]])).any()


def test_strain_of_a_mode_is_its_second_derivative() -> None:
    s = np.linspace(0, 1, 41)
    h, length = 1e-4, 0.5
    inside = s[2:-2]
    second = (mode_shapes(1, inside + h) - 2 * mode_shapes(1, inside) + mode_shapes(1, inside - h))[
        :, 0
    ] / (h * length) ** 2
    beam = np.column_stack([length * s, 1e-3 * mode_shapes(1, s)[:, 0]])[None]
    found = strain(beam)[0, 2:-2]
    assert found == pytest.approx(-HALF_STRIP * 1e-3 * second, abs=CURVED * np.abs(found).max())


def test_strain_has_colours_of_its_sign() -> None:
    found = strain_colours(np.array([-1.0, -0.5, 0.0, 1.0, 9.0]) * 1e-4, 1e-4)
    rgb = [tuple(int(each) >> shift & 255 for shift in (24, 16, 8)) for each in found]
    assert rgb[0] == COMPRESSION and rgb[2] == UNSTRAINED and rgb[3] == rgb[4] == TENSION
    halfway = (np.array(COMPRESSION) + UNSTRAINED) / 2
    assert rgb[1] == pytest.approx(halfway, abs=0.5)


def test_what_is_hollow_has_the_arm_in_its_middle() -> None:
    motion, p = made_up_motion("chain", 6), Parameters()
    line, outline = links(motion, p, 0.0), links(motion, p, 0.02)
    sides = (outline[:, :, 0] + outline[:, :, 3]) / 2, (outline[:, :, 1] + outline[:, :, 2]) / 2
    assert np.abs(sides[0] - line[:, :, 0]).max() < 1e-12
    assert np.abs(sides[1] - line[:, :, 1]).max() < 1e-12
    assert np.linalg.norm(outline[:, :, 0] - outline[:, :, 3], axis=-1) == pytest.approx(
        np.full(line.shape[:2], 0.02)
    )
    middle, _ = beam_segments(motion.beam, 0.0)
    edges, strained = beam_segments(motion.beam, 0.02)
    count = middle.shape[1]
    assert np.abs((edges[:, :count] + edges[:, count:]) / 2 - middle).max() < 1e-12
    assert np.array_equal(strained[:, :count], strained[:, count:])


def test_an_arrow_turns_as_far_and_as_its_torque_does() -> None:
    motion, p = made_up_motion("chain", 6, samples=3), Parameters()
    torque = np.array([[2.0, -1.0], [1.0, 0.0], [-2.0, 0.5]])
    found = torque_arrows(replace(motion, applied=torque), p, (2.0, 1.0))
    arc = found[:, 0, :ARC_POINTS]  # around joint 1, which is the origin
    angle = np.unwrap(np.arctan2(arc[..., 1], arc[..., 0]), axis=1)
    assert angle[:, 0] == pytest.approx(motion.joint[:, 0])
    assert angle[:, -1] - angle[:, 0] == pytest.approx(ARC * torque[:, 0] / 2.0)
    assert np.ptp(found[1, 1, :ARC_POINTS], axis=0).max() == 0.0  # no torque, no arc


def test_a_glass_moves_and_scales_only() -> None:
    glass = Glass(np.array([1.0, 0.5]), 20.0)
    about = np.array([0.3, 0.2])
    points = about + np.array([[0.0, 0.0], [0.004, 0.0], [0.0, -0.005]])
    found = glass.placed(points, about)
    assert found - glass.centre == pytest.approx(20.0 * (points - about))
    assert glass.shows == RADIUS / 20.0
    rim = np.outer([0.99, 1.01], [glass.shows, 0.0])
    assert list(glass.holds(about + rim, about)) == [True, False]


def test_the_factor_is_the_largest_that_shows_all() -> None:
    for largest in (0.09, 0.0123, 2e-3, 7e-6):
        factor = factor_for(np.array([0.0, largest, np.nan]))
        assert factor * largest <= RADIUS < 2.7 * factor * largest
    assert factor_for(np.array([0.5])) == 1.0  # a diverged tip is not made smaller


def test_a_glass_shows_what_is_near_in_time_and_place() -> None:
    time = np.arange(0, 2.0, 0.01)
    path = np.column_stack([0.03 * time, 0 * time])
    glass = Glass(np.zeros(2), 10.0)
    ((one,),) = trails(glass, [(time, path)], (time, path), np.array([1.0]), [False])
    assert one[-1] == pytest.approx([0, 0], abs=1e-12)
    assert one[0] == pytest.approx([-10 * 0.03 * 0.2, 0], abs=1e-9)  # the last 0.2 s
    ((both,),) = trails(glass, [(time, path)], (time, path), np.array([1.0]), [True])
    assert both[-1, 0] == pytest.approx(10 * 0.03 * 0.2)
    ((none,),) = trails(glass, [(time, path + 1.0)], (time, path), np.array([1.0]), [False])
    assert len(none) == 0


def test_the_map_holds_all_that_moves_and_the_glasses_beside_it() -> None:
    for case in made_up_cases():
        sheet = sheet_of(case, Parameters())
        _, x1, y0, y1 = sheet.bounds
        for motion in case.motions.values():
            x, y = motion.tip.T
            assert sheet.corners[0, 0] < x.min() and x.max() < sheet.corners[1, 0]
            assert sheet.corners[0, 1] < y.min() and y.max() < sheet.corners[1, 1]
        glasses = (sheet.about_reference, sheet.about_first)
        rims = [glass.circle() for glass in glasses if glass is not None]
        assert len(rims) == 2
        for rim in rims:
            assert sheet.corners[1, 0] < rim[:, 0].min() and rim[:, 0].max() < x1
            assert y0 < rim[:, 1].min() and rim[:, 1].max() < y1
        assert rims[0][:, 1].min() > rims[1][:, 1].max()


def driven(torque: float, speed: float) -> Motion:
    motion = made_up_motion("assumed-modes", samples=4)
    state = motion.state.copy()
    state[:, 5:7] = speed
    return replace(motion, state=state, applied=np.full((4, 2), torque))


def test_states_of_a_joint() -> None:
    simulink, opposing = Friction("simulink"), Friction("opposing")
    for friction, torque, speed, state in (
        (simulink, 2.0, 0.5, DEAD_ZONE),
        (simulink, 2.0, 0.001, STICKS),
        (simulink, 3.0, 0.001, DRIVEN),  # beyond 2.9129 N m
        (simulink, -3.0, 0.5, DEAD_ZONE),  # not beyond -3.2379 N m
        (opposing, 3.5, 0.001, STICKS),  # Coulomb friction of 4.56 N m holds it
        (opposing, 5.0, 0.001, DRIVEN),
        (replace(simulink, torque_limit=(2.0, 2.0)), 9.0, 0.5, DEAD_ZONE),
    ):
        assert (joint_states(friction, driven(torque, speed))[:, 0] == state).all()


def test_a_frame_of_several_states_switches() -> None:
    states = np.array([0, 0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 2])
    at, shown = frames_of(states, 4)
    assert list(at) == [0, 4, 8] and list(shown) == [0, SWITCHES, 2]
    assert frames_of(states[:0], 4)[0].size == 0


@pytest.mark.parametrize("seed", range(4))
def test_every_axis_has_labels_within(seed: int) -> None:
    """At multiples of one power of ten, two at least, no more than can be read."""
    rng = np.random.default_rng(seed)
    for _ in range(200):
        centre, span = rng.normal() * 10 ** rng.uniform(-3, 3), 10 ** rng.uniform(-3, 3)
        low, high = rounded([centre - span / 2, centre + span / 2])
        assert low < centre - span / 2 and centre + span / 2 < high
        pitch = 10.0 ** np.ceil(np.log10(span / DENSEST) - 1e-9)
        inside = np.floor(high / pitch) - np.ceil(low / pitch) + 1
        assert LABELS <= inside <= DENSEST + 4
    low, high = rounded([0.0, 0.0])
    assert low < 0 < high and np.isfinite([low, high]).all()
