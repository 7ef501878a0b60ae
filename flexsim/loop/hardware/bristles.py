"""LuGre friction over a step: bristles whose bend is a state, moved exactly along the joint's way.

z' = w - sigma_0 |w| z / g(w), F = sigma_0 z + sigma_1 s(w) z' (+ sigma_2 w, which is mu's), with
Stribeck's curve g and s = exp(-(w/w_s)^2). Over a way at a held rate the bend goes to
g sign(w)/sigma_0 exponentially, so any step is stable, however stiff the bristles. The torque of a
step is its mean over the way that the rate at the start would go; the bend follows the way gone.
Stuck, that is position Verlet, stable for h (sigma_1 + sigma_2 + sigma_0 h/2) < 2 J of a joint. At
held rates no energy is made: F w summed over steps is at least the change of sigma_0 z^2/2. With
s = 1, as printed first, that is so only of slow joints.

Source: Canudas de Wit, Olsson, Astrom and Lischinsky (1995), (1)-(4); s(w) Olsson (1996).
"""

from __future__ import annotations

import numpy as np

from flexsim.loop.friction import stribeck_torque
from flexsim.loop.hardware.memory import BEFORE, BRISTLE
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array


@jit
def bent(z: float, way: float, g: float, sigma_0: float):  # type: ignore[no-untyped-def]
    """Return bristles' bend after a way, and on average over it [rad].

    Args:
        z: at the start [rad]. way: of the joint [rad]. g: of Stribeck's curve there [N m].
    """
    x = sigma_0 * abs(way) / g
    if x == 0.0:
        return z, z
    end = np.sign(way) * g / sigma_0
    left = np.expm1(-x)  # e^-x - 1
    return z - (end - z) * left, end + (end - z) * left / x


@jit
def bristle_torque(
    memory: Array,
    step: float,
    theta: float,
    w: float,
    tau_0: float,
    stiction: float,
    stribeck: float,
    sigma_0: float,
    sigma_1: float,
) -> float:
    """Return the bristles' mean torque over a step [N m], their bend in memory brought up to date.

    Args:
        memory: of one joint. step: [s]. theta, w: of the joint at the step's start [rad], [rad/s].
        tau_0, stiction, stribeck, sigma_0, sigma_1: as in `flexsim.loop.friction.Friction`.
    """
    if tau_0 <= 0.0:
        return 0.0
    way = theta - memory[BEFORE]
    gone = stribeck_torque(way / step, tau_0, stiction, stribeck)
    z, _ = bent(memory[BRISTLE], way, gone, sigma_0)
    memory[BEFORE], memory[BRISTLE] = theta, z
    g = stribeck_torque(w, tau_0, stiction, stribeck)
    after, mean = bent(z, w * step, g, sigma_0)
    damping = sigma_1 * np.exp(-((w / stribeck) ** 2))
    return sigma_0 * mean + damping * (after - z) / step
