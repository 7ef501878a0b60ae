"""What a design can be turned by: named numbers with a unit and a range.

KNOBS = (Knob("bandwidth_1", "rad/s", 10.0, 200.0, True),)
"""

from typing import NamedTuple


class Knob(NamedTuple):
    """One number of a design: from low to high, drawn by its logarithm where `log` says so."""

    name: str
    unit: str
    low: float
    high: float
    log: bool
