"""From all runs to scores, verdicts, fronts and shares.

>>> judge = Judge(table, still={"line": 0.8}, seed=1)
>>> judge.score_rows()

What is compared is drawn by trajectory: seeds of searches, and repeats, within each.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexsim.numerics.types import Array
from flexsim.shaping.aids import PLAIN
from studies.arena.conditions import CORE, NOMINAL
from studies.arena.contestants import CLASSES
from studies.arena.rows import FrontRow, ProfileRow, ScoreRow, VerdictRow
from studies.arena.scoring import (
    Estimate,
    decades,
    difference,
    estimated,
    improvement,
    interquartile_mean,
    profile,
)
from studies.arena.search import front
from studies.arena.shares import ShareRow, shares
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
    ("reference", "zv", "zvd-held"),
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
FACTORS = ("structure", "order", "reference", "plant", "trajectory")


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

    def by_task(self, mask: Mask, columns: tuple[str, ...] = ("seed", "repeat")) -> Array:
        """Return scores (T, n) by trajectory, runs in the order of seeds and repeats."""
        rows = []
        for path in self.paths:
            its = np.flatnonzero(mask & (self.of["trajectory"] == path))
            order = np.lexsort([self.of[name][its] for name in reversed(columns)])
            rows.append(self.scores[its[order]])
        return np.array(rows)

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

    def score_rows(self) -> list[ScoreRow]:
        """Return every class under every condition, on every plant."""
        keys = (
            "class",
            "tuning",
            "condition",
            "plant",
            "reference",
            "robot",
            "setting",
            "hardware",
        )
        columns = [self.of[name].astype(str) for name in keys] + [self.of["period"].astype(str)]
        names = np.array(["\0".join(each) for each in zip(*columns, strict=True)])
        found = []
        for name in dict.fromkeys(names[self.scored].tolist()):
            parts = dict(zip(KEYS, name.split("\0"), strict=True))
            mask = (names == name) & self.scored
            found.append(self._score_row(parts, mask))
        return found

    def _score_row(self, parts: dict[str, str], mask: Mask) -> ScoreRow:
        scores, lost = self.by_task(mask), self.of["diverged"][mask]
        score = estimated(interquartile_mean, [scores], self.seed)
        chosen = CLASSES.get(parts["class"])
        return ScoreRow(
            contestant=parts["class"],
            order=chosen.order if chosen else "-",
            structure=chosen.structure if chosen else "-",
            tuning=parts["tuning"],
            condition=parts["condition"],
            level=level_of(parts),
            plant=parts["plant"],
            reference=parts["reference"],
            runs=int(mask.sum()),
            score=score.value,
            low=score.low,
            high=score.high,
            diverged=float(lost.mean()),
            **dict(
                zip(
                    ("diverged_low", "diverged_high"),
                    share_interval(int(lost.sum()), len(lost)),
                    strict=True,
                )
            ),
        )

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
                    rows.append(self._pair("reference", *names, plant, helped, plain))
            for other in self.plants[1:]:
                names = f"{contestant} on {other}", f"{contestant} on {plant}"
                elsewhere = self.usual(contestant, other)
                if elsewhere.any() and plain.any():
                    rows.append(self._pair("model", *names, other, elsewhere, plain))
        return rows + self._tunings()

    def _pair(
        self, factor: str, first: str, second: str, plant: str, one: Mask, other: Mask
    ) -> VerdictRow:
        samples = self.by_task(one), self.by_task(other)
        chance = estimated(improvement, samples, self.seed)

        apart = estimated(difference, samples, self.seed)
        return VerdictRow(factor, first, second, plant, *chance, *apart, said(chance))

    def _tunings(self) -> list[VerdictRow]:
        """Return what other tunings are worth, against the core's of the same seeds."""
        rows = []
        names = zip(self.of["class"].tolist(), self.of["tuning"].tolist(), strict=True)
        for contestant, tuning in dict.fromkeys(names):
            if tuning == CORE:
                continue
            own = self.where(**{"class": contestant, "tuning": tuning})
            seeds = np.isin(self.of["seed"], self.of["seed"][own])
            for plant in self.plants:
                its = {"condition": NOMINAL, "plant": plant}
                reference = self.own_reference(contestant)
                other = own & self.where(**its, reference=reference)
                usual = self.usual(contestant, plant) & seeds
                if other.any() and usual.any():
                    label = f"{contestant}, {tuning}", f"{contestant}, {CORE}"
                    rows.append(self._pair("tuning", *label, plant, other, usual))
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

    # --- fronts and shares ----------------------------------------------------------------------

    def front_rows(self) -> list[FrontRow]:
        """Return of every trajectory and condition who is on the front of error against effort."""
        found = []
        effort = self.of["variation_1"] + self.of["variation_2"]
        names = self.where(tuning=CORE) & np.isfinite(self.index)
        for plant in self.plants[:1]:
            for condition in dict.fromkeys(self.of["condition"].tolist()):
                for path in self.paths:
                    its = np.flatnonzero(
                        names & self.where(plant=plant, condition=condition, trajectory=path)
                    )
                    points = np.column_stack([effort[its], self.index[its]])
                    for i in its[front(points)] if its.size else ():
                        found.append(
                            FrontRow(
                                str(self.of["class"][i]),
                                int(self.of["seed"][i]),
                                condition,
                                path,
                                plant,
                                float(effort[i]),
                                float(self.index[i]),
                            )
                        )
        return found

    def share_rows(self) -> list[ShareRow]:
        """Return whose the variance of scores is, of classes that differ in two things alone."""
        classes = set(self.of["class"].tolist())
        if not {name for pair in FACTORIAL for name in pair} <= classes:
            return []
        references = (PLAIN, "true-tip", "feedforward")
        whole = [
            [
                [[self._seeds(name, ref, plant) for plant in self.plants] for ref in references]
                for name in pair
            ]
            for pair in FACTORIAL
        ]
        scores = np.array(whole)  # structure, order, reference, plant, trajectory, seed
        return shares(scores, FACTORS, self.seed)

    def _seeds(self, contestant: str, reference: str, plant: str) -> Array:
        """Return a class's scores (T, seeds), the mean over repeats."""
        its = {"class": contestant, "tuning": CORE, "condition": NOMINAL, "plant": plant}
        scores = self.by_task(self.where(**its, reference=reference))
        seeds = len(set(self.of["seed"][self.where(**its)].tolist()))
        return scores.reshape(len(scores), seeds, -1).mean(axis=-1)


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
