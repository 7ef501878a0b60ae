"""Repeats of a run: the same controller with its gains' fourth digits changed, and their medians.

>>> controllers = perturbed(TUNED["line"], 20, np.random.default_rng(1))
>>> medians(measure(plant, setting("none"), reference, controllers)).envelope      # [m]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from controllers import Controller, Gains

PERTURBATION = 1e-4  # relative: the fourth digit of each gain


def perturbed(controller: Controller, count: int, rng: np.random.Generator) -> list[Controller]:
    """Return copies of a controller, every gain changed by a relative PERTURBATION (1 sd)."""

    def shaken(gains: Gains) -> Gains:
        factors = 1 + PERTURBATION * rng.standard_normal(3)
        return replace(
            gains, k1=gains.k1 * factors[0], k2=gains.k2 * factors[1], k3=gains.k3 * factors[2]
        )

    return [
        replace(controller, joint1=shaken(controller.joint1), joint2=shaken(controller.joint2))
        for _ in range(count)
    ]


@dataclass(frozen=True)
class Medians:
    """Figures of merit over repeats, in SI units as `flexsim.loop.metrics.measures` has them.

    Repeats count as diverged when any of them did; medians and quartiles are of those that did
    not, None where there are none; diverged_at [s] is the earliest.
    """

    envelope: float | None
    max_error: float | None
    rms_error: float | None
    max_v: float | None
    residual_v: float | None
    index: float | None
    envelope_quartile_1: float | None
    envelope_quartile_3: float | None
    runs: int
    diverged: bool
    diverged_share: float
    diverged_at: float | None
    growth: float | None = None
    effort: float | None = None
    peak_torque_1: float | None = None
    peak_torque_2: float | None = None
    rms_torque_1: float | None = None
    rms_torque_2: float | None = None
    variation_1: float | None = None
    variation_2: float | None = None


TORQUES = tuple(
    f"{name}_{j}" for name in ("peak_torque", "rms_torque", "variation") for j in (1, 2)
)


def medians(figures: Sequence[dict[str, Any]]) -> Medians:
    """Return the medians of runs' figures of merit, the envelope's quartiles and divergences."""
    kept = [each for each in figures if not each["diverged"]]

    def part(name: str, percent: float = 50.0) -> float | None:
        known = [each[name] for each in kept if each.get(name) is not None]
        return float(np.percentile(known, percent)) if known else None

    times = [each["diverged_at"] for each in figures if each["diverged"]]
    return Medians(
        envelope=part("envelope"),
        max_error=part("max_error"),
        rms_error=part("rms_error"),
        max_v=part("max_v"),
        residual_v=part("residual_v"),
        index=part("index"),
        envelope_quartile_1=part("envelope", 25.0),
        envelope_quartile_3=part("envelope", 75.0),
        runs=len(figures),
        diverged=bool(times),
        diverged_share=len(times) / len(figures),
        diverged_at=float(min(times)) if times else None,
        growth=part("growth"),
        effort=part("effort"),
        **{name: part(name) for name in TORQUES},
    )
