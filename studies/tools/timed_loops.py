"""The loops that `flexsim benchmark` times: functions that run, and give simulated milliseconds.

    >>> least_cost({"chain_1": closed_loop_run(chain, 1, 5.0), "bare": bare_run(chain)}, rounds=3)

Closed loops are the circle's, of its tuned controllers, on the robot as it is with ideal hardware
and no friction but F: all run to the end.
"""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np

from controllers import TUNED_IDEAL, Controller
from flexsim.arm.parameters import Parameters
from flexsim.loop.control.stacking import stack
from flexsim.loop.measuring import NO_YARDSTICK, yardstick
from flexsim.loop.populations import Stage, run_population
from flexsim.loop.runs import evaluate, loop_of
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import Reference, reference, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.jit import jit
from flexsim.numerics.mujoco_c import mj_step, quiet_warnings
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from studies.tools.c_loop import compiled_c
from studies.tuning.genetic import GeneticSettings
from studies.tuning.individuals import MS_PER_S, ControllerDesign
from studies.tuning.problem import Problem

WHOLE = 5.0  # [s] of the trajectory, for a single controller
BRIEF = 0.5  # [s] of what costs most: a few ms of a clock, so that some go undisturbed
TASK = "circle"  # trajectory and controllers of the closed loops
IDEAL = "none"  # setting: no friction but F, no limit
PAPERS = GeneticSettings()  # budget of the tuning
BARE_RATES = (0.5, 0.3)  # [rad/s] of the joints where nothing drives them
SPREAD = 1e-3  # relative, of the individuals around the tuned one
SAME = 1e-9  # relative to 1 rad and 1 m: how far the loop in C may end from the compiled one

Run = Callable[[], float]


@jit
def _bare(model: int, data: int, steps: int) -> None:
    for _ in range(steps):
        mj_step(model, data)


def started(robot: Parameters, seconds: float) -> Reference:
    """Return the task's reference up to a time [s]."""
    whole = reference(trajectory(TASK), robot)
    kept = whole.time <= seconds
    return Reference(whole.time[kept], whole.tip[kept], whole.joint[kept])


def closed_loop_run(
    plant: Plant,
    population: int,
    seconds: float,
    threads: int | None = 1,
    measured: bool = False,
) -> Run:
    """Return a function that runs the closed loop and gives simulated milliseconds.

    Args:
        measured: whether figures of merit are taken, too, over a hold of half the time.
    """
    ref = started(plant.parameters, seconds)
    filters = stack([TUNED_IDEAL[TASK].filters(PERIOD)] * population, PERIOD)
    friction, loop = setting(IDEAL).friction.numbers(), loop_of(plant, ref)
    start = plant.rest_state(ref.joint[0])
    yard = yardstick(ref, seconds / 2) if measured else NO_YARDSTICK
    stage = Stage(plant, friction, loop, start, yard=yard)

    def once() -> float:
        outcome = run_population(stage, filters, threads=threads)
        assert np.isnan(outcome.diverged).all()  # a run cut short would look fast
        return 1e3 * ref.time[-1] * population

    return once


def as_drawn(controller: Controller) -> Array:
    """Return the ten parameters (10,) as a tuner draws them, gains for time in milliseconds."""
    drawn: list[float] = []
    for gains in (controller.joint1, controller.joint2):
        for k, nu in ((gains.k1, gains.nu1 or 0.0), (gains.k2, gains.nu2 or 0.0)):
            drawn += [k * MS_PER_S**nu, nu]
        drawn.append(gains.k3)
    return np.array(drawn)


def generation_run(plant: Plant, seconds: float = WHOLE) -> Run:
    """Return a function that evaluates a new generation and gives simulated milliseconds."""
    ref, center = started(plant.parameters, seconds), as_drawn(TUNED_IDEAL[TASK])
    problem = Problem(ControllerDesign(), ((plant, setting(IDEAL)),), ref)
    size, rng = PAPERS.population - PAPERS.survivors, np.random.default_rng(1)

    def once() -> float:
        population = center * (1 + SPREAD * rng.standard_normal((size, len(center))))
        assert np.isfinite(problem(population).indices).all()  # none may end early
        return 1e3 * ref.time[-1] * size

    return once


def bare_run(chain: ChainPlant, in_python: bool = False) -> Run:
    """Return a function that only steps the same MJCF, compiled or from Python."""
    model = chain.chain.model
    data = mujoco.MjData(model)
    steps = round(BRIEF / chain.step)
    model_address, data_address = model._address, data._address

    def once() -> float:
        mujoco.mj_resetData(model, data)
        data.qvel[:2] = BARE_RATES
        if in_python:
            for _ in range(steps):
                mujoco.mj_step(model, data)
        else:
            with quiet_warnings():
                _bare(model_address, data_address, steps)
        return 1e3 * chain.step * steps

    return once


def c_run(plant: AssumedModesPlant) -> tuple[Run | None, str]:
    """Return a function that runs the closed loop in C, as `closed_loop_run` of one controller.

    Returns:
        None without a C compiler, or where what it makes moves otherwise; and a note that says so.
    """
    ref, filters = started(plant.parameters, WHOLE), TUNED_IDEAL[TASK].filters(PERIOD)
    loop = compiled_c(plant, ref, filters)
    if loop is None:
        return None, "no C compiler (cc) here: c_loop is not timed"
    last = len(ref.time) - 1
    loop()
    ours = evaluate(plant, setting(IDEAL), ref, [filters], stride=last, threads=1).states[0, -1]
    apart = float(np.abs(loop.state - ours).max())
    if not apart <= SAME:
        return None, f"the loop in C ends {apart:.1g} from the compiled one: c_loop is not timed"

    def once() -> float:
        loop()
        return 1e3 * ref.time[-1]

    return once, ""
