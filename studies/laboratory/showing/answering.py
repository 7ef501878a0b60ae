"""The answer in a few sentences, made of the numbers.

>>> answer(result)      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from studies.core.evidence.digits import percent
from studies.laboratory.rows import Ground, LaboratoryResult, ScoreRow, of_ground, paper_cases
from studies.laboratory.scored import NONE
from studies.laboratory.suspects import SUSPECTS

DIVERGES = "div "
FITS = 0.05  # a p-value below which one set of sizes does not give all four
SURE, PERHAPS = 0.95, 0.5  # shares of resamples that reach a factor
FEW = 3  # sizes that are told one by one


def likely(result: LaboratoryResult, ground: Ground, wide: bool = True) -> list[ScoreRow]:
    """Return a ground's hypotheses under the widest or narrowest priors, the likeliest first."""
    rows = of_ground(result.scores, ground)
    decades = [row.decades for row in rows]
    its = max(decades) if wide else min(decades)
    return sorted((row for row in rows if row.decades == its), key=lambda row: -row.probability)


def _reached(result: LaboratoryResult, ground: Ground) -> dict[str, list[float]]:
    """Return how surely each suspect reaches the paper's factor in each case, of either sign."""
    cases = [each.name for each in paper_cases()]
    found: dict[str, list[float]] = {}
    for row in of_ground(result.reach, ground):
        mine = found.setdefault(row.suspect.split()[0], [0.0] * len(cases))
        case = cases.index(row.case)
        mine[case] = max(mine[case], row.found.share if row.found.size is not None else 0.0)
    return found


def strongest(result: LaboratoryResult, ground: Ground) -> list[str]:
    """Return the suspects that surely reach each of the four factors, at sizes of their own."""
    every = _reached(result, ground).items()
    return [name for name, shares in every if min(shares) >= SURE]


def weakest(result: LaboratoryResult, ground: Ground) -> list[str]:
    """Return the suspects that reach none of the four factors in their ranges."""
    every = _reached(result, ground).items()
    return [name for name, shares in every if max(shares) < PERHAPS]


def early(result: LaboratoryResult, ground: Ground) -> list[str]:
    """Return the suspects under which some loop diverges before it is as much worse."""
    rows = of_ground(result.reach, ground)
    lost = (r.suspect.split()[0] for r in rows if r.found.diverges and r.found.size is None)
    return list(dict.fromkeys(lost))


def _everywhere(
    of: Callable[[LaboratoryResult, Ground], list[str]],
    result: LaboratoryResult,
    grounds: Sequence[Ground],
) -> list[str]:
    """Return the names that are given on every ground."""
    others = [set(of(result, each)) for each in grounds]
    return [name for name in of(result, grounds[0]) if all(name in each for each in others)]


def two_digits(number: float) -> str:
    """Return a number above 0 in two digits, large ones without an exponent."""
    return f"{number:.2g}" if number < 100 else f"{float(f'{number:.2g}'):.0f}"


def _names(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"


def answer(result: LaboratoryResult) -> str:
    """Return which suspects give the paper's factors, which cannot, and what is likeliest."""
    by_name: dict[str, list[Ground]] = {}
    for ground in result.grounds:
        by_name.setdefault(ground.controllers, []).append(ground)
    return " ".join(_of_controllers(result, name, mine) for name, mine in by_name.items())


def _of_controllers(result: LaboratoryResult, name: str, grounds: list[Ground]) -> str:
    """Return the sentences on one kind of controllers, on all its plants."""
    every, nothing, lost = (_everywhere(of, result, grounds) for of in (strongest, weakest, early))
    plants = " and ".join(each.plant for each in grounds)
    words = [
        f"With the {name} controllers ({plants}), of {len(result.suspects)} suspects alone these "
        f"reach each of the paper's factors, at a size of its own for each: {_names(every)}. None "
        f"of the factors in their ranges: {_names(nothing)}. Some loop diverges before it is as "
        f"much worse: {_names(lost)}."
    ]
    words.append(_growing(result, name))
    for each in grounds:
        words += [_likeliest(result, each), _causes(result, each)]
    return " ".join(each for each in words if each)


def _causes(result: LaboratoryResult, ground: Ground) -> str:
    """Return how likely each cause is on a ground, the least and the most of all ways to score."""
    rows = of_ground(result.causes, ground)
    parts = []
    for cause in dict.fromkeys(row.cause for row in rows):
        odds = [100 * row.probability for row in rows if row.cause == cause]
        parts.append((odds[0], f"{cause} {odds[0]:.0f} % ({min(odds):.0f} to {max(odds):.0f})"))
    said = ", ".join(text for _, text in sorted(parts, reverse=True))
    return f"As causes, equally likely before: {said}, by how it is scored."


def _growing(result: LaboratoryResult, name: str) -> str:
    """Return what makes the exact linear loop grow, and from which size on; '' if nothing does."""
    rows = [row for row in result.growth if row.controllers == name]
    always, sizes = [], []
    for each in dict.fromkeys(row.suspect for row in rows):
        suspect = SUSPECTS[each.split()[0]]
        grows = [row.grows for row in rows if row.suspect == each]
        if any(size is None for size in grows):
            continue
        if not suspect.sized:
            always.append(each)
        elif max(size or 0.0 for size in grows) > 0:
            ends = sorted({two_digits(suspect.scale * (size or 0.0)) for size in grows}, key=float)
            between = f"{ends[0]} to {ends[-1]}" if len(ends) > 1 else ends[0]
            sizes.append(f"{each} from {between} {suspect.unit}".strip())
    if not always + sizes:
        return ""
    return f"The exact linear loop grows in all four cases with {_names([*always, *sizes])}."


def _likeliest(result: LaboratoryResult, ground: Ground) -> str:
    """Return what is likeliest on a ground, how surely, and whether one set gives all four."""
    rows = likely(result, ground)
    best, second = rows[0], rows[1] if len(rows) > 1 else rows[0]
    ends = (best.probability_low, best.probability_high)
    suspect = SUSPECTS.get(best.hypothesis)
    cause = f" ({suspect.cause})" if suspect else ""
    text = (
        f"On {ground.plant} the likeliest of {len(rows)} hypotheses is {best.hypothesis}{cause}, "
        f"{percent(best.probability, *ends)}, {two_digits(best.bayes)} times as likely as {NONE}; "
        f"then {second.hypothesis}, {100 * second.probability:.0f} %"
    )
    narrow = likely(result, ground, wide=False)[0]
    if narrow.decades != best.decades:
        odds = 100 * narrow.probability
        text += f"; with half as wide priors {narrow.hypothesis}, {odds:.0f} %"
    if best.recovered is not None:
        text += (
            f". Of data of its own {100 * best.recovered:.0f} % are called so, else mostly "
            f"{best.like}"
        )
    return f"{text}. {_fitted(best)}"


def _fitted(best: ScoreRow) -> str:
    """Return whether one and the same set of a hypothesis' sizes gives all four factors."""
    if best.fit is None:
        return "It diverges everywhere."
    few = best.sizes != "-" and best.sizes.count(",") < FEW
    factors, measured = (
        ", ".join(f"{x:.1f}" for x in each)
        for each in (best.fit.factors, [paper.factor for paper in paper_cases()])
    )
    one = "One set" if best.fit.p_exact >= FITS else "No one set"
    return (
        f"{best.sizes if few else 'Its likeliest draw'} gives {factors} for {measured}. {one} of "
        f"its sizes gives all four within rounding and luck (p {best.fit.p_exact:.1g}; "
        f"{best.fit.p_value:.2f} if models are off by some tenths)."
    )
