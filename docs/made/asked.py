"""How the scripts here ask: a command of ours for what it prints, in a folder of their own."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


def said(*words: object) -> str:
    """Return what `flexsim WORDS` prints; end with what it complains of."""
    done = subprocess.run(
        [sys.executable, "-m", "flexsim", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        sys.exit(f"flexsim {' '.join(map(str, words))}: {done.stderr.strip()}")
    return done.stdout


def asked(*words: object) -> dict[str, Any]:
    """Return the JSON object that `flexsim WORDS --json` prints."""
    found: dict[str, Any] = json.loads(said(*words, "--json"))
    return found


@contextmanager
def own_folder() -> Iterator[None]:
    """Work in a folder that is gone afterwards, so that nobody's files are written over."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        yield


def run_part(parts: Mapping[str, Callable[[], None]]) -> None:
    """Run the part that the command line names."""
    parser = argparse.ArgumentParser()
    parser.add_argument("part", choices=parts)
    parts[parser.parse_args().part]()


def row(*cells: object) -> None:
    """Print a row of a markdown table."""
    print("| " + " | ".join(map(str, cells)) + " |")


def numbers(values: Any, form: str, scale: float = 1.0) -> str:
    """Return several numbers with commas."""
    return ", ".join(format(scale * each, form) for each in values)
