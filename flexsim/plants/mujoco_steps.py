"""MuJoCo's `mj_step` and the tip's place, as compiled loops call them for chain and rod.

A state is one array of ours, `qpos` then `qvel`; an `mjData` is a workspace, one per thread. What
else one step hands to the next, the solver's warm start where constraints act, is in the run's own
work space, zero when a run begins as in a new `mjData`: so a run is MuJoCo's own, to the bit, and
the same on whichever thread and after whichever other.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from flexsim.numerics.jit import jit
from flexsim.numerics.mujoco_c import (
    INPUTS,
    STATE,
    mj_getState,
    mj_setState,
    mj_step,
    quiet_warnings,
)
from flexsim.numerics.types import Array
from flexsim.plants.stepped import stepped


class Chain(NamedTuple):
    """A chain as compiled functions read it.

    `model` and `data` are addresses, one mjData per thread; L_R, root (from joint 2 to the first
    hinge) and lengths (of the N segments, the last to the tip) in metres. Of a link 1 that bends,
    too: second, the place of joint 2 in the file's order, 1 behind a rigid link; link1 (second,),
    the lengths of its pieces [m].
    """

    model: int
    data: NDArray[np.int64]
    L_R: float
    root: float
    lengths: Array
    step: float
    second: int
    link1: Array


class Workspaces:
    """What loops step of a file: its model without the rest, and an mjData per thread.

    An mjData is lent to a run and kept for the next: making one costs as much as a hundred steps.
    """

    def __init__(self, model: mujoco.MjModel, text: str) -> None:
        self.model = stepped(model, text)
        self._free: list[list[mujoco.MjData]] = []  # a list for each of the runs at one time

    @contextmanager
    def lent(self, threads: int) -> Iterator[NDArray[np.int64]]:
        """Give the addresses of an mjData per thread, this run's alone, MuJoCo's warnings quiet."""
        data = self._free.pop() if self._free else []
        data += [mujoco.MjData(self.model) for _ in range(threads - len(data))]
        with quiet_warnings():
            yield np.array([each._address for each in data], dtype=np.int64)
        self._free.append(data)


@jit
def _advance(model: int, data: int, state: Array, tau_1: float, tau_2: float, work: Array) -> None:
    """Advance the state by one `mj_step`, torques held.

    Args:
        model, data: addresses. state: (2 nv,) qpos, then qvel; overwritten.
        work: of `dispatch.work_space`, zero when a run begins. Rows 4 and 5, end to end, hold the
            warm start (nv,), then the controls (2,), in MuJoCo's order.
    """
    inputs = work[4:6].reshape(2 * work.shape[1])
    inputs[work.shape[1]] = tau_1
    inputs[work.shape[1] + 1] = tau_2
    mj_setState(model, data, state.ctypes.data, STATE)
    mj_setState(model, data, inputs.ctypes.data, INPUTS)
    mj_step(model, data)
    mj_getState(model, data, state.ctypes.data, STATE)
    mj_getState(model, data, inputs.ctypes.data, INPUTS)


@jit
def chain_step(p: Chain, slot: int, state: Array, tau_1: float, tau_2: float, work: Array) -> None:
    """Advance the state by one `mj_step`, torques held.

    Args:
        slot: which thread's mjData serves as workspace.
        state: (2 m,) angles, then rates: joint 1, joint 2, then the hinges; overwritten.
        work: zero when a run begins.
    """
    if p.second == 1:  # as in the file
        _advance(p.model, p.data[slot], state, tau_1, tau_2, work)
        return
    m = state.shape[0] // 2
    own = work[6:8].reshape(2 * m)
    for i in range(m):
        own[i], own[m + i] = state[place(i, p.second)], state[m + place(i, p.second)]
    _advance(p.model, p.data[slot], own, tau_1, tau_2, work)
    for i in range(m):
        state[place(i, p.second)], state[m + place(i, p.second)] = own[i], own[m + i]


@jit
def place(i: int, second: int) -> int:
    """Return where in a state the i-th joint of a serial chain is: joint 2 comes second."""
    if i == second:
        return 1
    return i + 1 if 0 < i < second else i


@jit
def chain_tip(p: Chain, state: Array):  # type: ignore[no-untyped-def]
    """Return the tip along and across the hub's x-axis, from joint 2 [m]."""
    along, across, angle = p.root, 0.0, 0.0
    for j in range(p.lengths.shape[0]):
        angle += state[1 + p.second + j]
        along += p.lengths[j] * np.cos(angle)
        across += p.lengths[j] * np.sin(angle)
    return along, across


@jit
def chain_elbow(p: Chain, L_R: float, state: Array):  # type: ignore[no-untyped-def]
    """Return joint 2 along and across link 1 [m], and by how much link 1's end has turned [rad].

    L_R: of a rigid link 1.
    """
    if p.second == 1:
        return L_R, 0.0, 0.0
    along, across, angle = p.link1[0], 0.0, 0.0
    for j in range(1, p.second):
        angle += state[1 + j]
        along += p.link1[j] * np.cos(angle)
        across += p.link1[j] * np.sin(angle)
    return along, across, angle


class Rod(NamedTuple):
    """A rod as compiled functions read it.

    `model` and `data` are addresses, one mjData per thread; L_R and reach, from joint 2 to the tip
    of the straight beam, in metres.
    """

    model: int
    data: NDArray[np.int64]
    L_R: float
    reach: float
    step: float


@jit
def rod_step(p: Rod, slot: int, state: Array, tau_1: float, tau_2: float, work: Array) -> None:
    """Advance the state by one `mj_step`, torques held.

    Args:
        slot: which thread's mjData serves as workspace.
        state: (4 (N+1),) qpos, then qvel; overwritten.
        work: zero when a run begins.
    """
    _advance(p.model, p.data[slot], state, tau_1, tau_2, work)


@jit
def rod_tip(p: Rod, state: Array):  # type: ignore[no-untyped-def]
    """Return the tip along and across the hub's x-axis, from joint 2 [m]."""
    m = state.shape[0] // 2
    return p.reach + state[m - 2], state[m - 1]
