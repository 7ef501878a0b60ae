"""A quick run of a study: its folder, result, JSON and text, for all tests of the session."""

from __future__ import annotations

import csv
import importlib
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from figure_rules import faults
from rich.console import Console

from studies.core.carry_out import listed
from studies.core.figures import CAPTIONS
from studies.main import COMMANDS

WIDTH = 80  # columns of the terminal
OPTIONS: dict[str, dict[str, Any]] = {  # what makes a quick run quicker still
    "arena": {"conditions": ("nominal", "payload", "disturbed")},
    "converge": {"rounds": 1},
    "compare": {"controllers": ("ours", "table2")},
    "laboratory": {"synthetic": 2, "plants": ("assumed-modes",)},
    "ladder": {"rounds": 1},
    "screening": {"screen": 30},
    "stability": {"map_points": 3, "controllers": ("ideal-line",), "screen": 20},
    "tables": {"chain_generations": 2},
}


@dataclass(frozen=True, eq=False)
class QuickRun:
    """A quick run.

    Attributes:
        name: of the command. folder: of the run. result: as `run` gives it.
        content: of `--json`. text: without it.
    """

    name: str
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
        """Names of what lies in the folder, hidden files and tables for print left out."""
        return {name.removesuffix("/") for name in listed(self.folder)}

    @property
    def figures(self) -> set[str]:
        """Names of the figures, their captions left out."""
        return {path.name for path in (self.folder / "figures").iterdir()} - {CAPTIONS}

    def faults(self) -> list[str]:
        """Return what is wrong with the study's figures as something to print."""
        module = importlib.import_module(f"studies.{COMMANDS[self.name][0]}")
        drawn = module.command.figures(self.result)
        return [f"{name}: {fault}" for name, figure in drawn for fault in faults(figure)]


def carried_out(name: str, folder: Path) -> QuickRun:
    """Return the quick run of a command, its folder made."""
    home = COMMANDS[name]
    module = importlib.import_module(f"studies.{home.module}")
    options = {"out": folder, "quick": True, "json": True, "format": ("png",)}
    options |= OPTIONS.get(name, {})
    config, study = getattr(module, home.config)(**options), module.command
    result = study.carried_out(config)
    text = io.StringIO()
    study.show(config, result, Console(file=text, width=WIDTH))
    content = json.loads(study.as_json(config, result))
    return QuickRun(name, folder, result, content, text.getvalue())
