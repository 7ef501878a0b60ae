"""The answer in a few sentences, made of the numbers.

>>> answer(result)      # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterable

from studies.core.evidence.digits import percent
from studies.laboratory.rows import Ground, LaboratoryResult, ScoreRow, of_ground, paper_cases
from studies.laboratory.scored import NONE
from studies.laboratory.suspects import SUSPECTS

DIVERGES = "div "
SMALL = 1.1  # a factor that no case exceeds: a suspect that does nothing
FITS = 0.05  # a p-value below which one set of sizes does not give all four


def likely(result: LaboratoryResult, ground: Ground) -> list[ScoreRow]:
    """Return a ground's hypotheses under the wide priors, the likeliest first."""
    rows = of_ground(result.scores, ground)
    widest = max(row.decades for row in rows)
    return sorted((row for row in rows if row.decades == widest), key=lambda row: -row.probability)


def _reached(result: LaboratoryResult, ground: Ground) -> dict[str, list[bool]]:
    """Return in which cases each suspect reaches the paper's factor at some size."""
    found: dict[str, list[bool]] = {}
    for row in of_ground(result.reach, ground):
        name = row.suspect.split()[0]
        mine = found.setdefault(name, [False] * len(paper_cases()))
        case = [each.name for each in paper_cases()].index(row.case)
        mine[case] = mine[case] or row.found.size is not None
    return found


def strongest(result: LaboratoryResult, ground: Ground) -> list[str]:
    """Return the suspects that reach each of the four factors, at sizes of their own."""
    return [name for name, cases in _reached(result, ground).items() if all(cases)]


def weakest(result: LaboratoryResult, ground: Ground) -> list[str]:
    """Return the suspects that reach none of the four factors within their ranges."""
    return [name for name, cases in _reached(result, ground).items() if not any(cases)]


def _early(result: LaboratoryResult, ground: Ground) -> list[str]:
    """Return the suspects that make some loop diverge before they make it as much worse."""
    rows = of_ground(result.reach, ground)
    lost = (r.suspect.split()[0] for r in rows if r.found.diverges and r.found.size is None)
    return list(dict.fromkeys(lost))


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
    first, whole = grounds[0], len({row.suspect for row in result.suspects})
    plants = " and ".join(each.plant for each in grounds)
    alike = [set(each) for each in ([*strongest(result, g)] for g in grounds)]
    every = [n for n in strongest(result, first) if all(n in each for each in alike)]
    nothing = [n for n in weakest(result, first) if all(n in weakest(result, g) for g in grounds)]
    early = [n for n in _early(result, first) if all(n in _early(result, g) for g in grounds)]
    words = [
        f"{name.capitalize()} controllers, {plants}: of {whole} suspects alone {len(every)} reach "
        f"each of the paper's factors, at sizes of their own ({_names(every)}); {len(nothing)} "
        f"reach none in their ranges ({_names(nothing)}); some loop diverges before it is as much "
        f"worse under {_names(early)}."
    ]
    words += [_likeliest(result, each) for each in grounds]
    return " ".join(words)


def _likeliest(result: LaboratoryResult, ground: Ground) -> str:
    """Return what is likeliest on a ground, how surely, and whether one set gives all four."""
    rows = likely(result, ground)
    best, second = rows[0], rows[1] if len(rows) > 1 else rows[0]
    ends = (best.probability_low, best.probability_high)
    cause = SUSPECTS[best.hypothesis].cause if best.hypothesis in SUSPECTS else ""
    text = (
        f"On {ground.plant} the likeliest is {best.hypothesis}{f' ({cause})' * bool(cause)}, "
        f"{percent(best.probability, *ends)}, {best.bayes:.2g} times as likely as {NONE}; next "
        f"{second.hypothesis}, {100 * second.probability:.0f} %"
    )
    if best.recovered is not None:
        text += f" (data of its own are called so in {100 * best.recovered:.0f} %)"
    if best.fit is None:
        return text + "."
    factors = ", ".join(f"{x:.1f}" for x in best.fit.factors)
    measured = ", ".join(f"{each.factor:.1f}" for each in paper_cases())
    verb = "gives" if best.fit.p_exact >= FITS else "does not give"
    return (
        f"{text}; {best.sizes} gives {factors} for {measured} (p {best.fit.p_value:.2f} with a "
        f"discrepancy of the models, {best.fit.p_exact:.2g} without): one set {verb} all four "
        "but for rounding and luck."
    )
