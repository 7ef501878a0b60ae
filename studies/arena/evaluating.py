"""Tuned contestants under every condition: a study file each, and one tidy table of all runs.

>>> rows = evaluated([CONDITIONS["payload"]], tuned, plants, repeats=3)
>>> rows.column("index").to_numpy()

Columns are `class`, `tuning`, `seed` of the search, `condition`, what a run is of, then figures of
merit. What has been run is kept batch by batch (`studies.core.evidence.kept`), whoever ran it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa

from flexsim.numerics.types import Array
from flexsim.shaping.aids import PLAIN
from studies.arena.conditions import AIDED, CORE, SHIPPED, Condition, Tuned, document
from studies.core.evidence.kept import Kept
from studies.run.columns import FIGURES
from studies.run.workers import Done, cluster, here, spread
from studies.spec.building import Workshop
from studies.spec.matrix import Indices
from studies.spec.reading import given
from studies.spec.resolving import resolve

FIGURE_NAMES = tuple(each.name for each in FIGURES)
NUMBERS = ("run", "repeat", *FIGURE_NAMES, "diverged", "diverged_at")  # of a batch, as kept
BATCH = 256


def workshop_of(content: Mapping[str, Any]) -> Workshop:
    """Return what builds the runs of a study file that is given as TOML has it."""
    study = given(dict(content) | {"batch": BATCH}, SHIPPED.name, SHIPPED.parent)
    return Workshop(resolve(study))


def _spans(workshop: Workshop) -> list[tuple[int, int]]:
    total = workshop.matrix.runs
    return [(a, min(a + BATCH, total)) for a in range(0, total, BATCH)]


def _numbers(table: Any) -> Array:
    """Return the numbers (K, N) of a batch."""
    columns = [table.column(name).to_numpy(zero_copy_only=False) for name in NUMBERS]
    return np.column_stack([np.asarray(each, dtype=float) for each in columns])


def carried_out(
    workshop: Workshop,
    kept: Kept | None = None,
    threads: int | None = None,
    address: str | None = None,
    workers: int | None = None,
    ran: Callable[[int], None] = lambda _: None,
) -> Array:
    """Return the numbers (K, N) of all runs of a study, in order.

    Args:
        kept: what was run before; None to keep nothing. threads: None for all.
        address: of a dask scheduler; workers: processes here instead of threads; None for neither.
        ran: called with how many runs were done.
    """
    spans = _spans(workshop)
    name = workshop.resolved.digest
    missing = [s for s in spans if kept is None or not kept.has(f"{name} {s}")]
    with ExitStack() as held:
        done: Iterator[Done]
        if not missing:
            done = iter(())
        elif address is not None or workers is not None:
            client = held.enter_context(cluster(address, workers))
            done = spread(workshop.resolved, iter(missing), client)
        else:
            done = here(workshop, iter(missing), threads)
        found: dict[tuple[int, int], Array] = {}
        for first, last, table, _ in done:
            rows = _numbers(table)
            if kept is not None:
                rows = kept.of(f"{name} {first, last}", lambda rows=rows: rows)  # type: ignore[misc]
            found[first, last] = rows
            ran(last - first)
    for span in spans:
        if span not in found and kept is not None:
            found[span] = kept.of(f"{name} {span}", lambda s=span: _alone(workshop, s))  # type: ignore[misc]
            ran(span[1] - span[0])
    return np.concatenate([found[span] for span in spans])


def _alone(workshop: Workshop, span: tuple[int, int]) -> Array:
    """Return a batch whose file turned out to be damaged."""
    ((_, _, table, _),) = here(workshop, iter([span]), None)
    return _numbers(table)


def tidy(workshop: Workshop, condition: Condition, numbers: Array) -> Any:
    """Return the rows of a condition, a pyarrow.Table."""
    matrix, columns = workshop.matrix, dict(zip(NUMBERS, numbers.T, strict=True))
    of = matrix.indices(columns["run"].astype(np.int64))
    combos = np.array(matrix.combos)[of.combo]

    def names(key: str, at: Indices) -> list[str]:
        return [matrix.names[key][int(i)] for i in at]

    controllers = [each.split("/") for each in names("controllers", combos[:, 3])]
    paths = [each.partition("+") for each in names("trajectories", combos[:, 0])]
    robots = workshop.resolved.document["robots"]
    payload = [float(robots[int(i)].get("payload", 0.0)) for i in of.robot]
    lost = columns["diverged"] == 1.0
    return pa.table(
        {
            "class": [each[0] for each in controllers],
            "tuning": [each[1] for each in controllers],
            "seed": pa.array([int(each[2]) for each in controllers], pa.int64()),
            "condition": [condition.name] * len(lost),
            "plant": names("plants", of.plant),
            "robot": names("robots", of.robot),
            "payload": payload,
            "trajectory": [each[0] for each in paths],
            "reference": [each[2] or "plain" for each in paths],
            "setting": names("settings", combos[:, 1]),
            "hardware": names("hardware", combos[:, 2]),
            "period": [float(workshop.study.period)] * len(lost),
            "repeat": columns["repeat"].astype(np.int64),
            **{name: columns[name] for name in FIGURE_NAMES},
            "diverged": lost,
            "diverged_at": columns["diverged_at"],
        }
    )


def evaluated(
    conditions: Sequence[Condition],
    tuned: Sequence[Tuned],
    plants: Sequence[str],
    repeats: int,
    seed: int = 1,
    changes: Mapping[str, Any] | None = None,
    **how: Any,
) -> Any:
    """Return the rows of all runs, a pyarrow.Table.

    Args:
        conditions: carried out one after the other. tuned: who runs.
        plants: of conditions that ask for all; others run on the first and on the first chain.
        repeats, seed, changes: as of `document`. how: as of `carried_out`.
    """
    tables = []
    for condition, workshop in workshops(conditions, tuned, plants, repeats, seed, changes):
        tables.append(tidy(workshop, condition, carried_out(workshop, **how)))
    return pa.concat_tables(tables)


def workshops(
    conditions: Sequence[Condition],
    tuned: Sequence[Tuned],
    plants: Sequence[str],
    repeats: int,
    seed: int = 1,
    changes: Mapping[str, Any] | None = None,
) -> Iterator[tuple[Condition, Workshop]]:
    """Give what builds the runs of every condition.

    Other tunings run as tuned alone, those on another reference with the others, too.
    """
    few = [plants[0], *[each for each in plants[1:] if "chain" in each][:1]]
    core = [each for each in tuned if each.tuning == CORE]
    helped = [each for each in tuned if each.tuning in AIDED]
    others = [each for each in tuned if each not in core and each not in helped]
    how = (repeats, seed, changes)
    for condition in conditions:
        own = plants if condition.finer else few
        yield condition, workshop_of(document(condition, core, own, *how))
        for its, aids in ((helped, AIDED), (others, (PLAIN,))) if condition.finer else ():
            if its:
                plain = replace(condition, aids=aids)
                yield plain, workshop_of(document(plain, its, own, *how))
