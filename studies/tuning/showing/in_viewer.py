"""A tuning run in the rerun viewer, generation by generation: `flexsim tune --live`.

>>> with viewed(record, problem, url=None) as show:
...     show(generation)

What is shown decides nothing: a viewer that is closed is said so once, and the tuning goes on.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from flexsim.errors import RunError
from flexsim.loop.runs import closed_loop
from flexsim.numerics.types import Array
from flexsim.recording.case import Case
from studies.core.console import console
from studies.tuning.genetic import Generation, OnGeneration
from studies.tuning.kept import most_generations
from studies.tuning.problem import Problem
from studies.tuning.record import Record

TITLE = "index (5) [m2 s]"


class Course:
    """What the generations of a tuning have come to so far."""

    def __init__(self) -> None:
        self.best: list[float] = []
        self.median: list[float] = []
        self.stable: list[float] = []
        self.parameters: Array | None = None

    def add(self, new: Generation) -> bool:
        """Take a generation in; return whether its best is better than all before."""
        k = int(np.argmin(new.indices))
        before = self.best[-1] if self.best else np.inf
        better = bool(new.indices[k] < before)
        if better:
            self.parameters = new.population[k]
        self.best.append(min(before, float(new.indices[k])))
        self.median.append(float(np.median(new.indices)))
        self.stable.append(new.stable_share)
        return better


def case_of(problem: Problem, record: Record, parameters: Array) -> Case | None:
    """Return how an individual moves on the first plant that is simulated; None if it cannot."""
    (filters,) = problem.design.filters(parameters[None])
    if filters is None:
        return None
    plant, chosen = problem.scenarios[0]
    loop = (plant, chosen, problem.reference, [filters])
    (motion,) = closed_loop(*loop, v_gain=problem.v_gain)
    tuning = record.tuning
    return Case(
        "best",
        tuning.trajectory,
        tuning.controller,
        tuning.setting,
        {motion.plant: motion},
        None,
        problem.reference,
        tuning.built[0].words(),
        friction=chosen.friction,
    )


@contextmanager
def viewed(record: Record, problem: Problem, url: str | None) -> Iterator[OnGeneration]:
    """Give a function that shows each new generation in the viewer.

    Args:
        url: of a viewer; without one, that which runs on this machine, or else a new one.

    Raises:
        RunError: there is no viewer, and none can be started.
    """
    from flexsim.recording.tuning.convergence import Course as Drawn
    from flexsim.recording.tuning.live import LiveTuning
    from flexsim.recording.viewer import running_or_new

    parameters = problem.scenarios[0][0].parameters
    most = most_generations(record.tuning)
    screen: LiveTuning | None = LiveTuning(running_or_new(url), TITLE, most, parameters)
    course = Course()
    for each in record.generations:
        course.add(each)
    fresh = True  # a run that is continued shows its best at once

    def show(new: Generation) -> None:
        nonlocal screen, fresh
        better = course.add(new) or fresh
        if screen is None:
            return
        drawn = Drawn(
            TITLE, *(np.array(each) for each in (course.best, course.median, course.stable))
        )
        case = None
        if better and course.parameters is not None and np.isfinite(course.best[-1]):
            case = case_of(problem, record, course.parameters)
            fresh = False
        try:
            screen.show(drawn, case)
        except RunError as error:
            console(stderr=True).print(f"flexsim: {error}; tuning goes on", soft_wrap=True)
            screen = None

    yield show
