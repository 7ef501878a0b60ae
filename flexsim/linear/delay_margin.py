"""How much later may both torques come? The delay at which a pole reaches the unit circle.

>>> delay_margin(exact_loops(Parameters(), (1.5,)), stack([controller], period=1e-3))    # [s]

Delay is any number of seconds beside what the hardware has: whole samples are states, and the rest
splits the hold, exactly. Growth rises and falls with delay, so the first crossing is looked for in
steps of a fortieth of a period, then halved; what grows for less than a step is not seen.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from flexsim.errors import ParameterError
from flexsim.linear.exact_loop import exact_growth
from flexsim.linear.growth import quantised
from flexsim.linear.linearise import split_hold, zero_order_hold
from flexsim.linear.loop_poles import SampledPlant, seen_plant
from flexsim.loop.control.compiled import Controllers
from flexsim.numerics.types import Array

LONGEST = 0.02  # [s] beyond, a margin is inf
PARTS = 40  # of a period that a crossing is looked for in
HALVINGS = 20  # of such a part: 2e-11 s
SAME = 1e-9  # of a period: rounding of a whole number of them


def late(sampled: SampledPlant, extra: float) -> SampledPlant:
    """Return a plant whose two torques come later by a time, states last.

    Args:
        sampled: under exact hold. extra: 0 or more [s].

    Raises:
        ParameterError: the hold is another, or the delay is negative or not finite.
    """
    if sampled.options.hold != "exact":
        raise ParameterError("a delay of any length needs the exact hold; give hold='exact'")
    if not 0 <= extra < math.inf:
        raise ParameterError(f"extra delay is {extra} s; give a finite number, 0 or more")
    return _late(sampled, extra)


@lru_cache(maxsize=2048)
def _late(sampled: SampledPlant, extra: float) -> SampledPlant:
    hardware, period = sampled.options.hardware, sampled.period
    lags = (hardware.lag, hardware.effects.amplifier)
    whole = math.floor(extra / period + SAME)
    rest = extra - whole * period
    if rest <= SAME * period:
        A, new = zero_order_hold(sampled.linear, period, *lags)
        old = np.zeros_like(new)
    else:
        A, old, new = split_hold(sampled.linear, period, rest, *lags)
    gain = np.array(sampled.options.torque_gain)
    parts = _waiting(A, old * gain, new * gain, hardware.delay + whole)
    C = np.zeros((3, len(parts[0])))
    moved = replace(sampled, A=parts[0], B=parts[1], C=C, memory=0)
    if sampled.memory:
        C[:, : len(sampled.linear.A)] = sampled.linear.C
        return seen_plant(moved)
    C[:, : len(A)] = sampled.C[:, : len(A)]  # what is seen is of the plant's own states
    return moved


def _waiting(A: Array, old: Array, new: Array, whole: int) -> tuple[Array, Array]:
    """Return (A, B) where commands wait `whole` samples for `new`, one more for `old`.

    The commands that wait are states, those of both joints one sample ago first.
    """
    n, more = len(A), 2 * (whole + 1)
    total, into = np.zeros((n + more, n + more)), np.zeros((n + more, 2))
    total[:n, :n], total[:n, -2:] = A, old
    total[n + 2 :, n:-2] = np.eye(more - 2)
    into[n : n + 2] = np.eye(2)
    if whole:
        total[:n, -4:-2] = new
    else:
        into[:n] = new
    return total, into


def late_growth(loops: Iterable[SampledPlant], controllers: Controllers, extra: float) -> Array:
    """Return growth rates (P,) [1/s] with an extra delay [s], the largest over the plants."""
    return exact_growth([late(each, extra) for each in loops], controllers)


def delay_margin(
    loops: Iterable[SampledPlant], controllers: Controllers, longest: float = LONGEST
) -> float:
    """Return the smallest extra delay of both torques at which one of the loops grows [s].

    Args:
        loops: exact plants, of `exact_loops`. controllers: one.

    Returns:
        0 if one grows already; inf if none does up to `longest`.

    Raises:
        ParameterError: more than one controller is given, or a plant is not held exactly.
    """
    if len(controllers.b) != 1:
        raise ParameterError(f"{len(controllers.b)} controllers are given; a loop has one")
    plants = tuple(loops)

    def grows(extra: float) -> bool:
        return bool(quantised(late_growth(plants, controllers, extra))[0] > 0)

    if grows(0.0):
        return 0.0
    part = plants[0].period / PARTS
    for k in range(1, math.ceil(longest / part - SAME) + 1):
        if grows(k * part):
            low, high = (k - 1) * part, k * part
            for _ in range(HALVINGS):
                middle = (low + high) / 2
                low, high = (low, middle) if grows(middle) else (middle, high)
            return high
    return math.inf
