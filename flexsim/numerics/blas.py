"""BLAS on one thread: at the sizes of a robot arm its other threads only spin.

>>> one_thread()      # before numpy is loaded; afterwards it is too late

The threads that run populations of controllers are not affected.
"""

from __future__ import annotations

import os

THREADS = (
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def one_thread() -> None:
    """Tell every BLAS that numpy or scipy may load later, here or in a child, to use one thread."""
    for name in THREADS:
        os.environ[name] = "1"
