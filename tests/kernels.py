"""Kernels of BLAS and instruction sets of numpy that this processor can run, and runs under them.

    python tests/kernels.py -m kernels     # pytest under a kernel that this machine does not choose

OpenBLAS takes another kernel, without a word, where the one asked for cannot run; so what is
available is what the library itself says once it is loaded.
"""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from typing import Any

# Of processors with AVX2 and FMA, of both makers; and an older one, so that there is always another
KERNELS = ("Haswell", "SkylakeX", "Zen", "Nehalem")
ASKED = "from flexsim.numerics.machine import blas_kernels; print(*set(blas_kernels().values()))"
WIDE = ("AVX512", "X86_V4")  # how numpy's names of what is beyond AVX2 begin


WORK = """
import numpy as np
from scipy.linalg import lstsq
a = np.arange(90000.0).reshape(300, 300) % 7.0
a @ a, a @ a[0], a[0] @ a[1], np.linalg.eigvals(a), lstsq(a, a[0])
"""


@cache
def chosen(kernel: str | None = None) -> str:
    """Return the kernels that are loaded when one is asked for, or none: one name if all agree."""
    return subprocess.run(
        [sys.executable, "-c", ASKED],
        env=environment(kernel),
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()


def runs(kernel: str) -> bool:
    """Return whether numpy and scipy run under a kernel here, when it is asked for.

    OpenBLAS takes a kernel's name whether the processor has its instructions or not.
    """
    worked = subprocess.run(
        [sys.executable, "-c", WORK], env=environment(kernel), capture_output=True
    ).returncode
    return worked == 0 and chosen(kernel) == f"OpenBLAS {kernel}"


def wide_features() -> list[str]:
    """Return the names of numpy's instruction sets beyond AVX2 that it found here."""
    import numpy as np

    config: dict[str, Any] = np.show_config(mode="dicts")  # type: ignore[assignment]
    return [name for name in config["SIMD Extensions"].get("found", []) if name.startswith(WIDE)]


def environment(kernel: str | None, narrow: bool = False) -> dict[str, str]:
    """Return the environment for a kernel; narrow: numpy without what is beyond AVX2."""
    changed = {} if kernel is None else {"OPENBLAS_CORETYPE": kernel}
    if narrow and wide_features():
        changed["NPY_DISABLE_CPU_FEATURES"] = " ".join(wide_features())
    mine = ("OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES")
    return {name: value for name, value in os.environ.items() if name not in mine} | changed


def other() -> str | None:
    """Return a kernel that runs here and is not the one that this machine chooses by itself."""
    usual = chosen()
    return next((name for name in KERNELS if usual != f"OpenBLAS {name}" and runs(name)), None)


def main() -> int:
    """Run pytest with the command line's arguments under another kernel, numpy's AVX-512 off."""
    kernel = other()
    if kernel is None:
        print(f"no second kernel of {', '.join(KERNELS)} beside {chosen()} runs here: skipped")
        return int(bool(os.environ.get("FLEXSIM_ALL_TESTS")))
    print(f"under {kernel} instead of {chosen()}, numpy without {wide_features() or 'nothing'}")
    command = [sys.executable, "-m", "pytest", *sys.argv[1:]]
    return subprocess.run(command, env=environment(kernel, narrow=True)).returncode


if __name__ == "__main__":
    sys.exit(main())
