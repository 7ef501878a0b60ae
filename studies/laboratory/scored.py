"""Hypotheses made of simulated runs, and the paper's four factors scored under each.

>>> hypotheses = [none(cases=4), *(of_curves(each, ground.middle, 2.0) for each in ...)]
>>> scores(ground, hypotheses, decades=2.0, synthetic=40, seed=1)

A suspect alone has its curves, their medians interpolated between sizes; several together have
draws of their own, one run each. Whatever the hypothesis, every size is log-uniform over as many
decades up to the largest: the prior is as wide for all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy import special

from flexsim.numerics.elementary import log10, power_of_ten
from flexsim.numerics.types import Array
from studies.core.evidence.intervals import LEVEL, share_interval
from studies.laboratory.alone import Curve
from studies.laboratory.hypotheses import (
    Fit,
    Hypothesis,
    Noise,
    confusion,
    fit,
    log_marginals,
    seen,
)
from studies.laboratory.rows import ConfusionRow, Ground, ScoreRow, paper_cases
from studies.laboratory.suspects import SUSPECTS

NONE, ALL, PAPER = "none", "all", "the paper's three"
BETWEEN = 17  # sizes of a suspect alone, at which its curves are read
DISCREPANCIES = np.geomspace(0.05, 0.5, 4)  # of a factor's logarithm: 5 % to two thirds, each alike
RESAMPLES = 99
LEADING = 3  # suspects whose pairs are hypotheses, too


def noise_of(ground: Ground) -> Noise:
    """Return what scatters the paper's factors: rounding, the simulated run's luck, discrepancy.

    The run in the laboratory has its own luck, which simulated runs of a hypothesis have, too.
    """
    rounding = np.array([each.rounding for each in paper_cases()])
    return Noise(np.hypot(rounding, ground.scatter), DISCREPANCIES)


def none(ground: Ground) -> Hypothesis:
    """Return the hypothesis that nothing is other than in the simulation."""
    return Hypothesis(NONE, np.log(ground.base / ground.middle[:, None])[None], np.zeros((1, 0)))


def of_curves(curves: Sequence[Curve], middle: Array, decades: float) -> Hypothesis:
    """Return the hypothesis of one suspect alone.

    Args:
        curves: of its signs. middle: (C,) medians without it [m]. decades: of its sizes.
    """
    logs, sizes = [], []
    for curve in curves:
        own = np.log(curve.envelopes / middle[:, None])  # (K, C, R)
        if len(curve.sizes) == 1:  # it is there, or not
            logs.append(own)
            sizes.append(np.ones(1))
            continue
        top = log10(curve.sizes[-1])
        at = np.linspace(top - decades, top, BETWEEN)
        logs.append(between(log10(curve.sizes), own, at))
        sizes.append(curve.sign * power_of_ten(at - top))
    suspect = curves[0].suspect
    count = int(suspect.sized)
    every, own = np.concatenate(logs), np.concatenate(sizes)[:, None]
    return Hypothesis(suspect.name, every, own, (suspect.name,), count)


def alone_hypotheses(ground: Ground, decades: float) -> list[Hypothesis]:
    """Return a hypothesis for each suspect alone."""
    names = dict.fromkeys(curve.suspect.name for curve in ground.curves)
    return [
        of_curves(
            [each for each in ground.curves if each.suspect.name == name], ground.middle, decades
        )
        for name in names
    ]


def leading(grounds: Sequence[Ground], decades: float) -> list[str]:
    """Return the suspects that explain the paper's factors best alone, under mirrored v.

    By their mean logarithm of the marginal likelihood on all plants under the first controllers.
    """
    y = np.log([[each.factor for each in paper_cases()]])
    first = [each for each in grounds if each.controllers == grounds[0].controllers]
    logs: dict[str, float] = {}
    for ground in first:
        noise = noise_of(ground)
        for each in alone_hypotheses(ground, decades):
            logs[each.name] = logs.get(each.name, 0.0) + float(log_marginals(y, each, noise)[0])
    return sorted(logs, key=lambda name: -logs[name])[:LEADING]


def likeliest(ground: Ground, decades: float) -> tuple[str, float]:
    """Return the suspect that explains the factors best alone on a ground, and its size [SI]."""
    y, noise = np.log([each.factor for each in paper_cases()]), noise_of(ground)
    every = alone_hypotheses(ground, decades)
    best = max(every, key=lambda each: log_marginals(y[None], each, noise)[0])
    found = fit(y, best, noise)
    share = 0.0 if found is None else float(best.sizes[found.draw, 0])
    return best.name, share * SUSPECTS[best.name].most


def between(x: Array, y: Array, at: Array) -> Array:
    """Return runs y (K, C, R) over x (K,) rising at other places (n,): of the nearer x, with their
    medians moved as far as a straight line between neighbours' goes.

    So what lies between two chaotic runs is as chaotic as they are, not the half of it that a mean
    of both would be. Nothing is moved beyond the ends, or where a neighbour always diverges.
    """
    place = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    share = np.clip((at - x[place]) / (x[place + 1] - x[place]), 0.0, 1.0)[:, None]
    finite = np.where(np.isfinite(y), y, np.nan)
    some = np.isfinite(finite).any(axis=2)
    middle = np.full(some.shape, np.nan)
    middle[some] = np.nanmedian(finite[some], axis=-1)
    nearer = np.where(share[:, 0] < 0.5, place, place + 1)
    moved = (1 - share) * middle[place] + share * middle[place + 1] - middle[nearer]
    return np.asarray(y[nearer] + np.where(np.isfinite(moved), moved, 0.0)[:, :, None])


def scores(
    ground: Ground,
    hypotheses: Sequence[Hypothesis],
    decades: float,
    synthetic: int,
    seed: int,
    again: Callable[[Hypothesis, int], Array],
) -> tuple[list[ScoreRow], list[ConfusionRow]]:
    """Return how likely the paper's four factors are under each hypothesis.

    Args:
        decades: of the sizes, as the hypotheses have them. synthetic: data sets that each makes,
            to be scored in turn; 0 for none.
        again: runs a draw of a hypothesis, (C, R) logarithms of factors: what is interpolated
            between sizes is seen to be so.
    """
    noise, rng = noise_of(ground), np.random.default_rng((seed, 23))
    y = np.log([each.factor for each in paper_cases()])
    logs = np.array([log_marginals(y[None], each, noise)[0] for each in hypotheses])
    drawn = np.array(
        [
            [log_marginals(y[None], each.resampled(rng), noise)[0] for each in hypotheses]
            for _ in range(RESAMPLES)
        ]
    )
    probability, resampled = special.softmax(logs), special.softmax(drawn, axis=1)
    low, high = np.quantile(resampled, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=0)
    names = [each.name for each in hypotheses]
    fits: list[Fit | None] = []
    for each in hypotheses:
        found = fit(y, each, noise)
        if found is not None:
            found = seen(found, y, again(each, found.draw), each, noise)
        fits.append(found)
    counts, means = confusion(hypotheses, noise, synthetic, rng)
    where = (ground.plant, ground.controllers)
    rows = [
        ScoreRow(
            *where,
            each.name,
            decades,
            float(logs[i]),
            float(probability[i]),
            float(low[i]),
            float(high[i]),
            float(np.exp(logs[i] - logs[names.index(NONE)])),
            *_recovered(counts[i], i),
            float(means[i, i]) if counts[i].any() else None,
            _like(counts[i], names, i),
            float(1 - (each.known > 0).all(axis=1).mean()),
            _sizes(each, found),
            found,
        )
        for i, (each, found) in enumerate(zip(hypotheses, fits, strict=True))
    ]
    pairs = [
        ConfusionRow(*where, names[i], names[j], counts[i, j] / counts[i].sum(), means[i, j])
        for i in range(len(names))
        for j in range(len(names))
        if counts[i].any()
    ]
    return rows, pairs


def _recovered(counts: Array, own: int) -> tuple[float | None, float | None, float | None]:
    """Return the share of data sets that are thought to be their own, and its interval."""
    total = round(counts.sum())
    if not total:
        return None, None, None
    low, high = share_interval(min(total, round(counts[own])), total)
    return float(counts[own] / total), low, high


def _like(counts: Array, names: Sequence[str], own: int) -> str:
    """Return what data sets are most often thought to be of that are not; '-' where none is."""
    others = np.where(np.arange(len(names)) == own, 0.0, counts)
    return names[int(others.argmax())] if others.any() else "-"


def _sizes(hypothesis: Hypothesis, found: Fit | None) -> str:
    """Return the sizes of the likeliest draw in words."""
    if found is None or not hypothesis.parts:
        return "-"
    sizes = zip(hypothesis.parts, hypothesis.sizes[found.draw], strict=True)
    return ", ".join(shown_size(name, float(x) * SUSPECTS[name].most) for name, x in sizes)


def shown_size(name: str, size: float) -> str:
    """Return a suspect with a size [SI] in words: 'payload 46 g'."""
    suspect = SUSPECTS[name]
    if not suspect.sized:
        return name
    signed = "+" if len(suspect.signs) > 1 else ""
    return f"{name} {suspect.scale * size:{signed}.2g} {suspect.unit}".strip()
