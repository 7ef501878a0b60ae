"""One batch of a study: runs with neighbouring numbers, in one compiled call for each kind.

>>> batch = prepare(workshop, 0, 256)
>>> rows = carried_out(workshop, batch, threads=2)      # a table, one row a run

The same rows, to the bit, whatever batch a run is in and however many threads work at it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from flexsim.loop.compiled_loop import Outcome
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.measuring import figure_columns
from flexsim.loop.motion import Motion
from flexsim.loop.populations import Stage, run_each
from flexsim.loop.runs import motion_of
from flexsim.numerics.noise import MASK
from flexsim.numerics.types import Array
from studies.run.columns import FIGURES, NONE_DIVERGED, results_schema, trace_schema
from studies.spec.building import Measured, Workshop
from studies.spec.designs import FACTORS as GAINS
from studies.spec.matrix import Indices, Runs

AT_ONCE = 16  # runs whose motion is recorded at a time: 16 x 5000 samples x 20 numbers, 13 MB
BLOCK = 1 << 14  # repeats whose perturbations are drawn at a time


class Perturbations:
    """Standard normal numbers (6,) for every repeat but the first, by the seed.

    Those of `studies.core.evidence.repeats.perturbed`, a block of repeats at a time.
    """

    def __init__(self, seed: int) -> None:
        self._states = [np.random.default_rng(seed).bit_generator.state]
        self._block, self._drawn = -1, np.empty((0, GAINS))

    def of(self, repeats: Indices) -> Array:
        """Return those of repeats (K,), zeros for the first; (K, 6)."""
        found = np.zeros((len(repeats), GAINS))
        for i, repeat in enumerate(repeats):
            if repeat > 0:
                block, row = divmod(int(repeat) - 1, BLOCK)
                found[i] = self._draw(block)[row]
        return found

    def _draw(self, block: int) -> Array:
        while self._block != block:
            self._block = block if len(self._states) > block else len(self._states) - 1
            rng = np.random.default_rng()
            rng.bit_generator.state = self._states[self._block]
            self._drawn = rng.standard_normal((BLOCK, GAINS))
            if len(self._states) == self._block + 1:
                self._states.append(rng.bit_generator.state)
        return self._drawn


@dataclass(frozen=True, eq=False)
class Group:
    """Runs of one compiled call.

    Attributes:
        stages: where they happen. measured: their references. which: (K,) of the stages.
        rows: (K,) of the batch. numbers: (K,) for their noise. controllers: K of them.
    """

    stages: list[Stage]
    measured: list[Measured]
    which: Indices
    rows: Indices
    numbers: Indices
    controllers: Controllers

    def run(self, threads: int | None, stride: int = 0, only: Indices | None = None) -> Outcome:
        """Return the outcome of all runs, or of some."""
        some = slice(None) if only is None else only
        return run_each(
            self.stages,
            self.which[some],
            self.numbers[some],
            self.controllers.chosen(some),
            stride,
            threads,
        )


@dataclass(frozen=True, eq=False)
class Batch:
    """Runs first to last, the latter not among them, ready to be carried out.

    Attributes:
        indices: what each run is of, arrays (K,). drawn: what their draws set, by column.
        groups: of one compiled call each.
    """

    first: int
    last: int
    indices: Runs
    drawn: list[Array]
    groups: list[Group]


def prepare(
    workshop: Workshop,
    first: int,
    last: int,
    perturbations: Perturbations | None = None,
    model: str | None = None,
) -> Batch:
    """Return a batch with all that it takes built.

    Args:
        perturbations: kept from batch to batch. model: of plants instead of their own.

    Raises:
        ParameterError, ModelError: something of it cannot be built.
    """
    return prepared(workshop, np.arange(first, last), perturbations, model)


def prepared(
    workshop: Workshop,
    runs: Indices,
    perturbations: Perturbations | None = None,
    model: str | None = None,
) -> Batch:
    """Return runs (K,) with all that they take built; see `prepare`."""
    matrix = workshop.matrix
    indices = matrix.indices(runs)
    drawn = matrix.draws.columns(indices.draw)
    noise = (indices.repeat + matrix.repeats * indices.draw) & MASK
    normals = (perturbations or Perturbations(workshop.study.seed)).of(indices.repeat)
    alike = np.stack([indices.plant, indices.robot, indices.draw, indices.combo], axis=1)
    starts = np.flatnonzero(np.append(True, (np.diff(alike, axis=0) != 0).any(axis=1)))
    ends = np.append(starts[1:], len(runs))
    gathered: dict[Any, list[Any]] = {}
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        run = indices.nth(start)
        values = tuple(float(column[start]) for column in drawn)
        stage = workshop.stage(run, values, model)
        combo = matrix.combos[run.combo]
        measured = workshop.measured(combo, stage.plant.parameters, values)[1]
        factors = 1.0 + workshop.perturbation(values) * normals[start:end]
        controllers = workshop.controllers(combo.controller, values, factors)
        sizes = (controllers.b.shape[1:], controllers.A.shape[1:])
        p = stage.plant.parameters
        loaded = p.payload > 0 or p.payload_inertia > 0  # a body more in EXUDYN's beam
        kind = (run.plant, len(stage.start), loaded, sizes)
        gathered.setdefault(kind, []).append((stage, measured, np.arange(start, end), controllers))
    groups = [_group(parts, noise) for parts in gathered.values()]
    return Batch(int(runs[0]), int(runs[-1]) + 1, indices, drawn, groups)


def _group(parts: Sequence[Any], noise: Indices) -> Group:
    """Return runs of one kind as one group."""
    stages, measured, rows, controllers = zip(*parts, strict=True)
    which = np.repeat(np.arange(len(stages)), [len(each) for each in rows])
    row = np.concatenate(rows)
    together = Controllers(*(np.concatenate(each) for each in zip(*controllers, strict=True)))
    return Group(list(stages), list(measured), which, row, noise[row], together)


def carried_out(workshop: Workshop, batch: Batch, threads: int | None = None) -> Any:
    """Return the results of a batch, a pyarrow.Table with one row a run."""
    count = len(batch.indices.repeat)
    columns = {name: np.full(count, np.nan) for name in _NUMBERS}
    for group in batch.groups:
        found = group.run(threads)
        by_reference: dict[int, list[int]] = {}
        for i, stage in enumerate(group.which):
            by_reference.setdefault(id(group.measured[stage]), []).append(i)
        for members in by_reference.values():
            some = np.array(members)
            of = group.measured[group.which[some[0]]]
            outcome = (found.sums[some], found.indices[some], found.diverged[some])
            for name, found_ones in figure_columns(*outcome, of.reference, of.hold).items():
                columns[name][group.rows[some]] = found_ones
    diverged = columns["diverged"] == 1.0
    for each in FIGURES:
        lost = np.nan if each.name in NONE_DIVERGED else np.inf
        columns[each.name][diverged] = lost
    return _table(workshop, batch, columns, diverged)


_NUMBERS = (*(each.name for each in FIGURES), "diverged", "diverged_at")


def _table(workshop: Workshop, batch: Batch, columns: dict[str, Array], diverged: Array) -> Any:
    """Return the rows of a batch: what runs are of, what their draws set, their figures."""
    matrix, schema = workshop.matrix, results_schema(workshop)
    i = batch.indices
    combos = np.array(matrix.combos)[i.combo]
    names = matrix.names
    places = {
        "plant": ("plants", i.plant),
        "robot": ("robots", i.robot),
        "trajectory": ("trajectories", combos[:, 0]),
        "setting": ("settings", combos[:, 1]),
        "hardware": ("hardware", combos[:, 2]),
        "controller": ("controllers", combos[:, 3]),
    }
    arrays: dict[str, Any] = {
        "run": np.ravel_multi_index(tuple(i), matrix.shape),
        "draw": i.draw,
        "repeat": i.repeat,
        **{name: pa.array(names[key]).take(pa.array(at)) for name, (key, at) in places.items()},
        **dict(zip(matrix.draws.paths, batch.drawn, strict=True)),
        "diverged": diverged,
    }
    for name in (*(each.name for each in FIGURES), "diverged_at"):
        arrays[name] = pa.array(columns[name], from_pandas=True)  # nan: none
    return pa.table([arrays[name] for name in schema.names], schema=schema)


def traces(workshop: Workshop, batch: Batch, wanted: str, threads: int | None = None) -> Any:
    """Return the time series of a batch's runs, a pyarrow.Table; None if none are wanted.

    Args:
        wanted: 'all', or 'nominal', of runs with the gains as they are.
    """
    tables = []
    for group in batch.groups:
        repeats = batch.indices.repeat[group.rows]
        chosen = np.flatnonzero(repeats == 0) if wanted == "nominal" else np.arange(len(group.rows))
        for start in range(0, len(chosen), AT_ONCE):
            some = chosen[start : start + AT_ONCE]
            outcome = group.run(threads, 1, some)
            for k, i in enumerate(some):
                stage, of = group.stages[group.which[i]], group.measured[group.which[i]]
                motion = motion_of(outcome, k, stage.plant, of.reference, energy=False)
                tables.append((int(batch.first + group.rows[i]), motion))
    if not tables:
        return None
    tables.sort(key=lambda each: each[0])
    return pa.concat_tables([trace_of(run, motion) for run, motion in tables])


def trace_of(run: int, motion: Motion) -> Any:
    """Return the time series of one run."""
    columns = [
        np.full(len(motion.time), run),
        motion.time,
        *motion.tip.T,
        *motion.reference_tip.T,
        *motion.joint.T,
        *motion.reference_joint.T,
        motion.v,
        *motion.error.T,
        *motion.torque.T,
        *motion.applied.T,
    ]
    return pa.table([np.ascontiguousarray(each) for each in columns], schema=trace_schema())
