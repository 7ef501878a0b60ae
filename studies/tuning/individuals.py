"""From ten parameters to the filters of two joints, for whole populations.

    >>> ControllerDesign().filters(TABLE_1.sample(np.random.default_rng(1), 50))[0]

Parameters are Table 1's, gains in N m ms^nu/rad; filters are in SI. The series (2) and
Grünwald-Letnikov's are built for a population at once, since one by one they would take an eighth
of the simulations' time; the other realisations by `controllers` one by one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from controllers import (
    REALISATIONS,
    ControllerError,
    Filter,
    Gains,
    fractional_pid,
    textbook_pid,
)
from controllers.errors import MOST_ORDER
from flexsim.errors import ParameterError
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.elementary import power
from flexsim.numerics.types import Array
from studies.tuning.distributions import NAMES

Filters = tuple[Filter, Filter]

GAIN_MOST = 1e100  # of a filter's coefficients; the loop's matrix would overflow not far beyond
CONTROLLERS = ("fractional", "pid")
TEXTBOOK = "textbook"
MS_PER_S = 1000.0
TERMS_MOST = 5000  # a run has no more samples that an operator could look back upon
DERIVATIVE_PAIRS = ((0, 1), (2, 3), (5, 6), (7, 8))  # positions of a gain and its order
SI_NAMES = tuple(f"{NAMES[k]}_si" for k, _ in DERIVATIVE_PAIRS)  # of the gains that change


def moderate(pair: Filters) -> bool:
    """Return whether a linear loop can be made of two filters without overflow."""
    return all(np.abs(b).max() <= GAIN_MOST for b, _ in pair)


def in_si(parameters: Array) -> Array:
    """Return parameters (K, 10) with gains in SI units, N m s^nu/rad; see `Gains`."""
    converted = np.array(parameters, dtype=float)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        for k, nu in DERIVATIVE_PAIRS:
            converted[:, k] /= power(MS_PER_S, converted[:, nu])
    return converted


def _binomial(powers: Array, terms: int, sign: float) -> Array:
    """Return the coefficients of (1 + sign x)^power for every power (K,), (K, terms + 1)."""
    i = np.arange(1.0, terms + 1.0)
    ratios = np.cumprod(sign * (powers[:, None] - i + 1.0) / i, axis=1)
    return np.hstack([np.ones((len(powers), 1)), ratios])


def series_taps(orders: Array, period: float, terms: int, realisation: str) -> Array:
    """Return the taps (K, terms + 1) of D^order, not finite where `controllers` would refuse.

    Args:
        orders: (K,). period: T [s]. terms: p.
        realisation: 'tustin' or 'gruenwald-letnikov'.

    Source: (2), as `controllers.tustin`; section 3.1, as `controllers.gruenwald_letnikov`.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        taps = _binomial(orders, terms, -1.0)
        scale = 1.0
        if realisation == "tustin":
            scale = 2.0
            back, forward = _binomial(-orders, terms, 1.0), taps
            taps = np.stack(
                [(forward[:, : i + 1] * back[:, i::-1]).sum(axis=1) for i in range(terms + 1)],
                axis=1,
            )
        taps = power(scale / period, orders)[:, None] * taps  # (2)
    taps[~(np.abs(orders) <= MOST_ORDER)] = np.nan
    return taps


@dataclass(frozen=True)
class ControllerDesign:
    """What ten parameters mean.

    Attributes:
        controller: 'fractional', (3) and (4); or 'pid', the same with integer orders.
        realisation: of each operator, a key of `controllers.REALISATIONS`; or 'textbook' for
            PIDs with a true integrator and a backward-difference derivative.
        terms: p in (2), length of each operator; not read by 'textbook'.
        period: control period T [s].
        filter_time: time constant of the textbook derivative's low-pass filter [s].

    Raises:
        ParameterError: an unknown name, or what does not go together.
        ControllerError: a number out of range.
    """

    controller: str = "fractional"
    realisation: str = "tustin"
    terms: int = 10
    period: float = PERIOD
    filter_time: float = 0.0

    def __post_init__(self) -> None:
        names = (*REALISATIONS, TEXTBOOK)
        for label, value, known in (
            ("controller", self.controller, CONTROLLERS),
            ("realisation", self.realisation, names),
        ):
            if value not in known:
                raise ParameterError(
                    f"{label} {value!r} is unknown; choose one of {', '.join(known)}"
                )
        if self.terms > TERMS_MOST:
            raise ParameterError(f"terms is {self.terms}; give {TERMS_MOST} at most")
        if self.realisation == TEXTBOOK:
            if self.controller != "pid":
                raise ParameterError("realisation 'textbook' is of integer orders; give a pid")
            textbook_pid(1.0, 1.0, 1.0, self.period, self.filter_time)
        else:
            if self.filter_time != 0.0:
                raise ParameterError(
                    "filter time is of the textbook realisation only; leave it out"
                )
            REALISATIONS[self.realisation](0.5, self.period, self.terms)

    def filters(self, parameters: Array) -> list[Filters | None]:
        """Return the filters ((b1, a1), (b2, a2)) of individuals (K, 10); None if impossible."""
        si = in_si(parameters)
        first, second = self._joint(si[:, :5]), self._joint(si[:, 5:])
        return [
            None if one is None or two is None else (one, two)
            for one, two in zip(first, second, strict=True)
        ]

    def _joint(self, si: Array) -> Sequence[Filter | None]:
        """Return one joint's filters from gains (K, 5): k1, nu1, k2, nu2, k3 in SI units."""
        if self.realisation not in ("tustin", "gruenwald-letnikov"):
            return [self._one(row) for row in si]
        b = np.zeros((len(si), self.terms + 1))
        b[:, 0] = si[:, 4]
        with np.errstate(over="ignore", invalid="ignore"):
            for k, nu in ((0, 1), (2, 3)):
                b += si[:, k : k + 1] * self._taps(si[:, nu])
        one = np.ones(1)
        return [(row, one) if np.isfinite(row).all() else None for row in b]

    def _taps(self, orders: Array) -> Array:
        return series_taps(orders, self.period, self.terms, self.realisation)

    def _one(self, si: Array) -> Filter | None:
        """Return one individual's filter by `controllers`, None where that refuses."""
        k1, nu1, k2, nu2, k3 = map(float, si)
        try:
            if self.realisation == TEXTBOOK:
                return textbook_pid(k3, k2, k1, self.period, self.filter_time)
            gains = Gains(k1, nu1, k2, nu2, k3)
            return fractional_pid(gains, self.period, self.realisation, self.terms)
        except ControllerError:
            return None
