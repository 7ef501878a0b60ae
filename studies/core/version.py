"""Which flexsim is this? Its version, and the commit of its sources where they are a checkout.

>>> version()                                                   # doctest: +SKIP
'0.1.0 (commit 1a2b3c4d5e6f)'
"""

from __future__ import annotations

import importlib.metadata
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
ANSWERED = 5.0  # [s] for git


def commit() -> str | None:
    """Return the commit of the sources, `-dirty` if they were changed since; None if unknown."""
    if not (ROOT / ".git").exists():  # installed: a checkout around it is another project's
        return None
    describe = ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--exclude=*"]
    try:
        done = subprocess.run(
            [*describe, "--abbrev=12"], capture_output=True, text=True, timeout=ANSWERED, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip() or None


def about() -> str:
    """Return what `flexsim --version` prints."""
    from flexsim import MODELS

    return f"flexsim {version()}\nmodels: {MODELS}"


def version() -> str:
    """Return the version of the package, with the commit if it is known."""
    try:
        number = importlib.metadata.version("flexsim")
    except importlib.metadata.PackageNotFoundError:  # a tree that is not installed
        number = "unknown"
    known = commit()
    return f"{number} (commit {known})" if known else number
