"""How far off estimates may be: residuals that are not white, and the model that is not the arm.

>>> spread = spread_of(problem, residuals, jacobian)
>>> spread.error, spread.half                # (p,) standard errors, half-widths of 95 %

Of residuals r and their slopes J in the coordinates z, the covariance is the sandwich

    (J'J)^-1 S (J'J)^-1,   S = sum_l w_l sum_t (s_t s_(t-l)' + ...),   s_t = sum_c J_tc' r_tc

with Bartlett's weights w_l, a bandwidth after Andrews from the scores' first autocorrelation, and,
as the bandwidth takes degrees of freedom, Student's quantile with 1.5 T over it. What a model lacks
is no white noise, and neither is a count of an encoder, whose errors last as long as a joint
lingers: too few of them for their autocorrelation to be seen. So where a signal is counted, S is
also what such counts would make of the modelled motion, drawn at phases of the count that nobody
knows, beside the other signals' sum. The largest of both and of the classical s^2 (J'J)^-1, which
takes residuals for white, stands.

Source: Newey and West, Econometrica 55 (1987) 703; Andrews, Econometrica 59 (1991) 817, (6.2) and
(6.4); 1.5 T over Bartlett's bandwidth: Priestley, Spectral Analysis and Time Series (1981), table
6.1. Ljung and Box, Biometrika 65 (1978) 297, for the test of whiteness.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import linalg, stats

from flexsim.numerics.types import Array

LEVEL = 0.95
LAGS = 20  # of the test of whiteness
WHITE = 0.05  # p below which residuals are not
ANDREWS = 1.1447  # of Bartlett's weights, (6.2)
CORRELATED_MOST = 0.999  # first autocorrelation that a bandwidth is made for
SHARE_MOST = 0.2  # of the rows, a bandwidth
PHASES, PHASES_SEED = 100, 0  # of a count, at which its errors are drawn


class Counted(NamedTuple):
    """A record's modelled signals (N, S), their counts (S,), 0 where there are none, noise (S,)."""

    signals: Array
    counts: Array
    sigmas: Array


class Spread(NamedTuple):
    """What there is to know of estimates' errors, in their coordinates.

    Attributes:
        covariance: (p, p). error: (p,) standard errors. half: (p,) half-widths of LEVEL.
        freedom: degrees of freedom of the quantile. lags: bandwidth, in rows.
    """

    covariance: Array
    error: Array
    half: Array
    freedom: float
    lags: float


def spread_of(
    residuals: Sequence[Array], slopes: Sequence[Array], counted: Sequence[Counted] = ()
) -> Spread:
    """Return the errors of coordinates.

    Args:
        residuals: (N, S) of each record. slopes: (N, S, p) of each record. counted: of each
            record, if any signal of theirs is.
    """
    flat = np.vstack([each.reshape(-1, each.shape[-1]) for each in slopes])
    inverse = inverse_information(flat)
    count = flat.shape[0] - flat.shape[1]
    squares = sum(float(np.sum(each**2)) for each in residuals)
    classical = inverse * squares / max(count, 1)
    scores = [np.einsum("tc,tcp->tp", r, J) for r, J in zip(residuals, slopes, strict=True)]
    lags = bandwidth(scores)
    meat = sum(long_run(each, lags) for each in scores)
    sandwich = inverse @ meat @ inverse
    by_counts = inverse @ counts_meat(residuals, slopes, counted, lags) @ inverse
    largest = [np.diag(each) for each in (classical, sandwich, by_counts)]
    wider = np.sqrt(np.max(largest, axis=0))
    base = np.sqrt(np.maximum(np.diag(sandwich), 1e-300))
    covariance = sandwich * np.outer(wider / base, wider / base)
    rows = sum(len(each) for each in scores)
    freedom = max(1.5 * rows / lags, 3.0)
    quantile = float(stats.t.ppf((1 + LEVEL) / 2, freedom))
    return Spread(covariance, wider, quantile * wider, freedom, lags)


def counts_meat(
    residuals: Sequence[Array], slopes: Sequence[Array], counted: Sequence[Counted], lags: float
) -> Array:
    """Return S (p, p) of signals that are counted, and of the others; 0 where none is."""
    size = slopes[0].shape[-1]
    drawn, others = np.zeros((PHASES, size)), np.zeros((size, size))
    rng = np.random.default_rng(PHASES_SEED)
    if not any(each.counts.any() for each in counted):
        return others
    for r, J, each in zip(residuals, slopes, counted, strict=True):
        for s in np.flatnonzero(each.counts):
            place, unit = each.signals[:, s] / each.counts[s], each.counts[s] / each.sigmas[s]
            at = place + rng.uniform(size=(PHASES, 1))
            drawn += unit * (np.round(at) - at) @ J[:, s]
        free = each.counts == 0
        others += long_run(np.einsum("tc,tcp->tp", r[:, free], J[:, free]), lags)
    return others + drawn.T @ drawn / PHASES


def inverse_information(slopes: Array) -> Array:
    """Return (J'J)^-1 of slopes (R, p), by singular values of J with unit columns."""
    size = np.linalg.norm(slopes, axis=0)
    size = np.where(size > 0, size, 1.0)
    _, s, vt = linalg.svd(slopes / size, full_matrices=False)
    scaled = (vt.T / np.maximum(s, 1e-12)) / size[:, None]
    return scaled @ scaled.T


def bandwidth(scores: Sequence[Array]) -> float:
    """Return Andrews's bandwidth of Bartlett's weights for scores (N, p) of each record [rows].

    Of first-order processes with each score's own first autocorrelation; the longest counts.
    """
    rows = sum(len(each) for each in scores)
    above = sum(np.sum(each[1:] * each[:-1], axis=0) for each in scores)
    whole = sum(np.sum(each**2, axis=0) for each in scores)
    first = np.abs(above / np.where(whole > 0, whole, 1.0)).max()
    rho = min(float(first), CORRELATED_MOST)
    alpha = 4 * rho**2 / ((1 - rho) ** 2 * (1 + rho) ** 2)
    shortest = min(len(each) for each in scores)
    return float(np.clip(ANDREWS * (alpha * rows) ** (1 / 3), 1.0, SHARE_MOST * shortest))


def long_run(scores: Array, lags: float) -> Array:
    """Return the sum (p, p) of a record's autocovariances, Bartlett's weights over `lags` rows."""
    found = scores.T @ scores
    for lag in range(1, min(int(lags), len(scores) - 1) + 1):
        weight = 1 - lag / (lags + 1)
        across = scores[lag:].T @ scores[:-lag]
        found = found + weight * (across + across.T)
    return found


def correlation(covariance: Array) -> Array:
    """Return the correlations (p, p) of a covariance."""
    size = np.sqrt(np.diag(covariance))
    return covariance / np.outer(size, size)


def autocorrelations(column: Array, lags: int = LAGS) -> Array:
    """Return the autocorrelations (lags,) of a signal (N,), its mean taken away."""
    x = column - column.mean()
    whole = float(x @ x)
    if whole == 0.0:
        return np.zeros(lags)
    return np.array([float(x[k:] @ x[:-k]) / whole for k in range(1, lags + 1)])


def whiteness(column: Array, lags: int = LAGS) -> float:
    """Return the probability of residuals (N,) as correlated as these if they were white.

    Ljung and Box: n (n + 2) sum_k rho_k^2 / (n - k) is chi-squared with as many degrees of freedom
    as lags.
    """
    n = len(column)
    rho = autocorrelations(column, lags)
    statistic = n * (n + 2) * float(np.sum(rho**2 / (n - np.arange(1, lags + 1))))
    return float(stats.chi2.sf(statistic, lags))
