"""Runs as one file that opens offline: what was asked and found, what differs, how to do it again.

flexsim report runs/compare --out report.html
flexsim report runs/compare runs/mine --out both.html
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from flexsim.errors import ParameterError, RunError
from flexsim.files.atomic import require_replaceable, write_text
from flexsim.files.reading import kind_of
from studies.core.folder import to_json
from studies.core.text import spelled
from studies.report.kept import Kept, read
from studies.report.page import MARK, page

RUNS_MOST = 8
MOST = 60_000_000  # [bytes] of a report
Runs = Annotated[
    tuple[Path, ...],
    tyro.conf.Positional,
    tyro.conf.arg(metavar="RUN [RUN ...]", help="Folders of runs, of any study; up to 8."),
]


@dataclass(frozen=True)
class ReportConfig:
    """Write runs as one HTML file: answers, tables, figures, differences, how to reproduce."""

    run: Runs
    out: Annotated[Path, tyro.conf.arg(help="File to write, such as report.html.")]
    force: bool = False
    """Overwrite the file that is there, even if it is no report."""
    json: bool = False
    """Print one JSON object instead of a line."""


def check(config: ReportConfig) -> None:
    """Refuse what no report can be made of, before anything is read.

    Raises:
        ParameterError: no runs, too many, or one twice.
        RunError: the report cannot be written there.
    """
    if not 1 <= len(config.run) <= RUNS_MOST:
        raise ParameterError(f"{len(config.run)} runs are given; give 1 to {RUNS_MOST}")
    seen: dict[str, Path] = {}
    for folder in config.run:
        real = os.path.realpath(folder)
        if real in seen:
            raise ParameterError(f"{folder} is the same run as {seen[real]}; give each once")
        seen[real] = folder
    _check_out(config.out, config.force)


def _check_out(out: Path, force: bool) -> None:
    """Refuse a path that a report may not be written to."""
    if not out.parent.is_dir():
        raise RunError(f"{out}: cannot write the report: there is no folder {out.parent}")
    require_replaceable(out, "the report")
    if out.exists() and not force and not is_report(out):
        raise RunError(
            f"{out} exists already and is no report of ours; name another file, or give --force "
            "to overwrite it"
        )


def is_report(path: Path) -> bool:
    """Return whether a file is a report of ours, by its first lines."""
    if kind_of(path.lstat().st_mode) is not None:
        return False
    try:
        with path.open("rb") as file:
            return file.read(len(MARK)) == MARK.encode()
    except OSError:
        return False


def report(runs: Sequence[Path]) -> tuple[str, list[Kept]]:
    """Return the report about runs as HTML, and the runs.

    Raises:
        RunError: one is no run, or a file in it is damaged.
    """
    kept = [read(folder) for folder in runs]
    return page(kept), kept


def command(config: ReportConfig) -> None:
    """Write the report, and say where."""
    check(config)
    text, runs = report(config.run)
    size = len(text.encode())
    if size > MOST:
        raise RunError(
            f"{config.out}: the report would have {size:,} bytes, more than {MOST:,}; name fewer "
            "runs"
        )
    write_text(config.out, text, "the report")
    about = {"out": str(config.out), "runs": [str(run.folder) for run in runs], "bytes": size}
    if config.json:
        print(to_json(about))
        return
    of = f"{len(runs)} run{'s' * (len(runs) > 1)}"
    print(f"{spelled(config.out)}: {of}, {size / 1e6:.1f} MB; open it in any browser")
