"""Which robot a command is about: `--robot.*`, `--mjcf`; what a file changes; the file it keeps.

>>> robot = config.robot_of()
>>> show_differences(robot)                   # what the file changes
>>> keep_file(folder, robot)                  # in the run
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

from rich.console import Console

from flexsim.arm.free_arm import clamped_frequencies
from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.loop.hardware import Hardware, overridden
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.differences import Difference, arm_like, differences
from flexsim.mjcf.reading.names import Names
from flexsim.mjcf.rod_file import RodModel
from flexsim.robot import Robot
from flexsim.robot.named import robot_named
from studies import headings
from studies.core.console import console
from studies.core.table import Column, Table, write_prints
from studies.core.text import spelled

ArmName = Literal["paper", "one-link", "two-flexible"]
OF_PAPERS_ARM = (  # commands that ask about the paper's paths, controllers, figures or poles
    *(
        "compare",
        "ladder",
        "converge",
        "benchmark",
        "realisations",
        "screening",
        "structures",
        "tables",
    ),
    *("pid-question", "misprints", "reconstruct", "laboratory", "stability"),
)
ROBOT_FILE = "robot.xml"
DIFFERENCES_FILE = "robot_differences.csv"
ROWS_SHOWN = 16
DIFFERENCES = tuple(map(Column, Difference._fields))


@dataclass(frozen=True, kw_only=True)
class NameOptions:
    """What the robot's file calls the parts of the arm, where it has names of its own."""

    PANEL: ClassVar = headings.ROBOT

    joint1: str | None = None
    """With --mjcf, the file's own name of joint 1, if it has another."""
    joint2: str | None = None
    """With --mjcf, the file's own name of joint 2."""
    hub: str | None = None
    """With --mjcf, the file's own name of the site hub, or a body behind joint 2 to put it on."""
    tip: str | None = None
    """With --mjcf, the file's own name of the site tip; or a body to put it on, at its far end, or
    at a place on it [m], as 'hand 0.02 0 0'."""
    motor1: str | None = None
    """With --mjcf, the file's own name of the motor of joint 1."""
    motor2: str | None = None
    """With --mjcf, the file's own name of the motor of joint 2."""

    @property
    def names(self) -> Names:
        """What the file calls the parts of the arm."""
        return Names(**{item.name: getattr(self, item.name) for item in fields(Names)})


@dataclass(frozen=True, kw_only=True)
class OwnRobotOptions(NameOptions):
    """The robot by its numbers, or the names in its file."""

    PANEL: ClassVar = headings.ROBOT

    robot: Parameters = field(default_factory=Parameters)
    """The robot, in every model of it, unless --mjcf gives a file."""
    modal_damping: tuple[float, ...] = ()
    """Damping ratios of the assumed modes, one for each, instead of --robot.zeta; chains get the
    first one's, and ratios that grow with the frequency."""


@dataclass(frozen=True, kw_only=True)
class RobotOptions(OwnRobotOptions):
    """Which robot a command is about."""

    PANEL: ClassVar = headings.ROBOT

    arm: ArmName = "paper"
    """Which robot, unless --mjcf gives a file: the paper's, one flexible link on a stand, or two
    flexible links (De Luca and Siciliano, 1991)."""
    mjcf: Path | None = None
    """MJCF file that is the robot, in every model of it; the paper's robot unless given."""
    beam: Literal["file", "analytic"] = "file"
    """With --mjcf, the modes of the assumed-modes plant: the file's own chain's, or the paper's
    beam's on the file's rigid bodies."""

    @property
    def for_tuning(self) -> dict[str, Any]:
        """The same options of a `studies.tuning.tuning.Tuning`."""
        mjcf = None if self.mjcf is None else str(self.mjcf)
        own = {"robot": self.robot, "modal_damping": self.modal_damping, "arm": self.arm}
        return {"mjcf": mjcf, "beam": self.beam} | own | vars(self.names)

    @property
    def has_exact_loop(self) -> bool:
        """Whether the robot's beam is a uniform one, of which there is an exact linear loop."""
        return self.mjcf is None and not self.modal_damping

    def robot_of(self) -> Robot:
        """Return the robot.

        Raises:
            ParameterError, ModelError: as `Robot.of`.
        """
        own = None if self.robot == type(self)._usual_robot() else self.robot
        if self.arm != "paper":
            return robot_named(self.arm, self.mjcf, own, self.beam, self.modal_damping, self.names)
        if self.mjcf is None:
            own = self.robot
        return Robot.of(
            self.mjcf, self.beam, own, names=self.names, modal_damping=self.modal_damping
        )

    @classmethod
    def _usual_robot(cls) -> Parameters:
        """Return the robot that the command has unless told otherwise."""
        item: Any = cls.__dataclass_fields__["robot"]
        usual: Parameters = item.default_factory()
        return usual


def require_arm(command: str, config: object) -> None:
    """Refuse another arm than the paper's where a command is about that one.

    Raises:
        ParameterError: the command line names one.
    """
    arm = getattr(config, "arm", None)
    if arm not in (None, "paper") and command in OF_PAPERS_ARM:
        raise ParameterError(
            f"{command} asks about the paper's arm, its paths or its beam, not about --arm "
            f"{arm}; leave it out, or give it to flexsim modes, drive, follow, tune or animate, or "
            f'to a study file ([robot] arm = "{arm}") for flexsim run'
        )


@dataclass(frozen=True, kw_only=True)
class HardwareNumberOptions:
    """Numbers of sensors, computer and motors in place of the named hardware's."""

    PANEL: ClassVar = headings.HARDWARE

    hardware_delay: int | None = None
    """From measurement to torque, whole samples; the hardware's own unless given."""
    hardware_torque_limit: tuple[float, float] | None = None
    """Largest torques of the motors [N m], inf for none; the hardware's own unless given."""
    hardware_counts: int | None = None
    """Of both joints' encoders, per turn, 0 for exact angles; the hardware's own unless given."""
    hardware_noise: float | None = None
    """Noise on v, root mean square [m], its seed the command's; the hardware's own unless given."""
    hardware_lag: float | None = None
    """Time constant of the motors' first-order lag [s]; the hardware's own unless given."""
    hardware_with: tuple[str, ...] = ()
    """More of sensors, motors and joints, as ripple=0.02,0.02 (in studies/README.md); none unless
    given."""


@dataclass(frozen=True, kw_only=True)
class HardwareOptions(HardwareNumberOptions):
    """Which sensors, computer and motors are in the loop."""

    PANEL: ClassVar = headings.HARDWARE

    hardware: str = "ideal"
    """ideal, the paper's; bench (assumed: a sample of delay, 10 and 5 N m, 8192 counts a turn,
    0.1 mm of noise on v); bridges, the bench with v from two strain bridges; or worn, the bench
    with worn joints (in studies/README.md)."""

    @property
    def hardware_numbers(self) -> dict[str, Any]:
        """These options, as a `studies.tuning.tuning.Tuning` has them, too."""
        return {item.name: getattr(self, item.name) for item in fields(HardwareOptions)}

    @property
    def built(self) -> Hardware:
        """The hardware, its noise by the seed of what has one.

        Raises:
            ParameterError: there is none of that name, or a number is out of range.
        """
        return overridden(seed=getattr(self, "seed", 0), **self.hardware_numbers)

    @property
    def hardware_words(self) -> str:
        """The hardware in words, for notes and files."""
        return self.built.words()


def damping_note(robot: Robot) -> str:
    """Return which damping ratios a chain has where the assumed modes have some of their own."""
    asked = robot.modal_damping
    omega = clamped_frequencies(robot.parameters, len(asked))
    own = ", ".join(f"{robot.parameters.eta * each / 2:.3g}" for each in omega)
    given = ", ".join(f"{each:.3g}" for each in asked)
    return (
        f"Note: the assumed modes have the damping ratios {given}; chains and rods, damped in "
        f"proportion to stiffness, {own} or nearly"
    )


def show_differences(robot: Robot, out: Console | None = None) -> None:
    """Print what the robot's file changes, and what of its damping no chain follows, if any."""
    out = out or console()
    if robot.modal_damping:
        out.print(damping_note(robot))
    if robot.given is None:
        return
    rows = differences(robot.given)
    if not rows:
        out.print(f"{spelled(robot.given.source)}: the same robot as {_default_of(robot.given)}")
        return
    more = f"and {len(rows) - ROWS_SHOWN} more" if len(rows) > ROWS_SHOWN else ""
    title = f"{spelled(robot.given.source)} differs from {_default_of(robot.given)}:"
    plain = [Difference(*map(spelled, row)) for row in rows[:ROWS_SHOWN]]
    out.print(Table(plain, DIFFERENCES, title, more).render())


def _default_of(arm: ChainModel | RodModel) -> str:
    name = arm_like(arm)
    return "the default" if name == "paper" else f"--arm {name}"


def keep_file(folder: Path, robot: Robot) -> None:
    """Write the robot's file and its differences from the default into a run, if there is one."""
    if robot.given is None:
        return
    (folder / ROBOT_FILE).write_text(robot.given.text, encoding="utf-8")
    with (folder / DIFFERENCES_FILE).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Difference._fields)
        writer.writerows(differences(robot.given))
    title = f"{spelled(robot.given.source)} differs from {_default_of(robot.given)}"
    table = Table([Difference(*map(spelled, row)) for row in differences(robot.given)], DIFFERENCES)
    write_prints(folder / DIFFERENCES_FILE, [replace(table, title=title)])
