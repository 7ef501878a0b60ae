"""Open runs in the rerun viewer: `flexsim view RUN [RUN2 ...]`, any run of any study.

    flexsim view runs/compare
    flexsim view runs/bench runs/ideal        # side by side, on one timeline
    flexsim view runs/ladder --save it.rrd    # as a file

A run's own recording is opened as it is. Of a study file, some runs are carried out again and
shown; everything else has its figures and tables to show.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from flexsim.errors import ParameterError, RunError
from flexsim.files.atomic import require_replaceable
from studies.core.text import spelled

RUNS_MOST = 8  # beside each other
RECORDINGS = ("run.rrd", "convergence.rrd")  # that a run folder may hold
WHAT_WOULD_DO = "give the folder of a run or an .rrd file"


Runs = Annotated[
    tuple[Path, ...],
    tyro.conf.Positional,
    tyro.conf.arg(
        metavar="RUN [RUN ...]", help="Folders of runs, of any study; or .rrd files; up to 8."
    ),
]


@dataclass(frozen=True)
class ViewConfig:
    """Open one run in the rerun viewer, or several side by side on one timeline."""

    run: Runs
    web: bool = False
    """Show it in a browser on this machine instead of in a window."""
    case: str = ""
    """Name of the case whose tab is on top; the first unless given."""
    save: Path | None = None
    """Write what would be shown to this .rrd file, instead of showing it."""
    force: bool = False
    """Overwrite the file that is there."""
    code: bool = True
    """Whether a Python function of a study may be run, if its runs are repeated."""


def recording_of(run: Path) -> Path | None:
    """Return the recording of a run folder, or the .rrd file itself; None of a run without one.

    Raises:
        RunError: the path does not exist, or is neither a recording nor a run.
    """
    from studies.view.pages import is_run

    if not run.exists():
        raise RunError(f"there is no {run}; {WHAT_WOULD_DO}")
    if not run.is_dir():
        if run.suffix != ".rrd" or not run.is_file():
            raise RunError(f"{run} is no recording; {WHAT_WOULD_DO}")
        return run
    if not is_run(run):
        raise RunError(f"{run} is no run of flexsim; {WHAT_WOULD_DO}")
    found = [run / name for name in RECORDINGS if (run / name).is_file()]
    return found[0] if found else None


def _roots(runs: tuple[Path, ...]) -> list[str]:
    """Return a path below which each run's entities are; none for a single run."""
    if len(runs) == 1:
        return [""]
    found: list[str] = []
    for run in runs:
        name = re.sub(r"[^A-Za-z0-9_-]+", "-", run.resolve().stem).strip("-") or "run"
        while name in found:
            name += "_"
        found.append(name)
    return found


@contextmanager
def composed(config: ViewConfig) -> Iterator[Path]:
    """Give a recording of all that is asked for, gone when the block ends.

    Raises:
        RunError: as `recording_of`, or what a run holds cannot be read.
        ParameterError: there is no such case.
    """
    from flexsim.recording.joined import Part, write_joined
    from studies.view.pages import pages

    with ExitStack() as stack:
        private = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="flexsim-view-")))
        parts = []
        for i, (run, root) in enumerate(zip(config.run, _roots(config.run), strict=True)):
            recording = recording_of(run) or _study(run, private / f"{i}.rrd", config)
            contents = pages(run) if run.is_dir() else []
            alone = sum(each.name == run.name for each in config.run) == 1
            title = run.name if run.name and alone else str(run)
            parts.append(Part(root, title, recording, contents))
        path = private / "view.rrd"
        write_joined(path, parts, config.case)
        yield path


def _study(run: Path, path: Path, config: ViewConfig) -> Path | None:
    """Write the recording of a study file's run, if it is one; return where it is."""
    from studies.view.study_cases import cases_of, is_study

    if not is_study(run):
        return None
    from flexsim.recording.rrd import write_recording

    cases, robot = cases_of(run, config.case if len(config.run) == 1 else "", config.code)
    write_recording(path, cases, {"run": str(run)}, robot)
    return path


def command(config: ViewConfig) -> None:
    """Open the runs, and return when the viewer is closed; or write them to a file.

    Raises:
        RunError: there is nothing to show, or the viewer cannot start.
    """
    from flexsim.recording.joined import store_of
    from flexsim.recording.rerun_file import open_recording

    if not config.run:
        raise ParameterError(f"no run is named; {WHAT_WOULD_DO}")
    if len(config.run) > RUNS_MOST:
        raise ParameterError(f"{len(config.run)} runs are named; give {RUNS_MOST} at most")
    places = [run.resolve() for run in config.run]
    if len(set(places)) < len(places):
        raise ParameterError("the same run is named twice; name each once")
    recordings = [recording_of(run) for run in config.run]
    if config.save is not None:
        _save(config, config.save)
        return
    first = recordings[0]
    if len(recordings) == 1 and first is not None and not config.case:
        store_of(first)  # the viewer would open on what it cannot read
        open_recording(first, config.web)
        return
    with composed(config) as path:
        open_recording(path, config.web)


def _save(config: ViewConfig, path: Path) -> None:
    """Write what is shown to a file.

    Raises:
        RunError: it cannot be written, or is there already.
    """
    from flexsim.files.atomic import write_bytes

    if path.suffix != ".rrd":
        raise ParameterError(f"--save {path}: give a file that ends with .rrd")
    if path.exists() and not config.force:
        raise RunError(f"{path} exists already; name another file with --save, or add --force")
    require_replaceable(path, "the recording")
    with composed(config) as written:
        write_bytes(path, written.read_bytes(), "the recording")
    print(f"{spelled(path)}: rerun {spelled(path)}")
