"""Do the models of an arm whose links both bend vibrate like its beams? Their frequencies.

>>> two_flexible_tables(vibrating(Robot.named("two-flexible")))[0].render()
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexsim.arm.arms import PUBLISHED_HZ, Arm, named_arm
from flexsim.arm.beam import beta_lengths, load_of
from flexsim.arm.parameters import Parameters
from flexsim.arm.series_beams import series_frequencies
from flexsim.errors import ParameterError
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from flexsim.robot import Robot
from studies.core.table import Column, Table
from studies.parity.report import FREQUENCIES, ModeRow

MODES = 6  # flexible ones of the whole arm that are compared
ENOUGH = 5  # assumed modes of each link, so that these six are theirs
POSES = (0.0, 1.2)  # [rad] of joint 2


@dataclass(frozen=True, eq=False)
class TwoFlexibleModes:
    """Frequencies [Hz]: of the arm with free joints, by pose and model; of each link, published.

    Attributes:
        source: the file, or the arm's name. poses: of joint 2 [rad].
        joint_free_hz: model by model, (poses, 6). clamped_hz: of links 1 and 2, two modes each.
        published_hz: the same as printed. step: the chains' [s].
    """

    source: str
    poses: tuple[float, ...]
    joint_free_hz: dict[str, Array]
    clamped_hz: Array
    published_hz: Array
    step: float


def vibrating(robot: Robot, chain: Plant | None = None) -> TwoFlexibleModes:
    """Return how the models of an arm whose links both bend vibrate.

    Of a file the chain is its own; what it is compared with is the arm `two-flexible`, which it
    stood for when it was written.

    Args:
        robot: the arm. chain: instead of the robot's own.

    Raises:
        ParameterError: too few segments for six modes.
    """
    arm = named_arm("two-flexible")
    if robot.link1 is not None:
        arm = Arm(robot.parameters, robot.link1)
    chain = chain or robot.plant("chain")
    named = Robot(arm.parameters, link1=arm.link1)
    plants = {"assumed_modes": named.plant(f"assumed-modes:{ENOUGH}"), "chain": chain}
    found = {"exact": np.array([series_frequencies(arm, MODES, pose) for pose in POSES])}
    for name, plant in plants.items():
        found[name] = np.array([_free(plant, pose) for pose in POSES])
    return TwoFlexibleModes(
        source="two-flexible" if robot.file is None else robot.file.source,
        poses=POSES,
        joint_free_hz={name: omega / (2 * np.pi) for name, omega in found.items()},
        clamped_hz=clamped_hz(arm),
        published_hz=np.array(PUBLISHED_HZ),
        step=chain.step,
    )


def clamped_hz(arm: Arm) -> Array:
    """Return two frequencies (2, 2) of each link, its joint locked and what it carries rigid [Hz].

    Source: the boundary conditions of De Luca and Siciliano.
    """
    p = arm.parameters
    links = ((arm.beam1, arm.load1), (p, load_of(p)))
    return np.array([[b * b * _unit(own) for b in beta_lengths(2, load)] for own, load in links])


def _unit(beam: Parameters) -> float:
    return float(np.sqrt(beam.EI / beam.rho) / beam.L**2 / (2 * np.pi))


def _free(plant: Plant, theta2: float) -> Array:
    """Return the first flexible frequencies of a plant with free joints [rad/s]."""
    linear = plant.linearised(theta2)
    squared, _ = natural_modes(linear.K, linear.M)
    if len(squared) < 2 + MODES:
        raise ParameterError(
            f"the {plant.name} plant has {len(squared) - 2} flexible modes; {MODES} are compared: "
            "give more segments"
        )
    return np.sqrt(squared[2 : 2 + MODES])


@dataclass(frozen=True)
class PublishedRow:
    """A frequency of one link [Hz], computed and as published."""

    link: int
    mode: int
    computed: float
    published: float


PUBLISHED = (
    Column("link", form="d"),
    Column("mode", form="d"),
    Column("computed", form=".4f"),
    Column("published", form=".2f"),
)


def two_flexible_tables(result: TwoFlexibleModes) -> list[Table]:
    """Return a table for each pose, and one of the links' own frequencies."""
    models = [result.joint_free_hz[name] for name in ("exact", "assumed_modes", "chain")]
    tables = []
    for i, pose in enumerate(result.poses):
        columns = zip(*(each[i] for each in models), strict=True)
        rows = [ModeRow(k, *map(float, each)) for k, each in enumerate(columns, 1)]
        title = f"Frequencies with both joints free at theta2 = {pose:g} rad [Hz]"
        tables.append(Table(rows, FREQUENCIES, title))
    links = [
        PublishedRow(
            link + 1, mode + 1, float(result.clamped_hz[link, mode]), PUBLISHED_HZ[link][mode]
        )
        for link in range(2)
        for mode in range(2)
    ]
    title = "Each link with locked joints, what it carries rigid, and as published [Hz]"
    return [*tables, Table(links, PUBLISHED, title)]


def two_flexible_verdict(result: TwoFlexibleModes) -> str:
    """Return in words how far the models are off."""
    exact = result.joint_free_hz["exact"]
    off = {
        name: float(np.abs(result.joint_free_hz[name] / exact - 1).max())
        for name in ("assumed_modes", "chain")
    }
    return (
        f"{result.source}: with free joints {ENOUGH} assumed modes of each link are within "
        f"{100 * off['assumed_modes']:.2g} %, the chains within {100 * off['chain']:.2g} % of the "
        f"exact first {MODES} frequencies; the chains' step is {1e3 * result.step:g} ms."
    )
