"""A case's repeats on every plant: figures of all runs, what they cover, and the run that is shown.

>>> modes, chain = repeated(stages, controllers, task.trajectory.hold, config)
>>> chain.shown_words
'run 37 of 80, the median'

MuJoCo's chain is simulated by its equations in closed form, which move as MuJoCo does to rounding;
the run that is shown and a check sample are then MuJoCo's own. Runs i of all plants have the same
controller and noise: they are pairs. Batches keep the memory small: of a run's samples only the
band remains.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexsim.arm.kinematics import in_world
from flexsim.loop.measuring import yardstick
from flexsim.loop.metrics import envelope_half_width, measures, rms_distance
from flexsim.loop.motion import Motion
from flexsim.loop.runs import closed_loop, evaluate, measure, measured_figures
from flexsim.loop.settings import V_GAIN, Setting
from flexsim.loop.trajectories import Reference
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.recording.band import Band, PairBand, covered, pair_band
from flexsim.recording.traces import kind
from studies.core.evidence.check_sample import SAME, SAMPLE, Check, check_sample
from studies.core.evidence.repeats import (
    Medians,
    are_enough,
    counts,
    medians,
    middle_run,
    single,
    values_of,
)

BATCH = 20  # runs at a time, whose samples are in memory: some 30 MB of a chain's
NOMINAL_ONLY = ("exudyn",)  # plants too slow to be repeated: one run, with the gains as they are


@dataclass(frozen=True, eq=False)
class Stage:
    """Where a case runs: a plant, what its repeats are simulated by, the reference, the setting.

    v_gain: factor of atan(v/(r+L)) in the loop, -1 in the paper.
    """

    plant: Plant
    simulated: Plant
    reference: Reference
    setting: Setting
    v_gain: float = V_GAIN

    @property
    def repeats(self) -> bool:
        """Whether runs are repeated on this plant."""
        return kind(self.plant.name) not in NOMINAL_ONLY


@dataclass(frozen=True, eq=False)
class Repeated:
    """What came of a case on one plant.

    Attributes:
        found: medians. envelopes: of all runs [m], inf where diverged.
        motion, shown: the run that is shown, and which it is, counted from 1; words about it.
        band: of all runs, None where none went on to its end, or none was repeated.
        check: MuJoCo's own runs among those in closed form; None where there are none.
        pairs: of the second of two plants: how far it is from the first, run by run.
    """

    stage: Stage
    found: Medians
    envelopes: list[float]
    motion: Motion
    shown: int
    shown_words: str
    band: Band | None = None
    check: Check | None = None
    pairs: PairBand | None = None


@dataclass(frozen=True, eq=False)
class Batch:
    """Some of the runs on one plant.

    Attributes:
        figures: of merit. tip: (P, K, 2), v: (P, K) [m]; torque: (P, K, 2) commanded [N m].
    """

    figures: list[dict[str, Any]]
    tip: Array
    v: Array
    torque: Array


def batch(
    stage: Stage, filters: Sequence[Any], first: int, hold: float, threads: int | None
) -> Batch:
    """Return what runs do on a stage.

    Args:
        filters: of each run. first: the number of the first. hold: at the end [s].
    """
    plant, ref = stage.simulated, stage.reference
    yard = yardstick(ref, hold)
    how: dict[str, Any] = {"first_run": first, "v_gain": stage.v_gain}
    found = evaluate(plant, stage.setting, ref, filters, 1, threads, yard, **how)
    runs, rows, m = (*found.states.shape[:2], found.states.shape[2] // 2)
    q = found.states[..., :m].reshape(runs * rows, m)
    along, across = plant.deflection(q)
    tip = in_world(plant.parameters.L_R, q[:, :2], along[:, None], across[:, None])
    figures = measured_figures(found, ref, hold)
    tip, v = tip.reshape(runs, rows, 2), across.reshape(runs, rows)
    return Batch(figures, tip, v, found.torques)


def apart(one: Batch, other: Batch) -> list[float]:
    """Return the rms distance of two plants' tips [m], run by run, while both ran."""
    distances = []
    for first, second in zip(one.tip, other.tip, strict=True):
        both = np.isfinite(first[:, 0]) & np.isfinite(second[:, 0])
        if both.any():
            distances.append(rms_distance(first[both], second[both]))
    return distances


def pairs(one: Batch, other: Batch) -> Array:
    """Return the differences (P, K, 2) of two plants' tips [m], of runs that ended on both."""
    ended = np.isfinite(one.v[:, -1]) & np.isfinite(other.v[:, -1])
    return (other.tip[ended] - one.tip[ended]).astype(np.float32)


def repeated(
    stages: Sequence[Stage],
    nominal: Any,
    filters: Sequence[Any],
    hold: float,
    asked: int | None,
    threads: int | None,
) -> tuple[list[Repeated], list[float]]:
    """Return what came of a case on every plant, and pairwise distances of two plants' tips [m].

    All plants are repeated as often as the one that needs it most.

    Args:
        nominal: filters without perturbation, for plants that are not repeated.
        filters: of each run, as many as may be needed. hold: at the end [s].
        asked: number of runs; None for as many as it takes.
    """
    often = [stage for stage in stages if stage.repeats]
    figures: list[list[dict[str, Any]]] = [[] for _ in often]
    bands: list[Band | None] = [None] * len(often)
    distances: list[float] = []
    differences: list[Array] = []
    done = 0
    for count in counts(asked) if often else ():
        while done < count:
            some = filters[done : min(done + BATCH, count)]
            batches = [batch(stage, some, done, hold, threads) for stage in often]
            for i, (stage, each) in enumerate(zip(often, batches, strict=True)):
                figures[i] += each.figures
                ref = stage.reference
                bands[i] = covered(bands[i], ref.time, each.tip, each.v, each.torque, ref.tip)
            if len(batches) == 2:
                distances += apart(*batches)
                differences.append(pairs(*batches))
            done += len(some)
        if all(are_enough(values_of(each, "envelope")) for each in figures):
            break
    found = iter(zip(figures, bands, strict=True))
    ref = stages[0].reference
    joined = np.concatenate(differences) if differences else np.zeros((0, 0, 2))
    every = [
        _shown(stage, *next(found), filters, hold, threads)
        if stage.repeats
        else _once(stage, nominal, hold, threads)
        for stage in stages
    ]
    every[-1] = replace(every[-1], pairs=pair_band(ref.time, joined, ref.tip))
    return every, distances


def _once(stage: Stage, nominal: Any, hold: float, threads: int | None) -> Repeated:
    """Return what came of one run with the gains as they are."""
    ref = stage.reference
    how: dict[str, Any] = {"threads": threads, "v_gain": stage.v_gain}
    (motion,) = closed_loop(stage.plant, stage.setting, ref, [nominal], **how)
    figures = measures(motion, ref, hold)
    envelopes = values_of([figures], "envelope")
    return Repeated(stage, single(figures), envelopes, motion, 1, "one run, gains as they are")


def _shown(
    stage: Stage,
    figures: list[dict[str, Any]],
    band: Band | None,
    filters: Sequence[Any],
    hold: float,
    threads: int | None,
) -> Repeated:
    """Return what came of repeats, with the run that is shown, and MuJoCo's own where it is due."""
    found, envelopes = medians(figures), values_of(figures, "envelope")
    chosen = middle_run(figures)
    how: dict[str, Any] = {"threads": threads, "v_gain": stage.v_gain}

    def motion_of(run: int) -> Motion:
        (motion,) = closed_loop(
            stage.plant,
            stage.setting,
            stage.reference,
            [filters[run]],
            first_run=run,
            **how,
        )
        return motion

    motion, words = motion_of(chosen), f"run {chosen + 1} of {found.runs}, the median"
    if stage.simulated is stage.plant:
        return Repeated(stage, found, envelopes, motion, chosen + 1, words, band)
    sample = filters[: min(SAMPLE, found.runs)]
    ref = stage.reference
    own = measure(stage.plant, stage.setting, ref, sample, hold, **how)
    widths = values_of(own, "envelope")
    middle = found.envelope
    if middle is not None and not _belongs(motion, ref, envelopes[chosen], found):
        chosen = int(np.argmin(np.abs(np.array(widths) - middle)))
        motion = motion_of(chosen)
        words = f"run {chosen + 1} of MuJoCo's {len(sample)}, nearest to the median of {found.runs}"
    check = check_sample(envelopes, widths)
    return Repeated(stage, found, envelopes, motion, chosen + 1, words, band, check)


def _belongs(motion: Motion, ref: Reference, repeat: float, found: Medians) -> bool:
    """Return whether a motion's envelope is its repeat's [m], or between the quartiles of all."""
    if motion.diverged is not None:
        return False
    width = envelope_half_width(motion.tip, ref.tip)
    low, high = found.envelope_quartile_1, found.envelope_quartile_3
    between = (low or 0.0) <= width <= (math.inf if high is None else high)
    return abs(width - repeat) <= SAME or between
