"""What our controllers bear on the bench, and others do not: sentences of README.md.

python docs/made/margins.py
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from controllers import TUNED, TUNED_IDEAL
from controllers.pid import Controller
from flexsim import Parameters
from flexsim.linear.exact_loop import NO_FRICTION, exact_growth, exact_loops
from flexsim.linear.growth import SLACK
from flexsim.linear.loop_poles import small_signal
from flexsim.linear.reserves import reserves
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.settings import setting
from flexsim.numerics.clocks import PERIOD

BENCH = setting("simulink", HARDWARE["bench"])
SLOPE = small_signal(BENCH.friction)
ROBOT = Parameters()
OTHERS = (  # that the controllers are not told of
    replace(ROBOT, EI=0.8 * ROBOT.EI),
    replace(ROBOT, EI=1.2 * ROBOT.EI),
    replace(ROBOT, payload=0.05),
)


def stacked(controllers: Iterable[Controller]) -> Controllers:
    """Return controllers as loops take them."""
    return stack([each.filters(PERIOD) for each in controllers], PERIOD)


def borne() -> None:
    """Print the least delay and gain factor to spare, without friction and with its slope."""
    spare = []
    for slope in (NO_FRICTION, SLOPE):
        loops = exact_loops(ROBOT, slopes=(slope,), hardware=BENCH.hardware)
        each = [reserves(loops, stacked([one])) for one in TUNED.values()]
        delay = 1e3 * min(one.delay_margin for one in each)
        spare.append((delay, min(one.gain_margin for one in each)))
    (delay, gain), (slow, less) = spare
    print(
        f"They bear {delay:.2f} ms of delay and a gain factor of {gain:.2f} more (with friction's "
        f"slope {slow:.2f} ms and {less:.2f})"
    )


def others() -> None:
    """Print whether they bear another beam and a load."""
    slopes = (NO_FRICTION, SLOPE)
    loops = [
        loop
        for robot in OTHERS
        for loop in exact_loops(robot, slopes=slopes, hardware=BENCH.hardware)
    ]
    worst = exact_growth(loops, stacked(TUNED.values())).max()
    also = "also" if worst <= SLACK else f"not (growth {worst:.2f} 1/s)"
    print(f"{also} with 20 % more or less stiffness or 50 g at the tip")


def of_the_ideal_loop() -> None:
    """Print how fast controllers that were tuned in the ideal loop grow on the bench."""
    loops = exact_loops(ROBOT, hardware=BENCH.hardware)
    growth = exact_growth(loops, stacked(TUNED_IDEAL.values()))
    print(f"grows at {growth.min():.0f} 1/s or more")


if __name__ == "__main__":
    borne()
    others()
    of_the_ideal_loop()
