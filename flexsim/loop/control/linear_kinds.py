"""One linear digital system, whatever says it: told apart by type and shape, never guessed.

| given | read as |
|---|---|
| tuple or list of two rows | `(b, a)` in powers of 1/z, `lfilter`'s; b may be (1, n) |
| array (k, 6) | second-order sections, `sosfilt`'s |
| tuple of three | zeros, poles, gain, in z: fewer zeros than poles are a delay |
| tuple of four matrices | discrete state space (A, B, C, D) |
| what `cont2discrete` returns | any of these with its sampling period |
| `scipy.signal.dlti` | transfer function, zeros and poles, or state space |
| python-control's system | transfer function or state space |
| object with `cascades` | sum of cascades of `(b, a)`, as `controllers.Sections` has them |

>>> kind_of((np.array([1.0, 0.5]), np.ones(1)), 1e-3)
[[(array([1. , 0.5]), array([1.]))]]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy  # its signal package, half a second, is loaded where it is used

from flexsim.errors import ParameterError
from flexsim.loop.control.given_numbers import (
    real_numbers,
    real_or_paired,
    same_period,
    shape_of,
    shown,
)
from flexsim.numerics.types import Array

Filter = tuple[Array, Array]  # b, a in powers of 1/z
Branches = list[list[Filter]]  # a sum of cascades

SECTION = 6  # numbers of a second-order section: b0, b1, b2, a0, a1, a2
OUTPUTS, INPUTS = 2, (2, 3)  # of a state space for both joints: torques; (e1, e2) or (e1, e2, v)
KINDS = "(b, a), sections (k, 6), (zeros, poles, gain), (A, B, C, D) or a discrete system"


@dataclass(frozen=True, eq=False)
class Space:
    """A discrete state space: A (n, n), B (n, inputs), C (outputs, n), D (outputs, inputs)."""

    A: Array
    B: Array
    C: Array
    D: Array


def kind_of(given: Any, period: float) -> Branches | Space:
    """Return a system of any kind as a sum of cascades of filters, or as a state space.

    Raises:
        ParameterError: the kind, a shape, a number or a sampling period cannot be used.
    """
    if hasattr(given, "cascades"):
        return [[_filter(b, a) for b, a in cascade] for cascade in given.cascades]
    if isinstance(given, np.ndarray):
        return [_sections(given)]
    if isinstance(given, tuple | list):
        return _by_length(given, period)
    if isinstance(given, scipy.signal.lti):
        raise ParameterError(f"a continuous system; discretise it first: to_discrete({period:g})")
    if not hasattr(given, "dt"):
        raise ParameterError(f"of type {type(given).__name__}; give {KINDS}")
    same_period(given.dt, period)
    if all(hasattr(given, name) for name in "ABCD"):
        return _space(given.A, given.B, given.C, given.D)
    if hasattr(given, "gain") and hasattr(given, "zeros"):
        return [_zeros_poles(given.zeros, given.poles, given.gain)]
    if hasattr(given, "num") and hasattr(given, "den"):
        return _transfer(given.num, given.den)
    raise ParameterError(f"of type {type(given).__name__}; give {KINDS}")


def one_input(space: Space) -> Space:
    """Return a state space, known to have one input and one output.

    Raises:
        ParameterError: it has others.
    """
    if space.D.shape != (1, 1):
        outputs, inputs = space.D.shape
        raise ParameterError(
            f"a system of {inputs} inputs and {outputs} outputs; one joint's has one of each"
        )
    return space


def whole_space(given: Any, period: float) -> Space:
    """Return the state space of both joints, from (e1, e2, v) to two torques.

    Raises:
        ParameterError: it is of another kind, or has other inputs and outputs.
    """
    found = kind_of(given, period)
    if not isinstance(found, Space):
        raise ParameterError("one filter alone; give one for each joint, as a pair")
    outputs, inputs = found.D.shape
    if outputs != OUTPUTS or inputs not in INPUTS:
        raise ParameterError(
            f"a system of {inputs} inputs and {outputs} outputs; both joints' has the errors "
            "(e1, e2) or (e1, e2, v) for inputs and two torques for outputs"
        )
    missing = ((0, 0), (0, INPUTS[-1] - inputs))
    return Space(found.A, np.pad(found.B, missing), found.C, np.pad(found.D, missing))


def _by_length(given: tuple[Any, ...] | list[Any], period: float) -> Branches | Space:
    """Return a system given as a tuple or list of its parts."""
    shapes = [shape_of(part) for part in given]
    match len(given), len(shapes[0]) if shapes else 0:
        case 2, _:
            if isinstance(given, list) and shapes == [(SECTION,)] * 2:
                raise ParameterError(
                    "a list of two rows of six: give a tuple for (b, a), an array for sections"
                )
            return [[_filter(*given)]]
        case 3, 2:
            same_period(given[2], period)
            return [[_filter(*given[:2])]]
        case 3, _:
            if shapes[2] == () and given[2] == period:
                raise ParameterError(
                    "a tuple of three that ends in the control period; (zeros, poles, gain) "
                    "was expected: give (b, a), or a dlti"
                )
            return [_zeros_poles(*given)]
        case 4, 1:
            same_period(given[3], period)
            return [_zeros_poles(*given[:3])]
        case 4, 2:
            return _space(*given)
        case 5, 2:
            same_period(given[4], period)
            return _space(*given[:4])
    raise ParameterError(f"a {type(given).__name__} of {len(given)}; give {KINDS}")


def _filter(numerator: Any, denominator: Any) -> Filter:
    """Return (b, a) with a[0] = 1, the numerator's (1, n) flattened."""
    if len(shape_of(numerator)) == 2 and len(numerator) == 1:
        numerator = numerator[0]
    b, a = real_numbers(numerator, "b", 1), real_numbers(denominator, "a", 1)
    if not (b.size and a.size):
        raise ParameterError("b or a is empty; give finite coefficients")
    if a[0] == 0:
        raise ParameterError(f"a = {shown(a)}; give an a[0] other than 0")
    with np.errstate(over="ignore"):
        b, a = b / a[0], a / a[0]
    if not (np.isfinite(b).all() and np.isfinite(a).all()):
        raise ParameterError("coefficients over a[0] overflow; give a larger a[0]")
    return b, a


def _sections(given: Array) -> list[Filter]:
    """Return second-order sections as a cascade."""
    if given.ndim != 2 or given.shape[1] != SECTION or not len(given):
        raise ParameterError(
            f"an array of shape {given.shape}; an array is sections (k, {SECTION}), "
            "give (b, a) as a tuple"
        )
    return [_filter(row[:3], row[3:]) for row in real_numbers(given, "an array of sections", 2)]


def _transfer(num: Any, den: Any) -> Branches | Space:
    """Return a transfer function in powers of z: scipy's polynomials, or python-control's of each
    output and input.
    """
    if len(shape_of(den)) == 1:  # scipy's: one denominator
        if len(shape_of(num)) == 2 and len(num) > 1:
            raise ParameterError(f"a transfer function of {len(num)} outputs; give a state space")
        return [[_in_delays(num, den)]]
    table = [
        [_in_delays(n, d) for n, d in zip(*rows, strict=True)]
        for rows in zip(num, den, strict=True)
    ]
    if len(table) == len(table[0]) == 1:
        return [[table[0][0]]]
    return _joined(table)


def _in_delays(numerator: Any, denominator: Any) -> Filter:
    """Return polynomials in z, highest power first, as (b, a) in powers of 1/z."""
    b, a = _filter(numerator, denominator)
    b = np.trim_zeros(b, "f") if b.any() else b[:1]
    if b.size > a.size:
        raise ParameterError("a transfer function of more zeros than poles, which looks ahead")
    return np.concatenate([np.zeros(a.size - b.size), b]), a


def filter_space(b: Array, a: Array) -> tuple[Array, Array, Array, Array]:
    """Return filters (..., m+1) as state space A (..., m, m), B (..., m), C (m,), D (...).

    The states are the delays of `flexsim.loop.control.compiled.filter_sample`, direct form II
    transposed; a[0] = 1.
    """
    m = b.shape[-1] - 1
    A = np.zeros((*b.shape[:-1], m, m))
    if m:
        A[..., :, 0] = -a[..., 1:]
        A[..., np.arange(m - 1), np.arange(1, m)] = 1.0
    return A, b[..., 1:] - a[..., 1:] * b[..., :1], np.eye(1, m)[0], b[..., 0]


def _joined(table: list[list[Filter]]) -> Space:
    """Return the filters from every input (column) to every output (row) as one state space."""
    outputs, inputs = len(table), len(table[0])
    n = sum(len(a) - 1 for row in table for _, a in row)
    A, B = np.zeros((n, n)), np.zeros((n, inputs))
    C, D = np.zeros((outputs, n)), np.zeros((outputs, inputs))
    start = 0
    for i, row in enumerate(table):
        for j, (b, a) in enumerate(row):
            own = slice(start, start + len(a) - 1)
            A[own, own], B[own, j], C[i, own], D[i, j] = filter_space(b, a)
            start += len(a) - 1
    return Space(A, B, C, D)


def _space(A: Any, B: Any, C: Any, D: Any) -> Space:
    """Return a state space, its shapes checked."""
    parts = [real_numbers(part, name, 2) for name, part in zip("ABCD", (A, B, C, D), strict=True)]
    n, (outputs, inputs) = len(parts[0]), parts[3].shape
    if [part.shape for part in parts[:3]] != [(n, n), (n, inputs), (outputs, n)]:
        shapes = ", ".join(str(part.shape) for part in parts)
        raise ParameterError(
            f"A, B, C, D have shapes {shapes}; give (n, n), (n, inputs), (outputs, n), "
            "(outputs, inputs)"
        )
    return Space(*parts)


def _zeros_poles(zeros: Any, poles: Any, gain: Any) -> list[Filter]:
    """Return zeros and poles in z as a cascade: of first order where all are real, else second."""
    k = float(real_numbers(gain, "the gain of zeros and poles", 0))
    z, p = real_or_paired(zeros, "zeros"), real_or_paired(poles, "poles")
    delay = len(p) - len(z)
    if delay < 0:
        raise ParameterError(
            f"{len(z)} zeros and {len(p)} poles: more zeros than poles, which looks ahead"
        )
    if not (z.imag.any() or p.imag.any()):
        z, p = np.sort(z.real)[::-1], np.sort(p.real)[::-1]
        tops = [*([1.0, -zero] for zero in z), *([[0.0, 1.0]] * delay)]
        cascade = [(np.array(b), np.array([1.0, -a])) for b, a in zip(tops, p, strict=True)]
    else:
        paired = scipy.signal.zpk2sos(np.concatenate([z, np.zeros(delay)]), p, 1.0)
        cascade = [(row[:3], row[3:]) for row in paired]
        if delay:  # zeros at the origin stand for them in the pairs
            cascade.append((np.eye(1, delay + 1, delay)[0], np.ones(1)))
    if not cascade:
        return [(np.array([k]), np.ones(1))]
    (b, a), *others = cascade
    return [(k * b, a), *others]
