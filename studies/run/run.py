"""Carry out a study file: every case, its repeats and draws, to tidy results with intervals.

    >>> outcome = carry_out(RunConfig(study=Path("study.toml"), out=Path("runs/mine")))
    >>> outcome.found.rows[0].median

`flexsim run RUN/study.toml` repeats a run to the bit; `--resume` goes on with one that was ended.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from flexsim.errors import ParameterError
from flexsim.loop.beyond import beyond
from studies.core.carry_out import listed
from studies.core.console import console
from studies.core.ending import saying
from studies.core.figures import write_figures
from studies.core.folder import add_to_config, to_json, write_tables
from studies.core.study_options import FORMATS, Format, check_each_once, check_threads
from studies.core.table import write_files
from studies.core.text import spelled
from studies.run import report
from studies.run.checking import check_rows
from studies.run.report import Found
from studies.run.sensitivity import sensitivity_rows
from studies.run.store import STUDY, Store
from studies.run.summary import Cells, summary_rows
from studies.run.workers import Done, cluster, here, spread
from studies.spec.building import Workshop
from studies.spec.corners import require_buildable
from studies.spec.example import EXAMPLE
from studies.spec.reading import read_study
from studies.spec.resolving import resolve

Changes = Annotated[
    tuple[tuple[str, ...], ...],
    tyro.conf.UseAppendAction,
    tyro.conf.arg(
        name="set", metavar="PATH=VALUE", help="Numbers of the file instead: robot.zeta=0.002."
    ),
]
File = Annotated[
    Path | None,
    tyro.conf.Positional,
    tyro.conf.arg(metavar="STUDY", help="Its file; needed without --example."),
]


@dataclass(frozen=True)
class RunConfig:
    """Carry out a study file: results, summary with intervals, figures."""

    study: File = None
    out: Path | None = None
    """Folder of the run; runs/NAME after the study's file unless given."""
    changes: Changes = ()
    quick: bool = False
    """Two repeats, the ends of a grid, eight samples: a first impression."""
    json: bool = False
    """Print one JSON object instead of the tables."""
    example: bool = False
    """Print a commented study file that runs, and do no more."""
    force: bool = False
    """Replace the run that is there, if it has ended."""
    resume: bool = False
    """Continue the run that was ended early."""
    traces: Literal["none", "nominal", "all"] | None = None
    """Time series to keep: of no runs, of those with the gains as they are, of all; the file's
    unless given."""
    threads: int | None = None
    """Threads; all cores unless given. Results do not depend on it."""
    workers: int | None = None
    """Worker processes on this machine instead of threads."""
    cluster: str | None = None
    """A dask scheduler whose workers run the batches, such as tcp://host:8786; this
    machine unless given."""
    format: tuple[Format, ...] = FORMATS
    """Of the figures, each once."""
    code: bool = True
    """Whether the file may name a Python function, which is then run; --no-code refuses."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """A study that was carried out: its folder, what was found, and how long it took [s]."""

    folder: Path
    found: Found
    seconds: float


def flat(changes: tuple[tuple[str, ...], ...]) -> list[str]:
    """Return all of --set's words, whether given once or several times."""
    return [each for some in changes for each in some]


def workshop_of(
    study: Path,
    changes: Sequence[str] = (),
    quick: bool = False,
    code: bool = True,
    traces: str | None = None,
) -> Workshop:
    """Return what builds the runs of a study file; errors as `read_study` and `resolve`."""
    more = [f'traces="{traces}"'] if traces else []
    return Workshop(resolve(read_study(study, [*changes, *more], quick), code))


def _check(config: RunConfig) -> None:
    """Refuse options that contradict each other."""
    if config.workers is not None and config.cluster is not None:
        raise ParameterError("--workers and --cluster contradict each other; give one of them")
    if config.threads is not None and (config.workers or config.cluster):
        raise ParameterError("--threads is of this process, workers have one each; leave it out")
    if config.workers is not None and config.workers < 1:
        raise ParameterError(f"workers are {config.workers}; give 1 or more")
    if config.resume and config.force:
        raise ParameterError("--resume continues a run, --force replaces it; give one of them")
    check_threads(config.threads)
    check_each_once("format", config.format)


def carry_out(config: RunConfig) -> Outcome:
    """Return what came of a study, its folder written.

    Raises:
        ParameterError, ModelError: the study cannot be carried out; nothing is written then.
        RunError: a file cannot be read or written, or the run that is there is not to be replaced.
    """
    _check(config)
    began = time.monotonic()
    study, changes = config.study, flat(config.changes)
    if study is None and changes and "=" not in changes[-1]:  # --set repeats=2 study.toml
        study = Path(changes.pop())
    if study is None and config.resume and config.out is not None:
        study = config.out / STUDY
    if study is None:
        raise ParameterError(
            "no study file is given; write one: flexsim run --example > study.toml"
        )
    out = config.out or Path("runs") / study.stem
    workshop = workshop_of(study, changes, config.quick, config.code, config.traces)
    require_buildable(workshop)
    with ExitStack() as held:
        if config.resume and out.exists():
            store = held.enter_context(Store.continued(out, workshop))
        else:
            store = held.enter_context(Store.begun(out, config.force, workshop, config))
        again = f"continue with flexsim run --out {out} --resume"
        held.enter_context(saying(lambda: f"interrupted; {again}"))
        _batches(config, store, workshop)
        store.assemble()
        found = _found(store, workshop, config)
        if not store.finished:
            _write(store, found, config.format)
    return Outcome(out, found, time.monotonic() - began)


def _batches(config: RunConfig, store: Store, workshop: Workshop) -> None:
    """Carry out all batches that are not there."""
    pending = list(store.pending())
    if not pending:
        return
    with ExitStack() as held:
        if config.workers is not None or config.cluster is not None:
            client = held.enter_context(cluster(config.cluster, config.workers))
            done: Iterator[Done] = spread(workshop.resolved, iter(pending), client)
        else:
            done = here(workshop, iter(pending), config.threads)
        progress = held.enter_context(_progress())
        total = workshop.matrix.runs
        left = sum(last - first for first, last in pending)
        bar = progress.add_task("runs", total=total, completed=total - left, rate="")
        started, count = time.monotonic(), 0
        for first, last, rows, traces in done:
            store.keep(first, last, rows, traces)
            count += last - first
            rate = f"{count / max(time.monotonic() - started, 1e-9):,.0f} runs/s"
            progress.update(bar, advance=last - first, rate=rate)


def _progress() -> Progress:
    """Return a bar with runs done, their rate and the time left."""
    out = console(stderr=True)
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.completed:,.0f} of {task.total:,.0f}", markup=False),
        TextColumn("{task.fields[rate]}", markup=False),
        TimeRemainingColumn(),
        console=out,
        transient=True,
        disable=not out.is_terminal,
    )


def _found(store: Store, workshop: Workshop, config: RunConfig) -> Found:
    """Return what the results say."""
    seed = workshop.study.seed
    cells = Cells(store, workshop.matrix)
    rows, sensitivity = summary_rows(cells, seed), sensitivity_rows(cells, seed)
    checks = [] if store.finished else check_rows(cells, workshop, config.threads)
    return Found(workshop.matrix, rows, sensitivity, checks, bent(store, workshop))


def bent(store: Store, workshop: Workshop) -> list[str]:
    """Return a note for each plant that bent further than its equations hold."""
    length, notes = workshop.robot(0, workshop.nominal)[1].parameters.L, []
    by_plant = store.figure("max_v").reshape(len(workshop.study.plants), -1)
    for part, values in zip(workshop.study.plants, by_plant, strict=True):
        ended = values[np.isfinite(values)]
        most = float(ended.max()) if len(ended) else None
        own = "" if part.name == part.model else f"{part.name}: "
        notes += [own + note for note in beyond(part.model, most, length)]
    return notes


def _write(store: Store, found: Found, formats: Sequence[Format]) -> None:
    """Write what is found into the folder, which is then finished."""
    folder = store.folder
    store.write_csv()
    tables = report.tables(found)
    write_files(folder, [*tables, report.whole(found)])
    write_tables(folder, tables)
    add_to_config(folder, answer=report.verdict(found))
    write_figures(folder, report.figures(found), formats)
    store.conclude()


def command(config: RunConfig) -> None:
    """Carry out a study and print what came of it."""
    if config.example:
        print(EXAMPLE, end="")
        return
    outcome = carry_out(config)
    found, folder = outcome.found, outcome.folder
    if config.json:
        about = {"run": str(folder), "runs": found.runs, "diverged": found.diverged}
        print(to_json({**about, "seconds": outcome.seconds}))
        return
    out = console()
    for table in report.tables(found):
        if table.columns and table.rows:
            out.print(table.render())
    out.print(report.verdict(found), soft_wrap=True)
    out.print(f"{spelled(folder)}: {', '.join(listed(folder))}", soft_wrap=True)
