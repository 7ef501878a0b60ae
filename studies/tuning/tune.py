"""How good can the controllers be made? Section 3.2's genetic algorithm, or a peer, on a robot.

    flexsim tune --trajectory circle --plant assumed-modes --seed 1 --out runs/circle
    flexsim tune --resume runs/circle

A run interrupted or killed loses at most the generation it was at; `--resume` continues it to the
same bits as if it had never stopped, on any number of threads.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.robot import Robot
from studies.core.console import console
from studies.core.ending import NOTHING_KEPT, saying
from studies.core.folders.locking import locked
from studies.core.options import (
    ROBOT_FILE,
    ArmName,
    HardwareNumberOptions,
    OwnRobotOptions,
    show_differences,
)
from studies.core.study_options import FORMATS, Format, check_each_once, check_threads
from studies.core.text import spelled
from studies.tuning import record as tune_folder
from studies.tuning import report as tune_report
from studies.tuning.genetic import Generation, OnGeneration, Search
from studies.tuning.individuals import TEXTBOOK
from studies.tuning.kept import GENERATIONS, HEADER
from studies.tuning.problem import Problem, distribution_for, problem_of, tune
from studies.tuning.record import Record
from studies.tuning.scenarios import Perturbation, perturbations, robot_of
from studies.tuning.screened_draws import Screened, screened
from studies.tuning.showing.in_viewer import viewed
from studies.tuning.showing.terminal import live
from studies.tuning.tuning import Tuning

DEFAULT_OUT = Path("runs/tune")
WITHOUT_MODES = ("chain", "untuned", "rule-of-thumb", "rod", "rigid")  # kinds of plants


@dataclass(frozen=True)
class TuneConfig(HardwareNumberOptions, OwnRobotOptions):
    """Tune both joints' controllers: the genetic algorithm of section 3.2, or a peer."""

    trajectory: str | None = None
    """line, two-loop or circle, or turn, of joint 2 by a right angle; line unless given."""
    plant: tuple[str, ...] | None = None
    """both, or some of rigid, assumed-modes[:n], printed[:n], chain[:N], closed-chain[:N],
    untuned[:N], rule-of-thumb[:N], rod[:N], exudyn[:N]; the worst counts; assumed-modes unless
    given."""
    controller: str | None = None
    """fractional, or pid: orders 1 and -1; fractional unless given."""
    realisation: str | None = None
    """Of the operators, as in flexsim filter; or textbook, for PIDs. tustin, (2), unless given."""
    setting: str | None = None
    """Friction, limits and motors: none, simulink, jump, opposing or reconstructed; simulink
    unless given."""
    distribution: str | None = None
    """table-1, log-uniform, wide (three terms of one size), or a TOML file of rows such as
    k1 = { normal = [1e4, 2000] }; table-1 unless given."""
    tuner: str | None = None
    """genetic, cma (CMA-ES) or de (differential evolution); genetic unless given."""
    terms: int | None = None
    """p in (2), length of each operator; 10 unless given."""
    period: float | None = None
    """Control period T [s]; 1 ms unless given."""
    filter_time: float | None = None
    """Time constant of the textbook derivative's low-pass filter [s]; 0 unless given."""
    weights: tuple[float, float, float] | None = None
    """Of x, y and v in the index (5); 1 1 1 unless given."""
    perturb: int | None = None
    """Robots with other EI, rho, friction and payload beside the nominal one; the worst counts.
    0 unless given."""
    perturb_spread: float | None = None
    """Largest relative change of EI, rho and friction; 0.2 unless given."""
    perturb_payload: float | None = None
    """Largest payload at the tip [kg]; 0.02 unless given."""
    population: int | None = None
    """Individuals per generation; 50 unless given."""
    generations: int | None = None
    """Generations at most, the first included; 100 unless given. Peers get the same budget."""
    patience: int | None = None
    """Generations without improvement after which the algorithm stops; 10 unless given."""
    survivors: int | None = None
    """The best, which stay and reproduce; 6 unless given."""
    screen: int | None = None
    """Candidates at most per individual drawn, to keep those whose linear loop does not grow; 0,
    no screening, unless given."""
    seed: int | None = None
    """Seed of everything random; 1 unless given."""
    modes: int | None = None
    """Assumed modes, n; 3 unless given."""
    segments: int | None = None
    """Segments of the chain; 6 unless given."""
    arm: ArmName | None = None
    """Which robot, unless --mjcf gives a file: the paper's, one flexible link on a stand, or two
    flexible links (De Luca and Siciliano, 1991); paper unless given."""
    mjcf: str | None = None
    """MJCF file that is the robot, in every model of it; the paper's robot unless given."""
    beam: Literal["file", "analytic"] | None = None
    """With --mjcf, the modes of the assumed-modes plant: the file's own chain's, or the paper's
    beam's on the file's rigid bodies; file unless given."""
    payloads: tuple[float, ...] | None = None
    """At the tip, beside the robot's own [kg]; the worst counts; 0 unless given."""
    long_hold: float | None = None
    """Hold that runs are repeated with [s], in which they may not diverge; none unless given."""
    residual: float | None = None
    """What each metre of the largest |v| over the long hold's second half adds to the index [m s];
    0 unless given."""
    exact: bool = False
    """Reject what grows on the exact linear loop, of 12 modes, exactly held, with any of the
    hardware and payloads, before it is simulated."""
    exact_spread: float | None = None
    """Relative change of EI, both ways, with which it may not grow either; 0 unless given."""
    exact_payload: float | None = None
    """Payload with which it may not grow either [kg]; 0 unless given."""
    effort: float | None = None
    """What each N m of the torques' total variation adds to the index [m2 s]; 0 unless given."""
    v_gain: float | None = None
    """Factor of atan(v/(r+L)) in the measured angle of joint 2: -1, mirrored, as in the paper; 0
    ignores v; -1 unless given."""
    hardware: tuple[str, ...] | None = None
    """Some of ideal, delayed (a sample of delay), bench (assumed: that delay, 10 and 5 N m, 8192
    counts a turn, 0.1 mm of noise on v); the worst counts; ideal unless given."""
    out: Path | None = None
    """Folder of the run, made anew; runs/tune unless given."""
    force: bool = False
    """Replace the run that is there."""
    resume: Path | None = None
    """Folder of a run to continue instead of a new one; its own settings hold."""
    threads: int | None = None
    """Threads; all cores unless given. Results do not depend on it."""
    live: bool = False
    """Show every generation, and how the best individual moves, in the rerun viewer."""
    connect: str | None = None
    """With --live, the viewer to send to, as rerun+http://127.0.0.1:9876/proxy; the one running on
    this machine, or else a new one, unless given."""
    json: bool = False
    """Print one JSON object instead of the table."""
    format: tuple[Format, ...] = FORMATS
    """Of the figure, each once."""


def given(config: TuneConfig) -> dict[str, Any]:
    """Return those of a tuning's values that the command line gives."""
    names = (item.name for item in dataclasses.fields(Tuning))
    values = {name: getattr(config, name) for name in names}
    values |= {name: _single(values[name]) for name in ("plant", "hardware")}
    not_given = (None, (), False, Parameters())
    return {
        name: value
        for name, value in values.items()
        if not any(value is each or value == each != 0 for each in not_given)
    }


def _single(names: tuple[str, ...] | None) -> str | tuple[str, ...] | None:
    """Return one name as such, several as they are."""
    return names[0] if names and len(names) == 1 else names


def tuning_of(config: TuneConfig) -> Tuning:
    """Return the tuning that the command line describes.

    Raises:
        ParameterError: an option that would have no effect, or what `Tuning` refuses.
    """
    values = given(config)
    tuning = Tuning(**values)
    textbook = tuning.realisation == TEXTBOOK
    kinds = {name: name.partition(":")[::2] for name in tuning.plants}
    alone = len(kinds) == 1
    kind, size = next(iter(kinds.values())) if alone else ("", "")
    sized = f"{tuning.plants[0]} has its own number"
    for name, useless, reason in (
        ("terms", textbook, "the textbook realisation has no series to cut"),
        ("filter_time", not textbook, "only the textbook realisation has one"),
        ("perturb_spread", not tuning.perturb, "no robots are perturbed; add --perturb"),
        ("perturb_payload", not tuning.perturb, "no robots are perturbed; add --perturb"),
        ("residual", not tuning.long_hold, "no hold is long; add --long-hold"),
        ("exact_spread", not tuning.exact, "no exact loops are looked at; add --exact"),
        ("exact_payload", not tuning.exact, "no exact loops are looked at; add --exact"),
        ("patience", tuning.tuner != "genetic", f"{tuning.tuner} always uses its whole budget"),
        ("screen", tuning.tuner != "genetic", "only the genetic algorithm's draws are screened"),
        ("modes", kind in WITHOUT_MODES, f"the {kind} plant has none"),
        ("segments", kind in ("assumed-modes", "printed", "rigid"), f"the {kind} plant has none"),
    ):
        if name in values and size and name in ("modes", "segments"):
            useless, reason = useless or str(values[name]) != size, sized
        if name in values and useless:
            raise ParameterError(f"--{name.replace('_', '-')} has no effect: {reason}")
    return tuning


def texts_of(tuning: Tuning, problem: Problem, robot: Robot) -> dict[str, str]:
    """Return what a run keeps beside its configuration: MJCF and perturbed robots, by file name."""
    texts = {}
    own = [plant.mjcf for plant, _ in problem.scenarios if plant.mjcf is not None]
    if robot.given is not None:
        texts[ROBOT_FILE] = robot.given.text
    elif own:
        texts["chain.xml"] = own[0]
    if tuning.perturb:
        lines = [",".join(map(repr, each)) for each in perturbations(tuning)]
        texts["robots.csv"] = "\n".join([",".join(Perturbation._fields), *lines, ""])
    return texts


Start = Callable[[], None]


def begin(config: TuneConfig) -> tuple[Record, Problem, Start]:
    """Return a new run, and what makes its folder: its first generation may refuse yet."""
    tuning = tuning_of(config)
    folder = config.out or DEFAULT_OUT
    tune_folder.require_startable(folder, config.force)
    given_draws = distribution_for(tuning)
    check_threads(config.threads)
    robot = robot_of(tuning)
    problem = problem_of(tuning, config.threads, robot)
    draws = screened(tuning, given_draws, problem)
    texts = texts_of(tuning, problem, robot)
    if not config.json:
        show_differences(robot)

    def start() -> None:
        what = (tuning, draws, texts, problem.simulated)
        tune_folder.start(folder, config.force, *what)

    return Record(tuning, draws, [], len(HEADER)), problem, start


def first_difference(robot: Parameters, other: Parameters) -> tuple[str, float, float]:
    """Return the option of the first number in which two robots differ, and both its values."""
    for item in dataclasses.fields(Parameters):
        one, its = getattr(robot, item.name), getattr(other, item.name)
        if one != its:
            return f"robot.{item.name}", one, its
    raise ValueError("the robots are the same")


def _words(tuning: Tuning) -> str:
    return "; ".join(each.words() for each in tuning.built)


def take_up(config: TuneConfig, folder: Path) -> tuple[Record, Problem]:
    """Return a run to be continued, cut to its last complete generation.

    Raises:
        ParameterError: options that contradict it.
        RunError: the folder cannot be continued; it is left as it was.
    """
    record = tune_folder.read(folder)
    for name, value in given(config).items():
        its = getattr(record.tuning, name)
        if isinstance(value, Parameters) and value != its:
            name, value, its = first_difference(value, its)
        elif its is None and name.startswith("hardware_"):  # a number of the named hardware's own
            named = dataclasses.replace(record.tuning, **{name: value})
            value, its = (_words(each) for each in (named, record.tuning))
        if value != its:
            raise ParameterError(
                f"--{name.replace('_', '-')} {value} contradicts {folder}, which has {its}; "
                "leave it out, or start a new run"
            )
    check_threads(config.threads)
    if record.tuning.mjcf is None:
        robot = robot_of(record.tuning)
    else:  # the file as it was, not its later edits
        robot = Robot.of(folder / ROBOT_FILE, record.tuning.beam)
    problem = problem_of(record.tuning, config.threads, robot)
    tune_folder.check_texts(folder, texts_of(record.tuning, problem, robot))
    draws = screened(record.tuning, record.draws, problem)
    tune_folder.cut(folder, record.size)
    if not config.json:
        show_differences(robot)
    return dataclasses.replace(record, draws=draws), problem


def carry_out(
    folder: Path,
    record: Record,
    problem: Problem,
    start: Start,
    formats: Sequence[Format] = FORMATS,
    viewer: OnGeneration | None = None,
) -> tuple[Search, dict[str, float]]:
    """Return the search, every new generation kept in the folder as soon as it is there.

    And the best's index by plant, where it was rated on others than were simulated.

    Args:
        start: called before the first generation is kept. formats: of the figure.
        viewer: is shown every generation.
    """
    tuning, kept = record.tuning, len(record.generations)

    def keep(new: Generation) -> None:
        nonlocal kept
        if not kept:
            start()
        tune_folder.append(folder, new)
        kept = new.number + 1
        show(new)
        if viewer is not None:
            viewer(new)

    def interrupted() -> str:
        again = f"continue with flexsim tune --resume {folder}"
        return f"interrupted, {kept} generation(s) kept; {again}" if kept else NOTHING_KEPT

    with saying(interrupted):
        with live(record, len(problem.scenarios)) as show:
            how = (record.draws, tuning.genetic, tuning.seed, tuning.tuner)
            search = tune(problem, *how, keep, record.generations)
        rated = problem.rated(search.best_parameters)
        scenarios = len(problem.scenarios)
        if not tune_report.is_concluded(folder, search, scenarios, rated, formats):
            tune_report.conclude(folder, search, tuning, scenarios, rated, formats)
    return search, rated


def _viewer(
    held: ExitStack, config: TuneConfig, record: Record, problem: Problem
) -> OnGeneration | None:
    """Return what shows generations in the viewer, if that is asked for.

    Raises:
        RunError: there is no viewer, and none can be started.
    """
    if not config.live:
        return None
    return held.enter_context(viewed(record, problem, config.connect))


def command(config: TuneConfig) -> None:
    """Run the tuner, from the start or on, and write its folder."""
    if config.resume and (config.out or config.force):
        raise ParameterError("--resume continues in the run's own folder; leave out --out, --force")
    if config.connect is not None and not config.live:
        raise ParameterError("--connect has no effect: nothing is shown; add --live")
    check_each_once("format", config.format)
    folder = config.resume or config.out or DEFAULT_OUT
    with ExitStack() as held:
        if config.resume:
            held.enter_context(locked(folder))
            record, problem = take_up(config, folder)
            viewer = _viewer(held, config, record, problem)
            how = (config.format, viewer)
            search, rated = carry_out(folder, record, problem, lambda: None, *how)
        else:
            record, problem, make_folder = begin(config)

            def start() -> None:
                make_folder()
                held.enter_context(locked(folder))

            viewer = _viewer(held, config, record, problem)
            search, rated = carry_out(folder, record, problem, start, config.format, viewer)
    tally = record.draws.tally if isinstance(record.draws, Screened) else None
    if config.json:
        more: dict[str, Any] = {"screened": vars(tally)} if tally else {}
        more["simulated"] = problem.simulated
        print(tune_report.as_json(search, len(problem.scenarios), folder, more, rated))
        return
    out = console()
    for line in problem.remarks:
        out.print(spelled(line), soft_wrap=True)
    out.print(tune_report.summary(search, rated), soft_wrap=True)
    if tally:
        out.print(f"screened {tally.candidates} candidates in {tally.seconds:.1f} s")
    if (table := tune_report.result_table(search)).rows:
        out.print(table.render())
    left = f"{GENERATIONS}, convergence.csv, figures/, convergence.rrd"
    out.print(f"{spelled(folder)}: {left}", soft_wrap=True)
