"""One closed-loop case to record or draw: what was asked, and how each plant moved."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from flexsim.errors import ParameterError
from flexsim.loop.friction import Friction
from flexsim.loop.motion import Motion
from flexsim.loop.trajectories import Reference
from flexsim.numerics.types import Array
from flexsim.recording.band import Band, PairBand
from flexsim.recording.traces import longest

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, eq=False)
class Case:
    """One closed-loop case: what was asked, and how each plant moved.

    Attributes:
        name: entity root and tab; letters, digits, '_', '-' and '.'.
        trajectory, controllers, setting: for titles and tables.
        motions: by the plant's name; at least one. Of two, the difference is shown.
        chain_model: the compiled MJCF whose geometry draws the plant 'chain'; without it the
            chain is drawn as other arms are.
        hardware: in words, see `flexsim.loop.hardware`.
        reference: all of it, also after a divergence; without it, as far as the longer motion.
        bands: by the plant's name, what its repeats cover; not of every plant.
        shown: by the plant's name, which of its runs the motion is.
        friction: of the joints, whose states over time are shown; without it they are not.
        merit: by the plant's name, figures of merit in words by what they are.
        pairs: how far apart the two plants are in pairs of runs, if runs were repeated.
        torque_limit: of the motors of joints 1 and 2 [N m], inf for none.

    Raises:
        ParameterError: a name that no entity path can carry, or no motion.
    """

    name: str
    trajectory: str
    controllers: str
    setting: str
    motions: Mapping[str, Motion]
    chain_model: mujoco.MjModel | None = None
    reference: Reference | None = None
    hardware: str = "ideal"
    bands: Mapping[str, Band] = field(default_factory=dict)
    shown: Mapping[str, str] = field(default_factory=dict)
    friction: Friction | None = None
    merit: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    pairs: PairBand | None = None
    torque_limit: tuple[float, float] = (math.inf, math.inf)

    def __post_init__(self) -> None:
        """Refuse what could not be recorded."""
        if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", self.name):
            raise ParameterError(
                f"case name {self.name!r} cannot be used; give letters, digits, '_', '-' and '.'"
            )
        if not self.motions:
            raise ParameterError(f"case {self.name!r} has no motion; give one plant's or both's")

    @property
    def reference_tip(self) -> tuple[Array, Array]:
        """Time (M,) [s] and tip (M, 2) [m] of as much of the reference as is known."""
        if self.reference is not None:
            return self.reference.time, self.reference.tip
        whole = longest(self.motions)
        return whole.time, whole.reference_tip
