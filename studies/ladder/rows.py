"""What the ladder finds: a row per plant, a row per integrator and step, in SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flexsim.numerics.types import Array
from studies.core.evidence.repeats import Medians
from studies.core.table import value


@dataclass(frozen=True)
class Tips:
    """Rms and largest distances from the reference [m], by torque; infinite if it ran away."""

    tip_small: float
    peak_small: float
    tip_large: float
    peak_large: float


@dataclass(frozen=True, eq=False)
class PlantRow:
    """One plant against the reference.

    Attributes:
        clamped_hz, joint_free_hz: (3,), nan where it has no such mode.
        rotation_error: relative, of the tip's static rotation under a moment there, nan if unknown.
        loaded_error: (3,) relative, of the clamped frequencies under a payload, see `.loaded`.
        loop: how one controller tracks; None of the reference, which is not run in closed loop.
        us_per_ms: cost. pareto: whether no other row is as cheap and as near.
    """

    plant: str
    step: float
    clamped_hz: Array
    joint_free_hz: Array
    tips: Tips
    loop: Medians | None
    rotation_error: float = math.nan
    loaded_error: Array = field(default_factory=lambda: np.full(3, np.nan))
    us_per_ms: float = math.nan
    pareto_small: bool = False
    pareto_large: bool = False


@dataclass(frozen=True, eq=False)
class ModalFigures:
    """What a step does to the first three modes.

    Attributes:
        frequency_shift: (3,) relative, of the frequency of swinging. damping_ratio: (3,) what the
            step adds to that of the chain. radius: largest |exp(s h)|, over 1 where the step is
            unstable.
    """

    frequency_shift: Array
    damping_ratio: Array
    radius: float


@dataclass(frozen=True, eq=False)
class IntegratorRow:
    """One integrator at one step on the chain; what moves is None where the step is unstable.

    Attributes:
        longest_step: [s], None if there is no such limit or none known beforehand.
        energy_drift: relative. tip: rms [m], by torque. us_per_ms: cost of bare `mj_step`s.
    """

    integrator: str
    step: float
    stable: bool
    longest_step: float | None
    modal: ModalFigures
    energy_drift: float | None = None
    tip_small: float | None = None
    tip_large: float | None = None
    us_per_ms: float | None = None


@dataclass(frozen=True, eq=False)
class Converged:
    """What the plants are held against.

    Attributes:
        name: in words. tip: (K, 2) by torque [m]. uncertainty: by torque, rms [m]: errors below
            mean nothing. clamped_hz, joint_free_hz: (3,) [Hz].
    """

    name: str
    tip: dict[str, Array]
    uncertainty: dict[str, float]
    clamped_hz: Array
    joint_free_hz: Array


@dataclass(frozen=True, eq=False)
class LadderResult:
    """Rows of the plants, rows of the integrators, and the reference of the former."""

    rows: Sequence[PlantRow]
    integrators: Sequence[IntegratorRow]
    reference: Converged


def tip(row: Any, torque: str) -> float | None:
    """Return a row's rms distance under a torque [m]."""
    found: float | None = value(row, f"tip_{torque}")
    return found
