"""How many control periods are due? The wall clock decides that, and nothing else.

    >>> pace = Pace(period=1e-3, speed=0.5)
    >>> live.advance(pace.due())

Late, it lets the simulation fall behind the clock: a frame has at most FRAME seconds of it, the
rest is given up and counted. Steps are never longer, periods never left out.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from flexsim.errors import ParameterError

FRAME = 0.1  # [s] of simulated time at speed 1 that a frame may catch up with
SLOWEST, FASTEST = 0.001, 1.0


class Pace:
    """Simulated time by the wall clock.

    Attributes:
        period: of the loop [s]. speed: simulated over wall time. paused: whether nothing is due.
        late: wall time that was given up so far [s].
    """

    def __init__(
        self, period: float, speed: float = 1.0, now: Callable[[], float] = time.monotonic
    ) -> None:
        """Start the clock.

        Raises:
            ParameterError: the speed is out of range.
        """
        self.period, self._now = period, now
        self.paused = False
        self.late = 0.0
        self.set_speed(speed)

    def set_speed(self, speed: float) -> None:
        """Go on at another speed from now.

        Raises:
            ParameterError: it is out of range.
        """
        if not SLOWEST <= speed <= FASTEST:
            raise ParameterError(f"speed is {speed:g}; give {SLOWEST:g} to {FASTEST:g}, real time")
        self.speed = speed
        self.reset()

    def reset(self) -> None:
        """Count from now; what was due before is forgotten."""
        self._start, self._done = self._now(), 0

    def pause(self, paused: bool) -> None:
        """Stop, or go on from now."""
        self.paused = paused
        self.reset()

    def due(self) -> int:
        """Return how many periods to advance by now, and take them as done."""
        if self.paused:
            return 0
        count = int((self._now() - self._start) * self.speed / self.period) - self._done
        most = max(1, round(FRAME * self.speed / self.period))
        if count > most:
            lost = (count - most) * self.period / self.speed
            self._start += lost
            self.late += lost
            count = most
        count = max(count, 0)
        self._done += count
        return count
