"""Ten terms or eleven taps? Tables and numbers of controllers/README.md.

python docs/made/taps.py gains       # of the filters at rest
python docs/made/taps.py table-2     # envelopes of Table 2's controllers
python docs/made/taps.py ours        # of our own, in the ideal loop
"""

from __future__ import annotations

import numpy as np
from asked import numbers, row, run_part

from controllers import TABLE_2, TUNED_IDEAL, fractional_pid
from flexsim import Robot
from flexsim.arm.parameters import paper
from flexsim.linear.delay_margin import delay_margin
from flexsim.linear.exact_loop import exact_growth, exact_loops
from flexsim.linear.reserves import reserves
from flexsim.loop.control.stacking import stack
from flexsim.loop.runs import measure
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import reference, trajectory
from studies.core.evidence.digits import with_interval
from studies.core.evidence.repeats import medians, perturbed
from studies.reconstruct.reconstruct import FIGURES
from studies.reconstruct.variants import variants

TERMS = (8, 9, 10, 11, 12)  # p of (2)
PERIOD = 1e-3  # [s]
GAINS = (  # rows of the table: joint, figure, what it is called
    (0, "figure-3", "C_1 of Figure 3, ν -3.63 [N m/rad]"),
    (0, "figure-4", "C_1 of Figure 4, ν -3.54"),
    (0, "figure-5", "C_1 of Figure 5, ν 0.715"),
    (1, "figure-3", "C_2 of Figure 3, ν 0.298"),
    (1, "figure-4", "C_2 of Figure 4, ν -0.498 and 0.0101"),
    (1, "figure-5", "C_2 of Figure 5, ν -0.114"),
)


def gains() -> None:
    """Print the sums of the filters' taps."""
    for joint, figure, title in GAINS:
        own = TABLE_2[figure]
        found = []
        for p in TERMS:
            b, a = fractional_pid((own.joint1, own.joint2)[joint], PERIOD, terms=p)
            found.append(float(b.sum() / a.sum()))
        row(title, *map(short, found))


def short(gain: float) -> str:
    """Return a gain as the table has it."""
    if abs(gain) >= 1e5:
        return f"{gain:.2e}".replace("e+0", "e")
    text = f"{gain:.3g}" if abs(gain) >= 100 else f"{gain:.1f}"
    text = f"{gain:.0f}" if abs(gain) >= 1000 else text
    return f"**{text}**" if gain < 0 else text


def of_table_2() -> None:
    """Print envelopes as reconstructed, by taps, the figures side by side."""
    loop = next(iter(variants()))
    plant = loop.plants(Robot(paper()), 3, None)[0]
    cells: dict[int, list[str]] = {p: [] for p in TERMS}
    for shape, column, _ in FIGURES.values():
        path = reference(loop.trajectory(shape), plant.parameters, PERIOD)
        own = perturbed(TABLE_2[column], 40, np.random.default_rng(1))
        for p in TERMS:
            filters = [each.filters(PERIOD, terms=p) for each in own]
            found = medians(measure(plant, loop.setting, path, filters))
            cells[p].append(envelope(found))
    for p in TERMS:
        name = f"{p + 1} taps"
        row(f"**{name}**" if p == 10 else name, *cells[p])


def envelope(found: object) -> str:
    """Return an envelope with its interval [mm], or that all runs diverged."""
    ends = [getattr(found, f"envelope{end}") for end in ("", "_low", "_high")]
    if ends[0] is None or not np.isfinite(ends[0]):
        return "all diverge"
    return with_interval(*ends, scale=1e3)


def ours() -> None:
    """Print what ten taps instead of eleven do to our own of the ideal loop."""
    robot = Robot()
    shown: dict[str, dict[int, list[float]]] = {}
    grows = diverged = 0
    margins: dict[int, list[float]] = {9: [], 10: []}
    delays: dict[int, list[float]] = {9: [], 10: []}
    loops = exact_loops(robot.parameters)
    for name in ("simulink", "none"):
        shown[name] = {p: [] for p in TERMS}
        for shape in ("line", "two-loop", "circle"):
            own = setting(name)
            plant = robot.modes_plant(own)
            path = reference(trajectory(shape), plant.parameters, PERIOD)
            runs = perturbed(TUNED_IDEAL[shape], 20, np.random.default_rng(1))
            for p in TERMS:
                filters = [each.filters(PERIOD, terms=p) for each in runs]
                found = measure(plant, own, path, filters)
                diverged += sum(bool(each["diverged"]) for each in found)
                shown[name][p].append(1e3 * medians(found).envelope)
    for shape in ("line", "two-loop", "circle"):
        for p in TERMS:
            controller = stack([TUNED_IDEAL[shape].filters(PERIOD, terms=p)], PERIOD)
            grows += bool(exact_growth(loops, controller)[0] > 0)
            if p in margins:
                margins[p].append(reserves(loops, controller).gain_margin)
                delays[p].append(1e3 * delay_margin(loops, controller))
    rows = shown["simulink"]
    pairs = [
        f"{rows[9][i]:.2f} instead of {rows[10][i]:.2f}{unit}"
        for i, unit in enumerate((" mm (line)", " (two-loop)", " (circle)"))
    ]
    print(f"envelopes under simulink {', '.join(pairs)}")
    rows = shown["none"]
    pairs = [f"{rows[9][i]:.2f} instead of {rows[10][i]:.2f}" for i in range(3)]
    print(f"without friction {', '.join(pairs)}")
    print(
        f"the gain margin falls from {numbers(margins[10], '.2f')} to "
        f"{numbers(margins[9], '.2f')}, the delay that is borne from "
        f"{numbers(delays[10], '.2f')} ms to {numbers(delays[9], '.2f')} ms"
    )
    if diverged or grows:
        print(f"{diverged} runs diverge, {grows} loops grow")


if __name__ == "__main__":
    run_part({"gains": gains, "table-2": of_table_2, "ours": ours})
