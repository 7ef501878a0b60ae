"""Can all of a study be built? Tried at the corners of its sweep before anything runs.

>>> require_buildable(workshop)
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexsim.errors import FlexsimError, ParameterError
from studies.spec.building import Workshop
from studies.spec.matrix import Run

ONE = np.ones((1, 6))  # gains as they are
DRAWS_MOST = 64  # tried of a sweep's, and as many points of a grid


def require_buildable(workshop: Workshop) -> None:
    """Build every plant, reference and controller at some draws.

    Raises:
        ParameterError, ModelError: something cannot be built; with its place in the file.
    """
    matrix = workshop.matrix
    plants, robots, _, combos, _ = matrix.shape
    for draw in tried(workshop):
        values = matrix.draws.values(draw)
        try:
            workshop.perturbation(values)
            for controller in range(len(workshop.study.controllers)):
                workshop.controllers(controller, values, ONE)
            for plant in range(plants):
                for robot in range(robots):
                    for combo in range(combos):
                        workshop.stage(Run(plant, robot, draw, combo, 0), values)
        except FlexsimError as error:
            raise ParameterError(f"{error}{workshop.swept(values)}") from None
    _require_determined(workshop)


def _require_determined(workshop: Workshop) -> None:
    """Refuse a function that designs another controller when it is asked again."""
    values, other = workshop.matrix.draws.values(0), Workshop(workshop.resolved)
    for number, part in enumerate(workshop.study.controllers):
        if part.function is None:
            continue
        one, two = (shop.controllers(number, values, ONE) for shop in (workshop, other))
        if not all(np.array_equal(a, b) for a, b in zip(one, two, strict=True)):
            with workshop.within("controllers", number):
                raise ParameterError(
                    f"function {part.function!r} gives another controller each time; seed what is "
                    "random in it"
                )


def tried(workshop: Workshop) -> list[int]:
    """Return the draws to try: points of the grid, its ends among them; the extreme samples."""
    draws = workshop.matrix.draws
    points = _spread(len(draws.grid))
    samples = sorted({0, *_extremes(draws.unit)})
    return [point * draws.samples + sample for point in points for sample in samples[:DRAWS_MOST]]


def _spread(count: int) -> list[int]:
    """Return up to DRAWS_MOST numbers below a count, evenly, both ends among them."""
    if count <= DRAWS_MOST:
        return list(range(count))
    return sorted({round(each) for each in np.linspace(0, count - 1, DRAWS_MOST)})


def _extremes(unit: np.ndarray) -> Iterator[int]:
    """Give the samples in which some number is least or largest."""
    for column in unit.T:
        yield int(np.argmin(column))
        yield int(np.argmax(column))
