"""What does a simulated millisecond cost? Every loop timed in turn, in one run, side by side.

    >>> run(BenchmarkConfig(rounds=2)).us_per_ms["chain_50"]

Figures are the least over the rounds of microseconds per simulated millisecond and core. Times
of a machine mean little; the ratios between rows of one run are what to quote.

The tuning budget is that of section 3.2: 50 + 99 x 44 simulations of 5 s. Whole generations are
timed in the same rounds, on all threads: 44 individuals near the tuned one, so that all run to the
end, their filters built, one compiled call. What costs least is divided by
(simulations x cost per simulation / threads), with that cost

- `ratio`: of the plain population on one thread, `assumed_modes_50` or `chain_50`;
- `ratio_threaded`: of the same population on all threads, wall time x threads.

The first includes what threads cost each other in memory, cache and clock rate, the second only
what tuning adds to simulating. Breeding and writing a generation down are left out: a millisecond.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import mujoco
import numpy as np

from controllers import TUNED, Controller
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.runs import evaluate, thread_count
from flexsim.loop.settings import setting
from flexsim.loop.trajectories import Reference, reference, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.jit import jit
from flexsim.numerics.mujoco_c import mj_step, quiet_warnings
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from flexsim.plants.mujoco_steps import Workspaces
from studies.core.carry_out import Question
from studies.core.options import RobotOptions
from studies.core.paper import PLANT_KEYS
from studies.core.table import Column, Table
from studies.core.timing import least_cost
from studies.tuning.genetic import GeneticSettings
from studies.tuning.individuals import MS_PER_S, ControllerDesign
from studies.tuning.problem import Problem

WHOLE = 5.0  # [s] of the trajectory, for a single controller
POPULATION = 50  # of the genetic algorithm, section 3.2
SCALED_MODES = (1, 2, 3, 5)
SCALED_SEGMENTS = (4, 6, 8, 10)
TASK = "circle"  # trajectory and controllers of the closed loops
PAPERS = GeneticSettings()  # budget of the tuning
BARE_RATES = (0.5, 0.3)  # [rad/s] of the joints where nothing drives them
SPREAD = 1e-3  # relative, of the individuals around the tuned one


@dataclass(frozen=True)
class BenchmarkConfig(RobotOptions):
    """Time the closed loops beside a bare mj_step loop and a Python one."""

    rounds: int = 5
    """How often each loop is timed, in turn; the least time counts."""
    seconds: float = 2.0
    """Simulated time of each population's run [s], up to 5."""
    json: bool = False
    """Print one JSON object instead of tables."""


@dataclass(frozen=True)
class BenchmarkResult:
    """Microseconds per simulated millisecond and core, by loop, by plant size and by threads.

    `tuning_budget` has, by plant, the paper's number of simulations, what they take on all threads
    [s], and the two ratios of the module's docstring.
    """

    us_per_ms: dict[str, float]
    by_modes: dict[int, float]
    by_segments: dict[int, float]
    by_threads: dict[int, dict[str, float]]
    tuning_budget: dict[str, dict[str, float]] = field(default_factory=dict)


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
    plant: Plant, population: int, seconds: float, threads: int | None = 1
) -> Callable[[], float]:
    """Return a function that runs the closed loop and gives simulated milliseconds."""
    ref = started(plant.parameters, seconds)
    filters = [TUNED[TASK].filters(PERIOD)] * population

    def once() -> float:
        outcome = evaluate(plant, setting("simulink"), ref, filters, threads=threads)
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


def generation_run(plant: Plant, seconds: float = WHOLE) -> Callable[[], float]:
    """Return a function that evaluates a new generation and gives simulated milliseconds."""
    ref, center = started(plant.parameters, seconds), as_drawn(TUNED[TASK])
    problem = Problem(ControllerDesign(), ((plant, setting("simulink")),), ref)
    size, rng = PAPERS.population - PAPERS.survivors, np.random.default_rng(1)

    def once() -> float:
        population = center * (1 + SPREAD * rng.standard_normal((size, len(center))))
        assert np.isfinite(problem(population).indices).all()  # none may end early
        return 1e3 * ref.time[-1] * size

    return once


def tuning_budget(costs: dict[str, float], threads: int) -> dict[str, dict[str, float]]:
    """Return what the paper's budget takes by plant, see the module's docstring.

    Args:
        costs: wall time [us] per simulated ms of the loops '{plant}_50' on one thread, and
            '{plant} {threads}' and '{plant} generation' on all of them. threads: how many.
    """
    simulated = 1e3 * WHOLE * PAPERS.budget  # [ms]
    return {
        plant: {
            "simulations": PAPERS.budget,
            "seconds": 1e-6 * simulated * costs[f"{plant} generation"],
            "ratio": costs[f"{plant} generation"] * threads / costs[f"{plant}_50"],
            "ratio_threaded": costs[f"{plant} generation"] / costs[f"{plant} {threads}"],
        }
        for plant in PLANT_KEYS
    }


def bare_run(chain: ChainPlant, in_python: bool) -> Callable[[], float]:
    """Return a function that only steps the same MJCF, compiled or from Python."""
    model = chain.chain.model
    workspace = Workspaces(model, 1)
    data = workspace.data[0]
    steps = round((1 if in_python else 5) / chain.step)
    model_address, data_address = model._address, int(workspace.addresses[0])

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


def sized_loops(p: Parameters, seconds: float) -> dict[str, Callable[[], float]]:
    """Return loops by size, 'n3' of three assumed modes, 'N6' of six segments."""
    sized = {f"n{n}": closed_loop_run(AssumedModesPlant(p, n), 10, seconds) for n in SCALED_MODES}
    for n in SCALED_SEGMENTS:
        sized[f"N{n}"] = closed_loop_run(ChainPlant.designed(p, n), 1, seconds)
    return sized


def run(config: BenchmarkConfig) -> BenchmarkResult:
    """Return the costs.

    Raises:
        ParameterError: fewer than one round, or no simulated time.
    """
    if config.rounds < 1:
        raise ParameterError(f"rounds is {config.rounds}; give 1 or more")
    if not 0.01 <= config.seconds <= 5:
        raise ParameterError(f"seconds is {config.seconds}; give 0.01 to 5")
    s = config.seconds
    robot = config.robot_of()
    modes, chain = robot.both()
    loops = {
        "assumed_modes_1": closed_loop_run(modes, 1, WHOLE),
        "assumed_modes_50": closed_loop_run(modes, POPULATION, s),
        "chain_1": closed_loop_run(chain, 1, WHOLE),
        "chain_50": closed_loop_run(chain, POPULATION, s),
        "bare_mj_step": bare_run(chain, in_python=False),
        "python_loop": bare_run(chain, in_python=True),
    }
    threads = range(1, thread_count() + 1)
    plants: tuple[Plant, ...] = (modes, chain)
    tuning = {}
    for name, plant in zip(PLANT_KEYS, plants, strict=True):
        tuning[f"{name} generation"] = generation_run(plant)
        for count in threads:
            tuning[f"{name} {count}"] = closed_loop_run(plant, POPULATION, s, count)
    costs = least_cost(loops | tuning, config.rounds)
    by_size = least_cost({} if robot.file else sized_loops(robot.parameters, s), config.rounds)
    return BenchmarkResult(
        us_per_ms={name: costs[name] for name in loops},
        by_modes={n: by_size[f"n{n}"] for n in SCALED_MODES if f"n{n}" in by_size},
        by_segments={n: by_size[f"N{n}"] for n in SCALED_SEGMENTS if f"N{n}" in by_size},
        by_threads={
            count: {plant: costs[f"{plant} {count}"] * count for plant in PLANT_KEYS}
            for count in threads
        },
        tuning_budget=tuning_budget(costs, thread_count()),
    )


@dataclass(frozen=True)
class CostRow:
    """A loop's microseconds per simulated millisecond, and as a share of bare `mj_step`s."""

    loop: str
    us: float
    share: float


@dataclass(frozen=True)
class BudgetRow:
    """The paper's budget of simulations on a plant, as `tuning_budget` has it."""

    plant: str
    budget: dict[str, float]


COSTS = (Column("loop"), Column("us", form=".3f"), Column("share", "of bare mj_step", form=".3f"))
BUDGETS = (
    Column("plant"),
    Column("simulations", form=".0f"),
    Column("seconds", "all threads", "s", ".1f"),
    Column("ratio", "of one thread's\ncost / threads", "", ".3f"),
    Column("ratio_threaded", "of all\nthreads' cost", "", ".3f"),
)


def tables(result: BenchmarkResult) -> list[Table]:
    """Return the costs of the loops, and of tuning."""
    bare = result.us_per_ms["bare_mj_step"]
    costs = [CostRow(loop, us, us / bare) for loop, us in result.us_per_ms.items()]
    budgets = [
        BudgetRow(plant.replace("_", " "), each) for plant, each in result.tuning_budget.items()
    ]
    return [
        Table(costs, COSTS, "Cost of a simulated millisecond, per core"),
        Table(budgets, BUDGETS, f"Tuning, simulations of {WHOLE:g} s"),
    ]


def verdict(result: BenchmarkResult) -> str:
    """Return in words how cost goes with size and threads."""
    lines = []
    if result.by_modes:
        modes = ", ".join(f"n = {n}: {cost:.2f}" for n, cost in result.by_modes.items())
        chains = ", ".join(f"N = {n}: {cost:.1f}" for n, cost in result.by_segments.items())
        lines += [
            f"Assumed modes, us by number of modes: {modes}",
            f"Chain, us by segments (steps of 0.5 ms above N = 8): {chains}",
        ]
    for count, costs in result.by_threads.items():
        lines.append(
            f"{count} thread(s), {POPULATION} controllers, us per core: assumed modes "
            f"{costs['assumed_modes']:.2f}, chain {costs['chain']:.1f}"
        )
    return "\n".join([*lines, ""])


command = Question(run, tables, verdict, vars)
