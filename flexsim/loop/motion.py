"""One recorded motion of one plant: what figures, recordings, metrics and tables are made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexsim.numerics.types import Array


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples of one run, every column with the same number of rows K.

    A run that diverged ends at the last sample before it did, so its K is smaller than its
    reference's; `diverged` is then the time [s] of divergence, otherwise None.

    Attributes:
        plant: its name, as the command line has it, such as 'assumed-modes' or 'chain:10'.
        time: (K,) [s].
        state: (K, 2 m) generalised positions, then velocities, of the plant itself: theta1, theta2
            [rad], then the modal coordinates [m] or the hinge angles [rad].
        torque: (K, 2) torque commanded by the controllers from this sample on [N m].
        error: (K, 2) what the controllers see [rad].
        applied: (K, 2) torque of the motors, on average until the next sample, ahead of friction:
            the command as hardware delays, limits and smooths it [N m].
        measured: (K, 3) theta1, theta2 [rad] and v [m] as the controllers get them.
        sensed: (K, 4) two strains [-] as bridges read them and the rates of theta1, theta2
            [rad/s] as tachometers do, nan where there are none; None where nobody recorded it.
        joint: (K, 2) theta1, theta2 [rad].
        v: (K,) tip deflection in the hub's frame [m].
        tip: (K, 2) true tip position [m].
        modal: (K, n) modal coordinates [m]; for the chain, its shape projected on the modes.
        energy: (K,) kinetic plus elastic energy [J].
        beam: (K, P, 2) points along the deflected beam, from its clamp to its tip [m].
        reference_tip: (K, 2) [m]; reference_joint: (K, 2) [rad]; both nan where there is none.
        diverged: time of divergence [s], or None.
        link1: (K, P1, 2) points along link 1, from joint 1 to joint 2, where it bends [m]; or None.
    """

    plant: str
    time: Array
    state: Array
    torque: Array
    error: Array
    applied: Array
    measured: Array
    joint: Array
    v: Array
    tip: Array
    modal: Array
    energy: Array
    beam: Array
    reference_tip: Array
    reference_joint: Array
    diverged: float | None = None
    sensed: Array | None = None
    link1: Array | None = None

    def thinned(self, stride: int) -> Motion:
        """Return every stride-th sample, the first included."""
        return self._rows(slice(None, None, stride))

    def first(self, rows: int) -> Motion:
        """Return the first samples."""
        return self._rows(slice(rows))

    def _rows(self, chosen: slice) -> Motion:
        columns: dict[str, Any] = {
            name: value[chosen] if isinstance(value, np.ndarray) else value
            for name, value in vars(self).items()
        }
        return Motion(**columns)
