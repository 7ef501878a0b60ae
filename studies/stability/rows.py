"""What `flexsim stability` finds, as rows: loops, random draws, poles beside the zero."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from studies.stability.maps import StabilityMap


@dataclass(frozen=True)
class LoopRow:
    """One loop at one pose: rates in 1/s, angles in rad.

    Attributes:
        hold: of this row: 'exact' of the exact beam, else as asked for.
        growth: under that hold, in whole multiples of 1e-6; growth_undamped: of a beam without
            damping; fastest_hz: of the pole that `growth` is of [Hz].
        stable: whether growth is no more than the slack.
        delay_margin: extra delay of both torques that is borne under exact hold [s].
        gain_margin, gain_margin_low: factors nearest to 1 of joint 1's, joint 2's or both loop
            gains that are borne, 1 if a motion grows.
        growth_exact, growth_stepped: under either hold; None for a beam that is not stepped.
        growth_simulated: None there, too, and where no law of friction has both a torque gain and
            damping.
        margins: of both joints; of a loop that is not stable they are where it would next cross
            the unit circle. poles: moduli and frequencies [rad/s] of the largest.
    """

    plant: str
    controllers: str
    theta2: float
    hold: str
    stable: bool
    growth: float
    growth_undamped: float
    fastest_hz: float
    delay_margin: float
    gain_margin: float
    gain_margin_low: float
    spectral_radius: float
    growth_exact: float
    growth_stepped: float | None
    growth_simulated: float | None
    margins: Mapping[str, float]
    poles: Mapping[str, float]

    @property
    def loop(self) -> str:
        """Plant and controllers in short."""
        return f"{self.plant.removeprefix('assumed-')}: {self.controllers}"


@dataclass(frozen=True)
class DrawsRow:
    """How many random draws hold, what each costs [s], and whether a simulation agrees.

    Low and high are the ends of Wilson's 95 % intervals of the two shares.
    """

    plant: str
    theta2: float
    draws: int
    stable_share: float
    stable_share_low: float
    stable_share_high: float
    seconds_per_draw: float
    compared: int
    agreement: float
    agreement_low: float
    agreement_high: float


@dataclass(frozen=True)
class ZeroRow:
    """A loop's pole nearest to the slowest zero between torques and errors, on the exact beam.

    Attributes:
        controllers: name. factor: of both gains [-]. growth: of the loop [1/s].
        zero_decay, zero_hz: rate at which the zero's motion decays [1/s], its frequency [Hz].
        pole_decay, pole_hz: the same of the pole.
        apart: distance of the two [1/s].
        seen: second error in the pole's motion over v/(r+L) [-]; 0 at a zero.
    """

    controllers: str
    factor: float
    growth: float
    zero_decay: float
    zero_hz: float
    pole_decay: float
    pole_hz: float
    apart: float
    seen: float


@dataclass(frozen=True, eq=False)
class StabilityResult:
    """Rows of the tables, maps; the growth called stable [1/s], mode 1's damping ratio; what runs
    of flexsim tune gave."""

    rows: list[LoopRow]
    maps: list[StabilityMap]
    draws: list[DrawsRow]
    zeros: list[ZeroRow]
    slack: float
    zeta: float
    given: list[dict[str, Any]] = field(default_factory=list)
