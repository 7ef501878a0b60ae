"""Controllers that were given, not tuned: each on both plants and all trajectories.

>>> rows, ratios = evaluated([controller_of("runs/circle")], scenarios, how)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from flexsim.errors import ParameterError
from flexsim.loop.runs import measure
from flexsim.loop.settings import Setting
from flexsim.loop.trajectories import TRAJECTORIES, Reference, reference, trajectory
from flexsim.numerics.clocks import whole_substeps
from flexsim.plants.base import Plant
from studies.core.evidence.intervals import known_ends, ratio_interval
from studies.core.evidence.repeats import Medians, medians, perturbed, values_of
from studies.tables.rows import GivenRatio, GivenRow, figures_of
from studies.tuning.found import (
    AnyController,
    FoundController,
    devised_for,
    label_of,
    period_of,
    v_gain_of,
)

Scenario = tuple[Plant, Setting]


@dataclass(frozen=True)
class Repeats:
    """How often each is run: perturbations of the gains, their seed, threads."""

    perturbations: int
    seed: int
    threads: int | None


def check_untuned(config: Any) -> None:
    """Refuse options of a `TablesConfig` that have no effect where nothing is tuned.

    Raises:
        ParameterError: one of them was given, or a controller twice.
    """
    usual = {item.name: item.default for item in fields(config)}
    for name in ("exact", "generations", "population", "chain_generations"):
        if getattr(config, name) != usual[name]:
            option = name.replace("_", "-") if getattr(config, name) else f"no-{name}"
            raise ParameterError(
                f"--{option} has no effect: with --controller nothing is tuned; leave one out"
            )
    if len(set(config.controller)) != len(config.controller):
        raise ParameterError(f"controllers are {' '.join(config.controller)}; name each once")


def check(given: Sequence[AnyController], scenarios: Sequence[Scenario]) -> None:
    """Refuse controllers that a plant cannot be run with, before anything is.

    Raises:
        ParameterError: a control period is no whole multiple of a plant's physics step.
    """
    for each in given:
        for plant, _ in scenarios:
            whole_substeps(period_of(each), plant.step)
            _ = _references(each, plant)


def _references(controller: AnyController, plant: Plant) -> dict[str, Reference]:
    """Return all trajectories at a controller's period, by name."""
    period = period_of(controller)
    return {shape: reference(trajectory(shape), plant.parameters, period) for shape in TRAJECTORIES}


def evaluated(
    given: Sequence[AnyController],
    scenarios: Sequence[Scenario],
    how: Repeats,
    advance: Callable[[], None] = lambda: None,
) -> tuple[list[GivenRow], list[GivenRatio]]:
    """Return the rows of every controller, plant and trajectory, and the plants' ratios.

    Args:
        given: controllers. scenarios: both plants with the setting. how: as named.
        advance: called after each controller.
    """
    rows: list[GivenRow] = []
    ratios: list[GivenRatio] = []
    for each in given:
        rng = np.random.default_rng(how.seed)
        filters = [
            one.filters(period_of(each)) for one in (each, *perturbed(each, how.perturbations, rng))
        ]
        one, other = (_runs(each, filters, scenario, how.threads) for scenario in scenarios)
        rows += [row for row, _ in (*one, *other)]
        ratios += [_ratio(*pair, how.seed) for pair in zip(one, other, strict=True)]
        advance()
    return rows, ratios


def _runs(
    controller: AnyController, filters: Sequence[Any], scenario: Scenario, threads: int | None
) -> list[tuple[GivenRow, list[float]]]:
    """Return a row for each trajectory on one plant, and all runs' envelopes [m]."""
    plant, chosen = scenario
    found = []
    for shape, ref in _references(controller, plant).items():
        hold = trajectory(shape).hold
        options: dict[str, Any] = {"threads": threads, "v_gain": v_gain_of(controller)}
        nominal, *repeats = measure(plant, chosen, ref, filters, hold, **options)
        row = _row(controller, plant.name, shape, nominal, medians(repeats))
        found.append((row, values_of(repeats, "envelope")))
    return found


def _row(
    controller: AnyController, plant: str, shape: str, nominal: dict[str, Any], found: Medians
) -> GivenRow:
    tuned_on = " ".join(controller.tuning.plants) if isinstance(controller, FoundController) else ""
    return GivenRow(
        tuned_on,
        devised_for(controller),
        plant,
        shape,
        **figures_of(nominal, found),
        controllers=label_of(controller),
    )


def _ratio(
    one: tuple[GivenRow, list[float]], other: tuple[GivenRow, list[float]], seed: int
) -> GivenRatio:
    """Return how much wider the second plant's envelope is; runs i are pairs."""
    (first, under), (second, over) = one, other
    known = first.envelope is not None and second.envelope is not None
    low, high = known_ends(ratio_interval(over, under, seed) if known else None)
    return GivenRatio(
        tuned_on=first.tuned_on,
        tuned_for=first.tuned_for,
        trajectory=first.trajectory,
        from_plant=first.run_on,
        to_plant=second.run_on,
        from_envelope=first.envelope,
        to_envelope=second.envelope,
        ratio=None
        if first.envelope is None or second.envelope is None
        else second.envelope / first.envelope,
        paper_simulation=None,
        paper_laboratory=None,
        paper_ratio=None,
        ratio_low=low,
        ratio_high=high,
        controllers=first.controllers,
    )
