"""How we compile: numba, cached on disk, under a folder named after the sources themselves.

numba's own cache looks only at the file that holds a function, not at those it calls; a folder
per digest of the package means that an edit anywhere recompiles everything, and nothing stale
runs. `NUMBA_DISABLE_JIT=1` turns the compiler off, for debugging the assumed-modes plant.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

CACHES_KEPT = 4  # of source versions, this one included, so that switching branches stays quick


def _cache_folder() -> Path:
    """Return a writable folder for this version of the sources, dropping the oldest others."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(source.read_bytes())
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "flexsim"
    folder = home / digest.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        folder.touch()
        by_age = sorted(home.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
        for old in by_age[CACHES_KEPT:]:
            shutil.rmtree(old, ignore_errors=True)
    except OSError:
        return Path(tempfile.gettempdir()) / f"flexsim-{os.getuid()}" / folder.name
    return folder


if not os.environ.get("NUMBA_CACHE_DIR"):
    numba.config.CACHE_DIR = str(_cache_folder())  # type: ignore[attr-defined]


def jit(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function compiled without Python objects, IEEE division, cached on disk."""
    return numba.njit(cache=True, error_model="numpy", nogil=True, forceinline=True)(function)


def jit_parallel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function compiled as `jit`, its `prange` loops over threads."""
    return numba.njit(cache=True, error_model="numpy", nogil=True, parallel=True)(function)
