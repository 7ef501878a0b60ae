"""How likely is each cause, and what moves that? The same likelihoods, summed up and varied.

>>> cause_rows(ground, hypotheses, decades=2.0)[0].probability

Causes are equally likely before, and within each its hypotheses are: a cause of many suspects has
no more than one of few. A hypothesis whose parts are of several causes is of none of them, but of
SEVERAL. Varied are the width of the priors and the discrepancy between the true arm and any model.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import special

from flexsim.numerics.types import Array
from studies.laboratory.hypotheses import Hypothesis, Noise, log_marginals
from studies.laboratory.rows import CauseRow, Ground, paper_cases
from studies.laboratory.scored import NONE, noise_of
from studies.laboratory.suspects import CAUSES, SUSPECTS

SEVERAL = "several"
FAMILIES = (NONE, *CAUSES, SEVERAL)


def family(hypothesis: Hypothesis) -> str:
    """Return the cause that a hypothesis is of."""
    causes = {SUSPECTS[name].cause for name in hypothesis.parts}
    if not causes:
        return NONE
    return causes.pop() if len(causes) == 1 else SEVERAL


def cause_rows(
    ground: Ground, hypotheses: Sequence[Hypothesis], decades: float, varied: bool
) -> list[CauseRow]:
    """Return how likely each cause is on a ground.

    Args:
        decades: of the hypotheses' sizes. varied: whether for single discrepancies, too.
    """
    noise = noise_of(ground)
    y = np.log([[each.factor for each in paper_cases()]])
    rows = []
    singles = noise.discrepancies if varied else ()
    for alone in (None, *(float(s) for s in singles)):
        own = noise if alone is None else Noise(noise.fixed, np.array([alone]))
        logs = np.array([log_marginals(y, each, own)[0] for each in hypotheses])
        every = special.softmax(logs)
        best = int(every.argmax())
        about = (hypotheses[best].name, float(every[best]))
        families = [family(each) for each in hypotheses]
        there = [name for name in FAMILIES if name in families]
        mean = np.array([_mean(logs, families, name) for name in there])
        odds, none = special.softmax(mean), mean[there.index(NONE)]
        where = (ground.plant, ground.controllers, decades, alone)
        rows += [
            CauseRow(
                *where,
                name,
                families.count(name),
                float(odds[i]),
                float(np.exp(mean[i] - none)),
                *about,
            )
            for i, name in enumerate(there)
        ]
    return rows


def _mean(logs: Array, families: Sequence[str], name: str) -> float:
    """Return the logarithm of the mean likelihood of a cause's hypotheses."""
    own = [log for log, its in zip(logs, families, strict=True) if its == name]
    return float(special.logsumexp(own) - np.log(len(own)))
