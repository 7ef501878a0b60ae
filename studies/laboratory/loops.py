"""The loops whose envelopes are asked for, and compiled populations of them at many places.

>>> loops = loops_of("default", config, repeats=16)
>>> found = envelopes(loops, jobs)        # [m], inf where diverged

Repeats of a case differ in the fourth digits of the gains and in the noise. Repeats i of all
places are pairs: the same gains, the same noise. Equal jobs are run once, and where v has no part
in the loop all places are equal that differ in how it is measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from controllers import COLLOCATED, TUNED
from flexsim.arm.parameters import Parameters
from flexsim.loop.control.compiled import Controllers
from flexsim.loop.control.stacking import stack
from flexsim.loop.measuring import ENVELOPE, ROWS, TORQUE, VARIATION, Yardstick, yardstick
from flexsim.loop.populations import Stage, run_each
from flexsim.loop.runs import loop_of
from flexsim.loop.settings import V_GAIN
from flexsim.loop.trajectories import Reference, reference, trajectory
from flexsim.numerics.clocks import PERIOD
from flexsim.numerics.types import Array
from studies.core.evidence.kept import Kept
from studies.core.evidence.repeats import perturbed
from studies.core.paper import CASES, case_name
from studies.laboratory.place import Place

AT_ONCE = 1024  # runs of a population: between two moves of the progress bar


@dataclass(frozen=True, eq=False)
class Case:
    """A reference, and what runs are measured against on it."""

    name: str
    reference: Reference
    yard: Yardstick


@dataclass(frozen=True, eq=False)
class Loops:
    """The paper's four cases under one kind of controllers.

    Attributes:
        name: of the controllers. v_gain: factor of atan(v/(r+L)) in their loops.
        cases: in the paper's order. controllers: of all, case by case, repeat by repeat.
        repeats: of each case. seed: of their luck. threads: None for all. kept: what was run
            before, None to run it all.
    """

    name: str
    v_gain: float
    cases: tuple[Case, ...]
    controllers: Controllers
    repeats: int
    seed: int
    threads: int | None = None
    kept: Kept | None = None


class Job(NamedTuple):
    """One run: where, which of the cases, which of its repeats."""

    place: Place
    case: int
    repeat: int


class Found(NamedTuple):
    """What came of jobs: envelopes (J,) [m], inf where diverged; rms and total variation of both
    commanded torques (J, 2) [N m].
    """

    envelope: Array
    rms: Array
    variation: Array


KINDS: Mapping[str, tuple[Mapping[str, Any], float]] = {
    "default": (TUNED, V_GAIN),
    "collocated": (dict.fromkeys(TUNED, COLLOCATED), COLLOCATED.v_gain),
}


def loops_of(
    name: str,
    parameters: Parameters,
    repeats: int,
    seed: int,
    threads: int | None = None,
    kept: Kept | None = None,
) -> Loops:
    """Return the cases under the controllers of a name, with so many repeats."""
    table, v_gain = KINDS[name]
    cases: list[Case] = []
    drawn: list[Any] = []
    for number, (shape, devised) in enumerate(CASES):
        path = reference(trajectory(shape), parameters, PERIOD)
        own = perturbed(table[devised], repeats, np.random.default_rng((seed, number)))
        drawn += [each.filters(PERIOD) for each in own]
        cases.append(Case(case_name(shape, devised), path, yardstick(path)))
    return Loops(name, v_gain, tuple(cases), stack(drawn, PERIOD), repeats, seed, threads, kept)


def run_jobs(
    loops: Loops, jobs: Sequence[Job], ran: Callable[[int], None] = lambda _: None
) -> Found:
    """Return what comes of jobs, equal ones of one run.

    Args:
        ran: called with how many jobs were done.

    Raises:
        ParameterError, ModelError: a place that there cannot be.
    """
    if loops.v_gain == 0.0:
        jobs = [job._replace(place=job.place.without_v) for job in jobs]
    places: dict[Job, int] = {}
    index = np.array([places.setdefault(job, len(places)) for job in jobs], dtype=np.int64)
    alone = list(places)
    found = Found(np.empty(len(alone)), np.empty((len(alone), 2)), np.empty((len(alone), 2)))
    shares = np.bincount(index, minlength=len(alone))
    kinds: dict[tuple[str, int], list[int]] = {}
    for i, job in enumerate(alone):
        kinds.setdefault((job.place.plant, job.place.size), []).append(i)
    for mine in kinds.values():
        for start in range(0, len(mine), AT_ONCE):
            some = mine[start : start + AT_ONCE]
            for part, its in zip(found, _kept(loops, [alone[i] for i in some]), strict=True):
                part[some] = its
            ran(int(shares[some].sum()))
    return Found(*(part[index] for part in found))


def _kept(loops: Loops, jobs: Sequence[Job]) -> Found:
    """Return what comes of jobs, from what was run before if it was."""
    if loops.kept is None:
        return _population(loops, jobs)

    def made() -> Array:
        return np.column_stack(_population(loops, jobs))

    what = f"{loops.name} {loops.repeats} {loops.seed}\n{jobs!r}"
    columns = loops.kept.of(what, made)
    return Found(columns[:, 0], columns[:, 1:3], columns[:, 3:5])


def _population(loops: Loops, jobs: Sequence[Job]) -> Found:
    """Return what comes of jobs whose plants are of one kind and size."""
    numbers: dict[Any, Any] = {}  # what several stages share: told apart by identity
    stages: dict[tuple[Place, int], Stage] = {}
    for place, case, _ in jobs:
        if (place, case) in stages:
            continue
        plant, ref = place.built(), loops.cases[case].reference
        loop = numbers.setdefault((case, plant.step), loop_of(plant, ref, loops.v_gain))
        friction = place.setting.friction
        stages[place, case] = Stage(
            plant,
            numbers.setdefault(friction, friction.numbers()),
            loop,
            plant.rest_state(ref.joint[0]),
            place.setting.hardware,
            loops.cases[case].yard,
        )
    at = {key: i for i, key in enumerate(stages)}
    which = np.array([at[job.place, job.case] for job in jobs], dtype=np.int64)
    repeat = np.array([job.repeat for job in jobs], dtype=np.int64)
    row = np.array([job.case * loops.repeats + job.repeat for job in jobs], dtype=np.int64)
    controllers = loops.controllers.chosen(row)
    outcome = run_each(list(stages.values()), which, repeat, controllers, threads=loops.threads)
    sums = outcome.sums
    rows = np.maximum(sums[:, ROWS, None], 1.0)
    return Found(
        np.where(np.isnan(outcome.diverged), np.sqrt(sums[:, ENVELOPE]), np.inf),
        np.sqrt(sums[:, TORQUE : TORQUE + 2] / rows),
        sums[:, VARIATION : VARIATION + 2],
    )
