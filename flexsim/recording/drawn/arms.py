"""Both arms where they are: the first a line, the others hollow around it, the beam by its strain.

>>> links(motion, parameters, hollow=0.0)                # (K, 2, 2, 2) link 1 and hub
>>> segments, strain = beam_segments(motion.beam, 0.0)   # (K, S, 2, 2), (K, S)

Everything lies in the plane of motion, in metres; what is hollow is as wide as told, for display.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexsim.arm.parameters import Parameters
from flexsim.loop.motion import Motion
from flexsim.mjcf.chain_xml import STRIP_THICKNESS
from flexsim.numerics.types import Array
from flexsim.recording.colours import Colour

FRAME = 0.02  # between two poses of an arm [s], where it was sampled more often
BEAM_SEGMENTS = 14  # at most, of a beam
ARC, ARC_POINTS = 1.5 * np.pi, 9  # of the largest torque [rad]
ARC_RADIUS, ARC_PITCH, HEAD = 0.038, 0.012, 0.010  # of the arrows around joints [m]
TENSION: Colour = (0, 158, 115)  # of the side to the left, seen from the clamp
COMPRESSION: Colour = (204, 121, 167)
UNSTRAINED: Colour = (225, 225, 225)


def frames(motion: Motion) -> Motion:
    """Return a motion thinned to what a moving picture needs."""
    if motion.time.size < 2:
        return motion
    return motion.thinned(max(1, round(FRAME / float(motion.time[1] - motion.time[0]))))


def in_space(plane: Array, height: float = 0.0) -> NDArray[np.float32]:
    """Return points (..., 2) [m] of the plane of motion as (..., 3)."""
    level = np.full((*plane.shape[:-1], 1), height)
    return np.concatenate([plane, level], axis=-1).astype(np.float32)


def elbow(motion: Motion, parameters: Parameters) -> Array:
    """Return the position of joint 2, (K, 2) [m]."""
    if motion.link1 is not None:
        return motion.link1[:, -1]
    theta1 = motion.joint[:, 0]
    return parameters.L_R * np.column_stack([np.cos(theta1), np.sin(theta1)])


def links(motion: Motion, parameters: Parameters, hollow: float) -> Array:
    """Return link 1 and hub of every sample as lines, or hollow as closed outlines.

    Returns:
        (K, 2, 2, 2) or (K, 2, 5, 2) [m]; of a link 1 that bends, a line for each of its pieces.
    """
    joint2 = elbow(motion, parameters)
    link = np.stack([np.zeros_like(joint2), joint2], axis=1)
    if motion.link1 is not None:
        link = thinned_beam(motion.link1)
    start = np.concatenate([link[:, :-1], joint2[:, None]], axis=1)  # (K, 2, 2)
    end = np.concatenate([link[:, 1:], motion.beam[:, :1]], axis=1)
    if not hollow:
        return np.stack([start, end], axis=2)
    side = 0.5 * hollow * _normal(end - start)
    return np.stack([start + side, end + side, end - side, start - side, start + side], axis=2)


def _normal(along: Array) -> Array:
    """Return unit vectors to the left of directions (..., 2)."""
    left = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    length = np.linalg.norm(left, axis=-1, keepdims=True)
    return left / np.where(length > 0, length, 1.0)


def strain(beam: Array) -> Array:
    """Return the strain of the beam's left side at its points (K, P): curvature by half the strip.

    The curvature at a point is the angle between the pieces before and after it, over half the
    length of both; at the clamp that of the next point, at the tip none.

    Args:
        beam: (K, P, 2) points along it [m].
    """
    piece = np.diff(beam, axis=1)  # (K, P-1, 2)
    length = np.linalg.norm(piece, axis=-1)
    angle = np.unwrap(np.arctan2(piece[..., 1], piece[..., 0]), axis=1)
    found = np.zeros(beam.shape[:2])
    found[:, 1:-1] = np.diff(angle, axis=1) / (0.5 * (length[:, 1:] + length[:, :-1]))
    found[:, 0] = found[:, 1]
    return -0.5 * STRIP_THICKNESS * found  # bent to the left, its left side is compressed


def thinned_beam(beam: Array) -> Array:
    """Return a beam (K, P, 2) of no more than BEAM_SEGMENTS pieces, both ends kept."""
    points = beam.shape[1]
    if points <= BEAM_SEGMENTS + 1:
        return beam
    return beam[:, np.unique(np.linspace(0, points - 1, BEAM_SEGMENTS + 1).round().astype(int))]


def beam_segments(beam: Array, hollow: float) -> tuple[Array, Array]:
    """Return a beam's pieces, each a line of its own, and the strain in the middle of each.

    Args:
        beam: (K, P, 2) [m]. hollow: 0 for its middle line, else the distance of its two edges [m].

    Returns:
        (K, S, 2, 2) [m] and (K, S), S being P-1, or twice that.
    """
    beam = thinned_beam(beam)
    ends = strain(beam)
    middle = 0.5 * (ends[:, 1:] + ends[:, :-1])
    if not hollow:
        return np.stack([beam[:, :-1], beam[:, 1:]], axis=2), middle
    normal = _normal(np.gradient(beam, axis=1))
    edges = [beam + side * 0.5 * hollow * normal for side in (1, -1)]
    pieces = [np.stack([edge[:, :-1], edge[:, 1:]], axis=2) for edge in edges]
    return np.concatenate(pieces, axis=1), np.concatenate([middle, middle], axis=1)


def strain_colours(values: Array, largest: float) -> NDArray[np.uint32]:
    """Return colours (...) as 0xRRGGBBAA: pale without strain, green stretched, pink compressed."""
    share = np.clip(np.asarray(values) / largest, -1, 1)[..., None]
    ends = np.where(share > 0, TENSION, COMPRESSION)
    rgb = np.rint(np.array(UNSTRAINED) + np.abs(share) * (ends - np.array(UNSTRAINED)))
    red, green, blue = (rgb[..., i].astype(np.uint32) for i in range(3))
    return (red << 24) | (green << 16) | (blue << 8) | np.uint32(255)


def torque_arrows(
    motion: Motion, parameters: Parameters, largest: tuple[float, float], place: int = 0
) -> Array:
    """Return an arrow around each joint, as long as the motor's torque, ARC for the largest.

    Args:
        largest: of both joints [N m]. place: of the plant among those drawn; each further out.

    Returns:
        (K, 2, ARC_POINTS + 3, 2) [m]: from the link's direction, then the arrow's head.
    """
    radius = ARC_RADIUS + ARC_PITCH * place
    centres = np.stack([np.zeros_like(motion.joint), elbow(motion, parameters)], axis=1)
    start = np.cumsum(motion.joint, axis=1)  # directions of the link and of the hub
    sweep = ARC * motion.applied / np.array(largest)  # (K, 2)
    angle = start[..., None] + sweep[..., None] * np.linspace(0, 1, ARC_POINTS)
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=-1)  # (K, 2, A, 2)
    arc = radius * outward
    last, size = outward[:, :, -1], np.minimum(HEAD, radius * np.abs(sweep))[..., None]
    back = -np.sign(sweep)[..., None] * np.stack([-last[..., 1], last[..., 0]], axis=-1)
    tip = arc[:, :, -1]
    wings = [tip + size * (back + side * 0.6 * last) for side in (1, -1)]
    head = np.stack([wings[0], tip, wings[1]], axis=2)
    return centres[:, :, None] + np.concatenate([arc, head], axis=2)
