"""What our controllers bear on the bench: a sentence of README.md.

python docs/made/margins.py
"""

from __future__ import annotations

from controllers import TUNED
from flexsim import Parameters
from flexsim.linear.exact_loop import NO_FRICTION, exact_loops
from flexsim.linear.loop_poles import small_signal
from flexsim.linear.reserves import reserves
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.settings import setting
from flexsim.numerics.clocks import PERIOD


def main() -> None:
    """Print the least delay and gain factor to spare, without friction and with its slope."""
    bench = setting("simulink", HARDWARE["bench"])
    spare = []
    for slope in (NO_FRICTION, small_signal(bench.friction)):
        loops = exact_loops(Parameters(), slopes=(slope,), hardware=bench.hardware)
        each = [reserves(loops, stack([c.filters(PERIOD)], PERIOD)) for c in TUNED.values()]
        delay = 1e3 * min(one.delay_margin for one in each)
        spare.append((delay, min(one.gain_margin for one in each)))
    (delay, gain), (slow, less) = spare
    print(
        f"They bear {delay:.2f} ms of delay and a gain factor of {gain:.2f} more (with friction's "
        f"slope {slow:.2f} ms and {less:.2f})"
    )


if __name__ == "__main__":
    main()
