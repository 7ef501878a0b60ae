"""How a study is carried out and told: run under a progress bar, its folder whole or not at all.

    >>> command = Study(run, tables, verdict, figures, question="Do the two models agree?")
    >>> command(config)               # writes the folder; prints tables and verdict, or JSON

A study is a frozen configuration (`studies.core.study_options`), a pure `run` from it to a result,
and what is shown of the result: tables, a verdict in words, figures.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import Progress

from flexsim.loop.hardware import IDEAL
from flexsim.robot import Robot
from studies.core.console import console
from studies.core.figures import write_figures
from studies.core.folder import CONFIG, TABLES, run_folder, to_json, write_config, write_tables
from studies.core.folders.crate import CRATE
from studies.core.options import keep_file, show_differences
from studies.core.study_options import StudyOptions
from studies.core.table import Table, write_files
from studies.core.text import spelled

Config = TypeVar("Config", bound=StudyOptions)
Asked = TypeVar("Asked", bound="AskedOptions")
Result = TypeVar("Result")
Item = TypeVar("Item")

RECORDING = "run.rrd"


class AskedOptions(Protocol):
    """What a question's configuration has."""

    @property
    def json(self) -> bool:
        """Whether to print JSON."""

    def robot_of(self) -> Robot:
        """Return the robot that it is about."""


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Give a progress bar on the terminal, if standard error is one, that leaves no trace."""
    out = console(stderr=True)
    with Progress(console=out, transient=True, disable=not out.is_terminal) as progress:
        yield progress


def ticker(progress: Progress | None, label: str, total: int | None) -> Callable[[], None]:
    """Return a function that moves a bar on by one; without a progress bar it does nothing."""
    if progress is None:
        return lambda: None
    bar = progress.add_task(label, total=total)
    return lambda: progress.advance(bar)


def counted(progress: Progress | None, label: str, steps: Iterable[Item]) -> Iterable[Item]:
    """Return the steps, shown on a bar as they are taken."""
    return progress.track(list(steps), description=label) if progress else steps


def nothing(*_: Any) -> dict[str, Any]:
    """Return no facts, no figures, and write no files."""
    return {}


@dataclass(frozen=True)
class Study(Generic[Config, Result]):
    """What makes a study, all but its configuration.

    Attributes:
        run: from a configuration, under a progress bar, to the result.
        tables: of the result; each says itself whether it is shown, written, or in the JSON.
        verdict: the answer in words.
        figures: of the result, with the names of their files.
        facts: of the result beside the tables, for config.json and the JSON object.
        files: writes what else the folder holds: MJCF, a recording.
        question: that the verdict answers, a sentence.
        answer: as the run keeps it, if notes of the tables say a part of it; the verdict unless
            given.
        instead: does what else may be asked for, such as a dry run; returns whether it was.
    """

    run: Callable[[Config, Progress | None], Result]
    tables: Callable[[Result], Sequence[Table]]
    verdict: Callable[[Result], str]
    figures: Callable[[Result], Iterable[tuple[str, Figure]]] = nothing  # type: ignore[assignment]
    facts: Callable[[Result], dict[str, Any]] = nothing
    files: Callable[[Path, Config, Result], object] = nothing
    question: str = field(kw_only=True)
    answer: Callable[[Result], str] | None = field(default=None, kw_only=True)
    instead: Callable[[Config], bool] = field(default=lambda _: False, kw_only=True)

    def __call__(self, config: Config) -> None:
        """Carry the study out, and print what it found.

        Raises:
            RunError: as `run_folder`; and what `run` raises.
        """
        if self.instead(config):
            return
        result = self.carried_out(config)
        if config.json:
            print(self.as_json(config, result))
        else:
            self.show(config, result, console())

    def carried_out(self, config: Config) -> Result:
        """Return the result, written into the configuration's folder.

        What the file of the robot changes is printed first, and the file kept in the run.
        """
        robot = config.robot_of()  # as the file is now, not as it will be when the run ends
        if not config.json:
            show_differences(robot)
        with run_folder(config.out, config.force) as folder:
            with progress_bar() as progress:
                result = self.run(config, progress)
            self._write(folder, config, result)
            keep_file(folder, robot)
        return result

    def _write(self, folder: Path, config: Config, result: Result) -> None:
        ran = {"ran": dataclasses.asdict(config.asked())} if config.quick else {}
        built = {"hardware": config.hardware_words}
        answer = (self.answer or self.verdict)(result)
        said = {"question": self.question, "answer": answer}
        write_config(folder, config, **ran, **built, **said, **self.facts(result))
        tables = self.tables(result)
        write_files(folder, tables)
        write_tables(folder, tables)
        write_figures(folder, self.figures(result) or (), config.format)
        self.files(folder, config, result)

    def as_json(self, config: Config, result: Result) -> str:
        """Return the tables' rows, the facts and the folder as one JSON object."""
        rows = {table.key: table.as_json() for table in self.tables(result) if table.key}
        about = {"hardware": config.hardware_words, "run": str(config.out)}
        return to_json({**rows, **self.facts(result), **about})

    def show(self, config: Config, result: Result, out: Console) -> None:
        """Print the tables, the verdict and what lies in the folder."""
        show_tables(self.tables(result), out)
        out.print(self.verdict(result), soft_wrap=True)
        if config.hardware_words != IDEAL.words():
            out.print(f"Hardware: {config.hardware_words}.", soft_wrap=True)
        out.print(f"{spelled(config.out)}: {', '.join(contents(config.out))}", soft_wrap=True)


@dataclass(frozen=True)
class Question(Generic[Asked, Result]):
    """A study that answers at once and keeps no folder.

    Attributes:
        run: from a configuration to the result. tables, verdict: as of a `Study`.
        content: of the JSON object.
    """

    run: Callable[[Asked], Result]
    tables: Callable[[Result], Sequence[Table]]
    verdict: Callable[[Result], str]
    content: Callable[[Result], dict[str, Any]]

    def __call__(self, config: Asked) -> Result:
        """Return the result, printed."""
        robot = config.robot_of()
        result = self.run(config)
        if config.json:
            print(to_json(self.content(result)))
        else:
            show_differences(robot)
            self.show(result, console())
        return result

    def show(self, result: Result, out: Console) -> None:
        """Print the tables and the verdict."""
        show_tables(self.tables(result), out)
        out.print(self.verdict(result), soft_wrap=True, end="")


def show_tables(tables: Sequence[Table], out: Console) -> None:
    """Print the tables that are for reading."""
    for table in tables:
        if table.columns and table.rows:
            out.print(table.render())


def listed(folder: Path) -> list[str]:
    """Return what a folder holds, its metadata, hidden files and tables' copies left out."""
    found = sorted(path.name + "/" * path.is_dir() for path in folder.iterdir())
    copies = {name.removesuffix(".csv") + end for name in found for end in (".md", ".tex")}
    copies.add(CRATE)
    return [name for name in found if name not in copies and not name.startswith(".")]


def contents(folder: Path) -> list[str]:
    """Return what a run's folder holds beside its configuration, and how to see a recording."""
    shown = [name for name in listed(folder) if name not in (CONFIG, TABLES)]
    if RECORDING in shown:
        shown.append(shown.pop(shown.index(RECORDING)) + f" (flexsim view {spelled(folder)})")
    return shown
