"""A study of your own: do the models' frequencies agree at every pose?

    python examples/poses.py --out runs/poses

A study is a configuration, a `run` from it to rows, and what is shown of them: tables, a verdict,
figures. The rest comes with `Study`: options checked, a run folder whole or not at all, tables as
CSV, markdown and LaTeX, figures for print, JSON.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import tyro
from matplotlib.figure import Figure
from rich.progress import Progress

from flexsim.errors import FlexsimError, ParameterError
from flexsim.numerics.eigen import natural_modes
from flexsim.numerics.types import Array
from flexsim.plants.base import Plant
from studies.core.carry_out import Study, counted
from studies.core.figures import SINGLE, canvas, drawn, finish, styles
from studies.core.study_options import Out, StudyOptions
from studies.core.table import Column, Table
from studies.main import complain

MODES = 3  # that are compared


@dataclass(frozen=True)
class PosesConfig(StudyOptions):
    """Compare the frequencies of the arm with free joints, pose by pose."""

    QUICK: ClassVar = {"poses": 3}

    out: Out = Path("runs/poses")
    plants: tuple[str, ...] = ("assumed-modes", "chain")
    """By their names, the reference first."""
    poses: int = 9
    """How many, from joint 2 straight to at a right angle."""


@dataclass(frozen=True, eq=False)
class PoseRow:
    """A plant at a pose: theta2 [rad], its frequencies (3,) [Hz], their largest relative error."""

    plant: str
    theta2: float
    frequency: Array
    error: float


def frequencies(plant: Plant, theta2: float) -> Array:
    """Return the first frequencies (3,) with both joints free [Hz].

    Raises:
        ParameterError: the model has not as many.
    """
    linear = plant.linearised(theta2)
    if len(linear.M) < 2 + MODES:
        raise ParameterError(f"{plant.name} has fewer than {MODES} modes; take a finer model")
    squared, _ = natural_modes(linear.K, linear.M)
    found: Array = np.sqrt(squared[2 : 2 + MODES]) / (2 * np.pi)  # the first two are the joints
    return found


def run(config: PosesConfig, progress: Progress | None = None) -> list[PoseRow]:
    """Return the rows, pose by pose.

    Raises:
        ParameterError: an option out of range.
    """
    config = config.asked()
    if config.poses < 2:
        raise ParameterError(f"poses is {config.poses}; give 2 or more")
    plants = [config.robot_of().plant(name) for name in config.plants]
    rows = []
    for theta2 in counted(progress, "poses", np.linspace(0.0, np.pi / 2, config.poses).tolist()):
        found = [frequencies(plant, theta2) for plant in plants]
        for plant, each in zip(plants, found, strict=True):
            error = float(np.abs(each / found[0] - 1).max())
            rows.append(PoseRow(plant.name, theta2, each, error))
    return rows


COLUMNS = (
    Column("theta2", unit="rad", form=".2f", once=True),
    *(Column("frequency", f"mode {i + 1}", "Hz", ".3f", index=i) for i in range(MODES)),
    Column("error", "largest error", "%", ".3f", scale=100),
)


def tables(rows: Sequence[PoseRow]) -> list[Table]:
    """Return the rows as one table, the plants of a pose on a line."""
    title = "Frequencies with free joints: " + " | ".join(dict.fromkeys(r.plant for r in rows))
    return [Table(rows, COLUMNS, title, key="rows", file="results.csv", line=("theta2",))]


def verdict(rows: Sequence[PoseRow]) -> str:
    """Return the answer in words."""
    worst = max(rows, key=lambda row: row.error)
    return (
        f"Frequencies differ by {100 * worst.error:.3f} % at most, at theta2 = {worst.theta2:.2f} "
        f"rad on {worst.plant}."
    )


@drawn
def curves(rows: Sequence[PoseRow]) -> Figure:
    """Return the frequencies over the poses."""
    figure, panels = canvas(MODES, 1, height=110, width=SINGLE)
    look = styles(dict.fromkeys(row.plant for row in rows))
    for i, axes in enumerate(panels[:, 0]):
        for plant, how in look.items():
            mine = [row for row in rows if row.plant == plant]
            axes.plot([r.theta2 for r in mine], [r.frequency[i] for r in mine], label=plant, **how)
        axes.set_ylabel(f"mode {i + 1} [Hz]")
    panels[-1, 0].set_xlabel("theta2 [rad]")
    return finish(
        figure, list(panels[:, 0]), legend=2, caption="Frequencies with both joints free, by pose."
    )


def figures(rows: Sequence[PoseRow]) -> Iterator[tuple[str, Figure]]:
    """Give the figures by the names of their files."""
    yield "poses", curves(rows)


command = Study(run, tables, verdict, figures, question="Do frequencies agree at every pose?")

if __name__ == "__main__":
    try:
        command(tyro.cli(PosesConfig))
    except FlexsimError as error:
        sys.exit(complain(error))
