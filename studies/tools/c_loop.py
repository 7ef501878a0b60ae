"""The assumed modes' closed loop in C: what compiled Python is held against.

    >>> loop = compiled_c(plant, reference, filters)     # CLoop, or None without a C compiler
    >>> loop(), loop.state                               # the index (5), the state at the end

`c_loop.c`, beside this file, is compiled when it is asked for, by the system's `cc` with OPTIONS:
optimised, but with every operation rounded as it is written, neither contracted nor reordered.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flexsim.loop.control.stacking import stack
from flexsim.loop.runs import loop_of
from flexsim.loop.trajectories import Reference
from flexsim.plants.modes_plant import AssumedModesPlant

SOURCE = Path(__file__).with_name("c_loop.c")
COMPILER = "cc"
OPTIONS = ("-O3", "-ffp-contract=off", "-shared", "-fPIC")
PATIENCE = 60.0  # [s] for the compiler, which takes one

_Numbers = ctypes.POINTER(ctypes.c_double)


class _Modes(ctypes.Structure):
    """`modes` of c_loop.c."""

    _fields_ = (
        ("n", ctypes.c_long),
        *((name, ctypes.c_double) for name in "L_R reach A J I_m2 first_moment".split()),
        *((name, ctypes.c_double) for name in "F_1 F_2 r_1 r_2 step".split()),
        *((name, _Numbers) for name in "P X mass inverse_mass stiffness".split()),
        *((name, _Numbers) for name in "damping M N tip slope".split()),
    )


class _Loop(ctypes.Structure):
    """`loop` of c_loop.c."""

    _fields_ = (
        *((name, ctypes.c_long) for name in "samples substeps order".split()),
        *((name, ctypes.c_double) for name in "period L_R reach v_gain v_limit".split()),
        *((name, _Numbers) for name in "tip joint weights".split()),
    )


class CLoop:
    """A closed loop in C, called for the index (5) of its run [m2 s]; infinite where it diverged.

    Attributes:
        state: (2 m,) at the end of the last run. samples: of a run.
    """

    def __init__(
        self,
        library: ctypes.CDLL,
        plant: AssumedModesPlant,
        reference: Reference,
        filters: Sequence[Any],
    ) -> None:
        loop = loop_of(plant, reference)
        stacked = stack([filters], loop.period)
        b, a = stacked.b[0, :, 0, 0], stacked.a[0, :, 0, 0]  # (2, m+1): one section each
        sizes = {"samples": len(loop.tip), "order": b.shape[-1]}
        self.samples = sizes["samples"]
        self._kept: list[Any] = [library]  # as long as C may read them
        modes = self._structure(_Modes, plant.coefficients._asdict() | {"n": plant.modes})
        looped = self._structure(_Loop, loop._asdict() | sizes)
        self._start = plant.rest_state(reference.joint[0])
        self.state = self._start.copy()
        self._run = library.run_one
        self._run.restype = ctypes.c_double
        self._arguments = (
            ctypes.byref(modes),
            ctypes.byref(looped),
            *(self._numbers(each) for each in (b, a, self.state)),
        )

    def __call__(self) -> float:
        """Return the index of one run from rest."""
        self.state[:] = self._start
        return float(self._run(*self._arguments))

    def _numbers(self, values: Any) -> Any:
        array = np.ascontiguousarray(values, dtype=float)
        self._kept.append(array)
        return array.ctypes.data_as(_Numbers)

    def _structure(self, kind: Any, values: dict[str, Any]) -> ctypes.Structure:
        """Return a structure of C's with these values."""
        made = kind()
        for name, its in kind._fields_:
            value = values[name]
            setattr(made, name, self._numbers(value) if its is _Numbers else value)
        self._kept.append(made)
        return made


def compiled_c(
    plant: AssumedModesPlant, reference: Reference, filters: Sequence[Any]
) -> CLoop | None:
    """Return the loop of one controller, ((b1, a1), (b2, a2)), in C; None without a compiler."""
    compiler = shutil.which(COMPILER)
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "c_loop.so"
        command = [compiler, *OPTIONS, str(SOURCE), "-o", str(made), "-lm"]
        try:
            subprocess.run(command, check=True, capture_output=True, timeout=PATIENCE)
            library = ctypes.CDLL(str(made))  # stays when its file goes
        except (OSError, subprocess.SubprocessError):
            return None
    return CLoop(library, plant, reference, filters)
