"""Replay a measured torque: drive one plant open loop, read a log, write a CSV file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexsim.errors import ParameterError
from flexsim.files.atomic import require_replaceable, write_text
from flexsim.loop.beyond import beyond
from flexsim.loop.motion import Motion
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.robot import Robot
from flexsim.robot.start import Start, start_of
from studies.core.folder import to_json
from studies.core.options import HardwareOptions, RobotOptions, show_differences
from studies.core.text import spelled
from studies.tools.held_log import Log
from studies.tools.logs import LogOptions, read_log

RUNS_MOST = 2**32  # of which each has noise of its own
TORQUE = "torque file"
MOTION = "the motion"
MOTION_HEADER = ["t", "x", "y", "theta1", "theta2", "v"]
MEASURED_HEADER = ["t", "tau1", "tau2", "theta1", "theta2", "v"]
SENSED_HEADER = ["strain1", "strain2", "w1", "w2"]  # where they are sensed


@dataclass(frozen=True)
class DriveConfig(LogOptions, HardwareOptions, RobotOptions):
    """Drive a plant open loop with a recorded torque."""

    torque: Path
    """CSV file with columns t,tau1,tau2 [s, N m], at any rate: each torque is held to the next."""
    out: Path
    """CSV file to write: t,x,y,theta1,theta2,v [s, m, rad], row k the state at t_k, which counts
    from the log's first stamp."""
    plant: str = "chain"
    """rigid, assumed-modes[:n], printed[:n], chain[:N], closed-chain[:N], untuned[:N],
    rule-of-thumb[:N], rod or exudyn[:N]."""
    setting: str = "none"
    """Friction, limits and motors: none, simulink, jump, opposing or reconstructed."""
    theta1: float | None = None
    """Joint angle at rest at the start [rad], beam straight; 0 unless given."""
    theta2: float | None = None
    """Joint angle at rest at the start [rad]; 0 unless given."""
    start: str | None = None
    """Keyframe of the --mjcf file to start from instead, as bent; without a file, home or bent as
    flexsim chain writes them."""
    lock: tuple[Literal["joint1", "joint2"], ...] = ()
    """Joints that do not move: joint1, joint2 or both; none unless given."""
    log: Literal["true", "measured"] = "true"
    """What is written: the motion; or what a laboratory logs of it, through the sensors of
    --hardware: t,tau1,tau2,theta1,theta2,v, with bridges strain1,strain2, with tachometers w1,w2
    [s, N m, rad, m, -, rad/s]."""
    run_number: int = 0
    """Which of many runs it is, by which the noise of what is measured differs."""
    force: bool = False
    """Overwrite the file named by --out."""
    seed: int = 0
    """Of the noise of what is measured."""
    json: bool = False
    """Print one JSON object about the motion instead of lines."""


@dataclass(frozen=True, eq=False)
class Driven:
    """A motion, the log that drove it, and the keyframe it started from, None for given angles."""

    motion: Motion
    log: Log
    start: Start | None


def run(config: DriveConfig) -> Driven:
    """Return the motion under the log's torques, row k the state as torque k sets in."""
    chosen = setting(config.setting, config.built)
    robot = config.robot_of()
    plant = robot.plant(config.plant, chosen)
    theta, start = _start(config, robot, plant)
    log = read_log(config.torque, config, what=TORQUE)
    torque = log.resampled(config.period)
    if config.lock:
        plant = plant.locked(config.lock)
    state = None if start is None else start.state
    if not 0 <= config.run_number < RUNS_MOST:
        raise ParameterError(f"--run-number is {config.run_number}; give 0 to {RUNS_MOST - 1}")
    motion = drive(plant, chosen, torque, config.period, theta, state, config.run_number)
    return Driven(motion.first(len(torque)), log, start)


def _start(
    config: DriveConfig, robot: Robot, plant: Plant
) -> tuple[tuple[float, float], Start | None]:
    """Return joint angles at rest, or the keyframe to start from instead.

    Raises:
        ParameterError: angles that are not finite, or beside a keyframe; a keyframe that there is
            not, that the plant cannot take, or that moves a locked joint.
    """
    given = {"--theta1": config.theta1, "--theta2": config.theta2}
    theta = (config.theta1 or 0.0, config.theta2 or 0.0)
    if not all(math.isfinite(angle) for angle in theta):
        raise ParameterError(f"start angles are {theta} rad; give finite numbers")
    if config.start is None:
        return theta, None
    for option, angle in given.items():
        if angle is not None:
            raise ParameterError(
                f"--start {config.start} and {option} {angle:g} contradict each other: a keyframe "
                "has angles of its own; leave one out"
            )
    start = start_of(robot, plant, config.start)
    for joint, rate in zip(("joint1", "joint2"), start.rates, strict=True):
        if joint in config.lock and rate != 0.0:
            raise ParameterError(
                f"keyframe {config.start!r} moves {joint} at {rate:g} rad/s, which --lock holds; "
                "leave one out"
            )
    return theta, start


def write_motion(path: Path, motion: Motion, force: bool = True, columns: str = "true") -> None:
    """Write a motion as CSV, all of it or nothing; numbers read back to the same doubles.

    Args:
        columns: 'true', or 'measured' for what a laboratory logs of it.

    Raises:
        RunError: the file cannot be written.
    """
    header, table = MOTION_HEADER, np.column_stack([motion.tip, motion.joint, motion.v])
    if columns == "measured":
        header, table = measured_table(motion)
    rows = np.column_stack([motion.time, table]).tolist()
    lines = [",".join([f"{row[0]:.9g}", *map(repr, row[1:])]) for row in rows]
    write_text(path, "\n".join([",".join(header), *lines, ""]), MOTION, force)


def measured_table(motion: Motion) -> tuple[list[str], Array]:
    """Return the names of the columns, and all but the time (K, C), of what a laboratory logs.

    The torques are those commanded; strains and rates are there where they are sensed.
    """
    table, sensed = [motion.torque, motion.measured], motion.sensed
    header = list(MEASURED_HEADER)
    if sensed is not None:
        there = [i for i, column in enumerate(sensed.T) if np.isfinite(column).all()]
        header += [SENSED_HEADER[i] for i in there]
        table.append(sensed[:, there])
    return header, np.hstack(table)


def summary(config: DriveConfig, driven: Driven, notes: tuple[str, ...]) -> dict[str, Any]:
    """Return what there is to know of a motion, for programs to read."""
    motion, start = driven.motion, driven.start
    return {
        "plant": motion.plant,
        "hardware": config.built.words(),
        "rows": len(motion.time),
        "end_tip": motion.tip[-1],
        "max_v": float(np.abs(motion.v).max()),
        "beyond": notes,
        "log": driven.log.done(config.period),
        "start": {
            "keyframe": None if start is None else start.keyframe,
            "theta": motion.joint[0],
            "rates": (0.0, 0.0) if start is None else start.rates,
            "v": motion.v[0],
            "v_of_file": 0.0 if start is None else start.v_of_file,
        },
        "locked": sorted(set(config.lock)),
        "out": str(config.out),
    }


def start_words(driven: Driven) -> str:
    """Return where a motion started, in a line."""
    first, second = driven.motion.joint[0]
    start = driven.start
    if start is None:
        return f"Start: at rest at ({first:g}, {second:g}) rad, beam straight."
    own = f"v {1e3 * start.v:.4g} mm"
    if start.v != start.v_of_file:
        own += f" ({1e3 * start.v_of_file:.4g} mm in the file)"
    pace = "at rest"
    if not start.at_rest:
        pace = "rates ({:g}, {:g}) rad/s".format(*start.rates)
    return (
        f"Start: keyframe {spelled(start.keyframe)} of {spelled(start.source)}, {pace} at "
        f"({first:g}, {second:g}) rad, {own}."
    )


def command(config: DriveConfig) -> None:
    """Drive the plant and write the motion."""
    require_replaceable(config.out, MOTION, config.force)
    driven, robot = run(config), config.robot_of()
    motion = driven.motion
    write_motion(config.out, motion, config.force, config.log)
    v_most = float(np.abs(motion.v).max())
    notes = beyond(motion.plant, v_most, robot.parameters.L)
    if config.json:
        print(to_json(summary(config, driven, notes)))
        return
    show_differences(robot)
    for line in driven.log.words(config.period):
        print(line)
    print(start_words(driven))
    if config.lock:
        print(f"Locked: {', '.join(sorted(set(config.lock)))}.")
    x, y = motion.tip[-1]
    print(
        f"{spelled(config.out)}: {len(motion.time)} rows of the {motion.plant} plant; "
        f"tip ends at ({x:.6f}, {y:.6f}) m, largest |v| {1e3 * v_most:.3f} mm"
    )
    for note in notes:
        print(f"Note: {note}")
    if config.log == "true" and motion.sensed is not None:
        print("Note: what bridges and tachometers read is in the file with --log measured alone")
    if not config.built.ideal:
        print(f"Hardware: {config.built.words()}.")
