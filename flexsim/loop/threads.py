"""Items of a loop over threads: compiled code that lets go of Python's lock, each item taken once.

>>> in_threads(lambda first, last, slot: run_some(first, last, slot, *fixed), 50, threads=2)

Not numba's own parallel loops: those compile what they call twice over, and cannot be interrupted.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable


def in_threads(work: Callable[[int, int, int], object], count: int, threads: int) -> None:
    """Have items 0 to count worked at, one after the other by whichever thread is free.

    Args:
        work: called with the first item, the one after the last, and the number of the thread.
        threads: 1 or more; the caller's own thread works alone where one is enough.

    Raises:
        Exception: what `work` raises first, when all threads have ended.
    """
    threads = min(threads, count)
    if threads <= 1:
        if count:
            work(0, count, 0)
        return
    items, ends = itertools.count(), threading.Event()  # next() is one instruction of Python's
    ended = [threading.Event() for _ in range(threads)]  # a join that a signal interrupts forgets
    errors: list[BaseException] = []

    def worker(slot: int) -> None:
        try:
            while not ends.is_set() and (item := next(items)) < count:
                work(item, item + 1, slot)
        except BaseException as error:
            errors.append(error)
            ends.set()
        finally:
            ended[slot].set()

    started = 0
    try:
        for slot in range(threads):
            threading.Thread(target=worker, args=(slot,), daemon=True).start()
            started += 1
        for each in ended:
            each.wait()
    finally:  # a signal: what is at work ends its item, no other is begun
        ends.set()
        for each in ended[:started]:
            each.wait()
    if errors:
        raise errors[0]
