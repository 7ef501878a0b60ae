"""LuGre friction over a step: bristles whose bend is a state, moved exactly at a rate that is held.

z' = w - sigma_0 |w| z / g(w), F = sigma_0 z + sigma_1 s(w) z' (+ sigma_2 w, which is mu's), with
Stribeck's curve g and s = exp(-(w/w_s)^2). At a rate held over a step the bend goes to
g sign(w)/sigma_0 exponentially, so any step is stable, however stiff the bristles, and the torque's
mean over the step is exact: no energy is made, F w summed over steps is at least the change of
sigma_0 z^2/2 (a test holds that). With s = 1, as printed first, that is so only of slow joints.

Source: Canudas de Wit, Olsson, Astrom and Lischinsky (1995), (1)-(4); s(w) Olsson (1996).
"""

from __future__ import annotations

import numpy as np

from flexsim.loop.friction import stribeck_torque
from flexsim.loop.hardware.memory import BRISTLE
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array


@jit
def bristle_torque(
    memory: Array,
    step: float,
    w: float,
    tau_0: float,
    stiction: float,
    stribeck: float,
    sigma_0: float,
    sigma_1: float,
) -> float:
    """Return the bristles' mean torque over a step [N m], their bend in memory moved on.

    Args:
        memory: of one joint. step: [s]. w: joint velocity, held [rad/s].
        tau_0, stiction, stribeck, sigma_0, sigma_1: as in `flexsim.loop.friction.Friction`.
    """
    z = memory[BRISTLE]
    g = stribeck_torque(w, tau_0, stiction, stribeck)
    if g <= 0.0:
        memory[BRISTLE] = 0.0
        return 0.0
    x = sigma_0 * abs(w) / g * step
    if x == 0.0:
        return sigma_0 * z
    end = np.sign(w) * g / sigma_0
    left = np.expm1(-x)  # e^-x - 1
    after = z - (end - z) * left
    memory[BRISTLE] = after
    mean = end + (end - z) * left / x
    damping = sigma_1 * np.exp(-((w / stribeck) ** 2))
    return sigma_0 * mean + damping * (after - z) / step
