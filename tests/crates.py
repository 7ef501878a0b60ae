"""Run folders held against `tests/crate_validator.py`, in the environment that has it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from programs import missing

PYTHON = Path(sys.prefix) / "crates" / "bin" / "python"  # `make install` makes it
VALIDATOR = Path(__file__).with_name("crate_validator.py")


def issues(folder: Path) -> list[str]:
    """Return what the validator has against a folder, nothing for a valid crate."""
    if not PYTHON.is_file():
        missing(f"there is no environment {PYTHON.parents[1]}; run make install")
    done = subprocess.run(
        [str(PYTHON), str(VALIDATOR), str(folder)], capture_output=True, text=True, check=True
    )
    found: list[str] = json.loads(done.stdout.splitlines()[-1])[0]
    return found
