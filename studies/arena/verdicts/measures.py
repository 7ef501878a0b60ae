"""Figures of merit by class, condition, plant and trajectory; what finer models say of controllers.

>>> measure_rows(judge)
>>> spill_rows(judge, tuned)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from flexsim.numerics.types import Array
from studies.arena.conditions import CORE, NOMINAL
from studies.arena.rows import BudgetRow, MeasureRow, ScoreRow, SpillRow, TunedRow
from studies.arena.verdicts.judging import SPILLING, Judge, Mask, case_of, spilling
from studies.arena.verdicts.scoring import Estimate, estimated
from studies.core.evidence.intervals import share_interval

PARTS = ("index", "index_x", "index_y", "index_v")
WITH_ENDS = ("rms_error", "envelope", "residual_v")
RESAMPLES = 499  # of medians: thousands of rows
ALL = "all"


def measure_rows(judge: Judge) -> list[MeasureRow]:
    """Return the medians of the core's classes under every condition."""
    core = judge.of["tuning"] == CORE
    rows = []
    for where, mask in judge.cases(core):
        for path in dict.fromkeys(judge.of["trajectory"][mask].tolist()):
            its = mask & (judge.of["trajectory"] == path)
            rows.append(_measure_row(judge, where, path, its))
    return rows


def _measure_row(judge: Judge, where: dict[str, str], path: str, mask: Mask) -> MeasureRow:
    lost = judge.of["diverged"][mask]

    def middle(values: Array) -> float | None:
        found = float(np.median(np.where(lost, np.inf, values)))
        return found if np.isfinite(found) else None

    torque = np.hypot(judge.of["rms_torque_1"], judge.of["rms_torque_2"])[mask]
    variation = (judge.of["variation_1"] + judge.of["variation_2"])[mask]
    numbers: dict[str, Any] = {}
    for name in WITH_ENDS:
        values = judge.of[name][mask]
        known = not np.isnan(values[~lost]).any()
        found = _with_ends(judge, mask, values) if known else [None] * 3
        numbers |= dict(zip((name, f"{name}_low", f"{name}_high"), found, strict=True))
    numbers |= {name: middle(judge.of[name][mask]) for name in PARTS}
    return MeasureRow(
        **case_of(where),
        trajectory=path,
        runs=int(mask.sum()),
        diverged=float(lost.mean()),
        variation=middle(variation),
        rms_torque=middle(torque),
        **numbers,
    )


def _with_ends(judge: Judge, mask: Mask, values: Array) -> list[float | None]:
    """Return a median and the ends of its interval, None where they are not finite."""
    lost, seeds = judge.of["diverged"][mask], judge.of["seed"][mask]
    order = np.lexsort([judge.of["repeat"][mask], seeds])
    sample = np.where(lost, np.inf, values)[order].reshape(1, len(np.unique(seeds)), -1)
    found: Estimate = estimated(
        lambda each: np.median(each, axis=(-3, -2, -1)), [sample], judge.seed, resamples=RESAMPLES
    )
    return [each if np.isfinite(each) else None for each in found]


def spill_rows(judge: Judge, tuned: Sequence[TunedRow]) -> list[SpillRow]:
    """Return of every class, and of all, what controllers tuned on a few modes do on finer models.

    Controllers of searches in which nothing held are left out.
    """
    rows = []
    for modes in SPILLING:
        found = [r for r in tuned if r.tuning == spilling(modes) and r.objective is not None]
        names = list(dict.fromkeys(each.contestant for each in found))
        for plant in (each for each in judge.plants if _finer(each, modes)):
            own = [_spill_row(judge, name, modes, plant, found) for name in names]
            rows += own
            if own:
                count, grow = sum(r.controllers for r in own), sum(r.grows for r in own)
                rows.append(_row(ALL, modes, count, grow, plant, sum(r.diverge for r in own)))
    return rows


def _finer(plant: str, modes: int) -> bool:
    kind, _, number = plant.partition(":")
    return kind != "assumed-modes" or int(number) > modes


def _spill_row(
    judge: Judge, contestant: str, modes: int, plant: str, tuned: Sequence[TunedRow]
) -> SpillRow:
    its = {each.seed: each for each in tuned if each.contestant == contestant}
    mask = judge.where(
        **{"class": contestant, "tuning": spilling(modes), "condition": NOMINAL, "plant": plant},
        reference=judge.own_reference(contestant),
    )
    lost = {int(s) for s in judge.of["seed"][mask & judge.of["diverged"].astype(bool)]}
    grows = sum(each.growth > 0 for each in its.values())
    return _row(contestant, modes, len(its), grows, plant, len(lost & set(its)))


def _row(name: str, modes: int, count: int, grows: int, plant: str, lost: int) -> SpillRow:
    ends = share_interval(lost, count)
    return SpillRow(name, modes, count, grows, plant, lost, lost / count, *ends)


def budget_rows(
    tuned: Sequence[TunedRow], scores: Sequence[ScoreRow], plant: str, own: dict[str, str]
) -> list[BudgetRow]:
    """Return what twice as many simulations are worth to every class of which it is known.

    Args:
        plant: of the tuning. own: every class's reference.
    """
    rows = []
    for name, reference in own.items():
        gains = [
            np.log10(row.objective / row.twice)
            for row in tuned
            if row.contestant == name
            and row.tuning == CORE
            and row.twice is not None
            and row.objective is not None
        ]
        widths = [
            row.high - row.low
            for row in scores
            if (row.contestant, row.tuning, row.condition) == (name, CORE, NOMINAL)
            and (row.plant, row.reference) == (plant, reference)
        ]
        if gains and widths:
            moved = float(np.mean(gains))
            rows.append(BudgetRow(name, len(gains), moved, widths[0], moved < widths[0]))
    return rows
