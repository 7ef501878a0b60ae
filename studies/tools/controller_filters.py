"""A controller's two filters as tables: coefficients, and magnitude and phase over frequency.

>>> filters_of(controller_of("circle"), {}, frequencies).tables()    # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from controllers import Filter, TextbookPid, frequency_response
from flexsim.errors import ParameterError
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from studies.core.table import Column, Table
from studies.tuning.found import (
    AnyController,
    FoundController,
    devised_for,
    label_of,
    v_gain_of,
)


@dataclass(frozen=True, eq=False)
class ControllerFilters:
    """Both joints' filters.

    Attributes:
        controller: whose. filters: ((b1, a1), (b2, a2)). period: [s].
        omega: (n,) angular frequencies [rad/s]. responses: (2, n), complex [N m/rad].
    """

    controller: AnyController
    filters: tuple[Filter, Filter]
    period: float
    omega: Array
    responses: Any

    def as_dict(self) -> dict[str, object]:
        """Return what JSON has."""
        with np.errstate(divide="ignore"):
            decibels = 20.0 * np.log10(np.abs(self.responses))
        return {
            "controller": label_of(self.controller),
            "tuned_for": devised_for(self.controller),
            "period": self.period,
            "v_gain": v_gain_of(self.controller),
            **{f"joint{j}": {"b": b, "a": a} for j, (b, a) in enumerate(self.filters, start=1)},
            "omega": self.omega,
            **{f"magnitude_{j}_db": each for j, each in enumerate(decibels, start=1)},
            **{f"phase_{j}_deg": each for j, each in enumerate(_degrees(self.responses), start=1)},
        }

    def tables(self) -> list[Table]:
        """Return coefficients, and responses."""
        columns = [each for pair in self.filters for each in pair]
        taps = [
            TapRow(f"z^-{i}", *(float(x[i]) if i < x.size else None for x in columns))
            for i in range(max(x.size for x in columns))
        ]
        with np.errstate(divide="ignore"):
            decibels = 20.0 * np.log10(np.abs(self.responses))
        numbers = zip(self.omega, *decibels, *_degrees(self.responses), strict=True)
        rows = [
            ResponseRow(float(omega) / (2 * math.pi), *map(float, each)) for omega, *each in numbers
        ]
        about = f"{label_of(self.controller)}, T = {self.period:g} s: error [rad] to torque [N m]"
        return [Table(taps, TAPS, about), Table(rows, RESPONSE, "Responses")]


def _degrees(responses: Any) -> Array:
    return np.asarray(np.degrees(np.angle(responses)))


@dataclass(frozen=True)
class TapRow:
    """Coefficients of both joints at a delay, None beyond the last."""

    delay: str
    b1: float | None
    a1: float | None
    b2: float | None
    a2: float | None


@dataclass(frozen=True)
class ResponseRow:
    """Both responses at a frequency."""

    hertz: float
    magnitude_1_db: float
    magnitude_2_db: float
    phase_1_deg: float
    phase_2_deg: float


TAPS = (
    Column("delay"),
    *(Column(name, form=".10g", missing="") for name in ("b1", "a1", "b2", "a2")),
)
RESPONSE = (
    Column("hertz", "f", "Hz", ".4g"),
    Column("magnitude_1_db", "joint 1", "dB", ".2f"),
    Column("phase_1_deg", "phase", "deg", ".1f"),
    Column("magnitude_2_db", "joint 2", "dB", ".2f"),
    Column("phase_2_deg", "phase", "deg", ".1f"),
)


def filters_of(
    controller: AnyController, asked: Mapping[str, Any], frequencies: Callable[[float], Array]
) -> ControllerFilters:
    """Return a controller's filters, and their responses.

    Args:
        asked: `realisation`, `terms`, `period` [s], None where the usual ones do; a run of flexsim
            tune has its own.
        frequencies: from a period [s] to the angular frequencies (n,) [rad/s] that are shown.

    Raises:
        ParameterError: an option that has no effect.
        ControllerError: an option is out of range.
    """
    given = {name: each for name, each in asked.items() if each is not None}
    if isinstance(controller, FoundController):
        for name in given:
            raise ParameterError(
                f"--{name} has no effect: a run of flexsim tune has its own; leave it out"
            )
        period = controller.period
        filters = controller.filters(period)
    elif isinstance(controller, TextbookPid):
        for name in set(given) - {"period"}:
            raise ParameterError(f"--{name} has no effect on a textbook PID; leave it out")
        period = given.pop("period", PERIOD)
        filters = controller.filters(period)
    else:
        period = given.pop("period", PERIOD)
        filters = controller.filters(period, **given)
    omega = frequencies(period)
    responses = np.array([frequency_response(b, a, omega, period) for b, a in filters])
    return ControllerFilters(controller, filters, period, omega, responses)
