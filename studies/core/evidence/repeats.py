"""Repeats of a run: the same controller with its gains' fourth digits changed, and their medians.

>>> controllers = perturbed(TUNED["line"], 20, np.random.default_rng(1))
>>> medians(measure(plant, setting("none"), reference, controllers)).envelope      # [m]

How many runs it takes is found by doubling, see `counts`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, Self, TypeVar

import numpy as np

from studies.core.evidence.intervals import (
    median_interval,
    quantile,
    quantile_interval,
    share_interval,
)

GAINS = 6  # k1 to k6 of both joints
PERTURBATION = 1e-4  # relative: the fourth digit of each gain
FIRST, MOST = 20, 320  # runs: with how many doubling begins, and where it ends
WIDE = 5e-5  # [m] half of a digit printed: an envelope's interval need not be narrower
WIDE_SHARE = 0.01  # of the median: nor than this


class Scalable(Protocol):
    """A controller whose gains can be changed."""

    def scaled(self, factors: Any) -> Self:
        """Return the same with gains k1 to k6 times factors (6,)."""


Some = TypeVar("Some", bound=Scalable)


def perturbed(controller: Some, count: int, rng: np.random.Generator) -> list[Some]:
    """Return copies of a controller, every gain changed by a relative PERTURBATION (1 sd)."""
    factors = 1 + PERTURBATION * rng.standard_normal((count, GAINS))
    return [controller.scaled(each) for each in factors]


def counts(asked: int | None = None) -> Iterator[int]:
    """Give the numbers of runs after which to look whether they are enough.

    Args:
        asked: exactly so many; None for FIRST, twice that, and so on to MOST.
    """
    if asked is not None:
        yield asked
        return
    count = FIRST
    while count <= MOST:
        yield count
        count *= 2


def are_enough(envelopes: Sequence[float]) -> bool:
    """Return whether the median's interval is as narrow as it need be.

    Its half-width is at most WIDE, or WIDE_SHARE of the median; or there is none to be had, because
    half of the runs surely diverge. Stopping at what is found narrow costs coverage: with normal or
    lognormal runs 94 % of such intervals or more still had the true median in them, where it lies
    in a gap between two clusters 87 % (2,000 repetitions each).

    Args:
        envelopes: of every run [m], inf where diverged.
    """
    ends = median_interval(envelopes)
    if ends is None:
        return False
    low, high = ends
    if math.isinf(low):
        return True
    return (high - low) / 2 <= max(WIDE, WIDE_SHARE * quantile(envelopes))


@dataclass(frozen=True)
class Medians:
    """Figures of merit over repeats, in SI units as `flexsim.loop.metrics.measures` has them.

    A run that diverged counts as larger than all that did not. So where half of the runs or more
    diverged there is no median, None, and an interval's end is None where it is such a run's, and
    both are where there are fewer than six runs. Repeats count as diverged when any of them did;
    diverged_at [s] is the earliest.

    Attributes:
        envelope_low, envelope_high: 95 % interval of the median, by order statistics.
        diverged_share_low, diverged_share_high: 95 % interval, Wilson's.
        spread: quartiles and interval of every other figure, by its name and `_quartile_1`,
            `_quartile_3`, `_low`, `_high`.
    """

    envelope: float | None
    envelope_low: float | None
    envelope_high: float | None
    envelope_quartile_1: float | None
    envelope_quartile_3: float | None
    runs: int
    diverged: bool
    diverged_share: float
    diverged_share_low: float
    diverged_share_high: float
    diverged_at: float | None
    max_error: float | None = None
    rms_error: float | None = None
    max_v: float | None = None
    residual_v: float | None = None
    index: float | None = None
    growth: float | None = None
    effort: float | None = None
    peak_torque_1: float | None = None
    peak_torque_2: float | None = None
    rms_torque_1: float | None = None
    rms_torque_2: float | None = None
    variation_1: float | None = None
    variation_2: float | None = None
    spread: Mapping[str, float | None] = field(default_factory=dict, hash=False)

    def interval(self, name: str) -> tuple[float | None, float | None]:
        """Return the 95 % interval of a figure's median; None for an end that it does not have."""
        if name in ("envelope", "diverged_share"):
            return getattr(self, f"{name}_low"), getattr(self, f"{name}_high")
        return self.spread.get(f"{name}_low"), self.spread.get(f"{name}_high")


TORQUES = tuple(
    f"{name}_{j}" for name in ("peak_torque", "rms_torque", "variation") for j in (1, 2)
)
LENGTHS = ("max_error", "rms_error", "max_v", "residual_v")
OTHERS = (*LENGTHS, "index", "growth", "effort", *TORQUES)  # beside the envelope


def values_of(figures: Sequence[Mapping[str, Any]], name: str) -> list[float]:
    """Return a figure of all runs, inf where diverged; nothing of a run that does not have it."""
    found = [math.inf if each["diverged"] else each.get(name) for each in figures]
    return [each for each in found if each is not None]


def _known(number: float) -> float | None:
    return number if math.isfinite(number) else None


def summary(name: str, values: Sequence[float]) -> dict[str, float | None]:
    """Return median, interval and quartiles of runs by name; inf, where diverged, becomes None."""
    keys = (name, *(f"{name}_{part}" for part in ("low", "high", "quartile_1", "quartile_3")))
    if not values:
        return dict.fromkeys(keys)
    low, high = quantile_interval(values) or (math.inf, math.inf)
    found = (quantile(values), low, high, quantile(values, 0.25), quantile(values, 0.75))
    return dict(zip(keys, map(_known, found), strict=True))


def medians(figures: Sequence[Mapping[str, Any]]) -> Medians:
    """Return the medians of runs' figures of merit, how sure they are, and divergences."""
    times = [each["diverged_at"] for each in figures if each["diverged"]]
    low, high = share_interval(len(times), len(figures))
    others: dict[str, float | None] = {}
    for name in OTHERS:
        others |= summary(name, values_of(figures, name))
    middle: dict[str, Any] = {name: others.pop(name) for name in OTHERS}
    return Medians(
        **summary("envelope", values_of(figures, "envelope")),
        **middle,
        runs=len(figures),
        diverged=bool(times),
        diverged_share=len(times) / len(figures),
        diverged_share_low=low,
        diverged_share_high=high,
        diverged_at=float(min(times)) if times else None,
        spread=others,
    )


def single(figures: Mapping[str, Any]) -> Medians:
    """Return the figures of one run that is not repeated: without quartiles or intervals."""
    found = medians([figures])
    return replace(
        found,
        envelope_quartile_1=None,
        envelope_quartile_3=None,
        spread=dict.fromkeys(found.spread),
    )


def middle_run(figures: Sequence[Mapping[str, Any]]) -> int:
    """Return which run is the median one by its envelope, of an even number the lower middle.

    Runs that diverged come after all others, the sooner they did the later.
    """

    def rank(i: int) -> tuple[bool, float]:
        each = figures[i]
        return each["diverged"], -each["diverged_at"] if each["diverged"] else each["envelope"]

    return sorted(range(len(figures)), key=rank)[(len(figures) - 1) // 2]
