"""What the arena finds, in SI units; scores in decades below an arm that stands still."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from studies.arena.shares import ShareRow


@dataclass(frozen=True)
class TunedRow:
    """What one search found.

    Attributes:
        contestant, tuning, seed: whose. tried: individuals. held: share of them that did.
        grew: share whose exact linear loop grows, which are not simulated.
        objective, index: least objective, and its index (5) over all trajectories [m2 s]; None if
            nothing held. effort: over that of PIDs that ignore v [-].
        twice: the least objective after twice as many individuals [m2 s], None unless looked for.
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
class FrontRow:
    """A point that no other of its front dominates.

    Attributes:
        contestant, seed: whose. condition, trajectory, plant: of the front; 'search' and 'all' of
            what searches tried. effort: total variation of both torques [N m], of searches over
            that of PIDs that ignore v [-]. index: (5) [m2 s].
    """

    contestant: str
    seed: int
    condition: str
    trajectory: str
    plant: str
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
        overshoot: of joint 2's step, without payload and with 0.2 kg [-]; None where loops grow.
    """

    contestant: str
    seeds: int
    grows: float
    delay_margin: float | None
    peak_1: float | None
    peak_2: float | None
    overshoot: float | None
    overshoot_loaded: float | None


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
    table: Any = None
