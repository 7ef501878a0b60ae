"""How a study is carried out: its run under a progress bar, its folder written whole or not at all.

>>> result = carried_out(config, run, write)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import Progress

from studies.core.folder import run_folder
from studies.core.options import keep_file, print_differences

Result = TypeVar("Result")


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Give a progress bar on the terminal, if standard error is one, that leaves no trace."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        yield progress


def carried_out(
    config: Any,
    run: Callable[[Any, Progress], Result],
    write: Callable[[Path, Any, Result], None],
) -> Result:
    """Return what `run` returns, written by `write` into the configuration's folder.

    What the file of the robot changes is printed first, and the file kept in the run.

    Args:
        config: with `out`, `force`, `json` and the options of the robot.
        run: of the study, with a progress bar. write: the folder's content.

    Raises:
        RunError: as `run_folder`; and what the two raise.
    """
    robot = config.robot_of()  # as the file is now, not as it will be when the run ends
    if not config.json:
        print_differences(robot)
    with run_folder(config.out, config.force) as folder:
        with progress_bar() as progress:
            result = run(config, progress)
        write(folder, config, result)
        keep_file(folder, robot)
    return result
