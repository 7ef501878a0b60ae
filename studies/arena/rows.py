"""What the arena finds, in SI units; scores in decades below an arm that stands still."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class KnobRow:
    """A knob that searches turn: its range, and whether it is drawn by its logarithm."""

    contestant: str
    knob: str
    unit: str
    low: float
    high: float
    log: bool


@dataclass(frozen=True)
class TunedRow:
    """What one search found.

    Attributes:
        contestant, tuning, seed: whose. tried: individuals. held: share of them that did.
        grew: share whose exact linear loop grows, which are not simulated.
        objective, index: least objective, and its index (5) over all trajectories [m2 s]; None if
            nothing held. effort: over that of PIDs that ignore v [-].
        twice: the least objective after twice as many individuals [m2 s], None unless looked for.
        growth: of the exact linear loops of what was found, on the bench, 0 where none grows [1/s].
        knobs: in words.
    """

    contestant: str
    tuning: str
    seed: int
    tried: int
    held: float
    grew: float
    objective: float | None
    index: float | None
    effort: float | None
    twice: float | None
    growth: float
    knobs: str


@dataclass(frozen=True)
class ScoreRow:
    """A class under one condition on one plant: interquartile mean with its interval, divergence.

    Attributes:
        contestant, order, structure, tuning: of the class. condition, level: what is other than in
            the tuning, and how much. plant, reference: where. runs: of all seeds and trajectories.
        score, low, high: [decades]. diverged, diverged_low, diverged_high: share of the runs [-].
    """

    contestant: str
    order: str
    structure: str
    tuning: str
    condition: str
    level: str
    plant: str
    reference: str
    runs: int
    score: float
    low: float
    high: float
    diverged: float
    diverged_low: float
    diverged_high: float


@dataclass(frozen=True)
class VerdictRow:
    """One pair: is the first better than the second?

    Attributes:
        factor: what they differ in. first, second: classes, or references or plants of one class.
        plant: where. chance, low, high: that a run of the first scores more [-].
        difference, difference_low, difference_high: of interquartile means [decades].
        verdict: 'first', 'second' or 'open', as the interval of the chance is beyond a half or not.
    """

    factor: str
    first: str
    second: str
    plant: str
    chance: float
    low: float
    high: float
    difference: float
    difference_low: float
    difference_high: float
    verdict: str


@dataclass(frozen=True)
class MeasureRow:
    """Figures of merit of a class on one trajectory: medians over searches and repeats.

    Attributes:
        contestant, tuning: of the class. condition, level, plant, reference, trajectory: where.
        runs: how many. diverged: share of them [-].
        index: (5) [m2 s]; index_x, index_y, index_v: its parts. rms_error: of the tip [m].
        envelope: half-width about the path [m]. residual_v: largest deflection over the hold [m].
        variation, rms_torque: of both torques, summed, root of the sum of squares [N m].
        ..._low, ..._high: ends of its interval. None where half of the runs or more diverged.
    """

    contestant: str
    tuning: str
    condition: str
    level: str
    plant: str
    reference: str
    trajectory: str
    runs: int
    diverged: float
    index: float | None
    index_x: float | None
    index_y: float | None
    index_v: float | None
    variation: float | None
    rms_torque: float | None
    rms_error: float | None
    rms_error_low: float | None
    rms_error_high: float | None
    envelope: float | None
    envelope_low: float | None
    envelope_high: float | None
    residual_v: float | None
    residual_v_low: float | None
    residual_v_high: float | None


@dataclass(frozen=True)
class FrontRow:
    """A point that no other of its front dominates.

    Attributes:
        contestant, seed: whose. condition, level, trajectory, reference, plant: of the front;
            'search' and 'all' of what searches tried. measure: of effort: 'variation' or 'rms' of
            both torques [N m]; of searches 'share', the largest over what PIDs that ignore v take.
        effort: as it says. index: (5) [m2 s].
    """

    contestant: str
    seed: int
    condition: str
    level: str
    trajectory: str
    reference: str
    plant: str
    measure: str
    effort: float
    index: float


@dataclass(frozen=True)
class ProfileRow:
    """Performance profile of a class as it was tuned: share of runs that score more than a level.

    Attributes:
        contestant, plant: whose, where. level: [decades]. share: of the runs [-].
    """

    contestant: str
    plant: str
    level: float
    share: float


@dataclass(frozen=True)
class MarginRow:
    """A class's linear loops on the plant that it was tuned on, medians over seeds.

    Attributes:
        grows: share of seeds whose loop does [-]. delay_margin: extra delay borne [s].
        peak_1, peak_2: Ms, largest sensitivity of either joint's loop, the other closed [-].
        overshoot: of joint 2's step without payload [-]. loaded: share of seeds whose loops grow
            with none of the payloads, 0 to 0.2 kg [-]. spread: of these, largest less least
            overshoot with any [-], with its interval.
    """

    contestant: str
    seeds: int
    grows: float
    delay_margin: float | None
    peak_1: float | None
    peak_2: float | None
    overshoot: float | None
    loaded: float
    spread: float | None
    spread_low: float | None
    spread_high: float | None


@dataclass(frozen=True)
class SpillRow:
    """Controllers tuned on a few modes, whatever their loops do beyond: what a finer model says.

    Attributes:
        contestant: the class, 'all' of them together. modes: that it was tuned on.
        controllers: one of each search that found any. grows: of them whose exact linear loop does.
        plant: a finer one. diverge: how many do on one trajectory or more.
        share, low, high: of those that diverge [-].
    """

    contestant: str
    modes: int
    controllers: int
    grows: int
    plant: str
    diverge: int
    share: float
    low: float
    high: float


@dataclass(frozen=True)
class BudgetRow:
    """What twice as many simulations are worth to a class.

    Attributes:
        searches: that went on. moved: decades by which their objective falls, the mean.
        interval: from end to end of the class's score [decades]. enough: whether that is more.
    """

    contestant: str
    searches: int
    moved: float
    interval: float
    enough: bool


@dataclass(frozen=True)
class ShareRow:
    """A factor's share of the variance of scores, with its interval [-]; `of` says of whose."""

    of: str
    factor: str
    levels: int
    share: float
    low: float
    high: float


@dataclass
class ArenaResult:
    """All of it; `table` has the runs, a pyarrow.Table."""

    plants: tuple[str, ...]
    tuned: list[TunedRow] = field(default_factory=list)
    scores: list[ScoreRow] = field(default_factory=list)
    verdicts: list[VerdictRow] = field(default_factory=list)
    fronts: list[FrontRow] = field(default_factory=list)
    profiles: list[ProfileRow] = field(default_factory=list)
    margins: list[MarginRow] = field(default_factory=list)
    shares: list[ShareRow] = field(default_factory=list)
    measures: list[MeasureRow] = field(default_factory=list)
    spills: list[SpillRow] = field(default_factory=list)
    budget: list[BudgetRow] = field(default_factory=list)
    table: Any = None
