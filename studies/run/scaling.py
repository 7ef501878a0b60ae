"""What share of many workers would be at work? The cost of a batch measured, their queue simulated.

>>> scaling((16, 64, 256), batch_seconds=2.0)[-1].efficiency

One process submits batches, schedules them and writes what comes back. What that takes of its
processor for a batch is measured with two local workers that do nothing but send a batch's rows.
The rest is arithmetic: workers with a few batches ahead each, whose next one comes after the server
has got to it.
"""

from __future__ import annotations

import heapq
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from studies.run.workers import AHEAD, cluster

BATCHES = 400  # that the cost is measured with, after WARM others
WARM = 50
ROWS, COLUMNS = 256, 30  # of a batch's results
EACH = 40  # batches for every worker, of the simulated queue
SPREAD = 0.1  # standard deviation of a batch's time, relative


@dataclass(frozen=True)
class Scaling:
    """What share of workers is at work; overhead: of each batch, one after another [s]."""

    workers: int
    overhead: float
    efficiency: float


def scaling(workers: Sequence[int], batch_seconds: float) -> list[Scaling]:
    """Return what is to be expected of numbers of workers.

    Raises:
        ParameterError: dask.distributed is not installed.
    """
    overhead = measured_overhead()
    return [Scaling(n, overhead, simulated(n, batch_seconds, overhead)) for n in workers]


def rows_of(payload: str, first: int) -> bytes:
    """Return as many bytes as a batch's rows have; called in a worker."""
    rng = np.random.default_rng(first)
    table = pa.table({f"{i}": rng.standard_normal(ROWS) for i in range(COLUMNS)})
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def measured_overhead() -> float:
    """Return what a batch costs the process that submits, schedules and writes [s].

    Of its processor, in all its threads: workers are on other ones, and waiting costs it nothing.
    """
    from distributed import as_completed

    payload = "x" * 5000  # as long as a study
    with cluster(None, 2) as client, tempfile.TemporaryDirectory() as folder:

        def submitted(number: int) -> Any:
            return client.submit(rows_of, payload, number, pure=False)

        numbers = iter(range(WARM + BATCHES))
        waiting = as_completed([submitted(next(numbers)) for _ in range(2 * AHEAD)])
        began, done = time.process_time(), 0
        for future in waiting:
            content = future.result()
            if (number := next(numbers, None)) is not None:
                waiting.add(submitted(number))
            part = Path(folder) / f"{done}.part"
            part.write_bytes(content)
            part.rename(part.with_suffix(".arrow"))
            future.release()
            done += 1
            if done == WARM:
                began = time.process_time()
        return (time.process_time() - began) / (done - WARM)


def simulated(workers: int, batch_seconds: float, overhead: float, ahead: int = AHEAD) -> float:
    """Return which share of their time workers are at work, from the first batch to the last.

    Args:
        batch_seconds: mean of a batch's time, normally spread. overhead: that one process needs
            for each [s], in the order in which they end. ahead: batches that a worker has or
            waits for.
    """
    rng = np.random.default_rng(1)
    count = EACH * workers
    lengths = batch_seconds * np.clip(1 + SPREAD * rng.standard_normal(count), 0.1, None)
    served = 0.0  # until when the one process is busy
    free = [0.0] * workers  # when each worker ends what it has
    events: list[tuple[float, int]] = []  # when a batch of a worker ends
    sent = 0

    def send(worker: int, ready: float) -> None:
        nonlocal sent
        free[worker] = max(free[worker], ready) + float(lengths[sent])
        heapq.heappush(events, (free[worker], worker))
        sent += 1

    for _ in range(ahead):
        for worker in range(workers):
            if sent < count:
                served += overhead
                send(worker, served)
    ended = 0.0
    while events:
        ended, worker = heapq.heappop(events)
        served = max(served, ended) + overhead
        if sent < count:
            send(worker, served)
    return float(lengths.sum() / (workers * max(ended, served)))
