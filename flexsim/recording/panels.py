"""What a recording's views show, as plain data: kept in the file, so that they can be made anew.

>>> plans_from(plans_text([plan])) == [plan]            # doctest: +SKIP

A `Plan` is of one case: its plots, what its map covers. Paths of entities are relative to the
case, so that several recordings can stand side by side.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import pydantic

from flexsim.errors import RunError
from flexsim.recording.colours import Colour
from flexsim.recording.traces import TIMELINE

NOWHERE = (0.0, 1.0, 0.0, 1.0)  # a map of nothing
HEADROOM = 0.05  # beside the curves, as a share of what they span
DENSEST = 5.4  # multiples that curves span at most, for labels on a fourth of 700 pixels
ROOMY = 6.6  # the same on a third
LABELS = 2  # that an axis has at least
CHEAP = 0.08  # of the span, which an axis is extended by to have one more
SMALLEST = 1e-3  # span of an axis, in its unit


@dataclass(frozen=True)
class Series:
    """One curve of a plot.

    Attributes:
        entity: path below the case. component: of it. field: of that.
        name: for the tooltip. width: [points].
    """

    entity: str
    component: str
    field: str
    name: str
    colour: Colour
    width: float = 1.2


@dataclass(frozen=True)
class Panel:
    """One plot: its title says quantity, unit and whose curve is which; its range is explicit."""

    tab: str
    title: str
    low: float
    high: float
    series: tuple[Series, ...]


@dataclass(frozen=True)
class Page:
    """A text, or an image: its title, its entity."""

    title: str
    entity: str
    image: bool = False


@dataclass(frozen=True)
class Plan:
    """What the views of one case show.

    Attributes:
        name: of the case, and of its entities. end: of the longest curve [s].
        title: of the map; short: of a small one. bounds: of the map, x and y from and to [m];
            within: of its part that has the arms.
        panels: its plots. states: whether it has lanes of states. notes: whether it has a text.
        scene: whether it has a map. texts: titles and entities of texts that several cases share.
        timeline: of its curves.
    """

    name: str
    end: float
    title: str
    bounds: tuple[float, float, float, float]
    within: tuple[float, float, float, float]
    short: str
    panels: tuple[Panel, ...] = ()
    states: bool = False
    notes: bool = True
    scene: bool = True
    texts: tuple[tuple[str, str], ...] = ()
    timeline: str = TIMELINE


PLANS = pydantic.TypeAdapter(tuple[Plan, ...])


def plans_text(plans: Sequence[Plan]) -> str:
    """Return plans as JSON."""
    return PLANS.dump_json(tuple(plans)).decode()


def plans_from(text: str) -> tuple[Plan, ...]:
    """Return the plans of a JSON text.

    Raises:
        RunError: it is none of ours.
    """
    try:
        return PLANS.validate_json(text)
    except pydantic.ValidationError as error:
        where = ".".join(str(each) for each in error.errors()[0]["loc"])
        raise RunError(f"the recording's plan cannot be read at {where or 'its start'}") from None


def rounded(values: Iterable[float], densest: float = DENSEST) -> tuple[float, float]:
    """Return ends of an axis beyond the values, with two or more powers of ten's multiples inside.

    The viewer labels an axis at multiples of one power of ten, as far as they are not too dense: an
    axis that just holds its curves may have one label, or none.

    Args:
        values: those not finite are left out. densest: multiples for whose labels there is room.
    """
    finite = [float(each) for each in values if math.isfinite(each)] or [0.0]
    low, high = min(finite), max(finite)
    if low == high:
        low, high = low - 1.0, high + 1.0
    span = max(high - low, 1e-6 * max(abs(low), abs(high)), SMALLEST)
    pitch = 10.0 ** math.ceil(math.log10(span / densest) - 1e-9)
    margin = HEADROOM * max(span, pitch)
    low, high = low - margin, high + margin
    below, above = pitch * (math.ceil(low / pitch) - 1), pitch * (math.floor(high / pitch) + 1)
    if low - below < CHEAP * span:
        low, below = below - margin, below - pitch
    if above - high < CHEAP * span:
        high, above = above + margin, above + pitch
    while round((above - below) / pitch) - 1 < LABELS:
        if low - below < above - high:
            low, below = below - margin, below - pitch
        else:
            high, above = above + margin, above + pitch
    return low, high


def one_two_five(most: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is no larger than a number."""
    power = 10.0 ** math.floor(math.log10(most))
    ratio = most / power * (1 + 1e-12)
    return power * (5.0 if ratio >= 5 else 2.0 if ratio >= 2 else 1.0)
