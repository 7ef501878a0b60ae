"""Both arms live: one closed loop in MuJoCo's viewer, pushed, laden and retuned while it runs.

    flexsim play
    flexsim play my.xml --controller circle --speed 0.2
    flexsim play --headless --seconds 5 --push 1 0 1

The physics is that of every other command, to the bit; the window only looks on.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from controllers import TUNED
from flexsim.arm.beam import MODES
from flexsim.errors import ParameterError, RunError
from flexsim.files.atomic import require_replaceable
from flexsim.loop.settings import DEFAULT_SETTING, setting
from flexsim.loop.trajectories import path_named, reference
from flexsim.robot import Robot
from studies.core.folder import to_json
from studies.core.options import HardwareOptions, RobotOptions
from studies.core.study_options import SeedOptions
from studies.core.text import spelled
from studies.play.events import Turn, plain_event, push_events, read_events
from studies.play.knobs import KNOBS
from studies.play.live import Live, Stage
from studies.play.pace import Pace
from studies.play.record import events_path, write_play
from studies.play.reserves import Watcher
from studies.tuning.found import OWN, controller_of, devised_for, label_of, period_of

DEFAULT_TRAJECTORY = "circle"
CHUNK = 64  # periods at a time without a window
RECORDINGS = Path("runs")
SECONDS_MOST = 36_000.0


@dataclass(frozen=True)
class PlayConfig(HardwareOptions, SeedOptions, RobotOptions):
    """Play with the closed loop, live: both arms in MuJoCo's viewer; H shows the keys."""

    file: tyro.conf.Positional[Path | None] = None
    """MJCF file that is the robot, as --mjcf; the paper's robot unless given."""
    controller: str | None = None
    """As of flexsim follow: line, two-loop, circle, ideal-line, ..., figure-5, or the folder of a
    run of flexsim tune; the trajectory's own unless given."""
    trajectory: str | None = None
    """line, two-loop or circle, or turn, of joint 2 by a right angle; the controller's own unless
    given."""
    setting: str = DEFAULT_SETTING
    """Friction, limits and motors: none, simulink, jump, opposing, stribeck, lugre or
    reconstructed."""
    plant: str | None = None
    """MuJoCo's arm: chain[:N], untuned[:N], rule-of-thumb[:N] or rod; of a rod's file the rod,
    else the chain, unless given."""
    modes: int = MODES
    """Assumed modes of the ghost."""
    speed: float = 1.0
    """Simulated time over the clock's: 1 is real time, 0.1 a tenth of it."""
    repeat: bool = False
    """Begin the trajectory again at its end, or go it back if its ends lie apart; it is held there
    unless given."""
    seconds: float | None = None
    """End after so much simulated time [s]; when the window is closed unless given."""
    headless: bool = False
    """Run without a window, as fast as it goes, and print as JSON what happened."""
    push: tuple[float, ...] = ()
    """Push both tips [s, N, N, s]: when, FX, FY, and how long; 0.1 s, and no push at all, unless
    given."""
    payload_step: float = 0.05
    """What key P picks up [kg]."""
    record: Path | None = None
    """Recording to write at the end, and on key V: NAME.rrd, with the events in NAME.json; on the
    key only, to runs, unless given."""
    replay: Path | None = None
    """Do again what a file of events says, of the same loop, instead of waiting for keys."""
    force: bool = False
    """Overwrite the files named by --record."""
    json: bool = False
    """Print as JSON what happened when the window is closed, too."""


@dataclass(eq=False)
class Session:
    """A loop to be played, and what is to be told of it.

    Attributes:
        config: what was asked. live: the loop. facts: about it, for files and for the report.
        periods: to run for, None until the window is closed. recorded: files written so far.
    """

    config: PlayConfig
    live: Live
    facts: dict[str, Any]
    periods: int | None
    recorded: list[str] = field(default_factory=list)

    def record(self) -> str:
        """Write a recording of what was seen; return where it is.

        Raises:
            ParameterError: nothing was seen. RunError: it cannot be written.
        """
        path = self.config.record
        if path is None:
            names = ("play", *(f"play-{i}" for i in range(2, 1000)))
            free = (RECORDINGS / f"{name}.rrd" for name in names)
            path = next(each for each in free if not each.exists())
            path.parent.mkdir(exist_ok=True)
        write_play(path, self.live, self.facts)
        if str(path) not in self.recorded:
            self.recorded.append(str(path))
        return f"recorded in {spelled(path)}"


def _robot(config: PlayConfig) -> Robot:
    """Return the robot that a configuration names in either way.

    Raises:
        ParameterError: in both ways at once, and as `Robot.of`.
    """
    if config.file is None:
        return config.robot_of()
    if config.mjcf is not None:
        raise ParameterError("an MJCF file and --mjcf are given; give one")
    values = {item.name: getattr(config, item.name) for item in fields(config)}
    return PlayConfig(**values | {"mjcf": config.file, "file": None}).robot_of()


def session(config: PlayConfig) -> Session:
    """Return the loop that a configuration asks for.

    Raises:
        ParameterError, ModelError, RunError: an option cannot be used.
    """
    if config.seed < 0:
        raise ParameterError(f"seed is {config.seed}; give 0 or more")
    most = KNOBS["payload"].high
    if not 0 < config.payload_step <= most:
        raise ParameterError(
            f"--payload-step is {config.payload_step:g}; give more than 0, {most:g} kg at most"
        )
    if config.seconds is not None and not 0 < config.seconds <= SECONDS_MOST:
        raise ParameterError(
            f"--seconds is {config.seconds:g}; give more than 0, {SECONDS_MOST:g} at most"
        )
    Pace(1.0, config.speed)
    if config.record is not None:
        for path in (config.record, events_path(config.record)):
            require_replaceable(path, "the recording", config.force)
        if not config.record.absolute().parent.is_dir():
            raise RunError(
                f"--record {spelled(config.record)}: cannot write the recording: no such folder"
            )
    name = config.controller
    if name is None and config.arm in OWN:
        name = config.arm
    if name is None:
        own = config.trajectory or DEFAULT_TRAJECTORY
        name = own if own in TUNED else DEFAULT_TRAJECTORY
    controller = controller_of(name)
    chosen, robot = setting(config.setting, config.built), _robot(config)
    shape = path_named(config.trajectory or devised_for(controller), chosen.name == "reconstructed")
    modes = robot.modes_plant(chosen, config.modes)
    mujoco: Any = robot.plant(config.plant or ("rod" if robot.rod else "chain"), chosen)
    ref = reference(shape, modes.parameters, period_of(controller))
    uniform = robot.file is None and not robot.modal_damping
    stage = Stage(modes, mujoco, chosen, controller, ref, config.repeat, uniform)
    facts = {
        "controller": label_of(controller),
        "trajectory": shape.name,
        "repeat": config.repeat,
        "setting": config.setting,
        "hardware": config.built.words(),
        "seed": config.seed,
        "robot": "by its numbers" if robot.given is None else spelled(robot.given.source),
        "plants": [modes.name, mujoco.name],
        "modes": config.modes,
        "period": period_of(controller),
    }
    return _session(config, stage, facts)


def _session(config: PlayConfig, stage: Stage, facts: dict[str, Any]) -> Session:
    """Return a session of a stage, its script read."""
    period = facts["period"]
    script, periods = push_events(config.push, period), None
    if config.replay is not None:
        if script:
            raise ParameterError("--push and --replay exclude each other; give one")
        script, periods = read_events(config.replay, facts)
    if config.seconds is not None:
        periods = max(1, round(config.seconds / period))
    elif config.headless and periods is None:
        periods = len(stage.reference.time) - 1
    return Session(config, Live(stage, script), facts, periods)


def run_headless(given: Session, watcher: Watcher) -> float:
    """Run for the periods of a session, margins asked after each turn of a knob; return [s] taken.

    What the watcher takes is not counted: in a window another thread waits for it.
    """
    live, periods = given.live, given.periods or 0
    start, waited = time.perf_counter(), 0.0
    turned = -1
    while live.period < periods:
        turns = sum(isinstance(event, Turn) for event in live.done)
        if turns != turned:
            asked = time.perf_counter()
            watcher.ask(live.question())
            watcher.wait()
            waited += time.perf_counter() - asked
            turned = turns
        live.advance(min(CHUNK, periods - live.period))
    return time.perf_counter() - start - waited


def report(given: Session, watcher: Watcher, took: float, late: float) -> dict[str, Any]:
    """Return what happened, as JSON has it; errors in metres.

    Args:
        took: wall time [s]. late: of which the simulation fell behind the clock [s].
    """
    live, tally = given.live, given.live.tally
    names = [arm.body.plant.name for arm in live.arms]
    errors = [{"rms": rms, "max": most} for rms, most in zip(tally.rms, tally.most, strict=True)]
    times = 1e3 * np.array(watcher.took or [np.nan])
    return given.facts | {
        "seconds": live.time,
        "periods": live.period,
        "tip_error": dict(zip(names, errors[:2], strict=True)),
        "difference": errors[2],
        "diverged": {
            name: None if arm.diverged is None else live.length * arm.diverged
            for name, arm in zip(names, live.arms, strict=True)
        },
        "knobs": vars(live.knobs),
        "events": [plain_event(event) for event in live.done],
        "margins": None if watcher.answer is None else vars(watcher.answer),
        "margins_ms": {"median": float(np.median(times)), "max": float(times.max())},
        "real_time_factor": live.time / took if took > 0 else None,
        "late": late,
        "recorded": given.recorded,
    }


def command(config: PlayConfig) -> None:
    """Play until the window is closed, or without one for as long as was asked."""
    given = session(config)
    if not config.headless:
        from studies.play.window import require_display

        require_display()
    watcher = Watcher()
    try:
        watcher.ask(given.live.question())
        watcher.wait()  # once: what is compiled or looked up first takes longer
        watcher.took.clear()
        took, late = _played(given, watcher)
        watcher.ask(given.live.question())
        watcher.wait()
    finally:
        watcher.end()
    if config.record is not None:
        given.record()
    if config.headless or config.json:
        print(to_json(report(given, watcher, took, late)))
    else:
        print(f"played {given.live.time:.2f} s, {len(given.live.done)} events")
        for path in given.recorded:
            print(f"recorded: {spelled(path)}")


def _played(given: Session, watcher: Watcher) -> tuple[float, float]:
    """Play; return the wall time it took and how far the simulation fell behind it [s]."""
    config, live = given.config, given.live
    if config.headless:
        live.warm_up()
        return run_headless(given, watcher), 0.0
    from studies.play.window import play_in_window

    live.warm_up()
    pace = Pace(live.length, config.speed)
    seconds = None if given.periods is None else live.length * given.periods
    took = play_in_window(live, pace, watcher, given.record, config.payload_step, seconds)
    return took, pace.late
