"""Each item is worked at once, by one of the threads; what fails is heard of."""

from __future__ import annotations

import os
import signal
import threading
import time

import pytest

from flexsim.loop.threads import in_threads


@pytest.mark.parametrize(("count", "threads"), [(0, 2), (1, 4), (7, 1), (40, 3)])
def test_each_item_is_taken_once(count: int, threads: int) -> None:
    taken: list[int] = []
    slots: set[int] = set()

    def work(first: int, last: int, slot: int) -> None:
        taken.extend(range(first, last))
        slots.add(slot)
        time.sleep(0.001)

    in_threads(work, count, threads)
    assert sorted(taken) == list(range(count))
    assert slots <= set(range(min(threads, max(count, 1))))


def test_threads_work_at_the_same_time() -> None:
    together = threading.Barrier(2)
    in_threads(lambda first, last, slot: together.wait(timeout=10), 2, 2)


def test_an_error_ends_them_all_and_is_raised() -> None:
    done: list[int] = []

    def work(first: int, last: int, slot: int) -> None:
        if first == 3:
            raise ValueError("item 3")
        done.append(first)
        time.sleep(0.001)

    with pytest.raises(ValueError, match="item 3"):
        in_threads(work, 10_000, 2)
    assert len(done) < 10_000


def test_a_signal_is_answered_when_nothing_is_at_work_any_more() -> None:
    """What items work on may be freed then: a join that was interrupted forgets its thread."""
    at_work: list[int] = []

    def work(first: int, last: int, slot: int) -> None:
        at_work.append(first)
        time.sleep(0.6 if slot == 0 else 0.2)  # the first, which is waited for, is the last
        at_work.remove(first)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
    try:
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            in_threads(work, 20, 2)
        assert at_work == []
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)
