"""A quick run of a study: its folder, result, JSON and text, for all tests of the session."""

from __future__ import annotations

import csv
import importlib
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from studies.main import COMMANDS

WIDTH = 80  # columns of the terminal
OPTIONS: dict[str, dict[str, Any]] = {  # what makes a quick run quicker still
    "converge": {"rounds": 1},
    "compare": {"controllers": ("ours", "table2")},
    "ladder": {"rounds": 1},
    "screening": {"screen": 30},
    "stability": {"map_points": 3, "controllers": ("ideal-line",), "screen": 20},
    "tables": {"chain_generations": 2},
}


@dataclass(frozen=True, eq=False)
class QuickRun:
    """A quick run.

    Attributes:
        folder: of the run. result: as `run` gives it. content: of `--json`. text: without it.
    """

    folder: Path
    result: Any
    content: dict[str, Any]
    text: str

    def table(self, name: str) -> list[dict[str, str]]:
        """Return the rows of a CSV file."""
        with (self.folder / name).open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    @property
    def files(self) -> set[str]:
        """Names of what lies in the folder, hidden files left out."""
        return {path.name for path in self.folder.iterdir() if not path.name.startswith(".")}

    @property
    def figures(self) -> set[str]:
        """Names of the figures."""
        return {path.name for path in (self.folder / "figures").iterdir()}


def carried_out(name: str, folder: Path) -> QuickRun:
    """Return the quick run of a command, its folder made."""
    home = COMMANDS[name]
    module = importlib.import_module(f"studies.{home.module}")
    options = {"out": folder, "quick": True, "json": True, **OPTIONS.get(name, {})}
    config, study = getattr(module, home.config)(**options), module.command
    result = study.carried_out(config)
    text = io.StringIO()
    study.show(config, result, Console(file=text, width=WIDTH))
    return QuickRun(folder, result, json.loads(study.as_json(config, result)), text.getvalue())
