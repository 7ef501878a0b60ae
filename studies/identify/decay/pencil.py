"""Frequencies and damping of a free decay, by the matrix pencil.

>>> found = decay(signal, period=1e-3, modes=2)
>>> found.frequency / 6.283, found.ratio             # [Hz], [-]

A decay is a sum of c e^(s t). Of its samples' Hankel matrix, reduced to its main directions,
the part without its last column and that without its first differ by a factor e^(s h) along each
of the decay's terms: the pencil's eigenvalues. A mean over q rows leaves every e^(s t) one, so that
slow modes need no long matrix. Standard errors are those of the least squares problem that the
pencil solves approximately, with the residuals' own autocorrelation.

Source: Hua and Sarkar, IEEE Trans. Acoustics, Speech and Signal Processing 38 (1990) 814.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array
from studies.identify.intervals import spread_of

ROWS_MOST = 1500  # of what is analysed: more is averaged
PENCIL = 1 / 3  # of the rows, the pencil's parameter: between a third and two are best
COLUMNS_MOST = 300  # of it; what a shorter one loses, the steps after the pencil give back
HIGHEST = 100.0  # [Hz] usual end of what is looked for
POINTS = 4  # rows of a period of the highest frequency at least
REFINED = 6  # Gauss-Newton steps after the pencil
LEAST = 1e-3  # [1/s, rad/s] |Im s| below which a term does not vibrate


class Decay(NamedTuple):
    """The modes of a decay, by rising frequency.

    Attributes:
        frequency: (n,) |s| [rad/s]. ratio: (n,) damping ratios. amplitude: (n,) at the start, in
            the signal's unit. frequency_half, ratio_half: (n,) half-widths of 95 %.
        left: root mean square of what is left, over that of the signal.
    """

    frequency: Array
    ratio: Array
    amplitude: Array
    frequency_half: Array
    ratio_half: Array
    left: float


def decay(signal: Array, period: float, modes: int, highest: float = HIGHEST) -> Decay:
    """Return the modes of a signal (N,) of samples a period apart [s].

    Args:
        modes: n. highest: up to which frequency there are modes [Hz].

    Raises:
        ParameterError: the signal is too short, still, or has no so many modes.
    """
    averaged = max(1, min(len(signal) // ROWS_MOST + 1, int(1 / (POINTS * highest * period))))
    rows = len(signal) // averaged
    y = signal[: rows * averaged].reshape(rows, averaged).mean(axis=1)
    size = float(np.ptp(y))
    if rows < 8 * modes + 8 or size == 0.0:
        what = "is still" if size == 0.0 else f"has {rows} rows"
        raise ParameterError(
            f"the decay {what}; {modes} modes need {8 * modes + 8} rows of a motion: give a "
            "longer log, another --signal, or fewer --modes"
        )
    h = averaged * period
    s = _poles((y - y.mean()) / size, 2 * modes + 1) / h
    kept = _vibrating(s, modes, highest)
    time = h * np.arange(rows, dtype=float)
    s, c, offset = _refined(y / size, time, kept)
    return _as_decay(y / size, time, s, c, offset, size, averaged, period)


def _poles(y: Array, order: int) -> Array:
    """Return the eigenvalues (order,) of a signal's pencil."""
    columns = min(int(PENCIL * len(y)), COLUMNS_MOST)
    hankel = np.lib.stride_tricks.sliding_window_view(y, columns)
    basis = np.linalg.eigh(hankel.T @ hankel)[1][:, -order:]  # (columns, order), the largest
    return np.log(np.linalg.eigvals(np.linalg.pinv(basis[:-1]) @ basis[1:]).astype(complex))


def _vibrating(s: Array, modes: int, highest: float) -> Array:
    """Return the exponents (modes,) that vibrate, one of each pair, by rising frequency."""
    pairs = s[(s.imag > LEAST) & (s.imag < 2 * math.pi * highest)]
    if len(pairs) < modes:
        raise ParameterError(
            f"the decay has {len(pairs)} modes below {highest:g} Hz, not {modes}; give fewer "
            "--modes, another --signal, or what is after the last torque alone with --begin"
        )
    return pairs[np.argsort(pairs.imag)][:modes]


def _terms(time: Array, s: Array) -> Array:
    """Return the real terms (N, 2 n + 1) of exponents (n,), the last one constant."""
    waves = np.exp(np.outer(time, s))
    return np.column_stack([waves.real, -waves.imag, np.ones(len(time))])


def _refined(y: Array, time: Array, s: Array) -> tuple[Array, Array, float]:
    """Return exponents (n,), complex amplitudes (n,) and constant after Gauss-Newton steps."""
    n = len(s)
    for _ in range(REFINED):
        found = np.linalg.lstsq(_terms(time, s), y, rcond=None)[0]
        c = found[:n] + 1j * found[n : 2 * n]
        slopes = _slopes(time, s, c)
        step = np.linalg.lstsq(slopes, y - _terms(time, s) @ found, rcond=None)[0]
        s = s + step[:n] + 1j * step[n : 2 * n]
    found = np.linalg.lstsq(_terms(time, s), y, rcond=None)[0]
    return s, found[:n] + 1j * found[n : 2 * n], float(found[-1])


def _slopes(time: Array, s: Array, c: Array) -> Array:
    """Return the derivatives (N, 4 n + 1) by real and imaginary parts of s, of c, and a constant.

    Of Re sum c e^(s t).
    """
    moved = time[:, None] * np.exp(np.outer(time, s)) * c
    return np.column_stack([moved.real, -moved.imag, _terms(time, s)])


def _as_decay(
    y: Array, time: Array, s: Array, c: Array, offset: float, size: float, q: int, period: float
) -> Decay:
    """Return exponents and amplitudes, of a signal in units of `size`, in the words of modes."""
    n = len(s)
    parts = np.concatenate([c.real, c.imag, [offset]])
    left = y - _terms(time, s) @ parts
    slopes = _slopes(time, s, c)
    spread = spread_of([left[:, None]], [slopes[:, None, :]])
    omega = np.abs(s)
    frequency_half, ratio_half = np.empty(n), np.empty(n)
    quantile = spread.half[0] / spread.error[0]
    for i in range(n):
        a, b = s[i].real, s[i].imag
        by = np.array([[a, b], [-(b**2), a * b] / omega[i] ** 2]) / omega[i]
        own = spread.covariance[np.ix_([i, n + i], [i, n + i])]
        errors = np.sqrt(np.diag(by @ own @ by.T))
        frequency_half[i], ratio_half[i] = quantile * errors
    # a mean over q rows scales c e^(s t) by that of e^(s t) over them
    mean = np.exp(np.outer(s, period * np.arange(q))).mean(axis=1)
    noise = float(np.sqrt(np.mean(left**2)) / np.sqrt(np.mean((y - y.mean()) ** 2)))
    order = np.argsort(omega)
    amplitude = np.abs(c / mean) * size
    return Decay(
        omega[order],
        (-s.real / omega)[order],
        amplitude[order],
        frequency_half[order],
        ratio_half[order],
        noise,
    )
