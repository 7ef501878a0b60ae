"""A beam along its length, as a CSV file has it.

>>> place, EI, EI_out, rho = read_stations(Path("beam.csv"))     # EI_out None without a column
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from flexsim.errors import ParameterError, RunError
from flexsim.files.reading import MIB, read_text
from flexsim.numerics.types import Array

NAMES = ("s", "EI", "rho")  # [m, N m2, kg/m]
OUT = "EI_out"  # [N m2], that in the plane unless given
MOST = MIB  # bytes


def read_stations(path: Path) -> tuple[Array, Array, Array | None, Array]:
    """Return places, EI, EI out of the plane (None without such a column), rho (S,) of stations.

    Raises:
        RunError: the file cannot be read. ParameterError: it has other columns, or what is no
            number.
    """
    try:
        rows = list(csv.reader(io.StringIO(read_text(path, MOST, "file of stations")), strict=True))
    except csv.Error as error:
        raise RunError(f"{path}: cannot read the file of stations: {error}") from None
    head = [name.strip() for name in rows[0]] if rows else []
    if sorted(head) not in (sorted(NAMES), sorted([*NAMES, OUT])):
        shown = ",".join(head) or "nothing"
        raise ParameterError(
            f"{path}: line 1 is {shown[:60]!r}; give the names s,EI,rho, or s,EI,rho,EI_out"
        )
    columns: dict[str, list[float]] = {name: [] for name in head}
    for number, row in enumerate(rows[1:], start=2):
        if not row:
            continue
        if len(row) != len(head):
            raise ParameterError(f"{path}: line {number} has {len(row)} cells, not {len(head)}")
        for name, cell in zip(head, row, strict=True):
            try:
                columns[name].append(float(cell))
            except ValueError:
                raise ParameterError(
                    f"{path}: line {number} has {cell[:20]!r} for {name}; give a number"
                ) from None
    found = {name: np.array(values) for name, values in columns.items()}
    return found["s"], found["EI"], found.get(OUT), found["rho"]
