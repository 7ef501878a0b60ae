"""Which of the varied numbers matter? Rank correlations or Sobol' indices, with intervals.

>>> sensitivity_rows(cells, seed=1)[0].number, sensitivity_rows(cells, seed=1)[0].value

Of samples by Sobol' sequence or Latin hypercube, Spearman's rank correlation of a figure with each
number: +1 or -1 where the figure rises or falls with it, whatever else varies. Of saltelli's, the
share of the figure's variance that a number explains alone, and together with the others.

Source: A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259, as scipy.stats.sobol_indices.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from flexsim.numerics.types import Array
from studies.core.evidence.intervals import LEAST_RUNS, LEVEL, MANY
from studies.run.summary import COMPARED, Cells
from studies.spec.draws import SALTELLI, Draws, sensitivity_rows_of

RESAMPLES, FEWER = 999, 199  # the latter of more draws than MANY
NUMBERS = 4_000_000  # drawn at a time: 32 MB
CORRELATION, FIRST_ORDER, TOTAL = "rank correlation", "first-order index", "total index"
Ends = tuple[float, float, float]  # a value and the ends of its interval


@dataclass(frozen=True)
class SensitivityRow:
    """How a figure of one cell depends on a varied number.

    Attributes:
        factors, point: of the cell, as `studies.run.summary.CellRow` has them.
        number: its path. measure: rank correlation, first-order or total index. draws: behind it.
        low, high: 95 % interval by bootstrap of draws. value, low, high: None where nothing varies
            or, of an index, where a draw diverged.
    """

    factors: dict[str, str]
    point: dict[str, float]
    figure: str
    number: str
    measure: str
    draws: int
    value: float | None
    low: float | None
    high: float | None


def sensitivity_rows(cells: Cells, seed: int) -> list[SensitivityRow]:
    """Return every cell's rows, none where no number has a distribution.

    Repeats of a draw count by their median.
    """
    draws, repeats = cells.matrix.draws, cells.matrix.repeats
    if not draws.sampled:
        return []
    numbers = draws.columns(np.arange(draws.samples))[len(draws.gridded) :]
    rows: list[SensitivityRow] = []
    for figure in COMPARED:
        for cell, values in enumerate(cells.column(figure)):
            by_draw = np.median(values.reshape(draws.samples, repeats), axis=1)
            found = _indices(draws, by_draw, seed) if draws.sampler == SALTELLI else None
            if found is None:
                found = _correlations(draws, numbers, by_draw, seed)
            about = cells.about(cell)
            rows += [SensitivityRow(**about, figure=figure, **each) for each in found]
    return rows


def _correlations(
    draws: Draws, numbers: list[Array], values: Array, seed: int
) -> list[dict[str, Any]]:
    """Return Spearman's correlations; a run that diverged is larger than all that did not."""
    count, ranks = len(values), stats.rankdata(values)
    own = [stats.rankdata(number) for number in numbers]
    found = [float(_correlation(each[None], ranks[None])[0]) for each in own]
    resampled: list[list[Array]] = [[] for _ in own]
    rng = np.random.default_rng(seed)
    at_once = max(1, min(RESAMPLES, NUMBERS // count))
    resamples = 0 if count < LEAST_RUNS else RESAMPLES if count <= MANY else FEWER
    for start in range(0, resamples, at_once):
        some = rng.integers(0, count, (min(at_once, resamples - start), count))
        drawn = ranks[some]
        for each, kept in zip(own, resampled, strict=True):
            kept.append(_correlation(each[some], drawn))
    rows = []
    for path, value, kept in zip(draws.sampled, found, resampled, strict=True):
        low = high = None
        if kept and np.isfinite(value):
            low, high = np.nanquantile(np.concatenate(kept), [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
        rows.append(_row(path, CORRELATION, count, value, low, high))
    return rows


def _correlation(one: Array, other: Array) -> Array:
    """Return Pearson's correlation of rows (m, n), (m, n); nan where one does not vary."""
    a = one - one.mean(axis=1, keepdims=True)
    b = other - other.mean(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray((a * b).sum(axis=1) / np.sqrt((a * a).sum(axis=1) * (b * b).sum(axis=1)))


def _indices(draws: Draws, values: Array, seed: int) -> list[dict[str, Any]]:
    """Return Sobol' indices of first order and total; None for all where a draw diverged."""
    count = len(values)
    if not np.isfinite(values).all() or np.ptp(values) == 0:
        return [
            _row(path, measure, count, None, None, None)
            for path in draws.sampled
            for measure in (FIRST_ORDER, TOTAL)
        ]
    each = sobol_indices(*sensitivity_rows_of(draws, values), seed)
    return [
        _row(path, measure, count, *own)
        for path, both in zip(draws.sampled, each, strict=True)
        for measure, own in zip((FIRST_ORDER, TOTAL), both, strict=True)
    ]


def sobol_indices(f_A: Array, f_B: Array, f_AB: Array, seed: int) -> list[tuple[Ends, Ends]]:
    """Return first-order and total index of each number, with the ends of their 95 % intervals.

    Args:
        f_A, f_B: (n,), f_AB: (d, n) values, not all the same, see `studies.spec.draws`.
        seed: of the bootstrap.
    """
    given = {"f_A": f_A[None], "f_B": f_B[None], "f_AB": f_AB[:, None]}
    found = stats.sobol_indices(func=given, n=len(f_A), rng=np.random.default_rng(seed))
    with warnings.catch_warnings(), np.errstate(divide="ignore", invalid="ignore"):
        # of a number that changes nothing all resamples are alike, and there is no interval
        warnings.simplefilter("ignore", stats.DegenerateDataWarning)
        ends = found.bootstrap(confidence_level=LEVEL, n_resamples=RESAMPLES)
    parts = (
        (found.first_order, ends.first_order.confidence_interval),
        (found.total_order, ends.total_order.confidence_interval),
    )
    columns = [
        [np.ravel(each) for each in (values, interval.low, interval.high)]
        for values, interval in parts
    ]
    first, total = (
        [(float(value), float(low), float(high)) for value, low, high in zip(*column, strict=True)]
        for column in columns
    )
    return list(zip(first, total, strict=True))


def _row(path: str, measure: str, draws: int, value: Any, low: Any, high: Any) -> dict[str, Any]:
    value, low, high = (
        None if x is None or not np.isfinite(x) else float(x) for x in (value, low, high)
    )
    return {
        "number": path,
        "measure": measure,
        "draws": draws,
        "value": value,
        "low": low,
        "high": high,
    }
