"""Replay a measured torque: drive one plant open loop from rest, read and write CSV files."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexsim.errors import ParameterError, RunError
from flexsim.files.atomic import require_replaceable, write_text
from flexsim.files.reading import MIB, read_text
from flexsim.loop.beyond import beyond
from flexsim.loop.motion import Motion
from flexsim.loop.runs import drive
from flexsim.loop.settings import setting
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from studies.core.folder import to_json
from studies.core.options import HardwareOptions, RobotOptions, show_differences
from studies.core.text import spelled

ROW_PERIOD = PERIOD
ROW_TOLERANCE = 1e-6  # [s] how far a time stamp may be from its row
QUOTED = 60  # characters of a wrong line that a message shows
TORQUE_HEADER = ["t", "tau1", "tau2"]
TORQUE_MOST = 64 * MIB  # of a torque file: half an hour of rows in full digits
MOTION = "the motion"
MOTION_HEADER = ["t", "x", "y", "theta1", "theta2", "v"]


@dataclass(frozen=True)
class DriveConfig(HardwareOptions, RobotOptions):
    """Drive a plant open loop from rest with a recorded torque."""

    torque: Path
    """CSV file with columns t,tau1,tau2 [s, N m]: rows of 1 ms, each torque held to the next."""
    out: Path
    """CSV file to write: t,x,y,theta1,theta2,v [s, m, rad], row k the state at t_k."""
    plant: str = "chain"
    """rigid, assumed-modes[:n], printed[:n], chain[:N], closed-chain[:N], untuned[:N], rod or
    exudyn[:N]."""
    setting: str = "none"
    """Friction, limits and motors: none, simulink, jump, opposing or reconstructed."""
    theta1: float = 0.0
    """Joint angle at rest at the start [rad]."""
    theta2: float = 0.0
    """Joint angle at rest at the start [rad]."""
    force: bool = False
    """Overwrite the file named by --out."""
    json: bool = False
    """Print one JSON object about the motion instead of a line."""


def _shown(cells: list[str]) -> str:
    """Return a row as a message quotes it: what a binary file takes for a row can be endless."""
    line = ",".join(cells)
    return repr(line if len(line) <= QUOTED else f"{line[:QUOTED]}...")


def read_torque(path: Path) -> Array:
    """Return the torques (K, 2) of a CSV file [N m].

    Raises:
        RunError: the file cannot be read.
        ParameterError: a wrong header, a malformed row or time stamp; the message names the line.
    """
    lines = csv.reader(io.StringIO(read_text(path, TORQUE_MOST, "torque file"), newline=""))
    rows: list[tuple[float, float]] = []
    try:
        header = [name.strip() for name in next(lines, [])]
        if header != TORQUE_HEADER:
            wanted = ",".join(TORQUE_HEADER)
            raise ParameterError(
                f"{path}: the first line is {_shown(header)}, it must be {wanted!r}"
            )
        for number, line in enumerate(lines, start=2):
            rows.append(_torques(f"{path}, line {number}", line, len(rows) * ROW_PERIOD))
    except csv.Error:
        raise RunError(f"{path}: cannot read the torque file: not a CSV file") from None
    if not rows:
        raise ParameterError(f"{path}: has no rows of torque; give at least one after the header")
    return np.array(rows)


def _torques(where: str, line: list[str], due: float) -> tuple[float, float]:
    """Return the two torques of a row [N m], its time due [s].

    Raises:
        ParameterError: it is malformed.
    """
    try:
        values = [float(cell) for cell in line]
    except ValueError:
        values = []
    if len(values) != 3 or not all(map(math.isfinite, values)):
        raise ParameterError(f"{where}: {_shown(line)} is not three finite numbers t,tau1,tau2")
    if abs(values[0] - due) > ROW_TOLERANCE:
        raise ParameterError(
            f"{where}: t = {values[0]:g} s where {due:g} s is due; give rows every 1 ms from 0"
        )
    return values[1], values[2]


def run(config: DriveConfig) -> Motion:
    """Return the motion under the file's torques, row k the state as torque k sets in."""
    chosen = setting(config.setting, config.built)
    plant = config.robot_of().plant(config.plant, chosen)
    theta = (config.theta1, config.theta2)
    if not all(math.isfinite(angle) for angle in theta):
        raise ParameterError(f"start angles are {theta} rad; give finite numbers")
    torque = read_torque(config.torque)
    motion = drive(plant, chosen, torque, ROW_PERIOD, theta)
    return motion.first(len(torque))


def write_motion(path: Path, motion: Motion, force: bool = True) -> None:
    """Write a motion as CSV, all of it or nothing; numbers read back to the same doubles.

    Raises:
        RunError: the file cannot be written.
    """
    table = np.column_stack([motion.time, motion.tip, motion.joint, motion.v])
    lines = [",".join([f"{row[0]:.9g}", *map(repr, row[1:])]) for row in table.tolist()]
    write_text(path, "\n".join([",".join(MOTION_HEADER), *lines, ""]), MOTION, force)


def command(config: DriveConfig) -> None:
    """Drive the plant and write the motion."""
    require_replaceable(config.out, MOTION, config.force)
    motion, robot = run(config), config.robot_of()
    write_motion(config.out, motion, config.force)
    v_most = float(np.abs(motion.v).max())
    notes = beyond(motion.plant, v_most, robot.parameters.L)
    summary = {
        "plant": motion.plant,
        "hardware": config.built.words(),
        "rows": len(motion.time),
        "end_tip": motion.tip[-1],
        "max_v": v_most,
        "beyond": notes,
        "out": str(config.out),
    }
    if config.json:
        print(to_json(summary))
    else:
        show_differences(robot)
        x, y = motion.tip[-1]
        print(
            f"{spelled(config.out)}: {len(motion.time)} rows of the {motion.plant} plant; "
            f"tip ends at ({x:.6f}, {y:.6f}) m, largest |v| {1e3 * v_most:.3f} mm"
        )
        for note in notes:
            print(f"Note: {note}")
        if not config.built.ideal:
            print(f"Hardware: {config.built.words()}.")
