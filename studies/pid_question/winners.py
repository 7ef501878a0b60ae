"""The best controllers that searches found: repeated on plants that they were not tuned on, too.

>>> rows = winner_rows("bench", found, config.trajectory, robot, runs=40, seed=1)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexsim.loop.runs import closed_loop, measure
from flexsim.loop.settings import Setting, setting
from flexsim.loop.trajectories import Reference, reference, trajectory
from flexsim.plants.base import Plant
from flexsim.robot import Robot
from studies.core.evidence.holding import HOLD, Holding, holdings
from studies.core.evidence.intervals import quantile, ratio_interval
from studies.core.evidence.repeats import PERTURBATION, Medians, medians, values_of
from studies.pid_question.designs import GROUNDS, Effort, shaken, tunings_of
from studies.pid_question.structures_report import REFERENCE, Design, SearchRow, WinnerRow
from studies.tuning.individuals import Filters
from studies.tuning.tuning import Tuning

SECOND = "closed-chain"


@dataclass(frozen=True, eq=False)
class Winner:
    """A controller, and what a ground's plants make of it and its repeats.

    Attributes:
        search: that found it. time: length of a run [s].
        held: on each plant. indices: of all repeats by plant [m2 s], inf where diverged.
        found: medians by plant. error_over_v: by plant, None where the run diverged.
    """

    search: SearchRow
    time: float
    held: Mapping[str, Holding]
    indices: Mapping[str, list[float]]
    found: Mapping[str, Medians]
    error_over_v: Mapping[str, float | None]


def best_of(searches: Sequence[SearchRow]) -> SearchRow | None:
    """Return the search with the least cost, None if none found anything."""
    found = [each for each in searches if each.cost is not None]
    return min(found, key=lambda each: each.cost or 0.0, default=None)


def error_over_v(
    plant: Plant, its: Setting, ref: Reference, pair: Filters, v_gain: float
) -> float | None:
    """Return rms tip error over rms v of a run: 2 where the mirrored tip follows, 1 the straight.

    With perfect joint loops joint 2 is at its reference minus v_gain v/(r+L), and the tip beyond by
    v/(r+L): |1 - v_gain| v from where it should be.
    """
    (motion,) = closed_loop(plant, its, ref, [pair], energy=False, v_gain=v_gain)
    if motion.diverged is not None:
        return None
    apart = np.linalg.norm(motion.tip - motion.reference_tip, axis=1)
    return float(np.sqrt(np.mean(apart**2) / np.mean(motion.v**2)))


def winner_rows(
    ground: str,
    searches: Mapping[Design, Sequence[SearchRow]],
    effort: Effort,
    robot: Robot,
    runs: int,
    seed: int,
    done: Callable[[], None] = lambda: None,
) -> list[WinnerRow]:
    """Return the rows of every design's best controller, on the ground's plant and on the chain.

    With the last of the ground's hardware. Runs i of all designs and plants have the same relative
    changes of gains and the same noise: they are pairs.

    Args:
        searches: of every seed. runs: of each controller. seed: of what is random.
        done: called after each design.

    Raises:
        ParameterError, ModelError: a robot without such plants.
    """
    own = GROUNDS[ground]
    winners: dict[Design, Winner] = {}
    for design, found in searches.items():
        best = best_of(found)
        if best is not None:
            tuning = _tuning_of(best, design, effort, seed)
            its = setting(own.setting, tuning.built[-1])
            plants = [robot.plant(name, its) for name in (own.plant, SECOND)]
            winners[design] = _winner(best, tuning, plants, its, robot, runs)
        done()
    return [
        _row(ground, plant, design, winner, winners, seed)
        for plant in (own.plant, SECOND)
        for design, winner in winners.items()
    ]


def _tuning_of(best: SearchRow, design: Design, effort: Effort, seed: int) -> Tuning:
    tunings = tunings_of(design, GROUNDS[best.ground], effort, seed)
    return next(each for each in tunings if each.filter_time == best.filter_time)


def _winner(
    best: SearchRow,
    tuning: Tuning,
    plants: Sequence[Plant],
    its: Setting,
    robot: Robot,
    runs: int,
) -> Winner:
    """Return what a ground's plants make of a controller and its repeats."""
    individual = np.array(list(best.parameters.values()), dtype=float)
    copies = shaken(individual, runs, PERTURBATION, tuning.seed)
    nominal, *built = tuning.design.filters(np.vstack([individual, copies]))
    assert nominal is not None  # it was simulated
    repeats = [pair for pair in built if pair is not None]
    v_gain, path = tuning.v_gain, trajectory(tuning.trajectory)
    again = [repeats] * len(plants)
    held = holdings(plants, its, path, nominal, tuning.period, robot, HOLD, v_gain, again)
    figures: dict[str, list[dict[str, Any]]] = {}
    ratios: dict[str, float | None] = {}
    for plant in plants:
        ref = reference(path, plant.parameters, tuning.period)
        figures[plant.name] = measure(plant, its, ref, repeats, v_gain=v_gain)
        ratios[plant.name] = error_over_v(plant, its, ref, nominal, v_gain)
    return Winner(
        search=best,
        time=path.end_time,
        held=dict(zip(figures, held, strict=True)),
        indices={name: values_of(each, "index") for name, each in figures.items()},
        found={name: medians(each) for name, each in figures.items()},
        error_over_v=ratios,
    )


def ratio_of(
    first: Sequence[float], second: Sequence[float] | None, seed: int, paired: bool = True
) -> tuple[float | None, float | None, float | None]:
    """Return a ratio of medians with its interval; None for what there is not.

    Args:
        first, second: samples, inf where diverged; second None where there is none.
        seed: of the bootstrap. paired: whether items i belong together.
    """
    if second is None:
        return None, None, None
    above, below = quantile(first), quantile(second)
    if not (math.isfinite(above) and math.isfinite(below)):
        return None, None, None
    low, high = ratio_interval(first, second, seed, paired) or (None, None)
    return above / below, _finite(low), _finite(high)


def _finite(number: float | None) -> float | None:
    return number if number is not None and math.isfinite(number) else None


def _row(
    ground: str,
    plant: str,
    design: Design,
    winner: Winner,
    winners: Mapping[Design, Winner],
    seed: int,
) -> WinnerRow:
    """Return a winner's row on a plant, with its ratios to the fractional and the mirrored one."""

    def to(other: Design) -> tuple[float | None, float | None, float | None]:
        same = winners.get(other) if other != design else None
        return ratio_of(winner.indices[plant], None if same is None else same.indices[plant], seed)

    found = winner.found[plant]
    ratio, mirrored = to(REFERENCE), to(Design(design.structure, "mirrored"))
    low, high = found.interval("index")
    best, held = winner.search, winner.held[plant]
    assert best.filter_time is not None  # it found something
    one, other = found.variation_1, found.variation_2
    return WinnerRow(
        ground=ground,
        plant=plant,
        design=design,
        seed=best.seed,
        filter_time=best.filter_time,
        runs=found.runs,
        index=found.index,
        index_low=low,
        index_high=high,
        **_named("ratio", ratio),
        **_named("to_mirrored", mirrored),
        envelope=found.envelope,
        envelope_low=found.envelope_low,
        envelope_high=found.envelope_high,
        diverged_share=found.diverged_share,
        diverged_share_low=found.diverged_share_low,
        diverged_share_high=found.diverged_share_high,
        variation=None if one is None or other is None else (one + other) / winner.time,
        error_over_v=winner.error_over_v[plant],
        holds=held.holds,
        holding=held,
    )


def _named(name: str, ratio: Sequence[float | None]) -> dict[str, float | None]:
    return dict(zip((name, f"{name}_low", f"{name}_high"), ratio, strict=True))
