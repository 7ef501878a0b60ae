"""One closed loop: a controller follows a trajectory on one plant, its motion as a CSV file.

    flexsim follow --controller circle --out circle.csv

Row k is the state at t_k = k T, T the control period, with the torques that are commanded from then
on and where the reference is.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexsim.errors import ParameterError
from flexsim.files.atomic import require_replaceable, write_text
from flexsim.loop.beyond import beyond
from flexsim.loop.metrics import measures
from flexsim.loop.motion import Motion
from flexsim.loop.runs import closed_loop
from flexsim.loop.settings import DEFAULT_SETTING, setting
from flexsim.loop.trajectories import Reference, Trajectory, Turn, path_named, reference
from studies.core.folder import to_json
from studies.core.options import HardwareOptions, RobotOptions, show_differences
from studies.core.study_options import SeedOptions
from studies.core.text import spelled
from studies.tuning.found import (
    AnyController,
    controller_of,
    devised_for,
    label_of,
    period_of,
    v_gain_of,
)

MM = 1e3  # per metre
MOTION = "the motion"
MOTION_HEADER = (
    *("t", "x", "y", "theta1", "theta2", "v", "tau1", "tau2"),
    *("x_ref", "y_ref", "theta1_ref", "theta2_ref"),
)


@dataclass(frozen=True)
class FollowConfig(HardwareOptions, SeedOptions, RobotOptions):
    """Run one closed loop from rest on its reference, and write the motion."""

    controller: str
    """Of our own line, two-loop, circle; tuned in the ideal loop ideal-line, ideal-two-loop,
    ideal-circle; of Table 2 figure-3, figure-4, figure-5; with --arm one-link or two-flexible
    that of this name; or the folder of a run of flexsim tune.
    A name comes before a folder; ./line is the folder."""
    out: Path
    """CSV file to write, a row per control period: t,x,y,theta1,theta2,v,tau1,tau2 and x_ref,
    y_ref,theta1_ref,theta2_ref [s, m, rad, N m]; torques as commanded from t on."""
    plant: str = "chain"
    """rigid, assumed-modes[:n], printed[:n], chain[:N], closed-chain[:N], untuned[:N],
    rule-of-thumb[:N], rod or exudyn[:N]."""
    trajectory: str | None = None
    """line, two-loop or circle, or turn, of joint 2 by a right angle; the controller's own unless
    given."""
    setting: str = DEFAULT_SETTING
    """Friction, limits and motors: none, simulink, jump, opposing or reconstructed, which has its
    own trajectories."""
    force: bool = False
    """Overwrite the file named by --out."""
    json: bool = False
    """Print one JSON object about the motion instead of a line."""


@dataclass(frozen=True, eq=False)
class Followed:
    """What came of a loop: its motion, up to where it diverged if it did, and figures of merit."""

    controller: AnyController
    path: Trajectory | Turn
    reference: Reference
    motion: Motion
    figures: dict[str, Any]


def run(config: FollowConfig) -> Followed:
    """Return the motion of one closed loop, from rest on the reference.

    Raises:
        ParameterError, ModelError, RunError: an option cannot be used.
    """
    if config.seed < 0:
        raise ParameterError(f"seed is {config.seed}; give 0 or more")
    controller = controller_of(config.controller)
    chosen = setting(config.setting, config.built)
    plant = config.robot_of().plant(config.plant, chosen)
    shape = config.trajectory or devised_for(controller)
    path = path_named(shape, reconstructed=config.setting == "reconstructed")
    ref = reference(path, plant.parameters, period_of(controller))
    filters = controller.filters(period_of(controller))
    v_gain = v_gain_of(controller)
    (motion,) = closed_loop(plant, chosen, ref, [filters], energy=False, v_gain=v_gain)
    return Followed(controller, path, ref, motion, measures(motion, ref, path.hold))


def write_motion(path: Path, motion: Motion, force: bool = True) -> None:
    """Write a closed loop's motion as CSV; numbers read back to the same doubles.

    Raises:
        RunError: the file cannot be written.
    """
    columns = (motion.tip, motion.joint, motion.v, motion.torque)
    references = (motion.reference_tip, motion.reference_joint)
    table = np.column_stack([motion.time, *columns, *references])
    lines = [",".join([f"{row[0]:.9g}", *map(repr, row[1:])]) for row in table.tolist()]
    write_text(path, "\n".join([",".join(MOTION_HEADER), *lines, ""]), MOTION, force)


def command(config: FollowConfig) -> None:
    """Run the loop and write the motion."""
    require_replaceable(config.out, MOTION, config.force)
    found, robot = run(config), config.robot_of()
    motion = found.motion
    write_motion(config.out, motion, config.force)
    v_most = float(np.abs(motion.v).max(initial=0.0))
    notes = beyond(motion.plant, v_most, robot.parameters.L)
    if config.json:
        about = {
            "controller": label_of(found.controller),
            "trajectory": found.path.name,
            "plant": motion.plant,
            "setting": config.setting,
            "hardware": config.built.words(),
            "period": period_of(found.controller),
            "v_gain": v_gain_of(found.controller),
            "rows": len(motion.time),
        }
        print(to_json(about | found.figures | {"beyond": notes, "out": str(config.out)}))
        return
    show_differences(robot)
    print(
        f"{spelled(config.out)}: {len(motion.time)} rows of the {motion.plant} plant, "
        f"{found.path.name} by {label_of(found.controller)}; {_told(found)}"
    )
    for note in notes:
        print(f"Note: {note}")
    if not config.built.ideal:
        print(f"Hardware: {config.built.words()}.")


def _told(found: Followed) -> str:
    """Return in words how well the tip follows, or when the loop diverged."""
    figures = found.figures
    if figures["diverged"]:
        return f"diverged at t = {figures['diverged_at']:.4g} s, the motion up to then is written"
    envelope, error, v = (MM * figures[name] for name in ("envelope", "rms_error", "max_v"))
    return f"envelope {envelope:.3f} mm, rms error {error:.3f} mm, largest |v| {v:.3f} mm"
