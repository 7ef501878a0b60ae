"""Is a rung as good as the exact beam? A test of equivalence, figure by figure.

>>> change_of(rung, reference, published_runs(envelopes), seed=1).status
'within'

That no difference is found proves nothing: too few runs find none. So it is the other way round. A
figure is `within` if the whole 95 % interval of its change, a bootstrap of the paired runs, lies
between plus and minus a margin, which is two one-sided tests at 2.5 %; `beyond` if the whole
interval lies outside; `not resolved` if it has an end of the margin in it, or there is none, as of
fewer than six runs. The margin is the statistical interval of what is published: the half-width of
the reference's 95 % interval over as many runs as `flexsim compare` takes (20, doubled until the
envelope's is +-0.05 mm or 1 %), or FLOOR, half of a printed digit, if that is more. It does not
shrink with the runs of this study, so that more runs resolve more.

A rung is within if every figure is, in every case: since all must pass, chance lets a rung that is
not pass no more often than one test does. It is beyond if any figure is, or if its steps damp
what grows on the exact linear loop, or the other way round. The cheapest rung of a ladder is its
coarsest, of fewest modes, segments or steps: that the cost grows along a ladder is measured and
shown, but timers do not decide.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexsim.linear.exact_loop import CONVERGED
from flexsim.recording.traces import MM
from studies.converge.rows import FIGURES, CaseRow, Change, LadderRow, RungRow
from studies.core.evidence.intervals import (
    difference_interval,
    median_interval,
    quantile,
    share_interval,
)
from studies.core.evidence.repeats import are_enough, counts

WITHIN, BEYOND, OPEN = "within", "beyond", "not resolved"
FLOOR = 5e-5  # [m] half of a digit printed


def published_runs(envelopes: Sequence[float]) -> int:
    """Return over how many of these runs a figure is published; all if they are not enough.

    Args:
        envelopes: of every run [m], inf where diverged.
    """
    return next(
        (n for n in counts() if n <= len(envelopes) and are_enough(envelopes[:n])), len(envelopes)
    )


def margin_of(reference: Sequence[float], published: int) -> float | None:
    """Return within what a figure may change [m], None where the reference's interval is open.

    Args:
        reference: of every run [m], inf where diverged. published: see `published_runs`.
    """
    if math.isinf(quantile(reference)):
        return None
    ends = median_interval(reference[:published])
    if ends is None:
        return FLOOR
    half = (ends[1] - ends[0]) / 2
    return max(FLOOR, half) if math.isfinite(half) else None


def change_of(
    rung: ArrayLike, reference: ArrayLike, published: int, seed: int, same: bool = False
) -> Change:
    """Return how far a rung moves the median of a figure, and what that says.

    Args:
        rung, reference: (n,) of pairs of runs [m], inf where diverged. published: see `margin_of`.
        seed: of the bootstrap. same: whether the rung is the reference.
    """
    mine, exact = np.asarray(rung, dtype=float), np.asarray(reference, dtype=float)
    margin = margin_of(exact.tolist(), published)
    middle, other = quantile(mine), quantile(exact)
    if math.isinf(middle) or math.isinf(other):
        one_only = math.isinf(middle) != math.isinf(other)
        return Change(None, None, None, margin, BEYOND if one_only else OPEN)
    if same:
        return Change(0.0, 0.0, 0.0, margin, WITHIN)
    low, high = difference_interval(mine, exact, seed) or (-math.inf, math.inf)
    status = status_of(low, high, margin)
    return Change(middle - other, _known(low), _known(high), margin, status)


def _known(end: float) -> float | None:
    return end if math.isfinite(end) else None


def status_of(low: float, high: float, margin: float | None) -> str:
    """Return what an interval of a change says [m], its ends infinite where it is open."""
    if margin is None:
        return OPEN
    if -margin <= low and high <= margin:
        return WITHIN
    return BEYOND if low > margin or high < -margin else OPEN


def shares_status(diverged: int, reference: int, runs: int) -> str:
    """Return what the numbers of runs that diverged on a rung and on the reference say."""
    if diverged == reference:
        return WITHIN
    mine, exact = share_interval(diverged, runs), share_interval(reference, runs)
    return BEYOND if mine[0] > exact[1] or exact[0] > mine[1] else OPEN


def growth_agrees(growth: float, exact: float) -> bool:
    """Return whether a loop grows where the exact one does [1/s], to what that is known."""
    return (growth > 0) == (exact > 0) or abs(growth - exact) <= CONVERGED * (1 + abs(exact))


def overall(statuses: Iterable[str]) -> str:
    """Return the status of all together: the worst."""
    every = set(statuses)
    return next((each for each in (BEYOND, OPEN) if each in every), WITHIN)


def rung_status(rows: Sequence[CaseRow]) -> tuple[str, str]:
    """Return the status of a rung from its cases, and in words what speaks most against it."""
    said = [each for row in rows for each in _findings(row)]
    status = overall(each for each, _, _ in said)
    against = [(size, words) for each, size, words in said if each == status != WITHIN]
    return status, max(against, default=(0.0, ""))[1]


def _findings(row: CaseRow) -> list[tuple[str, float, str]]:
    """Return status, weight and words of every figure of a case."""
    found = [(row.shares, math.inf, f"{row.case}: {100 * row.found.diverged_share:.0f} % diverge")]
    if not row.agreed:
        words = f"{row.case}: growth {row.growth:+.2g} instead of {row.growth_exact:+.2g} 1/s"
        found.append((BEYOND, math.inf, words))
    for name in FIGURES:
        each = row.change(name)
        size = 0.0 if each.change is None else abs(each.change) / (each.margin or FLOOR)
        found.append((each.status, size, f"{row.case}: {name.replace('_', ' ')} {_words(each)}"))
    return found


def _words(each: Change) -> str:
    """Return a change and its interval in words."""
    if each.change is None:
        return "has no median"
    ends = (f"{MM * end:+.2f}" if end is not None else "?" for end in (each.low, each.high))
    return f"{MM * each.change:+.2f} mm [{', '.join(ends)}]"


def ladder_row(rungs: Sequence[RungRow]) -> LadderRow:
    """Return what a ladder says, its rungs from coarse to fine.

    The default is confirmed if it is the cheapest within, and others were run that are not.
    """
    default = next((i for i, rung in enumerate(rungs) if rung.default), None)
    first = next((i for i, rung in enumerate(rungs) if rung.status == WITHIN), None)
    coarser = rungs[: len(rungs) if first is None else first]
    unresolved = [rung.words for rung in coarser if rung.status == OPEN]
    mine = None if default is None else rungs[default]
    cheapest = None if first is None else rungs[first]
    return LadderRow(
        rungs[0].ladder,
        None if mine is None else mine.words,
        None if mine is None else mine.status,
        None if cheapest is None else cheapest.words,
        None if cheapest is None else cheapest.cost,
        ", ".join(unresolved),
        first is not None and first == default and not unresolved and len(rungs) > 2,
        "" if mine is None else mine.why,
    )
