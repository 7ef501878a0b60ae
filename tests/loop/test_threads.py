"""Each item is worked at once, by one of the threads; what fails is heard of."""

from __future__ import annotations

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
