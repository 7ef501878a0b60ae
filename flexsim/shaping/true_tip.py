"""References that make the *true* tip follow: stable, non-causal inversion along a trajectory.

    >>> from flexsim.shaping.true_tip import shaped_reference
    >>> motion, = closed_loop(plant, setting("none"), shaped_reference(reference, plant), filters)

The loop makes theta1 and the reflected tip, theta2 - atan(v/(r+L)), follow their references, so
the true tip is about 2 v off, whatever the controller. The references given here are those that
go with the motion in which the true tip stays on the path. That motion is unique among bounded
ones: with the tip prescribed, the beam's own dynamics have growing and decaying solutions (zeros
right and left, at +-54 rad/s and beyond for the paper's arm), so v must *precede* the path's
acceleration by some 0.1 s, and is found in the frequency domain, over the whole trajectory at
once. Newton's iteration with that inverse then takes in all of the plant's nonlinear terms.

What is left is the loop's own error, C^-1 times the torque. With the filters given, it is added to
the reference as well. Friction's dead zone remains, `feedforward.dead_zone_error` says how much,
unless the reference also carries a dither.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import ParameterError
from flexsim.linear.linearise import linearise
from flexsim.loop.friction import Friction
from flexsim.loop.settings import V_GAIN
from flexsim.loop.trajectories import Reference
from flexsim.numerics.dense import product
from flexsim.numerics.eigenvalues import eigenvalues
from flexsim.numerics.elementary import arctan2, cos, sin
from flexsim.numerics.state_matrix import state_matrix
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.linear_plant import LinearPlant
from flexsim.shaping.feedforward import Filters, dithered_torque, errors_for, motor_torque
from flexsim.shaping.spectra import Spectrum, inverse_responses, multiplied

REST = 0.6  # [s] of rest put before and after, e^(-54 x 0.6) = 1e-14
ITERATIONS = 30
CONVERGED = 1e-9  # [m] last change of v
ON_AXIS = 1e-6  # relative: a zero so close to the imaginary axis has no bounded inverse


@dataclass(frozen=True, eq=False)
class TrueTipMotion:
    """The motion in which the true tip follows a reference exactly, padded by rest.

    Attributes:
        time: (K,) [s], negative before the reference starts.
        q: (K, m) generalised positions of the plant; v: (K,) tip deflection [m].
        torque: (K, 2) that the motion needs at the motors [N m], friction of a setting apart.
        change: largest change of v in the last iteration [m].
    """

    time: Array
    q: Array
    v: Array
    torque: Array
    change: float


def shaped_reference(
    reference: Reference,
    plant: Plant,
    lead: float = 0.0,
    filters: Filters | None = None,
    friction: Friction | None = None,
    v_gain: float = V_GAIN,
    dither: bool = False,
) -> Reference:
    """Return the reference whose joint angles make the true tip follow, for any controller.

    Args:
        reference: sampled trajectory, at rest before and after. plant: whose beam is inverted.
        lead: [s] of hold put first, in which the arm bends in advance; without, the tip starts
            slightly off.
        filters: ((b1, a1), (b2, a2)); if given, the errors that make them give the motion's
            torque are added, and the reference serves these controllers only.
        friction: whose joint friction that torque overcomes; its dead zone needs the dither.
        v_gain: factor of atan(v/(r+L)) in the loop's measurement, -1 in the paper.
        dither: whether to add the tone that carries the torque through the dead zone.

    Returns:
        A reference of the same times, `lead` longer; its tip is the true path.

    Raises:
        ParameterError: lead is negative or not finite, the inversion does not exist or converge,
            a filter cannot be inverted, there is a dither but no filters or friction, or the
            reference has a torque.
    """
    period = float(reference.time[1] - reference.time[0])
    if not 0 <= lead < math.inf:
        raise ParameterError(f"lead is {lead} s; give 0 or more")
    if reference.torque is not None:
        raise ParameterError(
            "the reference has a torque fed forward, which shaping knows nothing of; "
            "shape it without, and add the torque to what comes back"
        )
    if dither and (filters is None or friction is None):
        raise ParameterError("a dither needs the filters it passes and the friction it overcomes")
    extra = round(lead / period)
    motion = true_tip_motion(reference, plant, max(REST, lead))
    joint = motion.q[:, :2].copy()
    joint[:, 1] += v_gain * arctan2(motion.v, plant.parameters.reach)
    first = int(np.searchsorted(motion.time, -(extra + 0.5) * period))
    if filters is not None:
        law = friction or Friction("none")
        turning = rates(motion.q[:, :2], period)[0]
        if dither:
            torque = dithered_torque(law, motion.torque, turning, period, first)
        else:
            torque = motor_torque(law, motion.torque, turning)
        joint += errors_for(filters, torque)
    count = extra + len(reference.time)
    tip = np.pad(reference.tip, ((extra, 0), (0, 0)), mode="edge")
    return Reference(period * np.arange(count, dtype=float), tip, joint[first : first + count])


def true_tip_motion(reference: Reference, plant: Plant, rest: float = REST) -> TrueTipMotion:
    """Return the bounded motion of a plant whose true tip is on the reference at every sample.

    rest: [s] put before and after.

    Raises:
        ParameterError: the inversion does not exist or does not converge.
    """
    h = float(reference.time[1] - reference.time[0])
    pad = math.ceil(rest / h)
    tip = np.pad(reference.tip, ((pad, pad), (0, 0)), mode="edge")  # (K, 2)
    at_rest = np.zeros((1, len(plant.rest_state((0.0, 0.0))) // 2))
    plant.needed_force(at_rest, at_rest, at_rest)  # refuses a plant without an inverse
    linear = linearise(plant)
    inverse = _inverse_response(linear, plant, len(tip), h)
    bend: Array = np.zeros((len(tip), len(linear.M) - 2))
    change = math.inf
    for _ in range(ITERATIONS):
        q = _on_path(plant, reference, tip, bend)
        force = plant.needed_force(q, *rates(q, h))
        step = _filtered(inverse, -force[:, 2:])
        bend = bend + step
        change = float(np.abs(product(step, linear.tip[2:])).max())
        if not change > CONVERGED:
            break
    if not change <= CONVERGED:
        raise ParameterError(
            f"the inversion of the tip does not converge (v still changes by {change:.2g} m): the "
            "trajectory is too fast for this beam; give it more time"
        )
    q = _on_path(plant, reference, tip, bend)
    torque: Array = plant.needed_force(q, *rates(q, h))[:, :2] / np.diag(linear.S[:2])
    time: Array = h * (np.arange(len(q), dtype=float) - pad)
    return TrueTipMotion(time, q, plant.deflection(q)[1], torque, change)


def _on_path(plant: Plant, reference: Reference, tip: Array, bend: Array) -> Array:
    """Return positions (K, m) with the beam bent as given (K, m-2) and its true tip on `tip`.

    The bent arm is a rigid one whose second link is the chord from joint 2 to the tip.
    """
    L_R = plant.parameters.L_R
    q = np.hstack([np.zeros_like(tip), bend])
    along, v = plant.deflection(q)
    chord = np.sqrt(along**2 + v**2)
    cosine = (np.sum(tip * tip, axis=1) - L_R**2 - chord**2) / (2 * L_R * chord)
    if not (np.abs(cosine) < 1).all():
        raise ParameterError(
            "the bent arm cannot reach the path; keep it farther from the straight or folded arm"
        )
    elbow = arctan2(np.sqrt(1 - cosine**2), cosine) * np.sign(reference.joint[0, 1])
    first = arctan2(tip[:, 1], tip[:, 0]) - arctan2(chord * sin(elbow), L_R + chord * cos(elbow))
    turns = np.round((reference.joint[0, 0] - first[0]) / (2 * np.pi))
    q[:, 0] = np.unwrap(first) + 2 * np.pi * turns
    q[:, 1] = elbow - arctan2(v, along)
    return q


def rates(q: Array, h: float) -> tuple[Array, Array]:
    """Return first and second central differences (K, m) of positions at rest at both ends."""
    ends = np.pad(q, ((1, 1), (0, 0)), mode="edge")
    return (ends[2:] - ends[:-2]) / (2 * h), (ends[2:] - 2 * q + ends[:-2]) / h**2


def tip_zeros(linear: LinearPlant, reach: float) -> NDArray[np.complex128]:
    """Return the zeros (2n,) [rad/s] of the beam's motion with theta1 and the true tip held.

    Args:
        linear: of n flexible coordinates; reach: r + L [m].
    """
    M, D, K = _held(linear, reach)
    return eigenvalues(state_matrix(M, D, K))


def _held(linear: LinearPlant, reach: float) -> tuple[Array, Array, Array]:
    """Return mass, damping, stiffness (n, n) of the beam when theta2 moves by -v/reach."""
    turn = linear.tip[2:] / reach
    return (
        linear.M[2:, 2:] - np.outer(linear.M[2:, 1], turn),
        linear.D[2:, 2:] - np.outer(linear.D[2:, 1], turn),
        linear.K[2:, 2:],
    )


def _inverse_response(linear: LinearPlant, plant: Plant, samples: int, h: float) -> Spectrum:
    """Return the beam's response (F, n, n) to forces, tip held, at the FFT's frequencies.

    Derivatives are those of `rates`, so that the iteration ends at rounding.
    """
    reach = plant.parameters.reach
    zeros = tip_zeros(linear, reach)
    nearest = np.argsort(np.abs(zeros.real) / np.abs(zeros))
    worst = zeros[nearest[0]] if len(zeros) else 1.0  # a rigid link has none
    if abs(worst.real) < ON_AXIS * abs(worst):
        raise ParameterError(
            f"with its tip held the beam swings freely at {abs(worst):.4g} rad/s, so no bounded "
            "inversion exists; change the beam or its number of modes"
        )
    M, D, K = _held(linear, reach)
    return inverse_responses(M, D, K, h, samples)


def _filtered(response: Spectrum, x: Array) -> Array:
    """Return x (K, n) filtered by a response (F, n, n) over a period of K samples."""
    spectrum = np.fft.rfft(x, axis=0)
    return np.fft.irfft(multiplied(response, spectrum), n=len(x), axis=0)
