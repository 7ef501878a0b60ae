"""What a laboratory measures with: encoders behind gears.

All off by default: the angles and v as they are, but for counts and noise (`.base`).
"""

from __future__ import annotations

from dataclasses import dataclass

from flexsim.loop.hardware.parts import check_parts, part


@dataclass(frozen=True)
class Sensing:
    """Sensors beyond counts and noise on v; each field has its unit, meaning and source.

    Raises:
        ParameterError: a number out of range.
    """

    gear: tuple[float, float] = part(
        (1.0, 1.0), "-", "turns of an encoder per turn of its joint", above=True
    )

    def __post_init__(self) -> None:
        check_parts(self)
