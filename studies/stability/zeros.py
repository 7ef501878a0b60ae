"""Is the slow pole of our loops the mirrored tip's zero? Poles beside it, at several gains.

>>> zero_rows(Parameters(), 1.5, [TUNED["line"]], LoopOptions(), draws=2000, seed=1)

The zero is the motion in which neither error moves (`flexsim.linear.zeros`). High gain drives a
pole onto it, the nearer the higher, and in the pole's motion the second error gets as small. A PD
of little gain is there to show where that pole is without.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from controllers import textbook_pid
from flexsim.arm.parameters import Parameters
from flexsim.linear.exact_loop import exact_growth, exact_plant, exact_sampled
from flexsim.linear.loop_poles import LinearLoop, LoopOptions
from flexsim.linear.zeros import held_motions
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.control.stacking import stack
from studies.stability.maps import draw
from studies.stability.rows import ZeroRow
from studies.tuning.found import AnyController, label_of, period_of

FACTORS = (0.3, 1.0, 3.0)  # of both gains
SHOWN = 3  # stable draws of Table 1
PD_GAINS = ((50.0, 8.0), (1.0, 0.1))  # [N m/rad], [N m s/rad] of both joints


def zero_rows(
    parameters: Parameters,
    theta2: float,
    devised: Sequence[AnyController],
    options: LoopOptions,
    draws: int,
    seed: int,
) -> list[ZeroRow]:
    """Return the pole nearest to the zero, controllers by controllers.

    Args:
        parameters: the robot. theta2: pose [rad].
        devised: controllers of loops that mirror the tip, each at every factor.
        options: of the loop. draws: of Table 1, of which the first stable ones are shown.
        seed: of the draws.
    """
    periods = (options.period, *map(period_of, devised))
    every = {
        period: exact_sampled(parameters, theta2, replace(options, period=period))
        for period in dict.fromkeys(periods)
    }
    sampled = every[options.period]
    zero = complex(held_motions(exact_plant(parameters).linearised(theta2), parameters.reach)[0])
    rows = []
    for name, factor, controllers, period in _candidates(devised, options.period):
        b, C, D = (factor * part for part in (controllers.b, controllers.C, controllers.D))
        loop = LinearLoop(every[period], controllers._replace(b=b, C=C, D=D))
        rows.append(_row(name, factor, loop, zero, parameters.reach))
    if draws:
        drawn = stack(draw(draws, np.random.default_rng(seed)), options.period)
        for i in np.flatnonzero(exact_growth([sampled], drawn) <= 0)[:SHOWN]:
            loop = LinearLoop(sampled, drawn.chosen(slice(i, i + 1)))
            rows.append(_row(f"draw {i + 1} of Table 1", 1.0, loop, zero, parameters.reach))
    return rows


def _candidates(
    devised: Sequence[AnyController], period: float
) -> Iterator[tuple[str, float, Controllers, float]]:
    """Give name, factor, controllers and control period [s]."""
    for each in devised:
        own = period_of(each)
        for factor in FACTORS:
            yield label_of(each), factor, stack([each], own), own
    pair = tuple(textbook_pid(k, 0.0, d, period) for k, d in PD_GAINS)
    for factor in (1.0, 10.0):
        yield "PD of little gain", factor, stack([pair], period), period


def _row(name: str, factor: float, loop: LinearLoop, zero: complex, reach: float) -> ZeroRow:
    """Return one line: the pole nearest to the zero, and what the second error sees of it."""
    values, vectors = np.linalg.eig(loop.matrix)
    moving = np.abs(values) > 0  # a sample's delay has poles at 0
    rates = np.log(values[moving].astype(complex)) / loop.sampled.period
    nearest = int(np.argmin(np.abs(rates - zero)))
    measured = loop.sampled.C @ vectors[: len(loop.sampled.A), moving][:, nearest]
    return ZeroRow(
        controllers=name,
        factor=factor,
        growth=loop.growth_rate,
        zero_decay=-zero.real,
        zero_hz=zero.imag / (2 * math.pi),
        pole_decay=-float(rates[nearest].real),
        pole_hz=float(rates[nearest].imag) / (2 * math.pi),
        apart=float(np.abs(rates[nearest] - zero)),
        seen=float(reach * np.abs(measured[1]) / np.abs(measured[2])),
    )
