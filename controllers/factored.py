"""Filters written out as sections: cascades of second order where that keeps their digits.

    found = factored((b, a))
    found.sections.cascades, found.whole

A polynomial of many coefficients is at the mercy of their rounding wherever it is typed in or run
in single precision; sections of second order are not. But finding them means finding roots, and
where those crowd, as at z = 1, the sections would be another filter. So what cannot be taken apart
to TOLERANCE of its response stays one section, as it is; a series of taps, which has no poles,
always does, its taps exact.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy  # its signal package, half a second, is loaded where it is used
from numpy.typing import NDArray

from controllers.errors import ControllerError
from controllers.sections import Cascade, Sections
from controllers.series import Array, Filter

Space: TypeAlias = tuple[Array, Array, Array, Array]

TOLERANCE = 1e-9
"""Largest relative change of the response when a polynomial becomes sections."""
SECOND = 2
"""Order up to which a section is never taken apart."""
MOST = 64
"""Order beyond which no roots are looked for."""
LOWEST, GRID = 1e-5, 400
"""Where that is checked: from here to pi and as near to pi, [rad/sample]; how often."""


@dataclass(frozen=True, eq=False)
class Factored:
    """A filter as sections.

    Attributes:
        sections: a sum of cascades; a[0] = 1 in each section.
        whole: orders of the polynomials that could not be taken apart, and so stayed one section.
    """

    sections: Sections
    whole: tuple[int, ...] = ()


def factored(given: Filter | Sections) -> Factored:
    """Return a filter as sections: of second order, of taps alone, or whole where it must be.

    Args:
        given: `(b, a)` in powers of z^-1, or a sum of cascades of them.

    Raises:
        ControllerError: there are no coefficients, one is not finite, or an a[0] is zero.
    """
    if not isinstance(given, Sections):
        given = Sections(((given,),))
    cascades: list[Cascade] = []
    whole: list[int] = []
    for cascade in given.cascades:
        parts: list[Filter] = []
        for each in cascade:
            b, a = normalised(*each)
            found = _taken_apart(b, a)
            if found is None:
                whole.append(max(b.size, a.size) - 1)
            parts += found or [(b, a)]
        cascades.append(tuple(parts))
    return Factored(Sections(tuple(cascades)), tuple(whole))


def normalised(b: Array, a: Array) -> Filter:
    """Return a filter over its a[0], without zeros at the ends of its polynomials.

    Raises:
        ControllerError: there are no coefficients, one is not finite, or a[0] is zero.
    """
    b, a = (np.atleast_1d(np.asarray(each, dtype=float)).ravel() for each in (b, a))
    if not b.size or not a.size or not (np.isfinite(b).all() and np.isfinite(a).all()):
        raise ControllerError("a filter needs finite coefficients, one or more of b and of a")
    if a[0] == 0.0:
        raise ControllerError("a[0] is zero: the filter would know its input ahead of time")
    b, a = np.trim_zeros(b, "b"), np.trim_zeros(a, "b")
    return (b if b.size else np.zeros(1)) / a[0], a / a[0]


def _taken_apart(b: Array, a: Array) -> list[Filter] | None:
    """Return sections in series, None where they would be another filter."""
    order = max(b.size, a.size) - 1
    if not b.any():
        return [(np.zeros(1), np.ones(1))]
    if a.size == 1 or order <= SECOND:
        return [(b, a)]
    if order > MOST:
        return None
    delay = int(np.argmax(b != 0.0))  # leading zeros: samples that everything is late by
    zeros, poles = (np.roots(each) for each in (b[delay:], a))
    rows = scipy.signal.zpk2sos(zeros, poles, b[delay])  # (k, 6), the gain in the first
    sections = [normalised(row[:3], row[3:]) for row in rows]
    if delay:
        sections.append((np.eye(1, delay + 1, delay)[0], np.ones(1)))
    return sections if _error(sections, (b, a)) <= TOLERANCE else None


def _error(sections: list[Filter], whole: Filter) -> float:
    """Return by how much the response of sections differs, relative; inf where it is not finite."""
    near = np.geomspace(LOWEST, np.pi - LOWEST, GRID)
    omega = np.concatenate([near, np.pi - near])
    response: NDArray[np.complex128] = np.ones(omega.size, dtype=np.complex128)
    with np.errstate(all="ignore"):
        for b, a in sections:
            response = response * scipy.signal.freqz(b, a, omega)[1]
        wanted = scipy.signal.freqz(*whole, omega)[1]
        error = np.abs(response - wanted) / np.abs(wanted)
    return float(error.max()) if np.isfinite(error).all() else np.inf


def state_space(sections: Sections) -> Space:
    """Return A (n, n), B (n, 1), C (1, n), D (1, 1) of a sum of cascades.

    Section by section in transposed direct form II, in series and then in parallel, so that no
    polynomials are multiplied.
    """
    total = _nothing(0.0)
    for cascade in sections.cascades:
        passed = _nothing(1.0)
        for b, a in cascade:
            passed = _after(passed, _space_of(b, a))
        total = _beside(total, passed)
    return total


def _nothing(gain: float) -> Space:
    return np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.full((1, 1), gain)


def _space_of(b: Array, a: Array) -> Space:
    """Return one section: z1' = z2 + b1 x - a1 y, ..., y = z1 + b0 x."""
    n = max(b.size, a.size) - 1
    b, a = (np.concatenate([each, np.zeros(n + 1 - each.size)]) for each in (b, a))
    A = np.eye(n, k=1)
    if n:
        A[:, 0] -= a[1:]
    return A, (b[1:] - a[1:] * b[0])[:, None], np.eye(1, n), np.full((1, 1), b[0])


def _after(first: Space, second: Space) -> Space:
    """Return two systems in series."""
    A, B, C, D = first
    E, F, G, H = second
    m, n = len(A), len(E)
    whole = np.block([[A, np.zeros((m, n))], [F @ C, E]])
    return whole, np.vstack([B, F @ D]), np.hstack([H @ C, G]), H @ D


def _beside(first: Space, second: Space) -> Space:
    """Return two systems in parallel."""
    A, B, C, D = first
    E, F, G, H = second
    m, n = len(A), len(E)
    whole = np.block([[A, np.zeros((m, n))], [np.zeros((n, m)), E]])
    return whole, np.vstack([B, F]), np.hstack([C, G]), D + H
