"""From all runs to scores, verdicts, fronts and shares.

>>> judge = Judge(table, still={"line": 0.8}, seed=1)
>>> judge.score_rows()

Drawn anew for intervals are searches, and repeats within each.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexsim.numerics.types import Array
from flexsim.shaping.aids import PLAIN
from studies.arena.conditions import AIDED, CORE, NOMINAL
from studies.arena.contestants import CLASSES
from studies.arena.rows import ProfileRow, ScoreRow, ShareRow, VerdictRow
from studies.arena.verdicts.loops import LoopNumbers, of_task
from studies.arena.verdicts.scoring import (
    Estimate,
    decades,
    difference,
    estimated,
    improvement,
    interquartile_mean,
    profile,
)
from studies.arena.verdicts.shares import shares, within_tasks
from studies.core.evidence.intervals import share_interval

Mask = NDArray[np.bool_]
PAIRS = (  # factor, first, second
    ("order", "fractional", "integer"),
    ("order", "fractional", "pid"),
    ("order", "oustaloup", "pid"),
    ("order", "collocated-fractional", "collocated"),
    ("structure", "collocated", "pid"),
    ("structure", "collocated-fractional", "oustaloup"),
    ("structure", "strain", "collocated"),
    ("structure", "lqg", "collocated"),
    ("structure", "h-infinity", "collocated"),
    ("reference", "zv", "zvd"),
    ("reference", "zvd", "zvd-held"),
    ("rule", "lead", "collocated-fractional"),
    ("rule", "flat-phase", "collocated-fractional"),
    ("rule", "five", "collocated-fractional"),
    ("rule", "valerio-s", "collocated-fractional"),
)
SPILLING = (3, 5, 8)  # modes that classes are tuned on with loops that may grow
LEVELS = 60  # of a performance profile
FACTORIAL = (("pid", "oustaloup"), ("collocated", "collocated-fractional"))  # structure x order
KEYS = (  # of runs that are one case
    *("class", "tuning", "condition", "plant", "reference"),
    *("robot", "setting", "hardware", "period"),
)
FACTORS = ("structure", "order", "reference", "plant", "")  # trajectories: within each
TUNING_FACTORS = ("class", "tuning", "plant", "")
ISO_DAMPING = "iso-damping"
DAMPED = tuple(
    (each, "collocated") for each in ("flat-phase", "lead", "five", "collocated-fractional")
)
PIDS, TUNINGS = "PIDs", "tunings"  # of whom shares are
OTHER_TUNINGS = ("genetic", "true-tip", "feedforward", "worst plant", "ideal")


class Judge:
    """The runs, by column; `still` is the index (5) of an arm that stands still, by trajectory."""

    def __init__(self, table: Any, still: Mapping[str, float], seed: int) -> None:
        self.of = {
            name: table.column(name).to_numpy(zero_copy_only=False) for name in table.schema.names
        }
        self.seed = seed
        index = np.where(self.of["diverged"], np.inf, self.of["index"])
        most = np.array([still.get(each, np.nan) for each in self.of["trajectory"]])
        self.scores = decades(index, most)
        self.index = index
        self.scored = np.isfinite(most)

    def where(self, **wanted: str) -> Mask:
        """Return which runs are of these."""
        found = self.scored.copy()
        for name, value in wanted.items():
            found &= self.of[name] == value
        return found

    def by_task(self, mask: Mask, values: Array | None = None) -> Array:
        """Return scores, or other values of all runs, (T, S, R) by trajectory, search and repeat.

        Every search of a mask has the same trajectories and repeats.
        """
        of = self.scores if values is None else values
        its = np.flatnonzero(mask)
        paths = {path: t for t, path in enumerate(self.paths)}
        task = np.array([paths[each] for each in self.of["trajectory"][its]], dtype=int)
        order = its[np.lexsort([self.of["repeat"][its], self.of["seed"][its], task])]
        searches = len(np.unique(self.of["seed"][its]))
        return of[order].reshape(len(np.unique(task)), searches, -1)

    @cached_property
    def paths(self) -> list[str]:
        """The trajectories that are scored."""
        return list(dict.fromkeys(self.of["trajectory"][self.scored].tolist()))

    @cached_property
    def plants(self) -> list[str]:
        """The plants, that of the tuning first."""
        return list(dict.fromkeys(self.of["plant"].tolist()))

    def own_reference(self, contestant: str) -> str:
        """Return the name of a class's reference without further help."""
        return CLASSES[contestant].aid if contestant in CLASSES else PLAIN

    def usual(self, contestant: str, plant: str) -> Mask:
        """Return a class's runs as it was tuned, on a plant."""
        return self.where(
            **{"class": contestant, "tuning": CORE, "condition": NOMINAL, "plant": plant},
            reference=self.own_reference(contestant),
        )

    # --- scores ---------------------------------------------------------------------------------

    def cases(self, mask: Mask) -> Iterator[tuple[dict[str, str], Mask]]:
        """Give what runs of a mask are cases of, by KEYS and `level`, and the runs of each."""
        its = np.flatnonzero(mask)
        columns = [self.of[name][its].astype(str) for name in KEYS]
        names, which = np.unique(
            ["\0".join(each) for each in zip(*columns, strict=True)], return_inverse=True
        )
        order = np.argsort([its[which == k][0] for k in range(len(names))])
        for k in order:
            where = dict(zip(KEYS, str(names[k]).split("\0"), strict=True))
            chosen = np.zeros_like(mask)
            chosen[its[which == k]] = True
            yield where | {"level": level_of(where)}, chosen

    def score_rows(self) -> list[ScoreRow]:
        """Return every class under every condition, on every plant."""
        return [self._score_row(where, mask) for where, mask in self.cases(self.scored)]

    def _score_row(self, where: dict[str, str], mask: Mask) -> ScoreRow:
        score = estimated(interquartile_mean, [self.by_task(mask)], self.seed)
        lost = self._diverged(mask)
        chosen = CLASSES.get(where["class"])
        return ScoreRow(
            order=chosen.order if chosen else "-",
            structure=chosen.structure if chosen else "-",
            **case_of(where),
            runs=int(mask.sum()),
            score=score.value,
            low=score.low,
            high=score.high,
            diverged=lost.value,
            diverged_low=lost.low,
            diverged_high=lost.high,
        )

    def _diverged(self, mask: Mask) -> Estimate:
        """Return the share of runs that diverged, and its interval over searches.

        Where all did, or none, that of as many searches.
        """
        lost = self.by_task(mask, self.of["diverged"].astype(float))
        share, searches = float(lost.mean()), lost.shape[1]
        if share in (0.0, 1.0):
            return Estimate(share, *share_interval(round(share * searches), searches))
        return estimated(lambda each: each.mean(axis=(-3, -2, -1)), [lost], self.seed)

    # --- verdicts -------------------------------------------------------------------------------

    def verdict_rows(self) -> list[VerdictRow]:
        """Return all pairs of which both are there, on every plant."""
        classes = set(self.of["class"].tolist())
        rows = [
            self._pair(factor, one, other, plant, self.usual(one, plant), self.usual(other, plant))
            for factor, one, other in PAIRS
            for plant in self.plants
            if {one, other} <= classes
        ]
        for contestant in [name for name in CLASSES if name in classes]:
            plant = self.plants[0]
            plain = self.usual(contestant, plant)
            for reference in ("true-tip", "feedforward"):
                its = {"class": contestant, "tuning": CORE, "condition": NOMINAL, "plant": plant}
                helped = self.where(**its, reference=reference)
                if helped.any() and plain.any():
                    names = f"{contestant}, {reference}", f"{contestant}, as tuned"
                    rows.append(self._pair("reference", *names, plant, helped, plain, paired=True))
            for other in self.plants[1:]:
                names = f"{contestant} on {other}", f"{contestant} on {plant}"
                elsewhere = self.usual(contestant, other)
                if elsewhere.any() and plain.any():
                    rows.append(self._pair("model", *names, other, elsewhere, plain, paired=True))
        return rows + self._tunings()

    def _pair(
        self,
        factor: str,
        first: str,
        second: str,
        plant: str,
        one: Mask,
        other: Mask,
        paired: bool = False,
    ) -> VerdictRow:
        samples = self.by_task(one), self.by_task(other)
        chance = estimated(improvement, samples, self.seed, paired)
        apart = estimated(difference, samples, self.seed, paired)
        return VerdictRow(factor, first, second, plant, *chance, *apart, said(chance))

    def _tunings(self) -> list[VerdictRow]:
        """Return what other tunings are worth, against the core's of the same seeds.

        Of tunings on another reference, on that one.
        """
        rows = []
        names = zip(self.of["class"].tolist(), self.of["tuning"].tolist(), strict=True)
        for contestant, tuning in dict.fromkeys(names):
            if tuning not in OTHER_TUNINGS:
                continue
            own = self.where(**{"class": contestant, "tuning": tuning})
            core = self.where(**{"class": contestant, "tuning": CORE})
            core &= np.isin(self.of["seed"], self.of["seed"][own])
            reference = tuning if tuning in AIDED else self.own_reference(contestant)
            for plant in self.plants:
                its = self.where(condition=NOMINAL, plant=plant, reference=reference)
                other, usual = own & its, core & its
                if other.any() and usual.any():
                    label = f"{contestant}, {tuning}", f"{contestant}, {CORE}"
                    rows.append(self._pair("tuning", *label, plant, other, usual))
        return rows

    def damping_rows(self, loops: Mapping[str, LoopNumbers]) -> list[VerdictRow]:
        """Return whose overshoot changes less with a payload, of pairs of which both have loops."""
        rows = []
        for first, second in DAMPED:
            if not {first, second} <= set(loops):
                continue
            spreads = [-loops[name].spread for name in (first, second)]
            samples = [of_task(each[np.isfinite(each)]) for each in spreads]
            if all(each.size for each in samples):
                chance = estimated(improvement, samples, self.seed)
                apart = estimated(difference, samples, self.seed)
                pair = (ISO_DAMPING, first, second, self.plants[0])
                rows.append(VerdictRow(*pair, *chance, *apart, said(chance)))
        return rows

    def profile_rows(self) -> list[ProfileRow]:
        """Return the performance profiles of all classes on all plants."""
        most = float(self.scores[self.scored].max(initial=0.0))
        levels = np.linspace(0.0, most, LEVELS)
        return [
            ProfileRow(name, plant, float(level), float(share))
            for name in dict.fromkeys(self.of["class"].tolist())
            for plant in self.plants
            if (its := self.usual(name, plant)).any()
            for level, share in zip(levels, profile(self.scores[its], levels), strict=True)
        ]

    # --- shares ---------------------------------------------------------------------------------

    def share_rows(self) -> list[ShareRow]:
        """Return whose the variance of scores is, within trajectories: of PIDs, and of classes with
        other tunings.

        Both are full factorials: PIDs that differ in structure and order alone, with all references
        on all plants; classes with all tunings on all plants.
        """
        classes = set(self.of["class"].tolist())
        found: list[ShareRow] = []
        if {name for pair in FACTORIAL for name in pair} <= classes:
            references = (PLAIN, "true-tip", "feedforward")
            whole = [
                [
                    [
                        [self._seeds(name, CORE, ref, plant) for plant in self.plants]
                        for ref in references
                    ]
                    for name in pair
                ]
                for pair in FACTORIAL
            ]
            found += shares(within_tasks(np.array(whole)), FACTORS, self.seed, 2, PIDS)
        return found + self._tuning_shares()

    def _tuning_shares(self) -> list[ShareRow]:
        pairs = set(zip(self.of["class"].tolist(), self.of["tuning"].tolist(), strict=True))
        names = [each for each in CLASSES if (each, OTHER_TUNINGS[0]) in pairs]
        tunings = (CORE, *OTHER_TUNINGS)
        if len(names) < 2 or not {(name, each) for name in names for each in tunings} <= pairs:
            return []
        seeds = len(set(self.of["seed"][self.of["tuning"] == OTHER_TUNINGS[0]].tolist()))
        whole = [
            [
                [
                    self._seeds(name, tuning, self.own_reference(name), plant)[:, :seeds]
                    for plant in self.plants
                ]
                for tuning in tunings
            ]
            for name in names
        ]
        return shares(within_tasks(np.array(whole)), TUNING_FACTORS, self.seed, 2, TUNINGS)

    def _seeds(self, contestant: str, tuning: str, reference: str, plant: str) -> Array:
        """Return a class's scores (T, seeds), the mean over repeats."""
        its = {"class": contestant, "tuning": tuning, "condition": NOMINAL, "plant": plant}
        return np.asarray(self.by_task(self.where(**its, reference=reference)).mean(axis=-1))


def case_of(where: Mapping[str, str]) -> dict[str, Any]:
    """Return what rows say of a case of `Judge.cases`."""
    names = ("tuning", "condition", "level", "plant", "reference")
    return {"contestant": where["class"], **{name: where[name] for name in names}}


def spilling(modes: int) -> str:
    """Return the name of the tuning on so many modes that rejects no loop for its growth."""
    return f"{modes} modes, growing"


def said(chance: Estimate) -> str:
    """Return who is better, by the interval of the chance that the first is."""
    if chance.low > 0.5:
        return "first"
    return "second" if chance.high < 0.5 else "open"


def level_of(parts: Mapping[str, str]) -> str:
    """Return what of a condition's case is other than nominal, in words."""
    other = [
        parts[name]
        for name, usual in (("robot", NOMINAL), ("setting", "simulink"), ("hardware", "bench"))
        if parts[name] != usual
    ]
    if float(parts["period"]) != 1e-3:
        other.append(f"{1e3 * float(parts['period']):g} ms")
    return ", ".join(other) or NOMINAL
