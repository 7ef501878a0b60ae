"""How the scripts here ask: a command of ours for its JSON, in a folder of their own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


def asked(*words: object) -> dict[str, Any]:
    """Return the JSON object that `flexsim WORDS --json` prints."""
    command = [sys.executable, "-m", "flexsim", *map(str, words), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def row(*cells: object) -> None:
    """Print a row of a markdown table."""
    print("| " + " | ".join(map(str, cells)) + " |")


def numbers(values: Any, form: str, scale: float = 1.0) -> str:
    """Return several numbers with commas."""
    return ", ".join(format(scale * each, form) for each in values)
