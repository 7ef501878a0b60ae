"""Many runs in compiled threads: one population, on one stage or each run on its own.

>>> run_population(Stage(plant, friction, hardware, loop, start), controllers)
>>> run_each(stages, which, numbers, controllers)      # robots, friction, references of many kinds

What runs share, a plant or a reference, is kept once. Plants of other kinds, or of another number
of coordinates, are populations of their own: `alike` says which may be one.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from flexsim.errors import ParameterError
from flexsim.loop.compiled_loop import Loop, Outcome, run_some
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.friction import LUGRE, FrictionNumbers
from flexsim.loop.hardware import (
    IDEAL,
    SENSED,
    Hardware,
    bridge_numbers,
    leanest_bridges,
    leanest_effects,
)
from flexsim.loop.measuring import NO_YARDSTICK, SUMS, Yardstick
from flexsim.loop.stacked import indexed, stacked
from flexsim.loop.threads import in_threads
from flexsim.numerics.types import Array

THREADS_MOST = numba.config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]


class Stage(NamedTuple):
    """Where a run happens.

    Attributes:
        plant: with `running(threads)`, a context manager (`flexsim.plants.base`).
        friction: compiled friction law. loop: reference and measurement.
        start: (2 m,) state at t = 0.
        hardware: sensors, computer, motors.
        yard: what runs are measured against; nothing is unless it is given.
    """

    plant: Any
    friction: FrictionNumbers
    loop: Loop
    start: Array
    hardware: Hardware = IDEAL
    yard: Yardstick = NO_YARDSTICK


def run_population(
    stage: Stage,
    controllers: Controllers,
    stride: int = 0,
    threads: int | None = None,
    same_noise: bool = False,
    first_run: int = 0,
) -> Outcome:
    """Return the outcome of every controller on one stage.

    Args:
        controllers: P of them, from `flexsim.loop.control.stacking.stack`.
        stride, threads: see `run_each`.
        same_noise: whether all runs have the first's noise.
        first_run: which run of a longer series the first is: it has that one's noise.
    """
    count = len(controllers.b)
    numbers = np.full(count, first_run) if same_noise else first_run + np.arange(count)
    which = np.zeros(count, dtype=np.int64)
    return run_each([stage], which, numbers, controllers, stride, threads)


def run_each(
    stages: Sequence[Stage],
    which: NDArray[np.int64],
    numbers: NDArray[np.int64],
    controllers: Controllers,
    stride: int = 0,
    threads: int | None = None,
) -> Outcome:
    """Return the outcome of runs on stages of one kind.

    Args:
        stages: S of them, whose plants have as many coordinates of the same kind.
        which: (P,) on which of them each run happens. numbers: (P,) of the runs, for their noise.
        controllers: P of them.
        stride: record every stride-th sample; 0 records nothing.
        threads: number of threads; None for as many as there are cores.

    Raises:
        ParameterError: stride or threads are out of range, or plants are of different kinds.
    """
    if stride < 0:
        raise ParameterError(f"stride is {stride}; give 1 or more, or 0 to record nothing")
    wanted = THREADS_MOST if threads is None else threads
    if not 1 <= wanted <= THREADS_MOST:
        raise ParameterError(f"threads is {threads}; give 1 to {THREADS_MOST}")
    plants, of_plant = indexed([each.plant for each in stages])
    frictions, of_friction = indexed([each.friction for each in stages])
    loops, of_loop = indexed([each.loop for each in stages])
    yards, of_yard = indexed([each.yard for each in stages])
    starts = np.array([each.start for each in stages])
    built = [(each.hardware, each.loop.period, each.loop.substeps) for each in stages]
    hardwares = list(dict.fromkeys(built))
    of_hardware = np.array([hardwares.index(each) for each in built])
    reading = [  # what bridges read depends on the plant, where there are any
        (each.hardware, each.loop.period, plant if each.hardware.sensing.strained else 0)
        for each, plant in zip(stages, of_plant.tolist(), strict=True)
    ]
    bridges = list(dict.fromkeys(reading))
    of_bridges = np.array([bridges.index(each) for each in reading])
    of_start = np.arange(len(stages))
    of_stage = np.stack(
        [of_plant, of_friction, of_hardware, of_loop, of_yard, of_start, of_bridges], axis=1
    )
    sensors = [bridge_numbers(h, plants[plant], period) for h, period, plant in bridges]
    bristles = any(each.law == LUGRE for each in frictions)
    own = [h.effects.numbers(period / steps) for h, period, steps in hardwares]
    effects = leanest_effects(own, bristles)
    samples = max(len(loop.tip) for loop in loops)
    outcome = _room(len(which), samples, len(starts[0]), stride, any(len(y.points) for y in yards))
    with ExitStack() as held:
        running = [held.enter_context(plant.running(wanted)) for plant in plants]
        fixed = (
            *stacked(running),
            *stacked(frictions),
            *stacked([h.numbers(period, substeps) for h, period, substeps in hardwares]),
            *stacked(effects),
            *stacked(leanest_bridges(sensors)),
            *stacked(loops),
            *stacked(yards),
            starts,
            of_stage[which],
            np.asarray(numbers, dtype=np.int64),
            controllers,
            stride,
            *outcome,
        )
        in_threads(
            lambda first, last, slot: run_some(first, last, slot, *fixed), len(which), wanted
        )
    return outcome


def _room(runs: int, samples: int, size: int, stride: int, measured: bool) -> Outcome:
    """Return an outcome to be filled, of runs of at most so many samples and states of a size."""
    rows = (samples + stride - 1) // stride if stride else 0
    return Outcome(
        np.empty(runs),
        np.empty(runs),
        np.full((runs, rows, size), np.nan),
        np.full((runs, rows, 2), np.nan),
        np.full((runs, rows, 2), np.nan),
        np.zeros((runs, SUMS if measured else 0)),
        np.full((runs, rows, 2), np.nan),
        np.full((runs, rows, 3), np.nan),
        np.full((runs, rows, SENSED), np.nan),
    )
