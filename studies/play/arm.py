"""One arm in the loop: its body, its controller's memory, and what was seen of it.

    >>> arm = Arm(body, loop, friction, hardware, controllers, start, again=HOLD)
    >>> rows = arm.run(first=0, count=16)

An arm that diverges stays where it is, marked with the time, while the other goes on.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from flexsim.loop.compiled_loop import Loop
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.friction import Friction
from flexsim.loop.hardware import (
    BridgeNumbers,
    EffectNumbers,
    Hardware,
    NoBridges,
    NoEffects,
    bridge_numbers,
    joint_memory,
    leanest_bridges,
    leanest_effects,
)
from flexsim.loop.motion import Motion
from flexsim.loop.trajectories import Reference
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.dispatch import work_space
from studies.play.bodies import ModesBody, MujocoBody
from studies.play.events import Shove
from studies.play.periods import Memory, Rows, rehearse, row_of, rows_for, run_periods
from studies.play.pushes import Point

REHEARSED = 5000  # samples that a new controller is shown of those before it
KEPT = 600_000  # rows: ten minutes at 1 kHz, half a gigabyte for both arms


@dataclass(frozen=True, eq=False)
class Block:
    """Rows of consecutive periods, and the plant as it was then."""

    first: int
    plant: Plant
    rows: Rows


class Arm:
    """One arm in the loop.

    Attributes:
        body: that moves. loop: its reference and kinematics. friction, hardware, controllers: now.
        blocks: what was seen, the last KEPT rows or so. diverged: period of divergence, or None.
    """

    def __init__(
        self,
        body: ModesBody | MujocoBody,
        loop: Loop,
        friction: Friction,
        hardware: Hardware,
        controllers: Controllers,
        start: Array,
        again: int,
    ) -> None:
        """Put the arm at rest at its start."""
        self.body, self.loop, self.again = body, loop, again
        self.friction, self.hardware = friction, hardware
        self._start = start
        self.restart(controllers)

    def restart(self, controllers: Controllers) -> None:
        """Put the arm back at rest at its start, nothing seen."""
        self.blocks: deque[Block] = deque()
        self.diverged: int | None = None
        self._kept = 0
        self.push = self.body.release()
        self.controllers = controllers
        self._numbers = self._bridges()
        self._memory = Memory(
            self._start.copy(),
            np.zeros(controllers.b.shape[1:]),
            np.zeros((2, controllers.A.shape[1])),
            np.zeros((self.hardware.delay, 2)),
            joint_memory(self._start),
            work_space(len(self._start) // 2),
            np.zeros(self._numbers.room),
        )

    def _bridges(self) -> BridgeNumbers | NoBridges:
        """Return what bridges and tachometers read of the plant as it is."""
        found = bridge_numbers(self.hardware, self.body.plant, self.loop.period)
        return leanest_bridges([found])[0]

    def _effects(self) -> EffectNumbers | NoEffects:
        """Return what there is at the joints."""
        own = self.hardware.effects.numbers(self.loop.period / self.loop.substeps)
        return leanest_effects([own], self.friction.law == "lugre")[0]

    @property
    def state(self) -> Array:
        """The state (2 m,), not to be written to."""
        return self._memory.state

    def run(self, first: int, count: int) -> Rows:
        """Go on by whole periods; rows are nan where the arm has diverged.

        Args:
            first: number of the first period. count: how many.
        """
        rows = rows_for(count, len(self.state))
        if self.diverged is not None:
            return rows
        loop = self.loop
        done, seen = run_periods(
            self.body.coefficients,
            self.friction.numbers(),
            self.hardware.numbers(loop.period, loop.substeps),
            self._effects(),
            self._numbers,
            loop,
            self.controllers,
            self._memory,
            self.push,
            first,
            count,
            self.again,
            rows,
        )
        if done < count:
            self.diverged = first + done
        self._keep(Block(first, self.body.plant, Rows(*(column[:seen] for column in rows))))
        if self.diverged is not None:
            last = self._last("state", len(self.state), 1)
            self._memory.state[:] = last[-1] if len(last) else self._start
        return rows

    def _keep(self, block: Block) -> None:
        self.blocks.append(block)
        self._kept += len(block.rows.state)
        while self._kept - len(self.blocks[0].rows.state) > KEPT:
            self._kept -= len(self.blocks.popleft().rows.state)

    def shoved(self, shove: Shove, tip: Point) -> None:
        """Be pushed until told otherwise, at a point that is taken anew when this is called."""
        if shove.ends:
            self.push = self.body.release()
        else:
            point = shove.point or tip
            self.push = self.body.push(point, shove.force, shove.torque, self.state)

    def became(self, plant: Plant) -> None:
        """Go on as another plant of the body's, bridges calibrated in it."""
        state = self.body.take(plant, self._memory.state)
        self._memory.state[:] = state
        self._numbers = self._bridges()

    def retuned(self, controllers: Controllers) -> None:
        """Have another controller, its memory what the last REHEARSED measurements make of it.

        So a filter without poles goes on as if it had been there all along; one with poles nearly,
        the older its memory reaches the less.
        """
        self.controllers = controllers
        z, inner = np.zeros(controllers.b.shape[1:]), np.zeros((2, controllers.A.shape[1]))
        error, v = self._last("error", 2, REHEARSED), self._last("measured", 3, REHEARSED)[:, 2]
        rehearse(controllers, z, inner, error, np.ascontiguousarray(v))
        self._memory = self._memory._replace(z=z, inner=inner)

    def delayed(self, hardware: Hardware, period: int) -> None:
        """Have other hardware; with another delay those commands wait that would have then.

        Args:
            period: the next to be run.
        """
        self.hardware = hardware
        self._numbers = self._bridges()
        late = np.zeros((hardware.delay, 2))
        said = self._last("torque", 2, hardware.delay)
        for j in range(1, len(said) + 1):
            late[(period - j) % hardware.delay] = said[-j]
        self._memory = self._memory._replace(late=late)

    def _last(self, column: str, width: int, count: int) -> Array:
        """Return the last rows (K, width) of a column, at most so many."""
        parts: list[Array] = []
        missing = count
        for block in reversed(self.blocks):
            if missing <= 0:
                break
            values = getattr(block.rows, column)
            parts.append(values[max(0, len(values) - missing) :])
            missing -= len(parts[-1])
        return np.concatenate([np.zeros((0, width)), *parts[::-1]])

    def motion(self, ref: Reference) -> Motion:
        """Return what was seen, as recordings and metrics want it.

        Args:
            ref: the reference, whose samples come again as the loop has it.
        """
        blocks = list(self.blocks)
        periods = np.concatenate([b.first + np.arange(len(b.rows.state)) for b in blocks])
        which = np.array([row_of(int(k), len(ref.time), self.again) for k in periods], dtype=int)
        columns = {
            name: np.concatenate([getattr(block.rows, name) for block in blocks])
            for name in ("state", "torque", "error", "applied", "measured", "sensed")
        }
        looks = [
            vars(plant.observe(np.concatenate([block.rows.state for block in group])))
            for plant, group in groupby(blocks, key=lambda block: block.plant)
        ]
        seen = {
            name: np.concatenate([look[name] for look in looks])
            for name, of_first in looks[0].items()
            if of_first is not None  # a rigid link has no points along it
        }
        period = self.loop.period
        return Motion(
            plant=self.body.plant.name,
            time=period * periods,
            reference_tip=ref.tip[which],
            reference_joint=ref.joint[which],
            diverged=None if self.diverged is None else period * self.diverged,
            **columns,
            **seen,
        )
