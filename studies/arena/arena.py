"""Are fractional controllers better on a flexible arm? `flexsim arena`.

>>> result = run(ArenaConfig(quick=True))
>>> result.verdicts[0].verdict

Every class is tuned with the same algorithm, number of simulations, seeds, ranges and allowed
effort, on five modes with the bench's hardware; then what was found runs under other conditions and
on other plants, and nobody is told. A run that was interrupted goes on when the same command is
given again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.progress import Progress

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.linear.loop_poles import LoopOptions as LinearOptions
from flexsim.loop.control.stacking import stack
from flexsim.loop.hardware import HARDWARE
from flexsim.loop.runs import thread_count
from flexsim.loop.settings import DEFAULT_SETTING, Setting, setting
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from flexsim.robot import Robot
from studies.arena.conditions import (
    CONDITIONS,
    CORE,
    NOMINAL,
    PAYLOADS,
    Condition,
    Tuned,
)
from studies.arena.contestants import CLASSES
from studies.arena.cost import cost_of, seconds_each
from studies.arena.evaluating import evaluated, workshops
from studies.arena.ground import Ground, paths, still
from studies.arena.rows import ArenaResult, FrontRow, TunedRow
from studies.arena.search import (
    CMA,
    DIVERGED,
    GROWTH,
    INDEX,
    OBJECTIVE,
    best_of,
    distribution_of,
    front,
    searched,
)
from studies.arena.search import (
    EFFORT as EFFORT_COLUMN,
)
from studies.arena.showing import report
from studies.arena.showing.answer import answer
from studies.arena.showing.figures import figures
from studies.arena.verdicts.fronts import front_rows
from studies.arena.verdicts.judging import SPILLING, Judge, spilling
from studies.arena.verdicts.loops import LoopNumbers, loop_numbers, margin_row
from studies.arena.verdicts.measures import budget_rows, measure_rows, spill_rows
from studies.core.carry_out import Study
from studies.core.console import console
from studies.core.evidence.kept import Kept, forget, going_on
from studies.core.study_options import (
    Out,
    SeedOptions,
    StudyOptions,
    ThreadOptions,
    check_each_once,
)

TUNED_ON = "assumed-modes:5"
PLANTS = (
    TUNED_ON,
    "closed-chain:6",
    "assumed-modes:8",
    "assumed-modes:12",
    "closed-chain:10",
    "chain:6",
)
SHORT = {"duration": 2.0, "hold": 0.4}  # [s] of quick runs' trajectories
DECIDES = (  # sources that what comes of a run depends on
    "flexsim/**/*.py",
    "controllers/**/*.py",
    "studies/spec/*.py",
    "studies/tuning/*.py",
    *(f"studies/run/{name}.py" for name in ("batches", "columns", "workers")),
    *(
        f"studies/arena/{name}.py"
        for name in ("contestants", "entry", "evaluating", "ground", "search")
    ),
)


SEARCH = "search"  # of fronts: what searches tried
VARIED = ("pid", "oustaloup", "collocated", "lqg")


@dataclass(frozen=True)
class Variant:
    """What else controllers are tuned on, with a few classes and seeds.

    Attributes:
        name: of the tuning. plants, hardware, aid: instead of the core's. tuner: instead of CMA-ES.
        exact: whether what grows on the exact linear loop is rejected.
        classes: that are tuned so, those that were asked for among them.
    """

    name: str
    plants: tuple[str, ...] = (TUNED_ON,)
    hardware: str = "bench"
    aid: str = "plain"
    tuner: str = CMA
    exact: bool = True
    classes: tuple[str, ...] = VARIED


VARIANTS = (
    *(
        Variant(spilling(n), plants=(f"assumed-modes:{n}",), exact=False, classes=tuple(CLASSES))
        for n in SPILLING
    ),
    Variant("genetic", tuner="genetic"),
    Variant("true-tip", aid="true-tip"),
    Variant("feedforward", aid="feedforward"),
    Variant("worst plant", plants=(TUNED_ON, "closed-chain:6")),
    Variant("ideal", hardware="ideal"),
)


@dataclass(frozen=True)
class ArenaConfig(ThreadOptions, SeedOptions, StudyOptions):
    """Tune every class of controllers alike, and see what holds under which condition."""

    QUICK: ClassVar = {
        "seeds": 2,
        "simulations": 20,
        "repeats": 1,
        "plants": 2,
        "conditions": 5,
        "twice": 1,
    }

    out: Out = Path("runs/arena")
    quick: bool = False
    """Short trajectories, twenty simulations and two seeds of every class: a first impression."""
    classes: tuple[str, ...] = tuple(CLASSES)
    """Who competes; see the study's README."""
    conditions: tuple[str, ...] = tuple(CONDITIONS)
    """What is other than in the tuning, one thing at a time."""
    plants: tuple[str, ...] = PLANTS
    """On which tuned controllers run; the first one is that of the tuning."""
    seeds: int = 10
    """Searches of every class."""
    simulations: int = 2000
    """Individuals of a search, each on all three trajectories."""
    repeats: int = 3
    """Runs of each case, with gains' fourth digits and noise of their own."""
    twice: int = 3
    """Seeds at most whose search goes on to twice as many individuals, to see its worth."""
    variants: int = 0
    """Seeds of further tunings of four classes: the paper's algorithm, other references, the worst
    of two plants, ideal hardware. And one seed of all classes on 3, 5 and 8 modes with loops that
    may grow."""
    workers: int | None = None
    """Worker processes on this machine instead of threads, for the evaluation."""
    cluster: str | None = None
    """A dask scheduler whose workers run the evaluation, such as tcp://host:8786; this machine
    unless given."""
    dry_run: bool = False
    """Print what it costs on this machine, and do no more."""

    @property
    def its(self) -> Setting:
        """Friction and the bench that all are tuned with."""
        return setting(DEFAULT_SETTING, HARDWARE["bench"])

    @property
    def short(self) -> dict[str, Any]:
        """What trajectories have other than the paper's."""
        return SHORT if self.quick else {}

    @property
    def chosen(self) -> list[Condition]:
        """The conditions asked for."""
        return [CONDITIONS[name] for name in self.conditions]


def seeds_of(config: ArenaConfig, variant: Variant) -> int:
    """Return how many searches of each class a further tuning has: one where all classes do it."""
    return config.variants if variant.exact else min(config.variants, 1)


def _check(config: ArenaConfig) -> None:
    """Refuse what the study cannot be run with.

    Raises:
        ParameterError: an unknown name, a number out of range, a robot's file.
    """
    robot = config.robot_of()
    if robot.given is not None or robot.link1 is not None or robot.parameters != Parameters():
        raise ParameterError(
            "the arena is about the paper's robot, which its controllers are told of; leave out "
            "--mjcf and --robot"
        )
    for what, given, known in (
        ("class", config.classes, tuple(CLASSES)),
        ("condition", config.conditions, tuple(CONDITIONS)),
    ):
        check_each_once(f"{what}es" if what == "class" else what, given)
        for name in given:
            if name not in known:
                raise ParameterError(f"{what} {name!r} is unknown; choose from {', '.join(known)}")
    check_each_once("plants", config.plants)
    for name, least in (
        ("seeds", 1),
        ("simulations", 20),
        ("repeats", 1),
        ("variants", 0),
        ("twice", 0),
    ):
        if getattr(config, name) < least:
            raise ParameterError(f"{name} is {getattr(config, name)}; give {least} or more")
    if config.workers is not None and config.cluster is not None:
        raise ParameterError("--workers and --cluster contradict each other; give one of them")


def run(
    config: ArenaConfig, progress: Progress | None = None, kept: Kept | None = None
) -> ArenaResult:
    """Return what every class comes to.

    Args:
        kept: what was run before, and is not run again; None to run it all.

    Raises:
        ParameterError, ModelError: an unknown name, or a number out of range.
    """
    config = config.asked()
    _check(config)
    result = ArenaResult(config.plants)
    tuned: list[Tuned] = []
    core = Variant(CORE, plants=config.plants[:1])
    ground = _ground(config, core)
    everyone = config.classes
    _tune(config, core, ground, ground, everyone, config.seeds, result, tuned, progress, kept)
    if config.variants:
        for variant in VARIANTS:
            classes = [name for name in config.classes if name in variant.classes]
            its = _ground(config, variant)
            seeds = seeds_of(config, variant)
            _tune(config, variant, its, ground, classes, seeds, result, tuned, progress, kept)
    result.table = evaluated(
        config.chosen,
        tuned,
        config.plants,
        config.repeats,
        config.seed,
        config.short,
        kept=kept,
        threads=config.threads,
        address=config.cluster,
        workers=config.workers,
        ran=_bar(progress, "evaluation", _runs(config, tuned) if progress else 0),
    )
    names = list(ground.trajectories)
    judge = Judge(result.table, dict(zip(names, still(ground), strict=True)), config.seed)
    _judged(result, judge)
    loops = _loops(config, ground, tuned)
    result.margins = [margin_row(name, each, config.seed) for name, each in loops.items()]
    result.verdicts += judge.damping_rows(loops)
    return result


def _judged(result: ArenaResult, judge: Judge) -> None:
    """Add what can be said of all runs."""
    result.scores = judge.score_rows()
    result.verdicts = judge.verdict_rows()
    result.fronts += front_rows(judge)
    result.profiles = judge.profile_rows()
    result.shares = judge.share_rows()
    result.measures = measure_rows(judge)
    result.spills = spill_rows(judge, result.tuned)
    classes = dict.fromkeys(row.contestant for row in result.tuned)
    own = {name: judge.own_reference(name) for name in classes}
    result.budget = budget_rows(result.tuned, result.scores, judge.plants[0], own)


def _ground(config: ArenaConfig, variant: Variant) -> Ground:
    its = setting(DEFAULT_SETTING, HARDWARE[variant.hardware])
    found = paths(**config.short)
    return Ground.of(
        Robot(), variant.plants, its, found, variant.aid, config.threads, variant.exact
    )


def _bar(progress: Progress | None, label: str, total: int) -> Callable[[int], None]:
    """Return what moves a bar on, if there is one."""
    if progress is None:
        return lambda _: None
    bar = progress.add_task(label, total=total)
    return lambda count: progress.advance(bar, count)


def _runs(config: ArenaConfig, tuned: list[Tuned]) -> int:
    """Return how many runs the evaluation has."""
    its = (config.chosen, tuned, config.plants, config.repeats, config.seed, config.short)
    return sum(workshop.matrix.runs for _, workshop in workshops(*its))


def _tune(
    config: ArenaConfig,
    variant: Variant,
    ground: Ground,
    bench: Ground,
    classes: Any,
    seeds: int,
    result: ArenaResult,
    tuned: list[Tuned],
    progress: Progress | None,
    kept: Kept | None,
) -> None:
    """Add what a class's searches find on a ground, for every class and seed.

    Loops of what is found are looked at on the bench.
    """
    ran = _bar(progress, f"tuning, {variant.name}", len(classes) * seeds)
    for name in classes:
        tried: list[Array] = []
        for seed in range(config.seed, config.seed + seeds):
            more = variant.name == CORE and seed < config.seed + config.twice
            budget = config.simulations * (2 if more else 1)

            def made(name: str = name, seed: int = seed, budget: int = budget) -> Array:
                return searched(ground, CLASSES[name], seed, budget, variant.tuner)

            what = f"{variant} {config.short} {name} {seed} {budget}"
            found = made() if kept is None else kept.of(what, made)
            whole, found = found, found[: config.simulations]
            best = best_of(found)
            tuned.append(Tuned(name, variant.name, seed, tuple(best[:OBJECTIVE].tolist())))
            growth = _growth(bench, tuned[-1])
            result.tuned.append(_tuned_row(tuned[-1], found, best, growth, whole if more else None))
            whose = np.full(len(found), float(seed))
            tried.append(np.column_stack([found[:, EFFORT_COLUMN], found[:, INDEX], whose]))
            ran(1)
        if variant.name == CORE:
            points = np.vstack(tried)
            for effort, index, seed_of in points[front(points[:, :2])].tolist():
                its = (name, int(seed_of), SEARCH, NOMINAL, "all", CLASSES[name].aid)
                result.fronts.append(FrontRow(*its, ground.plants[0].name, "share", effort, index))


def _growth(ground: Ground, who: Tuned) -> float:
    """Return how fast the exact linear loops of what was found grow [1/s], 0 if none does."""
    contestant = CLASSES[who.contestant]
    built = contestant.built(who.knobs, ground.designer)
    if built is None:
        return float("inf")
    return float(replace(ground, exact=True).growth(contestant, stack([built], PERIOD))[0])


def _tuned_row(
    who: Tuned, found: Array, best: Array, growth: float, whole: Array | None
) -> TunedRow:
    """Return the row of one search."""
    held = bool(np.isfinite(best[OBJECTIVE]))
    knobs = zip(CLASSES[who.contestant].knobs, who.knobs, strict=True)
    twice = None if whole is None else float(best_of(whole)[OBJECTIVE])
    return TunedRow(
        who.contestant,
        who.tuning,
        who.seed,
        len(found),
        float(np.isnan(found[:, DIVERGED]).mean()),
        float((found[:, GROWTH] > 0).mean()),
        float(best[OBJECTIVE]) if held else None,
        float(best[INDEX]) if held else None,
        float(best[EFFORT_COLUMN]) if held else None,
        twice if twice is not None and np.isfinite(twice) else None,
        growth,
        ", ".join(f"{knob.name} {value:.4g}" for knob, value in knobs),
    )


def _loops(config: ArenaConfig, ground: Ground, tuned: list[Tuned]) -> dict[str, LoopNumbers]:
    """Return what the linear loops of the core's controllers say, by class."""
    plants = [
        Robot.of(parameters=replace(ground.plants[0].parameters, payload=mass)).plant(
            config.plants[0], ground.setting
        )
        for mass in (0.0, *PAYLOADS)
    ]
    found = {}
    for name in config.classes:
        its = [each for each in tuned if each.contestant == name and each.tuning == CORE]
        built = [CLASSES[name].built(each.knobs, ground.designer) for each in its]
        options = LinearOptions(v_gain=CLASSES[name].v_gain, hardware=ground.setting.hardware)
        found[name] = loop_numbers(built, plants, ground.middle, options)
    return found


def carried_on(config: ArenaConfig, progress: Progress | None = None) -> ArenaResult:
    """Return what `run` does, going on from what was interrupted; a quick run keeps nothing.

    Raises:
        RunError: what is run cannot be kept; and what `run` raises.
    """
    _check(config.asked())
    if config.quick:
        return run(config, progress)
    with going_on(config.out, DECIDES, config.force) as kept:
        return run(config, progress, kept)


def _dry(config: ArenaConfig) -> bool:
    """Say what a run costs here, if that is all that is asked for."""
    if not config.dry_run:
        return False
    its = config.asked()
    _check(its)
    ground = _ground(its, Variant(CORE, plants=its.plants[:1]))
    individuals = {
        name: (its.seeds + min(its.twice, its.seeds)) * its.simulations for name in its.classes
    }
    tuned = [_middle(name, CORE, seed) for name in its.classes for seed in range(its.seeds)]
    for each in VARIANTS:
        for name in (name for name in its.classes if name in each.classes):
            individuals[name] += seeds_of(its, each) * its.simulations
            tuned += [_middle(name, each.name, seed) for seed in range(seeds_of(its, each))]
    costs = seconds_each(ground, its.classes, its.seed)
    found = cost_of(costs, individuals, _runs(its, tuned), len(ground.trajectories))
    console().print(
        f"{found.individuals:,} individuals to be tried on three trajectories, {found.runs:,} runs "
        f"of what is found: about {found.seconds / 60:.0f} min on this machine's "
        f"{config.threads or thread_count()} threads.",
        soft_wrap=True,
    )
    return True


def _middle(name: str, tuning: str, seed: int) -> Tuned:
    """Return a controller in the middle of its knobs' ranges, to be counted."""
    draws = distribution_of(CLASSES[name])
    return Tuned(name, tuning, seed, tuple(draws.parameters(np.zeros((1, len(draws.draws))))[0]))


def _files(folder: Path, config: ArenaConfig, result: ArenaResult) -> None:
    """Write the table of all runs; what was kept of them is needed no more."""
    report.write_runs(folder, result)
    if not config.quick:
        forget(config.out)


command = Study(
    carried_on,
    report.tables,
    report.verdict,
    figures,
    report.facts,
    _files,
    question="Are fractional controllers better on a flexible arm, at equal effort?",
    answer=answer,
    instead=_dry,
)
