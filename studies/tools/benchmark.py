"""What does a simulated millisecond cost? Every loop timed in turn, in one run, side by side.

    >>> run(BenchmarkConfig(rounds=2)).us_per_ms["chain_50"]

Figures are the least over the rounds of microseconds per simulated millisecond and core. Times
of a machine mean little; the ratios between rows of one run are what to quote.

All loops are ideal and undamped: no friction but F, no limit or delay, zeta = 0; three assumed
modes, a chain of 6, RK4 at 1 ms (a file has its own). `bare_mj_step` steps the chain's file as it
is, without a loop around it; `c_loop` is the loop of `assumed_modes_1` in C (`c_loop.c`).
`measured_50` is `assumed_modes_50` with its runs' figures of merit; `converged_10` has five modes
and a quarter of the step, as a run that is converged.

The tuning budget is that of section 3.2: 50 + 99 x 44 simulations of 5 s. Whole generations are
timed in the same rounds, on all threads: 44 individuals near the tuned one, so that all run to the
end, their filters built, one compiled call. What costs least is divided by
(simulations x cost per simulation / threads), with that cost

- `ratio`: of the plain population on one thread, such as `assumed_modes_50`;
- `ratio_threaded`: of the same population on all threads, wall time x threads.

The first includes what threads cost each other in memory, cache and clock rate, the second only
what tuning adds to simulating. Breeding and writing a generation down are left out: a millisecond.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from flexsim.arm.parameters import Parameters, paper
from flexsim.errors import ModelError, ParameterError
from flexsim.loop.runs import thread_count
from flexsim.plants.base import Plant
from flexsim.plants.chain_plant import ChainPlant, ClosedChainPlant
from flexsim.plants.modes_plant import AssumedModesPlant
from studies.core.carry_out import Question
from studies.core.options import RobotOptions
from studies.core.table import Column, Table
from studies.core.timing import least_cost
from studies.tools.timed_loops import (
    BRIEF,
    PAPERS,
    WHOLE,
    Run,
    bare_run,
    c_run,
    closed_loop_run,
    generation_run,
)

POPULATION = 50  # of the genetic algorithm, section 3.2
SCALED_MODES = (1, 2, 3, 5)
SCALED_SEGMENTS = (4, 6, 8, 10)
BARE = "bare_mj_step"
CONVERGED_MODES, CONVERGED_STEPS = 5, 4  # assumed modes, physics steps for one of the plain plant
CONVERGED = 10  # runs
GOALS = (  # a loop, what it is held against, how much of that it may cost at most
    ("closed_chain_1", BARE, 0.2),
    ("closed_chain_50", BARE, 0.2),
    ("chain_1", BARE, 0.92),
    ("chain_50", BARE, 0.92),
    ("assumed_modes_1", "c_loop", 1.2),
    ("measured_50", "assumed_modes_50", 1.4),
    ("measured_converged_10", "converged_10", 1.1),
)


@dataclass(frozen=True)
class BenchmarkConfig(RobotOptions):
    """Time the closed loops beside bare mj_steps, the same loop in C and one in Python."""

    robot: Parameters = field(default_factory=paper)
    """The robot, unless --mjcf gives a file; undamped unless told otherwise."""
    rounds: int = 5
    """How often each loop is timed, in turn; the least time counts."""
    seconds: float = 2.0
    """Simulated time of each population's run [s], up to 5."""
    json: bool = False
    """Print one JSON object instead of tables."""


@dataclass(frozen=True)
class BenchmarkResult:
    """Microseconds per simulated millisecond and core, by loop, by plant size and by threads.

    A loop that could not be timed is None, and `notes` say why. `c_by_modes` is of the loop in C.
    `tuning_budget` has, by plant, the paper's number of simulations, what they take on all threads
    [s], and the two ratios of the module's docstring.
    """

    us_per_ms: dict[str, float | None]
    by_modes: dict[int, float]
    by_segments: dict[int, float]
    by_threads: dict[int, dict[str, float]]
    tuning_budget: dict[str, dict[str, float]] = field(default_factory=dict)
    c_by_modes: dict[int, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def ratio(self, loop: str, other: str) -> float | None:
        """Return what a loop costs over what another does."""
        one, two = self.us_per_ms.get(loop), self.us_per_ms.get(other)
        return None if one is None or two is None else one / two

    @property
    def ratios(self) -> dict[str, float | None]:
        """The ratios that have a goal, as 'chain_1 / bare_mj_step'."""
        return {f"{loop} / {other}": self.ratio(loop, other) for loop, other, _ in GOALS}


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
        for plant in (name.removesuffix(" generation") for name in costs)
        if f"{plant} generation" in costs
    }


def sized_loops(p: Parameters, seconds: float) -> dict[str, Run]:
    """Return loops by size: 'n3' of three assumed modes, 'c3' in C, 'N6' of six segments."""
    sized = {}
    for n in SCALED_MODES:
        plant = AssumedModesPlant(p, n)
        sized[f"n{n}"] = closed_loop_run(plant, 10, seconds)
        in_c, _ = c_run(plant)
        if in_c is not None:
            sized[f"c{n}"] = in_c
    for n in SCALED_SEGMENTS:
        sized[f"N{n}"] = closed_loop_run(ChainPlant.designed(p, n), 1, seconds)
    return sized


def plants_of(config: BenchmarkConfig) -> tuple[dict[str, Plant], list[str]]:
    """Return the plants by their keys, undamped without a file; and why one is missing."""
    robot = config.robot_of()
    modes, chain = robot.both()
    plants: dict[str, Plant] = {"assumed_modes": modes, "chain": chain}
    try:
        plants["closed_chain"] = ClosedChainPlant(chain.parameters, chain.chain)
    except ModelError as error:
        return plants, [f"closed_chain is not timed: {error}"]
    return plants, []


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
    plants, notes = plants_of(config)
    modes, chain = plants["assumed_modes"], plants["chain"]
    assert isinstance(modes, AssumedModesPlant) and isinstance(chain, ChainPlant)
    loops: dict[str, Run | None] = {}
    for name, plant in plants.items():
        loops[f"{name}_1"] = closed_loop_run(plant, 1, BRIEF if plant is chain else WHOLE)
        loops[f"{name}_50"] = closed_loop_run(plant, POPULATION, s)
    fine = replace(modes, modes=CONVERGED_MODES, step=modes.step / CONVERGED_STEPS)
    loops["measured_50"] = closed_loop_run(modes, POPULATION, s, measured=True)
    loops["converged_10"] = closed_loop_run(fine, CONVERGED, s)
    loops["measured_converged_10"] = closed_loop_run(fine, CONVERGED, s, measured=True)
    loops[BARE] = bare_run(chain)
    loops["c_loop"], missing = c_run(modes)
    loops["python_loop"] = bare_run(chain, in_python=True)
    threads = range(1, thread_count() + 1)
    tuning = {}
    for name, plant in plants.items():
        tuning[f"{name} generation"] = generation_run(plant)
        for count in threads:
            tuning[f"{name} {count}"] = closed_loop_run(plant, POPULATION, s, count)
    timed = {name: loop for name, loop in loops.items() if loop is not None}
    costs = least_cost(timed | tuning, config.rounds)
    by_size = least_cost({} if config.mjcf else sized_loops(modes.parameters, s), config.rounds)
    return BenchmarkResult(
        us_per_ms={name: costs.get(name) for name in loops},
        by_modes={n: by_size[f"n{n}"] for n in SCALED_MODES if f"n{n}" in by_size},
        by_segments={n: by_size[f"N{n}"] for n in SCALED_SEGMENTS if f"N{n}" in by_size},
        by_threads={
            count: {plant: costs[f"{plant} {count}"] * count for plant in plants}
            for count in threads
        },
        tuning_budget=tuning_budget(costs, thread_count()),
        c_by_modes={n: by_size[f"c{n}"] for n in SCALED_MODES if f"c{n}" in by_size},
        notes=tuple(each for each in (*notes, missing) if each),
    )


@dataclass(frozen=True)
class CostRow:
    """A loop's microseconds per simulated ms, as a share of bare `mj_step`s and of its goal."""

    loop: str
    us: float | None
    share: float | None
    goal: str = ""


@dataclass(frozen=True)
class BudgetRow:
    """The paper's budget of simulations on a plant, as `tuning_budget` has it."""

    plant: str
    budget: dict[str, float]


COSTS = (
    Column("loop"),
    Column("us", form=".3f"),
    Column("share", "of bare mj_step", form=".3f"),
    Column("goal"),
)
BUDGETS = (
    Column("plant"),
    Column("simulations", form=".0f"),
    Column("seconds", "all threads", "s", ".1f"),
    Column("ratio", "of one thread's\ncost / threads", "", ".3f"),
    Column("ratio_threaded", "of all\nthreads' cost", "", ".3f"),
)


def goals_of(result: BenchmarkResult) -> dict[str, str]:
    """Return by loop how much it may cost of what it is held against, and costs of C."""
    spoken = {}
    for loop, other, most in GOALS:
        ratio = result.ratio(loop, other)
        if ratio is not None:
            own = "" if other == BARE else f"{ratio:.3f} of {other}, "
            spoken[loop] = f"{own}{most:g} at most"
    return spoken


def tables(result: BenchmarkResult) -> list[Table]:
    """Return the costs of the loops, and of tuning."""
    goals = goals_of(result)
    costs = [
        CostRow(loop, us, result.ratio(loop, BARE), goals.get(loop, ""))
        for loop, us in result.us_per_ms.items()
    ]
    budgets = [
        BudgetRow(plant.replace("_", " "), each) for plant, each in result.tuning_budget.items()
    ]
    return [
        Table(costs, COSTS, "Cost of a simulated millisecond, per core; ideal, undamped"),
        Table(budgets, BUDGETS, f"Tuning, simulations of {WHOLE:g} s"),
    ]


def verdict(result: BenchmarkResult) -> str:
    """Return in words how cost goes with size and threads, and what was not timed."""
    lines = list(result.notes)
    for what, costs, form in (
        ("Assumed modes, us by number of modes", result.by_modes, "n = {}: {:.2f}"),
        ("The same in C", result.c_by_modes, "n = {}: {:.2f}"),
        ("Chain, us by segments (0.5 ms above N = 8)", result.by_segments, "N = {}: {:.1f}"),
    ):
        if costs:
            each = ", ".join(form.format(size, cost) for size, cost in costs.items())
            lines.append(f"{what}: {each}")
    for count, by_plant in result.by_threads.items():
        each = ", ".join(f"{key.replace('_', ' ')} {cost:.2f}" for key, cost in by_plant.items())
        lines.append(f"{count} thread(s), {POPULATION} controllers, us per core: {each}")
    return "\n".join([*lines, ""])


def content(result: BenchmarkResult) -> dict[str, Any]:
    """Return what `--json` prints."""
    return vars(result) | {"ratios": result.ratios}


command = Question(run, tables, verdict, content)
