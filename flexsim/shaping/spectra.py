"""Complex arithmetic of inversions in the frequency domain, in compiled scalar code.

    >>> response = inverse_responses(M, D, K, step, samples)         # (F, n, n)
    >>> np.fft.irfft(multiplied(response, np.fft.rfft(x, axis=0)), n=samples, axis=0)

LAPACK, and numpy's vector instructions for complex numbers, have other last bits on another
processor; numpy's FFT is plain code.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import ParameterError
from flexsim.numerics.jit import jit
from flexsim.numerics.types import Array

Spectrum = NDArray[np.complex128]


def inverse_responses(M: Array, D: Array, K: Array, step: float, samples: int) -> Spectrum:
    """Return the responses (F, n, n) of M q'' + D q' + K q to forces, at `rfft`'s frequencies.

    Args:
        M, D, K: (n, n). step: [s] between samples, of which there are `samples` in a period. Rates
            and accelerations are central differences.

    Raises:
        ParameterError: at one of the frequencies there is no response.
    """
    out = np.empty((samples // 2 + 1, len(M), len(M)), dtype=complex)
    if not _fill_responses(*(np.ascontiguousarray(each) for each in (M, D, K)), step, samples, out):
        raise ParameterError(
            "the beam's motion cannot be inverted: it swings freely at a frequency"
        )
    return out


@jit
def _fill_responses(M: Array, D: Array, K: Array, step: float, samples: int, out: Spectrum) -> bool:
    """Fill out (F, n, n) as `inverse_responses`; return whether all exist."""
    n = M.shape[0]
    system = np.empty((n, n), dtype=np.complex128)
    for f in range(out.shape[0]):
        angle = 2.0 * math.pi * f / samples
        root, rate = 2.0 * math.sin(0.5 * angle) / step, math.sin(angle) / step
        for i in range(n):
            for j in range(n):
                system[i, j] = complex(K[i, j] - root * root * M[i, j], rate * D[i, j])
                out[f, i, j] = 1.0 if i == j else 0.0
        if not _inverted(system, out[f]):
            return False
    return True


@jit
def _inverted(a: Spectrum, x: Spectrum) -> bool:
    """Turn a unit matrix x (n, n) into the inverse of a (n, n), overwritten; say if it exists."""
    n = a.shape[0]
    for p in range(n):
        best, largest = p, 0.0
        for i in range(p, n):
            size = abs(a[i, p].real) + abs(a[i, p].imag)
            if size > largest:
                best, largest = i, size
        if not 0.0 < largest < np.inf:
            return False
        if best != p:
            for j in range(n):
                a[p, j], a[best, j] = a[best, j], a[p, j]
                x[p, j], x[best, j] = x[best, j], x[p, j]
        pivot = 1.0 / a[p, p]
        for j in range(n):
            a[p, j] *= pivot
            x[p, j] *= pivot
        for i in range(n):
            if i != p:
                factor = a[i, p]
                for j in range(n):
                    a[i, j] -= factor * a[p, j]
                    x[i, j] -= factor * x[p, j]
    return True


def multiplied(response: Spectrum, spectrum: Spectrum) -> Spectrum:
    """Return the products (F, n) of responses (F, n, n) and a spectrum (F, n)."""
    out = np.zeros_like(spectrum)
    _multiply(response, spectrum, out)
    return out


@jit
def _multiply(response: Spectrum, spectrum: Spectrum, out: Spectrum) -> None:
    """Fill out (F, n) with the products."""
    for f in range(response.shape[0]):
        for i in range(response.shape[1]):
            total = complex(0.0, 0.0)
            for j in range(response.shape[2]):
                total += response[f, i, j] * spectrum[f, j]
            out[f, i] = total


@jit
def filter_responses(taps: Array, samples: int) -> Spectrum:
    """Return the polynomial in z^-1 with these coefficients (m+1,) at `rfft`'s frequencies (F,)."""
    out = np.empty(samples // 2 + 1, dtype=np.complex128)
    for f in range(out.shape[0]):
        angle = 2.0 * math.pi * f / samples
        delay = complex(math.cos(angle), -math.sin(angle))
        total = complex(0.0, 0.0)
        for i in range(taps.shape[0] - 1, -1, -1):
            total = total * delay + taps[i]
        out[f] = total
    return out


@jit
def scaled(spectrum: Spectrum, above: Spectrum, below: Spectrum) -> Spectrum:
    """Return spectrum times above over below, each (F,)."""
    out = np.empty_like(spectrum)
    for f in range(spectrum.shape[0]):
        out[f] = spectrum[f] * above[f] / below[f]
    return out
