"""A tuning run on the terminal, generation by generation.

>>> with live(record, scenarios=2) as show:
...     show(generation)
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta

from rich.progress import BarColumn, Progress, TextColumn

from studies.core.console import console
from studies.tuning.genetic import Generation, OnGeneration
from studies.tuning.kept import most_generations
from studies.tuning.record import Record


@contextmanager
def live(record: Record, scenarios: int) -> Iterator[OnGeneration]:
    """Give a function that shows each new generation on the terminal."""
    out = console(stderr=True)
    columns = (BarColumn(bar_width=20), TextColumn("{task.description}", markup=False))
    most = most_generations(record.tuning)
    best = min((float(each.indices.min()) for each in record.generations), default=float("inf"))
    ran, started = 0, time.perf_counter()
    with Progress(*columns, console=out, transient=True, disable=not out.is_terminal) as bar:
        task = bar.add_task("compiling", total=most, completed=len(record.generations))

        def show(new: Generation) -> None:
            nonlocal best, ran
            best = min(best, float(new.indices.min()))
            ran += new.evaluated * scenarios
            rate = ran / (time.perf_counter() - started)
            left = (most - new.number - 1) * new.evaluated * scenarios / rate
            bar.update(
                task,
                completed=new.number + 1,
                description=f"generation {new.number + 1}/{most}  best {best:.4g} m2 s  "
                f"stable {100 * new.stable_share:.0f} %  {rate:.0f} simulations/s  "
                f"at most {timedelta(seconds=round(left))} left",
            )

        yield show
