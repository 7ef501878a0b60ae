"""What does a study file mean: how many runs, at what cost? Everything built, one run timed.

    >>> asked = asked_of(workshop, threads=2)
    >>> asked.runs, asked.seconds

With `--workers`, what the scheduler and this process need for each batch is measured on two local
workers, and from it what share of many workers would be at work (`studies.run.scaling`).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from flexsim.loop.runs import thread_count
from studies.core.console import console
from studies.core.folder import to_json
from studies.core.study_options import check_threads
from studies.core.table import Column, Table
from studies.run.batches import Group, prepared
from studies.run.columns import TRACES
from studies.run.run import Changes, flat, workshop_of
from studies.run.scaling import Scaling, scaling
from studies.run.throughput import throughput
from studies.run.workers import here
from studies.spec.building import Workshop
from studies.spec.corners import require_buildable

SECONDS = 1.0  # that a batch takes at most which is timed
TURNS = 4  # batches that are; the first is not counted, with which others are built meanwhile
SHORT = 11  # samples of a run that is only to be compiled
ROW = 320  # [bytes] of a run's results, and of a sample's time series
SAMPLE = 8 * (1 + len(TRACES))


@dataclass(frozen=True)
class CheckConfig:
    """Check a study file: what is wrong with it, or how many runs at what cost it means."""

    study: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="STUDY", help="Its file.")]
    changes: Changes = ()
    quick: bool = False
    """As the quick run of it."""
    threads: int | None = None
    """Threads that it would run on; all cores unless given."""
    workers: tuple[int, ...] = ()
    """Numbers of workers of a cluster: what share of each would be at work; none
    unless given."""
    batch_seconds: float = 2.0
    """With --workers, how long a batch takes a worker [s]."""
    throughput: bool = False
    """Time a part of it beside its compiled loop alone: what building, measuring, writing cost."""
    json: bool = False
    """Print one JSON object instead of the tables."""
    code: bool = True
    """Whether the file may name a Python function; --no-code refuses."""


@dataclass(frozen=True)
class PlantRow:
    """What the runs on one plant cost: of one, built and run, and of all [s]."""

    name: str
    runs: int
    seconds_per_run: float
    seconds: float


@dataclass(frozen=True, eq=False)
class Asked:
    """What a study means.

    Attributes:
        shape: how many there are of each. runs, batches: their numbers.
        seconds: that all would take. size: of results and time series [bytes].
    """

    shape: dict[str, int]
    runs: int
    batches: int
    threads: int
    seconds: float
    size: int
    plants: list[PlantRow]
    scaling: list[Scaling]
    throughput: float | None = None


def _compiled(group: Group, threads: int) -> None:
    """Have the loop of a group compiled, by a run of a few samples."""
    loops = [stage.loop for stage in group.stages]
    short = [
        stage._replace(loop=loop._replace(tip=loop.tip[:SHORT], joint=loop.joint[:SHORT]))
        for stage, loop in zip(group.stages, loops, strict=True)
    ]
    one = np.array([0])
    Group(short, group.measured, group.which, group.rows, group.numbers, group.controllers).run(
        threads, only=one
    )


def _timed(workshop: Workshop, runs: np.ndarray, threads: int) -> float:
    """Return how long runs take, one built and run after the other in batches [s]."""
    began = time.perf_counter()
    batch = prepared(workshop, runs)
    for group in batch.groups:
        group.run(threads)
    return time.perf_counter() - began


def plant_row(workshop: Workshop, plant: int, threads: int) -> PlantRow:
    """Return what the runs on one plant cost, in batches one after the other, as they will be."""
    matrix = workshop.matrix
    each = matrix.runs // matrix.shape[0]
    first = plant * each
    for group in prepared(workshop, np.array([first])).groups:
        _compiled(group, threads)
    spent = _timed(workshop, np.array([first]), threads)
    count = min(workshop.study.batch, round(threads * SECONDS / spent), each // TURNS)
    if count >= threads:
        fresh, spans = Workshop(workshop.resolved), []
        for turn in range(TURNS):
            spans.append((first + turn * count, first + (turn + 1) * count))
        ended = [time.perf_counter() for _ in here(fresh, iter(spans), threads)]
        spent = (ended[-1] - ended[0]) / ((TURNS - 1) * count)
    elif each > 1:
        spent /= threads
    return PlantRow(matrix.names["plants"][plant], each, spent, spent * each)


def asked_of(
    workshop: Workshop, threads: int, workers: Sequence[int] = (), batch_seconds: float = 2.0
) -> Asked:
    """Return what a study means.

    Raises:
        ParameterError, ModelError: something of it cannot be built.
    """
    require_buildable(workshop)
    matrix, study = workshop.matrix, workshop.study
    names = ("plants", "robots", "draws", "cases", "repeats")
    rows = [plant_row(workshop, plant, threads) for plant in range(matrix.shape[0])]
    return Asked(
        shape=dict(zip(names, matrix.shape, strict=True)),
        runs=matrix.runs,
        batches=-(-matrix.runs // study.batch),
        threads=threads,
        seconds=sum(row.seconds for row in rows),
        size=matrix.runs * ROW + traced(workshop),
        plants=rows,
        scaling=scaling(workers, batch_seconds) if workers else [],
    )


def traced(workshop: Workshop) -> int:
    """Return how large time series are at most [bytes]."""
    study, matrix = workshop.study, workshop.matrix
    if study.traces == "none":
        return 0
    repeats = 1 if study.traces == "nominal" else matrix.repeats
    values = matrix.draws.values(0)
    lengths = [workshop.path(combo.trajectory, values)[1].end_time for combo in matrix.combos]
    samples = sum(length / study.period for length in lengths)
    cases = matrix.runs // matrix.repeats // len(matrix.combos)
    return round(samples * cases * repeats * SAMPLE)


COLUMNS = (
    Column("name", "plant"),
    Column("runs", form=",d"),
    Column("seconds_per_run", "one run", "ms", ".3g", 1e3),
    Column("seconds", "all", "s", ",.3g"),
)
WORKERS = (
    Column("workers", form="d"),
    Column("overhead", "each batch costs", "ms", ".2f", 1e3),
    Column("efficiency", "at work", "%", ".1f", 100),
)


def command(config: CheckConfig) -> None:
    """Check a study and print what it means."""
    check_threads(config.threads)
    workshop = workshop_of(config.study, flat(config.changes), config.quick, config.code)
    threads = config.threads or thread_count()
    asked = asked_of(workshop, threads, config.workers, config.batch_seconds)
    if config.throughput:
        asked = replace(asked, throughput=throughput(workshop, threads))
    if config.json:
        print(to_json(asdict(asked)))
        return
    out = console()
    words = " x ".join(f"{count} {name}" for name, count in asked.shape.items())
    out.print(f"{words} = {asked.runs:,} runs in {asked.batches:,} batches", soft_wrap=True)
    out.print(Table(asked.plants, COLUMNS).render())
    out.print(_total(asked), soft_wrap=True)
    if asked.throughput is not None:
        out.print(
            f"runs per second over those of its compiled loop alone: {asked.throughput:.3f}",
            soft_wrap=True,
        )
    if asked.scaling:
        out.print(Table(asked.scaling, WORKERS).render())


def _total(asked: Asked) -> str:
    """Return in words how long all would take and how large it would be."""
    seconds: Any = asked.seconds
    for unit, size in (("h", 3600.0), ("min", 60.0), ("s", 1.0)):
        if seconds >= size or unit == "s":
            spent = f"{seconds / size:.2g} {unit}"
            break
    return f"about {spent} on {asked.threads} threads, {asked.size / 1e6:,.3g} MB"
