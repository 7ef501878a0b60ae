"""MuJoCo's C functions, callable from compiled code, and its warnings, kept quiet meanwhile.

A compiled loop holds a plant's state in its own array: `mj_setState` copies it in, `mj_step`
advances it, `mj_getState` copies it out, the solver's warm start included. So an `mjData` is only
a workspace, one per thread, and no result depends on which thread ran what.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import llvmlite.binding
import mujoco
from numba import types

STATE = int(mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_QVEL)
INPUTS = int(mujoco.mjtState.mjSTATE_WARMSTART | mujoco.mjtState.mjSTATE_CTRL)


def _library() -> ctypes.CDLL:
    """Return the library that the mujoco package itself uses."""
    folder = Path(mujoco.__file__).parent
    names = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    return ctypes.CDLL(str(next(path for name in names for path in folder.glob(name))))


_LIBRARY = _library()
_WARNING_HANDLER = ctypes.c_void_p.in_dll(_LIBRARY, "mju_user_warning")


def _function(name: str, *arguments: types.Type) -> Any:
    """Return a C function of MuJoCo's by name; pointers travel as integers."""
    address = ctypes.cast(getattr(_LIBRARY, name), ctypes.c_void_p).value
    llvmlite.binding.add_symbol(name, address)
    return types.ExternalFunction(name, types.void(*arguments))


mj_step = _function("mj_step", types.intp, types.intp)
mj_setState = _function("mj_setState", types.intp, types.intp, types.intp, types.int32)
mj_getState = _function("mj_getState", types.intp, types.intp, types.intp, types.int32)


@contextmanager
def quiet_warnings() -> Iterator[None]:
    """Keep MuJoCo's warnings off the terminal and out of log files while the block runs.

    The loops find divergence themselves. The handler is `mj_version`, C code without effect,
    since threads that do not hold Python's lock call it.
    """
    before = _WARNING_HANDLER.value
    _WARNING_HANDLER.value = ctypes.cast(_LIBRARY.mj_version, ctypes.c_void_p).value
    try:
        yield
    finally:
        _WARNING_HANDLER.value = before
