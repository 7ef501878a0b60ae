"""On what does a run run? Processor, BLAS kernel and instruction sets, for its folder.

    >>> machine()["blas"]
    'numpy: OpenBLAS Haswell; scipy: OpenBLAS Haswell'

Results do not depend on it (`tests/numerics/test_kernels.py`); where two tables differ all the
same, this tells them apart. The BLAS kernel is asked of the loaded library itself, since OpenBLAS
takes another, silently, where the one asked for by OPENBLAS_CORETYPE cannot run.
"""

from __future__ import annotations

import ctypes
import platform
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import numpy as np
import scipy

UNKNOWN = "unknown"
_SYMBOLS = ("scipy_openblas_get_corename", "openblas_get_corename")
_THREADS = ("scipy_openblas_get_num_threads", "openblas_get_num_threads")


@cache
def machine() -> dict[str, str]:
    """Return what a run ran on, by name: processor, BLAS, instruction sets, C library."""
    kernels = "; ".join(f"{name}: {kernel}" for name, kernel in blas_kernels().items())
    features = np.show_config(mode="dicts")["SIMD Extensions"]
    return {
        "processor": processor(),
        "blas": kernels,
        "numpy_simd": " ".join([*features.get("baseline", ()), *features.get("found", ())]),
        "compiled_for": getattr(numba.config, "CPU_NAME", None)
        or llvmlite.binding.get_host_cpu_name(),
        "short_vector_math": "SVML" if getattr(numba.config, "USING_SVML", False) else "none",
        "c_library": " ".join(platform.libc_ver()).strip() or UNKNOWN,
    }


def processor() -> str:
    """Return the processor's model as the system names it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    for line in lines:
        name, _, value = line.partition(":")
        if name.strip() == "model name":
            return value.strip()
    return platform.processor() or platform.machine() or UNKNOWN


def blas_kernels() -> dict[str, str]:
    """Return the kernel that numpy's and scipy's BLAS have chosen."""
    return {
        name: f"OpenBLAS {found}" if (found := _asked(library, _SYMBOLS, ctypes.c_char_p)) else kind
        for name, library, kind in _libraries()
    }


def blas_threads() -> dict[str, int | None]:
    """Return on how many threads numpy's and scipy's BLAS run, None where they do not say."""
    return {name: _asked(library, _THREADS, ctypes.c_int) for name, library, _ in _libraries()}


def _libraries() -> list[tuple[str, Path | None, str]]:
    """Return name, OpenBLAS that the wheel brought (None without one), and kind of BLAS."""
    found = []
    for module in (np, scipy):
        name = module.__name__
        folder = Path(module.__file__).parent  # type: ignore[arg-type]
        beside = (folder.parent / f"{name}.libs", folder / ".dylibs")
        paths = [path for where in beside for path in sorted(where.glob("*openblas*"))]
        config = module.show_config(mode="dicts")
        kind = str(config["Build Dependencies"]["blas"]["name"])
        found.append((name, paths[0] if paths else None, kind))
    return found


def _asked(library: Path | None, symbols: tuple[str, ...], kind: type) -> Any:
    """Return what the loaded library says, None if it has none of the functions."""
    if library is None:
        return None
    try:
        loaded = ctypes.CDLL(str(library))  # the one that is loaded already
    except OSError:
        return None
    for symbol in (name + end for name in symbols for end in ("64_", "", "_64")):
        if hasattr(loaded, symbol):
            function = getattr(loaded, symbol)
            function.restype = kind
            answer = function()
            return answer.decode() if isinstance(answer, bytes) else answer
    return None
