"""What a study's runs say: medians with intervals, paired differences, shares that diverged.

>>> rows = summary_rows(Cells(store, matrix), seed=1)
>>> rows[0].figure, rows[0].median, rows[0].low, rows[0].high

A cell is what repeats and samples of distributions share: a plant, a robot, a controller, a
trajectory, a setting, hardware and a point of the grid. Cells that differ in the plant alone, or
in the controller alone, are compared run by run: the same draw and repeat in both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexsim.numerics.types import Array
from studies.core.evidence.intervals import (
    difference_interval,
    known_ends,
    ratio_interval,
    share_interval,
)
from studies.core.evidence.repeats import summary
from studies.run.columns import FIGURES
from studies.run.store import Store
from studies.spec.matrix import Combo, Matrix

COMPARED = ("envelope", "rms_error", "max_v", "index")  # figures of pairs
PLANTS, CONTROLLERS = "plants", "controllers"


@dataclass(frozen=True)
class FigureRow:
    """A figure of merit of one cell, in SI units; None where half of the runs diverged.

    Attributes:
        what: 'cells', or what it is compared with.
        factors: names of the plant, robot, controller, trajectory, setting and hardware.
        point: the numbers of the grid, by path.
    """

    what: str
    factors: dict[str, str]
    point: dict[str, float]
    figure: str
    unit: str
    runs: int
    median: float | None


@dataclass(frozen=True)
class CellRow(FigureRow):
    """How sure a median is, and how many runs diverged.

    Attributes:
        low, high: 95 % interval of the median; None with fewer than six runs, or for an open end.
        diverged_share_low, diverged_share_high: 95 % interval, Wilson's.
    """

    low: float | None
    high: float | None
    quartile_1: float | None
    quartile_3: float | None
    diverged: int
    diverged_share: float
    diverged_share_low: float
    diverged_share_high: float


@dataclass(frozen=True)
class PairRow(FigureRow):
    """A cell against the first plant or controller, in all else the same: paired runs.

    Attributes:
        what: 'plants' or 'controllers'. against: the name of the other, which is subtracted and
            divided by. difference, ratio: of medians, with 95 % intervals by bootstrap of pairs.
    """

    against: str
    difference: float | None
    difference_low: float | None
    difference_high: float | None
    ratio: float | None
    ratio_low: float | None
    ratio_high: float | None


class Cells:
    """Figures of a study's runs, cell by cell.

    A column of the results is read at a time, sorted by cells: 8 bytes a run.
    """

    def __init__(self, store: Store, matrix: Matrix) -> None:
        self.store, self.matrix = store, matrix
        runs = np.arange(matrix.runs)
        self.of = matrix.cells(matrix.indices(runs)).astype(np.int32)
        self.order = np.argsort(self.of, kind="stable")
        count = math.prod(matrix.cell_shape)
        self.ends = np.searchsorted(self.of[self.order], np.arange(count + 1))

    def __len__(self) -> int:
        return math.prod(self.matrix.cell_shape)

    def column(self, name: str) -> list[Array]:
        """Return a column's numbers cell by cell, in the order of draws and repeats."""
        found = self.store.figure(name)
        values = np.asarray(found, dtype=float)[self.order]
        return [values[a:b] for a, b in zip(self.ends[:-1], self.ends[1:], strict=True)]

    def about(self, cell: int) -> dict[str, Any]:
        """Return the names of what a cell is of, and its point of the grid."""
        plant, robot, point, combo = self.matrix.cell(cell)
        draws = self.matrix.draws
        numbers = dict(zip(draws.gridded, draws.grid[point], strict=True))
        return {"factors": self.matrix.factors(plant, robot, combo), "point": numbers}

    def pairs(self) -> Iterator[tuple[str, int, int, str]]:
        """Give what is compared, the cell, the one it is compared to, and the other's name."""
        shape, names = self.matrix.cell_shape, self.matrix.names
        places = {combo: i for i, combo in enumerate(self.matrix.combos)}
        for cell in range(len(self)):
            plant, robot, point, combo = self.matrix.cell(cell)
            if plant > 0:
                other = np.ravel_multi_index((0, robot, point, places[combo]), shape)
                yield PLANTS, cell, int(other), names["plants"][0]
            first = self._first_controller(combo)
            if first != combo:
                other = np.ravel_multi_index((plant, robot, point, places[first]), shape)
                yield CONTROLLERS, cell, int(other), names["controllers"][first.controller]

    def _first_controller(self, combo: Combo) -> Combo:
        """Return the same with the first controller that runs there."""
        alike = (each for each in self.matrix.combos if each[:3] == combo[:3])
        return min(alike, key=lambda each: each.controller)


def summary_rows(cells: Cells, seed: int) -> list[CellRow | PairRow]:
    """Return the rows of every cell and figure, then those of pairs.

    Args:
        seed: of the bootstrap.
    """
    lost = [int(each.sum()) for each in cells.column("diverged")]
    about = [cells.about(cell) for cell in range(len(cells))]
    pairs = list(cells.pairs())
    rows: list[CellRow | PairRow] = []
    paired: list[CellRow | PairRow] = []
    for figure in FIGURES:
        column = cells.column(figure.name)
        for cell, values in enumerate(column):
            rows.append(_cell_row(about[cell], figure, values, lost[cell]))
        if figure.name in COMPARED:
            for what, cell, other, name in pairs:
                own = column[cell], column[other]
                paired.append(_pair_row(what, about[cell], figure, own, name, seed))
    return rows + paired


def _cell_row(about: dict[str, Any], figure: Any, values: Array, lost: int) -> CellRow:
    """Return the row of a figure in one cell."""
    found = summary("x", list(values[~np.isnan(values)]))
    low, high = share_interval(lost, len(values))
    return CellRow(
        what="cells",
        **about,
        figure=figure.name,
        unit=figure.unit,
        runs=len(values),
        median=found["x"],
        low=found["x_low"],
        high=found["x_high"],
        quartile_1=found["x_quartile_1"],
        quartile_3=found["x_quartile_3"],
        diverged=lost,
        diverged_share=lost / len(values),
        diverged_share_low=low,
        diverged_share_high=high,
    )


def _pair_row(
    what: str, about: dict[str, Any], figure: Any, own: tuple[Array, Array], name: str, seed: int
) -> PairRow:
    """Return the row of a figure in one cell, against another."""
    mine, other = own
    one, two = (summary("x", list(each))["x"] for each in (mine, other))
    known = one is not None and two is not None
    difference = ratio = None
    if known:
        difference = difference_interval(mine, other, seed)
        ratio = ratio_interval(mine, other, seed)
    difference_low, difference_high = known_ends(difference)
    ratio_low, ratio_high = known_ends(ratio)
    return PairRow(
        what=what,
        **about,
        figure=figure.name,
        unit=figure.unit,
        runs=len(mine),
        median=one,
        against=name,
        difference=None if one is None or two is None else one - two,
        difference_low=difference_low,
        difference_high=difference_high,
        ratio=None if one is None or not two else one / two,
        ratio_low=ratio_low,
        ratio_high=ratio_high,
    )
