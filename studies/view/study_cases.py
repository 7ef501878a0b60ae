"""The runs of a study file as cases to look at: those of one cell on all plants, gains as they are.

>>> cases, robot = cases_of(Path("runs/mine"))              # doctest: +SKIP

A study keeps figures of merit, not shapes of beams; so what is shown is run again from its file.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow.parquet as pq

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError, RunError
from flexsim.loop.friction import Friction
from flexsim.loop.motion import Motion
from flexsim.loop.runs import motion_of
from flexsim.loop.trajectories import Reference
from flexsim.plants.base import Plant
from flexsim.recording.case import Case
from flexsim.recording.traces import CHAIN, MM
from studies.run.batches import prepared
from studies.run.columns import FACTORS
from studies.run.export import COUNTED
from studies.run.store import RESULTS, STUDY
from studies.spec.building import Workshop
from studies.spec.reading import read_study
from studies.spec.resolving import resolve

MOST = 8  # cases that are shown unless one is asked for
SHARED = tuple(name for name in FACTORS if name != "plant")
MERIT = (
    ("envelope", "envelope [mm]", MM),
    ("rms_error", "rms error [mm]", MM),
    ("max_v", "max \\|v\\| [mm]", MM),
)


class Moved(NamedTuple):
    """A run carried out again: its motion, plant, reference and friction."""

    motion: Motion
    plant: Plant
    reference: Reference
    friction: Friction


def is_study(folder: Path) -> bool:
    """Return whether a folder holds a finished run of a study file."""
    return (folder / RESULTS).is_file() and (folder / STUDY).is_file()


def cases_of(folder: Path, wanted: str = "", code: bool = True) -> tuple[list[Case], Parameters]:
    """Return the first cases of a study, or one by its name, and the robot of the first.

    Args:
        folder: of the run. wanted: name of a case. code: whether a function of the study may run.

    Raises:
        RunError: the results cannot be read. ParameterError: there is no such case.
    """
    workshop = Workshop(resolve(read_study(folder / STUDY), code))
    columns = [*COUNTED, *FACTORS, *(name for name, _, _ in MERIT), "diverged"]
    try:
        rows = pq.read_table(folder / RESULTS, columns=columns).to_pylist()
    except (OSError, ValueError) as error:
        raise RunError(f"{folder / RESULTS}: cannot read the results: {error}") from None
    cells: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for row in rows:
        if row["draw"] == 0 and row["repeat"] == 0:
            cells.setdefault(tuple(str(row[name]) for name in SHARED), []).append(row)
    names = _names(list(cells))
    if wanted and wanted not in names.values():
        raise ParameterError(f"--case {wanted!r}: there is none; choose one of {_listed(names)}")
    chosen = [key for key in cells if not wanted or names[key] == wanted][:MOST]
    numbers = np.array(sorted(row["run"] for key in chosen for row in cells[key]))
    moved = _again(workshop, numbers)
    found = [_case(names[key], key, cells[key], moved) for key in chosen]
    return found, moved[int(numbers[0])].plant.parameters


def _listed(names: dict[tuple[str, ...], str]) -> str:
    """Return names for a message."""
    return ", ".join(sorted(names.values()))


def _names(cells: Sequence[tuple[str, ...]]) -> dict[tuple[str, ...], str]:
    """Return a name for every cell, of what differs between them."""
    differ = [i for i in range(len(SHARED)) if len({cell[i] for cell in cells}) > 1]
    found: dict[tuple[str, ...], str] = {}
    for cell in cells:
        words = [cell[i] for i in differ] or [cell[SHARED.index("trajectory")]]
        name = re.sub(r"[^A-Za-z0-9_.-]+", "-", "_".join(words)).lstrip("-.") or "case"
        while name in found.values():
            name += "_"
        found[cell] = name
    return found


def _again(workshop: Workshop, runs: np.ndarray) -> dict[int, Moved]:
    """Return the motions of runs by their numbers, with their plants and references."""
    found = {}
    batch = prepared(workshop, runs)
    for group in batch.groups:
        outcome = group.run(None, 1)
        for k, row in enumerate(group.rows):
            plant = group.stages[group.which[k]].plant
            ref = group.measured[group.which[k]].reference
            combo = workshop.matrix.combos[batch.indices.nth(int(row)).combo]
            values = tuple(float(column[row]) for column in batch.drawn)
            friction = workshop.setting(combo, values)[1].friction
            motion = motion_of(outcome, k, plant, ref)
            found[int(runs[row])] = Moved(motion, plant, ref, friction)
    return found


def _case(
    name: str,
    key: tuple[str, ...],
    rows: Sequence[dict[str, Any]],
    moved: dict[int, Moved],
) -> Case:
    """Return one cell as a case: its run on every plant."""
    factors = dict(zip(SHARED, key, strict=True))
    runs = {str(row["plant"]): moved[row["run"]] for row in rows}
    first = next(iter(runs.values()))
    motions = {plant: replace(each.motion, plant=plant) for plant, each in runs.items()}
    model = next((each.plant.model for name, each in runs.items() if name == CHAIN), None)
    return Case(
        name,
        factors["trajectory"],
        factors["controller"],
        factors["setting"],
        motions,
        model,
        first.reference,
        factors["hardware"],
        shown={str(row["plant"]): f"run {row['run']}" for row in rows},
        friction=first.friction,
        merit={str(row["plant"]): _merit(row) for row in rows},
    )


def _merit(row: dict[str, Any]) -> dict[str, str]:
    """Return the figures of merit of one run in words."""
    found = {title: f"{scale * row[name]:.4g}" for name, title, scale in MERIT}
    return {**found, "diverged": "yes" if row["diverged"] else "no"}
