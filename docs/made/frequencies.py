"""Frequencies and growth that the text of models/README.md names.

python docs/made/frequencies.py
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from asked import numbers

from controllers import TUNED_ARMS, textbook_pid
from flexsim import Parameters, Robot
from flexsim.arm.chain_design import design_chain
from flexsim.arm.free_arm import clamped_frequencies
from flexsim.linear.exact_loop import exact_growth, exact_loops
from flexsim.loop.control.stacking import stack
from flexsim.numerics.clocks import PERIOD

DESIGNED = (0.02, 0.03, 0.1)  # [N m s/rad] kd of joint 2, kp = kd/s, filtered with 3 ms


def growth(robot: Robot, filters: object, delays: tuple[int, ...]) -> float:
    """Return how fast a loop of the arm whose links both bend grows, v ignored [1/s]."""
    loops = exact_loops(robot.parameters, delays=delays, v_gain=0.0, link1=robot.link1)
    return float(exact_growth(loops, stack([filters], PERIOD))[0])


def undamped(robot: Robot) -> Robot:
    """Return the arm with beams that have no damping."""
    own = replace(robot.parameters, zeta=0.0)
    return replace(robot, parameters=own, link1=replace(robot.link1, zeta=0.0))


def main() -> None:
    """Print the sentences."""
    design = design_chain(Parameters(), 6)
    own = clamped_frequencies(Parameters(), 3)
    apart = np.abs(design.frequency[:3] / own - 1).max()
    print(
        f"are the beam's own ({numbers(design.frequency[:3], '.5f', 0.5 / np.pi)} Hz, to "
        f"1e{math.ceil(math.log10(apart))})"
    )
    robot = Robot.named("two-flexible")
    filters = TUNED_ARMS["two-flexible"].filters(PERIOD)
    late = (0, 1, 2)
    soft, stiff = (growth(robot.changed(k, 1.0, 0.0), filters, late) for k in (0.8, 1.2))
    third, free = growth(robot, filters, (3,)), growth(undamped(robot), filters, late)
    print(
        f"it decays at {-growth(robot, filters, late):.3f} 1/s or faster with none, one and two "
        f"samples of delay, at {-soft:.3f} and {-stiff:.3f} with 20 % less and more EI; a third "
        f"sample is too much ({third:+.1f}), and so are beams without damping ({free:+.1f})"
    )
    small = replace(robot, parameters=replace(robot.parameters, I_m2=0.001))
    print(f"with 0.001 it grows at {growth(small, filters, (1,)):.0f} 1/s")
    bare = replace(robot, parameters=replace(robot.parameters, I_m2=0.0))
    found = []
    for kd in DESIGNED:
        joint2 = textbook_pid(kp=kd, ki=0.0, kd=kd, period=PERIOD, filter_time=0.003)
        found.append(growth(bare, (filters[0], joint2), (1,)))
    held = "hold with" if found[0] <= 0 else f"grow at {found[0]:.1f} 1/s with"
    print(
        f"{held} a gain kd of {DESIGNED[0]:g} N m s/rad and grow with {DESIGNED[1]:g} at "
        f"{found[1]:.1f}, with {DESIGNED[2]:g} at {found[2]:.0f} 1/s"
    )


if __name__ == "__main__":
    main()
