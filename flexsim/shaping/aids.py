"""What a reference is helped by, of a model of the robot: the same help for any controller.

>>> aided(reference, model, "true-tip", v_gain=0.0)

The model is the designer's, not the plant that a run happens on: what is not told to the
controllers is not told to the reference either.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from flexsim.errors import ParameterError
from flexsim.loop.trajectories import Reference
from flexsim.plants.base import Plant
from flexsim.shaping.input_shaper import for_modes, joint_free_modes, joint_held_modes, shaped_by
from flexsim.shaping.true_tip import rates, shaped_reference

PLAIN = "plain"
Aid = Callable[[Reference, Plant, float], Reference]


def rigid_torque(reference: Reference, model: Plant) -> Reference:
    """Return a reference with the torque fed forward that its joints need, the beam rigid [N m].

    What the joint reference takes by the model's inverse dynamics, the beam straight all the time;
    friction apart.
    """
    period = float(reference.time[1] - reference.time[0])
    q = np.zeros((len(reference.time), len(model.rest_state((0.0, 0.0))) // 2))
    q[:, :2] = reference.joint
    torque = model.needed_force(q, *rates(q, period))[:, :2]
    return replace(reference, torque=torque / np.diag(model.linearised(0.0).S[:2]))


def _plain(reference: Reference, model: Plant, v_gain: float) -> Reference:
    return reference


def _true_tip(reference: Reference, model: Plant, v_gain: float) -> Reference:
    return shaped_reference(reference, model, v_gain=v_gain)


def _feedforward(reference: Reference, model: Plant, v_gain: float) -> Reference:
    return rigid_torque(reference, model)


def _shaper(kind: str, modes: Callable[..., list[tuple[float, float]]]) -> Aid:
    """Return the help of an input shaper for the model's first mode, at the middle of the path."""

    def shaped(reference: Reference, model: Plant, v_gain: float) -> Reference:
        middle = float(np.median(reference.joint[:, 1]))
        return shaped_by(reference, for_modes(kind, modes(model.linearised(middle), 1)))

    return shaped


AIDS: Mapping[str, Aid] = {
    PLAIN: _plain,
    "true-tip": _true_tip,
    "feedforward": _feedforward,
    "zv-free": _shaper("zv", joint_free_modes),
    "zvd-free": _shaper("zvd", joint_free_modes),
    "zv-held": _shaper("zv", joint_held_modes),
    "zvd-held": _shaper("zvd", joint_held_modes),
}
"""Ways to help a reference: none, that the true tip is on it, the torque of the rigid arm, an input
shaper for the first mode, joints free or held as a stiff loop holds them."""


def aided(reference: Reference, model: Plant, aid: str, v_gain: float) -> Reference:
    """Return a reference with its help.

    Args:
        reference: sampled. model: what the help knows of the robot.
        aid: a key of `AIDS`. v_gain: factor of atan(v/(r+L)) in the loop, -1 in the paper.

    Raises:
        ParameterError: there is no such help, or it cannot be computed.
    """
    if aid not in AIDS:
        raise ParameterError(f"aid {aid!r} is unknown; choose one of {', '.join(AIDS)}")
    return AIDS[aid](reference, model, v_gain)


def pulsed(
    reference: Reference, pulse: tuple[float, float], span: tuple[float, float]
) -> Reference:
    """Return a reference whose run is disturbed by a pulse of torque at both motors.

    It enters where a torque fed forward does: after the controllers, ahead of delay and limits.

    Args:
        pulse: at the motors [N m]. span: when it begins and ends [s].

    Raises:
        ParameterError: the span is not within the reference.
    """
    begins, ends = span
    if not 0 <= begins < ends <= reference.time[-1]:
        raise ParameterError(
            f"a pulse lasts from {begins:g} to {ends:g} s; give a span within the trajectory's "
            f"{reference.time[-1]:g} s"
        )
    torque = np.zeros_like(reference.joint) if reference.torque is None else reference.torque.copy()
    torque[(reference.time >= begins) & (reference.time < ends)] += pulse
    return replace(reference, torque=torque)
