"""Which run is which: what a file lists, crossed, numbered from 0.

>>> matrix = Matrix.of(resolved)
>>> matrix.runs, matrix.run(17)

Of a run's number the plant changes slowest, then robot, draw, trajectory, setting, hardware,
controller, repeat; so that what is costly to build is built once for many runs in a row.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexsim.errors import ParameterError
from studies.spec.draws import Draws
from studies.spec.parts import Study
from studies.spec.resolving import Resolved

RUNS_MOST = 10**9
Indices = NDArray[np.int64]


class Combo(NamedTuple):
    """Places in the file's lists."""

    trajectory: int
    setting: int
    hardware: int
    controller: int


class Run(NamedTuple):
    """What a run is of: places in the file's lists, its draw and its repeat."""

    plant: int
    robot: int
    draw: int
    combo: int
    repeat: int


class Runs(NamedTuple):
    """What several runs are of, an array (K,) each, as `Run` has it."""

    plant: Indices
    robot: Indices
    draw: Indices
    combo: Indices
    repeat: Indices

    def nth(self, place: int) -> Run:
        """Return what one of them is of."""
        return Run(*(int(each[place]) for each in self))


@dataclass(frozen=True, eq=False)
class Matrix:
    """All runs of a study.

    Attributes:
        names: of the items of each list. combos: what is run of trajectories, settings, hardware
            and controllers. draws: what is varied. repeats: of each.
    """

    names: dict[str, list[str]]
    combos: list[Combo]
    draws: Draws
    repeats: int

    @classmethod
    def of(cls, resolved: Resolved) -> Matrix:
        """Return the runs of a study.

        Raises:
            ParameterError: there are none, or more than RUNS_MOST; or as `Draws.of`.
        """
        study: Study = resolved.study
        try:
            draws = Draws.of(study.sweep, study.seed)
        except ParameterError as error:
            raise ParameterError(f"{resolved.source}: {error}") from None
        lists = ("robots", "plants", "controllers", "trajectories", "settings", "hardware")
        names = {key: [str(each["name"]) for each in resolved.document[key]] for key in lists}
        combos = [
            Combo(t, s, h, c)
            for t, trajectory in enumerate(names["trajectories"])
            for s in range(len(study.settings))
            for h in range(len(study.hardware))
            for c, controller in enumerate(study.controllers)
            if controller.trajectories is None or trajectory in controller.trajectories
        ]
        found = cls(names, combos, draws, study.repeats)
        if not combos:
            raise ParameterError(
                f"{resolved.source}: no controller runs on any trajectory; give one more of "
                "controllers[0].trajectories"
            )
        if found.runs > RUNS_MOST:
            raise ParameterError(
                f"{resolved.source}: {found.runs:,} runs; give {RUNS_MOST:,} at most"
            )
        return found

    @property
    def shape(self) -> tuple[int, int, int, int, int]:
        """Numbers of plants, robots, draws, combos, repeats."""
        plants, robots = len(self.names["plants"]), len(self.names["robots"])
        return plants, robots, self.draws.count, len(self.combos), self.repeats

    @property
    def runs(self) -> int:
        """Their number."""
        plants, robots, draws, combos, repeats = self.shape
        return plants * robots * draws * combos * repeats

    def run(self, number: int) -> Run:
        """Return what one run is of."""
        return Run(*(int(each) for each in np.unravel_index(number, self.shape)))

    def indices(self, numbers: Indices) -> Runs:
        """Return what runs (K,) are of."""
        found: Any = np.unravel_index(numbers, self.shape)
        return Runs(*(np.asarray(each, dtype=np.int64) for each in found))

    def cells(self, indices: Runs) -> Indices:
        """Return the cell (K,) of runs: what repeats and samples of distributions share.

        Numbered with the plant slowest, then robot, point of the grid, combo.
        """
        point = indices.draw // self.draws.samples
        every = (indices.plant, indices.robot, point, indices.combo)
        return np.asarray(np.ravel_multi_index(every, self.cell_shape), dtype=np.int64)

    @property
    def cell_shape(self) -> tuple[int, int, int, int]:
        """Numbers of plants, robots, points of the grid, combos."""
        plants, robots, _, combos, _ = self.shape
        return plants, robots, len(self.draws.grid), combos

    def cell(self, number: int) -> tuple[int, int, int, Combo]:
        """Return plant, robot, point of the grid and combo of a cell."""
        plant, robot, point, combo = (int(e) for e in np.unravel_index(number, self.cell_shape))
        return plant, robot, point, self.combos[combo]

    def factors(self, plant: int, robot: int, combo: Combo) -> dict[str, str]:
        """Return the names of what runs are of, as the columns of results have them."""
        return {
            "plant": self.names["plants"][plant],
            "robot": self.names["robots"][robot],
            "controller": self.names["controllers"][combo.controller],
            "trajectory": self.names["trajectories"][combo.trajectory],
            "setting": self.names["settings"][combo.setting],
            "hardware": self.names["hardware"][combo.hardware],
        }
