"""Waypoints from a CSV file: x,y or t,x,y in metres and seconds.

>>> read_points(Path("points.csv"))
([(0.7, 0.2), (0.3, 0.6)], [0.0, 4.0])
"""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

from flexsim.errors import ParameterError
from flexsim.files.reading import MIB, read_text
from flexsim.loop.waypoints import POINTS_MOST

POINTS_BYTES = MIB
HEADERS = (["x", "y"], ["t", "x", "y"])


def read_points(path: Path) -> tuple[list[tuple[float, float]], list[float]]:
    """Return the points of a file [m], and their times [s] where it has them, counted from 0.

    Raises:
        RunError: it cannot be read.
        ParameterError: its header is neither x,y nor t,x,y, or a row has other than finite numbers.
    """
    rows = csv.reader(io.StringIO(read_text(path, POINTS_BYTES, "waypoints"), newline=""))
    header = [name.strip().lower() for name in next(rows, [])]
    if header not in HEADERS:
        raise ParameterError(f"{path}: the first line is {','.join(header)!r}; give x,y or t,x,y")
    points: list[tuple[float, float]] = []
    times: list[float] = []
    for number, row in enumerate(rows, start=2):
        try:
            values = [float(cell) for cell in row]
        except ValueError:
            values = []
        if len(values) != len(header) or not all(map(math.isfinite, values)):
            raise ParameterError(
                f"{path}, line {number}: {','.join(row)[:60]!r} is not {len(header)} finite numbers"
            )
        if len(points) == POINTS_MOST:
            raise ParameterError(f"{path}: more than {POINTS_MOST} points; give fewer")
        points.append((values[-2], values[-1]))
        times += values[:-2]
    return points, [each - times[0] for each in times]
