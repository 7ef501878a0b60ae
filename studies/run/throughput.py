"""What share of its time does a study spend in the compiled loop? Side by side, in one run.

>>> throughput(workshop, threads=2)       # 1: building, measuring and writing would cost nothing
0.93

A part of the study is carried out, from building its parts to writing its batches, and in turn with
that the same runs by the same compiled loop alone: built before, nothing measured, nothing written.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from flexsim.loop.measuring import NO_YARDSTICK
from studies.run.batches import Group, prepare
from studies.run.store import BATCHES, Span, Store
from studies.run.workers import here
from studies.spec.building import Workshop

ROUNDS = 5  # turns of each; the least time counts
PARTS = 4  # batches of a turn
SECONDS = 0.4  # that a turn lasts at least


def throughput(workshop: Workshop, threads: int) -> float:
    """Return runs per second of a study over those of its compiled loop alone."""
    resolved, batch, runs = workshop.resolved, workshop.study.batch, workshop.matrix.runs
    spans: list[Span] = []
    for first in range(0, min(runs, PARTS * batch), batch):
        spans.append((first, min(first + batch, runs)))
    groups = [_bare(g) for span in spans for g in prepare(Workshop(resolved), *span).groups]

    def alone() -> None:
        for group in groups:
            group.run(threads)

    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / BATCHES).mkdir()

        def whole() -> None:
            fresh = Workshop(resolved)  # nothing kept from the turn before
            store = Store(Path(folder), fresh)
            for done in here(fresh, iter(spans), threads):
                store.keep(*done)

        whole()
        alone()  # compiled
        best = {alone: float("inf"), whole: float("inf")}
        for _ in range(ROUNDS):
            for turn in best:
                best[turn] = min(best[turn], _timed(turn))
    return best[alone] / best[whole]


def _bare(group: Group) -> Group:
    """Return the same runs with nothing measured."""
    stages = [stage._replace(yard=NO_YARDSTICK) for stage in group.stages]
    of = (group.measured, group.which, group.rows, group.numbers, group.controllers)
    return Group(stages, *of)


def _timed(turn: Callable[[], None]) -> float:
    """Return how long a turn takes, the least of as many as SECONDS have room for [s]."""
    best, until = float("inf"), time.perf_counter() + SECONDS
    while True:
        began = time.perf_counter()
        turn()
        best = min(best, time.perf_counter() - began)
        if time.perf_counter() > until:
            return best
