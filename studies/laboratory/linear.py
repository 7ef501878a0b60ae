"""From which size of a suspect on does the exact linear loop grow? What no run can blur.

>>> growth_rows(loops, place, suspects, sizes=9, decades=2.0)[0].grows        # [SI]

A beam of many modes under exact hold, at rest at several poses, without friction and with its
slope beyond the dead zone (`flexsim.linear.exact_loop`). It knows gains, places, filters and
estimators of bridges, stiffness, damping, payload, delay and lags. What grows there need not
diverge in a run: the dead zone holds what is small, the torque limits what is large. But it is no
longer the loop that was designed, and what it does is decided by friction.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import bisect

from flexsim.linear.exact_loop import EXACT_POSES, NO_FRICTION, exact_growth, exact_loops
from flexsim.linear.growth import SLACK, quantised
from flexsim.linear.loop_poles import small_signal
from flexsim.numerics.types import Array
from studies.laboratory.alone import sizes_of
from studies.laboratory.loops import Loops
from studies.laboratory.place import MORE, Place
from studies.laboratory.suspects import Suspect

FINE = 1e-4  # of the logarithm of a size from which on a loop grows


@dataclass(frozen=True)
class GrowthRow:
    """Growth of a case's exact linear loop over a suspect's size.

    Attributes:
        suspect: with its sign. least, largest: sizes [SI]. growth, growth_most: at these [1/s].
        grows: from which size on it is above `SLACK` [SI]; 0 from the least on, None for nowhere.
    """

    controllers: str
    suspect: str
    case: str
    least: float
    largest: float
    growth: float
    growth_most: float
    grows: float | None


def linear_of(place: Place) -> Any:
    """Return what the exact linear loop knows of a place: places that share it have one growth."""
    return place.parameters, place.setting.hardware.linear, small_signal(place.setting.friction)


def is_linear(suspect: Suspect, place: Place) -> bool:
    """Return whether its size, or its being there, changes the exact linear loop at a place."""
    most = linear_of(suspect.at(place, suspect.most))
    other = linear_of(suspect.at(place, suspect.most / 100) if suspect.sized else place)
    return bool(most != other)


def growth_at(loops: Loops, place: Place) -> Array:
    """Return growth (C,) of the cases' exact linear loops at a place [1/s], the worst of poses,
    without friction and with its slope.
    """
    parameters, hardware, slope = linear_of(place)
    plants = exact_loops(
        parameters,
        EXACT_POSES,
        slopes=(NO_FRICTION, slope),
        hardware=hardware,
        v_gain=loops.v_gain,
    )
    first = np.arange(len(loops.cases)) * loops.repeats
    return quantised(exact_growth(plants, loops.controllers.chosen(first)))


def growth_rows(
    loops: Loops, place: Place, suspects: Sequence[Suspect], sizes: int, decades: float
) -> list[GrowthRow]:
    """Return the growth of every case over every suspect that the linear loop knows."""
    rows = []
    if loops.v_gain == 0.0:
        place = place.without_v
    for each in suspects:
        if not is_linear(each, place):
            continue
        its = sizes_of(each, sizes if each.sized else 1, decades)
        for sign in each.signs:
            growth = np.array([growth_at(loops, each.at(place, sign * size)) for size in its])
            name = each.name if len(each.signs) == 1 else f"{each.name} {'+' if sign > 0 else '-'}"
            whole = any(one.how is MORE for one in each.changes)
            for number, (case, own) in enumerate(zip(loops.cases, growth.T, strict=True)):
                ends = float(its[0]), float(its[-1]), float(own[0]), float(own[-1])
                between = partial(_growth_of, loops, place, each, sign, number)
                grows = crossing(its, own, None if whole else between)
                rows.append(GrowthRow(loops.name, name, case.name, *ends, grows))
    return rows


def _growth_of(
    loops: Loops, place: Place, suspect: Suspect, sign: int, case: int, size: float
) -> float:
    """Return the growth of one case's loop at a suspect's size [1/s]."""
    return float(growth_at(loops, suspect.at(place, sign * size))[case])


def crossing(sizes: Array, growth: Array, between: Callable[[float], float] | None) -> float | None:
    """Return the size from which on growth (K,) exceeds `SLACK`, 0 for the least, None for none.

    Growth may bend within less than what parts two sizes, so it is asked, not interpolated.

    Args:
        sizes: (K,) rising. between: growth at any size [1/s]; None if sizes are whole numbers.
    """
    grows = growth > SLACK
    if not grows.any():
        return None
    k = int(grows.argmax())
    if k == 0:
        return 0.0
    if between is None:
        return float(round(sizes[k]))
    ends = np.log(sizes[k - 1]), np.log(sizes[k])
    return float(np.exp(bisect(lambda log: between(np.exp(log)) - SLACK, *ends, xtol=FINE)))
