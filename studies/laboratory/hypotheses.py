"""Which hypothesis explains measured factors? Marginal likelihoods of simulated hypotheses.

>>> noise = Noise(fixed=np.array([0.1, 0.1]), discrepancies=np.array([0.1, 0.3]))
>>> cause = Hypothesis("cause", np.log(factors))         # (n, C, R) simulated, inf where diverged
>>> np.exp(log_marginals(np.log([[3.3, 1.5]]), cause, noise))

A hypothesis is n draws of sizes from its prior, each with R simulated logarithms of the factors in
C cases. Given a draw, cases are independent: measured is what a run of the laboratory gives, over
what one of the simulation gives, with rounding, and with a discrepancy between the true arm and
any simulation, alike in all cases and of unknown size:

    p(y | H) = mean over discrepancies s, mean over draws, product over cases, mean over runs,
               N(y; log factor, fixed^2 + s^2),

0 for a run that diverged, since what was measured did not. All of it is elementary, and has closed
forms where factors are Gaussian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import special, stats

from flexsim.numerics.types import Array

AT_ONCE = 4_000_000  # numbers in memory: 32 MB
TIE = 1e-9  # relative, of probabilities that are one


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """What a cause predicts.

    Attributes:
        name: as shown. log_factors: (n, C, R), inf where diverged. sizes: (n, k) of the draws, as
            multiples of the largest. parts: what they are of. count: of those that are free.
    """

    name: str
    log_factors: Array
    sizes: Array
    parts: tuple[str, ...] = ()
    count: int = 0

    @property
    def draws(self) -> int:
        """Draws of the prior."""
        return len(self.log_factors)

    @cached_property
    def known(self) -> Array:
        """(n, C) share of the runs that did not diverge."""
        return np.asarray(np.isfinite(self.log_factors).mean(axis=2))

    @cached_property
    def moments(self) -> tuple[Array, Array]:
        """(n, C) mean and variance of the logarithms where bounded, nan where none was."""
        finite = np.isfinite(self.log_factors)
        count = finite.sum(axis=2)
        with np.errstate(invalid="ignore", divide="ignore"):
            own = np.where(finite, self.log_factors, 0.0)
            mean = own.sum(axis=2) / count
            apart = np.where(finite, self.log_factors - mean[:, :, None], 0.0)
            return mean, (apart**2).sum(axis=2) / count

    def resampled(self, rng: np.random.Generator) -> Hypothesis:
        """Return it with runs drawn anew, or with draws where each has one run."""
        n, _, runs = self.log_factors.shape
        if runs > 1:
            return replace(self, log_factors=self.log_factors[:, :, rng.integers(0, runs, runs)])
        some = rng.integers(0, n, n)
        return replace(self, log_factors=self.log_factors[some], sizes=self.sizes[some])


@dataclass(frozen=True, eq=False)
class Noise:
    """What scatters a measured logarithm beside its cause.

    Attributes:
        fixed: (C,) standard deviations of rounding and of the simulated run.
        discrepancies: (S,) standard deviations, each as likely.
    """

    fixed: Array
    discrepancies: Array


def log_likelihoods(y: Array, hypothesis: Hypothesis, noise: Noise) -> Array:
    """Return log p(y | draw, discrepancy) (M, n, S) of measured logarithms y (M, C)."""
    n, cases, runs = hypothesis.log_factors.shape
    found = np.empty((len(y), n, len(noise.discrepancies)))
    step = max(1, AT_ONCE // max(1, n * cases * runs))
    variances = noise.fixed[:, None] ** 2 + noise.discrepancies**2  # (C, S)
    for start in range(0, len(y), step):
        some = y[start : start + step]
        square = (some[:, None, :, None] - hypothesis.log_factors) ** 2  # (m, n, C, R)
        for s, variance in enumerate(variances.T):
            log = -0.5 * (square / variance[:, None] + np.log(2 * np.pi * variance)[:, None])
            each = np.logaddexp.reduce(log, axis=3) - np.log(runs)
            found[start : start + step, :, s] = each.sum(axis=2)
    return found


def log_marginals(y: Array, hypothesis: Hypothesis, noise: Noise) -> Array:
    """Return log p(y | hypothesis) (M,) of measured logarithms y (M, C)."""
    each = log_likelihoods(y, hypothesis, noise)
    whole = np.logaddexp.reduce(each.reshape(len(y), -1), axis=1)
    return np.asarray(whole - np.log(each[0].size))


def posteriors(y: Array, hypotheses: Sequence[Hypothesis], noise: Noise) -> Array:
    """Return probabilities (M, H) of hypotheses that are equally likely before."""
    logs = np.stack([log_marginals(y, each, noise) for each in hypotheses], axis=1)
    return np.asarray(special.softmax(logs, axis=1))


def made(hypothesis: Hypothesis, noise: Noise, count: int, rng: np.random.Generator) -> Array:
    """Return measured logarithms (count, C) as a hypothesis would make them.

    A draw of the prior, as often as it does not diverge; runs, noise and a discrepancy with it.
    """
    y, cases = [], hypothesis.log_factors.shape[1]
    odds = hypothesis.known.prod(axis=1)
    if not odds.any():
        return np.zeros((0, cases))
    for at in rng.choice(len(odds), count, p=odds / odds.sum()):
        runs = [rng.choice(each[np.isfinite(each)]) for each in hypothesis.log_factors[at]]
        s = rng.choice(noise.discrepancies)
        y.append(runs + np.sqrt(noise.fixed**2 + s**2) * rng.standard_normal(cases))
    return np.array(y)


def confusion(
    hypotheses: Sequence[Hypothesis], noise: Noise, count: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return how often what a hypothesis (row) makes is thought to be of another (column), and the
    mean probability that it is given: (H, H) counts and (H, H) probabilities.

    A tie counts for each of its hypotheses in equal parts. Rows are of zeros where a hypothesis
    always diverges.
    """
    size = len(hypotheses)
    counts, means = np.zeros((size, size)), np.zeros((size, size))
    for i, each in enumerate(hypotheses):
        y = made(each, noise, count, rng)
        if len(y):
            found = posteriors(y, hypotheses, noise)
            means[i] = found.mean(axis=0)
            first = np.isclose(found, found.max(axis=1, keepdims=True), rtol=TIE, atol=0)
            counts[i] = (first / first.sum(axis=1, keepdims=True)).sum(axis=0)
    return counts, means


@dataclass(frozen=True, eq=False)
class Fit:
    """How near a hypothesis comes with one and the same draw.

    Attributes:
        draw: which is the likeliest. factors: (C,) of its runs, medians, inf where half diverge.
        worst: the largest of |log(measured/factor)|.
        p_value: posterior predictive probability of a chi^2 as large, discrepancy included.
        p_exact: of the likeliest draw's without any discrepancy, as many degrees of freedom less
            as sizes are free, one at least.
    """

    draw: int
    factors: Array
    worst: float
    p_value: float
    p_exact: float


def fit(y: Array, hypothesis: Hypothesis, noise: Noise) -> Fit | None:
    """Return how near a hypothesis comes to measured logarithms y (C,); None if all diverges."""
    mean, variance = hypothesis.moments
    if not (hypothesis.known > 0).all(axis=1).any():
        return None
    log = log_likelihoods(y[None], hypothesis, noise)[0]  # (n, S)
    weights = np.exp(log - log.max())
    weights /= weights.sum()
    best = int(weights.sum(axis=1).argmax())
    square = (y - mean) ** 2  # (n, C)
    whole = variance[:, :, None] + noise.fixed[:, None] ** 2 + noise.discrepancies**2
    chi2 = (square[:, :, None] / whole).sum(axis=1)  # (n, S)
    tail = np.where(np.isfinite(chi2), stats.chi2.sf(chi2, len(y)), 0.0)
    p_value = float((weights * tail).sum())
    return seen(
        Fit(best, mean, 0.0, p_value, 0.0), y, hypothesis.log_factors[best], hypothesis, noise
    )


def seen(found: Fit, y: Array, logs: Array, hypothesis: Hypothesis, noise: Noise) -> Fit:
    """Return a fit by runs (C, R) at its draw: logarithms of factors, inf where diverged."""
    middle = np.median(logs, axis=1)
    if np.isinf(middle).any():
        return replace(found, factors=np.exp(middle), worst=np.inf, p_exact=0.0)
    finite = np.where(np.isfinite(logs), logs, np.nan)
    apart = y - middle
    exact = float((apart**2 / (np.nanvar(finite, axis=1) + noise.fixed**2)).sum())
    free = max(1, len(y) - hypothesis.count)
    p_exact = float(stats.chi2.sf(exact, free))
    return replace(found, factors=np.exp(middle), worst=float(abs(apart).max()), p_exact=p_exact)
