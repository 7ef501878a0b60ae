"""The plants behind three compiled functions, `physics_step`, `tip_in_hub` and `elbow`.

A plant's state is one array: generalised positions, then velocities, of which the first two are
theta1 and theta2. Compiled code chooses the plant by the type of its coefficients, so one closed
loop serves all; interpreted code (`NUMBA_DISABLE_JIT=1`) chooses it at the call.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba.extending import overload

from flexsim.errors import ParameterError
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array
from flexsim.plants.assumed_modes import AssumedModes, acceleration, rk4_step
from flexsim.plants.closed_form_chain import ROWS, ClosedChain, closed_chain_step
from flexsim.plants.exudyn_beam.calls import exudyn_step, exudyn_tip
from flexsim.plants.exudyn_beam.frames import ExudynBeam
from flexsim.plants.mujoco_steps import (
    Chain,
    Rod,
    chain_elbow,
    chain_step,
    chain_tip,
    rod_step,
    rod_tip,
)
from flexsim.plants.printed import PrintedModes, printed_acceleration
from flexsim.plants.two_flexible.equations import (
    TwoBeams,
    two_beams_acceleration,
    two_beams_elbow,
    two_beams_tip,
)

Coefficients = AssumedModes | PrintedModes | TwoBeams | Chain | ClosedChain | Rod | ExudynBeam


@jit
def modes_step(
    p: AssumedModes, slot: int, state: Array, tau_1: float, tau_2: float, work: Array
) -> None:
    """Advance the consistent assumed modes by one Runge-Kutta step."""
    rk4_step(acceleration, p, p.step, state, tau_1, tau_2, work)


@jit
def printed_step(
    p: PrintedModes, slot: int, state: Array, tau_1: float, tau_2: float, work: Array
) -> None:
    """Advance the printed assumed modes by one Runge-Kutta step."""
    rk4_step(printed_acceleration, p, p.step, state, tau_1, tau_2, work)


@jit
def modes_tip(p: AssumedModes, state: Array):  # type: ignore[no-untyped-def]
    """Return the tip along and across the hub's x-axis, from joint 2 [m], with its shortening.

    Source: (16); the shortening u = -1/2 int v'^2 dx.
    """
    n = p.tip.shape[0]
    v = shortening = 0.0
    for j in range(n):
        v += p.tip[j] * state[2 + j]
        for i in range(n):
            shortening -= 0.5 * p.slope[j, i] * state[2 + j] * state[2 + i]
    return p.reach + shortening, v


@jit
def printed_tip(p: PrintedModes, state: Array):  # type: ignore[no-untyped-def]
    """Return `modes_tip` of the printed equations' state."""
    return modes_tip(p, state)


@jit
def closed_chain_tip(p: ClosedChain, state: Array):  # type: ignore[no-untyped-def]
    """Return `chain_tip` of the closed form's state, which is MuJoCo's."""
    return chain_tip(p, state)


@jit
def closed_chain_elbow(p: ClosedChain, L_R: float, state: Array):  # type: ignore[no-untyped-def]
    """Return `chain_elbow` of the closed form's state."""
    return chain_elbow(p, L_R, state)


@jit
def two_beams_step(
    p: TwoBeams, slot: int, state: Array, tau_1: float, tau_2: float, work: Array
) -> None:
    """Advance the assumed modes of two flexible links by one Runge-Kutta step."""
    rk4_step(two_beams_acceleration, p, p.step, state, tau_1, tau_2, work)


@jit
def rigid_elbow(p, L_R: float, state: Array):  # type: ignore[no-untyped-def]
    """Return where joint 2 is on a link 1 that does not bend."""
    return L_R, 0.0, 0.0


@jit
def work_space(m: int) -> Array:
    """Return room for a step of any plant of m coordinates."""
    return np.zeros((ROWS, m))


_STEPS: dict[type, Callable[..., Any]] = {
    AssumedModes: modes_step,
    PrintedModes: printed_step,
    TwoBeams: two_beams_step,
    Chain: chain_step,
    ClosedChain: closed_chain_step,
    Rod: rod_step,
    ExudynBeam: exudyn_step,
}
_TIPS: dict[type, Callable[..., Any]] = {
    AssumedModes: modes_tip,
    PrintedModes: printed_tip,
    TwoBeams: two_beams_tip,
    Chain: chain_tip,
    ClosedChain: closed_chain_tip,
    Rod: rod_tip,
    ExudynBeam: exudyn_tip,
}
_ELBOWS: dict[type, Callable[..., Any]] = {  # of plants whose link 1 may bend
    TwoBeams: two_beams_elbow,
    Chain: chain_elbow,
    ClosedChain: closed_chain_elbow,
}


def register(
    coefficients: type,
    step: Callable[..., Any],
    tip: Callable[..., Any],
    elbow: Callable[..., Any] = rigid_elbow,
) -> None:
    """Let loops run another kind of plant, by the type of its coefficients.

    Args:
        coefficients: a NamedTuple, with a field `step` [s].
        step, tip, elbow: compiled, with the arguments of `modes_step`, `modes_tip`, `rigid_elbow`.

    Raises:
        ParameterError: that type is known already.
    """
    if coefficients in _STEPS:
        raise ParameterError(f"{coefficients.__name__} is registered already; give another type")
    _STEPS[coefficients], _TIPS[coefficients], _ELBOWS[coefficients] = step, tip, elbow


def physics_step(
    plant: Coefficients, slot: int, state: Array, tau_1: float, tau_2: float, work: Array
) -> None:
    """Advance a plant's state by one physics step with the joint torques held [N m].

    Args:
        plant: coefficients; slot: index of the running thread.
        state: (2 m,), overwritten; work: of `work_space`.
    """
    _STEPS[type(plant)](plant, slot, state, tau_1, tau_2, work)


def tip_in_hub(plant: Coefficients, state: Array) -> tuple[float, float]:
    """Return the tip along and across the hub's x-axis, from joint 2 [m]; the second is v."""
    return _TIPS[type(plant)](plant, state)


def elbow(plant: Coefficients, L_R: float, state: Array) -> tuple[float, float, float]:
    """Return joint 2 along and across link 1 at joint 1 [m], and how far its end has turned [rad].

    L_R: length of link 1, as long as it is straight [m].
    """
    return _ELBOWS.get(type(plant), rigid_elbow)(plant, L_R, state)


@overload(physics_step, jit_options={"forceinline": True})
def _physics_step(plant, slot, state, tau_1, tau_2, work):  # type: ignore[no-untyped-def]
    step = _STEPS[plant.instance_class]
    return lambda plant, slot, state, tau_1, tau_2, work: step(
        plant, slot, state, tau_1, tau_2, work
    )


@overload(tip_in_hub, jit_options={"forceinline": True})
def _tip_in_hub(plant, state):  # type: ignore[no-untyped-def]
    tip = _TIPS[plant.instance_class]
    return lambda plant, state: tip(plant, state)


@overload(elbow, jit_options={"forceinline": True})
def _elbow(plant, L_R, state):  # type: ignore[no-untyped-def]
    where = _ELBOWS.get(plant.instance_class, rigid_elbow)
    return lambda plant, L_R, state: where(plant, L_R, state)
