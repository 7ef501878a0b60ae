"""Poles and margins of the loop as the knobs have it, soon enough to be watched while they turn.

    >>> found = live_reserves(Question(loops_source, theta2=1.5, ...))
    >>> watcher = Watcher(); watcher.ask(question); watcher.answer

The exact linear loop near rest, as `flexsim.linear.exact_loop` has it, but with MODES modes of the
beam: growth of our controllers as with twelve to 1e-6 1/s, margins to some thousandths, in less
time. Margins are first crossings on a grid, refined: what grows for less than a step of it is not
seen; `flexsim stability` looks closer. Of a robot that is a file, its own chain under exact hold.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexsim.arm.parameters import Parameters
from flexsim.errors import FlexsimError
from flexsim.linear.delay_margin import late_growth
from flexsim.linear.exact_loop import exact_growth, exact_loops
from flexsim.linear.growth import quantised
from flexsim.linear.loop_poles import (
    LinearLoop,
    LoopOptions,
    SampledPlant,
    sampled_plant,
    small_signal,
)
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.friction import Friction
from flexsim.loop.hardware import Hardware
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant

MODES = 5
FACTORS = np.geomspace(1.0, 20.0, 28)[1:]  # of gains; a margin beyond is inf, or 0 below
DELAYS = np.arange(1, 13) / 4  # periods; a margin beyond is inf
FINER = 16  # parts of such a step


@dataclass(frozen=True, eq=False)
class Question:
    """A loop near rest.

    Attributes:
        robot: parameters of a uniform beam, or a plant to be linearised.
        theta2: [rad]. controllers: one. friction, hardware: of which slopes, delay and lag count.
        v_gain, period: of the loop.
    """

    robot: Parameters | Plant
    theta2: float
    controllers: Controllers
    friction: Friction
    hardware: Hardware
    v_gain: float
    period: float


@dataclass(frozen=True)
class Answer:
    """What it has to spare.

    Attributes:
        growth: of its fastest growing motion [1/s]; hz: that motion's frequency.
        gain_low, gain_high: factors of all gains at which one grows; 0 and inf beyond FACTORS.
        delay: of both torques, beside what there is, at which one grows [s]; inf beyond DELAYS.
        theta2: where [rad]. why_not: why there is none, all else nan.
    """

    growth: float = np.nan
    hz: float = np.nan
    gain_low: float = np.nan
    gain_high: float = np.nan
    delay: float = np.nan
    theta2: float = np.nan
    why_not: str = ""


def live_reserves(question: Question) -> Answer:
    """Return growth and margins; of a robot that has no linear loop, why."""
    try:
        sampled = _sampled(question)
        loop = LinearLoop(sampled, question.controllers)
        growth = float(quantised(loop.growth_rate))
        hz = float(np.abs(np.angle(loop.poles[0])) / (2 * np.pi * question.period))
        if growth > 0:
            return Answer(growth, hz, 1.0, 1.0, 0.0, question.theta2)
        c = question.controllers
        high = _first(lambda f: _grow_at(sampled, c, f), FACTORS, 1.0)
        low = 1 / _first(lambda f: _grow_at(sampled, c, 1 / f), FACTORS, 1.0)
        delay = _delay_margin(sampled, c)
    except (FlexsimError, np.linalg.LinAlgError) as error:
        return Answer(why_not=" ".join(str(error).split()))
    return Answer(growth, hz, low, high, delay, question.theta2)


def _sampled(question: Question) -> SampledPlant:
    """Return the plant of a question over a period, under exact hold."""
    gain, damping = small_signal(question.friction)
    own = question.hardware.linear
    if isinstance(question.robot, Parameters):
        (found,) = exact_loops(
            question.robot,
            (question.theta2,),
            slopes=((gain, damping),),
            period=question.period,
            hardware=own,
            modes=MODES,
            v_gain=question.v_gain,
        )
        return found
    options = LoopOptions(question.period, question.v_gain, gain, damping, "exact", own)
    return sampled_plant(question.robot, question.theta2, options)


def _first(grow: Callable[[Array], NDArray[np.bool_]], grid: Array, start: float) -> float:
    """Return where something first grows from a start along a grid, in parts of its steps.

    inf if nowhere. All of a grid is asked at once: a call costs as much as many matrices.
    """
    growing = np.flatnonzero(grow(grid))
    if not len(growing):
        return float(np.inf)
    i = int(growing[0])
    finer = np.linspace(grid[i - 1] if i else start, grid[i], FINER + 1)[1:]
    return float(finer[np.argmax(np.append(grow(finer[:-1]), True))])


def _grow_at(sampled: SampledPlant, c: Controllers, factors: Array) -> NDArray[np.bool_]:
    """Return which loops grow with their gains times factors (F,)."""
    many = Controllers(*(np.repeat(each, len(factors), axis=0) for each in c))
    many.b[:, :, :, 0] *= factors[:, None, None, None]
    many.C[:] *= factors[:, None, None]
    many.D[:] *= factors[:, None, None]
    return np.asarray(quantised(exact_growth([sampled], many)) > 0)


def _delay_margin(sampled: SampledPlant, controllers: Controllers) -> float:
    """Return the extra delay at which a loop that does not grow does [s]; inf beyond DELAYS."""

    def grows(periods: float) -> bool:
        extra = periods * sampled.period
        return bool(quantised(late_growth([sampled], controllers, extra))[0] > 0)

    below = 0.0
    for value in DELAYS.tolist():
        if grows(value):
            low, high = below, value
            while high - low > DELAYS[0] / FINER:
                middle = (low + high) / 2
                low, high = (low, middle) if grows(middle) else (middle, high)
            return float(high * sampled.period)
        below = value
    return float(np.inf)


class Watcher:
    """A thread that answers the last question asked, and how long each answer took.

    Attributes:
        answer: the latest, None at first. took: [s] from question to answer, of each answered.
    """

    def __init__(self, now: Callable[[], float] = time.perf_counter) -> None:
        """Start the thread."""
        self.answer: Answer | None = None
        self.took: list[float] = []
        self._now = now
        self._asked: tuple[float, Question] | None = None
        self._changed = threading.Condition()
        self._ended = self._busy = False
        self._thread = threading.Thread(target=self._work, name="margins", daemon=True)
        self._thread.start()

    def ask(self, question: Question) -> None:
        """Have a question answered; one that still waits is forgotten."""
        with self._changed:
            self._asked = (self._now(), question)
            self._changed.notify_all()

    def wait(self) -> Answer | None:
        """Return the answer to the last question, when it is there."""
        with self._changed:
            self._changed.wait_for(lambda: self._asked is None and not self._busy)
        return self.answer

    def end(self) -> None:
        """End the thread."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()
        self._thread.join()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._ended or self._asked is not None)
                if self._ended or self._asked is None:
                    return
                start, question = self._asked
                self._asked, self._busy = None, True
            answer = live_reserves(question)
            with self._changed:
                self.answer, self._busy = answer, False
                self.took.append(self._now() - start)
                self._changed.notify_all()


def with_load(parameters: Parameters, payload: float, damping: float) -> Parameters:
    """Return a robot with a payload [kg] more and its damping times a factor."""
    p = parameters
    return replace(p, payload=p.payload + payload, zeta=p.zeta * damping)
