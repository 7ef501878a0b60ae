"""The steps of the study on each ground: without suspects, alone, together, as hypotheses.

>>> numbers = Numbers(repeats=16, sizes=9, decades=2.0, draws=128, base=64, seed=1)
>>> ground = ground_of(numbers, suspects, place, "default")
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexsim.errors import ParameterError
from flexsim.numerics.types import Array
from studies.core.evidence.check_sample import check_sample
from studies.core.evidence.intervals import known_ends, median_interval, ratio_interval, share_of
from studies.core.evidence.kept import Kept
from studies.laboratory.alone import reached, scan
from studies.laboratory.hypotheses import Hypothesis
from studies.laboratory.loops import Job, loops_of, run_jobs
from studies.laboratory.place import Place
from studies.laboratory.rows import (
    AloneRow,
    BaseRow,
    CheckRow,
    Ground,
    IndexRow,
    ReachRow,
    paper_cases,
)
from studies.laboratory.scored import ALL, PAPER, alone_hypotheses, none
from studies.laboratory.suspects import CAUSES, FRICTION, MEASURED, MODES, SUSPECTS, Suspect
from studies.laboratory.together import (
    LUCKS,
    draws_from,
    factors_at,
    indices,
    places_from,
    shrunk,
    sizes_from,
)
from studies.spec.draws import sobol_samples

OFTEN = 4  # times as many runs without suspects: all ratios share their median
PILOT = 32  # draws of all suspects by which ranges are shrunk
CHECKED = 6  # MuJoCo's own runs of a case, at most

Ran = Callable[[str, int], Callable[[int], None]]


@dataclass(frozen=True)
class Numbers:
    """How much is run.

    Attributes:
        repeats: of each suspect's size. sizes, decades: of those. draws: of several suspects.
        base: n of Sobol' indices. seed: of what is random. threads: None for all.
        bar: from a label and a number of runs to a function that is told how many are done.
        kept: what was run before, None to run it all.
    """

    repeats: int
    sizes: int
    decades: float
    draws: int
    base: int
    seed: int
    threads: int | None
    bar: Ran
    kept: Kept | None = None


def ground_of(
    numbers: Numbers, suspects: Sequence[Suspect], place: Place, controllers: str
) -> Ground:
    """Return a plant under controllers, without suspects and with each alone.

    Raises:
        ParameterError: the loops diverge without any suspect.
    """
    every = OFTEN * numbers.repeats
    how = (every, numbers.seed, numbers.threads, numbers.kept)
    loops = loops_of(controllers, place.parameters, *how)
    cases = len(loops.cases)
    jobs = [Job(place, case, repeat) for case in range(cases) for repeat in range(every)]
    label = f"{controllers}, {place.plant}"
    base = run_jobs(loops, jobs, numbers.bar(label, len(jobs))).envelope.reshape(cases, every)
    if np.isinf(base).any():
        raise ParameterError(
            f"with the {controllers} controllers the bench itself diverges on {place.plant}: "
            "there is nothing to compare with; take other hardware or another setting"
        )
    places = sum(len(each.signs) * (numbers.sizes if each.sized else 1) for each in suspects)
    ran = numbers.bar(f"{label}, alone", places * cases * numbers.repeats)
    its = (numbers.repeats, numbers.sizes, numbers.decades)
    curves = scan(loops, place, suspects, base, *its, ran)
    return Ground(place, loops, base, curves)


def base_rows(ground: Ground) -> list[BaseRow]:
    """Return the cases without suspects."""
    loops, rows = ground.loops, []
    for number, (paper, own) in enumerate(zip(paper_cases(), ground.base, strict=True)):
        jobs = [Job(ground.place, number, repeat) for repeat in range(min(CHECKED, loops.repeats))]
        found = run_jobs(loops, jobs)
        low, high = known_ends(median_interval(own))
        rms, variation = (np.median(each, axis=0).tolist() for each in (found.rms, found.variation))
        rows.append(
            BaseRow(
                plant=ground.plant,
                controllers=ground.controllers,
                case=paper.name,
                runs=len(own),
                envelope=float(ground.middle[number]),
                envelope_low=low,
                envelope_high=high,
                scatter=float(ground.scatter[number]),
                rms_1=rms[0],
                rms_2=rms[1],
                variation_1=variation[0],
                variation_2=variation[1],
                simulated=paper.simulated,
                measured=paper.measured,
                factor=paper.factor,
                factor_low=paper.ends[0],
                factor_high=paper.ends[1],
            )
        )
    return rows


def alone_rows(ground: Ground, seed: int) -> list[AloneRow]:
    """Return every suspect of every size in every case."""
    rows = []
    for curve in ground.curves:
        ratio = curve.ratio()
        for (k, size), (c, paper) in itertools.product(
            enumerate(curve.sizes), enumerate(paper_cases())
        ):
            own, known = curve.envelopes[k, c], bool(np.isfinite(ratio[k, c]))
            ends = ratio_interval(own, curve.base[c], seed, paired=False) if known else None
            rows.append(
                AloneRow(
                    ground.plant,
                    ground.controllers,
                    curve.suspect.name,
                    paper.name,
                    curve.sign * float(size),
                    len(own),
                    float(np.median(own)) if known else None,
                    float(ratio[k, c]) if known else None,
                    *known_ends(ends),
                    **share_of("diverged_share", np.isinf(own)),
                )
            )
    return rows


def reach_rows(ground: Ground, seed: int) -> list[ReachRow]:
    """Return from which size on every suspect gives the paper's factor of every case."""
    return [
        ReachRow(
            ground.plant,
            ground.controllers,
            curve.name,
            curve.suspect.cause,
            paper.name,
            paper.factor,
            float(curve.sizes[0]),
            float(curve.sizes[-1]),
            reached(curve, case, paper.factor, seed),
        )
        for curve in ground.curves
        for case, paper in enumerate(paper_cases())
    ]


def combined(
    numbers: Numbers, ground: Ground, name: str, parts: Sequence[Suspect], decades: float
) -> Hypothesis:
    """Return the hypothesis of several suspects together: draws of their own, one run each."""
    rng = np.random.default_rng((numbers.seed, 17, len(parts)))
    unit = sobol_samples(len(parts) + 1, numbers.draws, rng)
    draws = draws_from(parts, unit, decades, ground.loops.repeats)
    ran = numbers.bar(f"{ground.controllers}, {ground.plant}, {name}", 4 * numbers.draws)
    places = places_from(ground.place, parts, draws.sizes)
    logs = factors_at(ground.loops, places, draws.luck.tolist(), ground.middle, ran)
    most = np.array([each.most for each in parts])
    count = sum(each.sized for each in parts)
    names = tuple(each.name for each in parts)
    return Hypothesis(name, logs[:, :, None], draws.sizes / most, names, count)


def hypotheses_of(
    numbers: Numbers,
    suspects: Sequence[Suspect],
    ground: Ground,
    leading: Sequence[str],
    decades: float,
) -> list[Hypothesis]:
    """Return all hypotheses on a ground, none the first, all the last.

    Args:
        leading: names of the suspects of which pairs are hypotheses.
    """
    found = [none(ground), *alone_hypotheses(ground, decades)]
    groups: dict[str, list[Suspect]] = {}
    for cause in CAUSES:
        groups[f"all: {cause}"] = [each for each in suspects if each.cause == cause]
    named = (MEASURED, MODES, FRICTION)
    groups[PAPER] = [each for each in suspects if each.cause in named]
    for pair in itertools.combinations(leading, 2):
        groups[" + ".join(pair)] = [SUSPECTS[name] for name in pair]
    groups[ALL] = list(suspects)
    for name, parts in groups.items():
        groups[name] = [each for each in parts if each.sized]
    together: dict[frozenset[str], Hypothesis] = {}
    for name, parts in groups.items():
        which = frozenset(each.name for each in parts)
        if len(parts) > 1 and which not in together:
            together[which] = combined(numbers, ground, name, parts, decades)
    return found + list(together.values())


def run_again(numbers: Numbers, ground: Ground, hypothesis: Hypothesis, draw: int) -> Array:
    """Return logarithms of factors (C, R) of runs at a draw of a hypothesis, inf where diverged."""
    parts = [SUSPECTS[name] for name in hypothesis.parts]
    most = np.array([each.most for each in parts])
    sizes = hypothesis.sizes[draw, : len(parts)] * most
    (place,) = places_from(ground.place, parts, sizes[None])
    cases = range(len(ground.middle))
    jobs = [Job(place, case, repeat) for case in cases for repeat in range(numbers.repeats)]
    found = run_jobs(ground.loops, jobs).envelope.reshape(len(cases), -1)
    return np.asarray(np.log(found / ground.middle[:, None]))


def index_rows(numbers: Numbers, suspects: Sequence[Suspect], ground: Ground) -> list[IndexRow]:
    """Return Sobol' indices of the factor, in ranges in which few draws diverge, and of whether it
    diverges, in the stated ones, of suspects that have sizes; none where none are asked for.
    """
    suspects = [each for each in suspects if each.sized and ground.feels(each)]
    if not numbers.base or not suspects:
        return []
    where = f"{ground.controllers}, {ground.plant}, Sobol'"
    rng = np.random.default_rng((numbers.seed, 11))
    unit = sobol_samples(len(suspects), numbers.base, rng)
    luck = rng.integers(0, ground.loops.repeats, (numbers.base, LUCKS))
    cases = [each.name for each in paper_cases()]

    def logs_of(unit: Array, luck: Any, scale: float) -> Array:
        ran = numbers.bar(where, luck.size * len(cases))
        sizes = sizes_from(suspects, unit, numbers.decades, scale)
        places = places_from(ground.place, suspects, sizes)
        found = [
            factors_at(ground.loops, places, each.tolist(), ground.middle, ran) for each in luck.T
        ]
        return np.stack(found, axis=2)

    def diverged(scale: float) -> float:
        some = slice(0, PILOT)
        logs = logs_of(unit[some], luck[some, :1], scale)
        return float(np.isinf(logs).mean(axis=(0, 2)).max())

    names = [each.name for each in suspects]
    found, small = [], shrunk(diverged)
    for of, scale in (("factor", small), ("divergence", 1.0)):
        found += indices(names, cases, unit, logs_of(unit, luck, scale), scale, of)
    return [IndexRow(ground.plant, ground.controllers, each) for each in found]


def check_rows(ground: Ground, where: str, place: Place) -> list[CheckRow]:
    """Return how MuJoCo's own runs lie among those in closed form.

    Args:
        ground: on a chain in closed form. where: in words. place: there.
    """
    loops = ground.loops
    rows, checked = [], min(CHECKED, loops.repeats // OFTEN)
    for case, paper in enumerate(paper_cases()):
        jobs = [Job(place, case, repeat) for repeat in range(loops.repeats)]
        some = [job._replace(place=replace(place, plant="chain")) for job in jobs[:checked]]
        repeats, own = (run_jobs(loops, each).envelope for each in (jobs, some))
        check = check_sample(repeats, list(own))
        rows.append(CheckRow(ground.controllers, where, paper.name, check))
    return rows
