"""Elementary functions of arrays, as the C library computes them one number at a time.

    >>> cos(angle), arctan2(y, x)       # as numpy's of the same names

numpy's own choose among vector instructions by processor, and their last bits differ. These are
compiled loops over the C library's scalar functions, as everything that runs in a loop of ours.
glibc has one result on every processor with AVX2 and FMA.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array

SIN, COS, TANH, EXP, LOG, ARCTAN2, POWER = range(7)


def sin(x: ArrayLike) -> Array:
    """Return the sine of angles [rad]; complex ones, for complex steps, as numpy has it."""
    return np.sin(x) if np.iscomplexobj(x) else _mapped(SIN, x)


def cos(x: ArrayLike) -> Array:
    """Return the cosine of angles [rad]; complex ones, for complex steps, as numpy has it."""
    return np.cos(x) if np.iscomplexobj(x) else _mapped(COS, x)


def tanh(x: ArrayLike) -> Array:
    """Return the hyperbolic tangent."""
    return _mapped(TANH, x)


def exp(x: ArrayLike) -> Array:
    """Return e^x."""
    return _mapped(EXP, x)


def log(x: ArrayLike) -> Array:
    """Return the natural logarithm."""
    return _mapped(LOG, x)


def log10(x: ArrayLike) -> Array:
    """Return the logarithm to base 10, by the natural one."""
    return log(x) / math.log(10.0)


def power_of_ten(x: ArrayLike) -> Array:
    """Return 10^x."""
    return exp(math.log(10.0) * np.asarray(x, dtype=float))


def arctan2(y: ArrayLike, x: ArrayLike) -> Array:
    """Return the angles [rad] in (-pi, pi] of the points (x, y)."""
    return _mapped(ARCTAN2, *np.broadcast_arrays(y, x))


def power(base: float, exponent: ArrayLike) -> Array:
    """Return powers of a base, as Python's `**` has them."""
    return _mapped(POWER, np.full_like(np.asarray(exponent, dtype=float), base), exponent)


def cbrt(x: ArrayLike) -> Array:
    """Return the real cube root."""
    return np.vectorize(math.cbrt, otypes=[float])(x)[()]


def cubed(x: Array) -> Array:
    """Return x^3, as products: numpy's power has other last bits on other processors."""
    return x * x * x


def _mapped(function: int, x: ArrayLike, second: ArrayLike = 0.0) -> Array:
    """Return a function of every element, in the arguments' shape; a number of numbers."""
    first = np.asarray(x, dtype=float)
    out = np.empty(first.shape)
    _fill(function, first.ravel(), np.asarray(second, dtype=float).ravel(), out.reshape(-1))
    return out[()]


@jit
def _fill(function: int, x: Array, second: Array, out: Array) -> None:
    """Fill out (K,) with a function of x (K,), and of second (K,) where it has two arguments."""
    for i in range(x.shape[0]):
        if function == SIN:
            out[i] = math.sin(x[i])
        elif function == COS:
            out[i] = math.cos(x[i])
        elif function == TANH:
            out[i] = math.tanh(x[i])
        elif function == EXP:
            out[i] = math.exp(x[i])
        elif function == LOG:
            out[i] = math.log(x[i])
        elif function == POWER:
            out[i] = math.pow(x[i], second[i])
        else:
            out[i] = math.atan2(x[i], second[i])
