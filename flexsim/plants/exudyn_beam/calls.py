"""From compiled code into EXUDYN and back: one C function, which finds a run's systems by number.

    >>> with serving(systems) as handle:      # alive as long as the block runs
    ...     run(beam._replace(handle=handle))

The loop around it is compiled and without Python's lock; the call takes it, so that runs on
several threads take turns in EXUDYN and are computed alike. What is raised in there cannot pass
through compiled code, nor can what a signal raises: it ends the run as a divergence does, and is
raised where the block ends.
"""

from __future__ import annotations

import ctypes
import itertools
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

import llvmlite.binding
from numba import types

from flexsim.numerics.jit import jit, jit_apart
from flexsim.numerics.types import Array
from flexsim.plants.exudyn_beam.frames import ExudynBeam, from_world, to_world

SYMBOL = "flexsim_exudyn_advance"


class Systems(Protocol):
    """What a run steps, one system per thread."""

    def advance(self, slot: int, begins: bool, tau_1: float, tau_2: float) -> bool:
        """Advance a thread's system by a physics step; False if it could not."""


class _Serving:
    """Systems, what they raised, and the signals that came meanwhile."""

    def __init__(self, systems: Systems) -> None:
        self.systems = systems
        self.raised: BaseException | None = None
        self.signals: list[int] = []


_serving: dict[int, _Serving] = {}
_handles = itertools.count(1)


@contextmanager
def serving(systems: Systems) -> Iterator[int]:
    """Give the number by which compiled code finds the systems; raise at the end what they did."""
    handle, mine = next(_handles), _Serving(systems)
    _serving[handle] = mine
    before = _heard_later(mine.signals)
    try:
        yield handle
    finally:
        del _serving[handle]
        for number, handler in before.items():
            signal.signal(number, handler)
    for number in mine.signals:
        before[number](number, None)
    if mine.raised is not None:
        raise mine.raised


def _heard_later(signals: list[int]) -> dict[int, Callable[..., Any]]:
    """Have signals noted, not handled; return their handlers, of the main thread only."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    handlers = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}
    found: dict[int, Callable[..., Any]] = {n: it for n, it in handlers.items() if callable(it)}
    for number in found:
        signal.signal(number, lambda number, frame: signals.append(number))
    return found


def _advance(handle: int, slot: int, begins: int, tau_1: float, tau_2: float) -> int:
    mine = _serving[handle]
    if mine.raised is not None or mine.signals:
        return 0
    try:
        return int(mine.systems.advance(slot, bool(begins), tau_1, tau_2))
    except BaseException as raised:  # all is raised again by `serving`
        mine.raised = raised
        return 0


_PROTOTYPE = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_int64] * 3, *[ctypes.c_double] * 2)
_C = _PROTOTYPE(_advance)
llvmlite.binding.add_symbol(SYMBOL, ctypes.cast(_C, ctypes.c_void_p).value)
_advance_in_exudyn: Any = types.ExternalFunction(
    SYMBOL, types.int64(types.int64, types.int64, types.int64, types.float64, types.float64)
)


@jit_apart
def exudyn_step(
    p: ExudynBeam, slot: int, state: Array, tau_1: float, tau_2: float, work: Array
) -> None:
    """Advance the state by one physics step in EXUDYN, torques held; nan where it could not.

    Args:
        slot: which thread's system. state: (2 m,), read when a run begins, else only written:
            EXUDYN keeps accelerations and constraint forces that no state has.
        work: zero when a run begins.
    """
    begins = work[0, 0] == 0.0
    if begins:
        work[0, 0] = 1.0
        to_world(p, state, p.world[slot])
    if _advance_in_exudyn(p.handle, slot, int(begins), p.r_1 * tau_1, p.r_2 * tau_2) != 0:
        from_world(p, p.world[slot], state)
    else:
        state[:] = float("nan")


@jit
def exudyn_tip(p: ExudynBeam, state: Array):  # type: ignore[no-untyped-def]
    """Return the tip along and across the hub's x-axis, from joint 2 [m]."""
    m = state.shape[0] // 2
    return p.reach + state[m - 4], state[m - 3]
