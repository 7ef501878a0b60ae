"""What a laboratory measures with: encoders behind gears, tachometers, strain bridges on the beam.

All off by default: the angles and v as they are, but for counts and noise (`.base`). A bridge
reads, at a place of the beam, the strain on its surface,

    (1 + gain) distance v''(place + shift) + offset + drift t + noise,

behind a first-order filter, at every sample; v'' is the plant's own (`flexsim.plants.curvature`).
v is made of that by an estimator (`.estimators`) that knows the nominal beam and the nominal
places, so what gain, mounting and the modes it leaves out do to v is in v. Tachometers are read
into logs; no controller has them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

from flexsim.errors import ParameterError
from flexsim.loop.hardware.parts import check_parts, part, word

KALMAN = "kalman:"
ESTIMATORS = ("exact", "two-bridges", "one-bridge", "quasi-static", KALMAN)
KALMAN_MOST = 8  # modes of the filter's model
SWITCH = ("off", "on")
GAUGES = (
    "assumed, within K. Hoffmann, An Introduction to Stress Analysis and Transducer Design using "
    "Strain Gauges, HBM 2012: gauge factors to 1 %"
)


@dataclass(frozen=True)
class Sensing:
    """Sensors beyond counts and noise on v; each field has its unit, meaning and source.

    Raises:
        ParameterError: a number out of range, an unknown estimator.
    """

    gear: tuple[float, float] = part(
        (1.0, 1.0), "-", "turns of an encoder per turn of its joint", above=True
    )
    estimator: str = word("exact", ESTIMATORS, "what makes v of the strains")
    bridges: str = word(
        "off", SWITCH, "whether bridges are read where v is exact, for drive --log measured"
    )
    bridge_places: tuple[float, float] = part(
        (0.025, 0.25),
        "m",
        "places of the bridges from the clamp, unless the robot's file has sites for them",
        low=0.0,
    )
    bridge_shift: tuple[float, float] = part(
        (0.0, 0.0),
        "m",
        "by how much farther out the bridges sit than the estimator knows",
        low=-math.inf,
    )
    bridge_distance: float = part(
        0.0005,
        "m",
        "of the gauges from the neutral axis",
        "half of the 1 mm of the steel strip, 20 mm wide, that rho and EI fit, (24), (26)",
        low=0.0,
        above=True,
    )
    bridge_gain: tuple[float, float] = part(
        (0.0, 0.0), "-", "relative error of a bridge's gain", GAUGES, low=-1.0
    )
    bridge_offset: tuple[float, float] = part(
        (0.0, 0.0), "-", "strain that a straight beam reads", low=-math.inf
    )
    bridge_drift: tuple[float, float] = part(
        (0.0, 0.0), "1/s", "rate at which the offset grows", low=-math.inf
    )
    bridge_noise: tuple[float, float] = part(
        (0.0, 0.0), "-", "rms noise of the strain read at a sample, ahead of the filter", low=0.0
    )
    bridge_filter: float = part(
        0.0, "s", "time constant of the first-order filter behind a bridge, 0 for none", low=0.0
    )
    kalman_pose: float = part(
        math.pi / 2, "rad", "theta2 that the Kalman filter's model is of", low=-math.inf
    )
    kalman_torque: tuple[float, float] = part(
        (0.1, 0.02),
        "N m",
        "rms torque at the joints that the Kalman filter does not know of, friction for one",
        low=0.0,
        above=True,
    )
    tachometers: str = word(
        "off", SWITCH, "whether the joints' rates are read, for drive --log measured"
    )
    tachometer_gain: tuple[float, float] = part(
        (0.0, 0.0), "-", "relative error of a tachometer's gain", low=-1.0
    )
    tachometer_noise: tuple[float, float] = part(
        (0.0, 0.0), "rad/s", "rms noise of a tachometer", low=0.0
    )

    def __post_init__(self) -> None:
        check_parts(self)
        _ = self.kalman_modes

    @property
    def kalman_modes(self) -> int:
        """Modes of the Kalman filter's model, 0 for another estimator."""
        if not self.estimator.startswith(KALMAN):
            return 0
        text = self.estimator.removeprefix(KALMAN)
        modes = int(text) if text.isascii() and text.isdigit() else 0
        if not 1 <= modes <= KALMAN_MOST:
            raise ParameterError(
                f"hardware estimator is {self.estimator}; give {KALMAN}n with 1 to {KALMAN_MOST} "
                "modes"
            )
        return modes

    @property
    def estimated(self) -> bool:
        """Whether v is made of strains."""
        return self.estimator != "exact"

    @property
    def strained(self) -> bool:
        """Whether bridges are read."""
        return self.estimated or self.bridges == "on"

    @property
    def quiet(self) -> Self:
        """The same without noise, offset and drift: what is linear of it."""
        none = (0.0, 0.0)
        return replace(
            self, bridge_noise=none, bridge_offset=none, bridge_drift=none, tachometer_noise=none
        )
