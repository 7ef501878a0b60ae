"""Who carries batches out: threads of this process, or workers of a dask scheduler.

>>> for first, last, rows, traces in here(workshop, store.pending(), threads=None):
...     store.keep(first, last, rows, traces)

Workers get the resolved study as text, build what a batch needs, and send its rows back. A batch
whose worker died is given to another. Workers of other versions are refused: their bits may differ.
"""

from __future__ import annotations

import json
import logging
import signal
from collections.abc import Iterator
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
from threading import Lock
from typing import Any

import pyarrow as pa

from flexsim.errors import FlexsimError, ParameterError, RunError
from studies.run.batches import Perturbations, carried_out, prepare, traces
from studies.run.store import Span, identity
from studies.spec.building import Workshop
from studies.spec.resolving import Resolved

AHEAD = 3  # batches that each worker has or waits for
CONNECTED = 30  # [s] for a scheduler to answer
Done = tuple[int, int, Any, Any]

_ONE = Lock()  # one population at a time has all threads


def here(workshop: Workshop, spans: Iterator[Span], threads: int | None) -> Iterator[Done]:
    """Give the rows and time series of batches, the next one built while one runs."""
    drawn = Perturbations(workshop.study.seed)
    wanted = workshop.study.traces
    with ThreadPoolExecutor(1) as pool:
        building = None
        for span in spans:
            following = pool.submit(prepare, workshop, *span, drawn)
            if building is not None:
                yield _rows(workshop, building.result(), wanted, threads)
            building = following
        if building is not None:
            yield _rows(workshop, building.result(), wanted, threads)


def _rows(workshop: Workshop, batch: Any, wanted: str, threads: int | None) -> Done:
    rows = carried_out(workshop, batch, threads)
    recorded = None if wanted == "none" else traces(workshop, batch, wanted, threads)
    return batch.first, batch.last, rows, recorded


@lru_cache(maxsize=2)
def _workshop(payload: str) -> tuple[Workshop, Perturbations]:
    """Return a worker's own workshop of a study, kept for the next batch."""
    source, document, inputs = json.loads(payload)
    workshop = Workshop(Resolved(source, document, inputs))
    return workshop, Perturbations(workshop.study.seed)


def payload_of(resolved: Resolved) -> str:
    """Return a study as text for workers."""
    return json.dumps([resolved.source, resolved.document, dict(resolved.inputs)])


def remote(payload: str, first: int, last: int, expected: dict[str, str]) -> tuple[bytes, bytes]:
    """Return the rows and the time series of a batch, as bytes; called in a worker.

    Raises:
        FlexsimError: the worker has other versions than the client.
    """
    require_alike("a worker", identity(), expected)
    with _ONE:
        workshop, drawn = _workshop(payload)
        batch = prepare(workshop, first, last, drawn)
        _, _, rows, recorded = _rows(workshop, batch, workshop.study.traces, 1)
    return _bytes(rows), b"" if recorded is None else _bytes(recorded)


def _bytes(table: Any) -> bytes:
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def _table(content: bytes) -> Any:
    return pa.ipc.open_stream(content).read_all() if content else None


def require_alike(who: str, found: dict[str, str], expected: dict[str, str]) -> None:
    """Refuse a worker whose versions are others.

    Raises:
        RunError: they are; the message names the first.
    """
    for name, version in expected.items():
        if found.get(name) != version:
            raise RunError(
                f"{who} has {name} {found.get(name)}, this process {version}: the results would "
                "not be the same; install the same on all machines"
            )


@contextmanager
def cluster(address: str | None, workers: int | None) -> Iterator[Any]:
    """Give a client of a running scheduler, or of local worker processes made for it.

    Args:
        address: of a scheduler, such as tcp://host:8786. workers: processes on this machine.

    Raises:
        ParameterError: dask.distributed is not installed.
        RunError: nobody answers at the address, or there are no workers.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise ParameterError(
            "--workers and --cluster need dask.distributed; install it: pip install "
            "'flexsim[cluster]'"
        ) from None

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    if address is None:
        try:
            with _uninterrupted():  # Ctrl-C is for this process, which ends its workers
                local = LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address="127.0.0.1:0",  # of this machine alone, on any port
                    silence_logs=logging.CRITICAL,
                )
        except (OSError, RuntimeError) as error:
            raise RunError(f"--workers {workers}: they cannot be started: {error}") from None
        with local, Client(local) as client:
            yield client
        return
    try:
        client = Client(address, timeout=CONNECTED)
    except (OSError, ValueError, TimeoutError) as error:
        raise RunError(f"--cluster {address}: no scheduler answers there: {error}") from None
    with client:
        if not client.scheduler_info()["workers"]:
            raise RunError(
                f"--cluster {address}: the scheduler has no workers; start some with "
                f"dask worker {address} --nthreads 1"
            )
        yield client


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Have processes that are started in the block ignore Ctrl-C."""
    try:
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    except ValueError:  # not in the main thread
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def spread(resolved: Resolved, spans: Iterator[Span], client: Any) -> Iterator[Done]:
    """Give the rows and time series of batches as workers return them, in any order.

    Raises:
        RunError: a worker has other versions, or batches kill one after another.
        FlexsimError: what building a batch raises.
    """
    from distributed import KilledWorker, as_completed

    expected = identity()
    for who, found in client.run(identity).items():
        require_alike(f"the worker {who}", found, expected)
    payload = payload_of(resolved)
    count = max(1, len(client.scheduler_info()["workers"]))
    spans = iter(spans)
    where: dict[Any, Span] = {}

    def submitted() -> Any:
        span = next(spans, None)
        if span is None:
            return None
        future = client.submit(remote, payload, *span, expected, pure=False)
        where[future.key] = span
        return future

    first = [each for each in (submitted() for _ in range(AHEAD * count)) if each is not None]
    waiting = as_completed(first)
    for future in waiting:
        try:
            rows, recorded = future.result()
        except FlexsimError:
            raise
        except KilledWorker:
            first_run, last_run = where[future.key]
            raise RunError(
                f"runs {first_run} to {last_run - 1} ended several workers, one after another; "
                "give workers more memory, or smaller batches"
            ) from None
        except (OSError, RuntimeError, CancelledError) as error:
            raise RunError(
                f"the scheduler is gone ({type(error).__name__}); go on with --resume when there "
                "is one"
            ) from None
        if (more := submitted()) is not None:
            waiting.add(more)
        yield (*where.pop(future.key), _table(rows), _table(recorded))
        future.release()
