"""Loops timed in turn, side by side in one run: only ratios of such times mean anything."""

from __future__ import annotations

import time
from collections.abc import Callable

TURN = 0.3  # [s] that a loop's turn lasts at least


def least_cost(
    loops: dict[str, Callable[[], float]],
    rounds: int,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, float]:
    """Return each loop's least time [us] per simulated ms, the loops taking turns.

    A quick loop is run several times in its turn: the machine's pauses would spare none of a few.

    Args:
        loops: each runs once and gives the simulated time [ms]. rounds: turns of each.
        clock: of the time that counts [s], on the wall; or `time.process_time`, from which other
            work on the machine takes nothing.
    """
    for loop in loops.values():
        loop()  # compiles
    best = dict.fromkeys(loops, float("inf"))
    for _ in range(rounds):
        for name, loop in loops.items():
            turn = time.perf_counter() + TURN
            while True:
                start = clock()
                simulated = loop()
                best[name] = min(best[name], 1e6 * (clock() - start) / simulated)
                if time.perf_counter() > turn:
                    break
    return best
