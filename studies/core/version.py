"""Which flexsim is this? Its version, its sources, and their commit where they are a checkout.

>>> version()                                                   # doctest: +SKIP
'0.1.0 (commit 1a2b3c4d5e6f)'
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import subprocess
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("flexsim", "controllers", "studies")
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


@cache
def sources() -> str:
    """Return a digest of our packages' sources, which tells edits of one commit apart."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            digest.update(str(path.relative_to(ROOT)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


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
