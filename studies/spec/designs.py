"""A controller of a study file, ready to be repeated with its gains slightly changed.

>>> design = design_of(part, period=1e-3, parameters=Parameters(), inputs={})
>>> design.stacked(np.ones((20, 6))).b.shape
(20, 2, 1, 1, 11)

Where a gain stands in the file it is the gain that is changed, k1 to k6; of other filters and
state spaces the torque of a joint is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from controllers import (
    REALISATIONS,
    Controller,
    ControllerError,
    Filter,
    Gains,
    fractional_pid,
    operator,
    oustaloup_pid,
    textbook_pid,
)
from controllers.errors import check_finite, check_order
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.control.stacking import stack
from flexsim.numerics.types import Array
from studies.spec.functions import call
from studies.spec.parts import (
    ControllerPart,
    FilterPart,
    GainsPart,
    JointPart,
    PidPart,
    SectionsPart,
    ZerosPart,
)
from studies.spec.resolving import at

FACTORS = 6  # of k1, k2, k3 of joint 1, then of joint 2
SECTIONS = "oustaloup-sections"
TEXTBOOK = "textbook"
OF_GAINS = (*REALISATIONS, SECTIONS)
OF_PIDS = (TEXTBOOK, *OF_GAINS)

NOTHING: Filter = (np.zeros(1), np.ones(1))


@lru_cache(maxsize=1024)
def cached_operator(
    realisation: str, order: float, period: float, terms: int
) -> tuple[Array, Array, float]:
    """Return an operator's (b, a), and its largest coefficient."""
    b, a = operator(realisation, order, period, terms)
    return b, a, float(np.abs(b).max())


class Design(Protocol):
    """A controller that may be repeated."""

    def stacked(self, factors: Array) -> Controllers:
        """Return n controllers for the compiled loop, gains times factors (n, 6)."""


@dataclass(frozen=True, eq=False)
class Series:
    """k1 D^nu1 + k2 D^nu2 + k3 whose operators are series of taps: a sum for each run.

    Attributes:
        gains: (6,) k1, k2, k3 of joint 1, then of joint 2. taps: (2, 2, m) of the operators.
    """

    gains: Array
    taps: Array

    def stacked(self, factors: Array) -> Controllers:
        """Return n controllers; added up in the order of `controllers.fractional_pid`."""
        runs, size = len(factors), self.taps.shape[-1]
        k = (self.gains * factors).reshape(runs, 2, 3)
        b = np.zeros((runs, 2, size))
        b[..., 0] = k[..., 2]
        for i in range(2):
            used = self.gains[[i, 3 + i]] != 0.0
            b[:, used] += k[:, used, i, None] * self.taps[used, i]
        a = np.zeros_like(b)
        a[..., 0] = 1.0
        return _alone(b, a)


@dataclass(frozen=True, eq=False)
class Each:
    """What is designed anew for every run: a function from factors (6,) to a controller."""

    design: Callable[[Array], Any]
    period: float

    def stacked(self, factors: Array) -> Controllers:
        """Return n controllers, equal ones designed once."""
        rows, which = np.unique(factors, axis=0, return_inverse=True)
        built = stack([self.design(row) for row in rows], self.period)
        return built.chosen(which.reshape(-1))


@dataclass(frozen=True, eq=False)
class Scaled:
    """What is designed once, the torque of each joint times its first factor."""

    one: Controllers

    def stacked(self, factors: Array) -> Controllers:
        """Return n controllers."""
        runs = len(factors)
        b, a, A, B, C, D = (np.repeat(each, runs, axis=0) for each in self.one)
        joints = factors[:, [0, 3]]
        b[:, :, :, 0] *= joints[:, :, None, None]
        return Controllers(b, a, A, B, C * joints[:, :, None], D * joints[:, :, None])


def _alone(b: Array, a: Array) -> Controllers:
    """Return one filter (n, 2, m) for each joint."""
    runs = len(b)
    none = (np.zeros((runs, 0, 0)), np.zeros((runs, 0, 3)), np.zeros((runs, 2, 0)))
    return Controllers(b[:, :, None, None], a[:, :, None, None], *none, np.zeros((runs, 2, 3)))


def design_of(
    part: ControllerPart, period: float, parameters: Parameters, inputs: Mapping[str, str]
) -> Design:
    """Return a controller of a resolved file.

    Args:
        part: as named. period: of the loop [s]. parameters: of the first robot, for functions.
        inputs: texts kept beside the study.

    Raises:
        ParameterError, ControllerError: it cannot be built, or the loop cannot take it.
    """
    if part.function is not None:
        found = call(part.function, inputs, period, parameters, part.options)
        if isinstance(found, Controller):
            return _of_gains(found.joint1, found.joint2, "tustin", part.terms, period)
        return Scaled(stack([found], period))
    if part.A is not None:
        return Scaled(stack([_space(part)], period))
    joints = part.joint1, part.joint2
    how = part.realisation
    if all(isinstance(each, GainsPart) for each in joints):
        own = [Gains(**each.model_dump()) for each in joints if each is not None]
        return _of_gains(own[0], own[1], how or "tustin", part.terms, period)
    if how is not None and not any(isinstance(each, GainsPart | PidPart) for each in joints):
        raise ParameterError(f"realisation {how!r} is of gains and orders; leave it out")

    def design(factors: Array) -> Any:
        found = []
        for i, each in enumerate(joints):
            with at(f"joint{i + 1}"):
                found.append(_joint(each, factors[3 * i : 3 * i + 3], how, part.terms, period))
        return tuple(found)

    return Each(design, period)


def matrix_of(name: str, rows: list[list[float]]) -> Array:
    """Return a matrix of rows as long as one another.

    Raises:
        ParameterError: they are not.
    """
    if len({len(row) for row in rows}) > 1:
        raise ParameterError(f"{name} has rows of different lengths; give them as many numbers")
    return np.array(rows, dtype=float)


def _space(part: ControllerPart) -> tuple[Array, ...]:
    """Return A, B, C, D, whose empty ones have their shapes."""
    A, B, C, D = (matrix_of(name, getattr(part, name)) for name in "ABCD")
    inputs = D.shape[1] if D.ndim == 2 else 0
    shapes = ((0, 0), (0, inputs), (2, 0))
    if not A.size and not B.size and not C.size:
        A, B, C = (np.zeros(shape) for shape in shapes)
    return A, B, C, D


def _require(realisation: str, known: tuple[str, ...]) -> None:
    if realisation not in known:
        raise ParameterError(
            f"realisation {realisation!r} is unknown; choose one of {', '.join(known)}"
        )


def _of_gains(one: Gains, other: Gains, realisation: str, terms: int, period: float) -> Design:
    """Return (3) and (4)."""
    _require(realisation, OF_GAINS)
    joints = one, other
    kept = []
    for number, gains in enumerate(joints, 1):
        with at(f"joint{number}"):
            check_finite("k3", gains.k3)
            kept.append([_operator(*each, realisation, terms, period) for each in _terms(gains)])
    if realisation != SECTIONS and all(len(a) == 1 for joint in kept for _, a in joint):
        size = max(len(b) for joint in kept for b, _ in joint)
        taps = np.zeros((2, 2, size))
        for i, joint in enumerate(kept):
            for j, (b, _) in enumerate(joint):
                taps[i, j, : len(b)] = b
        return Series(np.array([x for g in joints for x in (g.k1, g.k2, g.k3)]), taps)

    def design(factors: Array) -> Any:
        return tuple(
            _realised(_times(gains, factors[3 * i : 3 * i + 3]), realisation, terms, period)
            for i, gains in enumerate(joints)
        )

    return Each(design, period)


def _terms(gains: Gains) -> tuple[tuple[float, float | None], ...]:
    return (gains.k1, gains.nu1), (gains.k2, gains.nu2)


def _times(gains: Gains, factors: Array) -> Gains:
    k1, k2, k3 = (
        float(k * f) for k, f in zip((gains.k1, gains.k2, gains.k3), factors, strict=True)
    )
    return replace(gains, k1=k1, k2=k2, k3=k3)


def _operator(k: float, nu: float | None, realisation: str, terms: int, period: float) -> Filter:
    """Return the operator of a term, nothing where its gain is zero.

    Raises:
        ControllerError: there is no order, or the term overflows.
    """
    if k == 0.0 or realisation == SECTIONS:
        return NOTHING
    if nu is None:
        raise ControllerError(f"a gain of {k:g} has no order; give its nu")
    b, a, most = cached_operator(realisation, check_order("nu", nu), period, terms)
    if not abs(k) * most < math.inf:
        raise ControllerError(f"{k:g} times D^{nu:g} overflows; choose a smaller gain")
    return b, a


def _realised(gains: Gains, realisation: str, terms: int, period: float) -> Any:
    """Return one joint's filter, or its sections."""
    if realisation == SECTIONS:
        return oustaloup_pid(gains, period, terms)
    return fractional_pid(gains, period, realisation, terms)


def _joint(
    part: JointPart | None, factors: Array, how: str | None, terms: int, period: float
) -> Any:
    """Return one joint's controller with its gains times factors (3,)."""
    f1, f2, f3 = map(float, factors)
    if isinstance(part, FilterPart):
        return f1 * np.array(part.b), np.array(part.a)
    if isinstance(part, SectionsPart):
        sections = matrix_of("sos", part.sos)
        if sections.ndim != 2 or sections.shape[1] != FACTORS:
            raise ParameterError(f"sos has shape {sections.shape}; give rows of six numbers")
        sections[0, :3] *= f1
        return sections
    if isinstance(part, ZerosPart):
        return _roots(part.zeros), _roots(part.poles), f1 * part.gain
    if isinstance(part, PidPart):
        _require(how or TEXTBOOK, OF_PIDS)
        for name in ("kp", "ki", "kd"):
            check_finite(name, getattr(part, name))
        if how in (None, TEXTBOOK):
            gains = (f3 * part.kp, f2 * part.ki, f1 * part.kd)
            return textbook_pid(*gains, period, part.filter_time)
        if part.filter_time:
            raise ControllerError("filter_time is of the textbook realisation; leave it out")
        orders = Gains(f1 * part.kd, 1.0, f2 * part.ki, -1.0, f3 * part.kp)
        return _realised(orders, str(how), terms, period)
    own = Gains(**part.model_dump()) if part is not None else Gains(0, None, 0, None, 0)
    _require(how or "tustin", OF_GAINS)
    return _realised(_times(own, factors), how or "tustin", terms, period)


def _roots(given: list[Any]) -> Array:
    """Return roots, complex ones given as pairs."""
    return np.array(
        [complex(*each) if isinstance(each, tuple) else complex(each) for each in given]
    )
